//! One instant of a plan with everything that encoders need: the row, the exact motor positions, the joints, the pen.

use drawing::Point;
use kinematics::{Machine, MotorPos};
use plan::Row;

/// One instant of a plan, with what firmware formats need beside the row.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Setpoint {
    /// The row.
    pub row: Row,
    /// Motor positions before rounding, ticks; the row's own ticks where nothing else is known.
    pub exact_ticks: [f64; 2],
    /// The geometric joints, rad or mm.
    pub joints: [f64; 2],
    /// Pen position, machine mm.
    pub at: Point,
}

impl Setpoint {
    /// The setpoint of a row by the machine's forward kinematics.
    pub fn new(machine: &Machine, row: Row, exact_ticks: [f64; 2]) -> Self {
        let joints = machine.joint_positions(&MotorPos::from(exact_ticks));
        Self { row, exact_ticks, joints: joints.into(), at: machine.mechanism().forward(&joints) }
    }
}

/// Whether the motors stand still between two setpoints. A pose computed twice may differ in its last bit.
pub(crate) fn at_rest(from: &Setpoint, to: &Setpoint) -> bool {
    (0..2).all(|motor| (from.exact_ticks[motor] - to.exact_ticks[motor]).abs() < 1e-6)
}

/// The speed of each motor at each setpoint, ticks/s: central differences of the exact positions, 0 at rest.
pub(crate) fn motor_speeds(setpoints: &[Setpoint]) -> Vec<[f64; 2]> {
    let at = |k: usize| &setpoints[k];
    let seconds = |a: usize, b: usize| (at(b).row.t_us - at(a).row.t_us) as f64 * 1e-6;
    let at_rest = |a: usize, b: usize| at_rest(at(a), at(b));
    (0..setpoints.len())
        .map(|k| {
            // A plan begins and ends at rest, and is at rest on both sides of every interval without motion.
            if k == 0 || k + 1 == setpoints.len() || at_rest(k - 1, k) || at_rest(k, k + 1) {
                return [0.0; 2];
            }
            let difference = |motor: usize| at(k + 1).exact_ticks[motor] - at(k - 1).exact_ticks[motor];
            [0, 1].map(|motor| difference(motor) / seconds(k - 1, k + 1))
        })
        .collect()
}
