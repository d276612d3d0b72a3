//! `cargo xtask bound`: the fastest motion within the tolerance for the strokes of
//! `test_support::band`, by direct transcription with casadi and ipopt (`optimum.py`). The table in
//! `crates/planner/tests/optima.tsv` is what the planner's tests compare plans with.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::io::{BufRead as _, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use anyhow::{Context as _, Result};
use drawing::{Drawing, Pen, Point, Span, Stroke};
use kinematics::{Machine, MotorPos};
use planner::{Settings, plan};
use serde_json::{Value, json};
use test_support::band::{Setup, TOLERANCE_MM, setups, strokes};
use test_support::machines::with_jerk;

/// Times in which the motors build up their acceleration, ms; 0 without a jerk limit.
const BUILD_UPS_MS: [u32; 3] = [0, 20, 100];

const TABLE: &str = "crates/planner/tests/optima.tsv";
const HEADER: &str = "machine\tstroke\tbuild_up_ms\tseconds\tdistance_mm\tstatus\tnodes";
const SOLVER: &str = include_str!("optimum.py");
const CASADI: &str = "casadi==3.8.2";

/// Machine, stroke and build-up.
type Key = (String, String, String);

/// Computes the optima that are missing in the table, or all of them; true if the solver succeeded for each.
pub(crate) fn run(python: &str, all: bool) -> Result<bool> {
    let table = crate::top().join(TABLE);
    let mut rows = if all { BTreeMap::new() } else { read(&table)? };
    let missing = problems().into_iter().filter(|p| !rows.contains_key(&key_of(&p.json)));
    let missing: Vec<Value> = missing.map(Problem::with_plan).collect::<Result<_>>()?;
    println!("{} optima are in {TABLE}, {} are missing", rows.len(), missing.len());
    if !missing.is_empty() {
        let python = environment(python)?;
        let folder = tempfile::tempdir()?;
        let (script, input) = (folder.path().join("optimum.py"), folder.path().join("problems.json"));
        std::fs::write(&script, SOLVER)?;
        std::fs::write(&input, Value::Array(missing).to_string())?;
        let mut solver = Command::new(python).arg(&script).arg(&input).stdout(Stdio::piped()).spawn()?;
        let lines = BufReader::new(solver.stdout.take().context("the solver has no output")?);
        for line in lines.lines() {
            let line = line?;
            println!("{line}");
            rows.insert(key(&line)?, line);
            // After each of them: the whole table takes half an hour.
            write(&table, &rows)?;
        }
        anyhow::ensure!(solver.wait()?.success(), "the solver failed");
    }
    let solved = |line: &String| line.contains("Solve_Succeeded") || line.contains("Acceptable");
    for line in rows.values().filter(|line| !solved(line)) {
        println!("not solved: {line}");
    }
    Ok(rows.values().all(solved))
}

/// A stroke on a machine.
struct Problem {
    machine: Machine,
    points: Vec<Point>,
    json: Value,
}

impl Problem {
    /// For the solver, with our plan as a start: the pen's place every millisecond.
    fn with_plan(mut self) -> Result<Value> {
        let stroke = Stroke::polyline(Pen(1), self.points, Span::default()).context("a stroke of points")?;
        let settings = Settings::new(TOLERANCE_MM, 1000);
        let trajectory = plan(&self.machine, Drawing::from(vec![stroke]), &settings)?;
        let rows = trajectory.rows().filter(|row| row.row.pen != 0);
        let places =
            rows.map(|row| self.machine.forward_from_motors(&MotorPos::new(row.exact[0], row.exact[1])));
        let places: Vec<[f64; 2]> = places.map(|p| [p.x, p.y]).collect();
        self.json["plan_mm"] = json!(places);
        Ok(self.json)
    }
}

fn problems() -> Vec<Problem> {
    let mut problems = Vec::new();
    for Setup { name: machine, machine: parts, origin } in setups() {
        for (stroke, points) in strokes() {
            let points: Vec<Point> =
                points.iter().map(|(x, y)| Point::new(origin.x + x, origin.y + y)).collect();
            let places: Vec<[f64; 2]> = points.iter().map(|p| [p.x, p.y]).collect();
            for build_up in BUILD_UPS_MS {
                let json = json!({
                    "machine": describe(machine, &parts), "stroke": stroke, "build_up_ms": build_up,
                    "tolerance_mm": TOLERANCE_MM, "points_mm": places,
                });
                let machine = match build_up {
                    0 => parts.clone(),
                    ms => with_jerk(&parts, 1e-3 * f64::from(ms)),
                };
                problems.push(Problem { machine, points: points.clone(), json });
            }
        }
    }
    problems
}

/// The machine as the solver needs it: limits in units of its joints.
fn describe(name: &str, machine: &Machine) -> Value {
    let parts = machine.parts();
    let mechanism = machine.mechanism();
    let links = (!mechanism.is_linear()).then(|| {
        // At (0, 0) both links of an arm point along x; the parts of that point are their lengths.
        let reach = |q: [f64; 2]| mechanism.forward(&kinematics::JointPos::new(q[0], q[1]));
        let (same, opposite) = (reach([0.0, 0.0]).x, reach([0.0, std::f64::consts::PI]).x);
        [0.5 * (same + opposite), 0.5 * (same - opposite)]
    });
    let limit = |of: fn(&kinematics::Motor) -> f64| {
        machine.motors().each_ref().map(|motor| of(motor) / motor.ticks_per_unit.abs())
    };
    json!({
        "name": name, "links_mm": links, "elbow": -1, "coupling": parts.coupling,
        "speeds": limit(|motor| motor.max_speed_ticks_s),
        "accelerations": limit(|motor| motor.max_acceleration_ticks_s2),
        "pen_mm_s": machine.pen().max_speed_mm_s,
    })
}

fn key_of(problem: &Value) -> Key {
    let text = |value: &Value| value.as_str().map_or_else(|| value.to_string(), str::to_owned);
    (text(&problem["machine"]["name"]), text(&problem["stroke"]), text(&problem["build_up_ms"]))
}

fn key(line: &str) -> Result<Key> {
    let mut fields = line.split('\t').map(str::to_owned);
    let mut next = || fields.next().with_context(|| format!("a row with too few fields: {line}"));
    Ok((next()?, next()?, next()?))
}

fn read(table: &Path) -> Result<BTreeMap<Key, String>> {
    let Ok(text) = std::fs::read_to_string(table) else { return Ok(BTreeMap::new()) };
    text.lines().skip(1).map(|line| Ok((key(line)?, line.to_owned()))).collect()
}

/// In the order of the problems.
fn write(table: &Path, rows: &BTreeMap<Key, String>) -> Result<()> {
    let mut text = format!("{HEADER}\n");
    for row in problems().iter().filter_map(|problem| rows.get(&key_of(&problem.json))) {
        writeln!(text, "{row}")?;
    }
    Ok(std::fs::write(table, text)?)
}

/// A Python that has casadi: a virtual environment in the target folder.
fn environment(python: &str) -> Result<PathBuf> {
    let folder = crate::top().join("target/bound");
    let own = folder.join("bin/python");
    if !own.exists() {
        let made =
            Command::new(python).args(["-m", "venv"]).arg(&folder).status().context("python -m venv")?;
        anyhow::ensure!(made.success(), "`{python} -m venv` failed");
    }
    let installed = Command::new(&own).args(["-m", "pip", "install", "--quiet", CASADI, "numpy"]).status()?;
    anyhow::ensure!(installed.success(), "{CASADI} cannot be installed");
    Ok(own)
}
