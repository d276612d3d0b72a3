//! Requests and answers of the page: a line of JSON, then bytes.

use compiler::machine_file::PRESETS;
use compiler::pipeline::Step;
use serde::Deserialize;
use serde_json::{Value, json};

use crate::emulated::{EmulateJob, Emulated};
use crate::job::Job;
use crate::output::{Kind, formats};
use crate::problem::{About, Problem, Problems};
use crate::sending::{Event, SendJob, Sending, protocols};
use crate::session::{Reply, Studio};

/// A request.
#[derive(Debug, Deserialize)]
#[serde(tag = "method", rename_all = "lowercase", deny_unknown_fields)]
enum Request {
    /// The presets with their files, and the formats.
    Catalogue,
    /// Opens the drawing's file whose bytes follow.
    Open {
        /// Its name.
        name: String,
        /// Whether it is laid over those that are open.
        #[serde(default)]
        adds: bool,
    },
    /// The drawing as the job reads it.
    Drawing {
        /// The job.
        job: Job,
    },
    /// The job's machine without a drawing.
    Machine {
        /// The job.
        job: Job,
    },
    /// The plan of the job.
    Plan {
        /// The job.
        job: Job,
    },
    /// A file.
    Output {
        /// The job.
        job: Job,
        /// `format`, `picture` or `page`.
        kind: String,
        /// The format or picture.
        name: String,
    },
    /// The command lines of outputs.
    Commands {
        /// The job.
        job: Job,
        /// Kinds and names, as in `Output`.
        outputs: Vec<(String, String)>,
    },
    /// Begins to send the file whose bytes follow.
    Send {
        /// How.
        job: SendJob,
    },
    /// The page's end of the wire: what was received follows; the answer has what is to be written.
    Wire {
        /// The page's clock, microseconds.
        now_us: f64,
        /// What happened.
        #[serde(default)]
        event: Event,
        /// Whether everything written before has left.
        is_clear: bool,
    },
    /// Switches an emulated machine on.
    Emulate {
        /// Which.
        job: EmulateJob,
    },
    /// The emulated machine's end of the wire: what it receives follows; the answer has its answers.
    Device {
        /// Its clock, microseconds.
        now_us: f64,
        /// Whether the wire was unplugged before.
        #[serde(default)]
        is_unplugged: bool,
    },
    /// What the emulated machine has drawn.
    Ink,
}

impl Studio {
    /// Answers a request: a line of JSON that names the method, then the bytes of a file where the method
    /// takes one. The answer has the same form; its object has `problems` where the request failed.
    pub fn call(&mut self, request: &[u8], progress: &dyn Fn(Step)) -> Vec<u8> {
        let (line, bytes) = split(request);
        let reply = serde_json::from_slice::<Request>(line)
            .map_err(|error| Problem::new(About::Option, error.to_string()).into())
            .and_then(|request| self.answer(request, bytes, progress));
        let Reply { json, columns } = reply.unwrap_or_else(|problems: Problems| Reply {
            json: json!({ "problems": problems.0 }),
            columns: Vec::new(),
        });
        let mut answer = json.to_string().into_bytes();
        answer.push(b'\n');
        answer.extend(columns);
        answer
    }

    fn answer(&mut self, request: Request, bytes: &[u8], progress: &dyn Fn(Step)) -> Result<Reply, Problems> {
        let plain = |json: Value| Reply { json, columns: Vec::new() };
        match request {
            Request::Catalogue => Ok(plain(catalogue())),
            Request::Open { name, adds } => {
                if adds {
                    self.add(&name, bytes);
                } else {
                    self.open(&name, bytes);
                }
                Ok(plain(json!({})))
            }
            Request::Drawing { job } => self.drawing(&job),
            Request::Machine { job } => self.machine(&job),
            Request::Plan { job } => self.plan(&job, progress),
            Request::Output { job, kind, name } => {
                let output = self.output(&job, kind_of(&kind, &name)?, progress)?;
                let json = json!({ "name": output.name, "words": output.words, "losses": output.losses });
                Ok(Reply { json, columns: output.bytes })
            }
            Request::Commands { job, outputs } => {
                let command = |(kind, name): &(String, String)| {
                    let (file, words) = self.command(&job, kind_of(kind, name)?);
                    Ok(json!({ "name": file, "words": words }))
                };
                let commands = outputs.iter().map(command).collect::<Result<Vec<Value>, Problems>>()?;
                Ok(plain(json!({ "commands": commands })))
            }
            other => self.answer_wire(other, bytes),
        }
    }
}

impl Studio {
    /// Requests of the two ends of a wire.
    fn answer_wire(&mut self, request: Request, bytes: &[u8]) -> Result<Reply, Problems> {
        let plain = |json: Value| Reply { json, columns: Vec::new() };
        let none = || Problem::new(About::Option, "nothing is being sent");
        match request {
            Request::Send { job } => {
                self.sending = Some(Sending::new(&job, bytes)?);
                Ok(plain(json!({})))
            }
            Request::Wire { now_us, event, is_clear } => {
                let sending = self.sending.as_mut().ok_or_else(none)?;
                let step = sending.step(now_us.max(0.0) as u64, event, bytes, is_clear);
                Ok(Reply {
                    json: json!({ "wake_us": step.wake_us, "state": step.state }),
                    columns: step.bytes,
                })
            }
            Request::Emulate { job } => {
                self.emulated = Some(Emulated::new(&job)?);
                Ok(plain(json!({})))
            }
            Request::Device { now_us, is_unplugged } => {
                let emulated = self.emulated.as_mut().ok_or_else(none)?;
                if is_unplugged {
                    emulated.unplug();
                }
                let (json, columns) = emulated.step(now_us.max(0.0) as u64, bytes);
                Ok(Reply { json, columns })
            }
            Request::Ink => {
                let emulated = self.emulated.as_ref().ok_or_else(none)?;
                Ok(Reply { json: json!({}), columns: emulated.ink().into_bytes() })
            }
            _ => Err(none().into()),
        }
    }
}

/// The line of JSON and what follows it.
fn split(request: &[u8]) -> (&[u8], &[u8]) {
    let end = request.iter().position(|byte| *byte == b'\n').unwrap_or(request.len());
    (&request[..end], request.get(end + 1..).unwrap_or_default())
}

fn catalogue() -> Value {
    let presets = PRESETS
        .iter()
        .map(|preset| json!({ "name": preset.name, "about": preset.about, "toml": preset.toml }));
    json!({
        "program": concat!("plotplan ", env!("CARGO_PKG_VERSION")),
        "presets": presets.collect::<Vec<_>>(),
        "formats": formats(),
        "protocols": protocols(),
    })
}

fn kind_of<'a>(kind: &str, name: &'a str) -> Result<Kind<'a>, Problems> {
    match kind {
        "format" => Ok(Kind::Format(name)),
        "picture" => Ok(Kind::Picture(name)),
        "page" => Ok(Kind::Page),
        other => Err(Problem::new(About::Option, format!("no output is called {other}")).into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn called(studio: &mut Studio, request: &str) -> (Value, Vec<u8>) {
        let answer = studio.call(request.as_bytes(), &|_| {});
        let (line, bytes) = split(&answer);
        (serde_json::from_slice(line).unwrap(), bytes.to_vec())
    }

    #[test]
    fn requests_are_answered() {
        let mut studio = Studio::default();
        let (catalogue, _) = called(&mut studio, r#"{"method": "catalogue"}"#);
        assert_eq!(catalogue["presets"][0]["name"], "coaxial");
        called(&mut studio, "{\"method\": \"open\", \"name\": \"a.hpgl\"}\nIN;SP1;PU400,400;PD1200,400;PU;");
        let job = r#"{"machine": {"name": "corexy"}}"#;
        let (drawing, columns) = called(&mut studio, &format!(r#"{{"method": "drawing", "job": {job}}}"#));
        assert_eq!(drawing["bounds_mm"], json!([10.0, 10.0, 30.0, 10.0]));
        assert!(!columns.is_empty());
        let (plan, columns) = called(&mut studio, &format!(r#"{{"method": "plan", "job": {job}}}"#));
        assert_eq!(plan["problems"], json!([]));
        assert_eq!(plan["meta"]["certificate"]["holds"], true);
        assert!(columns.len() > 100);
        let request = format!(r#"{{"method": "output", "job": {job}, "kind": "format", "name": "ticks"}}"#);
        let (output, bytes) = called(&mut studio, &request);
        assert_eq!(output["name"], "a.ticks");
        assert!(bytes.starts_with(b"; plotplan: 1\n"));
    }

    #[test]
    fn wrong_requests_have_problems() {
        let mut studio = Studio::default();
        for request in ["", "{}", r#"{"method": "plan", "job": {"options": {"color": "red"}}}"#] {
            let (answer, _) = called(&mut studio, request);
            assert_eq!(answer["problems"].as_array().map(Vec::len), Some(1), "{request}");
        }
    }

    #[test]
    fn drawing_out_of_reach_names_a_remedy_and_shows_where() {
        let mut studio = Studio::default();
        let far = "{\"method\": \"open\", \"name\": \"a.hpgl\"}\nIN;SP1;PU0,0;PD20000,0;PU;";
        called(&mut studio, far);
        let (plan, _) = called(&mut studio, r#"{"method": "plan", "job": {"machine": {"name": "corexy"}}}"#);
        assert_eq!(plan["problems"][0]["about"], "plan");
        assert_eq!(plan["problems"][0]["help"], "Fit scales it to the sheet.");
        assert!(plan["beyond_mm"][0].as_array().is_some_and(|line| line.len() >= 4));
        assert_eq!(plan["meta"]["machine"]["name"], "corexy");
    }
}
