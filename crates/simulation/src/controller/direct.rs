//! No feedback: the setpoint is the command, as for steppers, RC servos and ideal drives.

use super::{Controller, Measurement, Setpoint};

/// Passes positions on.
#[derive(Clone, Copy, Debug, Default)]
pub struct Direct;

impl Controller for Direct {
    fn update(&mut self, setpoint: &Setpoint, _measured: &Measurement) -> f64 {
        setpoint.position
    }
}
