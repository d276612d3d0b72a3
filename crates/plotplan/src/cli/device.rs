//! Options of the machine on the port: sending, emulation, the pen of the firmware.

use std::sync::LazyLock;

use backends::{Backend, EncodeOptions, PenActuator};
use clap::builder::PossibleValue;
use clap::{Args, ValueEnum};

#[cfg(unix)]
use super::values::fault;
use super::values::{name, positions, time};

/// How firmware formats move the pen.
#[derive(Clone, Copy, Debug, Args)]
pub(crate) struct PenLift {
    /// For G-code: what moves the pen. For ebb: `servo` uses S2 instead of SP
    #[arg(long, value_name = "HOW", value_enum)]
    pub(crate) pen_by: Option<PenBy>,
    /// Positions with the pen up and down: S or degrees of a servo, mm of Z (such as 5,-0.5), 1/12 microseconds for
    /// ebb
    #[arg(long, value_name = "UP,DOWN", value_parser = positions, allow_hyphen_values = true)]
    pub(crate) pen_positions: Option<(f64, f64)>,
}

/// What moves the pen.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum PenBy {
    /// A servo
    Servo,
    /// The Z axis
    Z,
}

impl PenLift {
    /// Why the positions cannot be used: only the Z axis takes fractions and numbers below 0.
    pub(crate) fn wrong_positions(self) -> Option<String> {
        let (up, down) = self.pen_positions?;
        let is_whole = |value: f64| value.fract() == 0.0 && value >= 0.0;
        (self.pen_by != Some(PenBy::Z) && !(is_whole(up) && is_whole(down))).then(|| {
            format!(
                "--pen-positions {up},{down}: a servo takes whole numbers from 0; with --pen-by z they are mm"
            )
        })
    }

    /// The same for an encoder.
    pub(crate) fn encode_options(self) -> EncodeOptions {
        let pen_actuator = self.pen_by.map(|by| match by {
            PenBy::Servo => PenActuator::Servo,
            PenBy::Z => PenActuator::Z,
        });
        EncodeOptions { pen_actuator, pen_positions: self.pen_positions, legacy_moves: false, spare_mm: 0.0 }
    }
}

/// How the machine's start pose is found.
#[derive(Clone, Copy, Debug, Args)]
pub(crate) struct Datum {
    /// Home first, as `[homing]` of the machine file states
    #[arg(long, conflicts_with = "assume_homed")]
    pub(crate) home: bool,
    /// Take the machine's start pose for granted, though it has `[homing]` and does not know where it is
    #[arg(long)]
    pub(crate) assume_homed: bool,
}

#[derive(Debug, Args)]
pub(crate) struct Send {
    /// Plan to send, or for gcode, xy-serial, hpgl and raw a file in the machine's own language; `-` for standard input
    #[arg(value_parser = name())]
    pub(crate) plan: String,
    /// Serial device, pseudo-terminal, or tcp:HOST:PORT
    #[arg(short, long, value_name = "PATH", required_unless_present = "dry_run", value_parser = name())]
    pub(crate) port: Option<String>,
    /// Protocol of the machine
    #[arg(long, value_enum)]
    pub(crate) protocol: Protocol,
    /// Speed of the port
    #[arg(long, value_name = "BAUD", default_value_t = 115_200)]
    pub(crate) baud: u32,
    /// Flow control of the port; for hpgl also set on the plotter, which is asked for the room in its buffer either way
    #[arg(long, value_enum, default_value_t = Flow::None)]
    pub(crate) flow: Flow,
    /// For hpgl: the plotter, by name or by a file with its limits [default: as it answers OI]
    #[arg(long, value_name = "NAME|FILE.toml")]
    pub(crate) plotter: Option<String>,
    /// Resume from this row of the plan (for hpgl: after this stroke): where it was stopped, or where a sync line is
    #[arg(long, value_name = "ROW")]
    pub(crate) from: Option<u64>,
    /// Print every line with its time and send nothing
    #[arg(long)]
    pub(crate) dry_run: bool,
    /// Write everything sent and received to this file
    #[arg(long, value_name = "FILE")]
    pub(crate) log: Option<String>,
    /// For ticks: lines in transit at most [default: as the machine's buffer allows]. For gcode: size of the machine's receive buffer, bytes [default: 127]
    #[arg(long, value_name = "N")]
    pub(crate) window: Option<usize>,
    /// For paced: time by which lines are sent early
    #[arg(long, value_name = "TIME", default_value = "200ms", value_parser = time)]
    pub(crate) lead: f64,
    /// How long to wait for a lost port to return
    #[arg(long, value_name = "TIME", default_value = "60s", value_parser = time)]
    pub(crate) reconnect: f64,
    /// The machine, where the plan only knows its name and it is no preset
    #[arg(short, long, value_name = "NAME|FILE.toml", value_parser = name())]
    pub(crate) machine: Option<String>,
    #[command(flatten)]
    pub(crate) datum: Datum,
    /// For ebb: SM moves, which every firmware version executes
    #[arg(long)]
    pub(crate) stepper_moves: bool,
    #[command(flatten)]
    pub(crate) pen: PenLift,
}

#[derive(Debug, Args)]
pub(crate) struct Jog {
    /// Serial device, pseudo-terminal, or tcp:HOST:PORT
    #[arg(short, long, value_name = "PATH", value_parser = name())]
    pub(crate) port: String,
    /// Protocol of the machine; it must report its position: ticks, gcode, ebb
    #[arg(long, value_enum)]
    pub(crate) protocol: Protocol,
    /// The machine
    #[arg(short, long, value_name = "NAME|FILE.toml", value_parser = name())]
    pub(crate) machine: String,
    /// Speed of the port
    #[arg(long, value_name = "BAUD", default_value_t = 115_200)]
    pub(crate) baud: u32,
    /// Take commands from a file instead of the keyboard, one a line; `-` for standard input
    #[arg(long, value_name = "FILE", value_parser = name())]
    pub(crate) commands: Option<String>,
    /// Append touches to this file, for calibrate
    #[arg(long, value_name = "FILE.csv", value_parser = name())]
    pub(crate) touches: Option<String>,
    /// Write everything sent and received to this file
    #[arg(long, value_name = "FILE")]
    pub(crate) log: Option<String>,
    #[command(flatten)]
    pub(crate) datum: Datum,
    #[command(flatten)]
    pub(crate) pen: PenLift,
}

/// How to talk to a machine: a backend that has a protocol.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Protocol(pub(crate) &'static dyn Backend);

impl ValueEnum for Protocol {
    fn value_variants<'a>() -> &'a [Self] {
        static ALL: LazyLock<Vec<Protocol>> = LazyLock::new(|| {
            let all = backends::ALL.iter().copied();
            all.filter(|backend| backend.protocol().is_some()).map(Protocol).collect()
        });
        &ALL
    }

    fn to_possible_value(&self) -> Option<PossibleValue> {
        self.0.protocol().map(|(name, help)| PossibleValue::new(name).help(help))
    }
}

/// A machine that can be emulated: a backend that has an emulator.
#[cfg(unix)]
#[derive(Clone, Copy, Debug)]
pub(crate) struct Emulated(pub(crate) &'static dyn Backend);

#[cfg(unix)]
impl ValueEnum for Emulated {
    fn value_variants<'a>() -> &'a [Self] {
        static ALL: LazyLock<Vec<Emulated>> = LazyLock::new(|| {
            let all = backends::ALL.iter().copied();
            all.filter(|backend| backend.emulator_help().is_some()).map(Emulated).collect()
        });
        &ALL
    }

    fn to_possible_value(&self) -> Option<PossibleValue> {
        let (name, _) = self.0.protocol()?;
        self.0.emulator_help().map(|help| PossibleValue::new(name).help(help))
    }
}

/// Flow control of a port.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Flow {
    /// None
    None,
    /// RTS and CTS
    Hardware,
    /// XON and XOFF
    Software,
}

#[cfg(unix)]
#[derive(Debug, Args)]
pub(crate) struct Emulate {
    /// Machine to emulate
    #[arg(long, value_enum)]
    pub(crate) protocol: Emulated,
    /// Symbolic link to make to the pseudo-terminal; its name is printed either way
    #[arg(long, value_name = "PATH")]
    pub(crate) link: Option<String>,
    /// Picture to write at the end, of what was drawn
    #[arg(long, value_name = "OUT.svg")]
    pub(crate) svg: Option<String>,
    /// Table to write at the end, of what was drawn: line, pen, and position in the machine's own units
    #[arg(long, value_name = "OUT.csv")]
    pub(crate) ink: Option<String>,
    /// For ticks and ebb: the machine, for the motors' start and the picture
    #[arg(short, long, value_name = "NAME|FILE.toml", value_parser = name())]
    pub(crate) machine: Option<String>,
    /// Fault to inject: lost-answer=N, late-answer=N:TIME, garbled-answer=N, full-buffer=AT:TIME, unplugged=AT:TIME, garbled-byte=N, held=AT:TIME, power-cut=AT, limit=AT, switch-broken=N, switch-stuck=N
    #[arg(long, value_name = "FAULT", value_parser = fault)]
    pub(crate) fault: Vec<backends::Fault>,
    /// Run this many times faster than real time
    #[arg(long, alias = "haste", value_name = "FACTOR", default_value_t = 1.0)]
    pub(crate) speedup: f64,
    /// End when nothing was received for this time, after something was; by the emulated clock
    #[arg(long, alias = "rest", value_name = "TIME", value_parser = time)]
    pub(crate) idle_timeout: Option<f64>,
    /// For ticks: size of the receive buffer [default: 512]
    #[arg(long, value_name = "BYTES")]
    pub(crate) buffer: Option<usize>,
    /// For ticks: announce the room in the receive buffer in the answer to line 0
    #[arg(long)]
    pub(crate) announce_room: bool,
    /// Homed before: xy-serial, and machines with `[homing]`
    #[arg(long)]
    pub(crate) homed: bool,
}
