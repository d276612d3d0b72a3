//! Settings of grbl for a machine, and a feed for every stroke with which grbl keeps to the plan's time.

use drawing::{Drawing, Point, Stroke};
use kinematics::Machine;

use super::encode::{self, Options, Route};
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
/// Chords of the plan's path deviate from it by no more than this, even where the tolerance leaves more, mm: fewer
/// lines gain nothing then.
const CHORD_MM: f64 = 0.02;
/// The slowest feed, mm/s.
const LEAST_MM_S: f64 = 0.1;
/// Where the firmware does the kinematics its resolution is not known: steps that do not matter.
const FINE_STEPS_PER_MM: f64 = 1000.0;

/// What was found.
#[derive(Clone, Debug)]
pub(super) struct Feeds {
    pub(super) speeds_mm_s: Vec<f64>,
    /// For each stroke chords of the plan's path, or nothing where its own lines and arcs are written.
    chords: Vec<Option<Vec<Point>>>,
    chord_mm: f64,
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

    /// What is written of each stroke.
    pub(super) fn routes(&self) -> Vec<Route<'_>> {
        self.chords.iter().map(|chords| chords.as_deref().map_or(Route::Drawn, Route::Chords)).collect()
    }

    /// Strokes that are written as chords of the plan's path; `None` without such strokes.
    pub(super) fn chords_line(&self) -> Option<String> {
        let (count, all) = (self.chords.iter().flatten().count(), self.chords.len());
        (count > 0).then(|| {
            format!("{count} of {all} strokes: chords within {:.4} mm of the plan's path", self.chord_mm)
        })
    }

    /// Both durations.
    pub(super) fn times_line(&self) -> String {
        let share = 100.0 * (self.grbl_s / self.plan_s - 1.0);
        format!("grbl takes {:.1} s ({share:+.1} %), the plan {:.1} s", self.grbl_s, self.plan_s)
    }
}

/// What feeds are found for.
#[derive(Clone, Copy, Debug)]
pub(super) struct Job<'a> {
    pub(super) machine: &'a Machine,
    pub(super) drawing: &'a Drawing,
    /// The time that the plan gives each stroke, s.
    pub(super) times_s: &'a [f64],
    /// Where travel ends.
    pub(super) park: Point,
    pub(super) options: &'a Options,
    /// The part of the tolerance that the plan leaves, mm.
    pub(super) spare_mm: f64,
    pub(super) plan_s: f64,
}

impl Job<'_> {
    fn duration_s(&self, settings: &GrblSettings, routes: &[Route<'_>], speeds_mm_s: &[f64]) -> f64 {
        let lines = encode::paths(self.drawing, routes, speeds_mm_s, self.park, self.options, false);
        grbl_time::duration_s(lines.iter().map(|line| line.text.as_str()), settings)
    }

    /// Chords of the plan's path for each stroke, and how far they deviate from it, mm; none where the straight line
    /// between two rows deviates by more than the tolerance leaves.
    fn chords(&self, setpoints: impl Iterator<Item = Setpoint>) -> (Vec<Option<Vec<Point>>>, f64) {
        let paths = encode::stroke_paths(self.drawing.strokes.len(), setpoints);
        // The motors move linearly between rows: so does the pen, or it deviates in the middle.
        let middle = |pair: &[Setpoint]| {
            let joints = [0, 1].map(|joint: usize| 0.5 * (pair[0].joints[joint] + pair[1].joints[joint]));
            let chord = pair[0].at.midpoint(pair[1].at);
            drawing::distance(self.machine.mechanism().forward(&joints.into()), chord)
        };
        let bow_mm = paths.iter().flat_map(|path| path.windows(2).map(middle)).fold(0.0, f64::max);
        let chord_mm = (self.spare_mm - bow_mm).min(CHORD_MM);
        if chord_mm < 0.0 {
            return (vec![None; paths.len()], 0.0);
        }
        let chords = |path: Vec<Setpoint>| {
            let points: Vec<Point> = path.iter().map(|setpoint| setpoint.at).collect();
            let kept = drawing::kept_vertices(&points, chord_mm);
            (kept.len() > 1).then(|| kept.into_iter().map(|index| points[index]).collect())
        };
        (paths.into_iter().map(chords).collect(), chord_mm + bow_mm)
    }
}

/// The route of each stroke: its own, or the plan's if its own is slower than planned and the plan's is faster.
fn faster<'a>(
    job: &Job<'_>,
    chords: &'a [Option<Vec<Point>>],
    most_mm_s: f64,
    settings: &GrblSettings,
) -> Vec<Route<'a>> {
    let choose = |((stroke, chords), time_s): ((Stroke, &'a Option<Vec<Point>>), &f64)| {
        let duration_s = |route: Route<'_>| {
            let commands = commands(&encode::stroke(&stroke, route, job.options));
            stroke_duration_s(&commands, most_mm_s, settings)
        };
        let Some(chords) = chords else { return Route::Drawn };
        let drawn_s = duration_s(Route::Drawn);
        let is_slow = drawn_s > time_s * (1.0 + STROKE_MARGIN);
        if is_slow && duration_s(Route::Chords(chords)) < drawn_s {
            Route::Chords(chords)
        } else {
            Route::Drawn
        }
    };
    job.drawing.strokes.iter().zip(chords).zip(job.times_s).map(choose).collect()
}

/// Finds them. `setpoints` gives the plan.
pub(super) fn find<I: Iterator<Item = Setpoint>>(job: &Job<'_>, setpoints: impl Fn() -> I) -> Feeds {
    let most_mm_s = job.machine.pen().max_speed_mm_s;
    let is_linear = job.machine.mechanism().is_linear();
    let mut settings = if is_linear {
        settings_of(job.machine, job.options)
    } else {
        settings_from_plan(setpoints(), job.options)
    };
    let fastest = vec![most_mm_s; job.drawing.strokes.len()];
    let mut routes = vec![Route::Drawn; job.drawing.strokes.len()];
    let fits = |settings: &GrblSettings, routes: &[Route<'_>]| {
        job.duration_s(settings, routes, &fastest) <= job.plan_s * (1.0 + MARGIN)
    };
    let mut is_fast = false;
    for deviation_mm in JUNCTION_DEVIATIONS_MM {
        settings.junction_deviation_mm = deviation_mm;
        is_fast = fits(&settings, &routes);
        if is_fast {
            break;
        }
    }
    // Corners of the drawing that the plan smooths within the tolerance stop grbl: its own path, then.
    let (chords, chord_mm) = if is_fast { (Vec::new(), 0.0) } else { job.chords(setpoints()) };
    if !is_fast {
        for deviation_mm in JUNCTION_DEVIATIONS_MM {
            settings.junction_deviation_mm = deviation_mm;
            routes = faster(job, &chords, most_mm_s, &settings);
            is_fast = fits(&settings, &routes);
            if is_fast {
                break;
            }
        }
        if !is_fast {
            // Something else takes the time, such as a slow Z axis: strokes stay as they are drawn.
            routes = vec![Route::Drawn; job.drawing.strokes.len()];
        }
    }
    let mut speeds_mm_s: Vec<f64> = (job.drawing.strokes.iter().zip(&routes).zip(job.times_s))
        .map(|((stroke, route), time_s)| {
            stroke_speed_mm_s(&encode::stroke(&stroke, *route, job.options), *time_s, most_mm_s, &settings)
        })
        .collect();
    let mut grbl_s = job.duration_s(&settings, &routes, &speeds_mm_s);
    if grbl_s > job.plan_s * (1.0 + MARGIN) {
        // Travel takes longer than planned: no stroke waits for that.
        speeds_mm_s.clone_from(&fastest);
        grbl_s = job.duration_s(&settings, &routes, &speeds_mm_s);
    }
    if grbl_s < job.plan_s * (1.0 - MARGIN) {
        grbl_s = slow_travel(job, &mut settings, &routes, &speeds_mm_s, most_mm_s);
    }
    let chords = routes.iter().map(|route| match route {
        Route::Drawn => None,
        Route::Chords(points) => Some(points.to_vec()),
    });
    Feeds { speeds_mm_s, chords: chords.collect(), chord_mm, settings, grbl_s, is_linear, plan_s: job.plan_s }
}

/// Travel is faster than planned. Lower rates, above those of strokes, change nothing else. Returns the new time, s.
fn slow_travel(
    job: &Job<'_>,
    settings: &mut GrblSettings,
    routes: &[Route<'_>],
    speeds_mm_s: &[f64],
    most_mm_s: f64,
) -> f64 {
    let full = settings.max_rate_mm_s;
    let (mut low, mut high, mut grbl_s) = (0.0, 1.0, 0.0);
    for _ in 0..RATE_TRIALS {
        let share = 0.5 * (low + high);
        settings.max_rate_mm_s = full.map(|rate| (share * rate).max(most_mm_s.min(rate)).ceil());
        grbl_s = job.duration_s(settings, routes, speeds_mm_s);
        if grbl_s < job.plan_s {
            high = share;
        } else {
            low = share;
        }
    }
    grbl_s
}

fn commands(lines: &[crate::Line]) -> Vec<Command> {
    let mut reader = Reader::default();
    lines.iter().map(|line| reader.read(&line.text)).collect()
}

/// The time of a stroke, the travel to its start first, at this feed.
fn stroke_duration_s(commands: &[Command], feed_mm_s: f64, settings: &GrblSettings) -> f64 {
    let Some(Command::Move { to: start, .. }) = commands.first().copied() else { return 0.0 };
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
}

/// The feed with which a stroke takes this time, at most `most_mm_s`.
fn stroke_speed_mm_s(lines: &[crate::Line], time_s: f64, most_mm_s: f64, settings: &GrblSettings) -> f64 {
    let commands = commands(lines);
    let duration_s = |feed_mm_s: f64| stroke_duration_s(&commands, feed_mm_s, settings);
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
