//! A DC gearmotor with friction.
//!
//! In ticks and % of duty, with `w` the share of the supply that is left after the back-EMF:
//!
//! ```text
//! tau dv/dt = g (w - f sign v - b v / (100 g)),   w = clamp(u - v / g, -L, L)
//! ```
//!
//! | symbol | meaning | unit |
//! |---|---|---|
//! | `u` | duty | % |
//! | `v` | speed | ticks/s |
//! | `g` | speed without load per % of duty | ticks/s |
//! | `tau` | time constant, load included | s |
//! | `f`, `s` | Coulomb friction, stiction | % |
//! | `b` | viscous friction at the speed `100 g` | % |
//! | `L` | current limit as the duty that drives it at standstill | % |
//!
//! Without a current limit (`L` infinite) this is the first-order motor
//! `tau dv/dt = g (u - f sign v) - (1 + b/100) v`. At rest the motor stays at rest as long as
//! `|u| <= s` (D. Karnopp: "Computer simulation of stick-slip friction in mechanical dynamic
//! systems", J. Dyn. Sys. Meas. Control 1985). The inductance is neglected: it acts within a
//! millisecond.

use super::{Motor, STEP_S};

/// Below this speed a motor counts as at rest (Karnopp's velocity band), ticks/s.
pub const STICTION_BAND_TICKS_S: f64 = 1.0;

/// Parameters of a [`DcMotor`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DcParameters {
    /// Speed without load per percent of duty, ticks/s.
    pub speed_per_duty_ticks_s: f64,
    /// Time constant with the load, s.
    pub time_constant_s: f64,
    /// Duty up to which the motor does not start, %.
    pub stiction_percent: f64,
    /// Duty that Coulomb friction costs while it moves, %; at most the stiction.
    pub friction_percent: f64,
    /// Duty that viscous friction costs at the speed of 100 % duty without load, %.
    pub viscous_percent: f64,
    /// The current limit as duty at standstill, %; infinite without one.
    pub current_limit_percent: f64,
    /// Current per percent of duty at standstill, A; 0 where it is not known.
    pub current_per_duty_a: f64,
    /// Torque at the gear's output per percent of duty at standstill, N m; 0 where it is not known.
    pub torque_per_duty_nm: f64,
    /// Inertia at the gear's output, kg m²; 0 where it is not known.
    pub inertia_kg_m2: f64,
}

impl DcParameters {
    /// The first-order motor without friction, viscous friction and current limit.
    pub fn first_order(speed_per_duty_ticks_s: f64, time_constant_s: f64) -> Self {
        Self {
            speed_per_duty_ticks_s,
            time_constant_s,
            stiction_percent: 0.0,
            friction_percent: 0.0,
            viscous_percent: 0.0,
            current_limit_percent: f64::INFINITY,
            current_per_duty_a: 0.0,
            torque_per_duty_nm: 0.0,
            inertia_kg_m2: 0.0,
        }
    }

    /// The same motor with stiction and Coulomb friction, % of duty.
    #[must_use]
    pub fn with_friction(self, stiction_percent: f64, friction_percent: f64) -> Self {
        Self { stiction_percent, friction_percent, ..self }
    }
}

/// A gearmotor by its data sheet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DcSheet {
    /// Supply voltage, V.
    pub supply_v: f64,
    /// Winding resistance, ohm.
    pub resistance_ohm: f64,
    /// Torque constant of the motor without gear, N m/A; equal to the back-EMF constant in V s/rad.
    pub torque_constant_nm_a: f64,
    /// Inertia of the rotor, kg m².
    pub inertia_kg_m2: f64,
    /// Inertia of the load at the gear's output, kg m².
    pub load_inertia_kg_m2: f64,
    /// Gear ratio: turns of the motor per turn of the output.
    pub gear: f64,
    /// Current limit of driver or supply, A; infinite without one.
    pub current_limit_a: f64,
    /// Ticks per rad of the gear's output.
    pub ticks_per_rad: f64,
}

impl DcSheet {
    /// The motor's parameters, without friction:
    /// `g = V ticks / (100 k n)`, `tau = J R / (k n)²` with `J = J_rotor n² + J_load`.
    pub fn parameters(&self) -> DcParameters {
        let geared = self.torque_constant_nm_a * self.gear;
        let inertia = self.inertia_kg_m2 * self.gear * self.gear + self.load_inertia_kg_m2;
        let current_per_duty_a = self.supply_v / (100.0 * self.resistance_ohm);
        DcParameters {
            current_limit_percent: self.current_limit_a / current_per_duty_a,
            current_per_duty_a,
            torque_per_duty_nm: current_per_duty_a * geared,
            inertia_kg_m2: inertia,
            ..DcParameters::first_order(
                self.supply_v / (100.0 * geared) * self.ticks_per_rad.abs(),
                inertia * self.resistance_ohm / (geared * geared),
            )
        }
    }
}

/// `tau dv/dt = b - c v` over a time: exact solution.
#[derive(Clone, Copy, Debug)]
struct Affine {
    /// `c / tau`, 1/s.
    rate: f64,
    /// `exp(-rate STEP_S)`.
    decay: f64,
    /// `tau / c (1 - decay)`, s; [`STEP_S`] where `c` is 0.
    glide_s: f64,
    /// `1 / c`; 0 where `c` is 0.
    inverse: f64,
    tau: f64,
}

impl Affine {
    fn new(tau: f64, c: f64) -> Self {
        if c > 0.0 {
            let decay = libm::exp(-c * STEP_S / tau);
            Self { rate: c / tau, decay, glide_s: tau / c * (1.0 - decay), inverse: 1.0 / c, tau }
        } else {
            Self { rate: 0.0, decay: 1.0, glide_s: STEP_S, inverse: 0.0, tau }
        }
    }

    /// Speed and distance after a whole step, from speed `v`.
    fn step(&self, v: f64, b: f64) -> (f64, f64) {
        if self.rate == 0.0 {
            let gained = b * STEP_S / self.tau;
            return (v + gained, (v + 0.5 * gained) * STEP_S);
        }
        let limit = b * self.inverse;
        (limit + (v - limit) * self.decay, limit * STEP_S + (v - limit) * self.glide_s)
    }

    /// The time until the speed is 0 and the distance up to there, for a speed that changes its sign.
    fn stop(&self, v: f64, b: f64) -> (f64, f64) {
        if self.rate == 0.0 {
            let time = -v * self.tau / b;
            return (time, 0.5 * v * time);
        }
        let limit = b * self.inverse;
        let time = libm::log(1.0 - v / limit) / self.rate;
        (time, limit * time + v / self.rate)
    }

    /// Speed and distance after `time`, from rest.
    fn start(&self, b: f64, time: f64) -> (f64, f64) {
        if self.rate == 0.0 {
            let v = b * time / self.tau;
            return (v, 0.5 * v * time);
        }
        let limit = b * self.inverse;
        let reached = -libm::expm1(-self.rate * time);
        (limit * reached, limit * (time - reached / self.rate))
    }
}

/// A DC motor under a duty in percent. Each step is integrated exactly, zero crossings of the speed
/// included; only the current limit switches between steps.
#[derive(Clone, Debug)]
pub struct DcMotor {
    parameters: DcParameters,
    position: f64,
    speed: f64,
    free: Affine,
    limited: Affine,
}

impl DcMotor {
    /// A motor at rest at this position, ticks.
    pub fn new(parameters: DcParameters, position: f64) -> Self {
        let viscous = 0.01 * parameters.viscous_percent;
        Self {
            parameters,
            position,
            speed: 0.0,
            free: Affine::new(parameters.time_constant_s, 1.0 + viscous),
            limited: Affine::new(parameters.time_constant_s, viscous),
        }
    }

    /// The same at another speed, ticks/s.
    #[must_use]
    pub fn at_speed(mut self, speed: f64) -> Self {
        self.speed = speed;
        self
    }

    fn step(&mut self, duty: f64) {
        let p = &self.parameters;
        let slow = self.speed.abs() < STICTION_BAND_TICKS_S;
        if slow && duty.abs() <= p.stiction_percent {
            self.speed = 0.0;
            return;
        }
        // In the band friction opposes the drive, outside the motion.
        let direction = if slow { duty } else { self.speed };
        let friction = p.friction_percent.copysign(direction);
        let (law, b) = self.law(duty, friction);
        let (speed, distance) = law.step(self.speed, b);
        if slow || speed * self.speed >= 0.0 {
            self.speed = speed;
            self.position += distance;
            return;
        }
        let (time, distance) = law.stop(self.speed, b);
        self.position += distance;
        self.speed = 0.0;
        if duty.abs() > p.stiction_percent {
            let (law, b) = self.law(duty, p.friction_percent.copysign(duty));
            let (speed, distance) = law.start(b, STEP_S - time);
            self.speed = speed;
            self.position += distance;
        }
    }

    /// The affine law at the present speed and its constant term.
    fn law(&self, duty: f64, friction: f64) -> (&Affine, f64) {
        let p = &self.parameters;
        let left = duty - self.speed / p.speed_per_duty_ticks_s;
        if left.abs() <= p.current_limit_percent {
            (&self.free, p.speed_per_duty_ticks_s * (duty - friction))
        } else {
            let limit = p.current_limit_percent.copysign(left);
            (&self.limited, p.speed_per_duty_ticks_s * (limit - friction))
        }
    }
}

impl Motor for DcMotor {
    fn advance(&mut self, command: f64, steps: u32) {
        for _ in 0..steps {
            self.step(command);
        }
    }

    fn position(&self) -> f64 {
        self.position
    }

    fn speed(&self) -> f64 {
        self.speed
    }

    fn current_a(&self, duty: f64) -> f64 {
        let p = &self.parameters;
        let left = duty - self.speed / p.speed_per_duty_ticks_s;
        p.current_per_duty_a * left.clamp(-p.current_limit_percent, p.current_limit_percent)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn step_response_of_first_order_motor_is_the_closed_form() {
        let (g, tau, u) = (106.67, 0.12, 40.0);
        let mut motor = DcMotor::new(DcParameters::first_order(g, tau), 800.0);
        for step in 1..=5000 {
            motor.advance(u, 1);
            let t = f64::from(step) * STEP_S;
            let e = libm::exp(-t / tau);
            assert!((motor.speed() - g * u * (1.0 - e)).abs() < 1e-8, "speed at {t} s");
            let x = 800.0 + g * u * (t - tau * (1.0 - e));
            assert!((motor.position() - x).abs() < 1e-8, "position at {t} s");
        }
    }

    #[test]
    fn motor_below_stiction_stays_and_above_starts() {
        let parameters = DcParameters::first_order(106.67, 0.12).with_friction(8.0, 6.0);
        let mut motor = DcMotor::new(parameters, 0.0);
        motor.advance(8.0, 5000);
        assert_eq!((motor.position(), motor.speed()), (0.0, 0.0));
        motor.advance(-8.0, 5000);
        assert_eq!((motor.position(), motor.speed()), (0.0, 0.0));
        motor.advance(8.01, 50_000);
        assert!((motor.speed() - 106.67 * 2.01).abs() < 1e-6, "{}", motor.speed());
    }

    #[test]
    fn coasting_motor_stops_after_the_closed_form_time_and_distance() {
        // tau dv/dt = -g f - v from v0: rest at t = tau ln(1 + v0 / (g f)), x = tau v0 - g f t.
        let (g, tau, f, v0) = (100.0, 0.1, 5.0, 2000.0);
        let parameters = DcParameters::first_order(g, tau).with_friction(7.0, f);
        let mut motor = DcMotor::new(parameters, 0.0).at_speed(v0);
        let time = tau * libm::log(1.0 + v0 / (g * f));
        motor.advance(0.0, (time / STEP_S) as u32);
        assert!(motor.speed() > 0.0);
        motor.advance(0.0, 1);
        assert_eq!(motor.speed(), 0.0);
        // Less the way within the velocity band: 1 tick/s for 0.2 ms.
        assert!((motor.position() - (tau * v0 - g * f * time)).abs() < 2e-4, "{}", motor.position());
    }

    #[test]
    fn reversal_within_a_step_passes_zero_with_friction_on_either_side() {
        let parameters = DcParameters::first_order(100.0, 0.1).with_friction(7.0, 5.0);
        let mut motor = DcMotor::new(parameters, 0.0).at_speed(5.0);
        motor.advance(-100.0, 1);
        // Before: -100*(100+5) - v per tau; after: -100*(100-5).
        let stop = 0.1 * libm::log(1.0 + 5.0 / 10_500.0);
        let expected = -9500.0 * (1.0 - libm::exp(-(STEP_S - stop) / 0.1));
        assert!((motor.speed() - expected).abs() < 1e-9, "{} {expected}", motor.speed());
    }

    #[test]
    fn current_limit_gives_constant_acceleration_from_rest() {
        let parameters =
            DcParameters { current_limit_percent: 20.0, ..DcParameters::first_order(100.0, 0.1) };
        let mut motor = DcMotor::new(parameters, 0.0);
        // g L / tau = 20000 ticks/s², until v / g = 80 % of duty.
        motor.advance(100.0, 100);
        assert!((motor.speed() - 400.0).abs() < 1e-9);
        assert!((motor.position() - 4.0).abs() < 1e-9);
    }

    #[test]
    fn data_sheet_gives_speed_and_time_constant() {
        let sheet = DcSheet {
            supply_v: 12.0,
            resistance_ohm: 2.4,
            torque_constant_nm_a: 0.0115,
            inertia_kg_m2: 1e-6,
            load_inertia_kg_m2: 0.0,
            gear: 50.0,
            current_limit_a: 3.0,
            ticks_per_rad: 3200.0 / std::f64::consts::TAU,
        };
        let p = sheet.parameters();
        // 12 V / (0.0115 * 50) = 20.87 rad/s = 10 629 ticks/s.
        assert!((p.speed_per_duty_ticks_s - 106.2887).abs() < 1e-3, "{}", p.speed_per_duty_ticks_s);
        // 1e-6 * 2.4 / 0.0115².
        assert!((p.time_constant_s - 0.018_147).abs() < 1e-6);
        assert!((p.current_limit_percent - 60.0).abs() < 1e-9);
        assert!((DcMotor::new(p, 0.0).current_a(100.0) - 3.0).abs() < 1e-12);
    }

    #[test]
    fn viscous_friction_lowers_the_final_speed() {
        let parameters = DcParameters { viscous_percent: 25.0, ..DcParameters::first_order(100.0, 0.1) };
        let mut motor = DcMotor::new(parameters, 0.0);
        motor.advance(50.0, 20_000);
        assert!((motor.speed() - 4000.0).abs() < 1e-6);
    }
}
