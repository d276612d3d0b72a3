//! Homing in G-code: `$H` of grbl, `G28` of the others, and the coordinates of the place where it ends.

use kinematics::{HomingAxis, Machine};

use super::encode::{Flavour, xy};
use crate::Line;
use crate::homing::{HomingStep, HomingSteps, StepAnswer};

/// Whether the machine homes by moves.
fn has_moves(machine: &Machine) -> bool {
    machine.parts().homing.as_ref().is_some_and(|homing| !homing.moves().is_empty())
}

/// Sets the work coordinates where homing ends: in the start pose.
fn coordinates(machine: &Machine) -> String {
    xy(machine.mechanism().forward(&machine.start()))
}

/// The steps of grbl and its kin. The firmware has its own switches, speeds and order (`$23` to `$27`).
pub(super) fn steps(machine: &Machine) -> Option<HomingSteps> {
    let step = |text: String| HomingStep { text, repeats: false, parse: answer };
    has_moves(machine).then(|| HomingSteps {
        steps: vec![
            step("$H\n".to_owned()),
            step("G21\n".to_owned()),
            step(format!("G10 L20 P1 {}\n", coordinates(machine))),
        ],
        // Soft reset.
        abort: &[0x18],
    })
}

fn answer(line: &str) -> StepAnswer {
    let failed = |why: &str| StepAnswer::Failed(format!("{why} (`{line}`)"));
    match line {
        "ok" => StepAnswer::Done,
        "ALARM:6" | "ALARM:7" => failed("homing was reset"),
        "ALARM:8" => failed("homing has failed: the switch did not open on the way back"),
        "ALARM:9" => failed("homing has failed: a switch did not close on the way to it"),
        "error:5" => failed("homing is not enabled in the firmware: set $22=1"),
        _ if line.starts_with("ALARM") || line.starts_with("error") => failed("the machine does not home"),
        _ => StepAnswer::Other,
    }
}

/// The lines that home at the beginning of a file; none for a machine without homing moves.
pub(super) fn lines(flavour: Flavour, machine: &Machine) -> Vec<Line> {
    if !has_moves(machine) {
        return Vec::new();
    }
    let axes = |homing: &kinematics::Homing| {
        let mut axes = String::new();
        for (index, name) in [" X", " Y"].into_iter().enumerate() {
            let is_homed = |mv: &kinematics::HomingMove| match mv.axis {
                HomingAxis::Joint(joint) => joint == index,
                HomingAxis::Motor(motor) => motor == index,
            };
            if homing.moves().iter().any(is_homed) {
                axes.push_str(name);
            }
        }
        axes
    };
    let axes = machine.parts().homing.as_ref().map(axes).unwrap_or_default();
    let at = coordinates(machine);
    let texts = match flavour {
        Flavour::Grbl | Flavour::FluidNc => ["$H".to_owned(), format!("G10 L20 P1 {at}")],
        Flavour::Marlin | Flavour::Klipper => [format!("G28{axes}"), format!("G92 {at}")],
    };
    texts.map(|text| Line { text, ..Line::default() }).into()
}
