//! Outputs: the files that `plotplan convert` and `plotplan preview` write, and their command lines.

use backends::{Backend, EncodeOptions, PlanSource, RowIter, WriteError};
use compiler::pipeline::{self, Step, Target};
use compiler::scene;
use compiler::settings::Settings;
use serde::Serialize;

use crate::job::{For, Job};
use crate::problem::{About, Problem, Problems};
use crate::session::{Planned, Studio, refusal};

/// A PNG picture's longer side, pixels, as in the program.
const PIXELS: u32 = 1600;

/// What is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind<'a> {
    /// A format of `plotplan convert`, by its name.
    Format(&'a str),
    /// A picture of the placed drawing: `svg` or `png`.
    Picture(&'a str),
    /// The animated preview.
    Page,
}

/// A file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Output {
    /// Its name.
    pub name: String,
    /// Its bytes.
    pub bytes: Vec<u8>,
    /// The command with which the program writes the same, word by word.
    pub words: Vec<String>,
    /// What the format cannot carry.
    pub losses: Vec<String>,
}

/// A format of outputs.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct FormatInfo {
    /// Its name on the command line.
    pub name: &'static str,
    /// What it is.
    pub about: &'static str,
}

/// All formats of `convert --format`, in the order of its help.
pub fn formats() -> Vec<FormatInfo> {
    let backends = backends::ALL.iter();
    let mut all: Vec<FormatInfo> = backends
        .filter_map(|backend| Some(FormatInfo { name: backend.name(), about: backend.format_help()? }))
        .collect();
    let format = |name, about| FormatInfo { name, about };
    all.splice(
        1..1,
        [
            format("csv", "A table of ticks against time"),
            format("json", "A plan document with machine, settings and certificate"),
        ],
    );
    all.push(format("hpgl", "The drawing as understood, as clean HP-GL"));
    all.push(format("svg", "The drawing as understood, as SVG in mm"));
    all
}

impl Kind<'_> {
    fn purpose(self) -> For {
        match self {
            Self::Format("hpgl" | "svg") => For::Drawing,
            Self::Format(_) | Self::Page => For::Plan,
            Self::Picture(_) => For::Picture,
        }
    }

    fn extension(self) -> &'static str {
        match self {
            Self::Format("ticks") => "ticks",
            Self::Format("csv") => "csv",
            Self::Format("json") => "json",
            Self::Format("hpgl") => "hpgl",
            Self::Format("svg") | Self::Picture("svg") => "svg",
            Self::Format(name) if name.starts_with("gcode") => "gcode",
            Self::Format(_) => "txt",
            Self::Picture(_) => "png",
            Self::Page => "html",
        }
    }
}

impl Studio {
    /// The name of an output, and the command with which the program writes the same.
    pub fn command(&self, job: &Job, kind: Kind<'_>) -> (String, Vec<String>) {
        let first = self.names().next().unwrap_or_default();
        let stem = first.rsplit_once('.').map_or(first, |(stem, _)| stem);
        let extension = kind.extension();
        let mut name = format!("{stem}.{extension}");
        if self.names().any(|input| input == name) {
            // An output does not replace an input.
            name = format!("{stem}-out.{extension}");
        }
        let command = if matches!(kind, Kind::Format(_)) { "convert" } else { "preview" };
        let mut words = vec!["plotplan".to_owned(), command.to_owned()];
        words.extend(self.names().map(str::to_owned));
        words.push(format!("--machine={}", job.machine.word()));
        words.extend(self.resolved(job, kind).options.words(kind.purpose()));
        if let Kind::Format(format) = kind
            && format != extension
        {
            words.push(format!("--format={format}"));
        }
        words.push(format!("--output={name}"));
        (name, words)
    }

    /// The job for an output: where no plan is made, the best place is that of the last plan.
    fn resolved(&self, job: &Job, kind: Kind<'_>) -> Job {
        let job = Job { draft: false, ..self.settled(job) };
        if !job.options.is_best_place() || kind.purpose() == For::Plan {
            return job;
        }
        let best = self.planned_before(&job).and_then(|planned| planned.summary.best_place.as_ref());
        let options = best.map(|best| job.options.found(best));
        Job { options: options.unwrap_or_else(|| job.options.clone()), ..job }
    }

    /// Writes an output.
    ///
    /// # Errors
    /// Why the drawing cannot be planned or placed; what the format cannot represent.
    pub fn output(&mut self, job: &Job, kind: Kind<'_>, progress: &dyn Fn(Step)) -> Result<Output, Problems> {
        let asked = job;
        let job = &Job { draft: false, ..self.settled(job) };
        if job.options.is_best_place() && kind.purpose() != For::Plan {
            self.planned(job, progress)?;
        }
        let job = &self.resolved(job, kind);
        let mut losses = Vec::new();
        let mut bytes = Vec::new();
        match kind {
            Kind::Format("hpgl" | "svg") => bytes = self.arranged(job, kind)?,
            Kind::Picture(form) => bytes = self.picture(job, form)?,
            Kind::Page => {
                let planned = self.planned(job, progress)?;
                bytes = self.view_of(&planned).html().into_bytes();
            }
            Kind::Format(name) => {
                let planned = self.planned(job, progress)?;
                match name {
                    "csv" => {
                        let rows = planned.rows.iter().copied();
                        plan::file::csv::write(&planned.header, rows, &mut bytes).map_err(unwritten)?;
                    }
                    "json" => self.document(job, &planned, &mut bytes)?,
                    _ => {
                        let backend = backends::find(name).filter(|backend| backend.format_help().is_some());
                        let backend = backend.ok_or_else(|| {
                            Problem::new(About::Option, format!("no format is called {name}"))
                        })?;
                        losses = encode(backend, &planned, &mut bytes)?;
                    }
                }
            }
        }
        let (name, words) = self.command(asked, kind);
        Ok(Output { name, bytes, words, losses })
    }

    /// The placed drawing in a format of drawings.
    fn arranged(&mut self, job: &Job, kind: Kind<'_>) -> Result<Vec<u8>, Problems> {
        let (_, machine) = job.read_machine()?;
        let (page, _) = self.page(job)?;
        self.refuse_unusable(&page)?;
        let target = Target::Machine(&machine);
        let order = job.options.order(false)?;
        let arranged = pipeline::arrange(&page.drawing, target, &job.options.placement()?, None, &order);
        let request = job.request(&page, &machine)?;
        let arranged = arranged.map_err(|error| refusal(&page.drawing, &machine, &request, &error))?;
        if kind == Kind::Format("hpgl") {
            return Ok(hpgl::emit(&arranged.drawing, &hpgl::EmitOptions::default()));
        }
        let sheet = machine.sheet().with_origin((0.0, 0.0));
        let style = picture::svg::Style { page: Some(sheet), colors: scene::pen_colors(&page) };
        let mut bytes = Vec::new();
        picture::svg::write(&arranged.drawing, &style, &mut bytes).map_err(unwritten)?;
        Ok(bytes)
    }

    /// A picture of the placed drawing.
    fn picture(&mut self, job: &Job, form: &str) -> Result<Vec<u8>, Problems> {
        let (_, machine) = job.read_machine()?;
        let (page, _) = self.page(job)?;
        self.refuse_unusable(&page)?;
        let request = job.request(&page, &machine)?;
        let placement = planner::place(&machine, &page.drawing, &request.placement)
            .map_err(|error| refusal(&page.drawing, &machine, &request, &error))?;
        let mut drawing = page.drawing.clone();
        drawing.transform(placement);
        let title = format!("{} on {}", self.name(), machine.name());
        let scene = scene::of_placed(&title, &drawing, &machine, scene::pen_colors(&page));
        if form == "png" {
            return picture::png::encode(&scene, PIXELS).map_err(unwritten);
        }
        let mut bytes = Vec::new();
        picture::scene::svg(&scene, &mut bytes).map_err(unwritten)?;
        Ok(bytes)
    }

    /// The plan document.
    fn document(&self, job: &Job, planned: &Planned, out: &mut Vec<u8>) -> Result<(), Problems> {
        let command_line = job.options.words(For::Plan);
        let (reading, layout) = (job.options.reading()?, job.options.layout()?);
        let settings = Settings::of(&planned.request, planned.page_number, &reading, &layout, command_line);
        let document = plan::file::json::Document {
            source: plan::file::json::Source { name: self.name(), sha256: self.sha256() },
            machine: serde_json::to_value(&planned.file).map_err(unwritten)?,
            settings: serde_json::to_value(&settings).map_err(unwritten)?,
            summary: serde_json::to_value(&planned.summary).map_err(unwritten)?,
            certificate: serde_json::to_value(&planned.certificate).map_err(unwritten)?,
        };
        plan::file::json::write(&document, &planned.header, || planned.rows.iter().copied(), out)
            .map_err(unwritten)
    }
}

/// Writes a plan in a firmware's format; returns what the format cannot carry.
fn encode(backend: &dyn Backend, planned: &Planned, out: &mut Vec<u8>) -> Result<Vec<String>, Problems> {
    backend.check(&planned.machine).map_err(unwritten)?;
    let pens: Vec<u16> = planned.drawn.pens().into_iter().map(|pen| pen.0).collect();
    let losses =
        backend.losses(&planned.header, &pens).into_iter().chain(backend.file_caveat(&planned.machine));
    let losses = losses.map(|loss| loss.to_string()).collect();
    let rows =
        || -> RowIter<'_> { Box::new(planned.rows.iter().copied().zip(planned.exact.iter().copied())) };
    let source =
        PlanSource::new(&planned.header, &rows).on_machine(&planned.machine).of_drawing(&planned.drawn);
    let encode = EncodeOptions { spare_mm: planned.spare_mm, ..EncodeOptions::default() };
    backend.write(&source, &encode, out).map_err(|error: WriteError| unwritten(error))?;
    Ok(losses)
}

/// An output that cannot be written.
fn unwritten(error: impl std::fmt::Display) -> Problems {
    Problem::new(About::Plan, format!("this format cannot represent the plan: {error}")).into()
}
