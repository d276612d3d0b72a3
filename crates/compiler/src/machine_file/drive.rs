//! The `[drive]` table of a machine file: motors, loop, setpoints, for simulations.

use kinematics::{Machine, TwoLink};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use simulation::{
    AntiWindup, ArmInertia, CascadeGains, DcParameters, DcSheet, Drive, DriveError, FeedForward, Feedback,
    LinkInertia, MotorDrive, MotorPlant, PidGains, RcServoParameters, SetpointKind, StepperParameters,
};

use super::{MachineFileError, MotorTable};
use crate::quantity::{self, Dimension, PhysicalUnit, QuantityError};

/// A drive as the file gives it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DriveTable {
    /// What the loop gets between two rows.
    #[serde(default)]
    setpoints: SetpointsWord,
    /// With `"vertices"`: both motors are this close, ticks; without it, 20.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    reached_within: Option<f64>,
    /// Time between calls of the loop; without it, that of the plan.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    period: Option<String>,
    /// Time of the first call; without it, 0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    phase: Option<String>,
    /// Proportional gain, % of duty per tick; DC motors need it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    kp: Option<f64>,
    /// Integral gain, % of duty per tick and s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    ki: Option<f64>,
    /// Derivative gain, % of duty per tick/s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    kd: Option<f64>,
    /// Time constant of the low-pass filter of the derivative.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    kd_filter: Option<String>,
    /// What the integral does while the duty is at its limit; `true` is `"conditional"`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    anti_windup: Option<AntiWindupWord>,
    /// Encoder counts in a tick; without it, 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    counts_per_tick: Option<f64>,
    /// Shares, 0 to 1, of the duty that the planned motion needs by the model.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    feed_forward: Option<FeedForwardTable>,
    /// Loops of position, speed and current instead of gains.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    cascade: Option<CascadeTable>,
    /// Masses of a two-link arm; needs DC motors by their data sheet.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    arm: Option<ArmTable>,
    /// One table for both motors, or one for each.
    motor: Vec<DriveMotorTable>,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
enum SetpointsWord {
    Vertices,
    Held,
    #[default]
    Interpolated,
}

/// `true` is the usual kind.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "expected true, false, \"conditional\", \"clamp\" or \"none\"")]
enum AntiWindupWord {
    Switch(bool),
    Kind(AntiWindupKind),
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
enum AntiWindupKind {
    None,
    Conditional,
    Clamp,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
struct FeedForwardTable {
    /// Share of the duty for the speed.
    speed: f64,
    /// Share of the duty for the acceleration.
    acceleration: f64,
    /// Share of the duty for friction.
    friction: f64,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct CascadeTable {
    /// Gain of the position loop, 1/s.
    position: f64,
    /// Gain of the speed loop, A per tick/s.
    speed_kp: f64,
    /// Integral gain of the speed loop, A per tick.
    #[serde(default)]
    speed_ki: f64,
    /// Gain of the current loop, % of duty per A.
    current_kp: f64,
    /// Integral gain of the current loop, % of duty per A s.
    #[serde(default)]
    current_ki: f64,
    /// Time over which the speed is measured.
    speed_window: String,
    /// Time constant of the filter of the current.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    current_filter: Option<String>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct ArmTable {
    /// The link at the base.
    link1: LinkTable,
    /// The link with the pen.
    link2: LinkTable,
    /// Mass at the elbow.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    elbow_mass: Option<String>,
    /// Mass of the pen and its holder.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pen_mass: Option<String>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct LinkTable {
    /// Mass.
    mass: String,
    /// Centre of mass from its joint; without it, the middle.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    center: Option<String>,
    /// Inertia about the centre of mass; without it, that of a rod.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    inertia: Option<String>,
}

/// A `[[drive.motor]]` table. Which keys belong to which kind is checked when the drive is made.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct DriveMotorTable {
    /// The model.
    kind: MotorKind,
    /// dc: speed without load per % of duty, `"106.67ticks/s"`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    speed_per_duty: Option<String>,
    /// dc: time constant of the speed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    time_constant: Option<String>,
    /// dc: duty at which it starts to turn, %.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    stiction: Option<f64>,
    /// dc: duty that friction takes while it turns, %.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    friction: Option<f64>,
    /// dc: duty that viscous friction takes at the speed of 100 % duty, %.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    viscous: Option<f64>,
    /// dc: current at 100 % duty and no speed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    stall_current: Option<String>,
    /// dc: limit of the current.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    current_limit: Option<String>,
    /// dc: supply voltage.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    supply: Option<String>,
    /// dc: resistance of the winding.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    resistance: Option<String>,
    /// dc: torque per current.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    torque_constant: Option<String>,
    /// dc: inertia of the rotor. stepper: inertia of rotor and load.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    inertia: Option<String>,
    /// dc: inertia of the load at the output of the gear.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    load_inertia: Option<String>,
    /// dc: ratio of the gear.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    gear: Option<f64>,
    /// dc: travel per turn, where `counts` are per length.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    travel_per_turn: Option<String>,
    /// stepper: pairs of speed and torque in increasing order.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pull_out: Option<Vec<[String; 2]>>,
    /// stepper: torque of friction.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    friction_torque: Option<String>,
    /// stepper: microsteps in a full step; without it, 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    microsteps: Option<f64>,
    /// stepper: full steps in a turn; without it, 200.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    steps_per_turn: Option<f64>,
    /// rc-servo: its speed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    rate: Option<String>,
    /// rc-servo: error that it does not correct, ticks.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    dead_band: Option<f64>,
    /// rc-servo: its smallest step, ticks.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    resolution: Option<f64>,
    /// rc-servo: time between pulses; without it, 20 ms.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    frame: Option<String>,
    /// Play, ticks; without it, that of the `[[motor]]`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    backlash: Option<f64>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
enum MotorKind {
    Ideal,
    Dc,
    Stepper,
    RcServo,
}

impl MotorKind {
    fn name(self) -> &'static str {
        match self {
            Self::Ideal => "ideal",
            Self::Dc => "dc",
            Self::Stepper => "stepper",
            Self::RcServo => "rc-servo",
        }
    }

    /// The keys of its motors, besides `kind` and `backlash`.
    fn keys(self) -> &'static [&'static str] {
        match self {
            Self::Ideal => &[],
            Self::Dc => &[
                "speed_per_duty",
                "time_constant",
                "stiction",
                "friction",
                "viscous",
                "stall_current",
                "current_limit",
                "supply",
                "resistance",
                "torque_constant",
                "inertia",
                "load_inertia",
                "gear",
                "travel_per_turn",
            ],
            Self::Stepper => &["pull_out", "inertia", "friction_torque", "microsteps", "steps_per_turn"],
            Self::RcServo => &["rate", "dead_band", "resolution", "frame"],
        }
    }
}

/// Pulses of RC servos come every 20 ms.
const SERVO_FRAME_S: f64 = 0.02;
/// Full steps a turn of the usual stepper of 1.8 degrees.
const STEPS_PER_TURN: f64 = 200.0;

fn missing(key: &str, why: &str) -> MachineFileError {
    MachineFileError::Drive(DriveError::new(key, why))
}

fn at(key: &str) -> impl FnOnce(QuantityError) -> MachineFileError {
    let key = key.to_owned();
    move |source| MachineFileError::Quantity { key, source }
}

fn optional<T>(
    text: Option<&String>,
    key: &str,
    read: impl Fn(&str) -> Result<T, QuantityError>,
) -> Result<Option<T>, MachineFileError> {
    text.map(|text| read(text).map_err(at(key))).transpose()
}

fn physical(text: Option<&String>, key: &str, unit: PhysicalUnit) -> Result<Option<f64>, MachineFileError> {
    optional(text, key, |text| unit.value(text))
}

impl DriveTable {
    /// The drive of a machine with these `[[motor]]` tables.
    pub(super) fn drive(
        &self,
        machine: &Machine,
        motors: [&MotorTable; 2],
    ) -> Result<Drive, MachineFileError> {
        let period_s = optional(self.period.as_ref(), "drive.period", quantity::time_s)?
            .unwrap_or(machine.parts().period_s);
        let forward = self.feed_forward.unwrap_or_default();
        let (first, second) = match self.motor.as_slice() {
            [both] => (both, both),
            [first, second] => (first, second),
            other => {
                let reason =
                    format!("one table serves both motors, two are one for each; not {}", other.len());
                return Err(missing("drive.motor", &reason));
            }
        };
        let drive = Drive {
            setpoints: match self.setpoints {
                SetpointsWord::Vertices => SetpointKind::Vertices,
                SetpointsWord::Held => SetpointKind::Held,
                SetpointsWord::Interpolated => SetpointKind::Interpolated,
            },
            reached_within_ticks: self.reached_within.unwrap_or(20.0),
            period_s,
            phase_s: optional(self.phase.as_ref(), "drive.phase", quantity::time_s)?.unwrap_or(0.0),
            feedback: self.feedback(first.kind == MotorKind::Dc || second.kind == MotorKind::Dc)?,
            feed_forward: FeedForward {
                speed: forward.speed,
                acceleration: forward.acceleration,
                friction: forward.friction,
            },
            models: None,
            counts_per_tick: self.counts_per_tick.unwrap_or(1.0),
            motors: [
                first.motor(motors[0], self.arm.is_some())?,
                second.motor(motors[1], self.arm.is_some())?,
            ],
            arm: self.arm.as_ref().map(|arm| arm.inertia(machine)).transpose()?,
        };
        drive.validate().map_err(MachineFileError::Drive)?;
        Ok(drive)
    }

    fn feedback(&self, has_dc: bool) -> Result<Feedback, MachineFileError> {
        if let Some(table) = &self.cascade {
            let gains = [("kp", self.kp), ("ki", self.ki), ("kd", self.kd)];
            if let Some((key, _)) = gains.iter().find(|(_, gain)| gain.is_some()) {
                return Err(missing(&format!("drive.{key}"), "has no effect beside drive.cascade"));
            }
            if self.feed_forward.is_some() {
                return Err(missing("drive.feed_forward", "has no effect beside drive.cascade"));
            }
            return Ok(Feedback::Cascade(CascadeGains {
                position_per_s: table.position,
                speed_kp: table.speed_kp,
                speed_ki: table.speed_ki,
                current_kp: table.current_kp,
                current_ki: table.current_ki,
                speed_window_s: quantity::time_s(&table.speed_window)
                    .map_err(at("drive.cascade.speed_window"))?,
                current_filter_s: optional(
                    table.current_filter.as_ref(),
                    "drive.cascade.current_filter",
                    quantity::time_s,
                )?
                .unwrap_or(0.0),
            }));
        }
        if has_dc && self.kp.is_none() {
            return Err(missing("drive.kp", "is missing: a dc motor needs gains, or drive.cascade"));
        }
        let gains = PidGains {
            kp: self.kp.unwrap_or(0.0),
            ki: self.ki.unwrap_or(0.0),
            kd: self.kd.unwrap_or(0.0),
            kd_filter_s: optional(self.kd_filter.as_ref(), "drive.kd_filter", quantity::time_s)?
                .unwrap_or(0.0),
        };
        let anti_windup = match self.anti_windup {
            None | Some(AntiWindupWord::Switch(true) | AntiWindupWord::Kind(AntiWindupKind::Conditional)) => {
                AntiWindup::Conditional
            }
            Some(AntiWindupWord::Switch(false) | AntiWindupWord::Kind(AntiWindupKind::None)) => {
                AntiWindup::None
            }
            Some(AntiWindupWord::Kind(AntiWindupKind::Clamp)) => AntiWindup::Clamp,
        };
        Ok(Feedback::Pid(gains, anti_windup))
    }
}

impl DriveMotorTable {
    /// The first key that is given and that motors of this kind do not have.
    fn foreign_key(&self) -> Option<&'static str> {
        let given = [
            ("speed_per_duty", self.speed_per_duty.is_some()),
            ("time_constant", self.time_constant.is_some()),
            ("stiction", self.stiction.is_some()),
            ("friction", self.friction.is_some()),
            ("viscous", self.viscous.is_some()),
            ("stall_current", self.stall_current.is_some()),
            ("current_limit", self.current_limit.is_some()),
            ("supply", self.supply.is_some()),
            ("resistance", self.resistance.is_some()),
            ("torque_constant", self.torque_constant.is_some()),
            ("inertia", self.inertia.is_some()),
            ("load_inertia", self.load_inertia.is_some()),
            ("gear", self.gear.is_some()),
            ("travel_per_turn", self.travel_per_turn.is_some()),
            ("pull_out", self.pull_out.is_some()),
            ("friction_torque", self.friction_torque.is_some()),
            ("microsteps", self.microsteps.is_some()),
            ("steps_per_turn", self.steps_per_turn.is_some()),
            ("rate", self.rate.is_some()),
            ("dead_band", self.dead_band.is_some()),
            ("resolution", self.resolution.is_some()),
            ("frame", self.frame.is_some()),
        ];
        given
            .into_iter()
            .find(|(key, is_given)| *is_given && !self.kind.keys().contains(key))
            .map(|(key, _)| key)
    }

    /// The motor of a `[[motor]]` table. Its backlash is that of this table unless the drive has its own, or
    /// the masses of an arm, whose model has none.
    fn motor(&self, table: &MotorTable, has_masses: bool) -> Result<MotorDrive, MachineFileError> {
        if let Some(key) = self.foreign_key() {
            let reason = format!(
                "is no key of kind {}; known there: {}",
                self.kind.name(),
                self.kind.keys().join(", ")
            );
            return Err(missing(&format!("drive.motor.{key}"), &reason));
        }
        let counts =
            quantity::counts(&table.counts).map_err(at(&format!("counts of motor {}", table.name)))?;
        let plant = match self.kind {
            MotorKind::Ideal => MotorPlant::Ideal,
            MotorKind::Dc => MotorPlant::Dc(self.dc(counts)?),
            MotorKind::Stepper => MotorPlant::Stepper(self.stepper(counts)?),
            MotorKind::RcServo => MotorPlant::RcServo(self.rc_servo(counts)?),
        };
        let of_motor = table.backlash.filter(|_| !has_masses);
        Ok(MotorDrive { plant, backlash_ticks: self.backlash.or(of_motor).unwrap_or(0.0) })
    }

    fn dc(&self, counts: (f64, Dimension)) -> Result<DcParameters, MachineFileError> {
        let mut parameters = if self.resistance.is_some() || self.torque_constant.is_some() {
            self.dc_sheet(counts)?
        } else {
            self.dc_first_order(counts)?
        };
        let stiction = self.stiction.or(self.friction).unwrap_or(0.0);
        parameters.stiction_percent = stiction;
        parameters.friction_percent = self.friction.unwrap_or(stiction);
        parameters.viscous_percent = self.viscous.unwrap_or(0.0);
        Ok(parameters)
    }

    fn dc_first_order(&self, counts: (f64, Dimension)) -> Result<DcParameters, MachineFileError> {
        let why = "is missing: a dc motor has speed_per_duty and time_constant, or supply, resistance, torque_constant, inertia and gear";
        let speed = self.speed_per_duty.as_ref().ok_or_else(|| missing("drive.motor.speed_per_duty", why))?;
        let time = self.time_constant.as_ref().ok_or_else(|| missing("drive.motor.time_constant", why))?;
        let mut parameters = DcParameters::first_order(
            quantity::rate_ticks(speed, 1, counts.0, counts.1).map_err(at("drive.motor.speed_per_duty"))?,
            quantity::time_s(time).map_err(at("drive.motor.time_constant"))?,
        );
        let stall =
            physical(self.stall_current.as_ref(), "drive.motor.stall_current", PhysicalUnit::Current)?;
        let limit =
            physical(self.current_limit.as_ref(), "drive.motor.current_limit", PhysicalUnit::Current)?;
        parameters.current_per_duty_a = 0.01 * stall.unwrap_or(0.0);
        if let Some(limit) = limit {
            let Some(stall) = stall else {
                return Err(missing("drive.motor.stall_current", "is missing: current_limit needs it"));
            };
            parameters.current_limit_percent = 100.0 * limit / stall;
        }
        Ok(parameters)
    }

    fn dc_sheet(&self, (counts, dimension): (f64, Dimension)) -> Result<DcParameters, MachineFileError> {
        let why = "is missing: a data sheet has supply, resistance, torque_constant, inertia and gear";
        let needed = |text: &Option<String>, key: &str, unit: PhysicalUnit| {
            let key = format!("drive.motor.{key}");
            let value = physical(text.as_ref(), &key, unit)?.ok_or_else(|| missing(&key, why))?;
            if value > 0.0 { Ok(value) } else { Err(missing(&key, "must be positive")) }
        };
        for (key, given) in [
            ("speed_per_duty", self.speed_per_duty.is_some()),
            ("time_constant", self.time_constant.is_some()),
            ("stall_current", self.stall_current.is_some()),
        ] {
            if given {
                return Err(missing(
                    &format!("drive.motor.{key}"),
                    "follows from the data sheet; leave it out",
                ));
            }
        }
        let ticks_per_rad = match (dimension, &self.travel_per_turn) {
            (Dimension::Angle, None) => counts,
            (Dimension::Angle, Some(_)) => {
                return Err(missing(
                    "drive.motor.travel_per_turn",
                    "belongs to motors with counts per length",
                ));
            }
            (Dimension::Length, Some(travel)) => {
                let travel_mm =
                    quantity::length_mm(travel, false).map_err(at("drive.motor.travel_per_turn"))?;
                counts * travel_mm / std::f64::consts::TAU
            }
            (Dimension::Length, None) => {
                return Err(missing(
                    "drive.motor.travel_per_turn",
                    "is missing: the travel in a turn of the gear's output",
                ));
            }
        };
        let gear = self.gear.unwrap_or(1.0);
        if !(gear > 0.0 && gear.is_finite()) {
            return Err(missing("drive.motor.gear", "must be positive"));
        }
        let sheet = DcSheet {
            supply_v: needed(&self.supply, "supply", PhysicalUnit::Voltage)?,
            resistance_ohm: needed(&self.resistance, "resistance", PhysicalUnit::Resistance)?,
            torque_constant_nm_a: needed(
                &self.torque_constant,
                "torque_constant",
                PhysicalUnit::TorqueConstant,
            )?,
            inertia_kg_m2: needed(&self.inertia, "inertia", PhysicalUnit::Inertia)?,
            load_inertia_kg_m2: physical(
                self.load_inertia.as_ref(),
                "drive.motor.load_inertia",
                PhysicalUnit::Inertia,
            )?
            .unwrap_or(0.0),
            gear,
            current_limit_a: physical(
                self.current_limit.as_ref(),
                "drive.motor.current_limit",
                PhysicalUnit::Current,
            )?
            .unwrap_or(f64::INFINITY),
            ticks_per_rad,
        };
        Ok(sheet.parameters())
    }

    fn stepper(&self, counts: (f64, Dimension)) -> Result<StepperParameters, MachineFileError> {
        let table = self
            .pull_out
            .as_ref()
            .ok_or_else(|| missing("drive.motor.pull_out", "is missing: pairs of speed and torque"))?;
        let pull_out = table.iter().map(|[speed, torque]| {
            let speed =
                quantity::rate_ticks(speed, 1, counts.0, counts.1).map_err(at("drive.motor.pull_out"))?;
            Ok((speed, PhysicalUnit::Torque.value(torque).map_err(at("drive.motor.pull_out"))?))
        });
        let inertia = physical(self.inertia.as_ref(), "drive.motor.inertia", PhysicalUnit::Inertia)?;
        let friction =
            physical(self.friction_torque.as_ref(), "drive.motor.friction_torque", PhysicalUnit::Torque)?;
        Ok(StepperParameters {
            pull_out: pull_out.collect::<Result<_, MachineFileError>>()?,
            inertia_kg_m2: inertia
                .ok_or_else(|| missing("drive.motor.inertia", "is missing: of rotor and load"))?,
            friction_nm: friction.unwrap_or(0.0),
            microsteps: self.microsteps.unwrap_or(1.0),
            steps_per_turn: self.steps_per_turn.unwrap_or(STEPS_PER_TURN),
        })
    }

    fn rc_servo(&self, counts: (f64, Dimension)) -> Result<RcServoParameters, MachineFileError> {
        let rate = self.rate.as_ref().ok_or_else(|| {
            missing("drive.motor.rate", "is missing: the speed of the servo, such as \"300deg/s\"")
        })?;
        Ok(RcServoParameters {
            rate_ticks_s: quantity::rate_ticks(rate, 1, counts.0, counts.1)
                .map_err(at("drive.motor.rate"))?,
            dead_band_ticks: self.dead_band.unwrap_or(0.0),
            resolution_ticks: self.resolution.unwrap_or(0.0),
            frame_s: optional(self.frame.as_ref(), "drive.motor.frame", quantity::time_s)?
                .unwrap_or(SERVO_FRAME_S),
        })
    }
}

impl ArmTable {
    fn inertia(&self, machine: &Machine) -> Result<ArmInertia, MachineFileError> {
        let two_link: Option<&TwoLink> = machine.mechanism().as_two_link();
        let Some(arm) = two_link else {
            return Err(missing("drive.arm", "belongs to machines of kind two-link"));
        };
        let mass = |text: Option<&String>, key: &str| {
            Ok::<_, MachineFileError>(physical(text, key, PhysicalUnit::Mass)?.unwrap_or(0.0))
        };
        let link = |table: &LinkTable, name: &str, length_m: f64| {
            let key = |end: &str| format!("drive.arm.{name}.{end}");
            let mass_kg = mass(Some(&table.mass), &key("mass"))?;
            let center =
                optional(table.center.as_ref(), &key("center"), |text| quantity::length_mm(text, false))?;
            Ok::<_, MachineFileError>(LinkInertia {
                mass_kg,
                center_m: center.map_or(0.5 * length_m, |mm| 1e-3 * mm),
                // Without a value that of a rod.
                inertia_kg_m2: physical(table.inertia.as_ref(), &key("inertia"), PhysicalUnit::Inertia)?
                    .unwrap_or(mass_kg * length_m * length_m / 12.0),
            })
        };
        let lengths_m = [1e-3 * arm.l1_mm, 1e-3 * arm.l2_mm];
        Ok(ArmInertia {
            lengths_m,
            links: [link(&self.link1, "link1", lengths_m[0])?, link(&self.link2, "link2", lengths_m[1])?],
            elbow_mass_kg: mass(self.elbow_mass.as_ref(), "drive.arm.elbow_mass")?,
            pen_mass_kg: mass(self.pen_mass.as_ref(), "drive.arm.pen_mass")?,
        })
    }
}
