//! A good plan holds; each single fault causes exactly one kind of failure.

mod common;

use common::{Plotter, arm, cartesian, drawing, polar, sentences, timing};
use drawing::Drawing;
use kinematics::{JointRange, Machine, Motor};
use plan::Row;
use verify::{Certificate, PenMotion, Timing, Violation, mismatches};

const SQUARE: &[(f64, f64)] = &[(20.0, 20.0), (60.0, 20.0), (60.0, 50.0), (20.0, 50.0), (20.0, 20.0)];
const SLANT: &[(f64, f64)] = &[(80.0, 30.0), (97.3, 71.9)];
const DOT: &[(f64, f64)] = &[(30.0, 35.0)];
const TOLERANCE: f64 = 0.1;

fn picture() -> Drawing {
    drawing(&[(1, SQUARE), (2, SLANT), (1, DOT)])
}

fn good(machine: &Machine) -> Plotter<'_> {
    let mut plotter = Plotter::new(machine);
    plotter.stroke(1, SQUARE).stroke(2, SLANT).stroke(1, DOT).park();
    plotter
}

/// The only failure, and its message.
fn only(certificate: &Certificate) -> (&Violation, String) {
    assert!(!certificate.holds);
    assert_eq!(certificate.failures.len(), 1, "{:#?}", sentences(certificate));
    (&certificate.failures[0].violation, certificate.failures[0].to_string())
}

fn row_where(plotter: &Plotter, holds: impl Fn(usize) -> bool) -> usize {
    (1..plotter.rows.len() - 1).find(|row| holds(*row)).expect("such a row")
}

/// A row in motion, surrounded by rows with the same pen.
fn moving(plotter: &Plotter, pen: u16) -> usize {
    row_where(plotter, |row| {
        (row - 1..=row + 8).all(|k| plotter.rows[k].pen == pen)
            && plotter.rows[row].ticks != plotter.rows[row + 1].ticks
            && plotter.rows[row].ticks != plotter.rows[row - 1].ticks
    })
}

#[test]
fn good_plan_holds_on_a_cartesian_machine() {
    let machine = cartesian();
    let certificate = good(&machine).verify(&picture(), TOLERANCE);
    assert!(certificate.holds, "{:#?}", sentences(&certificate));
    let before = certificate.before_rounding.expect("exact positions were given");
    assert!(before.max_mm() < 0.0005, "{before:?}");
    assert!(certificate.after_rounding.max_mm() < 0.008, "{:?}", certificate.after_rounding);
    assert_eq!(certificate.pens, [1, 2]);
    assert_eq!((certificate.pen_downs, certificate.dots), (3, 1));
    let ink: f64 = picture().length();
    assert!((certificate.ink_mm - ink).abs() < 1e-3, "{} instead of {ink}", certificate.ink_mm);
    assert!((certificate.quantization_error.worst_mm - 0.005 * 2.0_f64.sqrt()).abs() < 1e-12);
    assert!((certificate.quantization_error.rms_mm - 0.01 / 6.0_f64.sqrt()).abs() < 1e-12);
    assert!(certificate.largest_rounding_ticks.expect("exact positions") <= 0.5);
    for motor in &certificate.motors {
        assert!(motor.speed_share <= 1.0 && motor.acceleration_share <= 1.0, "{motor:?}");
        assert!(motor.acceleration_share > 0.5 && motor.acceleration_share_p999 > 0.5, "{motor:?}");
        assert!(motor.speed_share_p999 <= motor.speed_share, "{motor:?}");
    }
}

#[test]
fn good_plan_holds_without_exact_positions() {
    let machine = cartesian();
    let certificate = good(&machine).verify_as(&picture(), TOLERANCE, false);
    assert!(certificate.holds, "{:#?}", sentences(&certificate));
    assert!(certificate.before_rounding.is_none() && certificate.largest_rounding_ticks.is_none());
}

#[test]
fn good_plans_hold_on_an_arm_and_a_polar_machine() {
    let shifted = |by: (f64, f64)| {
        let mut placed = picture();
        placed.transform(drawing::Affine::translate(by));
        placed
    };
    let shift = |points: &[(f64, f64)], by: (f64, f64)| -> Vec<(f64, f64)> {
        points.iter().map(|(x, y)| (x + by.0, y + by.1)).collect()
    };
    for (machine, by) in [(arm(), (30.0, 200.0)), (polar(), (10.0, 10.0))] {
        let mut plotter = Plotter::new(&machine);
        for (pen, points) in [(1, SQUARE), (2, SLANT), (1, DOT)] {
            plotter.stroke(pen, &shift(points, by));
        }
        let certificate = plotter.park().verify(&shifted(by), TOLERANCE);
        assert!(certificate.holds, "{:#?}", sentences(&certificate));
        let before = certificate.before_rounding.expect("exact positions were given");
        // Between rows the pen of these machines moves on curves, which the replay measures.
        assert!(before.max_mm() > 0.001, "{before:?}");
    }
}

#[test]
fn uncovered_segment() {
    let machine = cartesian();
    let mut plotter = Plotter::new(&machine);
    plotter.stroke(1, &SQUARE[..4]).stroke(2, SLANT).stroke(1, DOT).park();
    let certificate = plotter.verify_as(&picture(), TOLERANCE, false);
    let (violation, sentence) = only(&certificate);
    let Violation::Uncovered {
        pen: 1, rounded: true, is_lower_bound: true, uncovered_mm, strokes: 1, ..
    } = violation
    else {
        panic!("{sentence}")
    };
    assert!((uncovered_mm - 30.0).abs() < 0.5, "{sentence}");
    assert_eq!(certificate.failures[0].location.stroke, Some(0));
    assert!(certificate.after_rounding.drawing_to_ink.is_lower_bound);
}

#[test]
fn uncovered_dot() {
    let machine = cartesian();
    let mut plotter = Plotter::new(&machine);
    plotter.stroke(1, SQUARE).stroke(2, SLANT).park();
    let certificate = plotter.verify_as(&picture(), TOLERANCE, false);
    let (violation, sentence) = only(&certificate);
    assert!(
        matches!(violation, Violation::Uncovered { pen: 1, is_lower_bound: true, uncovered_mm: 0.0, .. }),
        "{sentence}"
    );
    let location = certificate.failures[0].location;
    assert_eq!((location.stroke, location.source.map(|span| span.start)), (Some(2), Some(2)));
}

#[test]
fn extra_dot() {
    let machine = cartesian();
    let mut plotter = Plotter::new(&machine);
    plotter.stroke(1, SQUARE).stroke(2, SLANT).stroke(1, DOT).stroke(2, &[(50.0, 40.0)]).park();
    let certificate = plotter.verify_as(&picture(), TOLERANCE, false);
    let (violation, sentence) = only(&certificate);
    assert!(matches!(violation, Violation::Deviates { pen: 2, .. }), "{sentence}");
}

#[test]
fn ink_deviates_by_0_3_mm() {
    let machine = cartesian();
    let mut plotter = Plotter::new(&machine);
    plotter.stroke(1, SQUARE).stroke(2, SLANT);
    // 0.3 mm off the edge and back: the drawing is still covered.
    plotter
        .travel(20.0, 20.0)
        .pen(1)
        .line(30.0, 20.0)
        .line(30.0, 20.3)
        .line(30.0, 20.0)
        .pen(0)
        .stroke(1, DOT)
        .park();
    let certificate = plotter.verify(&picture(), TOLERANCE);
    assert!(
        certificate.failures.iter().all(|f| matches!(f.violation, Violation::Deviates { pen: 1, .. })),
        "{:#?}",
        sentences(&certificate)
    );
    assert_eq!(certificate.failures.len(), 2, "before and after rounding: {:#?}", sentences(&certificate));
    let before = certificate.before_rounding.expect("exact positions");
    assert!((before.ink_to_drawing.max_mm - 0.3).abs() < 0.001, "{before:?}");
    assert!(before.drawing_to_ink.max_mm < 0.001, "{before:?}");
    assert!(before.ink_to_drawing.p99_mm < 0.01, "{before:?}");
    let point = certificate.failures[0].location.point_mm.expect("a point");
    assert!((point.x - 30.0).abs() < 1e-6 && (point.y - 20.3).abs() < 1e-6, "{point:?}");
}

#[test]
fn ink_far_from_the_drawing_is_measured() {
    let machine = cartesian();
    let mut plotter = good(&machine);
    plotter.stroke(1, &[(150.0, 35.0), (160.0, 35.0)]).park();
    let certificate = plotter.verify_as(&picture(), TOLERANCE, false);
    let (violation, sentence) = only(&certificate);
    let Violation::Deviates { distance_mm, .. } = violation else { panic!("{sentence}") };
    assert!((distance_mm - 100.0).abs() < 0.01, "{sentence}");
}

/// The same machine with other limits of motor x.
fn with_motor_x(machine: &Machine, change: impl FnOnce(&mut Motor)) -> Machine {
    let mut parts = machine.parts().clone();
    change(&mut parts.motors[0]);
    Machine::new(parts).expect("a valid machine")
}

fn verify_rows(machine: &Machine, plotter: &Plotter) -> Certificate {
    verify::certify(machine, &picture(), timing(), TOLERANCE, || plotter.rows.iter().map(|row| (*row, None)))
}

#[test]
fn speed_5_percent_above_the_limit() {
    let machine = cartesian();
    let plotter = good(&machine);
    let fastest = verify_rows(&machine, &plotter).motors[0].whole_tick_speed_ticks_s;
    let limited = |limit| with_motor_x(&machine, |x| x.max_speed_ticks_s = limit);
    let certificate = verify_rows(&limited((fastest - 1.0 / 0.01) / 1.05), &plotter);
    let (violation, sentence) = only(&certificate);
    assert!(matches!(violation, Violation::Speed { motor, .. } if motor == "x"), "{sentence}");
    assert!(violation.is_limit());
    // It holds exactly at the limit: the allowance is one tick a period.
    assert!(verify_rows(&limited(fastest - 1.0 / 0.01), &plotter).holds);
}

#[test]
fn jerk_5_percent_above_the_limit() {
    let machine = cartesian();
    let plotter = good(&machine);
    let limited = |limit| with_motor_x(&machine, |x| x.max_jerk_ticks_s3 = Some(limit));
    let certificate = verify_rows(&limited(1e12), &plotter);
    assert!(certificate.holds, "{:#?}", sentences(&certificate));
    assert!(certificate.motors[1].jerk.is_none());
    let peak = certificate.motors[0].jerk.expect("x has a jerk limit");
    assert!(peak.share < 1e-3 && peak.share_p999 <= peak.share, "{peak:?}");
    // The allowance is four ticks a period cubed.
    let hardest = peak.whole_tick_jerk_ticks_s3 - 4e6;
    let certificate = verify_rows(&limited(hardest / 1.05), &plotter);
    let (violation, sentence) = only(&certificate);
    assert!(matches!(violation, Violation::Jerk { motor, .. } if motor == "x"), "{sentence}");
    assert!(violation.is_limit());
    assert!(verify_rows(&limited(hardest), &plotter).holds);
}

/// An abrupt stop has a jerk at the last row, too: the motor is at rest after it.
#[test]
fn jerk_of_the_last_stop() {
    let machine = with_motor_x(&cartesian(), |x| x.max_jerk_ticks_s3 = Some(1e7));
    let mut plotter = Plotter::new(&machine);
    // Steps of 10 and -10 ticks: second differences 10, -20, 10, third ones 10, -30, 30, -10.
    for (k, x) in [(1, 10), (2, 0)] {
        plotter.rows.push(Row { t_us: k * 10_000, pen: 0, ticks: [x, 0] });
    }
    let certificate = verify::certify(&machine, &Drawing::default(), timing(), TOLERANCE, || {
        plotter.rows.iter().map(|row| (*row, None))
    });
    let jerk =
        certificate.failures.iter().find(|failure| matches!(failure.violation, Violation::Jerk { .. }));
    let jerk = jerk.unwrap_or_else(|| panic!("{:#?}", sentences(&certificate)));
    assert_eq!(
        (jerk.count, certificate.motors[0].jerk.map(|peak| peak.whole_tick_jerk_ticks_s3.round())),
        (2, Some(3e7))
    );
}

/// The header's limits are not used: a plan ten times too fast for the machine fails.
#[test]
fn plan_ten_times_too_fast_for_the_machine() {
    let fast = cartesian();
    let plotter = good(&fast);
    let mut parts = fast.parts().clone();
    for motor in &mut parts.motors {
        motor.max_speed_ticks_s /= 10.0;
        motor.max_acceleration_ticks_s2 /= 100.0;
    }
    let slow = Machine::new(parts).expect("a valid machine");
    let header = common::header(&fast);
    let certificate = verify::certify(&slow, &picture(), &header, TOLERANCE, || {
        plotter.rows.iter().map(|row| (*row, None))
    });
    let kinds = |holds: fn(&Violation) -> bool| {
        certificate.failures.iter().filter(|failure| holds(&failure.violation)).count()
    };
    assert_eq!(kinds(|violation| matches!(violation, Violation::Speed { .. })), 2);
    assert_eq!(kinds(|violation| matches!(violation, Violation::Acceleration { .. })), 2);
    assert_eq!(
        mismatches(&slow, &header).iter().map(ToString::to_string).collect::<Vec<_>>(),
        [
            "motor x: speed limit of 10000 ticks/s in the plan, of 1000 ticks/s in the machine",
            "motor x: acceleration limit of 100000 ticks/s^2 in the plan, of 1000 ticks/s^2 in the machine",
            "motor y: speed limit of 10000 ticks/s in the plan, of 1000 ticks/s in the machine",
            "motor y: acceleration limit of 100000 ticks/s^2 in the plan, of 1000 ticks/s^2 in the machine",
        ]
    );
    assert_eq!(mismatches(&fast, &header), []);
}

/// A long stated period would soften stops: rows that are omitted count as one period of rest.
#[test]
fn stated_period_longer_than_the_steps() {
    let machine = cartesian();
    let plotter = good(&machine);
    let edited = Timing { period_us: 10_000_000, ..timing() };
    let certificate = verify::certify(&machine, &picture(), edited, TOLERANCE, || {
        plotter.rows.iter().map(|row| (*row, None))
    });
    let (violation, sentence) = only(&certificate);
    assert_eq!(violation, &Violation::Period { dt_us: 10_000, period_us: 10_000_000 }, "{sentence}");
}

#[test]
fn acceleration_of_one_displaced_row() {
    let machine = cartesian();
    let mut plotter = good(&machine);
    // One row displaced by 13 ticks: a second difference of 2 * 13 ticks, where 10 + 2 are allowed.
    let row = row_where(&plotter, |row| {
        row > 12
            && (row - 1..=row + 8).all(|k| plotter.rows[k].pen == 0)
            && plotter.rows[row].ticks[0] != plotter.rows[row + 1].ticks[0]
            && plotter.rows[row].ticks[0] != plotter.rows[row - 1].ticks[0]
            && (plotter.rows[row].ticks[0] - plotter.rows[row - 1].ticks[0]).abs() < 50
    });
    plotter.rows[row].ticks[0] += 13;
    let certificate = plotter.verify_as(&picture(), TOLERANCE, false);
    let (violation, sentence) = only(&certificate);
    assert!(matches!(violation, Violation::Acceleration { motor, .. } if motor == "x"), "{sentence}");
    assert_eq!(certificate.failures[0].location.row, Some(row as u64));
}

#[test]
fn time_does_not_increase() {
    let machine = cartesian();
    for back in [0, 1] {
        let mut plotter = good(&machine);
        let row = moving(&plotter, 1);
        let mut again = plotter.rows[row];
        again.t_us -= back;
        plotter.rows.insert(row + 1, again);
        let certificate = plotter.verify_as(&picture(), TOLERANCE, false);
        let (violation, sentence) = only(&certificate);
        assert!(matches!(violation, Violation::Time { .. }), "{sentence}");
        assert_eq!(certificate.failures[0].location.row, Some(row as u64 + 1));
    }
}

#[test]
fn time_does_not_start_at_zero() {
    let machine = cartesian();
    let mut plotter = good(&machine);
    plotter.rows.iter_mut().for_each(|row| row.t_us += 5);
    let (certificate, expected) =
        (plotter.verify_as(&picture(), TOLERANCE, false), Violation::TimeStart { t_us: 5 });
    assert_eq!(only(&certificate).0, &expected);
}

#[test]
fn motors_move_during_a_drop() {
    let machine = cartesian();
    let mut plotter = good(&machine);
    // The pen is lowered one row late.
    let down = row_where(&plotter, |row| plotter.rows[row].pen == 1);
    let mut late = plotter.rows[down];
    plotter.rows[down].pen = 0;
    late.t_us += 10_000;
    plotter.rows.insert(down + 1, late);
    let certificate = plotter.verify_as(&picture(), TOLERANCE, false);
    let (violation, sentence) = only(&certificate);
    assert_eq!(
        violation,
        &Violation::MovesDuringPen { motion: PenMotion::Drop, pen: 1, early_us: 10_000 },
        "{sentence}"
    );
}

#[test]
fn motors_move_during_a_lift() {
    let machine = cartesian();
    let mut plotter = good(&machine);
    let up = row_where(&plotter, |row| plotter.rows[row - 1].pen == 1 && plotter.rows[row].pen == 0);
    let mut late = plotter.rows[up];
    plotter.rows[up].pen = 1;
    late.t_us += 1;
    plotter.rows.insert(up + 1, late);
    let certificate = plotter.verify_as(&picture(), TOLERANCE, false);
    let (violation, sentence) = only(&certificate);
    assert_eq!(
        violation,
        &Violation::MovesDuringPen { motion: PenMotion::Lift, pen: 1, early_us: 1 },
        "{sentence}"
    );
}

#[test]
fn wrong_pen() {
    let machine = cartesian();
    let mut plotter = Plotter::new(&machine);
    plotter.stroke(1, SQUARE).stroke(3, SLANT).stroke(1, DOT).park();
    let certificate = plotter.verify_as(&picture(), TOLERANCE, false);
    let violations: Vec<_> = certificate.failures.iter().map(|failure| &failure.violation).collect();
    assert!(
        matches!(violations[..], [Violation::ForeignPen { pen: 3 }, Violation::Uncovered { pen: 2, .. }]),
        "{violations:#?}"
    );
    assert_eq!(certificate.pens, [1, 3]);
}

#[test]
fn pen_change_takes_lift_and_drop_time() {
    let machine = cartesian();
    let mut plotter = Plotter::new(&machine);
    let picture = drawing(&[(1, &[(10.0, 10.0), (20.0, 10.0)]), (2, &[(20.0, 10.0), (20.0, 20.0)])]);
    plotter.travel(10.0, 10.0).pen(1).line(20.0, 10.0).pen(2);
    let mut patient = plotter.clone();
    plotter.line(20.0, 20.0).pen(0).park();
    let certificate = plotter.verify_as(&picture, TOLERANCE, false);
    assert_eq!(
        only(&certificate).0,
        &Violation::MovesDuringPen { motion: PenMotion::Change, pen: 2, early_us: 150_000 }
    );
    patient.rest(0.15).line(20.0, 20.0).pen(0).park();
    assert!(patient.verify(&picture, TOLERANCE).holds);
}

#[test]
fn wrong_start_pose() {
    let machine = cartesian();
    let mut plotter = good(&machine);
    plotter.rows[0].ticks = [1, 0];
    let certificate = plotter.verify_as(&picture(), TOLERANCE, false);
    let expected = Violation::StartPose { found: [1, 0], expected: [0, 0] };
    assert_eq!(only(&certificate).0, &expected);
}

#[test]
fn wrong_park_pose() {
    let machine = cartesian();
    let mut plotter = Plotter::new(&machine);
    plotter.stroke(1, SQUARE).stroke(2, SLANT).stroke(1, DOT);
    let certificate = plotter.verify_as(&picture(), TOLERANCE, false);
    let expected = Violation::ParkPose { found: [3000, 3500], expected: [0, 0] };
    assert_eq!(only(&certificate).0, &expected);
}

#[test]
fn plan_starts_in_motion() {
    let machine = cartesian();
    let mut plotter = Plotter::new(&machine);
    plotter.travel(25.0, 0.0).stroke(1, SQUARE).stroke(2, SLANT).stroke(1, DOT).park();
    // Without the first rows the plan starts at full speed.
    let fast = row_where(&plotter, |row| plotter.rows[row].ticks[0] >= 600);
    let (cut, at) = (plotter.rows[fast].t_us - 10_000, plotter.rows[fast].ticks[0]);
    plotter.rows.drain(1..fast);
    plotter.rows[1..].iter_mut().for_each(|row| row.t_us -= cut);
    plotter.rows[0].ticks = [at - (plotter.rows[2].ticks[0] - at), 0];
    let certificate = plotter.verify_as(&picture(), TOLERANCE, false);
    let violations: Vec<_> = certificate.failures.iter().map(|failure| &failure.violation).collect();
    assert!(
        matches!(violations[..], [Violation::StartPose { .. }, Violation::RestAtStart { .. }]),
        "{violations:#?}"
    );
}

#[test]
fn plan_ends_in_motion() {
    let machine = cartesian();
    let mut plotter = good(&machine);
    let rows = plotter.rows.len() - 12;
    plotter.rows.truncate(rows);
    let certificate = verify_rows(&machine, &plotter);
    let count = |holds: fn(&Violation) -> bool| {
        certificate.failures.iter().filter(|failure| holds(&failure.violation)).count()
    };
    let (at_rest, parked) = (
        count(|violation| matches!(violation, Violation::RestAtEnd { .. })),
        count(|violation| matches!(violation, Violation::ParkPose { .. })),
    );
    assert!(at_rest >= 1 && parked == 1, "{:#?}", sentences(&certificate));
    assert_eq!(certificate.failures.len(), at_rest + parked, "{:#?}", sentences(&certificate));
}

#[test]
fn pen_down_in_first_and_last_row() {
    let machine = cartesian();
    let dot = drawing(&[(1, &[(0.0, 0.0)])]);
    let mut plotter = Plotter::new(&machine);
    plotter.rows[0].pen = 1;
    plotter.rest(0.2);
    let certificate = plotter.verify(&dot, TOLERANCE);
    let violations: Vec<_> = certificate.failures.iter().map(|failure| &failure.violation).collect();
    assert_eq!(violations, [&Violation::PenAtStart { pen: 1 }, &Violation::PenAtEnd { pen: 1 }]);
}

#[test]
fn joint_limit() {
    let mut parts = cartesian().parts().clone();
    parts.joints[0] = JointRange { min: 0.0, max: 97.0 };
    let machine = Machine::new(parts).expect("a sound machine");
    let free = cartesian();
    let plotter = good(&free);
    let mut verifier = verify::Verifier::new(&machine, &picture(), timing(), TOLERANCE);
    plotter.rows.iter().for_each(|row| verifier.row(*row, None));
    let certificate = verifier.finish();
    let (violation, sentence) = only(&certificate);
    assert!(matches!(violation, Violation::Joint { .. }), "{sentence}");
    assert!(certificate.failures[0].count > 1, "{sentence}");
}

#[test]
fn half_a_tick_beyond_a_joint_limit_is_allowed() {
    let mut parts = cartesian().parts().clone();
    parts.joints[0] = JointRange { min: 0.0, max: 97.2956 };
    let machine = Machine::new(parts).expect("a sound machine");
    let picture = drawing(&[(1, &[(80.0, 30.0), (97.2956, 71.9)])]);
    let mut plotter = Plotter::new(&machine);
    plotter.stroke(1, &[(80.0, 30.0), (97.2956, 71.9)]).park();
    assert!(plotter.rows.iter().any(|row| row.ticks[0] == 9730));
    let certificate = plotter.verify(&picture, TOLERANCE);
    assert!(certificate.holds, "{:#?}", sentences(&certificate));
}

#[test]
fn drift_of_rounding() {
    let machine = cartesian();
    let mut plotter = good(&machine);
    let row = moving(&plotter, 1);
    plotter.rows[row].ticks[0] += 1;
    let certificate = plotter.verify(&picture(), TOLERANCE);
    let (violation, sentence) = only(&certificate);
    assert!(matches!(violation, Violation::Drift { motor, .. } if motor == "x"), "{sentence}");
}

#[test]
fn empty_plan_and_empty_drawing() {
    let machine = cartesian();
    let verifier = verify::Verifier::new(&machine, &Drawing::default(), timing(), TOLERANCE);
    let certificate = verifier.finish();
    assert_eq!(only(&certificate).0, &Violation::Empty);
    // A plan at rest draws the empty drawing.
    let certificate = Plotter::new(&machine).rest(1.0).verify(&Drawing::default(), TOLERANCE);
    assert!(certificate.holds, "{:#?}", sentences(&certificate));
}

#[test]
fn non_finite_numbers() {
    let machine = cartesian();
    let broken = drawing(&[(1, &[(f64::NAN, 0.0), (1.0, 1.0)])]);
    let certificate = Plotter::new(&machine).rest(1.0).verify(&broken, TOLERANCE);
    assert_eq!(only(&certificate).0, &Violation::NotFinite);
    for tolerance in [f64::NAN, -1.0] {
        assert!(!good(&machine).verify(&picture(), tolerance).holds, "{tolerance}");
    }
    let mut plotter = good(&machine);
    let row = moving(&plotter, 1);
    plotter.rows[row].ticks = [i64::MAX, i64::MIN];
    assert!(!plotter.verify(&picture(), TOLERANCE).holds);
}

#[test]
fn failure_messages() {
    let machine = cartesian();
    let mut plotter = Plotter::new(&machine);
    plotter.stroke(1, &SQUARE[..4]).stroke(1, DOT).stroke(4, SLANT);
    let certificate = plotter.verify_as(&picture(), TOLERANCE, false);
    assert_eq!(
        sentences(&certificate),
        [
            "pen 4 draws, but the drawing has no stroke of this pen, at 3.930000 s, row 327, at 80.00, 30.00 mm",
            "the plan ends at 9730, 7190 ticks instead of the start pose 0, 0, at 4.960000 s, row 397, at 97.30, 71.90 mm",
            "29.80 mm of pen 1 in 1 stroke are not drawn: the ink is more than 0.1338 mm away after rounding \
             to ticks (allowed 0.1071 mm), at 20.00, 49.86 mm, stroke 0 (bytes 0 to 1)",
            "45.33 mm of pen 2 in 1 stroke are not drawn: the ink is more than 0.1338 mm away after rounding \
             to ticks (allowed 0.1071 mm), at 80.00, 30.01 mm, stroke 1 (bytes 1 to 2)",
        ]
    );
}
