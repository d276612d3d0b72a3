//! `cargo xtask bench plan`: duration of the planner's workload, limit checks, and CPU time of
//! every stage; beside it toppra (Pham & Pham) if it is installed.

use std::fmt::Write as _;
use std::path::Path;
use std::process::Command;

use anyhow::{Context as _, Result};
use drawing::{Drawing, Point, Rect, Segment};
use kinematics::{Cartesian, JointPos, JointRange, Machine, MachineParts, Motor, PenLimits, TwoLink};
use planner::unstable::{
    CornerBlend, JointPath, PathBudget, PathGeometry, Profile, SpeedCap, profile, profile_on_grid, sections,
};
use planner::{PlacementOptions, Scale, place};
use planner::{Settings, Trajectory};

use super::{fastest, workload};

/// Number of points in the workload. Growth is measured against ten times as many.
const POINTS: usize = 10_000;
const TOLERANCE: f64 = 0.05;
/// Time between the rows in which accelerations are measured, microseconds.
const PERIOD_US: u64 = 1000;

/// Largest speed and acceleration of the belts, mm/s and mm/s²: the square around the disc of 100
/// mm/s and 1000 mm/s².
const SPEED: f64 = 141.42;
const ACCELERATION: f64 = 1414.2;
const TICKS_PER_MM: f64 = 80.0;

const TOPPRA: &str = include_str!("toppra_side.py");

/// A measured figure with its goal.
struct Goal {
    what: &'static str,
    unit: &'static str,
    figure: f64,
    wanted: f64,
    at_most: bool,
}

impl Goal {
    fn met(&self) -> bool {
        if self.at_most { self.figure <= self.wanted } else { self.figure >= self.wanted }
    }
}

pub(super) fn run(python: &str) -> Result<bool> {
    let machine = corexy()?;
    let points = workload::points(POINTS);
    let length: f64 = points.windows(2).map(|w| (w[1] - w[0]).hypot()).sum();
    let once = read(&points)?;
    let tenfold = read(&workload::points(10 * POINTS))?;
    println!("workload: {} points, {length:.3} mm, one stroke, as HPGL", points.len());

    let settings = Settings::new(TOLERANCE, PERIOD_US);
    let (trajectory, planning) = fastest(|| planner::plan(&machine, once.clone(), &settings));
    let trajectory = trajectory?;
    let (tenfold_plan, tenfold_planning) = fastest(|| planner::plan(&machine, tenfold.clone(), &settings));
    tenfold_plan?;
    let peaks = Peaks::of(&machine, &trajectory);

    let stages = Stages::of(&machine, &once)?;
    let ten_stages = Stages::of(&machine, &tenfold)?;
    let emission = emission(&machine, &trajectory)?;
    // Only cached plans: others are planned again during emission. So from a tenth to the whole.
    let tenth = read(&workload::points(POINTS / 10))?;
    let tenth_plan = planner::plan(&machine, tenth, &settings)?;
    let tenth_emission = emission_seconds(&machine, &tenth_plan)?;
    let arm = arm()?;
    let mut fitted = once.clone();
    fitted.transform(place(
        &arm,
        &once,
        &PlacementOptions { scale: Scale::Fit, ..PlacementOptions::default() },
    )?);
    let arm_trajectory = planner::plan(&arm, fitted, &settings)?;
    let arm_emission = self::emission(&arm, &arm_trajectory)?;

    println!("{:<14} {:>10} {:>10} {:>10}", "CPU ms", "points", "10 times", "exponent");
    for (name, one, ten) in [
        ("path", stages.path, ten_stages.path),
        ("joint path", stages.joint_path, ten_stages.joint_path),
        ("grid profile", stages.coarse_profile, ten_stages.coarse_profile),
        ("profile", stages.time_parametrization, ten_stages.time_parametrization),
        ("all of plan", planning, tenfold_planning),
    ] {
        println!("{name:<14} {:>10.2} {:>10.2} {:>10.3}", 1e3 * one, 1e3 * ten, (ten / one).log10());
    }
    println!(
        "intervals: {} of {} joint paths; {} phases",
        stages.intervals,
        stages.paths.len(),
        stages.profiles.iter().map(|p| p.phases.len()).sum::<usize>()
    );
    println!("finite differences of {PERIOD_US} us: speed {:.5} of the limit", peaks.speed);
    let goals = goals(&Measured {
        trajectory: &trajectory,
        peaks: &peaks,
        stages: &stages,
        emission,
        arm_emission,
        planning_growth: (tenfold_planning / planning).log10(),
        emission_growth: (trajectory.row_count() as f64 / emission / tenth_emission).ln()
            / (trajectory.row_count() as f64 / tenth_plan.row_count() as f64).ln(),
    });
    for goal in &goals {
        let relation = if goal.at_most { "at most" } else { "at least" };
        let verdict = if goal.met() { "" } else { "   MISSED" };
        println!(
            "{:<40} {:>10.4} {:<12} ({relation} {:.4}){verdict}",
            goal.what, goal.figure, goal.unit, goal.wanted
        );
    }
    toppra(python, &points, &machine, &stages)?;
    Ok(goals.iter().all(Goal::met))
}

/// What the goals are about.
struct Measured<'a> {
    trajectory: &'a Trajectory<'a>,
    peaks: &'a Peaks,
    stages: &'a Stages,
    /// Rows per second on the CoreXY and on the arm.
    emission: f64,
    arm_emission: f64,
    /// Exponents of the cost.
    planning_growth: f64,
    emission_growth: f64,
}

fn goals(measured: &Measured<'_>) -> [Goal; 8] {
    let tick_limit = ACCELERATION * TICKS_PER_MM * (PERIOD_US as f64 * 1e-6).powi(2) + 2.0;
    [
        Goal {
            what: "drawing time",
            unit: "s",
            figure: measured.trajectory.times().drawing_s,
            wanted: 207.0,
            at_most: true,
        },
        Goal {
            what: "largest acceleration, exact positions",
            unit: "of the limit",
            figure: measured.peaks.acceleration,
            wanted: 1.0 + 1e-6,
            at_most: true,
        },
        Goal {
            what: "largest second difference, whole ticks",
            unit: "ticks",
            figure: measured.peaks.ticks,
            wanted: tick_limit,
            at_most: true,
        },
        Goal {
            what: "profile of the workload",
            unit: "ms",
            figure: 1e3 * measured.stages.time_parametrization,
            // A tenth of what it took with refinement (5e26b6c).
            wanted: 16.8,
            at_most: true,
        },
        Goal {
            what: "rows to CSV, CoreXY",
            unit: "M rows/s",
            figure: 1e-6 * measured.emission,
            wanted: 10.0,
            at_most: false,
        },
        Goal {
            what: "rows to CSV, arm",
            unit: "M rows/s",
            figure: 1e-6 * measured.arm_emission,
            wanted: 10.0,
            at_most: false,
        },
        Goal {
            what: "growth of planning, 1 to 10 times",
            unit: "exponent",
            figure: measured.planning_growth,
            wanted: 1.05,
            at_most: true,
        },
        Goal {
            what: "growth of emission with rows, to 10 times",
            unit: "exponent",
            figure: measured.emission_growth,
            wanted: 1.05,
            at_most: true,
        },
    ]
}

/// The workload as the pipeline receives it: written as HPGL and parsed.
fn read(points: &[Point]) -> Result<Drawing> {
    let document = hpgl::read(workload::hpgl(points).as_bytes(), &hpgl::Options::default());
    anyhow::ensure!(document.diagnostics.is_empty(), "the workload is read with {:?}", document.diagnostics);
    let page = document.pages.into_iter().next().context("a document without a page")?;
    anyhow::ensure!(page.drawing.strokes.len() == 1, "the workload is one stroke");
    Ok(page.drawing)
}

fn motor(name: &str, counts: f64, speed: f64, acceleration: f64) -> Motor {
    let (max_speed, max_acceleration) = (counts * speed, counts * acceleration);
    Motor {
        name: name.into(),
        ticks_per_unit: counts,
        offset_ticks: 0.0,
        max_speed_ticks_s: max_speed,
        max_acceleration_ticks_s2: max_acceleration,
        max_jerk_ticks_s3: None,
        backlash_ticks: 0.0,
    }
}

fn corexy() -> Result<Machine> {
    let joint = JointRange { min: -50.0, max: 400.0 };
    Ok(Machine::new(MachineParts {
        name: "workload".into(),
        mechanism: std::sync::Arc::new(Cartesian),
        joints: [joint; 2],
        min_manipulability: 0.0,
        coupling: [[1.0, 1.0], [1.0, -1.0]],
        motors: ["a", "b"].map(|name| motor(name, TICKS_PER_MM, SPEED, ACCELERATION)),
        pen: PenLimits {
            max_speed_mm_s: 1000.0,
            max_travel_speed_mm_s: f64::INFINITY,
            lift_time_s: 0.15,
            drop_time_s: 0.15,
        },
        pen_servo: None,
        pen_offsets_mm: std::collections::BTreeMap::new(),
        homing: None,
        sheet: Rect::new(0.0, 0.0, 400.0, 400.0),
        start: JointPos::ZERO,
        period_s: 0.01,
    })?)
}

/// An arm with two links and both motors in its base, for the cost of transcendental functions.
fn arm() -> Result<Machine> {
    let counts = 32_000.0 / std::f64::consts::TAU;
    Ok(Machine::new(MachineParts {
        name: "arm".into(),
        mechanism: std::sync::Arc::new(TwoLink { l1_mm: 206.0, l2_mm: 256.0, elbow_left: true }),
        joints: [JointRange::FREE; 2],
        min_manipulability: 0.1,
        coupling: [[1.0, 0.0], [0.0, 1.0]],
        motors: ["arm1", "arm2"].map(|name| motor(name, counts, 1.0, 5.0)),
        pen: PenLimits {
            max_speed_mm_s: 60.0,
            max_travel_speed_mm_s: f64::INFINITY,
            lift_time_s: 0.15,
            drop_time_s: 0.15,
        },
        pen_servo: None,
        pen_offsets_mm: std::collections::BTreeMap::new(),
        homing: None,
        sheet: Rect::new(12.7, 76.2, 228.6, 355.6),
        start: JointPos::new(std::f64::consts::FRAC_PI_2, std::f64::consts::PI),
        period_s: 0.01,
    })?)
}

/// Largest finite differences over the rows of a plan.
struct Peaks {
    /// As shares of the limits, in the exact positions.
    speed: f64,
    acceleration: f64,
    /// Largest second difference of the ticks.
    ticks: f64,
}

impl Peaks {
    fn of(machine: &Machine, trajectory: &Trajectory<'_>) -> Self {
        let period = PERIOD_US as f64 * 1e-6;
        let mut peaks = Self { speed: 0.0, acceleration: 0.0, ticks: 0.0 };
        let mut last: Option<(u64, [f64; 2], [i64; 2])> = None;
        // Differences from the previous row; at rest before the first.
        let (mut step, mut tick_step) = ([0.0; 2], [0; 2]);
        for row in trajectory.rows() {
            let (t_us, exact, ticks) = (row.row.t_us, row.exact, row.row.ticks);
            if let Some((before, from, from_ticks)) = last {
                if t_us - before > PERIOD_US {
                    // Rows are omitted only where nothing moves.
                    (step, tick_step) = ([0.0; 2], [0; 2]);
                }
                for (k, motor) in machine.motors().iter().enumerate() {
                    let (now, now_ticks) = (exact[k] - from[k], ticks[k] - from_ticks[k]);
                    let acceleration = (now - step[k]).abs() / (period * period);
                    peaks.speed = peaks.speed.max(now.abs() / period / motor.max_speed_ticks_s);
                    peaks.acceleration =
                        peaks.acceleration.max(acceleration / motor.max_acceleration_ticks_s2);
                    peaks.ticks = peaks.ticks.max((now_ticks - tick_step[k]).abs() as f64);
                    (step[k], tick_step[k]) = (now, now_ticks);
                }
            }
            last = Some((t_us, exact, ticks));
        }
        peaks
    }
}

/// The planner's stages one by one, s of CPU time.
struct Stages {
    path: f64,
    joint_path: f64,
    /// With one acceleration on each interval of the grid, and by arcs.
    coarse_profile: f64,
    time_parametrization: f64,
    intervals: usize,
    paths: Vec<JointPath>,
    rough: Vec<Profile>,
    profiles: Vec<Profile>,
}

/// The number of phases and the total duration of some profiles, s.
fn nodes_and_time(profiles: &[Profile]) -> (usize, f64) {
    let phases = profiles.iter().map(|profile| profile.phases.len()).sum();
    (phases, profiles.iter().map(|profile| profile.duration_s).sum())
}

impl Stages {
    fn of(machine: &Machine, drawing: &Drawing) -> Result<Self> {
        let budget = PathBudget {
            chord_mm: 0.5 * TOLERANCE,
            simplify_mm: 0.3 * TOLERANCE,
            blend_mm: 0.7 * TOLERANCE,
            corner: CornerBlend::Parabola,
            row_mm: f64::INFINITY,
        };
        let stroke = drawing.strokes.iter().next().context("a workload without strokes")?;
        let (sections, path) = fastest(|| sections(&stroke, &budget));
        let (paths, joint_path) = fastest(|| {
            let joint_paths = sections.iter().map(|section| {
                let pose = machine
                    .poses(section[0].curve.start(), &machine.start())
                    .map_err(|fault| anyhow::anyhow!("{fault}"))?;
                Ok(JointPath::from_section(machine, section.clone(), pose[0], TOLERANCE)?)
            });
            joint_paths.collect::<Result<Vec<JointPath>>>()
        });
        let paths = paths?;
        let cap = SpeedCap {
            pen_mm_s: machine.pen().max_speed_mm_s,
            row_deviation_mm: f64::INFINITY,
            period_s: 1e-3,
        };
        let timed = |profile: fn(&Machine, &JointPath, &SpeedCap) -> Profile| {
            fastest(|| paths.iter().map(|path| profile(machine, path, &cap)).collect::<Vec<Profile>>())
        };
        let (rough, coarse_profile) = timed(profile_on_grid);
        let (profiles, time_parametrization) = timed(profile);
        let intervals = paths.iter().map(|path| path.intervals.len()).sum();
        Ok(Self { path, joint_path, coarse_profile, time_parametrization, intervals, paths, rough, profiles })
    }
}

/// Rows per second through inverse kinematics, rounding and CSV.
fn emission(machine: &Machine, trajectory: &Trajectory<'_>) -> Result<f64> {
    Ok(trajectory.row_count() as f64 / emission_seconds(machine, trajectory)?)
}

fn emission_seconds(machine: &Machine, trajectory: &Trajectory<'_>) -> Result<f64> {
    let header = plan::Header {
        machine: machine.name().into(),
        motors: machine.motors().clone().map(|motor| plan::Motor {
            name: motor.name,
            limits: plan::Limits {
                speed: motor.max_speed_ticks_s,
                acceleration: motor.max_acceleration_ticks_s2,
                jerk: None,
            },
        }),
        placement: [1.0, 0.0, 0.0, 1.0, 0.0, 0.0],
        period_us: PERIOD_US,
        rows: trajectory.row_count(),
        lift_overlap_us: 0,
        rounding: plan::Rounding::Nearest,
        pen_colors: std::collections::BTreeMap::new(),
        duration_us: trajectory.duration_us(),
    };
    let rows = || trajectory.rows().map(|row| row.row);
    let (written, seconds) = fastest(|| plan::file::csv::write(&header, rows(), &mut std::io::sink()));
    written?;
    Ok(seconds)
}

/// toppra on the same points, and on the same path with the same limits.
fn toppra(python: &str, points: &[Point], machine: &Machine, stages: &Stages) -> Result<()> {
    let folder = tempfile::tempdir()?;
    let file = |name: &str, text: &str| -> Result<std::path::PathBuf> {
        let path = folder.path().join(name);
        std::fs::write(&path, text)?;
        Ok(path)
    };
    let script = file("toppra_side.py", TOPPRA)?;
    let mut text = String::new();
    for point in points {
        writeln!(text, "{} {}", point.x + point.y, point.x - point.y)?;
    }
    let belts = file("points.txt", &text)?;
    let longest = stages.paths.iter().max_by_key(|path| path.intervals.len()).context("no joint path")?;
    let nodes = file("nodes.txt", &nodes(machine, longest))?;
    let Some(output) = run_python(python, &script, &belts, &nodes)? else {
        println!(
            "toppra is not installed for `{python}` (python3 -m pip install toppra numpy): nothing beside our figures"
        );
        return Ok(());
    };
    println!(
        "\n{:<38} {:>8} {:>9} {:>9} {:>10} {:>11} {:>8}  on one path",
        "", "nodes", "CPU ms", "M nodes/s", "motion s", "worst a", "mm off"
    );
    for (name, profiles, seconds) in [
        ("plotplan, one acceleration an interval", &stages.rough, stages.coarse_profile),
        ("plotplan, arcs (what plans are)", &stages.profiles, stages.time_parametrization),
    ] {
        let (nodes, time) = nodes_and_time(profiles);
        println!(
            "{name:<38} {nodes:>8} {:>9.2} {:>9.4} {time:>10.3}",
            1e3 * seconds,
            1e-6 * nodes as f64 / seconds
        );
    }
    for line in output.lines() {
        let mut fields = line.split('\t');
        let name = format!("toppra: {}", fields.next().unwrap_or_default());
        let mut number = || fields.next().and_then(|field| field.parse::<f64>().ok()).unwrap_or(f64::NAN);
        let (count, cpu, motion, worst, off) = (number(), number(), number(), number(), number());
        if motion.is_nan() {
            println!("{name:<38} {count:>8} {:>9.2}  finds no time law", 1e3 * cpu);
            continue;
        }
        println!(
            "{name:<38} {count:>8} {:>9.2} {:>9.4} {motion:>10.3} {worst:>11.3} {off:>8.3}  {:.0} times as long as on the grid, {:.0} as arcs",
            1e3 * cpu,
            1e-6 * count / cpu,
            cpu / stages.coarse_profile,
            cpu / stages.time_parametrization
        );
    }
    Ok(())
}

/// The script's output; `None` if Python or toppra is missing.
fn run_python(python: &str, script: &Path, points: &Path, nodes: &Path) -> Result<Option<String>> {
    let Ok(output) = Command::new(python).arg(script).arg(points).arg(nodes).output() else {
        return Ok(None);
    };
    if output.status.code() == Some(3) {
        return Ok(None);
    }
    anyhow::ensure!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    Ok(Some(String::from_utf8(output.stdout)?))
}

/// `s q q' q''` in mm of belt at the start of every part of a path, none longer than 0.2 mm, and at
/// its end.
fn nodes(machine: &Machine, path: &JointPath) -> String {
    let PathGeometry::Drawn(start, section) = &path.geometry else { return String::new() };
    let (mut text, mut s, mut near) = (String::new(), 0.0, *start);
    let mut node = |s: f64, piece: usize, at: f64| {
        let piece = &section[piece];
        let t = (at * piece.rate).min(1.0);
        let point = Segment::eval(&piece.curve, t);
        near = machine.pose_near(point, &near).unwrap_or(near);
        let (velocity, acceleration) = piece.curve.derivatives(t);
        let (first, second) =
            machine.motor_derivatives(&near, piece.rate * velocity, piece.rate * piece.rate * acceleration);
        let (q, first, second) =
            (machine.motor_positions(&near) / TICKS_PER_MM, first / TICKS_PER_MM, second / TICKS_PER_MM);
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{s} {} {} {} {} {} {}", q[0], q[1], first[0], first[1], second[0], second[1]);
    };
    let mut last = (0, 0.0);
    for interval in &path.intervals {
        let parts = (interval.length / 0.2).ceil().max(1.0);
        for k in 0..parts as u32 {
            let from = interval.length * f64::from(k) / parts;
            node(s + from, interval.piece, interval.start + from);
        }
        s += interval.length;
        last = (interval.piece, interval.start + interval.length);
    }
    node(s, last.0, last.1);
    text
}
