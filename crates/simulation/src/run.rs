//! The simulation of a plan: loop, plant, samples.

use kinematics::{Machine, MotorPos};
use plan::Row;

use crate::controller::{Controller, Measurement, Setpoint};
use crate::drive::{Drive, MotorPlant};
use crate::plant::{Plant, STEP_S};
use crate::setpoint::{Rows, SetpointKind, Vertex};

/// Microseconds of a step.
const STEP_US: u64 = 200;
/// Steps between samples: 2 ms.
const SAMPLE_STEPS: u64 = 10;
/// How long the drive is watched after the plan's end, s.
const AFTER_S: f64 = 0.5;
/// A vertex that is not reached after this time is given up, s.
const GIVE_UP_S: f64 = 5.0;
/// A vertex is also given up when both motors rest for this time, s.
const GIVE_UP_AT_REST_S: f64 = 0.5;
/// Beyond this many ticks a position has nothing to do with a plotter any more.
const RUNAWAY_TICKS: f64 = 1e12;

/// What to simulate.
#[derive(Clone, Copy, Debug)]
pub struct Job<'a> {
    /// The machine.
    pub machine: &'a Machine,
    /// The rows of the plan; at least one.
    pub rows: &'a [Row],
    /// Time between rows while anything moves, microseconds.
    pub period_us: u64,
    /// The vertices, for [`SetpointKind::Vertices`].
    pub vertices: &'a [Vertex],
}

/// The state of the machine every 2 ms.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Time since the start, microseconds.
    pub t_us: u64,
    /// The pen that is down, by the plan; 0 for up.
    pub pen: u16,
    /// Positions of the loads, ticks.
    pub ticks: [f64; 2],
    /// Positions that are asked for at this time, ticks.
    pub planned: [f64; 2],
    /// Commands of the controllers: % of duty, or ticks for drives without feedback.
    pub commands: [f64; 2],
}

/// What one motor did.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MotorOutcome {
    /// Largest distance of the load from its planned position, ticks.
    pub error_max_ticks: f64,
    /// Its root mean square over the plan's time, ticks.
    pub error_rms_ticks: f64,
    /// Share of the loop's calls with the duty at its limit.
    pub saturated_share: f64,
    /// Distance from the planned position at the end, ticks.
    pub rest_error_ticks: f64,
    /// How far the motor still swings in the last 0.3 s, after the plan's end, ticks.
    pub swing_ticks: f64,
    /// Steps lost, ticks.
    pub lost_ticks: f64,
    /// Steppers: the largest share of the pull-out torque that was needed, and the largest speed
    /// beyond the data, ticks/s.
    pub torque: Option<(f64, f64)>,
}

/// What a simulation measured.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Outcome {
    /// Simulated time, s.
    pub duration_s: f64,
    /// The motors.
    pub motors: [MotorOutcome; 2],
    /// Vertices that were not reached before they were given up.
    pub unreached: usize,
}

/// Why a simulation ends early.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SimulationError {
    /// The plan has no rows, or there are no vertices where vertices are the setpoints.
    #[error("there is nothing to simulate")]
    Empty,
    /// A position grew without bound.
    #[error("motor {motor} runs away: beyond 1e12 ticks after {at_s:.3} s")]
    Runaway {
        /// The motor's name.
        motor: String,
        /// When, s.
        at_s: f64,
    },
}

/// The steps at which something is called once a period, each rounded up to a whole step.
struct Schedule {
    period_s: f64,
    phase_s: f64,
    calls: u64,
    next: u64,
}

impl Schedule {
    fn new(period_s: f64, phase_s: f64) -> Self {
        let mut schedule = Self { period_s, phase_s, calls: 0, next: 0 };
        schedule.next = schedule.step_of(0);
        schedule
    }

    fn step_of(&self, call: u64) -> u64 {
        ((self.phase_s + call as f64 * self.period_s) / STEP_S - 1e-6).ceil().max(0.0) as u64
    }

    fn advance(&mut self) {
        self.calls += 1;
        self.next = self.step_of(self.calls);
    }
}

/// Steps through vertices: the next one follows when both motors are near enough.
struct Sequencer<'a> {
    vertices: &'a [Vertex],
    within: f64,
    index: usize,
    pen: u16,
    /// Steps up to which the pen moves; the step at which the vertex began; since when motors rest.
    waits_until: u64,
    since: u64,
    rests_since: Option<u64>,
    lift_steps: u64,
    drop_steps: u64,
    unreached: usize,
}

impl<'a> Sequencer<'a> {
    fn new(job: &Job<'a>, within: f64) -> Self {
        let steps = |time: f64| (time / STEP_S).round() as u64;
        Self {
            vertices: job.vertices,
            within,
            index: 0,
            pen: 0,
            waits_until: 0,
            since: 0,
            rests_since: None,
            lift_steps: steps(job.machine.pen().lift_time_s),
            drop_steps: steps(job.machine.pen().drop_time_s),
            unreached: 0,
        }
    }

    fn target(&self) -> [f64; 2] {
        // While the pen moves, the motors hold the last vertex.
        self.vertices[self.index].ticks
    }

    /// Called once a period; whether all vertices are done.
    fn update(&mut self, now: u64, counts: [f64; 2], at_rest: bool) -> bool {
        if now < self.waits_until {
            return false;
        }
        if at_rest {
            self.rests_since.get_or_insert(now);
        } else {
            self.rests_since = None;
        }
        let target = self.target();
        let reached = (0..2).all(|k| (target[k] - counts[k]).abs() <= self.within);
        let elapsed = |since: u64| (now - since) as f64 * STEP_S;
        let rests = self.rests_since.is_some_and(|since| elapsed(since.max(self.since)) >= GIVE_UP_AT_REST_S);
        if !reached && !rests && elapsed(self.since) < GIVE_UP_S {
            return false;
        }
        self.unreached += usize::from(!reached);
        let Some(next) = self.vertices.get(self.index + 1) else { return true };
        if next.pen != self.pen {
            self.waits_until = now + if next.pen == 0 { self.lift_steps } else { self.drop_steps };
            self.pen = next.pen;
            self.since = self.waits_until;
            return false;
        }
        self.index += 1;
        self.since = now;
        self.rests_since = None;
        false
    }
}

/// Sums over a simulation for one motor.
#[derive(Clone, Copy, Debug, Default)]
struct Sums {
    max: f64,
    squares: f64,
    samples: f64,
    saturated: f64,
    low: f64,
    high: f64,
}

struct Simulation<'a> {
    drive: &'a Drive,
    plan: Rows<'a>,
    sequencer: Option<Sequencer<'a>>,
    plant: Box<dyn Plant>,
    controllers: [Box<dyn Controller>; 2],
    commands: [f64; 2],
    with_rates: bool,
    sums: [Sums; 2],
    calls: f64,
}

impl<'a> Simulation<'a> {
    fn new(job: &Job<'a>, drive: &'a Drive) -> Result<Self, SimulationError> {
        let first = job.rows.first().ok_or(SimulationError::Empty)?;
        let is_vertices = drive.setpoints == SetpointKind::Vertices;
        if is_vertices && job.vertices.is_empty() {
            return Err(SimulationError::Empty);
        }
        let start = first.ticks.map(|ticks| ticks as f64);
        let forward = drive.feed_forward;
        Ok(Self {
            drive,
            plan: Rows::new(job.rows, job.period_us),
            sequencer: is_vertices.then(|| Sequencer::new(job, drive.reached_within_ticks)),
            plant: drive.plant(job.machine, start),
            controllers: drive.controllers(),
            commands: [0, 1].map(|k: usize| match drive.motors[k].plant {
                MotorPlant::Dc(_) => 0.0,
                _ => start[k],
            }),
            with_rates: forward.speed != 0.0 || forward.acceleration != 0.0 || forward.friction != 0.0,
            sums: [Sums { low: f64::INFINITY, high: f64::NEG_INFINITY, ..Sums::default() }; 2],
            calls: 0.0,
        })
    }

    /// Positions by the encoder: rounded to its counts.
    fn counts(&self) -> [f64; 2] {
        let per_tick = self.drive.counts_per_tick;
        self.plant.positions().map(|ticks| libm::floor(ticks * per_tick + 0.5) / per_tick)
    }

    /// One call of the loop; whether all vertices are done.
    fn control(&mut self, now: u64) -> bool {
        let counts = self.counts();
        let mut done = false;
        let setpoints = match &mut self.sequencer {
            Some(sequencer) => {
                let at_rest = self.plant.speeds().iter().all(|speed| *speed == 0.0);
                done = sequencer.update(now, counts, at_rest);
                sequencer.target().map(|position| Setpoint { position, ..Setpoint::default() })
            }
            None => self.plan.setpoints((now * STEP_US) as f64, self.drive.setpoints, self.with_rates),
        };
        let currents = self.plant.currents_a(self.commands);
        for k in 0..2 {
            let measured = Measurement { position: counts[k], current_a: currents[k] };
            self.commands[k] = self.controllers[k].update(&setpoints[k], &measured);
            self.sums[k].saturated += f64::from(u8::from(self.controllers[k].is_saturated()));
        }
        self.calls += 1.0;
        done
    }

    /// Commands of motors that follow positions at every step: where they are to be after it.
    fn follow(&mut self, now: u64) {
        let position = if let Some(sequencer) = &self.sequencer {
            sequencer.target()
        } else {
            let t_us = ((now + 1) * STEP_US) as f64;
            self.plan.setpoints(t_us, self.drive.setpoints, false).map(|setpoint| setpoint.position)
        };
        for (k, position) in position.into_iter().enumerate() {
            if matches!(self.drive.motors[k].plant, MotorPlant::Ideal | MotorPlant::Stepper(_)) {
                self.commands[k] = position;
            }
        }
    }

    fn sample(&mut self, now: u64) -> Sample {
        let t_us = now * STEP_US;
        let row = self.plan.row(t_us as f64);
        let (pen, planned) = match &self.sequencer {
            Some(sequencer) => (sequencer.pen, sequencer.target()),
            None => (row.pen, self.plan.position(t_us as f64)),
        };
        Sample { t_us, pen, ticks: self.plant.loads(), planned, commands: self.commands }
    }
}

/// Simulates a plan; `observe` gets a sample every 2 ms.
///
/// # Errors
/// When there is nothing to simulate, or a position grows without bound.
pub fn simulate(
    job: &Job<'_>,
    drive: &Drive,
    mut observe: impl FnMut(&Sample),
) -> Result<Outcome, SimulationError> {
    let mut simulation = Simulation::new(job, drive)?;
    let after = (AFTER_S / STEP_S) as u64;
    let mut plan_end = job.rows.last().map_or(0, |row| row.t_us.div_ceil(STEP_US));
    if simulation.sequencer.is_some() {
        plan_end = u64::MAX - after;
    }
    let fine = drive.has_fine_motor();
    let mut schedule = Schedule::new(drive.period_s, drive.phase_s);
    let (mut now, mut next_sample) = (0, 0);
    while now < plan_end + after {
        if now == schedule.next {
            if simulation.control(now) && plan_end > now {
                plan_end = now;
            }
            schedule.advance();
        }
        if now == next_sample {
            let sample = simulation.sample(now);
            let settling = now >= plan_end + after / 2 - after / 10;
            record(&mut simulation.sums, &sample, now <= plan_end, settling);
            if let Some(k) =
                sample.ticks.iter().position(|ticks| ticks.is_nan() || ticks.abs() > RUNAWAY_TICKS)
            {
                let motor = job.machine.motors()[k].name.clone();
                return Err(SimulationError::Runaway { motor, at_s: now as f64 * STEP_S });
            }
            observe(&sample);
            next_sample += SAMPLE_STEPS;
        }
        if fine {
            simulation.follow(now);
        }
        let until = if fine { now + 1 } else { schedule.next.min(next_sample).min(plan_end + after) };
        simulation.plant.advance(simulation.commands, (until - now) as u32);
        now = until;
    }
    Ok(outcome(&mut simulation, now))
}

fn record(sums: &mut [Sums; 2], sample: &Sample, in_plan: bool, settling: bool) {
    for (k, sums) in sums.iter_mut().enumerate() {
        if in_plan {
            let error = (sample.ticks[k] - sample.planned[k]).abs();
            sums.max = sums.max.max(error);
            sums.squares += error * error;
            sums.samples += 1.0;
        }
        if settling {
            sums.low = sums.low.min(sample.ticks[k]);
            sums.high = sums.high.max(sample.ticks[k]);
        }
    }
}

fn outcome(simulation: &mut Simulation<'_>, now: u64) -> Outcome {
    let last = simulation.sample(now);
    let (lost, torque) = (simulation.plant.lost_ticks(), simulation.plant.torque_margins());
    let motors = [0, 1].map(|k: usize| {
        let sums = &simulation.sums[k];
        MotorOutcome {
            error_max_ticks: sums.max,
            error_rms_ticks: (sums.squares / sums.samples.max(1.0)).sqrt(),
            saturated_share: sums.saturated / simulation.calls.max(1.0),
            rest_error_ticks: (last.ticks[k] - last.planned[k]).abs(),
            swing_ticks: (sums.high - sums.low).max(0.0),
            lost_ticks: lost[k],
            torque: torque[k],
        }
    });
    Outcome {
        duration_s: now as f64 * STEP_S,
        motors,
        unreached: simulation.sequencer.as_ref().map_or(0, |sequencer| sequencer.unreached),
    }
}

/// The vertices of a list of polylines with their pens, as [`SetpointKind::Vertices`] takes them:
/// to the first point with the pen up, along the others with it down, at last back to the start.
pub fn vertices(
    machine: &Machine,
    polylines: impl IntoIterator<Item = (u16, Vec<drawing::Point>)>,
) -> Vec<Vertex> {
    let mut near = machine.start();
    let mut all = Vec::new();
    for (pen, points) in polylines {
        for (index, point) in points.iter().enumerate() {
            if let Ok(pose) = machine.pose_near(*point, &near) {
                near = pose;
                let ticks = <[f64; 2]>::from(machine.motor_positions(&pose)).map(f64::round);
                all.push(Vertex { pen: if index == 0 { 0 } else { pen }, ticks });
            }
        }
        if points.len() == 1
            && let Some(dot) = all.last().copied()
        {
            all.push(Vertex { pen, ..dot });
        }
    }
    let start: MotorPos = machine.motor_positions(&machine.start());
    all.push(Vertex { pen: 0, ticks: start.0.map(f64::round) });
    all
}
