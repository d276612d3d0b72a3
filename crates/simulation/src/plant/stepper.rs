//! A stepper motor that loses steps when more torque is needed than it has.
//!
//! The field pulls the rotor `x` towards the commanded position `c` with the torque
//!
//! ```text
//! J x'' = clamp(T(|v|) sin(2 pi (c - x) / p) + D (c' - x'), -T(|v|), T(|v|)) - T_f sign(x')
//! ```
//!
//! with the period `p` of four full steps. `T(v)` is the pull-out torque of the data sheet, interpolated linearly; beyond the last speed of
//! the table it is 0, which is reported. `D` damps small oscillations about the field with a ratio of
//! 0.7 of the critical one: the data sheets do not give it; drivers and friction damp about as much.
//! When the rotor is more than two full steps away from the field, it falls into the next well: a
//! multiple of four full steps is lost. (T. Kenjo, A. Sugawara: "Stepping Motors and Their
//! Microprocessor Controls", 1994, chapter 4.)

use std::f64::consts::TAU;

use super::{Motor, STEP_S};

/// Share of the critical damping.
const DAMPING_RATIO: f64 = 0.7;
/// Largest phase of the rotor's own oscillation within one part of a step, rad.
const PHASE_RAD: f64 = 0.2;

/// Parameters of a [`Stepper`].
#[derive(Clone, Debug, PartialEq)]
pub struct StepperParameters {
    /// Pull-out torque against speed: (ticks/s, N m), in increasing order of the speed.
    pub pull_out: Vec<(f64, f64)>,
    /// Inertia of rotor and load on the motor's shaft, kg m².
    pub inertia_kg_m2: f64,
    /// Friction on the motor's shaft, N m.
    pub friction_nm: f64,
    /// Ticks in one full step: the number of microsteps.
    pub microsteps: f64,
    /// Full steps a turn.
    pub steps_per_turn: f64,
}

impl StepperParameters {
    /// Pull-out torque at a speed in ticks/s, N m.
    pub fn pull_out_nm(&self, speed: f64) -> f64 {
        let table = &self.pull_out;
        let above = table.partition_point(|(at, _)| *at <= speed);
        match (above.checked_sub(1).map(|index| table[index]), table.get(above)) {
            (Some((v0, t0)), Some((v1, t1))) => t0 + (t1 - t0) * (speed - v0) / (v1 - v0),
            (None, Some((_, torque))) => *torque,
            (Some((at, torque)), None) if speed <= at => torque,
            _ => 0.0,
        }
    }

    /// Ticks per rad of the motor's shaft.
    fn ticks_per_rad(&self) -> f64 {
        self.microsteps * self.steps_per_turn / TAU
    }
}

/// A stepper under a position in ticks. Commands are ramps over the steps of a call.
#[derive(Clone, Debug)]
pub struct Stepper {
    parameters: StepperParameters,
    /// Ticks of four full steps.
    period: f64,
    /// Torque in N m to acceleration in ticks/s².
    acceleration_per_nm: f64,
    damping_per_s: f64,
    parts: u32,
    position: f64,
    speed: f64,
    command: f64,
    lost_periods: f64,
    torque_share: f64,
    beyond_ticks_s: f64,
}

impl Stepper {
    /// A motor at rest at this position, ticks.
    pub fn new(parameters: StepperParameters, position: f64) -> Self {
        let period = 4.0 * parameters.microsteps;
        let acceleration_per_nm = parameters.ticks_per_rad() / parameters.inertia_kg_m2;
        let stiffness = acceleration_per_nm * parameters.pull_out_nm(0.0) * TAU / period;
        let natural = stiffness.sqrt();
        Self {
            period,
            acceleration_per_nm,
            damping_per_s: 2.0 * DAMPING_RATIO * natural,
            parts: (natural * STEP_S / PHASE_RAD).ceil().clamp(1.0, 100.0) as u32,
            position,
            speed: 0.0,
            command: position,
            lost_periods: 0.0,
            torque_share: 0.0,
            beyond_ticks_s: 0.0,
            parameters,
        }
    }

    fn part(&mut self, dt: f64, command: f64, command_speed: f64) {
        let p = &self.parameters;
        let available = p.pull_out_nm(self.speed.abs().max(command_speed.abs()));
        let field = available * libm::sin(TAU * (command - self.position) / self.period);
        let damping = self.damping_per_s / self.acceleration_per_nm * (command_speed - self.speed);
        let torque = (field + damping).clamp(-available, available);
        let driven = self.acceleration_per_nm * torque;
        let friction = self.acceleration_per_nm * p.friction_nm;
        // Semi-implicit Euler; friction never turns the motion around.
        let free = self.speed + driven * dt;
        let slowed = (free.abs() - friction * dt).max(0.0);
        self.speed = slowed.copysign(free);
        self.position += self.speed * dt;
        let lag = (command - self.position) / self.period - self.lost_periods;
        if lag.abs() > 0.5 {
            self.lost_periods += lag.round();
        }
        let share = if available > 0.0 { (torque / available).abs() } else { 1.0 };
        self.torque_share = self.torque_share.max(share);
        let last = p.pull_out.last().map_or(0.0, |(at, _)| *at);
        self.beyond_ticks_s = self.beyond_ticks_s.max(command_speed.abs() - last);
    }
}

impl Motor for Stepper {
    fn advance(&mut self, command: f64, steps: u32) {
        if steps == 0 {
            return;
        }
        let parts = steps * self.parts;
        let dt = f64::from(steps) * STEP_S / f64::from(parts);
        let from = self.command;
        let rate = (command - from) / (f64::from(parts) * dt);
        for part in 1..=parts {
            self.part(dt, from + rate * dt * f64::from(part), rate);
        }
        self.command = command;
    }

    fn position(&self) -> f64 {
        self.position
    }

    fn speed(&self) -> f64 {
        self.speed
    }

    fn lost_ticks(&self) -> f64 {
        self.lost_periods * self.period
    }

    fn torque_margin(&self) -> Option<(f64, f64)> {
        Some((self.torque_share, self.beyond_ticks_s.max(0.0)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parameters() -> StepperParameters {
        StepperParameters {
            pull_out: vec![(0.0, 0.4), (3200.0, 0.3), (16_000.0, 0.1)],
            inertia_kg_m2: 2e-5,
            friction_nm: 0.02,
            microsteps: 16.0,
            steps_per_turn: 200.0,
        }
    }

    /// Runs a ramp of constant acceleration (ticks/s²) for a time, then stops as fast.
    fn ramp(acceleration: f64, time: f64) -> Stepper {
        let mut stepper = Stepper::new(parameters(), 0.0);
        let steps = (time / STEP_S).round() as u32;
        let (mut x, mut v) = (0.0, 0.0);
        for step in 0..2 * steps {
            v += acceleration * STEP_S * if step < steps { 1.0 } else { -1.0 };
            x += v * STEP_S;
            stepper.advance(x, 1);
        }
        stepper.advance(x, 1000);
        stepper
    }

    #[test]
    fn pull_out_torque_is_interpolated_and_ends_with_the_table() {
        let p = parameters();
        assert_eq!(p.pull_out_nm(0.0), 0.4);
        assert!((p.pull_out_nm(1600.0) - 0.35).abs() < 1e-12);
        assert!((p.pull_out_nm(16_000.0) - 0.1).abs() < 1e-12);
        assert_eq!(p.pull_out_nm(16_001.0), 0.0);
    }

    #[test]
    fn no_step_is_lost_below_pull_out_torque() {
        // J a: 2e-5 * 20000 * tau / 3200 = 0.0008 N m, far below 0.3.
        let stepper = ramp(20_000.0, 0.15);
        assert_eq!(stepper.lost_ticks(), 0.0);
        assert!((stepper.position() - 20_000.0 * 0.15 * 0.15).abs() < 3.0, "{}", stepper.position());
    }

    #[test]
    fn steps_are_lost_and_counted_above_pull_out_torque() {
        // 2e-5 * 1.2e7 * tau / 3200 = 0.47 N m, more than 0.4.
        let lost = ramp(12_000_000.0, 0.02);
        assert!(lost.lost_ticks() != 0.0);
        assert_eq!(lost.lost_ticks() % 64.0, 0.0, "whole periods of four full steps");
        assert!(lost.torque_margin().is_some_and(|(share, beyond)| share > 0.99 && beyond > 0.0));
    }

    #[test]
    fn constant_friction_leaves_the_static_lag() {
        // T sin(2 pi lag / 64) = T_f: at rest the rotor may stay anywhere within it.
        let stepper = ramp(20_000.0, 0.15);
        let at = 20_000.0 * 0.15 * 0.15;
        let most = 64.0 / TAU * libm::asin(0.02 / 0.4);
        assert!((stepper.position() - at).abs() <= most + 0.05, "{}", stepper.position() - at);
    }
}
