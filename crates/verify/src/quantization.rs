//! The quantization error along the ink.

use drawing::Point;
use kinematics::{JointPos, Machine, MotorPos};

use crate::QuantizationError;

/// Distance along the ink between two evaluations, mm.
const STEP_MM: f64 = 0.5;

/// Maximum and weighted mean square of the quantization error.
#[derive(Clone, Debug, Default)]
pub(crate) struct Quantization {
    at: Option<Point>,
    worst_mm: f64,
    squares: f64,
    weight: f64,
}

impl Quantization {
    pub(crate) fn worst_mm(&self) -> f64 {
        self.worst_mm
    }

    /// The pen goes down here.
    pub(crate) fn begin(&mut self, machine: &Machine, joints: &JointPos, point: Point) {
        // A small weight, so that dots count, but not compared with ink that has a length.
        self.add(machine, joints, point, 1e-6);
    }

    /// The pen has drawn up to here. Returns whether the error was evaluated.
    pub(crate) fn follow(&mut self, machine: &Machine, joints: &JointPos, point: Point) -> bool {
        let Some(last) = self.at else { return false };
        let step_mm = libm::hypot(point.x - last.x, point.y - last.y);
        if step_mm < STEP_MM {
            return false;
        }
        self.add(machine, joints, point, step_mm);
        true
    }

    fn add(&mut self, machine: &Machine, joints: &JointPos, point: Point, weight: f64) {
        let worst = machine.quantization_error(joints);
        let square: f64 = [MotorPos::new(1.0, 0.0), MotorPos::new(0.0, 1.0)]
            .map(|tick| machine.mechanism().pen_velocity(joints, &machine.joint_rates(&tick)).hypot2())
            .iter()
            .sum();
        self.at = Some(point);
        self.worst_mm = self.worst_mm.max(worst);
        self.squares += weight * square / 12.0;
        self.weight += weight;
    }

    pub(crate) fn result(&self) -> QuantizationError {
        let mean = if self.weight > 0.0 { self.squares / self.weight } else { 0.0 };
        QuantizationError { worst_mm: self.worst_mm, rms_mm: mean.sqrt() }
    }
}
