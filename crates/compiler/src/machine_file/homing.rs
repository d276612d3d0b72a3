//! `[homing]`: how the machine finds its start pose.

use kinematics::{Homing, HomingAxis, HomingMethod, HomingMove, JointRange, Mechanism, TIMEOUT_FACTOR};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{MachineFileError, MotorTable, dimension};
use crate::quantity::{self, Dimension};

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct HomingTable {
    /// What a person does before the start pose is confirmed, instead of `moves`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pose: Option<String>,
    /// One or two moves towards switches, in their order.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    moves: Option<Vec<MoveTable>>,
    /// Whether `calibrate` measured where the switches are.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    calibrated: bool,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct MoveTable {
    /// The joint that moves.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    joint: Option<String>,
    /// The motor that moves, instead of a joint.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    motor: Option<String>,
    /// Name of the switch, or `"stop"` for a mechanical stop.
    towards: String,
    /// Speed towards it; its sign is the direction.
    speed: String,
    /// Speed of the second approach; without it, a tenth of `speed`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    slow_speed: Option<String>,
    /// How far it goes back from the switch.
    back_off: String,
    /// The longest way to the switch; without it, the range of the joint.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    travel: Option<String>,
    /// The move fails after this time; without it, a multiple of `travel` at `speed`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    timeout: Option<String>,
}

/// The word for a mechanical stop.
const STOP: &str = "stop";
/// The second approach is this much slower unless the file states its speed.
const SLOW_SHARE: f64 = 0.1;

fn invalid(what: impl Into<String>) -> MachineFileError {
    MachineFileError::Invalid(what.into())
}

impl HomingTable {
    pub(super) fn homing(
        &self,
        mechanism: &dyn Mechanism,
        motors: &[MotorTable],
        joints: &[JointRange; 2],
    ) -> Result<Homing, MachineFileError> {
        let method = match (&self.pose, &self.moves) {
            (Some(pose), None) if !pose.trim().is_empty() => HomingMethod::Pose(pose.trim().to_owned()),
            (None, Some(moves)) if (1..=2).contains(&moves.len()) => {
                let read =
                    |(number, table): (usize, &MoveTable)| table.read(number, mechanism, motors, joints);
                HomingMethod::Moves(moves.iter().enumerate().map(read).collect::<Result<_, _>>()?)
            }
            (None, Some(moves)) => {
                return Err(invalid(format!("homing.moves must be one or two moves, not {}", moves.len())));
            }
            _ => {
                return Err(invalid(
                    "[homing] has either `moves`, or `pose`: what a person does before confirming",
                ));
            }
        };
        if let HomingMethod::Moves(moves) = &method
            && let [first, second] = moves.as_slice()
            && first.axis == second.axis
        {
            return Err(invalid("both moves of [homing] are of the same axis"));
        }
        Ok(Homing { method, calibrated: self.calibrated })
    }
}

impl MoveTable {
    fn read(
        &self,
        number: usize,
        mechanism: &dyn Mechanism,
        motors: &[MotorTable],
        joints: &[JointRange; 2],
    ) -> Result<HomingMove, MachineFileError> {
        let at = |key: &str| {
            let key = format!("{key} of homing move {}", number + 1);
            move |source| MachineFileError::Quantity { key, source }
        };
        let (axis, dimension, range) = self.axis(number, mechanism, motors, joints)?;
        let rate = |text: &str, key: &str| quantity::rate_ticks(text, 1, 1.0, dimension).map_err(at(key));
        let speed = rate(&self.speed, "speed")?;
        let back_off = dimension.value(&self.back_off).map_err(at("back_off"))?;
        let travel = match &self.travel {
            Some(travel) => dimension.value(travel).map_err(at("travel"))?,
            None if range.is_finite() => range,
            None => {
                return Err(invalid(format!(
                    "homing move {} needs `travel`, the longest way to its switch: the joint has no limits",
                    number + 1
                )));
            }
        };
        Ok(HomingMove {
            axis,
            switch: (self.towards != STOP).then(|| self.towards.clone()),
            speed,
            slow_speed: match &self.slow_speed {
                Some(slow) => rate(slow, "slow_speed")?,
                None => SLOW_SHARE * speed.abs(),
            },
            back_off,
            travel,
            timeout_s: match &self.timeout {
                Some(timeout) => quantity::time_s(timeout).map_err(at("timeout"))?,
                None => TIMEOUT_FACTOR * travel / speed.abs(),
            },
        })
    }

    /// What moves, what its values are, and its range.
    fn axis(
        &self,
        number: usize,
        mechanism: &dyn Mechanism,
        motors: &[MotorTable],
        joints: &[JointRange; 2],
    ) -> Result<(HomingAxis, Dimension, f64), MachineFileError> {
        let unknown = |what: &str, name: &str, names: [&str; 2]| {
            invalid(format!(
                "homing move {} names the {what} {name}, but this machine has {} and {}",
                number + 1,
                names[0],
                names[1]
            ))
        };
        match (&self.joint, &self.motor) {
            (Some(joint), None) => {
                let names = mechanism.joint_names();
                let index = names.iter().position(|name| name == joint);
                let index = index.ok_or_else(|| unknown("joint", joint, names))?;
                let range = joints[index].max - joints[index].min;
                Ok((HomingAxis::Joint(index), dimension(mechanism.joint_kinds()[index]), range))
            }
            (None, Some(motor)) => {
                let names = [0, 1].map(|index| motors.get(index).map_or("", |motor| motor.name.as_str()));
                let index = names.iter().position(|name| name == motor);
                let index = index.ok_or_else(|| unknown("motor", motor, names))?;
                let (_, dimension) = quantity::counts(&motors[index].counts).map_err(|source| {
                    MachineFileError::Quantity { key: format!("counts of motor {motor}"), source }
                })?;
                Ok((HomingAxis::Motor(index), dimension, f64::INFINITY))
            }
            _ => Err(invalid(format!("homing move {} has either `joint` or `motor`", number + 1))),
        }
    }
}
