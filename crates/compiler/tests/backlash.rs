//! Plans for machines with backlash: the simulation's backlash, which knows nothing of plans, gets the
//! motors' ticks, and its ink is compared with the drawing.

use std::collections::BTreeMap;

use compiler::import;
use compiler::machine_file::{MachineFile, PRESETS};
use compiler::pipeline::{self, Order, Request};
use compiler::simulate::{Plan, simulate};
use drawing::Drawing;
use kinematics::{Machine, MachineParts, Motor};
use plan::Row;
use planner::{PlacementOptions, PlanError, Rounding, Scale, TimingLaw};
use simulation::{Drive, MotorPlant};

const TOLERANCE_MM: f64 = 0.1;

fn preset(name: &str) -> Machine {
    let preset = PRESETS.iter().find(|preset| preset.name == name).expect("a preset");
    MachineFile::parse(preset.toml).and_then(|file| file.machine()).expect("a machine")
}

/// With this backlash of each motor, ticks, and as jerk limit the acceleration in this time, s.
fn with_backlash(machine: &Machine, backlash_ticks: [f64; 2], jerk_s: Option<f64>) -> Machine {
    let motor = |index: usize| {
        let motor = machine.motors()[index].clone();
        let max_jerk_ticks_s3 = jerk_s.map(|time_s| motor.max_acceleration_ticks_s2 / time_s);
        Motor { backlash_ticks: backlash_ticks[index], max_jerk_ticks_s3, ..motor }
    };
    Machine::new(MachineParts { motors: [motor(0), motor(1)], ..machine.parts().clone() }).expect("a machine")
}

fn drawing(hpgl: &[u8]) -> Drawing {
    import::read(hpgl, &import::Options::default()).expect("a drawing").pages.remove(0).drawing
}

/// Curves whose motors reverse in the middle of strokes, corners, dots and travel.
const SHAPES: &[u8] =
    b"IN;SP1;PU2000,2000;CI700;PU600,600;PD3400,600,3400,3400,600,3400,600,600;PU1500,2500;\
    PD1500,2500;PU1000,1000;PD1400,3000,1800,1000,2200,3000,2600,1000;PU3000,1500;CI60;PU;SP0;";

fn request(timing_law: TimingLaw) -> Request {
    Request {
        tolerance_mm: TOLERANCE_MM,
        period_us: 10_000,
        order: Order::Optimize(ordering::Options::default()),
        placement: PlacementOptions { scale: Scale::Fit, ..PlacementOptions::default() },
        search: None,
        crop: None,
        pen_speeds: Vec::new(),
        pen_colors: BTreeMap::new(),
        lift_overlap_s: 0.0,
        timing_law,
        rounding: Rounding::Path,
        joint_fit: true,
        allow_over_limit: false,
    }
}

/// Largest distance of simulated ink from the drawing and of the drawing from the ink, mm: ideal motors
/// with `backlash_ticks`.
fn simulated_mm(machine: &Machine, rows: &[Row], drawn: &Drawing, backlash_ticks: [f64; 2]) -> f64 {
    let mut drive = Drive::proportional(MotorPlant::Ideal, 1.0, 0.01);
    for (motor, backlash_ticks) in drive.motors.iter_mut().zip(backlash_ticks) {
        motor.backlash_ticks = backlash_ticks;
    }
    let plan = Plan { machine, rows, period_us: 10_000, drawing: drawn };
    let ink = simulate(&plan, &drive, |_| {}).expect("a simulation").ink;
    ink.stray.max_mm.max(ink.missed.max_mm)
}

#[test]
fn backlash_in_the_simulation_leaves_ink_of_compensated_plans_within_tolerance() {
    let shapes = drawing(SHAPES);
    let zot = drawing(include_bytes!("../../../examples/zot.hpgl"));
    for (name, backlash, jerk_s, drawn) in [
        ("corexy", [24.0, 31.5], None, &shapes),
        ("corexy", [24.0, 0.0], Some(0.03), &shapes),
        ("coaxial", [6.0, 4.0], None, &zot),
        ("coaxial", [0.0, 9.3], Some(0.02), &shapes),
        ("five-bar", [40.0, 25.0], None, &shapes),
        ("polar", [5.0, 7.0], None, &shapes),
        ("polargraph", [12.0, 12.0], None, &shapes),
    ] {
        let ideal = preset(name);
        let machine = with_backlash(&ideal, backlash, jerk_s);
        let request = request(TimingLaw::TimeOptimal);
        let compiled = pipeline::compile(drawn, &machine, &request, &|_| {}).unwrap();
        // The verifier's motors have the same backlash, and their limits hold.
        assert!(compiled.certificate.holds, "{name}: {:?}", compiled.certificate.failures);
        let allowed_mm = TOLERANCE_MM + compiled.certificate.quantization_error.worst_mm + 1e-6;
        let rows: Vec<Row> = compiled.trajectory.rows().map(|row| row.row).collect();
        let with = simulated_mm(&machine, &rows, compiled.ordered(), backlash);
        assert!(with <= allowed_mm, "{name}: {with} mm, allowed {allowed_mm}");

        // The same drawing planned for motors without backlash is not within tolerance.
        let plain = pipeline::compile(drawn, &ideal, &request, &|_| {}).unwrap();
        let rows: Vec<Row> = plain.trajectory.rows().map(|row| row.row).collect();
        let without = simulated_mm(&ideal, &rows, plain.ordered(), backlash);
        assert!(without > 1.5 * allowed_mm, "{name}: {without} mm without compensation");
        println!("{name}: {with:.3} mm with, {without:.3} mm without compensation, allowed {allowed_mm:.3}");
    }
}

#[test]
fn plan_without_lead_is_refused_by_the_verifier_of_a_machine_with_backlash() {
    let (ideal, shapes) = (preset("corexy"), drawing(SHAPES));
    let machine = with_backlash(&ideal, [40.0, 40.0], None);
    let request = request(TimingLaw::TimeOptimal);
    let plain = pipeline::compile(&shapes, &ideal, &request, &|_| {}).unwrap();
    let certify = |machine: &Machine| {
        verify::certify(machine, plain.ordered(), &plain.header, TOLERANCE_MM, || {
            plain.trajectory.rows().map(|row| (row.row, None))
        })
    };
    assert!(certify(&ideal).holds);
    let certificate = certify(&machine);
    assert!(!certificate.holds);
    // Half of 40 ticks of 92 a mm on both motors.
    assert!(certificate.after_rounding.max_mm() > 0.2, "{}", certificate.after_rounding.max_mm());
}

#[test]
fn backlash_of_a_line_between_vertices_is_taken_up_at_its_ends() {
    let ideal = preset("cartesian");
    let machine = with_backlash(&ideal, [20.0, 20.0], None);
    let request = Request { rounding: Rounding::Nearest, ..request(TimingLaw::Trapezoid) };
    let line = drawing(b"IN;SP1;PU1000,1000;PD3000,1000;PD1000,1000;PU;");
    let compiled = pipeline::compile(&line, &machine, &request, &|_| {}).unwrap();
    assert!(compiled.certificate.holds, "{:?}", compiled.certificate.failures);
    let rows: Vec<Row> = compiled.trajectory.rows().map(|row| row.row).collect();
    let extent = |rows: &[Row]| {
        let x = rows.iter().map(|row| row.ticks[0]);
        x.clone().max().unwrap() - x.min().unwrap()
    };
    let plain = pipeline::compile(&line, &ideal, &request, &|_| {}).unwrap();
    let plain: Vec<Row> = plain.trajectory.rows().map(|row| row.row).collect();
    // 10 ticks ahead in each direction.
    assert_eq!(extent(&rows), extent(&plain) + 20);
    assert_eq!(rows.first().unwrap().ticks, rows.last().unwrap().ticks);
}

#[test]
fn fixed_durations_are_refused_with_backlash() {
    let machine = with_backlash(&preset("corexy"), [20.0, 20.0], None);
    let law = TimingLaw::FixedDuration { easing: planner::Easing::Linear, segment_time_s: 0.5 };
    let refused = pipeline::compile(&drawing(SHAPES), &machine, &request(law), &|_| {});
    assert!(matches!(refused, Err(PlanError::Setting { .. })), "{:?}", refused.err());
}
