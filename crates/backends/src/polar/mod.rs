//! The polar robot: its table and its C arrays, both of one stroke.

mod c_arrays;
mod csv;
mod points;

use std::io::Write;

use kinematics::Machine;

use crate::backend::{Backend, EncodeOptions, PenNumbers, PlanSource};
use crate::{Unrepresentable, WriteError};

/// The table.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PolarCsv;

/// The arrays of its program.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CArrays;

fn check(machine: &Machine) -> Result<(), Unrepresentable> {
    if machine.mechanism().kind() == "polar" {
        return Ok(());
    }
    let machine = machine.name().to_owned();
    Err(Unrepresentable::OtherMachine { wanted: "a rotating rail with a rack, such as polar", machine })
}

impl Backend for PolarCsv {
    fn name(&self) -> &'static str {
        csv::NAME
    }

    fn format_help(&self) -> Option<&'static str> {
        Some("The polar robot's table; one stroke")
    }

    fn check(&self, machine: &Machine) -> Result<(), Unrepresentable> {
        check(machine)
    }

    fn pens(&self) -> PenNumbers {
        PenNumbers::Dropped
    }

    fn needs_machine(&self) -> bool {
        true
    }

    fn write(
        &self,
        plan: &PlanSource<'_>,
        _options: &EncodeOptions,
        out: &mut dyn Write,
    ) -> Result<(), WriteError> {
        csv::write(plan.setpoints(self.name())?, out)
    }
}

impl Backend for CArrays {
    fn name(&self) -> &'static str {
        c_arrays::NAME
    }

    fn format_help(&self) -> Option<&'static str> {
        Some("The polar robot's points as C arrays; one stroke")
    }

    fn check(&self, machine: &Machine) -> Result<(), Unrepresentable> {
        check(machine)
    }

    fn pens(&self) -> PenNumbers {
        PenNumbers::Dropped
    }

    fn needs_machine(&self) -> bool {
        true
    }

    fn write(
        &self,
        plan: &PlanSource<'_>,
        _options: &EncodeOptions,
        out: &mut dyn Write,
    ) -> Result<(), WriteError> {
        c_arrays::write(plan.setpoints(self.name())?, out)
    }
}
