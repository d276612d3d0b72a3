//! What the plan asks for, what the rig saw, and their comparison.

use std::collections::BTreeSet;
use std::path::Path;

use anyhow::{Context as _, Result, ensure};

use super::rig::CYCLES_PER_US;

/// A step: time in microseconds, direction.
pub(super) type Step = (f64, i64);

/// A plan as steps.
#[derive(Debug, Default)]
pub(super) struct Steps {
    pub(super) start: [i64; 2],
    pub(super) end: [i64; 2],
    pub(super) motors: [Vec<Step>; 2],
    /// Changes of the pen, in order.
    pub(super) pens: Vec<bool>,
    /// Pairs of ticks at the ends of lines with the pen down.
    pub(super) ink: BTreeSet<[i64; 2]>,
    pub(super) duration_us: f64,
}

impl Steps {
    /// Step i of a line of n ticks in D is due at (i - 1/2) D / n.
    pub(super) fn read(plan: &Path) -> Result<Self> {
        let text = std::fs::read_to_string(plan)?;
        let mut steps = Self::default();
        let mut at = None;
        let mut pen = false;
        for line in text.lines() {
            let (verb, rest) = line.split_once(' ').unwrap_or((line, ""));
            if !matches!(verb, "s" | "m") {
                continue;
            }
            let n = rest.split(' ').map(str::parse).collect::<Result<Vec<i64>, _>>().context("a number")?;
            let [first, us, a, b] = n[..] else { continue };
            if verb == "s" {
                if at.is_none() {
                    (at, steps.start) = (Some([a, b]), [a, b]);
                }
                continue;
            }
            let from = at.context("no start")?;
            if pen != (first != 0) {
                pen = first != 0;
                steps.pens.push(pen);
            }
            for (motor, (from, to)) in from.into_iter().zip([a, b]).enumerate() {
                let count = (to - from).abs();
                for i in 0..count {
                    let time = (i as f64 + 0.5) * us as f64 / count as f64;
                    steps.motors[motor].push((steps.duration_us + time, (to - from).signum()));
                }
            }
            if pen {
                steps.ink.insert([a, b]);
            }
            steps.duration_us += us as f64;
            at = Some([a, b]);
        }
        if pen {
            steps.pens.push(false);
        }
        steps.end = at.context("an empty plan")?;
        Ok(steps)
    }
}

/// What the rig saw.
#[derive(Debug, Default)]
pub(super) struct Trace {
    /// Steps, microseconds since power-up.
    pub(super) motors: [Vec<Step>; 2],
    /// New widths of the pen's pulse: time, width, us.
    pub(super) pens: Vec<(f64, f64)>,
    /// Positions with their time: after each step, or each millisecond of a DC machine.
    pub(super) positions: Vec<(f64, [f64; 2])>,
}

impl Trace {
    pub(super) fn read(path: &Path) -> Result<Self> {
        let mut trace = Self::default();
        for line in std::fs::read_to_string(path)?.lines() {
            let words: Vec<&str> = line.split(' ').collect();
            let number = |index: usize| words.get(index).and_then(|word| word.parse::<f64>().ok());
            let (Some(cycle), Some(first)) = (number(1), number(2)) else { continue };
            let time = cycle / CYCLES_PER_US;
            match (words[0], number(3)) {
                ("p", _) => trace.pens.push((time, first)),
                (kind, Some(second)) => {
                    if kind == "s" {
                        let before = trace.positions.last().map_or([0.0; 2], |(_, at)| *at);
                        for (motor, step) in [first - before[0], second - before[1]].into_iter().enumerate() {
                            // The first step has no position before it; its direction is not used.
                            if step != 0.0 {
                                trace.motors[motor].push((time, step as i64));
                            }
                        }
                    }
                    trace.positions.push((time, [first, second]));
                }
                _ => {}
            }
        }
        Ok(trace)
    }

    /// Whether the pen is down at each change, by the pulses' widths.
    pub(super) fn pen_changes(&self, down_us: f64) -> Vec<bool> {
        let mut states: Vec<bool> = self.pens.iter().map(|(_, us)| (us - down_us).abs() < 4.0).collect();
        states.dedup();
        // Up at power-up.
        if states.first() == Some(&false) {
            states.remove(0);
        }
        states
    }
}

/// Steps are this close to their time, us.
pub(super) const STEP_BOUND_US: f64 = 16.0;

/// How early and how late steps are, us, relative to the median: a constant delay moves the whole
/// drawing in time only.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Jitter {
    pub(super) early_us: f64,
    pub(super) late_us: f64,
}

impl std::fmt::Display for Jitter {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "-{:.1} to +{:.1} us", self.early_us, self.late_us)
    }
}

impl Jitter {
    pub(super) fn most(&self) -> f64 {
        self.early_us.max(self.late_us)
    }
}

/// Compares every step with the plan: number, direction, time.
pub(super) fn compare(plan: &Steps, trace: &Trace) -> Result<Jitter> {
    let mut late = Vec::new();
    for motor in 0..2 {
        let (wanted, made) = (&plan.motors[motor], &trace.motors[motor]);
        ensure!(wanted.len() == made.len(), "motor {}: {} steps of {}", motor + 1, made.len(), wanted.len());
        for (index, (wanted, made)) in wanted.iter().zip(made).enumerate() {
            ensure!(wanted.1 == made.1, "motor {}: step {index} goes the wrong way", motor + 1);
            late.push(made.0 - wanted.0);
        }
    }
    late.sort_by(f64::total_cmp);
    let (Some(first), Some(last)) = (late.first(), late.last()) else { return Ok(Jitter::default()) };
    let median = late[late.len() / 2];
    Ok(Jitter { early_us: median - first, late_us: last - median })
}

/// Only number and direction: where the queue may have run empty.
pub(super) fn compare_order(plan: &Steps, trace: &Trace) -> Result<usize> {
    for motor in 0..2 {
        let ways = |steps: &[Step]| steps.iter().map(|step| step.1).collect::<Vec<_>>();
        let (wanted, made) = (ways(&plan.motors[motor]), ways(&trace.motors[motor]));
        ensure!(wanted == made, "motor {}: {} steps of {}", motor + 1, made.len(), wanted.len());
    }
    Ok(plan.motors[0].len() + plan.motors[1].len())
}
