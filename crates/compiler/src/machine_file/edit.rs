//! Machine files with another loop: comments, order and everything else stay.

use simulation::tune::three_digits;
use simulation::{Drive, Feedback, SetpointKind};
use toml_edit::{DocumentMut, InlineTable, Item, Table, Value, value};

/// The keys of the `[drive]` table that a search of gains sets, with their values.
pub fn drive_keys(drive: &Drive) -> Vec<(&'static str, Value)> {
    let setpoints = match drive.setpoints {
        SetpointKind::Vertices => "vertices",
        SetpointKind::Held => "held",
        SetpointKind::Interpolated => "interpolated",
    };
    let milliseconds = |time_s: f64| Value::from(format!("{}ms", (time_s * 1e6).round() / 1e3));
    let mut keys = vec![("setpoints", Value::from(setpoints)), ("period", milliseconds(drive.period_s))];
    if let Feedback::Pid(gains, _) = &drive.feedback {
        for (key, gain) in [("kp", gains.kp), ("ki", gains.ki), ("kd", gains.kd)] {
            keys.push((key, Value::from(three_digits(gain))));
        }
        if gains.kd > 0.0 && gains.kd_filter_s > 0.0 {
            keys.push(("kd_filter", milliseconds(gains.kd_filter_s)));
        }
    }
    let forward = drive.feed_forward;
    let mut table = InlineTable::new();
    for (key, share) in
        [("speed", forward.speed), ("acceleration", forward.acceleration), ("friction", forward.friction)]
    {
        table.insert(key, Value::from(share));
    }
    keys.push(("feed_forward", Value::from(table)));
    keys
}

/// A machine file with the loop of this drive.
///
/// # Errors
/// When the text is not TOML.
pub fn with_drive(toml: &str, drive: &Drive) -> Result<String, toml_edit::TomlError> {
    let mut document: DocumentMut = toml.parse()?;
    let table = document.entry("drive").or_insert_with(|| Item::Table(Table::new()));
    if let Some(table) = table.as_table_like_mut() {
        // Belongs to other loops or setpoints.
        for key in ["cascade", "reached_within", "kd_filter"] {
            table.remove(key);
        }
        for (key, new) in drive_keys(drive) {
            match table.get_mut(key).and_then(Item::as_value_mut) {
                // What stands around the value, comments included, stays.
                Some(old) => {
                    let decor = old.decor().clone();
                    *old = new;
                    *old.decor_mut() = decor;
                }
                None => {
                    table.insert(key, value(new));
                }
            }
        }
    }
    Ok(document.to_string())
}

#[cfg(test)]
mod tests {
    use simulation::{FeedForward, PidGains};

    use super::super::{MachineFile, PRESETS};
    use super::*;

    #[test]
    fn new_gains_keep_comments_and_motors() {
        let file = MachineFile::parse(PRESETS[0].toml).unwrap();
        let machine = file.machine().unwrap();
        let mut drive = file.drive(&machine).unwrap().unwrap();
        drive.setpoints = SetpointKind::Interpolated;
        drive.feed_forward = FeedForward { speed: 1.0, acceleration: 1.0, friction: 1.0 };
        let gains = PidGains { kp: 0.375, ki: 1.0, kd: 0.04, kd_filter_s: 0.01 };
        drive.feedback = Feedback::Pid(gains, simulation::AntiWindup::Conditional);
        let text = with_drive(PRESETS[0].toml, &drive).unwrap();
        let comments = |text: &str| text.lines().filter(|line| line.starts_with('#')).count();
        assert_eq!(comments(&text), comments(PRESETS[0].toml));
        let back = MachineFile::parse(&text).unwrap();
        drive.reached_within_ticks = 20.0;
        assert_eq!(back.drive(&back.machine().unwrap()).unwrap(), Some(drive));
    }

    #[test]
    fn cascade_gives_way_to_gains() {
        let preset = PRESETS.iter().find(|preset| preset.name == "hbot").unwrap();
        let file = MachineFile::parse(preset.toml).unwrap();
        let mut drive = file.drive(&file.machine().unwrap()).unwrap().unwrap();
        let gains = PidGains { kp: 0.5, ..PidGains::default() };
        drive.feedback = Feedback::Pid(gains, simulation::AntiWindup::Conditional);
        let text = with_drive(preset.toml, &drive).unwrap();
        let back = MachineFile::parse(&text).unwrap();
        assert_eq!(back.drive(&back.machine().unwrap()).unwrap().unwrap().feedback, drive.feedback);
    }
}
