//! Machines.

use drawing::{Line, Point, Rect, Segment, Vec2};
use kinematics::{Machine, reach_outlines};
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
    /// What `machine check` looks into besides; else `null`.
    pub workspace: Option<WorkspaceReport>,
    /// The sheet and how much of it can be drawn on.
    pub sheet: SheetReport,
    /// Whether the machine can draw the drawing, from `check` with a machine; else `null`.
    pub can_draw: Option<bool>,
    /// How far ink reaches beyond the sheet, mm; from `check` with a machine, else `null`.
    pub beyond_sheet_mm: Option<f64>,
}

/// The reach of a machine, its resolution over the sheet, and what to look at.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct WorkspaceReport {
    /// Left, bottom, right and top end of the reach, mm; `null` where nothing bounds it.
    pub reach_mm: Option<[f64; 4]>,
    /// Quantization error over the sheet, mm: least, median and greatest; `null` if none of it is
    /// within reach.
    pub tick_floor_mm: Option<[f64; 3]>,
    /// Manipulability of the start pose.
    pub start_manipulability: f64,
    /// Where the pen could start instead, mm: of the sheet's edges and its middle the place farthest from a
    /// singular pose; `null` if the start pose will do.
    pub suggested_start_mm: Option<[f64; 2]>,
    /// Limits that make no sense, in sentences.
    pub doubts: Vec<String>,
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
            workspace: None,
            sheet: SheetReport::of(machine),
            can_draw: None,
            beyond_sheet_mm: None,
        }
    }
}

impl WorkspaceReport {
    /// The workspace of a machine.
    pub fn of(machine: &Machine) -> Self {
        let points: Vec<Point> = reach_outlines(machine).into_iter().flatten().collect();
        let most = |of: fn(f64, f64) -> f64, at: fn(&Point) -> f64| points.iter().map(at).reduce(of);
        let reach = (most(f64::min, |p| p.x), most(f64::min, |p| p.y), most(f64::max, |p| p.x));
        let reach_mm = match (reach, most(f64::max, |p| p.y)) {
            ((Some(x0), Some(y0), Some(x1)), Some(y1)) => Some([x0, y0, x1, y1].map(round::mm)),
            _ => None,
        };
        let sheet = machine.sheet();
        let share = |k: i32| f64::from(k) / 20.0;
        let grid = (0..21 * 21).map(|k| {
            Point::new(sheet.x0 + share(k % 21) * sheet.width(), sheet.y0 + share(k / 21) * sheet.height())
        });
        let pose = |p: Point| {
            machine.check_point(p).ok()?;
            machine.pose_near(p, &machine.start()).ok()
        };
        let mut floors: Vec<f64> =
            grid.filter_map(pose).map(|pose| machine.quantization_error(&pose)).collect();
        floors.sort_by(f64::total_cmp);
        let floor = |share: f64| floors[((floors.len() - 1) as f64 * share) as usize];
        let tick_floor_mm = (!floors.is_empty()).then(|| [floor(0.0), floor(0.5), floor(1.0)].map(round::mm));
        let manipulability = |p: Point| pose(p).map_or(0.0, |pose| machine.mechanism().manipulability(&pose));
        let start_manipulability = machine.mechanism().manipulability(&machine.start());
        let middle = sheet.center();
        let edges = [
            (middle.x, sheet.y0),
            (sheet.x0, sheet.y0),
            (sheet.x1, sheet.y0),
            (sheet.x0, middle.y),
            (sheet.x1, middle.y),
            (middle.x, sheet.y1),
            (middle.x, middle.y),
        ];
        let best = edges.map(Point::from).into_iter().reduce(|best, other| {
            if manipulability(other) > manipulability(best) + 1e-3 { other } else { best }
        });
        let poor = start_manipulability < machine.parts().min_manipulability;
        let suggested = best.filter(|best| poor && manipulability(*best) > start_manipulability);
        Self {
            reach_mm,
            tick_floor_mm,
            start_manipulability: round::coefficient(start_manipulability),
            suggested_start_mm: suggested.map(|start| [start.x, start.y].map(round::mm)),
            doubts: doubts(machine),
        }
    }
}

/// Limits that can hardly be meant.
fn doubts(machine: &Machine) -> Vec<String> {
    let mut doubts = Vec::new();
    for motor in machine.motors() {
        let (name, speed) = (&motor.name, motor.max_speed_ticks_s);
        let time_s = speed / motor.max_acceleration_ticks_s2;
        if time_s > 5.0 {
            doubts.push(format!("motor {name} takes {time_s:.1} s to reach its largest speed"));
        }
        if time_s < 1e-3 {
            doubts.push(format!("motor {name} reaches its largest speed within {:.2} ms", 1e3 * time_s));
        }
        if speed * machine.parts().period_s < 1.0 {
            doubts.push(format!("motor {name} moves by less than a tick between two rows"));
        }
        if speed > 2e6 {
            doubts.push(format!("motor {name} takes {speed:.0} ticks/s, more than a controller gives"));
        }
    }
    let middle = machine.sheet().center();
    if let Ok(pose) = machine.pose_near(middle, &machine.start()) {
        let fastest = (0..36)
            .map(|k| {
                let (sin, cos) = libm::sincos(f64::from(k) * std::f64::consts::TAU / 36.0);
                let (rates, _) = machine.motor_derivatives(&pose, Vec2::new(cos, sin), Vec2::ZERO);
                let limits = machine.motors().each_ref().map(|motor| motor.max_speed_ticks_s);
                (limits[0] / rates[0].abs()).min(limits[1] / rates[1].abs())
            })
            .fold(0.0, f64::max);
        let pen = machine.pen().max_speed_mm_s;
        if fastest < pen {
            doubts.push(format!(
                "the motors move the pen by at most {fastest:.1} mm/s in the middle of the sheet, less than its \
                 max_speed of {pen:.1} mm/s"
            ));
        }
    }
    doubts
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
