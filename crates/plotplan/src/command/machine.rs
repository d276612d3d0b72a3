//! `plotplan machine`: list, show and check machines.

use std::fmt::Write as _;

use compiler::machine_file::PRESETS;
use drawing::{Line, Point, Segment};

use crate::cli::Machine;
use crate::failure::Failure;
use crate::machines;
use crate::{output, terminal};

pub(crate) fn run(arguments: &Machine) -> Result<(), Failure> {
    let text = match arguments {
        Machine::List => list(),
        Machine::Show { name } => {
            // Only a machine that can be used is shown.
            machines::machine(name)?;
            machines::machine_toml(name)?
        }
        Machine::Check { file } => check(file)?,
    };
    output::write("-", |out| out.write_all(text.as_bytes()))
}

/// The presets, and the user's own machines.
fn list() -> String {
    let mut text = String::new();
    let own = machines::own_machine_files();
    for preset in PRESETS.iter().filter(|preset| own.iter().all(|(name, _)| name != preset.name)) {
        let _ = writeln!(text, "{:<10} {}", preset.name, preset.about);
    }
    for (name, path) in own {
        let _ = writeln!(text, "{name:<10} your own: {}", path.display());
    }
    text
}

fn check(file: &str) -> Result<String, Failure> {
    let machine = machines::machine(file)?.machine;
    let sheet = machine.sheet();
    let mut text = format!("{} is valid\n", machine.name());
    let joints = machine.mechanism().joint_names();
    for (k, motor) in machine.motors().iter().enumerate() {
        let row = machine.coupling().rows()[k];
        let _ = write!(
            text,
            "motor {}: {:.4} * ({} {} + {} {}) + {:.4} ticks, at most {:.1} ticks/s, {:.1} ticks/s2",
            motor.name,
            motor.ticks_per_unit,
            row[0],
            joints[0],
            row[1],
            joints[1],
            motor.offset_ticks,
            motor.max_speed_ticks_s,
            motor.max_acceleration_ticks_s2
        );
        if let Some(jerk) = motor.max_jerk_ticks_s3 {
            let _ = write!(text, ", {jerk:.1} ticks/s3");
        }
        text.push('\n');
    }
    let start = machine.motor_positions(&machine.start());
    let _ = writeln!(text, "start at ticks {}, {}", start[0].round(), start[1].round());
    let middle = sheet.center();
    if let Ok(pose) = machine.pose_near(middle, &machine.start()) {
        let _ = writeln!(
            text,
            "tick floor in the middle of the sheet: {:.4} mm",
            machine.quantization_error(&pose)
        );
    }
    let corners = [
        Point::new(sheet.x0, sheet.y0),
        Point::new(sheet.x1, sheet.y0),
        Point::new(sheet.x1, sheet.y1),
        Point::new(sheet.x0, sheet.y1),
    ];
    let mut whole = true;
    for (k, name) in ["lower", "right", "upper", "left"].into_iter().enumerate() {
        let edge = Segment::Line(Line::new(corners[k], corners[(k + 1) % 4]));
        if let Err(out) = machine.check_segment(&edge) {
            whole = false;
            terminal::warning(&format!("not all of the sheet's {name} edge can be drawn: {out}"));
        }
    }
    // An arm may reach all edges and not the middle.
    let steps = 40;
    let missed = (1..steps)
        .flat_map(|i| (1..steps).map(move |j| (i, j)))
        .filter(|(i, j)| {
            let at = |low: f64, size: f64, k: i32| low + size * f64::from(k) / f64::from(steps);
            let p = Point::new(at(sheet.x0, sheet.width(), *i), at(sheet.y0, sheet.height(), *j));
            machine.check_point(p).is_err()
        })
        .count();
    if missed > 0 {
        whole = false;
        let share = 100.0 * missed as f64 / f64::from((steps - 1) * (steps - 1));
        terminal::warning(&format!("about {share:.0} % of the sheet's inside is out of reach"));
    }
    let _ = writeln!(
        text,
        "sheet {:.2}, {:.2} to {:.2}, {:.2} mm: {}",
        sheet.x0,
        sheet.y0,
        sheet.x1,
        sheet.y1,
        if whole { "all of it can be drawn on" } else { "parts of it cannot be drawn on" }
    );
    Ok(text)
}
