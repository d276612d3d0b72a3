//! Settings of grbl for a machine, and a feed for every stroke with which grbl keeps to the plan's time.

use drawing::{Drawing, Point};
use kinematics::Machine;

use super::encode::{self, Options};
use super::grbl_time::{self, Command, GrblSettings, LINE_S, Model, Reader};
use crate::Setpoint;

/// `$11` is the smallest of these with which grbl is fast enough, mm.
const JUNCTION_DEVIATIONS_MM: [f64; 5] = [0.01, 0.02, 0.05, 0.1, 0.2];
/// `$12`: the chords of other curves have the same.
const ARC_TOLERANCE_MM: f64 = 0.01;
/// Slower than the plan by no more than this share.
const MARGIN: f64 = 0.02;
/// A stroke's time is met to this share.
const STROKE_MARGIN: f64 = 0.005;
const MOST_TRIALS: usize = 6;
const RATE_TRIALS: usize = 7;
/// The slowest feed, mm/s.
const LEAST_MM_S: f64 = 0.1;
/// Where the firmware does the kinematics its resolution is not known: steps that do not matter.
const FINE_STEPS_PER_MM: f64 = 1000.0;

/// What was found.
#[derive(Clone, Debug)]
pub(super) struct Feeds {
    pub(super) speeds_mm_s: Vec<f64>,
    pub(super) settings: GrblSettings,
    /// Time of the program without pen changes, s.
    pub(super) grbl_s: f64,
    /// Whether steps for each mm follow from the machine.
    is_linear: bool,
    plan_s: f64,
}

impl Feeds {
    /// `$1=255 $11=0.1 ...`, in lines of less than 80 characters.
    pub(super) fn settings(&self) -> [String; 2] {
        let GrblSettings { steps_per_mm, max_rate_mm_s, acceleration_mm_s2, .. } = &self.settings;
        let number = |value: f64| encode::decimal(value, 3);
        let mut words = vec![
            "$1=255".to_owned(),
            format!("$11={}", number(self.settings.junction_deviation_mm)),
            format!("$12={}", number(self.settings.arc_tolerance_mm)),
        ];
        if self.is_linear {
            words.extend((0..2).map(|axis| format!("$10{axis}={}", number(steps_per_mm[axis]))));
        }
        let rates = (0..2).map(|axis| format!("$11{axis}={}", number(max_rate_mm_s[axis] * 60.0)));
        let accelerations = (0..2).map(|axis| format!("$12{axis}={}", number(acceleration_mm_s2[axis])));
        let limits: Vec<String> = rates.chain(accelerations).collect();
        [words.join(" "), limits.join(" ")]
    }

    /// Both durations.
    pub(super) fn times_line(&self) -> String {
        let share = 100.0 * (self.grbl_s / self.plan_s - 1.0);
        format!("grbl takes {:.1} s ({share:+.1} %), the plan {:.1} s", self.grbl_s, self.plan_s)
    }
}

/// Finds them. `times_s` has the time that the plan gives each stroke; `setpoints` is the plan.
pub(super) fn find(
    machine: &Machine,
    drawing: &Drawing,
    times_s: &[f64],
    setpoints: impl Iterator<Item = Setpoint>,
    park: Point,
    options: &Options,
    plan_s: f64,
) -> Feeds {
    let most_mm_s = machine.pen().max_speed_mm_s;
    let is_linear = machine.mechanism().is_linear();
    let mut settings =
        if is_linear { settings_of(machine, options) } else { settings_from_plan(setpoints, options) };
    let duration_s = |settings: &GrblSettings, speeds_mm_s: &[f64]| {
        let lines = encode::paths(drawing, speeds_mm_s, park, options, false);
        grbl_time::duration_s(lines.iter().map(|line| line.text.as_str()), settings)
    };
    let fastest = vec![most_mm_s; drawing.strokes.len()];
    for deviation_mm in JUNCTION_DEVIATIONS_MM {
        settings.junction_deviation_mm = deviation_mm;
        if duration_s(&settings, &fastest) <= plan_s * (1.0 + MARGIN) {
            break;
        }
    }
    let strokes = drawing.strokes.iter().zip(times_s);
    let mut speeds_mm_s: Vec<f64> = strokes
        .map(|(stroke, time_s)| {
            stroke_speed_mm_s(&encode::stroke(&stroke, options), *time_s, most_mm_s, &settings)
        })
        .collect();
    let mut grbl_s = duration_s(&settings, &speeds_mm_s);
    if grbl_s > plan_s * (1.0 + MARGIN) {
        // Travel takes longer than planned: no stroke waits for that.
        speeds_mm_s = fastest;
        grbl_s = duration_s(&settings, &speeds_mm_s);
    }
    if grbl_s < plan_s * (1.0 - MARGIN) {
        // Travel is faster than planned. Lower rates, above those of strokes, change nothing else.
        let full = settings.max_rate_mm_s;
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..RATE_TRIALS {
            let share = 0.5 * (low + high);
            settings.max_rate_mm_s = full.map(|rate| (share * rate).max(most_mm_s.min(rate)).ceil());
            grbl_s = duration_s(&settings, &speeds_mm_s);
            if grbl_s < plan_s {
                high = share;
            } else {
                low = share;
            }
        }
    }
    Feeds { speeds_mm_s, settings, grbl_s, is_linear, plan_s }
}

/// The feed with which a stroke takes this time, at most `most_mm_s`.
fn stroke_speed_mm_s(lines: &[crate::Line], time_s: f64, most_mm_s: f64, settings: &GrblSettings) -> f64 {
    let mut reader = Reader::default();
    let commands: Vec<Command> = lines.iter().map(|line| reader.read(&line.text)).collect();
    let Some(Command::Move { to: start, .. }) = commands.first().copied() else { return most_mm_s };
    let duration_s = |feed_mm_s: f64| {
        let mut model = Model::new(settings, start);
        for command in &commands[1..] {
            model.pass_time(LINE_S);
            model.execute(match *command {
                Command::Move { to, feed_mm_s: Some(_), arc } => {
                    Command::Move { to, feed_mm_s: Some(feed_mm_s), arc }
                }
                other => other,
            });
        }
        model.finish()
    };
    // The time falls as the feed grows: bounds on both sides, and the inverse feed by the secant.
    let (mut high, mut high_s) = (most_mm_s, duration_s(most_mm_s));
    if high_s >= time_s || high_s <= 0.0 {
        return most_mm_s;
    }
    let (mut low, mut low_s) = (LEAST_MM_S, f64::INFINITY);
    let mut best = (high, (high_s - time_s).abs());
    for _ in 0..MOST_TRIALS {
        let inverse = if low_s.is_finite() {
            let share = (time_s - high_s) / (low_s - high_s);
            1.0 / high + share * (1.0 / low - 1.0 / high)
        } else {
            // As if all of it were at the feed.
            time_s / (high_s * high)
        };
        let trial = (1.0 / inverse).clamp(LEAST_MM_S, most_mm_s);
        let trial_s = duration_s(trial);
        let off = (trial_s - time_s).abs();
        if off < best.1 {
            best = (trial, off);
        }
        if off <= STROKE_MARGIN * time_s {
            break;
        }
        if trial_s > time_s {
            (low, low_s) = (trial, trial_s);
        } else {
            (high, high_s) = (trial, trial_s);
        }
    }
    best.0
}

/// Settings of a machine whose motors depend linearly on x and y: the motors' limits along each axis alone.
fn settings_of(machine: &Machine, options: &Options) -> GrblSettings {
    let q = machine.start();
    let (x, _) = machine.motor_derivatives(&q, drawing::Vec2::new(1.0, 0.0), drawing::Vec2::ZERO);
    let (y, _) = machine.motor_derivatives(&q, drawing::Vec2::new(0.0, 1.0), drawing::Vec2::ZERO);
    let ticks: [[f64; 2]; 2] = [x.into(), y.into()];
    let motors = machine.motors();
    let least = |axis: usize, limit: fn(&kinematics::Motor) -> f64| {
        let of = |motor: usize| limit(&motors[motor]) / ticks[axis][motor].abs();
        of(0).min(of(1))
    };
    let most_ticks = |axis: usize| ticks[axis][0].abs().max(ticks[axis][1].abs());
    let mut settings = settings_without_limits(options);
    for axis in 0..2 {
        settings.steps_per_mm[axis] = most_ticks(axis);
        settings.max_rate_mm_s[axis] =
            least(axis, |motor| motor.max_speed_ticks_s).min(options.travel_limit_mm_s);
        settings.acceleration_mm_s2[axis] = least(axis, |motor| motor.max_acceleration_ticks_s2);
    }
    settings
}

/// Settings for firmware that does the kinematics of another machine: the largest speed and acceleration of
/// the plan along each axis.
fn settings_from_plan(setpoints: impl Iterator<Item = Setpoint>, options: &Options) -> GrblSettings {
    let mut settings = settings_without_limits(options);
    let mut before: Option<Setpoint> = None;
    // The interval before: its length, s, and speed, mm/s.
    let mut last: Option<(f64, [f64; 2])> = None;
    let (mut speed_mm_s, mut acceleration_mm_s2) = ([0.0_f64; 2], [0.0_f64; 2]);
    for setpoint in setpoints {
        if let Some(from) = before {
            let dt = (setpoint.row.t_us - from.row.t_us) as f64 * 1e-6;
            let way = setpoint.at - from.at;
            let speed = [way.x / dt, way.y / dt];
            speed_mm_s = [0, 1].map(|axis: usize| speed_mm_s[axis].max(speed[axis].abs()));
            if let Some((last_dt, last)) = last {
                acceleration_mm_s2 = [0, 1].map(|axis: usize| {
                    let change = (speed[axis] - last[axis]).abs() / (0.5 * (dt + last_dt));
                    acceleration_mm_s2[axis].max(change)
                });
            }
            last = Some((dt, speed));
        }
        before = Some(setpoint);
    }
    settings.max_rate_mm_s[..2].copy_from_slice(&speed_mm_s.map(|speed| speed.max(1.0).ceil()));
    settings.acceleration_mm_s2[..2].copy_from_slice(&acceleration_mm_s2.map(|value| value.max(1.0).ceil()));
    settings
}

fn settings_without_limits(options: &Options) -> GrblSettings {
    GrblSettings {
        idle_delay_s: 0.0,
        arc_tolerance_mm: ARC_TOLERANCE_MM,
        steps_per_mm: [FINE_STEPS_PER_MM; 3],
        max_rate_mm_s: [options.travel_mm_s; 3],
        ..GrblSettings::default()
    }
}
