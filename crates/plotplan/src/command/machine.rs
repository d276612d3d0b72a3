//! `plotplan machine`: list, show and check machines.

use std::fmt::Write as _;

use compiler::report::{Code, MachineReport, MachineSource, WorkspaceReport};

use super::{firmware_config, new_machine};
use crate::cli::Machine;
use crate::failure::Failure;
use crate::machines;
use crate::{output, session, terminal};

pub(crate) fn run(arguments: &Machine) -> Result<(), Failure> {
    match arguments {
        Machine::List => output::report(&list()),
        Machine::Show { name, firmware_config: Some(drive) } => {
            let header = firmware_config::header(&machines::machine(name)?, *drive)?;
            output::write("-", |out| out.write_all(header.as_bytes()))
        }
        Machine::Show { name, firmware_config: None } => {
            // Only a machine that can be used is shown.
            machines::machine(name)?;
            let text = machines::machine_toml(name)?;
            output::write("-", |out| out.write_all(text.as_bytes()))
        }
        Machine::New { kind, output, name, set, defaults } => {
            new_machine::run(kind.as_deref(), output, name.as_deref(), set, *defaults)
        }
        Machine::Check { file, output } => {
            let text = check(file)?;
            if let Some(to) = output {
                super::preview::machine(file, to, None)?;
            }
            output::report(&text)
        }
        Machine::Preview { name, output, format } => super::preview::machine(name, output, *format),
    }
}

/// The presets and the user's own machines, those that cannot be used marked.
fn list() -> String {
    let machines = machines::listed();
    let mut text = String::new();
    let width = machines.iter().map(|machine| machine.name.chars().count()).max().unwrap_or(0).clamp(10, 20);
    for machine in &machines {
        let own = if machine.source == MachineSource::Own { "your own: " } else { "" };
        let _ = write!(text, "{:<width$} {own}{}", machine.name, machine.about);
        if machine.hides_preset {
            text.push_str("; hides the preset of this name");
        }
        if let Some(error) = &machine.error {
            let first = error.lines().next().unwrap_or_default();
            let _ = write!(text, "; CANNOT BE USED: {first} (plotplan machine check {})", machine.name);
        }
        text.push('\n');
    }
    session::report(|report| report.machines = Some(machines));
    text
}

/// Reach, resolution over the sheet, start pose, and doubtful limits.
fn describe(workspace: &WorkspaceReport, text: &mut String) {
    if let Some([least, median, greatest]) = workspace.tick_floor_mm {
        let _ = writeln!(
            text,
            "tick floor over the sheet: {least:.4} to {greatest:.4} mm, median {median:.4} mm"
        );
    }
    if let Some([x0, y0, x1, y1]) = workspace.reach_mm {
        let _ = writeln!(text, "reach {x0:.1}, {y0:.1} to {x1:.1}, {y1:.1} mm");
    }
    if let Some([x, y]) = workspace.suggested_start_mm {
        let _ = writeln!(
            text,
            "the start pose is singular (manipulability {:.3}): an error in it is hard to see and large at the pen; \
             [start] x = \"{x}mm\", y = \"{y}mm\" is better",
            workspace.start_manipulability
        );
    }
    for doubt in &workspace.doubts {
        let _ = writeln!(text, "is this meant? {doubt}");
    }
}

fn check(file: &str) -> Result<String, Failure> {
    session::report(|report| report.inputs.push(file.to_owned()));
    let machine = machines::machine(file)?.machine;
    let workspace = WorkspaceReport::of(&machine);
    let report = MachineReport { workspace: Some(workspace.clone()), ..MachineReport::of(&machine) };
    let mut text = format!("{} is valid\n", report.name);
    for motor in &report.motors {
        let _ = write!(
            text,
            "motor {}: {:.4} * ({} {} + {} {}) + {:.4} ticks, at most {:.1} ticks/s, {:.1} ticks/s2",
            motor.limits.name,
            motor.ticks_per_unit,
            motor.row[0],
            report.joints[0],
            motor.row[1],
            report.joints[1],
            motor.offset_ticks,
            motor.limits.speed_ticks_s,
            motor.limits.acceleration_ticks_s2
        );
        if let Some(jerk) = motor.limits.jerk_ticks_s3 {
            let _ = write!(text, ", {jerk:.1} ticks/s3");
        }
        let named = machine.motors().iter().find(|other| other.name == motor.limits.name);
        if let Some(backlash) = named.map(|motor| motor.backlash_ticks).filter(|ticks| *ticks > 0.0) {
            let _ = write!(text, ", backlash of {backlash} ticks");
        }
        text.push('\n');
    }
    if let Some(servo) = machine.parts().pen_servo {
        let [up, down] = servo.pulses_us;
        let _ = writeln!(text, "pen servo: {up:.1} us up, {down:.1} us down");
    }
    for (pen, offset) in &machine.parts().pen_offsets_mm {
        let _ = writeln!(text, "pen {pen} draws at {:.3}, {:.3} mm from the others", offset.x, offset.y);
    }
    let _ = writeln!(text, "start at ticks {}, {}", report.start_ticks[0], report.start_ticks[1]);
    if let Some(floor) = report.tick_floor_mm {
        let _ = writeln!(text, "tick floor in the middle of the sheet: {floor:.4} mm");
    }
    describe(&workspace, &mut text);
    for edge in &report.sheet.unreached_edges {
        terminal::warning(Code::SheetNotReached, edge);
    }
    if report.sheet.unreached_share > 0.0 {
        let share = 100.0 * report.sheet.unreached_share;
        let what = format!("about {share:.0} % of the sheet's inside is out of reach");
        terminal::warning(Code::SheetNotReached, &what);
    }
    let [x0, y0, x1, y1] = report.sheet.bounds_mm;
    let _ = writeln!(
        text,
        "sheet {x0:.2}, {y0:.2} to {x1:.2}, {y1:.2} mm: {}",
        if report.sheet.is_reached { "all of it can be drawn on" } else { "parts of it cannot be drawn on" }
    );
    session::report(|all| all.machine = Some(report));
    Ok(text)
}
