//! The presets against the printed equations of the machine reports (docs/references.md), written
//! here independently of our machine model: positions, counts, start poses, and the points of a
//! listing.

use compiler::machine_file::{MachineFile, PRESETS};
use drawing::Point;
use kinematics::{JointPos, Machine, MotorPos};

fn preset(name: &str) -> Machine {
    let preset = PRESETS.iter().find(|preset| preset.name == name).expect("a preset of this name");
    MachineFile::parse(preset.toml).and_then(|file| file.machine()).expect("a preset is a machine")
}

/// Exact motor positions with the pen at (x, y) mm, in the same full rotation as the start pose.
fn ticks(machine: &Machine, x: f64, y: f64) -> [f64; 2] {
    let pose = machine.pose_near(Point::new(x, y), &machine.start()).expect("within reach");
    machine.motor_positions(&pose).into()
}

/// The pen position with the motors at `ticks`, mm.
fn pen(machine: &Machine, ticks: [f64; 2]) -> [f64; 2] {
    let point = machine.forward_from_motors(&MotorPos::from(ticks));
    [point.x, point.y]
}

fn near(a: [f64; 2], b: [f64; 2], within: f64) -> bool {
    (a[0] - b[0]).abs() <= within && (a[1] - b[1]).abs() <= within
}

/// Coaxial arm (report 1). th1 is the angle of the first arm from +x, counterclockwise; th2 is the
/// fold of the second arm against the direction of the first one, clockwise; the belt couples th1
/// into motor 2.
mod coaxial {
    use super::*;
    use proptest::prelude::*;

    const CPR: f64 = 3200.0;

    /// Appendix D, "order of calculation in code": both angles in degrees for the pen at (x, y).
    fn angles([l1, l2]: [f64; 2], x: f64, y: f64) -> [f64; 2] {
        let l3 = libm::hypot(x, y);
        let th1 = libm::atan2(y, x) + libm::acos((l1 * l1 + l3 * l3 - l2 * l2) / (2.0 * l1 * l3));
        let th2 = std::f64::consts::PI - libm::acos((l1 * l1 + l2 * l2 - l3 * l3) / (2.0 * l1 * l2));
        [th1.to_degrees(), th2.to_degrees()]
    }

    /// Counts of both motors. The report subtracts the last move of the first arm,
    /// `th1 - th1_previous`, from th2, and starts with `th1_previous` = 90. The belt needs the sum
    /// of all moves, which is the same for a first point.
    fn counts([th1, th2]: [f64; 2]) -> [f64; 2] {
        [CPR / 360.0 * th1, CPR / 360.0 * (th2 - (th1 - 90.0))]
    }

    /// The report's sample of a converted drawing starts with `PU 1183x327` for (0, 0) of the
    /// drawing, at the upper left corner of the sheet: x0 right of the base, y0 above it. Of the
    /// values in the report, y0 = 14 in (its usage line) gives these counts; y0 = 14.5 in (Appendix
    /// D) gives 1156x308, for any of the stated arm lengths.
    #[test]
    fn first_point_of_the_reports_sample() {
        let whole = |arms, y0| counts(angles(arms, 0.5, y0)).map(f64::round);
        for l1 in [8.11, 8.1102] {
            for l2 in [10.078, 10.0787, 10.08] {
                assert_eq!(whole([l1, l2], 14.0), [1183.0, 327.0], "L1 {l1}, L2 {l2}");
                assert_eq!(whole([l1, l2], 14.5), [1156.0, 308.0], "L1 {l1}, L2 {l2}");
            }
        }
    }

    #[test]
    fn preset_sheet_corner_matches_the_sample() {
        let machine = preset("coaxial");
        let sheet = machine.sheet();
        assert!(near([sheet.x0, sheet.y1], [0.5 * 25.4, 14.0 * 25.4], 1e-9), "{sheet:?}");
        assert!(near([sheet.width(), sheet.height()], [8.5 * 25.4, 11.0 * 25.4], 1e-9), "{sheet:?}");
        assert_eq!(ticks(&machine, sheet.x0, sheet.y1).map(f64::round), [1183.0, 327.0]);
    }

    #[test]
    fn start_pose_is_straight_up() {
        let machine = preset("coaxial");
        let start: [f64; 2] = machine.motor_positions(&machine.start()).into();
        assert!(near(start, counts([90.0, 0.0]), 1e-9), "{start:?}");
        assert!(near(start, [800.0, 0.0], 1e-9), "{start:?}");
        assert!(near(pen(&machine, start), [0.0, 206.0 + 256.0], 1e-9));
    }

    proptest! {
        #[test]
        fn sheet_points_match_the_reports_counts(x in 12.7..228.6, y in 76.2..355.6) {
            let machine = preset("coaxial");
            let [th1, th2] = angles([206.0, 256.0], x, y);
            let theirs = counts([th1, th2]);
            let ours = ticks(&machine, x, y);
            prop_assert!(near(ours, theirs, 1e-6), "{ours:?}, the report has {theirs:?}");
            prop_assert!(near(pen(&machine, theirs), [x, y], 1e-9));
            // The elbow is on the left of the line from base to pen.
            let (sin, cos) = libm::sincos(th1.to_radians());
            prop_assert!(x * sin - y * cos > 0.0);
        }

        #[test]
        fn angles_match_the_reports_pen_position(th1 in -90.0..270.0, th2 in 0.0..180.0) {
            let (sin1, cos1) = libm::sincos(f64::to_radians(th1));
            let (sin12, cos12) = libm::sincos(f64::to_radians(th1 - th2));
            let theirs = [206.0 * cos1 + 256.0 * cos12, 206.0 * sin1 + 256.0 * sin12];
            let ours = pen(&preset("coaxial"), counts([th1, th2]));
            prop_assert!(near(ours, theirs, 1e-9), "{ours:?}, the report has {theirs:?}");
        }

        /// theta2_{n+1} = theta2_n + theta1_{n+1} - theta1_n: the fold while the second motor is at
        /// rest.
        #[test]
        fn fold_follows_the_first_arm(first in 0.0..1600.0, second in 0.0..1600.0, by in -800.0..800.0_f64) {
            let machine = preset("coaxial");
            let joints = |arm1: f64| machine.joint_positions(&MotorPos::from([arm1, second]));
            let (before, after) = (joints(first), joints(first + by));
            let fold = |q: JointPos| (q[0] - q[1]).to_degrees();
            let th1 = |q: JointPos| q[0].to_degrees();
            prop_assert!((th1(after) - th1(before) - by * 360.0 / CPR).abs() < 1e-9);
            prop_assert!((fold(after) - fold(before) - (th1(after) - th1(before))).abs() < 1e-9);
        }
    }
}

/// H-bot plotter (report 2), equations (1) to (4), over the bed of 250 x 250 mm.
mod hbot {
    use super::*;

    #[test]
    fn equations_1_to_4_round_trip() {
        let machine = preset("hbot");
        let bed = machine.sheet();
        assert_eq!([bed.x0, bed.y0, bed.x1, bed.y1], [0.0, 0.0, 250.0, 250.0]);
        for millimetre in 0..251 * 251 {
            let (x, y) = (f64::from(millimetre % 251), f64::from(millimetre / 251));
            let l = (y + x) * 6200.0 / 500.0;
            let r = (y - x) * 6200.0 / 500.0 + 3100.0;
            assert!(near(ticks(&machine, x, y), [l, r], 1e-9), "{x}, {y}");
            let y_back = (l + r - 3100.0) * 250.0 / 6200.0;
            let x_back = (l - r + 3100.0) * 250.0 / 6200.0;
            assert!(near(pen(&machine, [l, r]), [x_back, y_back], 1e-9), "{l}, {r}");
        }
    }

    #[test]
    fn bed_corners_use_the_full_counter_range() {
        let machine = preset("hbot");
        let corners = [(0.0, 0.0), (250.0, 0.0), (250.0, 250.0), (0.0, 250.0)];
        let counts = corners.map(|(x, y)| ticks(&machine, x, y).map(f64::round));
        assert_eq!(counts, [[0.0, 3100.0], [3100.0, 0.0], [6200.0, 3100.0], [3100.0, 6200.0]]);
        assert_eq!(machine.motor_positions(&machine.start()).0, [0.0, 3100.0], "homed at the lower left");
    }
}

/// CoreXY worktable (report 3) with the motors A and B.
mod corexy {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn counts_are_displacement_times_encoder_ratio(x in 0.0..200.0, y in 0.0..200.0) {
            let enc_ratio = 171.79 * 24.0 / (14.26 * std::f64::consts::PI);
            let machine = preset("corexy");
            let (a, b) = (x + y, x - y);
            let counts = [enc_ratio * a, enc_ratio * b];
            let ours = ticks(&machine, x, y);
            prop_assert!(near(ours, counts, 1e-6), "{ours:?}, the report has {counts:?}");
            prop_assert!(near(pen(&machine, counts), [0.5 * (a + b), 0.5 * (a - b)], 1e-9));
        }
    }

    #[test]
    fn datum_is_zero() {
        let machine = preset("corexy");
        assert_eq!(machine.motor_positions(&machine.start()).0, [0.0, 0.0]);
        assert_eq!(pen(&machine, [0.0, 0.0]), [0.0, 0.0]);
    }
}

/// Polar robot (report 4) with a turning rail and a rack.
mod polar {
    use super::*;
    use assert_cmd::cargo::cargo_bin;
    use proptest::prelude::*;

    /// The pulse of `Servo.write(theta)`, us, and the angle of the other servo after `set_r`,
    /// degrees from its start.
    fn commands(r: f64, theta: f64) -> [f64; 2] {
        [544.0 + theta * (2400.0 - 544.0) / 180.0, (r - 138.0) * 360.0 / 44.0]
    }

    /// The inverse of the listing's r = hypot(x, y) and theta = degrees(atan(x / y)) + 90.
    fn point(r: f64, theta: f64) -> Point {
        let (sin, cos) = libm::sincos((theta - 90.0).to_radians());
        Point::new(r * sin, r * cos)
    }

    proptest! {
        #[test]
        fn half_ring_points_match_the_listings_commands(r in 48.0..138.0, theta in 0.1..179.9) {
            let Point { x, y } = point(r, theta);
            let listing = commands(libm::hypot(x, y), libm::atan(x / y).to_degrees() + 90.0);
            let machine = preset("polar");
            let ours = ticks(&machine, x, y);
            prop_assert!(near(ours, listing, 1e-6), "{ours:?}, the listing has {listing:?}");
            prop_assert!(near(pen(&machine, listing), [x, y], 1e-9));
        }
    }

    #[test]
    fn plan_passes_all_points_of_the_listing() {
        let machine = preset("polar");
        let sheet = machine.sheet();
        let mut vertices = Vec::new();
        for (r, theta) in RADII.into_iter().zip(ANGLES) {
            let Point { x, y } = point(r, theta);
            assert!(near(ticks(&machine, x, y), commands(r, theta), 1e-9), "r {r}, theta {theta}");
            // Plotter units of 0.025 mm; the origin of the drawing is at the corner of the sheet.
            vertices.push(format!("{:.0},{:.0}", (x - sheet.x0) * 40.0, (y - sheet.y0) * 40.0));
        }
        let hpgl = format!("IN;SP1;PU{};PD{},{};PU;", vertices[0], vertices[1..].join(","), vertices[0]);
        let mut program = assert_cmd::Command::new(cargo_bin!("plotplan"));
        program.args(["convert", "-", "--machine", "polar", "--format", "csv"]).write_stdin(hpgl);
        let output = program.assert().success();
        let csv = std::str::from_utf8(&output.get_output().stdout).expect("text");
        let rows: Vec<[i64; 4]> = csv
            .lines()
            .skip_while(|line| !line.starts_with("t_us,"))
            .skip(1)
            .map(|line| line.split(',').map(|field| field.parse().expect("a whole number")))
            .map(|fields| fields.collect::<Vec<_>>().try_into().expect("four columns"))
            .collect();
        // From servo commands to the pen with the listing's equations, 20 points between two rows.
        let ink: Vec<Point> = rows
            .windows(2)
            .filter(|pair| pair[0][1] == 1)
            .flat_map(|pair| (0..20).map(move |part| (pair, f64::from(part) / 20.0)))
            .map(|(pair, part)| {
                let [us, degrees] = [2, 3].map(|motor| {
                    let [from, to] = [pair[0], pair[1]].map(|row| row[motor] as f64);
                    from + part * (to - from)
                });
                point(138.0 + degrees * 44.0 / 360.0, (us - 544.0) * 180.0 / 1856.0)
            })
            .collect();
        // The tolerance, half a us at the largest radius, half a degree of the pinion, half a
        // plotter unit.
        let half_tick =
            [RADII.into_iter().fold(0.0, f64::max) * (90.0 / 1856.0_f64).to_radians(), 22.0 / 360.0];
        let allowed = 0.1 + libm::hypot(half_tick[0], half_tick[1]) + libm::hypot(0.0125, 0.0125);
        for (r, theta) in RADII.into_iter().zip(ANGLES) {
            let p = point(r, theta);
            let off = ink.iter().map(|ink| ink.distance(p)).fold(f64::INFINITY, f64::min);
            assert!(off <= allowed, "r {r}, theta {theta} is missed by {off} mm of {allowed}");
        }
    }

    /// Both arrays of the listing, mm and degrees.
    const RADII: [f64; 129] = [
        87.95, 83.96, 80.49, 76.64, 72.96, 69.64, 67.49, 67.3, 69.54, 73.41, 77.41, 81.18, 84.53, 87.21,
        89.49, 91.99, 95.17, 98.98, 103.07, 107.0, 110.9, 114.51, 117.84, 120.85, 123.56, 125.83, 127.67,
        128.08, 126.31, 122.71, 118.9, 115.59, 112.57, 109.93, 107.47, 104.96, 102.72, 100.35, 98.09, 95.54,
        92.8, 90.13, 87.49, 84.77, 81.93, 79.34, 78.39, 79.19, 81.88, 85.0, 88.53, 92.4, 96.36, 100.01,
        102.2, 101.91, 100.65, 98.75, 96.66, 94.24, 91.6, 88.96, 85.99, 82.45, 78.8, 74.91, 73.34, 74.46,
        76.98, 80.41, 84.33, 88.38, 92.36, 96.06, 98.7, 100.01, 99.89, 99.19, 98.04, 96.1, 93.6, 91.21,
        88.87, 86.93, 85.5, 84.27, 83.2, 82.59, 82.26, 81.35, 80.09, 79.64, 79.77, 80.64, 81.68, 83.23,
        84.92, 87.28, 90.67, 93.25, 95.8, 98.58, 101.43, 98.53, 95.79, 93.24, 90.62, 87.91, 85.42, 84.11,
        86.46, 87.75, 89.93, 92.41, 95.06, 98.11, 101.22, 104.66, 108.36, 112.41, 115.58, 117.3, 117.96,
        117.93, 117.33, 116.3, 115.16, 113.64, 113.28,
    ];
    const ANGLES: [f64; 129] = [
        64.84, 65.4, 65.93, 66.75, 67.99, 69.86, 72.62, 76.1, 79.02, 79.71, 79.17, 77.84, 76.15, 74.14,
        72.43, 74.4, 75.86, 76.67, 76.91, 76.79, 76.16, 75.3, 74.2, 72.91, 71.6, 70.25, 68.6, 66.83, 65.55,
        65.25, 65.8, 66.95, 68.32, 69.89, 71.49, 73.28, 75.02, 76.85, 78.77, 80.63, 82.48, 84.44, 86.34,
        88.28, 90.14, 92.35, 92.64, 90.39, 88.24, 86.58, 85.22, 84.55, 84.74, 85.72, 87.54, 89.82, 92.01,
        94.06, 96.06, 98.01, 99.87, 101.76, 103.58, 105.06, 106.19, 105.45, 102.66, 99.71, 97.32, 96.12,
        95.4, 95.36, 95.82, 96.85, 98.73, 101.11, 103.44, 105.74, 108.03, 110.1, 112.01, 114.11, 116.33,
        118.86, 121.37, 124.2, 127.07, 130.0, 132.87, 135.49, 134.98, 132.11, 129.16, 126.1, 123.35, 120.72,
        118.18, 115.87, 117.4, 119.38, 121.26, 123.06, 124.81, 123.13, 121.36, 119.48, 117.56, 115.65, 113.5,
        112.37, 114.55, 115.64, 113.4, 111.39, 109.62, 108.01, 106.57, 105.37, 104.39, 104.62, 105.87,
        107.75, 109.69, 111.63, 113.57, 115.52, 117.41, 119.29, 119.71,
    ];
}
