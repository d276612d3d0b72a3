//! The cost of jerk limits against motion without them, on the same path: `cargo test -p
//! plotplan-planner --release --test jerk -- --nocapture` prints the table of docs/planning.md.

use drawing::{EllipticArc, Pen, Point, Span, Stroke};
use kinematics::Machine;
use planner::unstable::JointPath;
use planner::unstable::{CornerBlend, PathBudget, sections};
use planner::unstable::{SpeedCap, profile};
use test_support::machines;

const BUDGET: PathBudget = PathBudget {
    chord_mm: 0.01,
    simplify_mm: 0.0,
    blend_mm: 0.05,
    corner: CornerBlend::Spline,
    row_mm: f64::INFINITY,
};

fn polyline(points: &[(f64, f64)]) -> Stroke {
    let points = points.iter().map(|&(x, y)| Point::new(x, y)).collect();
    Stroke::polyline(Pen(1), points, Span::default()).expect("there are points")
}

fn shapes() -> [(&'static str, Stroke); 5] {
    let mut circle = polyline(&[(40.0, 80.0), (60.0, 80.0)]);
    let down = -std::f64::consts::FRAC_PI_2;
    circle.arc(EllipticArc::circular(Point::new(60.0, 90.0), 10.0, down, 5.0));
    let wave = |k: u32| (40.0 + 0.5 * f64::from(k), 90.0 + 6.0 * libm::sin(0.3 * f64::from(k)));
    [
        ("line", polyline(&[(40.0, 80.0), (75.0, 82.0)])),
        ("corners", polyline(&[(40.0, 80.0), (75.0, 82.0), (72.0, 104.0), (50.0, 90.0), (45.0, 110.0)])),
        ("line and circle", circle),
        ("wave", polyline(&(0..60).map(wave).collect::<Vec<_>>())),
        ("0.03 mm", polyline(&[(40.0, 80.0), (40.03, 80.01)])),
    ]
}

fn time(machine: &Machine, stroke: &Stroke) -> f64 {
    let mut near = machine.start();
    let mut time = 0.0;
    for section in sections(stroke, &BUDGET) {
        let (start, end) = (section[0].curve.start(), section[section.len() - 1].curve.end());
        let pose = machine.pose_near(start, &near).expect("within reach");
        let path = JointPath::from_section(machine, section, pose, 0.1).expect("within reach");
        let cap = SpeedCap { pen_mm_s: 60.0, row_deviation_mm: f64::INFINITY, period_s: 1e-3 };
        time += profile(machine, &path, &cap).duration_s;
        near = machine.pose_near(end, &pose).expect("within reach");
    }
    time
}

#[test]
fn jerk_limits_duration_ratios() {
    println!("machine path                 0 ms     5 ms    20 ms   100 ms");
    let mut wrong = Vec::new();
    for (name, machine) in
        [("arm", machines::arm()), ("corexy", machines::corexy()), ("polar", machines::polar())]
    {
        for (shape, stroke) in shapes() {
            let least = time(&machine, &stroke);
            let builds = [0.005, 0.02, 0.1];
            let times = builds.map(|build_up| time(&machines::with_jerk(&machine, build_up), &stroke));
            let ratios = times.map(|time| format!("{:8.4}", time / least));
            println!("{name:<7} {shape:<16} {least:>8.4} {}", ratios.join(" "));
            // A stop costs at most one build-up of the acceleration; so does every corner, where a
            // motor changes its acceleration. Speeds and other limits are the same.
            for (time, build_up) in times.iter().zip(builds) {
                let most = if shape == "0.03 mm" { 5.0 } else { 1.1 + 18.0 * build_up };
                if !(*time >= least * (1.0 - 1e-6) && *time <= most * least) {
                    wrong.push(format!("{name}, {shape}: {time} s with {build_up} s, {least} s without"));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}
