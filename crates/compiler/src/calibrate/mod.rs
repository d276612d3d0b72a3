//! Calibration of machine files: what was measured, as files, and the machine file with what was found.

mod marks;
mod touches;
mod write;

use calibration::Setup;
use kinematics::Machine;

pub use self::marks::{Marks, pattern};
pub use self::touches::{CORNER_NAMES, corners, read_distances, read_drawn, read_touches};
pub use self::write::calibrated;
use crate::machine_file::MachineFile;

/// The machine as calibration sees it; `None` for a mechanism that machine files do not know.
pub fn setup(file: &MachineFile, machine: &Machine) -> Option<Setup> {
    let parts = machine.parts();
    Some(Setup {
        kind: Setup::kind_of(machine.mechanism().kind())?,
        geometry: file.geometry_parameters(),
        coupling: parts.coupling,
        ticks_per_unit: parts.motors.each_ref().map(|motor| motor.ticks_per_unit),
        offset_ticks: parts.motors.each_ref().map(|motor| motor.offset_ticks),
        backlash_ticks: parts.motors.each_ref().map(|motor| motor.backlash_ticks),
        corner: drawing::Point::new(parts.sheet.x0, parts.sheet.y0),
        sheet_mm: [parts.sheet.width(), parts.sheet.height()],
    })
}
