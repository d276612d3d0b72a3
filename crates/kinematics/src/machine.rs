//! A whole machine: geometry, coupling, motors, limits, pen and sheet.

use drawing::{Point, Rect, Vec2};
use nalgebra::Matrix2;

use crate::{
    Coupling, Fault, Geometry, JointPos, MotorPos, SingularCoupling, Unreachable, reach::CHORD_TOLERANCE,
};

/// The allowed range of one joint, rad or mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Joint {
    /// Smallest allowed value.
    pub min: f64,
    /// Largest allowed value.
    pub max: f64,
}

impl Joint {
    /// A joint that may go anywhere.
    pub const FREE: Self = Self { min: f64::NEG_INFINITY, max: f64::INFINITY };
}

/// One motor with its limits, in ticks: the smallest unit in which it is commanded.
#[derive(Clone, Debug, PartialEq)]
pub struct Motor {
    /// Heads the motor's column in a plan.
    pub name: String,
    /// Ticks per unit (rad or mm) of this motor's row of `C q`; negative for a motor that counts the other way.
    pub ticks_per_unit: f64,
    /// Ticks where that row is 0.
    pub offset_ticks: f64,
    /// Largest speed, ticks/s.
    pub max_speed_ticks_s: f64,
    /// Largest acceleration, ticks/s².
    pub max_acceleration_ticks_s2: f64,
    /// Largest jerk, ticks/s³, where the machine states one.
    pub max_jerk_ticks_s3: Option<f64>,
}

/// What the pen itself allows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PenLimits {
    /// Largest speed of the pen over the paper while it draws, mm/s.
    pub max_speed_mm_s: f64,
    /// Largest speed of the pen while it travels, mm/s; infinite where only the motors limit it.
    pub max_travel_speed_mm_s: f64,
    /// How long lifting takes, s: the motors stand still.
    pub lift_time_s: f64,
    /// How long lowering takes, s: the motors stand still.
    pub drop_time_s: f64,
}

/// What a machine is made of, before it was checked.
#[derive(Clone, Debug, PartialEq)]
pub struct MachineParts {
    /// Name of the machine.
    pub name: String,
    /// Its shape.
    pub geometry: Geometry,
    /// Allowed ranges of the joints.
    pub joints: [Joint; 2],
    /// No pen-down pose may have a smaller [`Geometry::manipulability`].
    pub min_manipulability: f64,
    /// Rows of the coupling matrix, one a motor.
    pub coupling: [[f64; 2]; 2],
    /// The motors.
    pub motors: [Motor; 2],
    /// The pen.
    pub pen: PenLimits,
    /// The sheet in machine mm; its lower-left corner is the drawing's (0, 0) unless told otherwise.
    pub sheet: Rect,
    /// The pose in which every plan starts, and ends unless told otherwise.
    pub start: JointPos,
    /// Time between the rows of a plan, s, unless told otherwise.
    pub period_s: f64,
}

/// Why a machine cannot be.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MachineError {
    /// See [`SingularCoupling`].
    #[error(transparent)]
    Coupling(#[from] SingularCoupling),
    /// A quantity that must be a positive number is not.
    #[error("{what} must be a positive number, not {value}")]
    NotPositive {
        /// What the quantity is.
        what: String,
        /// What it was.
        value: f64,
    },
    /// A quantity is not a finite number, or a range is turned inside out.
    #[error("{what}")]
    Invalid {
        /// What is wrong with what.
        what: String,
    },
    /// A joint of the start pose is outside its own range.
    #[error("the start pose is not allowed: {fault}")]
    Start {
        /// Why.
        fault: Fault,
    },
}

/// A machine that holds together: invertible coupling, positive limits, a start pose inside its joint limits.
#[derive(Clone, Debug, PartialEq)]
pub struct Machine {
    parts: MachineParts,
    coupling: Coupling,
    /// `diag(ticks_per_unit) C` and its inverse: joints to ticks (less the offset) and back.
    to_ticks: Matrix2<f64>,
    from_ticks: Matrix2<f64>,
    offset: MotorPos,
}

impl Machine {
    /// Checks the parts and puts them together.
    ///
    /// # Errors
    /// When the coupling is singular, or a limit, length or time is not a positive finite number, or the start pose
    /// is outside the joint limits.
    pub fn new(parts: MachineParts) -> Result<Self, MachineError> {
        let positive = |what: &str, value: f64| {
            (value > 0.0 && value.is_finite())
                .then_some(())
                .ok_or_else(|| MachineError::NotPositive { what: what.into(), value })
        };
        let require = |holds: bool, what: &str| {
            holds.then_some(()).ok_or_else(|| MachineError::Invalid { what: what.into() })
        };
        if let Geometry::TwoLink(arm) = parts.geometry {
            positive("l1", arm.l1)?;
            positive("l2", arm.l2)?;
        }
        for motor in &parts.motors {
            let of = |what: &str| format!("{what} of motor {}", motor.name);
            require(!motor.name.is_empty(), "a motor has no name")?;
            positive(&of("the size of counts"), motor.ticks_per_unit.abs())?;
            positive(&of("max_speed"), motor.max_speed_ticks_s)?;
            positive(&of("max_acceleration"), motor.max_acceleration_ticks_s2)?;
            if let Some(jerk) = motor.max_jerk_ticks_s3 {
                positive(&of("max_jerk"), jerk)?;
            }
            require(motor.offset_ticks.is_finite(), &of("offset must be finite"))?;
        }
        require(parts.motors[0].name != parts.motors[1].name, "both motors have the same name")?;
        positive("the pen's max_speed", parts.pen.max_speed_mm_s)?;
        let travel = parts.pen.max_travel_speed_mm_s;
        require(travel > 0.0, "the pen's max_travel_speed must be a positive number")?;
        for (what, time) in [("lift_time", parts.pen.lift_time_s), ("drop_time", parts.pen.drop_time_s)] {
            require(
                (0.0..=3600.0).contains(&time),
                &format!("the pen's {what} must be between 0 and 3600 s"),
            )?;
        }
        positive("period", parts.period_s)?;
        require((1e-6..=10.0).contains(&parts.period_s), "period must be between 1 us and 10 s")?;
        require(
            parts.sheet.is_finite() && parts.sheet.width() > 0.0 && parts.sheet.height() > 0.0,
            "the sheet must have a positive width and height",
        )?;
        require(
            (0.0..1.0).contains(&parts.min_manipulability),
            "the smallest dexterity must be from 0 to below 1",
        )?;
        for (joint, name) in parts.joints.iter().zip(parts.geometry.joint_names()) {
            require(joint.min < joint.max, &format!("joint {name}: min must be below max"))?;
        }
        let coupling = Coupling::from_rows(parts.coupling)?;
        let (to_ticks, from_ticks) =
            coupling.scaled(parts.motors.each_ref().map(|motor| motor.ticks_per_unit));
        let offset = MotorPos(parts.motors.each_ref().map(|motor| motor.offset_ticks));
        require(parts.start.is_finite(), "the start pose must be finite")?;
        let machine = Self { parts, coupling, to_ticks, from_ticks, offset };
        match machine.joint_fault(&machine.parts.start) {
            Some(fault) => Err(MachineError::Start { fault }),
            None => Ok(machine),
        }
    }

    /// What it was made of.
    pub fn parts(&self) -> &MachineParts {
        &self.parts
    }

    /// Name of the machine.
    pub fn name(&self) -> &str {
        &self.parts.name
    }

    /// Its shape.
    pub fn geometry(&self) -> &Geometry {
        &self.parts.geometry
    }

    /// Its coupling.
    pub fn coupling(&self) -> &Coupling {
        &self.coupling
    }

    /// Its motors.
    pub fn motors(&self) -> &[Motor; 2] {
        &self.parts.motors
    }

    /// What its pen allows.
    pub fn pen(&self) -> &PenLimits {
        &self.parts.pen
    }

    /// The sheet, machine mm.
    pub fn sheet(&self) -> Rect {
        self.parts.sheet
    }

    /// The pose in which plans start.
    pub fn start(&self) -> JointPos {
        self.parts.start
    }

    /// Exact motor positions at a pose, in ticks that need not be whole.
    pub fn motor_positions(&self, q: &JointPos) -> MotorPos {
        self.motor_rates(q) + self.offset
    }

    /// The pose at which the motors are where they are.
    pub fn joint_positions(&self, motors: &MotorPos) -> JointPos {
        self.joint_rates(&(*motors - self.offset))
    }

    /// Joint speeds (or accelerations) as motor speeds, ticks/s for rad/s and mm/s.
    pub fn motor_rates(&self, joint_rates: &JointPos) -> MotorPos {
        MotorPos(product(&self.to_ticks, joint_rates.0))
    }

    /// Motor speeds as joint speeds.
    pub fn joint_rates(&self, motor_rates: &MotorPos) -> JointPos {
        JointPos(product(&self.from_ticks, motor_rates.0))
    }

    /// Where the pen is when the motors are at `motors`, mm.
    pub fn forward_from_motors(&self, motors: &MotorPos) -> Point {
        self.parts.geometry.forward(&self.joint_positions(motors))
    }

    /// The pose for the point `p`, unwrapped: of all whole turns about the base the one nearest to `near`. Joint limits
    /// are not looked at.
    ///
    /// # Errors
    /// When no pose reaches the point.
    pub fn pose_near(&self, p: Point, near: &JointPos) -> Result<JointPos, Unreachable> {
        let q = self.parts.geometry.inverse(p)?;
        Ok(match self.parts.geometry.full_rotation() {
            // The first joint is one that turns.
            Some(rotation) => q + rotation * ((near[0] - q[0]) / rotation[0]).round(),
            None => q,
        })
    }

    /// The poses for the point `p` that the joint limits allow, the one nearest to `near` first.
    ///
    /// # Errors
    /// When there is none.
    pub fn poses(&self, p: Point, near: &JointPos) -> Result<Vec<JointPos>, Fault> {
        let nearest = self.pose_near(p, near)?;
        let mut allowed = Vec::new();
        let mut fault = None;
        let turns: &[f64] =
            if self.parts.geometry.full_rotation().is_some() { &[0.0, -1.0, 1.0, -2.0, 2.0] } else { &[0.0] };
        for extra in turns {
            let candidate = nearest + self.parts.geometry.full_rotation().unwrap_or_default() * *extra;
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

    /// First and second derivative of the motors' positions (ticks) along a path on which the pen, at pose `q`, has
    /// the derivatives `first` and `second`.
    pub fn motor_derivatives(&self, q: &JointPos, first: Vec2, second: Vec2) -> (MotorPos, MotorPos) {
        let (q_1, q_2) = self.parts.geometry.path_derivatives(q, first, second);
        (self.motor_rates(&q_1), self.motor_rates(&q_2))
    }

    /// Third derivative of the motors' positions (ticks) along such a path, on which the pen also has the derivative `third`.
    pub fn motor_third_derivative(&self, q: &JointPos, first: Vec2, second: Vec2, third: Vec2) -> MotorPos {
        self.motor_rates(&self.parts.geometry.path_third_derivative(q, first, second, third))
    }

    /// How far the pen can be from where it should be because motors only take whole ticks: the largest displacement
    /// over half a tick more or less on both motors, mm.
    pub fn quantization_error(&self, q: &JointPos) -> f64 {
        let exact = self.parts.geometry.forward(q);
        [(0.5, 0.5), (0.5, -0.5), (-0.5, 0.5), (-0.5, -0.5)]
            .into_iter()
            .map(|(a, b)| {
                let moved = self.parts.geometry.forward(&(*q + self.joint_rates(&MotorPos::new(a, b))));
                libm::hypot(moved.x - exact.x, moved.y - exact.y)
            })
            .fold(0.0, f64::max)
    }

    /// The joint of `q` that is outside its range, if one is. A rounding error of 1e-9 is forgiven.
    pub fn joint_fault(&self, q: &JointPos) -> Option<Fault> {
        self.joint_fault_beyond(q, [1e-9, 1e-9])
    }

    /// The same for points between those that [`Self::check_segment`] looked at: curves are checked as chords, so a joint
    /// may exceed its range there by what a curve leaves its chord by, seen from no nearer than 10 mm.
    pub fn joint_fault_between(&self, q: &JointPos) -> Option<Fault> {
        let angles = self.parts.geometry.joint_is_angle();
        self.joint_fault_beyond(
            q,
            angles.map(|angle| if angle { CHORD_TOLERANCE / 10.0 } else { CHORD_TOLERANCE }),
        )
    }

    fn joint_fault_beyond(&self, q: &JointPos, slack: [f64; 2]) -> Option<Fault> {
        let names = self.parts.geometry.joint_names();
        (0..2).find_map(|index| {
            let (joint, value) = (self.parts.joints[index], q[index]);
            let allowed = value >= joint.min - slack[index] && value <= joint.max + slack[index];
            (!allowed).then(|| Fault::JointLimit {
                joint: names[index],
                angle: self.parts.geometry.joint_is_angle()[index],
                value,
                min: joint.min,
                max: joint.max,
            })
        })
    }
}

/// `M v`.
fn product(m: &Matrix2<f64>, [a, b]: [f64; 2]) -> [f64; 2] {
    [m.m11 * a + m.m12 * b, m.m21 * a + m.m22 * b]
}
