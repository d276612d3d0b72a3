//! Homing over a serial line: the steps of a firmware, the run of them, and the datum of an emulated machine.

use kinematics::Homing;

use crate::session::LineReader;

/// What a line from the machine means for a step of homing.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum StepAnswer {
    /// The step is done.
    Done,
    /// Homing has failed.
    Failed(String),
    /// Nothing that matters.
    Other,
}

/// One step of homing: bytes that are sent, and answers that end it.
#[derive(Clone, Debug)]
pub struct HomingStep {
    /// What is sent.
    pub text: String,
    /// Whether it is sent again every half second until it is done.
    pub repeats: bool,
    /// What a line of the machine means.
    pub parse: fn(&str) -> StepAnswer,
}

/// Homing as a firmware does it.
#[derive(Clone, Debug)]
pub struct HomingSteps {
    /// The steps, in order.
    pub steps: Vec<HomingStep>,
    /// The bytes that stop it.
    pub abort: &'static [u8],
}

/// The query is repeated after this, microseconds.
const POLL_INTERVAL_US: u64 = 500_000;
/// Time beyond what the moves may take, microseconds.
const SLACK_US: u64 = 5_000_000;

/// The run of a machine's homing.
#[derive(Debug)]
pub struct HomingRun {
    steps: HomingSteps,
    /// The step under way.
    step: usize,
    next_us: Option<u64>,
    limit_us: u64,
    begun_us: Option<u64>,
    lines: LineReader,
    outcome: Option<Result<(), String>>,
}

impl HomingRun {
    /// The run of these steps on a machine with this homing.
    pub fn new(steps: HomingSteps, homing: &Homing) -> Self {
        let limit_us = (homing.longest_s() * 1e6) as u64 + SLACK_US;
        let lines = LineReader::default();
        Self { steps, step: 0, next_us: Some(0), limit_us, begun_us: None, lines, outcome: None }
    }

    /// Processes bytes from the machine.
    pub fn receive(&mut self, bytes: &[u8]) {
        for line in self.lines.add(bytes) {
            let Some(step) = self.steps.steps.get(self.step) else { return };
            match (step.parse)(&line) {
                StepAnswer::Done => {
                    self.step += 1;
                    self.next_us = Some(0);
                    if self.step == self.steps.steps.len() {
                        self.outcome = Some(Ok(()));
                    }
                }
                StepAnswer::Failed(why) => self.outcome = self.outcome.take().or(Some(Err(why))),
                StepAnswer::Other => {}
            }
        }
    }

    /// Bytes to send now.
    pub fn transmit(&mut self, now_us: u64) -> Vec<u8> {
        let begun_us = *self.begun_us.get_or_insert(now_us);
        if self.outcome.is_none() && now_us > begun_us + self.limit_us {
            let seconds = self.limit_us as f64 * 1e-6;
            let heard = self.lines.last_received();
            self.outcome = Some(Err(format!("homing did not end within {seconds:.0} s; {heard}")));
            return self.steps.abort.to_vec();
        }
        let due = self.next_us.is_some_and(|next_us| now_us >= next_us);
        let step = self.steps.steps.get(self.step).filter(|_| due && self.outcome.is_none());
        let Some(step) = step else { return Vec::new() };
        self.next_us = step.repeats.then_some(now_us + POLL_INTERVAL_US);
        step.text.clone().into_bytes()
    }

    /// The bytes that stop it.
    pub fn abort(&mut self) -> Vec<u8> {
        self.outcome = Some(Err("interrupted".to_owned()));
        self.steps.abort.to_vec()
    }

    /// How it ended, once it has.
    pub fn outcome(&self) -> Option<&Result<(), String>> {
        self.outcome.as_ref()
    }
}

/// A switch or mechanical stop of an emulated machine that does not work.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SwitchFault {
    /// The switch of this homing move, from 0, never closes: a wire is broken, or it turns the wrong way. A stop is
    /// not reached within the travel.
    Broken(u8),
    /// It never opens. The motor does not come away from a stop: it is jammed, or its encoder does not count.
    Stuck(u8),
}

/// How long an emulated machine takes to home.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct EmulatedHoming {
    /// For each move: the time that it takes, and that after which it has failed, microseconds.
    pub moves_us: [Option<[u64; 2]>; 2],
    /// A switch that does not work.
    pub fault: Option<SwitchFault>,
}

/// An emulated machine stands at this share of the way from its switch when it is switched on.
const STANDS_AT: f64 = 0.6;

impl EmulatedHoming {
    /// Of a machine with this homing; all of it 0 for a pose.
    pub fn of(homing: &Homing, fault: Option<SwitchFault>) -> Self {
        let us = |seconds: f64| (seconds * 1e6) as u64;
        let mut moves_us = [None; 2];
        for (times, mv) in moves_us.iter_mut().zip(homing.moves()) {
            let fast_s = (STANDS_AT * mv.travel + mv.back_off) / mv.speed.abs();
            let slow_s = 2.0 * mv.back_off / mv.slow_speed;
            *times = Some([us(fast_s + slow_s), us(mv.timeout_s)]);
        }
        Self { moves_us, fault }
    }
}

/// Whether an emulated machine knows where it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Datum {
    /// It does not.
    Unknown,
    /// It searches its switches, until this time; then it has found them or not.
    Homing { until_us: u64, failure: Option<SwitchFault> },
    /// It does.
    Known,
    /// Homing has failed.
    Failed(SwitchFault),
    /// A switch closed outside of homing.
    Limit,
}

impl Datum {
    /// Of a machine that was just switched on: one without homing counts as standing in its start pose.
    pub(crate) fn at_start(homing: Option<EmulatedHoming>, homed: bool) -> Self {
        if homing.is_some() && !homed { Self::Unknown } else { Self::Known }
    }

    /// Begins homing; whether there are switches to do so.
    pub(crate) fn begin(&mut self, homing: Option<EmulatedHoming>, now_us: u64) -> bool {
        let Some(homing) = homing.filter(|homing| homing.moves_us[0].is_some()) else { return false };
        let mut until_us = now_us;
        let mut failure = None;
        for (number, [takes_us, fails_us]) in (0_u8..).zip(homing.moves_us.into_iter().flatten()) {
            failure = homing.fault.filter(|fault| {
                let (SwitchFault::Broken(at) | SwitchFault::Stuck(at)) = *fault;
                at == number
            });
            until_us += if failure.is_some() { fails_us } else { takes_us };
            if failure.is_some() {
                break;
            }
        }
        *self = Self::Homing { until_us, failure };
        true
    }

    /// Ends homing that is due; whether it did.
    pub(crate) fn advance(&mut self, now_us: u64) -> bool {
        match *self {
            Self::Homing { until_us, failure } if now_us >= until_us => {
                *self = failure.map_or(Self::Known, Self::Failed);
                true
            }
            _ => false,
        }
    }

    /// When homing ends.
    pub(crate) fn wake_us(self) -> Option<u64> {
        match self {
            Self::Homing { until_us, .. } => Some(until_us),
            _ => None,
        }
    }
}
