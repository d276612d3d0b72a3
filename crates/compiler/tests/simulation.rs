//! Predicted ink of the coaxial arm on examples/zot.hpgl, against independent code: explicit Euler of
//! the same equations in Python, nearest points by a k-d tree (`SciPy`), on a plan of an earlier
//! planner. Loads and gains as in docs/simulation.md.

use std::fmt::Write as _;

use compiler::machine_file::{MachineFile, PRESETS};
use compiler::pipeline::{self, Order, Request};
use compiler::simulate::{Plan, Simulated, simulate};
use compiler::{import, report};
use drawing::Drawing;
use kinematics::Machine;
use plan::Row;
use planner::{PlacementOptions, Rounding, TimingLaw};
use simulation::{
    AntiWindup, DcParameters, Drive, FeedForward, Feedback, MotorPlant, PidGains, SetpointKind,
    SimulationError,
};

struct Zot {
    machine: Machine,
    rows: Vec<Row>,
    drawing: Drawing,
}

impl Zot {
    /// Rounded to the nearest ticks, as the plan of the independent code.
    fn new() -> Self {
        Self::rounded(Rounding::Nearest)
    }

    fn rounded(rounding: Rounding) -> Self {
        let machine = MachineFile::parse(PRESETS[0].toml).expect("a preset").machine().expect("a machine");
        let bytes = include_bytes!("../../../examples/zot.hpgl");
        let document = import::read(bytes, &import::Options::default()).expect("a drawing");
        let request = Request {
            tolerance_mm: 0.1,
            period_us: 10_000,
            order: Order::Optimize(ordering::Options::default()),
            placement: PlacementOptions::default(),
            search: None,
            crop: None,
            pen_speeds: Vec::new(),
            pen_colors: std::collections::BTreeMap::new(),
            lift_overlap_s: 0.0,
            timing_law: TimingLaw::TimeOptimal,
            rounding,
            joint_fit: true,
            allow_over_limit: false,
        };
        let compiled =
            pipeline::compile(&document.pages[0].drawing, &machine, &request, &|_| {}).expect("a plan");
        let rows = compiled.trajectory.rows().map(|row| row.row).collect();
        let drawing = compiled.ordered().clone();
        Self { rows, drawing, machine: machine.clone() }
    }

    fn simulate(&self, drive: &Drive) -> Result<Simulated, SimulationError> {
        let plan =
            Plan { machine: &self.machine, rows: &self.rows, period_us: 10_000, drawing: &self.drawing };
        drive.validate().expect("a possible drive");
        simulate(&plan, drive, |_| {})
    }
}

fn arm(kp: f64, period_s: f64, feed_forward: [f64; 3]) -> Drive {
    let motor = DcParameters::first_order(106.67, 0.12).with_friction(8.0, 6.0);
    let [speed, acceleration, friction] = feed_forward;
    Drive {
        feed_forward: FeedForward { speed, acceleration, friction },
        ..Drive::proportional(MotorPlant::Dc(motor), kp, period_s)
    }
}

fn pid(kp: f64, ki: f64, kd: f64) -> Feedback {
    Feedback::Pid(PidGains { kp, ki, kd, kd_filter_s: 0.0 }, AntiWindup::Conditional)
}

#[test]
fn zot_ink_is_that_of_independent_code_and_ranks_as_there() {
    let zot = Zot::new();
    let mut other = arm(0.4, 0.01, [1.0; 3]);
    for motor in &mut other.motors {
        motor.plant = MotorPlant::Dc(DcParameters::first_order(80.0, 0.08).with_friction(5.0, 3.0));
    }
    // Stray max and RMS, missed RMS, mm.
    let cases = [
        ("P 0.05", arm(0.05, 0.01, [0.0; 3]), [116.163, 28.5538, 27.9429]),
        ("P 0.5, speed and acceleration", arm(0.5, 0.01, [1.0, 1.0, 0.0]), [8.217, 2.5590, 2.4689]),
        ("P 0.5", arm(0.5, 0.01, [0.0; 3]), [5.235, 2.2591, 2.2908]),
        (
            "PID at 5 ms, shares",
            Drive { feedback: pid(0.3, 1.0, 0.03), ..arm(0.3, 0.005, [0.9, 0.8, 0.7]) },
            [4.366, 1.1135, 1.1953],
        ),
        ("P 0.5, friction", arm(0.5, 0.01, [1.0; 3]), [2.088, 0.4758, 0.4764]),
        ("another motor", other, [1.975, 0.4030, 0.4067]),
        (
            "PI at 2 ms",
            Drive { feedback: pid(1.5, 2.0, 0.0), ..arm(1.5, 0.002, [1.0; 3]) },
            // Euler's 0.521 for the largest becomes 0.582 with steps of 20 us.
            [0.582, 0.1639, 0.1650],
        ),
    ];
    let mut last = f64::INFINITY;
    let mut table = String::new();
    for (name, drive, [max, rms, missed]) in cases {
        let ink = zot.simulate(&drive).unwrap().ink;
        let (stray, missed_rms_mm) = (ink.stray, ink.missed.rms_mm);
        writeln!(
            table,
            "{name}: {:.3} {:.4} {missed_rms_mm:.4}, independent {max} {rms} {missed}",
            stray.max_mm, stray.rms_mm
        )
        .expect("a string takes all text");
        assert!((ink.stray.rms_mm / rms - 1.0).abs() < 0.05, "{table}");
        assert!((ink.missed.rms_mm / missed - 1.0).abs() < 0.05, "{table}");
        assert!((ink.stray.max_mm / max - 1.0).abs() < 0.15, "{table}");
        assert!(ink.stray.rms_mm < last, "{table}");
        last = ink.stray.rms_mm;
    }
}

#[test]
fn ideal_drives_draw_the_plan() {
    let zot = Zot::new();
    let ink = zot.simulate(&Drive::proportional(MotorPlant::Ideal, 0.0, 0.01)).unwrap().ink;
    // Rounding to ticks only: 0.39 mm at most by the certificate of this plan.
    assert!(ink.stray.max_mm < 0.40 && ink.missed.max_mm < 0.40, "{ink:?}");
    assert!((ink.stray.rms_mm - 0.1124).abs() < 0.01, "{}", ink.stray.rms_mm);
    assert_eq!(ink.tails.count, 0);
    let zot = Zot::rounded(Rounding::Path);
    let ink = zot.simulate(&Drive::proportional(MotorPlant::Ideal, 0.0, 0.01)).unwrap().ink;
    assert!(ink.stray.max_mm < 0.27 && ink.missed.max_mm < 0.27, "{ink:?}");
    assert!((ink.stray.rms_mm - 0.0741).abs() < 0.005, "{}", ink.stray.rms_mm);
}

#[test]
fn drive_of_report_1_does_not_reach_its_vertices() {
    let zot = Zot::new();
    let file = MachineFile::parse(PRESETS[0].toml).unwrap();
    let drive = file.drive(&zot.machine).unwrap().unwrap();
    assert_eq!(drive.setpoints, SetpointKind::Vertices);
    let simulated = zot.simulate(&drive).unwrap();
    assert!(simulated.outcome.unreached > 50, "{}", simulated.outcome.unreached);
    let report = report::simulation::SimulationReport::of(&zot.machine, &drive, &simulated, Some(0.5));
    assert!(!report.holds);
    assert!(report.ink.stray_rms_mm > 5.0, "{}", report.ink.stray_rms_mm);
}

#[test]
fn unstable_loop_is_reported_and_finite() {
    let zot = Zot::new();
    let drive = arm(50.0, 0.05, [0.0; 3]);
    let simulated = zot.simulate(&drive).unwrap();
    let report = report::simulation::SimulationReport::of(&zot.machine, &drive, &simulated, None);
    for motor in &report.motors {
        assert_eq!(motor.stable, Some(false));
        assert!(motor.swing_ticks > 100.0, "{motor:?}");
        assert!(motor.saturated_share > 0.5);
    }
    assert!(report.ink.stray_rms_mm.is_finite() && report.text().contains("UNSTABLE"));
}

#[test]
fn simulation_is_the_same_twice() {
    let zot = Zot::new();
    let drive = arm(0.5, 0.01, [1.0; 3]);
    let run = || format!("{:?}", zot.simulate(&drive).unwrap().ink);
    assert_eq!(run(), run());
}

fn error_of(from: &str, to: &str) -> String {
    let toml = PRESETS[0].toml;
    assert!(toml.contains(from), "{from}");
    let result = MachineFile::parse(&toml.replacen(from, to, 1)).and_then(|file| file.machine());
    let error = result.expect_err("refused");
    let source = std::error::Error::source(&error).map(|source| format!(": {source}"));
    format!("{error}{}", source.unwrap_or_default())
}

#[test]
fn impossible_values_of_the_drive_name_their_key() {
    for (from, to, expected) in [
        ("kp = 0.05", "kq = 0.05", "unknown key `kq`"),
        ("kp = 0.05", "kp = -1", "drive.kp: must be from 0"),
        ("kp = 0.05", "", "drive.kp: is missing"),
        ("time_constant = \"120ms\"", "time_constant = \"0ms\"", "drive.motor.time_constant: must be from"),
        (
            "time_constant = \"120ms\"",
            "time_constant = \"120\"",
            "drive.motor.time_constant: `120` has no unit",
        ),
        ("stiction = 8 ", "stiction = 4 ", "drive.motor.friction: must not exceed the stiction of 4"),
        ("\"106.67ticks/s\"", "\"-1ticks/s\"", "drive.motor.speed_per_duty: must be a positive number"),
        ("kind = \"dc\"", "kind = \"ac\"", "unknown value `ac`"),
        ("kind = \"dc\"", "kind = \"dc\"\nrate = \"3deg/s\"", "drive.motor.rate: is no key of kind dc"),
        ("period = \"10ms\"\nkp", "period = \"1us\"\nkp", "drive.period: must be from 0.0002"),
        (
            "kp = 0.05",
            "kp = 0.05\nfeed_forward = { speed = 2 }",
            "drive.feed_forward.speed: must be from 0 to 1",
        ),
        ("setpoints = \"vertices\"", "setpoints = \"vertexes\"", "did you mean `vertices`"),
    ] {
        let error = error_of(from, to);
        assert!(error.contains(expected), "{to}: {error}");
    }
}

/// The coaxial preset with DC motors by their data sheet; `first` extends the table of motor 1, `arm`
/// is the `[drive.arm]` table.
fn data_sheet_drive(first: &str, arm: &str) -> Drive {
    let motor = "[[drive.motor]]\nkind = \"dc\"\nsupply = \"12V\"\nresistance = \"5.5ohm\"\n\
                 torque_constant = \"0.0105Nm/A\"\ninertia = \"5e-7kgm2\"\ngear = 50\n";
    let (machine, _) = PRESETS[0].toml.split_once("[[drive.motor]]").expect("the preset has a drive");
    let file =
        MachineFile::parse(&format!("{machine}{arm}\n{motor}{first}\n{motor}")).expect("a machine file");
    let machine = file.machine().expect("a machine");
    file.drive(&machine).expect("a drive").expect("a drive table")
}

/// A mass at the elbow turns about the base with the first link only, so that motor 1 moves
/// `m l1²` = 0.5 kg (0.206 m)² and motor 2 none of it: the same as an inertia on its output shaft.
#[test]
fn elbow_mass_of_a_machine_file_is_an_inertia_on_motor_1() {
    let zot = Zot::new();
    let bare = zot.simulate(&data_sheet_drive("", "")).unwrap();
    let masses =
        "[drive.arm]\nlink1 = { mass = \"1e-9kg\" }\nlink2 = { mass = \"1e-9kg\" }\nelbow_mass = \"0.5kg\"\n";
    let arm = zot.simulate(&data_sheet_drive("", masses)).unwrap();
    let lumped = zot.simulate(&data_sheet_drive("load_inertia = \"0.021218kgm2\"", "")).unwrap();
    for (arm, lumped) in arm.outcome.motors.iter().zip(&lumped.outcome.motors) {
        // The equations of the arm are integrated numerically, those of a single motor in closed form.
        assert!((arm.error_rms_ticks / lumped.error_rms_ticks - 1.0).abs() < 0.005, "{arm:?} {lumped:?}");
    }
    let [with, without] = [&arm, &bare].map(|run| run.outcome.motors[0].error_rms_ticks);
    assert!((with / without - 1.0).abs() > 0.05, "the mass has no effect: {with} {without}");
}
