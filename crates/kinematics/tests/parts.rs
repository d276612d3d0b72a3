//! Parts of machines that other crates use: homing, the pen's servo, play; by hand.

use drawing::Rect;
use kinematics::{
    Homing, HomingAxis, HomingMethod, HomingMove, Machine, MachineParts, Motor, PenServo, Play, Polar,
};
use test_support::machines;

/// A polar arm with motors of 500 ticks/rad and 40 ticks/mm.
fn parts() -> MachineParts {
    let motors = [Motor::new("a", 500.0, 1.0, 5.0), Motor::new("b", 40.0, 100.0, 500.0)];
    MachineParts::new("test", Polar::default(), motors, Rect::new(100.0, 100.0, 200.0, 200.0))
}

/// Towards a switch at 20 mm/s, back 4 mm, and slowly again.
fn approach(axis: HomingAxis, switch: Option<&str>) -> HomingMove {
    HomingMove {
        axis,
        switch: switch.map(str::to_owned),
        speed: -20.0,
        slow_speed: 5.0,
        back_off: 4.0,
        travel: 100.0,
        timeout_s: 7.5,
    }
}

fn homing(moves: Vec<HomingMove>) -> Homing {
    Homing { method: HomingMethod::Moves(moves), calibrated: false }
}

#[test]
fn longest_time_of_homing_is_the_sum_of_both_approaches_and_ways_back() {
    let first = approach(HomingAxis::Joint(1), Some("x"));
    // 7.5 s to the switch, 4 mm back at 20 mm/s, 4 mm at 5 mm/s there, and twice 4 mm at 5 mm/s in reserve.
    let by_hand = 7.5 + 0.2 + 0.8 + 1.6;
    assert!((first.longest_s() - by_hand).abs() < 1e-12, "{}", first.longest_s());
    let second = HomingMove { speed: 40.0, slow_speed: 8.0, ..first.clone() };
    let both = homing(vec![first, second]);
    assert!((both.longest_s() - (by_hand + 7.5 + 0.1 + 0.5 + 1.0)).abs() < 1e-12, "{}", both.longest_s());
    let by_a_person = Homing { method: HomingMethod::Pose("arm on the mark".into()), calibrated: false };
    assert_eq!(by_a_person.longest_s(), 0.0);
    assert!(by_a_person.moves().is_empty());
}

#[test]
fn move_without_a_switch_needs_a_stop() {
    let with = approach(HomingAxis::Joint(0), Some("x"));
    let without = approach(HomingAxis::Joint(1), None);
    assert!(!homing(vec![with.clone()]).needs_stop());
    assert!(homing(vec![with, without]).needs_stop());
}

#[test]
fn homing_moves_a_joint_by_all_motors_and_a_motor_alone() {
    let mut parts = parts();
    parts.coupling = [[1.0, 0.0], [2.0, 3.0]];
    let machine = machines::build(parts);
    let ticks = |axis| approach(axis, None).ticks_per_unit(&machine);
    assert_eq!(ticks(HomingAxis::Joint(0)), [500.0, 80.0]);
    assert_eq!(ticks(HomingAxis::Joint(1)), [0.0, 120.0]);
    assert_eq!(ticks(HomingAxis::Motor(0)), [500.0, 0.0]);
    assert_eq!(ticks(HomingAxis::Motor(1)), [0.0, 40.0]);
}

#[test]
fn homing_without_speed_way_or_time_is_refused() {
    let error = |change: &dyn Fn(&mut HomingMove)| {
        let mut parts = parts();
        let mut mv = approach(HomingAxis::Joint(0), None);
        change(&mut mv);
        parts.homing = Some(homing(vec![mv]));
        Machine::new(parts).map(|_| ()).map_err(|error| error.to_string())
    };
    assert_eq!(error(&|_| ()), Ok(()));
    let wrong = |what: &str| Err(format!("the {what} of homing must be a positive number, not 0"));
    assert_eq!(error(&|mv| mv.speed = 0.0), wrong("speed"));
    assert_eq!(error(&|mv| mv.slow_speed = 0.0), wrong("slow_speed"));
    assert_eq!(error(&|mv| mv.back_off = 0.0), wrong("back_off"));
    assert_eq!(error(&|mv| mv.travel = 0.0), wrong("travel"));
    assert_eq!(error(&|mv| mv.timeout_s = 0.0), wrong("timeout"));
}

#[test]
fn pulses_that_no_servo_takes_are_refused() {
    let is_taken = |pulses_us| {
        let mut parts = parts();
        parts.pen_servo = Some(PenServo { pulses_us, angles_deg: None });
        Machine::new(parts).is_ok()
    };
    assert!(is_taken([100.0, 3000.0]));
    assert!(!is_taken([99.0, 2000.0]) && !is_taken([1000.0, 3001.0]) && !is_taken([f64::NAN, 1500.0]));
}

#[test]
fn loads_rest_until_the_motors_have_taken_up_the_play() {
    let mut parts = parts();
    parts.motors[0].backlash_ticks = 10.0;
    parts.motors[1].backlash_ticks = 4.0;
    let mut play = Play::new(&machines::build(parts), [0.0, 0.0]);
    assert_eq!((play.backlash(), play.loads()), ([10.0, 4.0], [0.0, 0.0]));
    // The second load starts at 2 of 10 ticks, the first at 5 of 20, when the second is at 2.5 - 2.
    assert_eq!(play.follow([20.0, 10.0]), [Some([0.0, 0.0]), Some([0.0, 0.5])]);
    assert_eq!(play.loads(), [15.0, 8.0]);
    // Back: the first load rests for 10 of 20 ticks, the second motor does not move.
    assert_eq!(play.follow([0.0, 10.0]), [None, Some([15.0, 8.0])]);
    assert_eq!(play.loads(), [5.0, 8.0]);
    // On in the same direction: no load rests.
    assert_eq!(play.follow([-7.0, 12.0]), [None, None]);
    assert_eq!(play.loads(), [-2.0, 10.0]);
    // Less than the play: the motor moves alone.
    assert_eq!(play.follow([2.0, 12.0]), [None, None]);
    assert_eq!(play.loads(), [-2.0, 10.0]);
}

#[test]
fn loads_without_play_follow_at_once() {
    let mut play = Play::new(&machines::build(parts()), [3.0, 4.0]);
    assert_eq!(play.follow([-20.0, 10.5]), [None, None]);
    assert_eq!(play.loads(), [-20.0, 10.5]);
}
