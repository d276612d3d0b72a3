//! Plans for the viewer: what `viewer::page` shows, from a plan, its machine and its drawing.

mod motion;
mod scenes;
mod trace;

use std::collections::{BTreeMap, BTreeSet};

use drawing::{Affine, Drawing, Pen, Point};
use kinematics::{Anchor, JointAffine, JointKind, Machine, reach_outlines};
use plan::{Header, Row};
use serde_json::{Value, json};
use simulation::Sample;
use viewer::{Column, Columns};

pub use self::scenes::ColorBy;
pub(crate) use self::scenes::label;
use crate::import::PenSettings;
use crate::report::simulation::SimulationReport;
use crate::report::{CertificateReport, Finding, Summary};

/// Files of together more bytes are not part of the page.
const MOST_SOURCE: usize = 16 << 20;
/// Steps of the distance from the drawing, as a share of the tolerance.
const DEVIATION_STEPS: f64 = 40.0;
/// Positions are rounded so that the acceleration, their second difference, is off by less than
/// this share of its limit; likewise the jerk by twenty times as much.
const ACCELERATION_ERROR: f64 = 0.005;
const JERK_ERROR: f64 = 0.1;
/// Bits of a tick at most.
const MOST_BITS: i32 = 14;
/// Bits of a tick of predicted positions.
const PREDICTED_BITS: i32 = 4;
/// Rows of a prediction at most: longer ones are thinned.
const MOST_PREDICTED: usize = 400_000;

/// What the viewer shows. Positions are in machine mm.
#[derive(Clone, Debug)]
pub struct View<'a> {
    /// What is drawn.
    pub title: String,
    /// The machine.
    pub machine: &'a Machine,
    /// The plan's header.
    pub header: &'a Header,
    /// The plan's rows.
    pub rows: &'a [Row],
    /// Exact positions of the motors at the rows, ticks; without them speeds are means over several
    /// rows.
    pub exact: Option<&'a [[f64; 2]]>,
    /// The drawing that the plan was made from.
    pub drawing: Option<DrawingView<'a>>,
    /// Tolerance of the plan, mm.
    pub tolerance_mm: f64,
    /// The plan's summary.
    pub summary: Option<Summary>,
    /// The plan's certificate.
    pub certificate: Option<CertificateReport>,
    /// Messages about the files, and warnings.
    pub findings: Vec<Finding>,
    /// What motors and loop are predicted to do.
    pub prediction: Option<Prediction<'a>>,
}

/// The drawing of a plan and its files.
#[derive(Clone, Debug)]
pub struct DrawingView<'a> {
    /// In the order drawn.
    pub drawn: &'a Drawing,
    /// In the file's order, with each stroke's own bytes.
    pub placed: &'a Drawing,
    /// What the file states about its pens.
    pub pens: &'a BTreeMap<Pen, PenSettings>,
    /// Drawing speeds of single pens, mm/s, where the plan keeps them.
    pub pen_speeds: &'a [(Pen, f64)],
    /// Its files, in the order of the bytes that strokes name.
    pub files: Vec<SourceFile<'a>>,
}

/// A file of a drawing.
#[derive(Clone, Copy, Debug)]
pub struct SourceFile<'a> {
    /// Its name, to be shown.
    pub name: &'a str,
    /// Its path, as findings name it.
    pub path: &'a str,
    /// Its bytes.
    pub bytes: &'a [u8],
}

/// The result of a simulation.
#[derive(Clone, Debug)]
pub struct Prediction<'a> {
    /// The state of the machine every 2 ms.
    pub samples: &'a [Sample],
    /// What the simulation found, in sentences.
    pub sentences: Vec<String>,
}

impl<'a> Prediction<'a> {
    /// The prediction of a simulation with these samples.
    pub fn of(report: &SimulationReport, samples: &'a [Sample]) -> Self {
        let ink = &report.ink;
        let distances = |what: &str, [max, p99, rms]: [f64; 3]| {
            format!("{what}: at most {max:.3} mm, 99 % within {p99:.3} mm, {rms:.3} mm RMS.")
        };
        let mut sentences = vec![
            distances("Predicted ink to drawing", [ink.stray_max_mm, ink.stray_p99_mm, ink.stray_rms_mm]),
            distances("Drawing to predicted ink", [ink.missed_max_mm, ink.missed_p99_mm, ink.missed_rms_mm]),
        ];
        for motor in report.motors.iter().filter(|motor| motor.stable == Some(false)) {
            sentences.push(format!("The loop of motor {} is unstable.", motor.name));
        }
        Self { samples, sentences }
    }
}

impl View<'_> {
    /// The view as one HTML file.
    pub fn html(&self) -> String {
        let (meta, columns) = self.data();
        let title = format!("{} on {}", self.title, self.machine.name());
        viewer::page(&title, &meta.to_string(), &columns)
    }

    /// The view as the data of the viewer: what `js/viewer.js` reads.
    pub fn data(&self) -> (Value, Columns) {
        self.data_into(Columns::default())
    }

    /// The same, in these columns.
    pub fn data_into(&self, columns: Columns) -> (Value, Columns) {
        self.data_with(&machine(self.machine), columns)
    }

    /// The same, with what [`machine`] said of this machine before.
    pub fn data_with(&self, machine: &Value, mut columns: Columns) -> (Value, Columns) {
        let units = self.rows_into(&mut columns);
        let traced = self
            .drawing
            .as_ref()
            .and_then(|drawing| trace::trace(self.rows, self.machine, drawing.drawn, drawing.placed));
        let deviation_unit_mm = self.tolerance_mm.max(1e-6) / DEVIATION_STEPS;
        let is_pieced =
            traced.is_some() && self.drawing.as_ref().is_some_and(|drawing| !drawing.files.is_empty());
        if let Some(traced) = &traced {
            let steps = |mm: &f64| (mm / deviation_unit_mm).round() as i64;
            columns.numbers("deviation", &traced.deviation_mm.iter().map(steps).collect::<Vec<_>>());
        }
        if let Some(traced) = traced.as_ref().filter(|_| is_pieced) {
            let of = |number: fn(&trace::Piece) -> usize| {
                traced.pieces.iter().map(|piece| number(piece) as i64).collect::<Vec<_>>()
            };
            columns.numbers("piece_row", &of(|piece| piece.row));
            columns.numbers("piece_start", &of(|piece| piece.source.start));
            columns.numbers("piece_length", &of(|piece| piece.source.end - piece.source.start));
        }
        let files = self.files_into(&mut columns);
        if let Some(prediction) = &self.prediction {
            prediction_into(prediction, units, &mut columns);
        }
        let subtitle = format!("on {}", self.machine.name());
        let meta = json!({
            "program": concat!("plotplan ", env!("CARGO_PKG_VERSION")),
            "title": self.title,
            "subtitle": subtitle,
            "machine": machine,
            "period_us": self.header.period_us,
            "duration_us": self.header.duration_us,
            "exact": self.exact.is_some(),
            "tick_units": units,
            "deviation_unit_mm": deviation_unit_mm,
            "pens": self.pens(),
            "columns": description(&columns),
            "summary": self.summary,
            "certificate": self.certificate,
            "diagnostics": self.diagnostics(),
            "files": files,
            "prediction": self.prediction.as_ref().map(|found| json!({ "sentences": found.sentences })),
        });
        (meta, columns)
    }

    /// Adds the rows; returns the unit of each motor's column, ticks.
    fn rows_into(&self, columns: &mut Columns) -> [f64; 2] {
        let times: Vec<i64> = self.rows.iter().map(|row| row.t_us as i64).collect();
        let pens: Vec<i64> = self.rows.iter().map(|row| i64::from(row.pen)).collect();
        columns.numbers("t", &times);
        columns.numbers("pen", &pens);
        [("a", 0), ("b", 1)].map(|(name, motor)| {
            let bits = self.exact.map_or(0, |_| bits(self.header, motor));
            let scale = f64::from(1 << bits);
            let positions: Vec<i64> = match self.exact {
                None => self.rows.iter().map(|row| row.ticks[motor]).collect(),
                Some(exact) => {
                    let pairs = self.rows.iter().zip(exact);
                    let nearest: Vec<(i64, f64)> = pairs
                        .map(|(row, exact)| (nearest(row.ticks[motor], exact[motor]), exact[motor]))
                        .collect();
                    let off: Vec<i64> = self
                        .rows
                        .iter()
                        .zip(&nearest)
                        .map(|(row, (nearest, _))| row.ticks[motor] - nearest)
                        .collect();
                    if off.iter().any(|off| *off != 0) {
                        columns.numbers(["off_a", "off_b"][motor], &off);
                    }
                    nearest.into_iter().map(|(ticks, exact)| fixed_point(ticks, exact, bits)).collect()
                }
            };
            columns.numbers(name, &positions);
            1.0 / scale
        })
    }

    /// Adds the files' text, unless it is too long; returns what is true of each file.
    fn files_into(&self, columns: &mut Columns) -> Vec<Value> {
        let files = self.drawing.as_ref().map_or(&[][..], |drawing| &drawing.files);
        let text: Vec<u8> = files.iter().flat_map(|file| file.bytes).copied().collect();
        if !text.is_empty() && text.len() <= MOST_SOURCE {
            columns.text("source", &text);
        }
        files
            .iter()
            .map(|file| {
                let is_utf8 = std::str::from_utf8(file.bytes).is_ok();
                json!({ "name": file.name, "bytes": file.bytes.len(), "is_utf8": is_utf8 })
            })
            .collect()
    }

    /// The largest speed that the plan allows a pen, mm/s.
    fn pen_speed_mm_s(&self, number: u16) -> f64 {
        let speeds = self.drawing.as_ref().map_or(&[][..], |drawing| drawing.pen_speeds);
        let own = speeds.iter().find(|(pen, _)| pen.0 == number).map_or(f64::INFINITY, |(_, speed)| *speed);
        self.machine.pen().max_speed_mm_s.min(own)
    }

    /// The pens that draw.
    fn pens(&self) -> Vec<Value> {
        let numbers: BTreeSet<u16> = self.rows.iter().map(|row| row.pen).filter(|pen| *pen != 0).collect();
        let none = PenSettings::default();
        let stated = |pen: u16| {
            let drawing = self.drawing.as_ref()?;
            drawing.pens.get(&Pen(pen))
        };
        numbers
            .into_iter()
            .map(|number| {
                let settings = stated(number).unwrap_or(&none);
                json!({
                    "number": number,
                    "color": picture::ink_color(number, &self.header.pen_colors),
                    "name": settings.name,
                    "width_mm": settings.width_mm.filter(|width| *width > 0.0 && *width < 20.0),
                    "speed_mm_s": self.pen_speed_mm_s(number),
                })
            })
            .collect()
    }

    fn diagnostics(&self) -> Vec<Value> {
        let files = self.drawing.as_ref().map_or(&[][..], |drawing| &drawing.files);
        let placement = Affine::new(self.header.placement);
        self.findings
            .iter()
            .map(|found| {
                let file = files.iter().position(|file| found.file.as_deref() == Some(file.path));
                let offset =
                    file.map(|file| files[..file].iter().map(|file| file.bytes.len()).sum::<usize>());
                let start = offset.zip(found.byte).map(|(offset, byte)| offset + byte);
                let at_mm = found.pen_mm.map(|[x, y]| {
                    let point = placement * Point::new(x, y);
                    [point.x, point.y]
                });
                let mut place: Vec<String> = Vec::new();
                place.extend(found.file.clone().filter(|_| files.len() > 1));
                place.extend(found.command.map(|command| format!("command {command}")));
                place.extend(found.line.map(|line| format!("line {line}")));
                place.extend(found.byte.map(|byte| format!("byte {byte}")));
                json!({
                    "severity": found.severity,
                    "code": found.code,
                    "message": found.message,
                    "help": found.help,
                    "count": found.count,
                    "place": place.join(", "),
                    "start": start,
                    "at_mm": at_mm.filter(|_| start.is_some()),
                })
            })
            .collect()
    }
}

/// How `js/columns.js` reads columns.
pub fn description(columns: &Columns) -> Value {
    let column = |column: &Column| {
        let count = column.count.map_or(-1, |count| count as i64);
        json!({ "name": column.name, "count": count, "order": column.order, "bytes": column.bytes })
    };
    columns.list().iter().map(column).collect()
}

/// The nearest tick to an exact position: the row's own, where it is one of two.
fn nearest(ticks: i64, exact: f64) -> i64 {
    if (ticks as f64 - exact).abs() <= 0.5 { ticks } else { exact.round() as i64 }
}

/// A position in steps of `2^-bits` ticks, rounded down, so that `floor(position + 0.5)` is the nearest
/// whole tick. A row that is rounded along the path has its distance from that tick in another column.
fn fixed_point(ticks: i64, exact: f64, bits: i32) -> i64 {
    let one = 1i64 << bits;
    let half = one >> 1;
    let steps = (exact * one as f64).floor() as i64;
    // A tie may be rounded either way.
    steps.clamp(ticks * one - half, ticks * one + half - 1)
}

/// The bits of a tick that the limits of a motor ask for.
fn bits(header: &Header, motor: usize) -> i32 {
    let period_s = header.period_us.max(1) as f64 * 1e-6;
    let limits = header.motors[motor].limits;
    let step = limits.acceleration * period_s * period_s * ACCELERATION_ERROR;
    let jerk = limits.jerk.map_or(f64::INFINITY, |jerk| jerk * period_s * period_s * period_s * JERK_ERROR);
    let step = step.min(jerk);
    (1..=MOST_BITS).find(|bits| 1.0 / f64::from(1 << bits) <= step).unwrap_or(MOST_BITS)
}

fn prediction_into(prediction: &Prediction<'_>, units: [f64; 2], columns: &mut Columns) {
    let every = prediction.samples.len().div_ceil(MOST_PREDICTED).max(1);
    let samples: Vec<&Sample> = prediction.samples.iter().step_by(every).collect();
    columns.numbers("predicted_t", &samples.iter().map(|sample| sample.t_us as i64).collect::<Vec<_>>());
    columns.numbers("predicted_pen", &samples.iter().map(|sample| i64::from(sample.pen)).collect::<Vec<_>>());
    for (name, motor) in [("predicted_a", 0), ("predicted_b", 1)] {
        // In the units of the plan's columns, so that one factor serves both.
        let coarse = 1.0 / f64::from(1 << PREDICTED_BITS);
        let step = (coarse / units[motor]).max(1.0).floor();
        let steps = |sample: &&Sample| ((sample.ticks[motor] / units[motor] / step).round() * step) as i64;
        columns.numbers(name, &samples.iter().map(steps).collect::<Vec<_>>());
    }
}

/// The machine as `js/machine.js` reads it: linkage, motors, sheet, outlines of the reach.
pub fn machine(machine: &Machine) -> Value {
    let sheet = machine.sheet();
    let mechanism = machine.mechanism();
    let reach: Vec<Vec<f64>> = reach_outlines(machine)
        .iter()
        .map(|outline| outline.iter().flat_map(|point| [round(point.x), round(point.y)]).collect())
        .collect();
    let columns = [[1.0, 0.0], [0.0, 1.0]].map(|unit| machine.joint_rates(&unit.into()));
    let joints = mechanism.joint_names().into_iter().zip(mechanism.joint_kinds()).map(|(name, kind)| {
        let kind = match kind {
            JointKind::Revolute => "revolute",
            JointKind::Prismatic => "prismatic",
        };
        json!({ "name": name, "kind": kind })
    });
    let motors = machine.motors().iter().map(|motor| {
        let mut found = json!({
            "name": motor.name,
            "speed": motor.max_speed_ticks_s,
            "acceleration": motor.max_acceleration_ticks_s2,
            "jerk": motor.max_jerk_ticks_s3,
        });
        if motor.backlash_ticks > 0.0 {
            found["backlash"] = motor.backlash_ticks.into();
        }
        found
    });
    let linkage = mechanism.linkage(sheet);
    let affine = |f: &JointAffine| json!([f.constant, f.factors[0], f.factors[1]]);
    let anchors = linkage.anchors.iter().map(|anchor| match anchor {
        Anchor::Fixed(point) => json!({ "x": point.x, "y": point.y }),
        Anchor::Moving { from, length_mm, angle_rad } => {
            json!({ "from": from, "length_mm": affine(length_mm), "angle_rad": affine(angle_rad) })
        }
        Anchor::Crossing { from, radii_mm, is_left } => {
            json!({ "centers": from, "radii_mm": radii_mm.each_ref().map(affine), "is_left": is_left })
        }
    });
    let parts = linkage
        .parts
        .iter()
        .map(|part| json!({ "kind": part.kind.name(), "from": part.from, "to": part.to }));
    let pen = machine.pen();
    json!({
        "name": machine.name(),
        "kind": mechanism.kind(),
        "sheet_mm": [sheet.x0, sheet.y0, sheet.x1, sheet.y1],
        "reach_mm": reach,
        "joints_per_tick": [[columns[0][0], columns[1][0]], [columns[0][1], columns[1][1]]],
        "offset_ticks": machine.motors().each_ref().map(|motor| motor.offset_ticks),
        "linkage": {
            "anchors": anchors.collect::<Vec<_>>(),
            "parts": parts.collect::<Vec<_>>(),
            "pen": linkage.pen,
        },
        "joints": joints.collect::<Vec<_>>(),
        "motors": motors.collect::<Vec<_>>(),
        "pen": {
            "speed_mm_s": pen.max_speed_mm_s,
            "travel_speed_mm_s": Some(pen.max_travel_speed_mm_s).filter(|speed| speed.is_finite()),
            "lift_s": pen.lift_time_s,
            "drop_s": pen.drop_time_s,
        },
    })
}

/// Micrometres are enough for outlines.
fn round(mm: f64) -> f64 {
    (mm * 1000.0).round() / 1000.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fixed_point_positions_round_to_the_whole_tick() {
        for (ticks, exact) in
            [(3, 2.5), (3, 3.4999), (-3, -2.5), (-2, -2.5), (0, 0.499_999_9), (1, 0.5), (-1, -0.5)]
        {
            for bits in 1..=MOST_BITS {
                let position = fixed_point(ticks, exact, bits) as f64 / f64::from(1 << bits);
                assert_eq!((position + 0.5).floor() as i64, ticks, "{exact} in {bits} bits");
                assert!((position - exact).abs() <= 1.0 / f64::from(1 << bits));
            }
        }
    }
}
