//! A drive: motors, their load, controller and setpoints, as a machine file describes them.

use kinematics::Machine;

use crate::controller::{
    AntiWindup, Cascade, CascadeGains, Controller, Direct, FeedForward, MotorModel, Pid, PidGains,
};
use crate::plant::{
    Arm, ArmInertia, ArmMotor, Backlash, DcMotor, DcParameters, Ideal, Independent, Motor, Plant, RcServo,
    RcServoParameters, STEP_S, Stepper, StepperParameters,
};
use crate::setpoint::SetpointKind;

/// One motor's plant.
#[derive(Clone, Debug, PartialEq)]
pub enum MotorPlant {
    /// Without error.
    Ideal,
    /// A DC motor under a feedback loop.
    Dc(DcParameters),
    /// A stepper motor.
    Stepper(StepperParameters),
    /// An RC servo.
    RcServo(RcServoParameters),
}

/// One motor of a drive.
#[derive(Clone, Debug, PartialEq)]
pub struct MotorDrive {
    /// The plant.
    pub plant: MotorPlant,
    /// Play between motor and load, ticks.
    pub backlash_ticks: f64,
}

/// The feedback law of DC motors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Feedback {
    /// PID with feed-forward.
    Pid(PidGains, AntiWindup),
    /// Cascade of position, speed and current.
    Cascade(CascadeGains),
}

/// A drive with its controller. Both motors share loop period, gains and setpoints.
#[derive(Clone, Debug, PartialEq)]
pub struct Drive {
    /// How a plan becomes setpoints.
    pub setpoints: SetpointKind,
    /// With [`SetpointKind::Vertices`]: a vertex is reached within this many ticks.
    pub reached_within_ticks: f64,
    /// Period of the feedback loop, s.
    pub period_s: f64,
    /// Time of the first call of the loop after the plan's start, s.
    pub phase_s: f64,
    /// The feedback law.
    pub feedback: Feedback,
    /// Shares of the model that are fed forward.
    pub feed_forward: FeedForward,
    /// The controller's model of the motors; `None`: the motors as they are.
    pub models: Option<[MotorModel; 2]>,
    /// Encoder counts per tick.
    pub counts_per_tick: f64,
    /// The motors.
    pub motors: [MotorDrive; 2],
    /// The masses of a two-link arm; `None`: each motor has its own constant inertia.
    pub arm: Option<ArmInertia>,
}

/// A value of a drive that cannot be.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{key}: {reason}")]
pub struct DriveError {
    /// The key of the machine file.
    pub key: String,
    /// What is wrong with its value.
    pub reason: String,
}

impl DriveError {
    /// An error about this key.
    pub fn new(key: impl Into<String>, reason: impl Into<String>) -> Self {
        Self { key: key.into(), reason: reason.into() }
    }
}

/// Longest period of a loop and longest time constant, s.
const LONGEST_S: f64 = 10.0;

impl Drive {
    /// Two motors of the same plant under a P controller, interpolated setpoints, no feed-forward.
    pub fn proportional(plant: MotorPlant, kp: f64, period_s: f64) -> Self {
        let motor = MotorDrive { plant, backlash_ticks: 0.0 };
        Self {
            setpoints: SetpointKind::Interpolated,
            reached_within_ticks: 20.0,
            period_s,
            phase_s: 0.0,
            feedback: Feedback::Pid(PidGains { kp, ..PidGains::default() }, AntiWindup::default()),
            feed_forward: FeedForward::default(),
            models: None,
            counts_per_tick: 1.0,
            motors: [motor.clone(), motor],
            arm: None,
        }
    }

    /// Checks all values.
    ///
    /// # Errors
    /// Names the key of the first value that is not possible.
    pub fn validate(&self) -> Result<(), DriveError> {
        within("drive.period", self.period_s, STEP_S, LONGEST_S, "s")?;
        within("drive.phase", self.phase_s, 0.0, LONGEST_S, "s")?;
        within("drive.reached_within", self.reached_within_ticks, 0.0, 1e9, "ticks")?;
        positive("drive.counts_per_tick", self.counts_per_tick)?;
        for (key, share) in [
            ("drive.feed_forward.speed", self.feed_forward.speed),
            ("drive.feed_forward.acceleration", self.feed_forward.acceleration),
            ("drive.feed_forward.friction", self.feed_forward.friction),
        ] {
            within(key, share, 0.0, 1.0, "")?;
        }
        match &self.feedback {
            Feedback::Pid(gains, _) => {
                for (key, gain) in [("drive.kp", gains.kp), ("drive.ki", gains.ki), ("drive.kd", gains.kd)] {
                    within(key, gain, 0.0, 1e6, "")?;
                }
                within("drive.kd_filter", gains.kd_filter_s, 0.0, LONGEST_S, "s")?;
            }
            Feedback::Cascade(gains) => {
                for (key, gain) in [
                    ("drive.cascade.position", gains.position_per_s),
                    ("drive.cascade.speed_kp", gains.speed_kp),
                    ("drive.cascade.speed_ki", gains.speed_ki),
                    ("drive.cascade.current_kp", gains.current_kp),
                    ("drive.cascade.current_ki", gains.current_ki),
                ] {
                    within(key, gain, 0.0, 1e9, "")?;
                }
                within("drive.cascade.speed_window", gains.speed_window_s, 0.0, LONGEST_S, "s")?;
                within("drive.cascade.current_filter", gains.current_filter_s, 0.0, LONGEST_S, "s")?;
            }
        }
        for motor in &self.motors {
            motor.validate(&self.feedback)?;
        }
        if let Some(arm) = &self.arm {
            self.validate_arm(arm)?;
        }
        Ok(())
    }

    fn validate_arm(&self, arm: &ArmInertia) -> Result<(), DriveError> {
        let [a, b, c] = arm.constants();
        // Also positive definite without the motors' own inertia.
        if !(a > 0.0 && c > 0.0 && a * c > b * b && (a * c).is_finite()) {
            return Err(DriveError::new(
                "drive.arm",
                "masses, centres and inertias do not give a positive mass matrix",
            ));
        }
        let known = |motor: &MotorDrive| match &motor.plant {
            MotorPlant::Dc(p) => p.torque_per_duty_nm > 0.0 && motor.backlash_ticks == 0.0,
            _ => false,
        };
        if self.motors.iter().all(known) {
            return Ok(());
        }
        Err(DriveError::new(
            "drive.arm",
            "masses need DC motors by their data sheet (supply, resistance, torque_constant, gear) without backlash",
        ))
    }

    /// Whether any motor follows positions without a feedback loop and at every step.
    pub(crate) fn has_fine_motor(&self) -> bool {
        self.motors.iter().any(|motor| matches!(motor.plant, MotorPlant::Ideal | MotorPlant::Stepper(_)))
    }

    /// The controllers.
    pub(crate) fn controllers(&self) -> [Box<dyn Controller>; 2] {
        [0, 1].map(|index: usize| -> Box<dyn Controller> {
            let MotorPlant::Dc(parameters) = &self.motors[index].plant else { return Box::new(Direct) };
            match self.feedback {
                Feedback::Pid(gains, anti_windup) => {
                    let model = self.models.map_or_else(|| parameters.into(), |models| models[index]);
                    Box::new(Pid::new(gains, anti_windup, self.feed_forward, model, self.period_s))
                }
                Feedback::Cascade(gains) => Box::new(Cascade::new(gains, self.period_s)),
            }
        })
    }

    /// The plant at rest at these positions of the motors, ticks.
    pub(crate) fn plant(&self, machine: &Machine, ticks: [f64; 2]) -> Box<dyn Plant> {
        if let (Some(inertia), [MotorPlant::Dc(first), MotorPlant::Dc(second)]) =
            (&self.arm, [&self.motors[0].plant, &self.motors[1].plant])
        {
            let rows = machine.coupling().rows();
            let motor = |index: usize, parameters: DcParameters| ArmMotor {
                parameters,
                ticks_per_rad: machine.motors()[index].ticks_per_unit,
                offset_ticks: machine.motors()[index].offset_ticks,
                row: rows[index],
            };
            if let Some(arm) = Arm::new(inertia, [motor(0, *first), motor(1, *second)], ticks) {
                return Box::new(arm);
            }
        }
        Box::new(Independent([0, 1].map(|index: usize| self.motors[index].at(ticks[index]))))
    }
}

impl MotorDrive {
    /// The motor at rest at this position, ticks.
    pub fn at(&self, ticks: f64) -> Box<dyn Motor> {
        let motor: Box<dyn Motor> = match &self.plant {
            MotorPlant::Ideal => Box::new(Ideal::new(ticks)),
            MotorPlant::Dc(parameters) => Box::new(DcMotor::new(*parameters, ticks)),
            MotorPlant::Stepper(parameters) => Box::new(Stepper::new(parameters.clone(), ticks)),
            MotorPlant::RcServo(parameters) => Box::new(RcServo::new(*parameters, ticks)),
        };
        if self.backlash_ticks > 0.0 { Box::new(Backlash::new(motor, self.backlash_ticks)) } else { motor }
    }

    fn validate(&self, feedback: &Feedback) -> Result<(), DriveError> {
        within("drive.motor.backlash", self.backlash_ticks, 0.0, 1e9, "ticks")?;
        match &self.plant {
            MotorPlant::Ideal => Ok(()),
            MotorPlant::Dc(p) => {
                positive("drive.motor.speed_per_duty", p.speed_per_duty_ticks_s)?;
                within("drive.motor.time_constant", p.time_constant_s, STEP_S, LONGEST_S, "s")?;
                within("drive.motor.stiction", p.stiction_percent, 0.0, 100.0, "% of duty")?;
                within("drive.motor.friction", p.friction_percent, 0.0, 100.0, "% of duty")?;
                within("drive.motor.viscous", p.viscous_percent, 0.0, 1e4, "% of duty")?;
                if p.friction_percent > p.stiction_percent {
                    let reason = format!(
                        "must not exceed the stiction of {} %, not be {} %",
                        p.stiction_percent, p.friction_percent
                    );
                    return Err(DriveError::new("drive.motor.friction", reason));
                }
                if p.current_limit_percent.is_nan() || p.current_limit_percent <= 0.0 {
                    return Err(DriveError::new("drive.motor.current_limit", "must be positive"));
                }
                if matches!(feedback, Feedback::Cascade(_)) && p.current_per_duty_a <= 0.0 {
                    return Err(DriveError::new(
                        "drive.motor.resistance",
                        "a cascade measures the current: give supply and resistance of the motor",
                    ));
                }
                Ok(())
            }
            MotorPlant::Stepper(p) => {
                positive("drive.motor.inertia", p.inertia_kg_m2)?;
                positive("drive.motor.microsteps", p.microsteps)?;
                positive("drive.motor.steps_per_turn", p.steps_per_turn)?;
                within("drive.motor.friction_torque", p.friction_nm, 0.0, 1e3, "N m")?;
                let rising = p.pull_out.windows(2).all(|pair| pair[0].0 < pair[1].0);
                let possible = p.pull_out.iter().all(|(speed, torque)| {
                    *speed >= 0.0 && *torque >= 0.0 && speed.is_finite() && torque.is_finite()
                });
                if p.pull_out.first().is_none_or(|(_, torque)| *torque <= 0.0) || !rising || !possible {
                    return Err(DriveError::new(
                        "drive.motor.pull_out",
                        "must be pairs of speed and torque in increasing order of speed, the first torque positive",
                    ));
                }
                Ok(())
            }
            MotorPlant::RcServo(p) => {
                positive("drive.motor.rate", p.rate_ticks_s)?;
                within("drive.motor.dead_band", p.dead_band_ticks, 0.0, 1e9, "ticks")?;
                within("drive.motor.resolution", p.resolution_ticks, 0.0, 1e9, "ticks")?;
                within("drive.motor.frame", p.frame_s, 0.0, LONGEST_S, "s")
            }
        }
    }
}

fn positive(key: &str, value: f64) -> Result<(), DriveError> {
    if value > 0.0 && value.is_finite() {
        return Ok(());
    }
    Err(DriveError::new(key, format!("must be a positive number, not {value}")))
}

fn within(key: &str, value: f64, min: f64, max: f64, unit: &str) -> Result<(), DriveError> {
    if (min..=max).contains(&value) {
        return Ok(());
    }
    let unit = if unit.is_empty() { String::new() } else { format!(" {unit}") };
    Err(DriveError::new(key, format!("must be from {min} to {max}{unit}, not {value}")))
}
