//! `[pen] servo`: the pulses of a servo that lifts the pen.

use kinematics::PenServo;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::MachineFileError;
use crate::quantity::{self, Quantity};

/// Positions as pulses, or as angles with the range of the servo.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct ServoTable {
    /// Position of the pen up: a pulse such as `"1200us"`, or an angle with `pulses` and `range`.
    up: String,
    /// Position of the pen down.
    down: String,
    /// Pulses at both ends of the range.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pulses: Option<[String; 2]>,
    /// The angle between them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    range: Option<String>,
}

/// Units of time.
const TIMES: [&str; 4] = ["s", "ms", "us", "min"];

impl ServoTable {
    /// The pulses, us: `p = p0 + (p1 - p0) angle / range` for angles.
    pub(super) fn servo(&self) -> Result<PenServo, MachineFileError> {
        let at = |key: &str| {
            let key = format!("pen.servo.{key}");
            move |source| MachineFileError::Quantity { key, source }
        };
        let pulse_us = |text: &str, key: &str| -> Result<f64, MachineFileError> {
            Ok(quantity::time_s(text).map_err(at(key))? * 1e6)
        };
        let positions = [("up", &self.up), ("down", &self.down)];
        let is_pulse = |text: &str| text.parse::<Quantity>().is_ok_and(|q| TIMES.contains(&q.unit.as_str()));
        match (&self.pulses, &self.range) {
            (None, None) => {
                let [up, down] = positions.map(|(key, text)| pulse_us(text, key));
                Ok(PenServo { pulses_us: [up?, down?], angles_deg: None })
            }
            (Some([first, last]), Some(range)) => {
                let (first, last) = (pulse_us(first, "pulses")?, pulse_us(last, "pulses")?);
                let range_deg = quantity::angle_rad(range).map_err(at("range"))?.to_degrees();
                if range_deg <= 0.0 {
                    return Err(MachineFileError::Invalid(format!("pen.servo.range must be positive, not {range}")));
                }
                if let Some((key, text)) = positions.iter().find(|(_, text)| is_pulse(text)) {
                    return Err(MachineFileError::Invalid(format!(
                        "pen.servo.{key}: {text} is a pulse, which needs no range: leave out `pulses` and `range`, or \
                         write an angle"
                    )));
                }
                let angle = |(key, text): (&str, &String)| {
                    let deg = quantity::angle_rad(text).map_err(at(key))?.to_degrees();
                    // Rounding of degrees to rad and back.
                    if !(-1e-9..=range_deg + 1e-9).contains(&deg) {
                        return Err(MachineFileError::Invalid(format!(
                            "pen.servo.{key}: {text} is not within the range of 0 to {range}"
                        )));
                    }
                    // To a millionth of a degree: 40deg stays 40.
                    Ok((deg * 1e6).round() / 1e6)
                };
                let [up, down] = positions.map(angle);
                let angles = [up?, down?];
                let pulse = |deg: f64| first + (last - first) * deg / range_deg;
                Ok(PenServo { pulses_us: angles.map(pulse), angles_deg: Some(angles) })
            }
            (Some(_), None) | (None, Some(_)) => Err(MachineFileError::Invalid(
                "pen.servo: `pulses` and `range` go together: the pulses at both ends, and the angle between them".into(),
            )),
        }
    }
}
