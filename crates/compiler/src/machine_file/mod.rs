//! Machine files: a machine described in TOML, and the presets, which are such files.
//!
//! The form is documented in docs/machine-files.md. Values carry their units as text and keep it, so that a file that was
//! read can be written into a plan document and read back without a digit's change.

mod drive;
mod edit;
mod error;
mod homing;
mod keys;
mod line;
mod servo;

use std::collections::BTreeMap;
use std::sync::Arc;

use drawing::{Point, Rect, Vec2};
use kinematics::mechanism::{KINDS, Kind, ParameterError, Parameters};
use kinematics::{JointKind, JointPos, JointRange, Machine, MachineParts, Mechanism, Motor, PenLimits};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use simulation::Drive;

pub use self::drive::DriveTable;
pub use self::edit::{drive_keys, with_drive};
pub use self::error::{MachineFileError, SyntaxError};
use self::homing::HomingTable;
pub use self::keys::{markdown, schema};
use self::servo::ServoTable;
use crate::quantity::{self, Dimension, QuantityError};

/// A preset: its name, a line about it, and its file.
#[derive(Clone, Copy, Debug)]
pub struct Preset {
    /// What `--machine` calls it.
    pub name: &'static str,
    /// One line about it.
    pub about: &'static str,
    /// The machine file.
    pub toml: &'static str,
}

/// The machines that come with plotplan.
pub const PRESETS: [Preset; 11] = [
    Preset {
        name: "coaxial",
        about: "two-link arm, both motors at the base, elbow driven through a belt; letter sheet",
        toml: include_str!("../../machines/coaxial.toml"),
    },
    Preset {
        name: "corexy",
        about: "CoreXY table, 200 x 200 mm",
        toml: include_str!("../../machines/corexy.toml"),
    },
    Preset {
        name: "hbot",
        about: "single-belt (H-bot) table, 250 x 250 mm",
        toml: include_str!("../../machines/hbot.toml"),
    },
    Preset {
        name: "polar",
        about: "turning rail with a sliding rack, half ring from r = 48 to 138 mm",
        toml: include_str!("../../machines/polar.toml"),
    },
    Preset {
        name: "cartesian",
        about: "plain x-y table, 300 x 300 mm, 80 steps/mm",
        toml: include_str!("../../machines/cartesian.toml"),
    },
    Preset {
        name: "serial-arm",
        about: "two-link arm with the second motor on its elbow (grbl-scara), A5 sheet",
        toml: include_str!("../../machines/serial-arm.toml"),
    },
    Preset {
        name: "scara",
        about: "RepRapFirmware SCARA with crosstalk, both motors at the base, A7 sheet",
        toml: include_str!("../../machines/scara.toml"),
    },
    Preset {
        name: "brachiograph",
        about: "BrachioGraph, an arm of two hobby servos, 140 x 90 mm",
        toml: include_str!("../../machines/brachiograph.toml"),
    },
    Preset {
        name: "five-bar",
        about: "five-bar with two steppers, A6 sheet",
        toml: include_str!("../../machines/five-bar.toml"),
    },
    Preset {
        name: "polargraph",
        about: "pen hanging from two cords (Polargraph), 650 mm wide, A4 sheet",
        toml: include_str!("../../machines/polargraph.toml"),
    },
    Preset {
        name: "axidraw",
        about: "AxiDraw V3, 300 x 218 mm",
        toml: include_str!("../../machines/axidraw.toml"),
    },
];

/// A machine as its file tells it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MachineFile {
    /// Name of the machine, copied into plans.
    name: String,
    /// The mechanism and its dimensions.
    geometry: GeometryTable,
    /// Range of each joint, by its name; without it a joint is free.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    joints: PerJoint<Range>,
    /// How joints and motors are coupled.
    #[serde(default)]
    coupling: CouplingTable,
    /// The two motors, in the order of the rows of the coupling matrix.
    motor: Vec<MotorTable>,
    /// Speed of the pen, and the time that it needs to go up and down.
    pen: PenTable,
    /// Position and size of the sheet in the machine frame.
    sheet: SheetTable,
    /// Start pose, where plans start and end: a value for each joint, or `x` and `y` of the pen.
    start: PerJoint<String>,
    /// How the machine finds its start pose.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    homing: Option<HomingTable>,
    /// What plans of this machine are like.
    #[serde(default)]
    plan: PlanTable,
    /// Motors and feedback loop, for `simulate` and `tune`; plans do not depend on it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    drive: Option<DriveTable>,
}

/// The `[geometry]` table: the kind of mechanism and its parameters.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(try_from = "BTreeMap<String, Parameter>", into = "BTreeMap<String, Parameter>")]
#[schemars(with = "BTreeMap<String, Parameter>")]
struct GeometryTable {
    kind: Kind,
    /// What the table holds, `kind` included.
    table: BTreeMap<String, Parameter>,
}

/// A value in the `[geometry]` table: a number, or text, which may have a unit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(
    untagged,
    expecting = "expected a number, text such as \"206mm\", or a point such as [\"-40mm\", \"0mm\"]"
)]
enum Parameter {
    Number(f64),
    Text(String),
    Point([String; 2]),
}

/// Values by the names of joints.
type PerJoint<T> = BTreeMap<String, T>;

/// The values of the mechanism's two joints in a table of the file.
fn per_joint<'a, T>(
    values: &'a PerJoint<T>,
    table: &str,
    mechanism: &dyn Mechanism,
) -> Result<[Option<&'a T>; 2], MachineFileError> {
    let names = mechanism.joint_names();
    if let Some(name) = values.keys().find(|name| !names.contains(&name.as_str())) {
        return Err(MachineFileError::Invalid(format!(
            "[{table}] names the joint {name}, but this geometry has {} and {}",
            names[0], names[1]
        )));
    }
    Ok(names.map(|name| values.get(name)))
}

#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Range {
    /// Smallest value: an angle where the joint turns, a length where it slides.
    #[serde(skip_serializing_if = "Option::is_none")]
    min: Option<String>,
    /// Largest value.
    #[serde(skip_serializing_if = "Option::is_none")]
    max: Option<String>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct CouplingTable {
    /// A row for each motor: `ticks = counts * (matrix * joints) + offset`.
    matrix: [[f64; 2]; 2],
}

impl Default for CouplingTable {
    fn default() -> Self {
        Self { matrix: [[1.0, 0.0], [0.0, 1.0]] }
    }
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct MotorTable {
    /// Name of the motor, the header of its column.
    name: String,
    /// Ticks per unit of its row of the matrix: `"3200/rev"`, `"80/mm"`, `"360/44mm"`; negative
    /// reverses the direction.
    counts: String,
    /// Motor position in ticks where its row is 0.
    #[serde(default)]
    offset: f64,
    /// Largest speed: `"60deg/s"`, `"500mm/s"`, `"2000ticks/s"`.
    max_speed: String,
    /// Largest acceleration: `"3000deg/s2"`.
    max_acceleration: String,
    /// Largest jerk: `"90000deg/s3"`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    max_jerk: Option<String>,
    /// Play between motor and mechanism, ticks.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    backlash: Option<f64>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct PenTable {
    /// Largest speed of the pen while it draws.
    max_speed: String,
    /// Largest speed of the pen while it is up; without it, the motors limit it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    max_travel_speed: Option<String>,
    /// Time to lift the pen; the motors are at rest meanwhile.
    lift_time: String,
    /// Time to lower the pen.
    drop_time: String,
    /// Pulses of the servo that lifts the pen.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    servo: Option<ServoTable>,
    /// Cartesian machines: where the tips of single pens are, by their numbers, relative to the
    /// others.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    offset: BTreeMap<String, [String; 2]>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct SheetTable {
    /// Left edge.
    x: String,
    /// Lower edge.
    y: String,
    /// Width.
    width: String,
    /// Height.
    height: String,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct PlanTable {
    /// Time between rows.
    #[serde(default = "default_period")]
    period: String,
}

fn default_period() -> String {
    "10ms".into()
}

impl Default for PlanTable {
    fn default() -> Self {
        Self { period: default_period() }
    }
}

impl MachineFile {
    /// Reads a machine file.
    ///
    /// # Errors
    /// When it is not TOML of the documented form; the message shows the line, and for an unknown key the nearest known.
    pub fn parse(toml: &str) -> Result<Self, MachineFileError> {
        toml::from_str(toml).map_err(|error| MachineFileError::Syntax(SyntaxError::of(toml, &error)))
    }

    /// The machine that the file describes.
    ///
    /// # Errors
    /// When a value is not of the unit that its key wants, or the parts do not make a machine.
    pub fn machine(&self) -> Result<Machine, MachineFileError> {
        let mechanism = self.geometry.mechanism().map_err(MachineFileError::Geometry)?;
        let dimensions = mechanism.joint_kinds().map(dimension);
        let names = mechanism.joint_names();
        let at = |key: String| move |source| MachineFileError::Quantity { key, source };

        let mut joints = [JointRange::FREE; 2];
        for (k, range) in per_joint(&self.joints, "joints", &*mechanism)?.into_iter().enumerate() {
            let Some(range) = range else { continue };
            let value = |text: &Option<String>, which: &str, otherwise: f64| match text {
                Some(text) => dimensions[k].value(text).map_err(at(format!("joints.{}.{which}", names[k]))),
                None => Ok(otherwise),
            };
            joints[k] = JointRange {
                min: value(&range.min, "min", f64::NEG_INFINITY)?,
                max: value(&range.max, "max", f64::INFINITY)?,
            };
        }
        let start = self.start(&*mechanism)?;
        let motors = self.motor.as_slice();
        let homing =
            self.homing.as_ref().map(|homing| homing.homing(&*mechanism, motors, &joints)).transpose()?;
        let [first, second] = self.motor.as_slice() else {
            return Err(MachineFileError::Invalid(format!(
                "a machine has two motors, this file has {}",
                self.motor.len()
            )));
        };
        let length = |text: &str, key: &str| quantity::length_mm(text, false).map_err(at(key.to_owned()));
        let time = |text: &str, key: &str| quantity::time_s(text).map_err(at(key.to_owned()));
        let (x, y) = (length(&self.sheet.x, "sheet.x")?, length(&self.sheet.y, "sheet.y")?);
        let (width, height) =
            (length(&self.sheet.width, "sheet.width")?, length(&self.sheet.height, "sheet.height")?);
        let machine = Machine::new(MachineParts {
            name: self.name.clone(),
            joints,
            min_manipulability: self.geometry.min_manipulability(&*mechanism)?,
            mechanism,
            coupling: self.coupling.matrix,
            motors: [first.motor()?, second.motor()?],
            pen: PenLimits {
                max_speed_mm_s: quantity::speed_mm_s(&self.pen.max_speed)
                    .map_err(at("pen.max_speed".into()))?,
                max_travel_speed_mm_s: match &self.pen.max_travel_speed {
                    Some(speed) => quantity::speed_mm_s(speed).map_err(at("pen.max_travel_speed".into()))?,
                    None => f64::INFINITY,
                },
                lift_time_s: time(&self.pen.lift_time, "pen.lift_time")?,
                drop_time_s: time(&self.pen.drop_time, "pen.drop_time")?,
            },
            pen_servo: self.pen.servo.as_ref().map(ServoTable::servo).transpose()?,
            pen_offsets_mm: self.pen_offsets()?,
            homing,
            sheet: Rect { x0: x, y0: y, x1: x + width, y1: y + height },
            start,
            period_s: time(&self.plan.period, "plan.period")?,
        })?;
        // A drive that cannot be shows as soon as the machine is used.
        self.drive(&machine)?;
        Ok(machine)
    }

    /// Where the tips of single pens are.
    fn pen_offsets(&self) -> Result<BTreeMap<u16, Vec2>, MachineFileError> {
        let mut offsets = BTreeMap::new();
        for (pen, [x, y]) in &self.pen.offset {
            let number = pen.parse::<u16>().ok().filter(|number| *number > 0).ok_or_else(|| {
                MachineFileError::Invalid(format!("pen.offset: `{pen}` is not the number of a pen"))
            })?;
            let length = |text: &str| {
                let key = format!("pen.offset.{pen}");
                quantity::length_mm(text, false).map_err(|source| MachineFileError::Quantity { key, source })
            };
            offsets.insert(number, Vec2::new(length(x)?, length(y)?));
        }
        if !offsets.is_empty() && self.geometry.kind.name != "cartesian" {
            return Err(MachineFileError::Invalid(format!(
                "pen.offset needs a holder that does not turn, as that of a cartesian machine: that of a {} machine \
                 turns with the mechanism",
                self.geometry.kind.name
            )));
        }
        Ok(offsets)
    }

    /// The start pose: a value for each joint, or the place of the pen.
    fn start(&self, mechanism: &dyn Mechanism) -> Result<JointPos, MachineFileError> {
        let names = mechanism.joint_names();
        let at = |key: String| move |source| MachineFileError::Quantity { key, source };
        if let (2, Some(x), Some(y)) = (self.start.len(), self.start.get("x"), self.start.get("y"))
            && names != ["x", "y"]
        {
            let length = |text: &str, key: &str| quantity::length_mm(text, false).map_err(at(key.to_owned()));
            let pen = Point::new(length(x, "start.x")?, length(y, "start.y")?);
            return mechanism.inverse(pen).map_err(|unreachable| {
                let (x, y) = (pen.x, pen.y);
                MachineFileError::Invalid(format!("the pen cannot start at {x}, {y} mm: {unreachable}"))
            });
        }
        let mut start = JointPos::ZERO;
        for (k, value) in per_joint(&self.start, "start", mechanism)?.into_iter().enumerate() {
            let text = value.ok_or_else(|| {
                MachineFileError::Invalid(format!("[start] does not say where joint {} is", names[k]))
            })?;
            let dimension = dimension(mechanism.joint_kinds()[k]);
            start[k] = dimension.value(text).map_err(at(format!("start.{}", names[k])))?;
        }
        Ok(start)
    }

    /// The parameters of the mechanism, for calibration.
    pub fn geometry_parameters(&self) -> BTreeMap<String, calibration::Parameter> {
        let length = |text: &str| quantity::length_mm(text, false).ok();
        let parameter = |value: &Parameter| match value {
            Parameter::Number(_) => None,
            Parameter::Text(text) => Some(match length(text) {
                Some(mm) => calibration::Parameter::Length(mm),
                None => calibration::Parameter::Choice(text.clone()),
            }),
            Parameter::Point([x, y]) => {
                Some(calibration::Parameter::Point(Point::new(length(x)?, length(y)?)))
            }
        };
        let of_mechanism = self.geometry.table.iter().filter(|(key, _)| *key != "kind");
        of_mechanism.filter_map(|(key, value)| Some((key.clone(), parameter(value)?))).collect()
    }

    /// The drive of the machine, for simulations; `None` for a file without `[drive]`.
    ///
    /// # Errors
    /// When a value is not of the unit that its key wants, or cannot be; the error names the key.
    pub fn drive(&self, machine: &Machine) -> Result<Option<Drive>, MachineFileError> {
        let (Some(table), [first, second]) = (&self.drive, self.motor.as_slice()) else { return Ok(None) };
        table.drive(machine, [first, second]).map(Some)
    }
}

/// A key of every `[geometry]` table: [`MachineParts::min_manipulability`].
const MIN_MANIPULABILITY: &str = "min_dexterity";

/// The smallest value that it may have where a mechanism has singular poses: motors turn a thousand
/// times as fast as elsewhere.
const LEAST_MANIPULABILITY: f64 = 1e-3;

/// What the values of a joint are.
fn dimension(kind: JointKind) -> Dimension {
    match kind {
        JointKind::Revolute => Dimension::Angle,
        JointKind::Prismatic => Dimension::Length,
    }
}

impl GeometryTable {
    fn min_manipulability(&self, mechanism: &dyn Mechanism) -> Result<f64, MachineFileError> {
        let usual = mechanism.default_min_manipulability();
        match self.table.get(MIN_MANIPULABILITY) {
            Some(Parameter::Number(least)) if usual > 0.0 && *least < LEAST_MANIPULABILITY => {
                Err(MachineFileError::Invalid(format!(
                    "{MIN_MANIPULABILITY} must be at least {LEAST_MANIPULABILITY}, not {least}: at 0 the pose is \
                     singular, and no motor speed is high enough to move the pen in every direction ({usual} is \
                     usual)"
                )))
            }
            Some(Parameter::Number(least)) => Ok(*least),
            _ => Ok(usual),
        }
    }

    fn mechanism(&self) -> Result<Arc<dyn Mechanism>, ParameterError> {
        self.kind.mechanism(&mut TableReader(&self.table))
    }
}

impl TryFrom<BTreeMap<String, Parameter>> for GeometryTable {
    type Error = String;

    /// Checks the keys. Values with units are read when the machine is made, where an error names its key.
    fn try_from(table: BTreeMap<String, Parameter>) -> Result<Self, String> {
        let listed =
            |names: &[&str]| names.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ");
        let name = match table.get("kind") {
            Some(Parameter::Text(name)) => name,
            Some(_) => return Err("`kind` must be text".into()),
            None => return Err("missing field `kind`".into()),
        };
        let kind = *KINDS.iter().find(|kind| kind.name == name).ok_or_else(|| {
            let names: Vec<_> = KINDS.iter().map(|kind| kind.name).collect();
            format!("unknown variant `{name}`, expected one of {}", listed(&names))
        })?;
        let known = [&["kind"], kind.parameters, &[MIN_MANIPULABILITY]].concat();
        if let Some(key) = table.keys().find(|key| !known.contains(&key.as_str())) {
            return Err(format!("unknown field `{key}`, expected one of {}", listed(&known)));
        }
        if let Some(Parameter::Text(_) | Parameter::Point(_)) = table.get(MIN_MANIPULABILITY) {
            return Err(format!("`{MIN_MANIPULABILITY}` must be a number"));
        }
        let geometry = Self { kind, table };
        match geometry.mechanism() {
            Ok(_) | Err(ParameterError::Unreadable { .. }) => Ok(geometry),
            Err(error) => Err(error.to_string()),
        }
    }
}

impl From<GeometryTable> for BTreeMap<String, Parameter> {
    fn from(geometry: GeometryTable) -> Self {
        geometry.table
    }
}

/// Reads a mechanism's parameters from a `[geometry]` table.
struct TableReader<'a>(&'a BTreeMap<String, Parameter>);

impl TableReader<'_> {
    fn text(&self, key: &'static str) -> Result<&str, ParameterError> {
        match self.0.get(key) {
            Some(Parameter::Text(text)) => Ok(text),
            Some(Parameter::Number(number)) => {
                let reason = format!("{number} has no unit: write it as text, such as \"{number}mm\"");
                Err(ParameterError::Unreadable { key, reason })
            }
            Some(Parameter::Point(_)) => {
                let reason = "it is one value, not a point of two".to_owned();
                Err(ParameterError::Unreadable { key, reason })
            }
            None => Err(ParameterError::Missing { key }),
        }
    }
}

impl Parameters for TableReader<'_> {
    fn length_mm(&mut self, key: &'static str) -> Result<f64, ParameterError> {
        let unreadable = |error: QuantityError| ParameterError::Unreadable { key, reason: error.to_string() };
        quantity::length_mm(self.text(key)?, false).map_err(unreadable)
    }

    fn optional_length_mm(&mut self, key: &'static str) -> Result<Option<f64>, ParameterError> {
        if self.0.contains_key(key) { self.length_mm(key).map(Some) } else { Ok(None) }
    }

    fn point_mm(&mut self, key: &'static str) -> Result<Point, ParameterError> {
        let unreadable = |reason: String| ParameterError::Unreadable { key, reason };
        match self.0.get(key) {
            Some(Parameter::Point(values)) => {
                let length = |text: &str| {
                    quantity::length_mm(text, false).map_err(|error| unreadable(error.to_string()))
                };
                Ok(Point::new(length(&values[0])?, length(&values[1])?))
            }
            Some(_) => Err(unreadable("a point is written as [\"-40mm\", \"0mm\"]".into())),
            None => Err(ParameterError::Missing { key }),
        }
    }

    fn choice(
        &mut self,
        key: &'static str,
        choices: &'static [&'static str],
    ) -> Result<usize, ParameterError> {
        let value = self.text(key)?;
        let found = choices.iter().position(|choice| *choice == value);
        found.ok_or_else(|| ParameterError::NotAChoice { key, value: value.to_owned(), choices })
    }
}

impl MotorTable {
    fn motor(&self) -> Result<Motor, MachineFileError> {
        let at = |key: &str| {
            let key = format!("{key} of motor {}", self.name);
            move |source| MachineFileError::Quantity { key, source }
        };
        let (counts, dimension) = quantity::counts(&self.counts).map_err(at("counts"))?;
        let rate =
            |text: &str, power, key| quantity::rate_ticks(text, power, counts, dimension).map_err(at(key));
        Ok(Motor {
            name: self.name.clone(),
            ticks_per_unit: counts,
            offset_ticks: self.offset,
            max_speed_ticks_s: rate(&self.max_speed, 1, "max_speed")?,
            max_acceleration_ticks_s2: rate(&self.max_acceleration, 2, "max_acceleration")?,
            max_jerk_ticks_s3: self.max_jerk.as_deref().map(|text| rate(text, 3, "max_jerk")).transpose()?,
            backlash_ticks: self.backlash.unwrap_or(0.0),
        })
    }
}

/// The name most similar to a misspelt one (Jaro-Winkler above 0.75).
pub fn nearest<'a>(wrong: &str, names: impl Iterator<Item = &'a str>) -> Option<String> {
    names
        .map(|name| (strsim::jaro_winkler(wrong, name), name))
        .filter(|(likeness, _)| *likeness > 0.75)
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, name)| name.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_preset_is_a_machine_of_its_name() {
        for preset in PRESETS {
            let machine = MachineFile::parse(preset.toml).unwrap().machine().unwrap();
            assert_eq!(machine.name(), preset.name);
        }
    }

    #[test]
    fn a_file_written_as_json_and_read_back_is_the_same_machine() {
        for preset in PRESETS {
            let file = MachineFile::parse(preset.toml).unwrap();
            let json = serde_json::to_value(&file).unwrap();
            let back: MachineFile = serde_json::from_value(json).unwrap();
            // Debug writes every digit of a number.
            let parts = |file: &MachineFile| format!("{:?}", file.machine().unwrap().parts());
            assert_eq!(parts(&back), parts(&file));
        }
    }

    fn error_of(from: &str, to: &str) -> String {
        let toml = PRESETS[0].toml;
        assert!(toml.contains(from), "{from}");
        let result = MachineFile::parse(&toml.replacen(from, to, 1)).and_then(|file| file.machine());
        chain(&result.unwrap_err())
    }

    /// The error with its sources, as the program prints them.
    fn chain(error: &MachineFileError) -> String {
        let mut text = error.to_string();
        let mut source = std::error::Error::source(error);
        while let Some(error) = source {
            text = format!("{text}: {error}");
            source = error.source();
        }
        text
    }

    #[test]
    fn errors_state_each_cause_once() {
        for (from, to) in [
            ("l1 = \"206mm\"", "l1 = \"206\""),
            ("theta = \"90deg\"", "theta = \"90\""),
            ("lift_time = \"150ms\"", "lift_time = \"150\""),
        ] {
            let error = error_of(from, to);
            assert_eq!(error.matches("is not").count(), 1, "{error}");
        }
    }

    #[test]
    fn messages_of_machine_files() {
        let said = [
            error_of("max_speed = \"60deg/s\"", "max_sped = \"60deg/s\""),
            error_of("elbow = \"left\"", "elbow = \"lefft\""),
            error_of("l2 = \"256mm\"", "lenght = \"256mm\""),
            error_of("l2 = \"256mm\"", "l2 = 256"),
            error_of("max_speed = \"60mm/s\"", "max_speed = 60"),
            error_of("name = \"coaxial\"", ""),
            error_of("[[1, 0], [0, -1]]", "[[1, 1], [1, 1]]"),
            error_of("l1 = \"206mm\"", "l1 = \"206\""),
            error_of("counts = \"3200/rev\"", "counts = \"3200\""),
            error_of("max_speed = \"60deg/s\"", "max_speed = \"60mm/s\""),
            error_of("theta = \"90deg\"", "r = \"90mm\""),
            error_of("max_acceleration = \"300deg/s2\"", "max_acceleration = \"0deg/s2\""),
        ];
        insta::assert_snapshot!(said.join("\n--\n"));
    }
}
