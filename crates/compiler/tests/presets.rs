//! Every preset draws over its whole sheet, and what it draws is certified.

use compiler::machine_file::{MachineFile, PRESETS, Preset};
use compiler::pipeline::{Order, Request, compile};
use drawing::{Drawing, EllipticArc, Pen, Point, Span, Stroke, Vec2};
use kinematics::{JointRange, Machine, MotorPos, reach_outlines};
use planner::{PlacementOptions, Scale, TimingLaw};
use test_support::polyline;

fn machine(preset: &Preset) -> Machine {
    MachineFile::parse(preset.toml).and_then(|file| file.machine()).expect(preset.name)
}

/// The presets whose sheet is a box around a reach that does not fill it.
const SHEET_BEYOND_REACH: [&str; 1] = ["polar"];

#[test]
fn sheets_are_within_reach() {
    for preset in PRESETS.iter().filter(|preset| !SHEET_BEYOND_REACH.contains(&preset.name)) {
        let (machine, parts) = (machine(preset), 40);
        let sheet = machine.sheet();
        for k in 0..(parts + 1) * (parts + 1) {
            let share = |k: i32| f64::from(k) / f64::from(parts);
            let (x, y) = (share(k % (parts + 1)), share(k / (parts + 1)));
            let p = Point::new(sheet.x0 + x * sheet.width(), sheet.y0 + y * sheet.height());
            machine.check_point(p).unwrap_or_else(|error| panic!("{}: {error}", preset.name));
        }
    }
}

/// Outlines of the reach hold the sheet; what a joint limits ends there.
#[test]
fn outlines_hold_the_sheet() {
    for preset in PRESETS.iter().filter(|preset| !SHEET_BEYOND_REACH.contains(&preset.name)) {
        let machine = machine(preset);
        let outlines = reach_outlines(&machine);
        assert!(!outlines.is_empty(), "{}", preset.name);
        let inside =
            outlines.iter().filter(|outline| winds_around(outline, machine.sheet().center())).count();
        assert_eq!(inside % 2, 1, "{}", preset.name);
    }
}

fn winds_around(outline: &[Point], p: Point) -> bool {
    let edges = outline.iter().zip(outline.iter().cycle().skip(1));
    let crossings = edges
        .filter(|(a, b)| (a.y > p.y) != (b.y > p.y) && a.x + (p.y - a.y) / (b.y - a.y) * (b.x - a.x) > p.x);
    crossings.count() % 2 == 1
}

#[test]
fn plans_over_the_sheet_are_certified() {
    for preset in PRESETS.iter().filter(|preset| !SHEET_BEYOND_REACH.contains(&preset.name)) {
        let machine = machine(preset);
        let sheet = machine.sheet();
        let size = sheet.width().min(sheet.height());
        let mut circle = Stroke::new(Pen(2), Point::new(0.9, 0.5), Span::default());
        circle.arc(EllipticArc::circular(Point::new(0.5, 0.5), 0.4, 0.0, std::f64::consts::TAU));
        let cross = polyline([(0.02, 0.02), (0.98, 0.98), (0.98, 0.02), (0.02, 0.98)]);
        let drawing = Drawing::from(vec![cross, circle]);
        let request = Request {
            tolerance_mm: 0.1,
            period_us: 10_000,
            order: Order::File,
            placement: PlacementOptions {
                scale: Scale::Explicit { factor: size, origin_mm: Vec2::ZERO },
                ..PlacementOptions::default()
            },
            search: None,
            crop: None,
            pen_speeds: Vec::new(),
            pen_colors: std::collections::BTreeMap::new(),
            lift_overlap_s: 0.0,
            timing_law: TimingLaw::default(),
            rounding: planner::Rounding::Path,
            joint_fit: true,
            allow_over_limit: false,
        };
        let compiled = compile(&drawing, &machine, &request, &|_| ());
        let compiled = compiled.unwrap_or_else(|error| panic!("{}: {error:?}", preset.name));
        assert!(compiled.certificate.holds, "{}: {:?}", preset.name, compiled.certificate.failures);
    }
}

fn preset(name: &str) -> Machine {
    machine(PRESETS.iter().find(|preset| preset.name == name).expect(name))
}

/// The pen of a BrachioGraph at these pulses, by its program's equations: angles clockwise from +y, the
/// elbow's from the inner arm, 10 us a degree, -90 and 90 degrees at 1500 us.
#[test]
fn brachiograph_preset_agrees_with_its_program() {
    let machine = preset("brachiograph");
    for (first, second) in [(1500.0, 1500.0), (1234.0, 1600.0), (900.0, 1750.0)] {
        let shoulder = (-90.0 - (first - 1500.0) / 10.0_f64).to_radians();
        let elbow = (90.0 + (second - 1500.0) / 10.0_f64).to_radians();
        let pen = 80.0 * Vec2::new(libm::sin(shoulder), libm::cos(shoulder))
            + 80.0 * Vec2::new(libm::sin(shoulder + elbow), libm::cos(shoulder + elbow));
        let ours = machine.forward_from_motors(&MotorPos::new(first, second));
        assert!((ours - pen.to_point()).hypot2() < 1e-18, "{ours:?} {pen:?}");
    }
}

/// Motor 1 of an AxiDraw is x + down, motor 2 x - down; 2032 steps an inch.
#[test]
fn axidraw_preset_agrees_with_its_program() {
    let machine = preset("axidraw");
    let motors =
        machine.motor_positions(&machine.pose_near(Point::new(25.4, -50.8), &machine.start()).unwrap());
    assert!((motors - MotorPos::new(3.0 * 2032.0, -2032.0)).norm() < 1e-9, "{motors:?}");
}

/// The motor on the elbow moves when the elbow bends, not when the shoulder turns.
#[test]
fn serial_arm_couples_the_elbow_to_its_own_motor() {
    let machine = preset("serial-arm");
    let turned = machine.motor_positions(&(machine.start() + kinematics::JointPos::new(0.3, 0.3)))
        - machine.motor_positions(&machine.start());
    assert!(turned[1].abs() < 1e-9 && (turned[0] - 0.3 * 3200.0 / std::f64::consts::TAU).abs() < 1e-9);
    assert_ne!(machine.parts().joints[0], JointRange::FREE);
}

/// 0 is refused with a reason where a mechanism has singular poses; the least value that is not works.
#[test]
fn dexterity_of_zero_is_refused() {
    let arm = |least: &str| {
        let toml = PRESETS[0].toml.replace("min_dexterity = 0.1", &format!("min_dexterity = {least}"));
        MachineFile::parse(&toml).and_then(|file| file.machine())
    };
    let error = arm("0").unwrap_err().to_string();
    assert!(error.contains("min_dexterity must be at least 0.001") && error.contains("singular"), "{error}");
    arm("0.001").unwrap().check_point(Point::new(0.0, 461.99)).unwrap();
}

#[test]
fn workspace_report_suggests_a_start_and_doubts_limits() {
    let arm = compiler::report::WorkspaceReport::of(&preset("coaxial"));
    assert!(arm.start_manipulability < 1e-6, "straight up is stretched");
    assert!(arm.suggested_start_mm.is_some());
    assert!(arm.doubts.is_empty(), "{:?}", arm.doubts);
    let [least, median, greatest] = arm.tick_floor_mm.expect("the sheet is within reach");
    assert!(least < median && median < greatest && greatest < 0.4537);
    let mut parts = preset("coaxial").parts().clone();
    parts.motors[0].max_acceleration_ticks_s2 = 50.0;
    parts.motors[1].max_speed_ticks_s = 20.0;
    let doubts = compiler::report::WorkspaceReport::of(&Machine::new(parts).expect("a machine")).doubts;
    assert_eq!(doubts.len(), 2, "{doubts:?}");
    assert!(doubts[0].contains("10.7 s") && doubts[1].contains("less than a tick"), "{doubts:?}");
    let corexy = compiler::report::WorkspaceReport::of(&preset("corexy"));
    assert_eq!(corexy.suggested_start_mm, None);
    assert_eq!(corexy.reach_mm, Some([0.0, 0.0, 200.0, 200.0]));
}
