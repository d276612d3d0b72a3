//! What every backend offers: the trait, and what is passed in and out.

use std::fmt;
use std::io::Write;
use std::sync::Arc;

use drawing::Drawing;
use kinematics::{Machine, Play};
use plan::{Header, Row, TickTable};

use crate::device::Device;
use crate::homing::{EmulatedHoming, HomingSteps};
use crate::pen_plotter::plotter::{Handshake, Plotter};
use crate::program::{Program, ProgramError};
use crate::session::Session;
use crate::status::StatusProtocol;
use crate::{Setpoint, Unrepresentable, WriteError};

/// A firmware or program that plans are encoded for, and in most cases sent to.
///
/// `Debug` prints the name.
pub trait Backend: fmt::Debug + Send + Sync {
    /// Its name: that of the format where it has one, otherwise that of the protocol.
    fn name(&self) -> &'static str;

    /// One line of help, if `convert --format` writes it.
    fn format_help(&self) -> Option<&'static str> {
        None
    }

    /// Name and one line of help, if `send --protocol` has it.
    fn protocol(&self) -> Option<(&'static str, &'static str)> {
        None
    }

    /// One line of help, if it can be emulated; the name is the protocol's.
    fn emulator_help(&self) -> Option<&'static str> {
        None
    }

    /// Whether it is for machines of this kind.
    ///
    /// # Errors
    /// What kind it is for.
    fn check(&self, _machine: &Machine) -> Result<(), Unrepresentable> {
        Ok(())
    }

    /// What [`crate::Line::row`] counts, in messages.
    fn row_name(&self) -> &'static str {
        "row"
    }

    /// What becomes of the pens' numbers.
    fn pens(&self) -> PenNumbers;

    /// Other information that is lost, or a setting that does not suit the firmware.
    fn caveat(&self, _header: &Header) -> Option<String> {
        None
    }

    /// What of this machine a file in the format does not carry.
    fn file_caveat(&self, _machine: &Machine) -> Option<Loss> {
        None
    }

    /// What the format cannot carry of a plan with these pens.
    fn losses(&self, header: &Header, pens: &[u16]) -> Vec<Loss> {
        let pens = match self.pens() {
            numbers if pens.len() > 1 && numbers != PenNumbers::Sent => {
                Some(Loss::Pens { pens: pens.to_vec(), numbers })
            }
            _ => None,
        };
        pens.into_iter().chain(self.caveat(header).map(Loss::Caveat)).collect()
    }

    /// Whether [`Self::program`] needs the machine's kinematics.
    fn needs_machine(&self) -> bool {
        false
    }

    /// The program that is sent for a plan.
    ///
    /// # Errors
    /// A plan that the firmware cannot execute; a backend that has no session.
    fn program(&self, _plan: &PlanSource<'_>, _options: &EncodeOptions) -> Result<Program, ProgramError> {
        Err(Unrepresentable::NotSent { format: self.name() }.into())
    }

    /// A program from a file in the machine's own language; `None` if plans alone are sent.
    fn parse_program(&self, _file: &[u8]) -> Option<Program> {
        None
    }

    /// Writes a plan as a file.
    ///
    /// # Errors
    /// A plan that the format cannot represent, before anything is written; an error of the writer.
    fn write(
        &self,
        _plan: &PlanSource<'_>,
        _options: &EncodeOptions,
        _out: &mut dyn Write,
    ) -> Result<(), WriteError> {
        Err(Unrepresentable::NotWritten { format: self.name() }.into())
    }

    /// What the user should know of the file that [`Self::write`] makes of this plan: lines of text.
    fn remarks(&self, _plan: &PlanSource<'_>, _options: &EncodeOptions) -> Vec<String> {
        Vec::new()
    }

    /// Why a program cannot be sent, as far as that is known before the machine is asked.
    fn fault(&self, _program: &Program, _options: &SessionOptions) -> Option<String> {
        None
    }

    /// A session that sends a program, if the backend has a protocol.
    fn session(&self, _program: Program, _options: &SessionOptions) -> Option<Box<dyn Session>> {
        None
    }

    /// How long before its time a line is sent, of the lead asked for: 0 where the machine's answers set the pace.
    fn lead_us(&self, _wanted_us: u64) -> u64 {
        0
    }

    /// Position reports, if the machine can be asked where it is.
    fn status(&self) -> Option<Box<dyn StatusProtocol>> {
        None
    }

    /// The program that lifts or lowers the pen where the machine stands, for a plan of rows that rest there.
    ///
    /// # Errors
    /// A backend without sessions or positions.
    fn pen_program(
        &self,
        _plan: &PlanSource<'_>,
        _options: &EncodeOptions,
        _down: bool,
    ) -> Result<Program, ProgramError> {
        Err(Unrepresentable::NotSent { format: self.name() }.into())
    }

    /// The program for rows that go on from where the machine stands: before them the pen is as in the first
    /// row, and after them as in the last one. `start` is where the motors of the machine's first plan started,
    /// ticks.
    ///
    /// # Errors
    /// As [`Self::program`].
    fn continuing_program(
        &self,
        _plan: &PlanSource<'_>,
        _options: &EncodeOptions,
        _start: [i64; 2],
    ) -> Result<Program, ProgramError> {
        Err(Unrepresentable::NotSent { format: self.name() }.into())
    }

    /// The steps that home this machine through its firmware; `None` where it cannot, and where the machine's
    /// homing is a pose that a person sets.
    fn homing(&self, _machine: &Machine) -> Option<HomingSteps> {
        None
    }

    /// Whether the machine homes itself when it is switched on, before it takes anything.
    fn homes_itself(&self) -> bool {
        false
    }

    /// Whether a position that the machine reports proves that it was homed.
    fn knows_datum(&self) -> bool {
        false
    }

    /// An emulated machine.
    fn emulator(&self, _options: &EmulatorOptions) -> Option<Box<dyn Device>> {
        None
    }

    /// The frame of the ink that the emulated machine draws.
    fn ink_frame(&self) -> InkFrame {
        InkFrame::Ticks
    }
}

/// What becomes of the pens' numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PenNumbers {
    /// The machine receives them.
    Sent,
    /// The machine pauses for a pen change.
    Pause,
    /// All strokes are drawn with the same pen.
    Dropped,
}

/// Something that a format cannot carry.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Loss {
    /// The pens' numbers.
    Pens {
        /// The plan's pens.
        pens: Vec<u16>,
        /// What becomes of them.
        numbers: PenNumbers,
    },
    /// Anything else, as a sentence.
    Caveat(String),
}

impl fmt::Display for Loss {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Pens { pens, numbers } => {
                let pens: Vec<String> = pens.iter().map(u16::to_string).collect();
                let what = match numbers {
                    PenNumbers::Pause => "the machine pauses (M0) for each pen change",
                    PenNumbers::Sent => "the machine receives their numbers",
                    PenNumbers::Dropped => {
                        "this firmware has no pen numbers, all strokes are drawn with the same pen"
                    }
                };
                write!(f, "pens {}: {what}", pens.join(", "))
            }
            Self::Caveat(what) => f.write_str(what),
        }
    }
}

/// An iterator over rows with their exact motor positions, ticks.
pub type RowIter<'a> = Box<dyn Iterator<Item = (Row, [f64; 2])> + 'a>;

/// A plan as backends see it.
#[derive(Clone, Copy)]
pub struct PlanSource<'a> {
    header: &'a Header,
    machine: Option<&'a Machine>,
    rows: &'a (dyn Fn() -> RowIter<'a> + 'a),
    drawing: Option<&'a Drawing>,
}

impl fmt::Debug for PlanSource<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("PlanSource").field("header", self.header).finish_non_exhaustive()
    }
}

impl<'a> PlanSource<'a> {
    /// Rows without a machine: enough for encoders of motor positions.
    pub fn new(header: &'a Header, rows: &'a (dyn Fn() -> RowIter<'a> + 'a)) -> Self {
        Self { header, machine: None, rows, drawing: None }
    }

    /// With the machine, for encoders of joints or pen positions.
    pub fn on_machine(self, machine: &'a Machine) -> Self {
        Self { machine: Some(machine), ..self }
    }

    /// With the drawing in machine mm, strokes in drawing order, for encoders of paths.
    pub fn of_drawing(self, drawing: &'a Drawing) -> Self {
        Self { drawing: Some(drawing), ..self }
    }

    /// The plan's header.
    pub fn header(&self) -> &'a Header {
        self.header
    }

    /// The rows.
    pub fn rows(&self) -> impl Iterator<Item = Row> + use<'a> {
        (self.rows)().map(|(row, _)| row)
    }

    /// The rows as a table.
    pub fn table(&self) -> TickTable {
        TickTable { header: self.header.clone(), rows: self.rows().collect() }
    }

    /// The machine.
    ///
    /// # Errors
    /// When none is known.
    pub fn machine(&self, format: &'static str) -> Result<&'a Machine, Unrepresentable> {
        self.machine.ok_or(Unrepresentable::NoMachine { format })
    }

    /// The drawing.
    ///
    /// # Errors
    /// When the plan was read from a file.
    pub fn drawing(&self, format: &'static str) -> Result<&'a Drawing, Unrepresentable> {
        self.drawing.ok_or(Unrepresentable::NoDrawing { format })
    }

    /// The rows with joints and pen positions.
    ///
    /// # Errors
    /// When no machine is known.
    pub fn setpoints(
        &self,
        format: &'static str,
    ) -> Result<impl Iterator<Item = Setpoint> + use<'a>, Unrepresentable> {
        let machine = self.machine(format)?;
        Ok((self.rows)().map(move |(row, exact)| Setpoint::new(machine, row, exact)))
    }
}

/// What moves the pen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PenActuator {
    /// A servo.
    Servo,
    /// The Z axis.
    Z,
}

/// How a program is encoded.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct EncodeOptions {
    /// What moves the pen; the firmware's own default if `None`.
    pub pen_actuator: Option<PenActuator>,
    /// Positions with the pen up and down, in the unit of the firmware: mm of the Z axis,
    /// whole units of a servo. Its own default if `None`.
    pub pen_positions: Option<(f64, f64)>,
    /// Moves that every version of the firmware executes.
    pub legacy_moves: bool,
    /// What chords of the plan's path may deviate from it, mm: the part of the tolerance that the plan leaves.
    pub spare_mm: f64,
}

/// How a program is sent.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SessionOptions {
    /// For pen plotters: the plotter; by its own answer if `None`.
    pub plotter: Option<Arc<Plotter>>,
    /// For pen plotters: how the buffer is kept from overflowing; by polling if `None`.
    pub handshake: Option<Handshake>,
    /// Lines or bytes in transit at most; the session's own limit if `None`.
    pub window: Option<usize>,
    /// How long before its time a line is sent, where the sender keeps the plan's time, microseconds.
    pub lead_us: u64,
}

/// How an emulated machine begins.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct EmulatorOptions {
    /// Where its motors are, ticks; `None` if it does not know.
    pub start: Option<[i64; 2]>,
    /// The play of its motors, from where they start; `None` for a machine without backlash, and for a firmware
    /// whose positions are those of the pen.
    pub play: Option<Play>,
    /// Whether it was homed before.
    pub homed: bool,
    /// How long homing takes it; `None` for a machine without `[homing]`, which knows where it is.
    pub homing: Option<EmulatedHoming>,
    /// A machine that acknowledges before it arrives does so within this distance, mm; 0 for an ideal one.
    pub answers_within_mm: f64,
    /// Size of the receive buffer, bytes, of a machine that may have another than its own.
    pub buffer: Option<usize>,
    /// Whether it announces the room in its receive buffer.
    pub announces_room: bool,
}

/// The frame of an emulated machine's ink.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum InkFrame {
    /// Absolute motor positions, ticks.
    Ticks,
    /// Motor positions since the machine was switched on, ticks.
    TicksFromStart,
    /// Pen positions in machine mm with this many decimals.
    Millimetres(u8),
    /// Pen positions in plotter units of 0.025 mm.
    PlotterUnits,
}
