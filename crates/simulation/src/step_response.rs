//! The response of one motor to a step of its setpoint.

use crate::controller::{Measurement, Setpoint};
use crate::drive::{Drive, MotorPlant};
use crate::plant::STEP_S;

/// How near to its last position the motor must stay to count as settled, as a share of the step.
const SETTLED: f64 = 0.02;

/// Steps between points, at most: 2 ms.
const POINT_STEPS: u64 = 10;

/// The motor at one time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepPoint {
    /// Time, s.
    pub t_s: f64,
    /// Position by the encoder, ticks.
    pub position: f64,
    /// Command from now on: % of duty, or ticks for drives without feedback.
    pub command: f64,
}

/// A step response with its characteristic figures.
#[derive(Clone, Debug, PartialEq)]
pub struct StepResponse {
    /// Position and command at each call of the loop, and every 2 ms.
    pub points: Vec<StepPoint>,
    /// The largest position less the step, ticks; 0 without overshoot.
    pub overshoot_ticks: f64,
    /// From when on the motor stays within 2 % of the step of its last position, s; `None` while it
    /// swings on.
    pub settling_s: Option<f64>,
    /// The last position, ticks.
    pub rest_ticks: f64,
    /// How far the motor swings in the last quarter of the time, from lowest to highest, ticks.
    pub swing_ticks: f64,
}

/// Simulates motor `index` for `duration_s` after a step of `ticks` from rest at 0. Setpoints without
/// time: no feed-forward.
pub fn step_response(drive: &Drive, index: usize, ticks: f64, duration_s: f64) -> StepResponse {
    let mut motor = drive.motors[index].at(0.0);
    let [first, second] = drive.controllers();
    let mut controller = if index == 0 { first } else { second };
    let setpoint = Setpoint { position: ticks, ..Setpoint::default() };
    let is_dc = matches!(drive.motors[index].plant, MotorPlant::Dc(_));
    let mut command = 0.0;
    let mut points = Vec::new();
    let step_of = |time: f64| (time / STEP_S - 1e-6).ceil().max(0.0) as u64;
    let (end, mut now, mut call, mut next_call) = (step_of(duration_s), 0, 0_u64, 0);
    while now <= end {
        let counts = libm::floor(motor.position() * drive.counts_per_tick + 0.5) / drive.counts_per_tick;
        if now == next_call {
            let current_a = if is_dc { motor.current_a(command) } else { 0.0 };
            command = controller.update(&setpoint, &Measurement { position: counts, current_a });
            call += 1;
            next_call = step_of(call as f64 * drive.period_s);
        }
        points.push(StepPoint { t_s: now as f64 * STEP_S, position: counts, command });
        let until = next_call.min((now / POINT_STEPS + 1) * POINT_STEPS);
        motor.advance(command, (until - now) as u32);
        now = until;
    }
    figures(points, ticks)
}

fn figures(points: Vec<StepPoint>, ticks: f64) -> StepResponse {
    let rest = points.last().map_or(0.0, |point| point.position);
    let sign = if ticks < 0.0 { -1.0 } else { 1.0 };
    let highest = points.iter().map(|point| sign * point.position).fold(0.0, f64::max);
    let tail = &points[points.len() * 3 / 4..];
    let low = tail.iter().map(|point| point.position).fold(f64::INFINITY, f64::min);
    let high = tail.iter().map(|point| point.position).fold(f64::NEG_INFINITY, f64::max);
    let band = SETTLED * ticks.abs();
    let outside = points.iter().rposition(|point| (point.position - rest).abs() > band);
    let settled = outside.map_or(0, |index| index + 1);
    // Settled at the very end only: it is still on its way.
    let settling_s = (settled * 4 < points.len() * 3).then(|| points[settled].t_s);
    StepResponse {
        overshoot_ticks: (highest - sign * ticks).max(0.0),
        settling_s,
        rest_ticks: rest,
        swing_ticks: high - low,
        points,
    }
}
