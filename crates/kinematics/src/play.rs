//! Play between the motors and the mechanism.

use crate::Machine;

/// Follows the load of each motor through its backlash.
///
/// With the play `b` of a motor at `x`, in ticks, its load `y` is `clamp(y, x - b/2, x + b/2)`: the load
/// rests until the motor has taken up the play (M. Nordin, P.-O. Gutman: "Controlling mechanical
/// systems with backlash - a survey", Automatica 2002). A motor without backlash moves its load at once.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Play {
    half: [f64; 2],
    motors: [f64; 2],
    loads: [f64; 2],
}

/// Positions of the loads at which one of them starts to move while the motors move linearly: at most
/// one for each motor.
pub type Corners = [Option<[f64; 2]>; 2];

impl Play {
    /// At rest at these motor positions, ticks, with each load in the middle of its play.
    pub fn new(machine: &Machine, motors: [f64; 2]) -> Self {
        let half = machine.motors().each_ref().map(|motor| 0.5 * motor.backlash_ticks);
        Self { half, motors, loads: motors }
    }

    /// The backlash of the motors, ticks.
    pub fn backlash(&self) -> [f64; 2] {
        self.half.map(|half| 2.0 * half)
    }

    /// The positions of the loads, ticks.
    pub fn loads(&self) -> [f64; 2] {
        self.loads
    }

    /// Moves the motors linearly to these positions, ticks. The loads move linearly from corner to
    /// corner, then to [`Self::loads`].
    pub fn follow(&mut self, to: [f64; 2]) -> Corners {
        let from = self.motors;
        let mut shares = [0, 1].map(|motor: usize| {
            let way = to[motor] - from[motor];
            let gap = self.loads[motor] - from[motor] + self.half[motor].copysign(way);
            // A load without play moves from the start.
            Some(gap / way).filter(|share| self.half[motor] > 0.0 && *share > 0.0 && *share < 1.0)
        });
        if shares[0] > shares[1] {
            shares.swap(0, 1);
        }
        let at = |share: f64, loads: &[f64; 2]| {
            [0, 1].map(|motor| {
                let x = if share < 1.0 { from[motor] + share * (to[motor] - from[motor]) } else { to[motor] };
                loads[motor].clamp(x - self.half[motor], x + self.half[motor])
            })
        };
        let corners = shares.map(|share| share.map(|share| at(share, &self.loads)));
        self.loads = at(1.0, &self.loads);
        self.motors = to;
        corners
    }
}
