//! A machine as calibration sees it: everything that decides where the pen is at given ticks.

use std::collections::BTreeMap;
use std::sync::Arc;

use drawing::{Point, Vec2};
use kinematics::mechanism::{KINDS, Kind, ParameterError, Parameters};
use kinematics::{JointKind, JointPos, Mechanism};
use nalgebra::{Matrix2, Vector2};

use crate::fit::Touch;

/// A parameter of a mechanism, as machine files name it.
#[derive(Clone, Debug, PartialEq)]
pub enum Parameter {
    /// A length, mm.
    Length(f64),
    /// A point, machine mm.
    Point(Point),
    /// One of a few words.
    Choice(String),
}

/// What decides where the pen is on the sheet at given ticks.
#[derive(Clone, Debug, PartialEq)]
pub struct Setup {
    /// The kind of mechanism.
    pub kind: Kind,
    /// Its parameters by their names.
    pub geometry: BTreeMap<String, Parameter>,
    /// The rows of the coupling matrix.
    pub coupling: [[f64; 2]; 2],
    /// Ticks per unit (rad or mm) of each row.
    pub ticks_per_unit: [f64; 2],
    /// Ticks where a row is 0.
    pub offset_ticks: [f64; 2],
    /// Backlash of each motor, ticks.
    pub backlash_ticks: [f64; 2],
    /// The lower-left corner of the sheet, machine mm.
    pub corner: Point,
    /// Width and height of the sheet, mm.
    pub sheet_mm: [f64; 2],
}

/// A setup does not make a machine: a length that is not positive, a singular coupling.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("the parameters do not make a machine: {0}")]
pub struct InvalidSetup(pub String);

/// A quantity that calibration can find.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unknown {
    /// Place of the sheet along x.
    SheetX,
    /// Place of the sheet along y.
    SheetY,
    /// Offset of a motor: the pose in which it counts 0.
    Offset(usize),
    /// Ticks per unit of a motor.
    Counts(usize),
    /// Backlash of a motor.
    Backlash(usize),
    /// A length of the mechanism.
    Length(&'static str),
    /// Rotation of the sheet against the machine's axes, or the line of its bases.
    Turn,
    /// Distance of the two bases or anchors.
    Spread,
    /// Ratio of the belt that drives the elbow, against that of the machine file.
    Belt,
    /// Angle by which the axes are not at right angles.
    Skew,
}

/// A setup ready to be evaluated.
#[derive(Clone, Debug)]
pub(crate) struct Model {
    mechanism: Arc<dyn Mechanism>,
    from_ticks: Matrix2<f64>,
    to_ticks: Matrix2<f64>,
    offset: Vector2<f64>,
    backlash_ticks: [f64; 2],
    corner: Point,
}

struct Reader<'a>(&'a BTreeMap<String, Parameter>);

impl Reader<'_> {
    fn unreadable<T>(key: &'static str) -> Result<T, ParameterError> {
        Err(ParameterError::Unreadable { key, reason: "of another type".into() })
    }
}

impl Parameters for Reader<'_> {
    fn length_mm(&mut self, key: &'static str) -> Result<f64, ParameterError> {
        match self.0.get(key) {
            Some(Parameter::Length(length_mm)) => Ok(*length_mm),
            Some(_) => Self::unreadable(key),
            None => Err(ParameterError::Missing { key }),
        }
    }

    fn optional_length_mm(&mut self, key: &'static str) -> Result<Option<f64>, ParameterError> {
        if self.0.contains_key(key) { self.length_mm(key).map(Some) } else { Ok(None) }
    }

    fn point_mm(&mut self, key: &'static str) -> Result<Point, ParameterError> {
        match self.0.get(key) {
            Some(Parameter::Point(point)) => Ok(*point),
            Some(_) => Self::unreadable(key),
            None => Err(ParameterError::Missing { key }),
        }
    }

    fn choice(
        &mut self,
        key: &'static str,
        choices: &'static [&'static str],
    ) -> Result<usize, ParameterError> {
        let Some(Parameter::Choice(value)) = self.0.get(key) else {
            return Err(ParameterError::Missing { key });
        };
        let found = choices.iter().position(|choice| choice == value);
        found.ok_or_else(|| ParameterError::NotAChoice { key, value: value.clone(), choices })
    }
}

impl Setup {
    /// The kind of mechanism of this name.
    pub fn kind_of(name: &str) -> Option<Kind> {
        KINDS.iter().find(|kind| kind.name == name).copied()
    }

    /// The mechanism.
    ///
    /// # Errors
    /// When a parameter is missing or its value cannot be.
    pub fn mechanism(&self) -> Result<Arc<dyn Mechanism>, InvalidSetup> {
        let mechanism = self
            .kind
            .mechanism(&mut Reader(&self.geometry))
            .map_err(|error| InvalidSetup(error.to_string()))?;
        mechanism.validate().map_err(|error| InvalidSetup(error.to_string()))?;
        Ok(mechanism)
    }

    pub(crate) fn model(&self) -> Result<Model, InvalidSetup> {
        let [[a, b], [c, d]] = self.coupling;
        let scale = Matrix2::from_diagonal(&Vector2::from(self.ticks_per_unit));
        let to_ticks = scale * Matrix2::new(a, b, c, d);
        let from_ticks =
            to_ticks.try_inverse().ok_or_else(|| InvalidSetup("the coupling matrix is singular".into()))?;
        let offset = Vector2::from(self.offset_ticks);
        Ok(Model {
            mechanism: self.mechanism()?,
            from_ticks,
            to_ticks,
            offset,
            backlash_ticks: self.backlash_ticks,
            corner: self.corner,
        })
    }

    /// The two points of the mechanism: bases or anchors.
    fn points(&self) -> Vec<(&String, Point)> {
        let point = |(key, value): (_, &Parameter)| match value {
            Parameter::Point(point) => Some((key, *point)),
            _ => None,
        };
        self.geometry.iter().filter_map(|(key, value)| point((key, value))).collect()
    }

    /// Distance of the two bases or anchors, mm; 0 without.
    pub fn distance_of_points(&self) -> f64 {
        match self.points()[..] {
            [(_, a), (_, b)] => (b - a).hypot2().sqrt(),
            _ => 0.0,
        }
    }

    /// Replaces both points.
    fn map_points(&mut self, map: impl Fn(Vec2) -> Vec2) {
        let points: Vec<(String, Point)> =
            self.points().into_iter().map(|(key, point)| (key.clone(), point)).collect();
        let [(first, a), (second, b)] = &points[..] else { return };
        let middle = a.midpoint(*b);
        for (key, point) in [(first, a), (second, b)] {
            let moved = middle + map(*point - middle);
            self.geometry.insert(key.clone(), Parameter::Point(moved));
        }
    }

    /// The unknowns in the order in which they are freed: first the pose, then what decides the scale, then
    /// what only many touches determine.
    pub fn unknowns(&self) -> Vec<Vec<Unknown>> {
        use Unknown::{Belt, Counts, Length, Offset, SheetX, SheetY, Skew, Spread, Turn};
        let pose = vec![SheetX, SheetY, Offset(0), Offset(1)];
        match self.kind.name {
            "cartesian" => vec![vec![Offset(0), Offset(1), Turn], vec![Counts(0), Counts(1)], vec![Skew]],
            "two-link" => vec![pose, vec![Length("l1"), Length("l2")], vec![Belt]],
            "polar" => vec![pose, vec![Counts(1)], vec![Length("rack_offset")]],
            "five-bar" => {
                let links = ["proximal1", "proximal2", "distal1", "distal2"].map(Length).to_vec();
                // On one axis the two bases have no direction.
                let apart =
                    if self.distance_of_points() > 0.0 { vec![vec![Turn], vec![Spread]] } else { vec![] };
                [vec![pose], apart, vec![links]].concat()
            }
            "polargraph" => vec![pose, vec![Spread], vec![Turn], vec![Counts(0), Counts(1)]],
            _ => vec![pose],
        }
    }

    /// Whether a row of the coupling has this dimension: that of the first joint that it takes.
    fn is_revolute(&self, motor: usize) -> bool {
        let kinds = self.mechanism().map(|mechanism| mechanism.joint_kinds());
        let joint = usize::from(self.coupling[motor][0] == 0.0);
        kinds.is_ok_and(|kinds| kinds[joint] == JointKind::Revolute)
    }

    /// How much of the unknown's own unit moves the pen by about 1 mm, for a machine of this size, mm.
    pub(crate) fn scale(&self, unknown: Unknown, size_mm: f64) -> f64 {
        match unknown {
            Unknown::SheetX | Unknown::SheetY | Unknown::Length(_) | Unknown::Spread => 1.0,
            Unknown::Offset(motor) | Unknown::Backlash(motor) if !self.is_revolute(motor) => 1.0,
            _ => 1.0 / size_mm,
        }
    }

    /// Changes an unknown: lengths by mm, angles by rad, counts and ratios by a share. Offset and backlash of
    /// a motor change by rad or mm of its row.
    pub(crate) fn change(&mut self, unknown: Unknown, by: f64) {
        let (sin, cos) = libm::sincos(by);
        match unknown {
            Unknown::SheetX => self.corner.x += by,
            Unknown::SheetY => self.corner.y += by,
            Unknown::Offset(motor) => self.offset_ticks[motor] += by * self.ticks_per_unit[motor].abs(),
            Unknown::Counts(motor) => self.ticks_per_unit[motor] *= 1.0 + by,
            Unknown::Backlash(motor) => {
                self.backlash_ticks[motor] += by * self.ticks_per_unit[motor].abs();
            }
            Unknown::Length(key) => {
                let length_mm = match self.geometry.get(key) {
                    Some(Parameter::Length(length_mm)) => *length_mm,
                    _ => 0.0,
                };
                self.geometry.insert(key.into(), Parameter::Length(length_mm + by));
            }
            Unknown::Turn if self.points().len() == 2 => {
                self.map_points(|v| Vec2::new(cos * v.x - sin * v.y, sin * v.x + cos * v.y));
            }
            // q = R(by) C^-1 m, so C becomes C R(-by).
            Unknown::Turn => self.multiply_coupling([[cos, sin], [-sin, cos]]),
            Unknown::Skew => self.multiply_coupling([[1.0, -libm::tan(by)], [0.0, 1.0]]),
            Unknown::Spread => {
                let distance = self.distance_of_points();
                self.map_points(|v| v * ((distance + by) / distance));
            }
            // The row takes (a + b) theta + b (psi - theta); the belt divides the last.
            Unknown::Belt => {
                let [a, b] = self.coupling[1];
                let driven = b / (1.0 + by);
                self.coupling[1] = [a + b - driven, driven];
            }
        }
    }

    fn multiply_coupling(&mut self, right: [[f64; 2]; 2]) {
        self.coupling = self.coupling.map(|row| {
            [row[0] * right[0][0] + row[1] * right[1][0], row[0] * right[0][1] + row[1] * right[1][1]]
        });
    }

    /// Where the pen is at these ticks, mm from the lower-left corner of the sheet.
    ///
    /// # Errors
    /// When the parameters do not make a machine.
    pub fn pen(&self, ticks: [f64; 2]) -> Result<Point, InvalidSetup> {
        Ok(self.model()?.pen(ticks))
    }

    /// The joints at these ticks, rad or mm.
    ///
    /// # Errors
    /// When the parameters do not make a machine.
    pub fn joints(&self, ticks: [f64; 2]) -> Result<[f64; 2], InvalidSetup> {
        Ok(self.model()?.joints(ticks).0)
    }

    /// The ticks that hold the pen there, mm from the lower-left corner of the sheet, on the turn nearest to
    /// `near`. `None` out of reach.
    pub fn ticks(&self, pen: Point, near: [f64; 2]) -> Option<[f64; 2]> {
        self.model().ok()?.ticks(pen, near)
    }

    /// Whether the elbow of a two-link arm is on its left in the pose at these ticks.
    pub fn is_elbow_left(&self, ticks: [f64; 2]) -> Option<bool> {
        let model = self.model().ok()?;
        model.mechanism.as_two_link()?;
        let q = model.joints(ticks);
        Some(libm::sin(q[1] - q[0]) < 0.0)
    }
}

impl Model {
    pub(crate) fn joints(&self, ticks: [f64; 2]) -> JointPos {
        let q = self.from_ticks * (Vector2::from(ticks) - self.offset);
        JointPos::new(q.x, q.y)
    }

    pub(crate) fn pen(&self, ticks: [f64; 2]) -> Point {
        self.mechanism.forward(&self.joints(ticks)) - self.corner.to_vec2()
    }

    pub(crate) fn ticks(&self, pen: Point, near: [f64; 2]) -> Option<[f64; 2]> {
        let q = self.mechanism.inverse(pen + self.corner.to_vec2()).ok()?;
        let close = self.joints(near);
        let q = match self.mechanism.full_rotation() {
            Some(turn) => q + turn * ((close[0] - q[0]) / turn[0]).round(),
            None => q,
        };
        let ticks = self.to_ticks * Vector2::new(q[0], q[1]) + self.offset;
        Some([ticks.x, ticks.y])
    }

    /// Where the pen was at a touch: a motor that came to its ticks from below is half its backlash ahead of
    /// the mechanism.
    pub(crate) fn touched(&self, touch: &Touch) -> Point {
        let load = [0, 1].map(|motor: usize| {
            touch.ticks[motor] - 0.5 * self.backlash_ticks[motor] * touch.approach[motor]
        });
        self.pen(load)
    }

    /// Half a tick either way on both motors, and half the play of those whose `approach` is not known (0), RMS,
    /// mm.
    pub(crate) fn rounding_mm(&self, ticks: [f64; 2], approach: [f64; 2]) -> f64 {
        let q = self.joints(ticks);
        let of = |motor: usize| {
            let column = self.from_ticks.column(motor);
            let play = if approach[motor] == 0.0 { self.backlash_ticks[motor] } else { 0.0 };
            let square = self.mechanism.pen_velocity(&q, &JointPos::new(column[0], column[1])).hypot2();
            square * (1.0 + play * play) / 12.0
        };
        (of(0) + of(1)).sqrt()
    }
}
