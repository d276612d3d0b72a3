//! An emulated machine for the page's end of a wire: to rehearse a plan without a machine.

use std::fmt;

use backends::homing::EmulatedHoming;
use backends::{Device, EmulatorOptions};
use serde::Deserialize;
use serde_json::{Value, json};

use crate::job::MachineChoice;
use crate::problem::{About, Problem, Problems};
use crate::sending::backend_of;

/// Which machine is emulated: the options of `plotplan emulate`.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct EmulateJob {
    /// `--protocol`
    pub protocol: String,
    /// `--machine`
    pub machine: MachineChoice,
    /// `--homed`
    pub homed: bool,
}

/// A machine that behaves on its wire as its firmware does.
pub struct Emulated {
    device: Box<dyn Device>,
}

impl fmt::Debug for Emulated {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Emulated").finish_non_exhaustive()
    }
}

impl Emulated {
    /// A machine that has just been switched on.
    ///
    /// # Errors
    /// A protocol without an emulated machine; what is wrong with the machine file.
    pub fn new(job: &EmulateJob) -> Result<Self, Problems> {
        let (_, machine) = job.machine.read()?;
        let ticks = machine.motor_positions(&machine.start());
        let homing = machine.parts().homing.as_ref();
        let options = EmulatorOptions {
            start: Some([ticks[0].round() as i64, ticks[1].round() as i64]),
            homed: job.homed,
            homing: homing.map(|homing| EmulatedHoming::of(homing, None)),
            ..EmulatorOptions::default()
        };
        let device = backend_of(&job.protocol)?.emulator(&options);
        let what = || Problem::new(About::Option, format!("{} has no emulated machine", job.protocol));
        Ok(Self { device: device.ok_or_else(what)? })
    }

    /// Bytes that the machine receives; its answers, and for the page when it next does something (`wake_us`), how many
    /// bytes were lost and how many lines of ink it has drawn.
    pub fn step(&mut self, now_us: u64, received: &[u8]) -> (Value, Vec<u8>) {
        if received.is_empty() {
            self.device.advance(now_us);
        } else {
            self.device.receive(received, now_us);
        }
        let answers = self.device.answers().concat();
        let json = json!({
            "wake_us": self.device.wake_us(),
            "lost_bytes": self.device.lost_bytes(),
            "ink": self.device.ink().lines().len(),
            "pen_is_down": self.device.pen_is_down(),
        });
        (json, answers)
    }

    /// The wire is unplugged: bytes in transit are lost.
    pub fn unplug(&mut self) {
        self.device.disconnect();
    }

    /// The ink, as `emulate --ink` writes it.
    pub fn ink(&self) -> String {
        ink_text(self.device.ink())
    }
}

/// A line for each position: number of the line of ink, pen, position.
pub(crate) fn ink_text(ink: &backends::Ink) -> String {
    let lines = ink.lines();
    let rows = lines
        .iter()
        .enumerate()
        .flat_map(|(line, (pen, places))| places.iter().map(move |[x, y]| format!("{line},{pen},{x},{y}\n")));
    std::iter::once("line,pen,x,y\n".to_owned()).chain(rows).collect()
}
