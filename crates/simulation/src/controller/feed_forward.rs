//! Feed-forward: the duty that the planned motion needs by the model of the motor.
//!
//! From `tau dv/dt = g (u - f sign v) - v`, see [`DcMotor`](crate::plant::DcMotor):
//!
//! ```text
//! u = c_v v / g + c_a tau a / g + c_f f sign v
//! ```

use super::Setpoint;
use crate::plant::DcParameters;

/// Below this planned speed friction is not made up for: the motor is to rest, ticks/s.
const AT_REST_TICKS_S: f64 = 1.0;

/// Shares of the model that are fed forward, 0 to 1.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FeedForward {
    /// Share of the speed term.
    pub speed: f64,
    /// Share of the acceleration term.
    pub acceleration: f64,
    /// Share of the friction.
    pub friction: f64,
}

/// What a controller knows of its motor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotorModel {
    /// Speed without load per percent of duty, ticks/s.
    pub speed_per_duty_ticks_s: f64,
    /// Time constant, s.
    pub time_constant_s: f64,
    /// Coulomb friction, %.
    pub friction_percent: f64,
    /// Duty of viscous friction at full speed, %.
    pub viscous_percent: f64,
}

impl From<&DcParameters> for MotorModel {
    fn from(p: &DcParameters) -> Self {
        Self {
            speed_per_duty_ticks_s: p.speed_per_duty_ticks_s,
            time_constant_s: p.time_constant_s,
            friction_percent: p.friction_percent,
            viscous_percent: p.viscous_percent,
        }
    }
}

impl FeedForward {
    /// The duty for this setpoint, %.
    pub fn duty(&self, model: &MotorModel, setpoint: &Setpoint) -> f64 {
        let g = model.speed_per_duty_ticks_s;
        let direction = if setpoint.speed > AT_REST_TICKS_S {
            1.0
        } else if setpoint.speed < -AT_REST_TICKS_S {
            -1.0
        } else {
            0.0
        };
        self.speed * (1.0 + 0.01 * model.viscous_percent) * setpoint.speed / g
            + self.acceleration * model.time_constant_s * setpoint.acceleration / g
            + self.friction * model.friction_percent * direction
    }
}
