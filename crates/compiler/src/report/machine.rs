//! Machines.

use drawing::{Line, Point, Rect, Segment};
use kinematics::Machine;
use schemars::JsonSchema;
use serde::Serialize;

use super::input::{MotorLimits, corners};
use super::round;

/// A machine.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct MachineReport {
    /// Its name.
    pub name: String,
    /// Names of the two joints.
    pub joints: [String; 2],
    /// Its motors.
    pub motors: Vec<MachineMotor>,
    /// Motor positions of the start pose, ticks.
    pub start_ticks: [i64; 2],
    /// Quantization error in the middle of the sheet (half a tick on both motors), mm; `null` if the
    /// middle is out of reach.
    pub tick_floor_mm: Option<f64>,
    /// The sheet and how much of it can be drawn on.
    pub sheet: SheetReport,
    /// Whether the machine can draw the drawing, from `check` with a machine; else `null`.
    pub can_draw: Option<bool>,
    /// How far ink reaches beyond the sheet, mm; from `check` with a machine, else `null`.
    pub beyond_sheet_mm: Option<f64>,
}

/// A motor: `ticks = counts * (matrix row * joints) + offset`.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct MachineMotor {
    /// Its limits.
    #[serde(flatten)]
    pub limits: MotorLimits,
    /// Ticks per mm or rad of its row.
    pub ticks_per_unit: f64,
    /// Its row of the coupling matrix.
    pub row: [f64; 2],
    /// Position where the row is 0, ticks.
    pub offset_ticks: f64,
}

/// A sheet.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct SheetReport {
    /// Left, bottom, right and top edge, mm in the machine's frame.
    pub bounds_mm: [f64; 4],
    /// Whether the machine can draw on all of it.
    pub is_reached: bool,
    /// Share of its inside that is out of reach, from a grid of 39 x 39 points.
    pub unreached_share: f64,
    /// Edges that cannot be drawn whole, in sentences with the reason at one point.
    pub unreached_edges: Vec<String>,
}

/// Where a machine comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum MachineSource {
    /// It comes with the program.
    Preset,
    /// It is a file in the user's folder.
    Own,
}

/// A machine that can be named.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, JsonSchema)]
pub struct ListedMachine {
    /// The name for `--machine`.
    pub name: String,
    /// Where it comes from.
    pub source: MachineSource,
    /// A line about a preset, or the path of an own file.
    pub about: String,
    /// Why it cannot be used; `null` if it can.
    pub error: Option<String>,
    /// Whether it hides a preset of the same name.
    pub hides_preset: bool,
}

/// Points of the grid along each side of a sheet.
const GRID: i32 = 40;

impl MachineReport {
    /// The report of a machine, with the reach of its sheet.
    pub fn of(machine: &Machine) -> Self {
        let motors =
            machine.motors().iter().zip(machine.coupling().rows()).map(|(motor, row)| MachineMotor {
                limits: MotorLimits {
                    name: motor.name.clone(),
                    speed_ticks_s: round::ticks(motor.max_speed_ticks_s),
                    acceleration_ticks_s2: round::ticks(motor.max_acceleration_ticks_s2),
                    jerk_ticks_s3: motor.max_jerk_ticks_s3.map(round::ticks),
                },
                ticks_per_unit: round::coefficient(motor.ticks_per_unit),
                row: row.map(round::coefficient),
                offset_ticks: round::coefficient(motor.offset_ticks),
            });
        let start = machine.motor_positions(&machine.start());
        let middle = machine.pose_near(machine.sheet().center(), &machine.start()).ok();
        Self {
            name: machine.name().to_owned(),
            joints: machine.mechanism().joint_names().map(ToOwned::to_owned),
            motors: motors.collect(),
            start_ticks: [start[0].round() as i64, start[1].round() as i64],
            tick_floor_mm: middle.map(|pose| round::mm(machine.quantization_error(&pose))),
            sheet: SheetReport::of(machine),
            can_draw: None,
            beyond_sheet_mm: None,
        }
    }
}

impl SheetReport {
    fn of(machine: &Machine) -> Self {
        let sheet = machine.sheet();
        let corners_at = [
            Point::new(sheet.x0, sheet.y0),
            Point::new(sheet.x1, sheet.y0),
            Point::new(sheet.x1, sheet.y1),
            Point::new(sheet.x0, sheet.y1),
        ];
        let mut unreached_edges = Vec::new();
        for (k, name) in ["lower", "right", "upper", "left"].into_iter().enumerate() {
            let edge = Segment::Line(Line::new(corners_at[k], corners_at[(k + 1) % 4]));
            if let Err(out) = machine.check_segment(&edge) {
                unreached_edges.push(format!("not all of the sheet's {name} edge can be drawn: {out}"));
            }
        }
        // An arm may reach all edges and not the middle.
        let missed = missed(machine, sheet);
        let inside = f64::from((GRID - 1) * (GRID - 1));
        Self {
            bounds_mm: corners(sheet),
            is_reached: missed == 0 && unreached_edges.is_empty(),
            unreached_share: round::share(missed as f64 / inside),
            unreached_edges,
        }
    }
}

/// Points of a grid inside the sheet that are out of reach.
fn missed(machine: &Machine, sheet: Rect) -> usize {
    let points = (1..GRID).flat_map(|i| (1..GRID).map(move |j| (i, j)));
    points
        .filter(|(i, j)| {
            let at = |low: f64, size: f64, k: i32| low + size * f64::from(k) / f64::from(GRID);
            let point = Point::new(at(sheet.x0, sheet.width(), *i), at(sheet.y0, sheet.height(), *j));
            machine.check_point(point).is_err()
        })
        .count()
}
