//! A whole machine: mechanism, coupling, motors, limits, pen and sheet.

use std::collections::BTreeMap;
use std::sync::Arc;

use drawing::{Point, Rect, Vec2};
use nalgebra::Matrix2;

use crate::reach::CHORD_TOLERANCE;
use crate::{
    Coupling, Fault, Homing, JointKind, JointPos, Mechanism, MotorPos, SingularCoupling, Unreachable,
};

/// The allowed range of one joint, rad or mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointRange {
    /// Smallest allowed value.
    pub min: f64,
    /// Largest allowed value.
    pub max: f64,
}

impl JointRange {
    /// A joint without limits.
    pub const FREE: Self = Self { min: f64::NEG_INFINITY, max: f64::INFINITY };
}

/// One motor with its limits, in ticks: the smallest unit in which it is commanded.
#[derive(Clone, Debug, PartialEq)]
pub struct Motor {
    /// The name; the heading of the motor's column in a plan.
    pub name: String,
    /// Ticks per unit (rad or mm) of this motor's row of `C q`; negative for a motor that counts the
    /// other way.
    pub ticks_per_unit: f64,
    /// Ticks where that row is 0.
    pub offset_ticks: f64,
    /// Largest speed, ticks/s.
    pub max_speed_ticks_s: f64,
    /// Largest acceleration, ticks/s².
    pub max_acceleration_ticks_s2: f64,
    /// Largest jerk, ticks/s³; `None` for a machine without a jerk limit.
    pub max_jerk_ticks_s3: Option<f64>,
    /// Play between the motor and the mechanism, ticks: how far it turns after a reversal before its
    /// load follows. 0 for none.
    pub backlash_ticks: f64,
}

impl Motor {
    /// A motor with offset 0, no jerk limit, no backlash, and these limits in units (rad or mm) of its row of
    /// `C q`: units/s and units/s².
    pub fn new(
        name: impl Into<String>,
        ticks_per_unit: f64,
        max_speed_per_s: f64,
        max_acceleration_per_s2: f64,
    ) -> Self {
        let scale = ticks_per_unit.abs();
        Self {
            name: name.into(),
            ticks_per_unit,
            offset_ticks: 0.0,
            max_speed_ticks_s: scale * max_speed_per_s,
            max_acceleration_ticks_s2: scale * max_acceleration_per_s2,
            max_jerk_ticks_s3: None,
            backlash_ticks: 0.0,
        }
    }
}

/// The limits of the pen and its lift.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PenLimits {
    /// Largest speed of the pen over the paper while it draws, mm/s.
    pub max_speed_mm_s: f64,
    /// Largest speed of the pen while it travels, mm/s; infinite where only the motors limit it.
    pub max_travel_speed_mm_s: f64,
    /// Duration of lifting, s; the motors are at rest.
    pub lift_time_s: f64,
    /// Duration of lowering, s; the motors are at rest.
    pub drop_time_s: f64,
}

impl Default for PenLimits {
    /// 60 mm/s while drawing, no limit while travelling, 150 ms to lift and to lower.
    fn default() -> Self {
        Self {
            max_speed_mm_s: 60.0,
            max_travel_speed_mm_s: f64::INFINITY,
            lift_time_s: 0.15,
            drop_time_s: 0.15,
        }
    }
}

/// The pulses of a servo that lifts the pen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PenServo {
    /// Pulse with the pen up and with the pen down, us.
    pub pulses_us: [f64; 2],
    /// The same as angles, degrees, where the machine file states them so.
    pub angles_deg: Option<[f64; 2]>,
}

impl PenServo {
    /// The shortest and the longest pulse of any servo, us.
    pub const PULSES_US: [f64; 2] = [100.0, 3000.0];

    fn validate(&self) -> Result<(), MachineError> {
        for pulse_us in self.pulses_us {
            let [min, max] = Self::PULSES_US;
            MachineError::require_range("a pulse of the pen's servo", pulse_us, (min, max), "us")?;
        }
        Ok(())
    }
}

/// Unvalidated parameters of a machine. [`MachineParts::new`] sets what a machine file may leave out.
#[derive(Clone, Debug)]
pub struct MachineParts {
    /// Name of the machine.
    pub name: String,
    /// The mechanism.
    pub mechanism: Arc<dyn Mechanism>,
    /// Allowed ranges of the joints.
    pub joints: [JointRange; 2],
    /// No pen-down pose may have a smaller [`Mechanism::manipulability`].
    pub min_manipulability: f64,
    /// The rows of the coupling matrix, one per motor.
    pub coupling: [[f64; 2]; 2],
    /// The motors.
    pub motors: [Motor; 2],
    /// The pen.
    pub pen: PenLimits,
    /// The servo that lifts it, where one is known.
    pub pen_servo: Option<PenServo>,
    /// Where the tips of single pens are, relative to that of the others, machine mm, by pen number.
    pub pen_offsets_mm: BTreeMap<u16, Vec2>,
    /// How it finds its start pose; `None` where that is somebody else's matter.
    pub homing: Option<Homing>,
    /// The sheet, machine mm. Its lower-left corner is the drawing's origin by default.
    pub sheet: Rect,
    /// The pose in which every plan starts; by default plans end there too.
    pub start: JointPos,
    /// Default time between the rows of a plan, s.
    pub period_s: f64,
}

impl MachineParts {
    /// A machine with free joints, motors coupled one to one with the joints, the default pen
    /// ([`PenLimits::default`]), rows every 10 ms, and plans that start over the centre of the sheet
    /// (in the pose 0, 0 where the centre is out of reach).
    pub fn new(
        name: impl Into<String>,
        mechanism: impl Mechanism + 'static,
        motors: [Motor; 2],
        sheet: Rect,
    ) -> Self {
        Self {
            name: name.into(),
            joints: [JointRange::FREE; 2],
            min_manipulability: mechanism.default_min_manipulability(),
            coupling: [[1.0, 0.0], [0.0, 1.0]],
            motors,
            pen: PenLimits::default(),
            pen_servo: None,
            pen_offsets_mm: BTreeMap::new(),
            homing: None,
            sheet,
            start: mechanism.inverse(sheet.center()).unwrap_or_default(),
            period_s: 0.01,
            mechanism: Arc::new(mechanism),
        }
    }
}

/// Invalid machine description.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MachineError {
    /// See [`SingularCoupling`].
    #[error(transparent)]
    Coupling(#[from] SingularCoupling),
    /// A quantity that must be a positive number is not.
    #[error("{quantity} must be a positive number, not {value}")]
    NotPositive {
        /// Which quantity.
        quantity: Quantity,
        /// Its value.
        value: f64,
    },
    /// A quantity is not within its range.
    #[error("{quantity} must be from {min} to {max}{unit}, not {value}", unit = if unit.is_empty() { String::new() } else { format!(" {unit}") })]
    OutOfRange {
        /// Which quantity.
        quantity: Quantity,
        /// Its value.
        value: f64,
        /// The smallest allowed value.
        min: f64,
        /// The largest allowed value.
        max: f64,
        /// The unit of the three; empty for a pure number.
        unit: &'static str,
    },
    /// The smallest allowed manipulability is not from 0 to below 1.
    #[error("min_dexterity must be at least 0 and below 1, not {value}")]
    MinManipulability {
        /// Its value.
        value: f64,
    },
    /// A quantity is infinite or NaN.
    #[error("{quantity} must be finite")]
    NotFinite {
        /// Which quantity.
        quantity: Quantity,
    },
    /// The smallest allowed value of a joint is not below the largest.
    #[error("joint {joint}: min must be below max")]
    EmptyJointRange {
        /// The joint's name.
        joint: &'static str,
    },
    /// The dimensions of the mechanism contradict each other.
    #[error("[geometry]: {why}")]
    Dimensions {
        /// In which way.
        why: &'static str,
    },
    /// The sheet has no area.
    #[error("the sheet must have a positive width and height")]
    EmptySheet,
    /// A motor has no name.
    #[error("a motor has no name")]
    UnnamedMotor,
    /// Both motors have the same name.
    #[error("both motors are named {name}")]
    DuplicateMotorName {
        /// The name.
        name: String,
    },
    /// A joint of the start pose is outside its range.
    #[error("the start pose is not allowed: {fault}")]
    Start {
        /// Which joint, and its range.
        fault: Fault,
    },
}

/// Which quantity of a machine description an error is about.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Quantity {
    /// Its name, as machine files have it.
    pub name: &'static str,
    /// The name of the motor that it belongs to, if it belongs to one.
    pub motor: Option<String>,
}

impl std::fmt::Display for Quantity {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match &self.motor {
            Some(motor) => write!(f, "{} of motor {motor}", self.name),
            None => f.write_str(self.name),
        }
    }
}

impl From<&'static str> for Quantity {
    fn from(name: &'static str) -> Self {
        Self { name, motor: None }
    }
}

impl MachineError {
    /// An error unless the value is a positive finite number.
    pub(crate) fn require_positive(quantity: impl Into<Quantity>, value: f64) -> Result<(), Self> {
        if value > 0.0 && value.is_finite() {
            return Ok(());
        }
        Err(Self::NotPositive { quantity: quantity.into(), value })
    }

    /// An error unless the value is from `min` to `max`.
    fn require_range(
        quantity: &'static str,
        value: f64,
        (min, max): (f64, f64),
        unit: &'static str,
    ) -> Result<(), Self> {
        if (min..=max).contains(&value) {
            return Ok(());
        }
        Err(Self::OutOfRange { quantity: quantity.into(), value, min, max, unit })
    }
}

/// A validated machine: invertible coupling, positive limits, a start pose within the joint limits.
#[derive(Clone, Debug)]
pub struct Machine {
    parts: MachineParts,
    coupling: Coupling,
    /// `diag(ticks_per_unit) C` and its inverse: joints to ticks (less the offset) and back.
    to_ticks: Matrix2<f64>,
    from_ticks: Matrix2<f64>,
    offset: MotorPos,
}

impl Motor {
    fn validate(&self) -> Result<(), MachineError> {
        if self.name.is_empty() {
            return Err(MachineError::UnnamedMotor);
        }
        let of = |name: &'static str| Quantity { name, motor: Some(self.name.clone()) };
        MachineError::require_positive(of("the size of counts"), self.ticks_per_unit.abs())?;
        MachineError::require_positive(of("max_speed"), self.max_speed_ticks_s)?;
        MachineError::require_positive(of("max_acceleration"), self.max_acceleration_ticks_s2)?;
        if let Some(jerk) = self.max_jerk_ticks_s3 {
            MachineError::require_positive(of("max_jerk"), jerk)?;
        }
        if !self.offset_ticks.is_finite() {
            return Err(MachineError::NotFinite { quantity: of("offset") });
        }
        if self.backlash_ticks == 0.0 {
            return Ok(());
        }
        MachineError::require_positive(of("backlash"), self.backlash_ticks)
    }
}

impl PenLimits {
    fn validate(&self) -> Result<(), MachineError> {
        MachineError::require_positive("the pen's max_speed", self.max_speed_mm_s)?;
        let travel = self.max_travel_speed_mm_s;
        if travel.is_nan() || travel <= 0.0 {
            let quantity = "the pen's max_travel_speed".into();
            return Err(MachineError::NotPositive { quantity, value: travel });
        }
        MachineError::require_range("the pen's lift_time", self.lift_time_s, (0.0, 3600.0), "s")?;
        MachineError::require_range("the pen's drop_time", self.drop_time_s, (0.0, 3600.0), "s")
    }
}

impl MachineParts {
    fn validate(&self) -> Result<(), MachineError> {
        self.mechanism.validate()?;
        for motor in &self.motors {
            motor.validate()?;
        }
        if self.motors[0].name == self.motors[1].name {
            return Err(MachineError::DuplicateMotorName { name: self.motors[0].name.clone() });
        }
        self.pen.validate()?;
        if let Some(servo) = &self.pen_servo {
            servo.validate()?;
        }
        for homing in self.homing.iter().flat_map(Homing::moves) {
            homing.validate()?;
        }
        if !self.pen_offsets_mm.values().all(|offset| offset.is_finite()) {
            return Err(MachineError::NotFinite { quantity: "the offset of a pen".into() });
        }
        MachineError::require_range("period", self.period_s, (1e-6, 10.0), "s")?;
        let sheet = self.sheet;
        if !(sheet.is_finite() && sheet.width() > 0.0 && sheet.height() > 0.0) {
            return Err(MachineError::EmptySheet);
        }
        if !(0.0..1.0).contains(&self.min_manipulability) {
            return Err(MachineError::MinManipulability { value: self.min_manipulability });
        }
        for (range, joint) in self.joints.iter().zip(self.mechanism.joint_names()) {
            // NaN is no limit either.
            let ordered = range.min < range.max;
            if !ordered {
                return Err(MachineError::EmptyJointRange { joint });
            }
        }
        if !self.start.is_finite() {
            return Err(MachineError::NotFinite { quantity: "the start pose".into() });
        }
        Ok(())
    }
}

impl Machine {
    /// Validates the parts and assembles the machine.
    ///
    /// # Errors
    /// When the coupling is singular, a limit, length or time is not a positive finite number, or
    /// the start pose is outside the joint limits.
    pub fn new(parts: MachineParts) -> Result<Self, MachineError> {
        parts.validate()?;
        let coupling = Coupling::from_rows(parts.coupling)?;
        let (to_ticks, from_ticks) =
            coupling.scaled(parts.motors.each_ref().map(|motor| motor.ticks_per_unit));
        let offset = MotorPos(parts.motors.each_ref().map(|motor| motor.offset_ticks));
        let machine = Self { parts, coupling, to_ticks, from_ticks, offset };
        match machine.joint_fault(&machine.parts.start) {
            Some(fault) => Err(MachineError::Start { fault }),
            None => Ok(machine),
        }
    }

    /// The same machine with a sheet of this size, mm, whose lower-left corner takes the place of
    /// that of the present one.
    ///
    /// # Errors
    /// [`MachineError::EmptySheet`] and the like for a size that is not positive and finite.
    pub fn with_sheet_size(&self, width_mm: f64, height_mm: f64) -> Result<Self, MachineError> {
        let corner = Point::new(self.parts.sheet.x0, self.parts.sheet.y0);
        let sheet = Rect::from_origin_size(corner, (width_mm, height_mm));
        Self::new(MachineParts { sheet, ..self.parts.clone() })
    }

    /// The parts that it is made of.
    pub fn parts(&self) -> &MachineParts {
        &self.parts
    }

    /// Name of the machine.
    pub fn name(&self) -> &str {
        &self.parts.name
    }

    /// Its mechanism.
    #[inline]
    pub fn mechanism(&self) -> &dyn Mechanism {
        &*self.parts.mechanism
    }

    /// Its coupling.
    pub fn coupling(&self) -> &Coupling {
        &self.coupling
    }

    /// Its motors.
    #[inline]
    pub fn motors(&self) -> &[Motor; 2] {
        &self.parts.motors
    }

    /// The limits of its pen.
    #[inline]
    pub fn pen(&self) -> &PenLimits {
        &self.parts.pen
    }

    /// Whether a motor has backlash.
    pub fn has_backlash(&self) -> bool {
        self.parts.motors.iter().any(|motor| motor.backlash_ticks > 0.0)
    }

    /// Where the tip of a pen is, relative to the place that [`Mechanism::forward`] gives, machine mm.
    pub fn pen_offset_mm(&self, pen: u16) -> Vec2 {
        self.parts.pen_offsets_mm.get(&pen).copied().unwrap_or(Vec2::ZERO)
    }

    /// The sheet, machine mm.
    pub fn sheet(&self) -> Rect {
        self.parts.sheet
    }

    /// The pose in which plans start.
    pub fn start(&self) -> JointPos {
        self.parts.start
    }

    /// Exact motor positions at a pose, ticks: not rounded.
    pub fn motor_positions(&self, q: &JointPos) -> MotorPos {
        self.motor_rates(q) + self.offset
    }

    /// The pose at these motor positions.
    pub fn joint_positions(&self, motors: &MotorPos) -> JointPos {
        self.joint_rates(&(*motors - self.offset))
    }

    /// Joint velocities (or accelerations, ...) as those of the motors: ticks/s from rad/s and mm/s.
    #[inline]
    pub fn motor_rates(&self, joint_rates: &JointPos) -> MotorPos {
        MotorPos(product(&self.to_ticks, joint_rates.0))
    }

    /// Motor velocities (or accelerations, ...) as those of the joints.
    pub fn joint_rates(&self, motor_rates: &MotorPos) -> JointPos {
        JointPos(product(&self.from_ticks, motor_rates.0))
    }

    /// The position of the pen at these motor positions, mm.
    pub fn forward_from_motors(&self, motors: &MotorPos) -> Point {
        self.parts.mechanism.forward(&self.joint_positions(motors))
    }

    /// The pose for the point `p`, unwrapped: of all full rotations about the base the one nearest to
    /// `near`. Joint limits are not checked.
    ///
    /// # Errors
    /// When no pose reaches the point.
    pub fn pose_near(&self, p: Point, near: &JointPos) -> Result<JointPos, Unreachable> {
        if self.parts.mechanism.pole() == Some(p) {
            // Every direction will do.
            return Ok(JointPos::new(near[0], 0.0));
        }
        let q = self.parts.mechanism.inverse(p)?;
        Ok(match self.parts.mechanism.full_rotation() {
            Some(rotation) => q + rotation * ((near[0] - q[0]) / rotation[0]).round(),
            None => q,
        })
    }

    /// The poses for the point `p` within the joint limits, up to two full rotations either way from
    /// the one nearest to `near`, which comes first.
    ///
    /// # Errors
    /// When there is none.
    pub fn poses(&self, p: Point, near: &JointPos) -> Result<Vec<JointPos>, Fault> {
        let nearest = self.pose_near(p, near)?;
        let mut allowed = Vec::new();
        let mut fault = None;
        let turns: &[f64] = if self.parts.mechanism.full_rotation().is_some() {
            &[0.0, -1.0, 1.0, -2.0, 2.0]
        } else {
            &[0.0]
        };
        for extra in turns {
            let candidate = nearest + self.parts.mechanism.full_rotation().unwrap_or_default() * *extra;
            match self.joint_fault(&candidate) {
                None => allowed.push(candidate),
                Some(found) => fault = fault.or(Some(found)),
            }
        }
        match (allowed.is_empty(), fault) {
            (true, Some(fault)) => Err(fault),
            _ => Ok(allowed),
        }
    }

    /// First and second derivatives of the motor positions (ticks) along a path on which the pen, at
    /// pose `q`, has the derivatives `first` and `second`.
    pub fn motor_derivatives(&self, q: &JointPos, first: Vec2, second: Vec2) -> (MotorPos, MotorPos) {
        let (q_1, q_2) = self.parts.mechanism.path_derivatives(q, first, second);
        (self.motor_rates(&q_1), self.motor_rates(&q_2))
    }

    /// Third derivative of the motor positions (ticks) along such a path, on which the pen also has the
    /// derivative `third`.
    pub fn motor_third_derivative(&self, q: &JointPos, first: Vec2, second: Vec2, third: Vec2) -> MotorPos {
        self.motor_rates(&self.parts.mechanism.path_third_derivative(q, first, second, third))
    }

    /// The largest error of the pen's position from rounding motor positions to whole ticks, mm: over
    /// half a tick either way on both motors.
    pub fn quantization_error(&self, q: &JointPos) -> f64 {
        let exact = self.parts.mechanism.forward(q);
        [(0.5, 0.5), (0.5, -0.5), (-0.5, 0.5), (-0.5, -0.5)]
            .into_iter()
            .map(|(a, b)| {
                let moved = self.parts.mechanism.forward(&(*q + self.joint_rates(&MotorPos::new(a, b))));
                libm::hypot(moved.x - exact.x, moved.y - exact.y)
            })
            .fold(0.0, f64::max)
    }

    /// The joint of `q` that is outside its range, if there is one. 1e-9 are allowed for rounding.
    pub fn joint_fault(&self, q: &JointPos) -> Option<Fault> {
        self.joint_fault_beyond(q, [1e-9, 1e-9])
    }

    /// The same for points between those that [`Self::check_segment`] checked. It takes curves as
    /// chords, so a joint may exceed its range by the chord error, as an angle seen from 10 mm.
    pub fn joint_fault_between(&self, q: &JointPos) -> Option<Fault> {
        let slack = |kind| match kind {
            JointKind::Revolute => CHORD_TOLERANCE / 10.0,
            JointKind::Prismatic => CHORD_TOLERANCE,
        };
        self.joint_fault_beyond(q, self.parts.mechanism.joint_kinds().map(slack))
    }

    fn joint_fault_beyond(&self, q: &JointPos, slack: [f64; 2]) -> Option<Fault> {
        let names = self.parts.mechanism.joint_names();
        (0..2).find_map(|index| {
            let (joint, value) = (self.parts.joints[index], q[index]);
            let allowed = value >= joint.min - slack[index] && value <= joint.max + slack[index];
            (!allowed).then(|| Fault::JointLimit {
                joint: names[index],
                kind: self.parts.mechanism.joint_kinds()[index],
                value,
                min: joint.min,
                max: joint.max,
            })
        })
    }
}

/// `M v`.
#[inline]
fn product(m: &Matrix2<f64>, [a, b]: [f64; 2]) -> [f64; 2] {
    [m.m11 * a + m.m12 * b, m.m21 * a + m.m22 * b]
}
