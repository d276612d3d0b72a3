//! Machine files: a machine described in TOML, and the presets, which are such files.
//!
//! The form is documented in docs/machine-files.md. Values carry their units as text and keep it, so that a file that was
//! read can be written into a plan document and read back without a digit's change.

use drawing::Rect;
use kinematics::{
    Cartesian, Geometry, Joint, JointPos, Machine, MachineError, MachineParts, Motor, PenLimits, Polar,
    TwoLink,
};
use serde::{Deserialize, Serialize};

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
pub const PRESETS: [Preset; 5] = [
    Preset {
        name: "coaxial",
        about: "two-link arm, both motors at the base, elbow driven through a belt; letter sheet",
        toml: include_str!("../machines/coaxial.toml"),
    },
    Preset {
        name: "corexy",
        about: "CoreXY table, 200 x 200 mm",
        toml: include_str!("../machines/corexy.toml"),
    },
    Preset {
        name: "hbot",
        about: "single-belt (H-bot) table, 250 x 250 mm",
        toml: include_str!("../machines/hbot.toml"),
    },
    Preset {
        name: "polar",
        about: "turning rail with a sliding rack, half ring from r = 48 to 138 mm",
        toml: include_str!("../machines/polar.toml"),
    },
    Preset {
        name: "cartesian",
        about: "plain x-y table, 300 x 300 mm, 80 steps/mm",
        toml: include_str!("../machines/cartesian.toml"),
    },
];

/// A machine as its file tells it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MachineFile {
    name: String,
    geometry: GeometryTable,
    #[serde(default, skip_serializing_if = "JointsTable::is_empty")]
    joints: JointsTable,
    #[serde(default)]
    coupling: CouplingTable,
    motor: Vec<MotorTable>,
    pen: PenTable,
    sheet: SheetTable,
    start: StartTable,
    #[serde(default)]
    plan: PlanTable,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
enum GeometryTable {
    Cartesian {},
    TwoLink {
        l1: String,
        l2: String,
        elbow: Elbow,
        #[serde(default = "default_min_dexterity")]
        min_dexterity: f64,
    },
    Polar {},
}

/// Arms are kept away from poses where a joint would turn ten times as fast as it need elsewhere, the polar pen a
/// millimetre from the pole.
fn default_min_dexterity() -> f64 {
    0.1
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum Elbow {
    Left,
    Right,
}

/// A value for each joint that the geometry has; those of other geometries stay empty.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct PerJoint<T> {
    #[serde(skip_serializing_if = "Option::is_none")]
    x: Option<T>,
    #[serde(skip_serializing_if = "Option::is_none")]
    y: Option<T>,
    #[serde(skip_serializing_if = "Option::is_none")]
    theta: Option<T>,
    #[serde(skip_serializing_if = "Option::is_none")]
    psi: Option<T>,
    #[serde(skip_serializing_if = "Option::is_none")]
    phi: Option<T>,
    #[serde(skip_serializing_if = "Option::is_none")]
    r: Option<T>,
}

type JointsTable = PerJoint<Range>;
type StartTable = PerJoint<String>;

impl<T> PerJoint<T> {
    fn is_empty(&self) -> bool {
        self.named().iter().all(|(_, value)| value.is_none())
    }

    fn named(&self) -> [(&'static str, Option<&T>); 6] {
        [
            ("x", self.x.as_ref()),
            ("y", self.y.as_ref()),
            ("theta", self.theta.as_ref()),
            ("psi", self.psi.as_ref()),
            ("phi", self.phi.as_ref()),
            ("r", self.r.as_ref()),
        ]
    }

    /// The values of the geometry's two joints.
    fn of(&self, table: &str, geometry: &Geometry) -> Result<[Option<&T>; 2], MachineFileError> {
        let names = geometry.joint_names();
        let named = self.named();
        if let Some((name, _)) = named.iter().find(|(name, value)| value.is_some() && !names.contains(name)) {
            return Err(MachineFileError::Invalid(format!(
                "[{table}] names the joint {name}, but this geometry has {} and {}",
                names[0], names[1]
            )));
        }
        Ok(names.map(|wanted| named.iter().find(|(name, _)| *name == wanted).and_then(|(_, value)| *value)))
    }
}

#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Range {
    #[serde(skip_serializing_if = "Option::is_none")]
    min: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    max: Option<String>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct CouplingTable {
    matrix: [[f64; 2]; 2],
}

impl Default for CouplingTable {
    fn default() -> Self {
        Self { matrix: [[1.0, 0.0], [0.0, 1.0]] }
    }
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct MotorTable {
    name: String,
    counts: String,
    #[serde(default)]
    offset: f64,
    max_speed: String,
    max_acceleration: String,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    max_jerk: Option<String>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct PenTable {
    max_speed: String,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    max_travel_speed: Option<String>,
    lift_time: String,
    drop_time: String,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct SheetTable {
    x: String,
    y: String,
    width: String,
    height: String,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct PlanTable {
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

/// Why a machine file makes no machine.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MachineFileError {
    /// It is not a machine file: not TOML, a key that is missing or not known, a value of the wrong type.
    #[error("{message}{}", suggestion.as_ref().map_or(String::new(), |s| format!("\nhelp: did you mean `{s}`?")))]
    Syntax {
        /// What is wrong and where, several lines.
        message: String,
        /// A known key that is near to one that is not.
        suggestion: Option<String>,
    },
    /// A quantity is not what its key wants.
    #[error("{key}: {source}")]
    Quantity {
        /// Which key.
        key: String,
        /// What is wrong with it.
        source: QuantityError,
    },
    /// The parts do not make a machine.
    #[error(transparent)]
    Machine(#[from] MachineError),
    /// The file contradicts itself.
    #[error("{0}")]
    Invalid(String),
}

impl MachineFile {
    /// Reads a machine file.
    ///
    /// # Errors
    /// When it is not TOML of the documented form; the message shows the line, and for an unknown key the nearest known.
    pub fn parse(toml: &str) -> Result<Self, MachineFileError> {
        toml::from_str(toml).map_err(|error| MachineFileError::Syntax {
            suggestion: nearest_known(error.message()),
            message: error.to_string().trim_end().to_owned(),
        })
    }

    /// The machine that the file describes.
    ///
    /// # Errors
    /// When a value is not of the unit that its key wants, or the parts do not make a machine.
    pub fn machine(&self) -> Result<Machine, MachineFileError> {
        let geometry = self.geometry()?;
        let dimensions =
            geometry.joint_is_angle().map(|angle| if angle { Dimension::Angle } else { Dimension::Length });
        let names = geometry.joint_names();
        let at = |key: String| move |source| MachineFileError::Quantity { key, source };

        let mut joints = [Joint::FREE; 2];
        for (k, range) in self.joints.of("joints", &geometry)?.into_iter().enumerate() {
            let Some(range) = range else { continue };
            let value = |text: &Option<String>, which: &str, otherwise: f64| match text {
                Some(text) => dimensions[k].value(text).map_err(at(format!("joints.{}.{which}", names[k]))),
                None => Ok(otherwise),
            };
            joints[k] = Joint {
                min: value(&range.min, "min", f64::NEG_INFINITY)?,
                max: value(&range.max, "max", f64::INFINITY)?,
            };
        }
        let mut start = JointPos::ZERO;
        for (k, value) in self.start.of("start", &geometry)?.into_iter().enumerate() {
            let text = value.ok_or_else(|| {
                MachineFileError::Invalid(format!("[start] does not say where joint {} is", names[k]))
            })?;
            start[k] = dimensions[k].value(text).map_err(at(format!("start.{}", names[k])))?;
        }
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
        let min_dexterity = match self.geometry {
            GeometryTable::TwoLink { min_dexterity, .. } => min_dexterity,
            GeometryTable::Polar {} => default_min_dexterity(),
            GeometryTable::Cartesian {} => 0.0,
        };
        Ok(Machine::new(MachineParts {
            name: self.name.clone(),
            geometry,
            joints,
            min_manipulability: min_dexterity,
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
            sheet: Rect { x0: x, y0: y, x1: x + width, y1: y + height },
            start,
            period_s: time(&self.plan.period, "plan.period")?,
        })?)
    }

    fn geometry(&self) -> Result<Geometry, MachineFileError> {
        let length = |text: &str, key: &str| {
            quantity::length_mm(text, false)
                .map_err(|source| MachineFileError::Quantity { key: format!("geometry.{key}"), source })
        };
        Ok(match &self.geometry {
            GeometryTable::Cartesian {} => Geometry::Cartesian(Cartesian),
            GeometryTable::Polar {} => Geometry::Polar(Polar),
            GeometryTable::TwoLink { l1, l2, elbow, .. } => Geometry::TwoLink(TwoLink {
                l1: length(l1, "l1")?,
                l2: length(l2, "l2")?,
                elbow_left: *elbow == Elbow::Left,
            }),
        })
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
        })
    }
}

/// Of serde's "unknown field `a`, expected one of `b`, `c`" the expected name nearest to the unknown, if one is near.
fn nearest_known(message: &str) -> Option<String> {
    let known = message.strip_prefix("unknown ")?;
    let mut names = known.split('`').skip(1).step_by(2);
    let wrong = names.next()?;
    nearest(wrong, names)
}

/// Of the names the one nearest to a misspelt one, if any is near enough to be meant.
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
            assert_eq!(back.machine().unwrap(), file.machine().unwrap());
        }
    }

    fn error_of(from: &str, to: &str) -> String {
        let toml = PRESETS[0].toml;
        assert!(toml.contains(from), "{from}");
        let result = MachineFile::parse(&toml.replacen(from, to, 1)).and_then(|file| file.machine());
        result.unwrap_err().to_string()
    }

    #[test]
    fn mistakes_are_explained() {
        let said = [
            error_of("max_speed = \"60deg/s\"", "max_sped = \"60deg/s\""),
            error_of("elbow = \"left\"", "elbow = \"lefft\""),
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
