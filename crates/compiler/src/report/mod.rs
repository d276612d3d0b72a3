//! Reports: the result of a command, as types that serialize, and as [`text`].
//!
//! Every command reports with the same type, [`Report`], on success and on failure. `docs/reports.md`
//! and the JSON schema are generated from the types of this module; see [`page`].

mod build;
pub mod calibration;
mod certificate;
mod diff;
mod input;
mod machine;
pub mod page;
mod round;
mod sending;
pub mod simulation;
mod summary;
pub mod text;
pub mod tuning;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

pub use self::build::{BuiltOutput, BuiltState};
pub use self::certificate::{
    CertificateReport, DeviationReport, Distances, JerkReport, MotorReport, TickFloor,
};
pub use self::diff::{CauseReport, DiffReport, QuantityReport, StrokesReport};
pub use self::input::{
    DrawingReport, FactReport, MotorLimits, PageReport, PenReport, PlanReport, ProgramReport,
};
pub use self::machine::{
    ListedMachine, MachineMotor, MachineReport, MachineSource, SheetReport, WorkspaceReport,
};
pub use self::sending::{SendEnd, SendReport, SendUnit};
pub use self::summary::{BestPlaceReport, Ordering, Summary};

use crate::import::Diagnostic;
use crate::pipeline::Arranged;

/// Version of the form of reports. A key that is removed or changes its meaning or unit raises it; a
/// new key does not.
pub const SCHEMA_VERSION: u32 = 1;

/// The result of a command.
#[derive(Clone, Debug, Default, PartialEq, Serialize, JsonSchema)]
pub struct Report {
    /// Version of this form. It rises when a key is removed or changes its meaning or unit.
    pub schema_version: u32,
    /// The program and its version.
    pub program: String,
    /// The command, such as `convert` or `machine check`.
    pub command: String,
    /// The input files, as given; `-` is standard input.
    pub inputs: Vec<String>,
    /// The exit code of the program.
    pub exit_code: u8,
    /// Why the command failed; `null` if it did not.
    pub error: Option<ErrorReport>,
    /// Findings about the inputs and warnings, in the order in which they were found.
    pub diagnostics: Vec<Finding>,
    /// The drawing, from `check` and `info`.
    pub drawing: Option<DrawingReport>,
    /// A plan that was read, from `info`.
    pub plan: Option<PlanReport>,
    /// A G-code program that plotplan wrote, from `info`.
    pub program_file: Option<ProgramReport>,
    /// The files that were written, from `convert`, in the order of their names.
    pub outputs: Vec<OutputReport>,
    /// The plan that was computed, from `convert` with one output, and from `info` with a machine.
    pub summary: Option<Summary>,
    /// What the replay of a plan measured, from `convert` with one output, from `verify`, and from `info` with a machine.
    pub certificate: Option<CertificateReport>,
    /// Differences between a plan's header and the machine or drawing that it was verified with, in
    /// sentences; from `verify`.
    pub mismatches: Option<Vec<String>>,
    /// The machine, from `machine check`, and its verdict on a drawing from `check` with a machine.
    pub machine: Option<MachineReport>,
    /// The machines that can be named, from `machine list`.
    pub machines: Option<Vec<ListedMachine>>,
    /// Predicted ink compared with the drawing, from `simulate`.
    pub ink: Option<simulation::InkReport>,
    /// What motors and loop did, from `simulate`.
    pub simulation: Option<simulation::SimulationReport>,
    /// The response to a step, from `simulate --step`.
    pub step: Option<simulation::StepReport>,
    /// Gains and what each measure buys, from `tune`.
    pub tuning: Option<tuning::TuningReport>,
    /// The parameters of a motor, from `tune --from-step`.
    pub motor: Option<tuning::MotorEstimates>,
    /// What was found, from `calibrate`.
    pub calibration: Option<calibration::CalibrationReport>,
    /// What was sent, from `send`.
    pub sending: Option<SendReport>,
    /// What changed, from `diff`.
    pub diff: Option<DiffReport>,
    /// The outputs of a project, from `build`.
    pub built: Vec<BuiltOutput>,
}

/// A file that was written.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct OutputReport {
    /// The file, as given; `-` is standard output.
    pub file: String,
    /// The drawing, with `--format hpgl` and `svg`.
    pub drawing: Option<ArrangedReport>,
    /// The plan, with other formats.
    pub summary: Option<Summary>,
    /// The plan's certificate.
    pub certificate: Option<CertificateReport>,
}

/// A drawing as it was written.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct ArrangedReport {
    /// Number of strokes.
    pub strokes: usize,
    /// Length of the ink, mm.
    pub ink_mm: f64,
    /// The pens that draw, in the order of their numbers.
    pub pens: Vec<u16>,
    /// How far ink reaches beyond the sheet, mm; 0 if it does not.
    pub beyond_sheet_mm: f64,
    /// What ordering gained; `null` for the file's order.
    pub ordering: Option<Ordering>,
}

impl ArrangedReport {
    /// The report of a drawing. `by_time`: its order was found by time on a machine.
    pub fn of(arranged: &Arranged, by_time: bool) -> Self {
        let drawing = &arranged.drawing;
        Self {
            strokes: drawing.strokes.len(),
            ink_mm: round::mm(drawing.length()),
            pens: drawing.pens().iter().map(|pen| pen.0).collect(),
            beyond_sheet_mm: round::mm(arranged.beyond_sheet_mm),
            ordering: arranged.ordering.as_ref().map(|report| Ordering::of(report, by_time)),
        }
    }
}

/// A finding about an input, or a warning of the program.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Finding {
    /// The input file, as given; `null` for warnings that concern no place in a file.
    pub file: Option<String>,
    /// The stable name of the kind: `H0101` (HP-GL), `S0101` (SVG), or one of the codes above.
    pub code: String,
    /// `note`, `warning` or `error`.
    pub severity: String,
    /// What was found at the first place.
    pub message: String,
    /// What to do about it.
    pub help: Option<String>,
    /// How often it was found.
    pub count: u64,
    /// First byte of the first place, from 0.
    pub byte: Option<usize>,
    /// The byte after its last.
    pub end: Option<usize>,
    /// Line of the first place, from 1, in formats of lines.
    pub line: Option<usize>,
    /// Column of the first place, from 1, in formats of lines.
    pub column: Option<usize>,
    /// Number of the command at the first place, from 1, in HP-GL.
    pub command: Option<usize>,
    /// Position of the pen at the first place, mm, in HP-GL.
    pub pen_mm: Option<[f64; 2]>,
}

impl Finding {
    /// A finding in the file of this name.
    pub fn of(file: &str, diagnostic: &Diagnostic) -> Self {
        Self {
            file: Some(file.to_owned()),
            code: diagnostic.code.to_owned(),
            severity: diagnostic.severity.to_string(),
            message: diagnostic.message.clone(),
            help: diagnostic.help.clone(),
            count: diagnostic.count,
            byte: Some(diagnostic.span.start),
            end: Some(diagnostic.span.end),
            line: diagnostic.line_column.map(|[line, _]| line),
            column: diagnostic.line_column.map(|[_, column]| column),
            command: diagnostic.command,
            pen_mm: diagnostic.pen_mm.map(|position| position.map(round::mm)),
        }
    }

    /// A warning of the program.
    pub fn warning(code: Code, message: &str) -> Self {
        Self {
            code: code.name().to_owned(),
            severity: "warning".to_owned(),
            message: message.to_owned(),
            count: 1,
            ..Self::default()
        }
    }
}

/// Why a command failed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ErrorReport {
    /// The kind of failure.
    pub code: Code,
    /// The message, as on standard error.
    pub message: String,
    /// What to do about it, where that is not part of the message.
    pub help: Option<String>,
    /// Where; `null` for failures without a place.
    pub place: Option<Place>,
}

/// A place in an input file and on the machine.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Place {
    /// The file, as given.
    pub file: String,
    /// First byte, from 0.
    pub byte: Option<usize>,
    /// The byte after the last.
    pub end: Option<usize>,
    /// Line, from 1.
    pub line: Option<usize>,
    /// Stroke of the drawing in the file's order, from 1.
    pub stroke: Option<usize>,
    /// The stroke's pen.
    pub pen: Option<u16>,
    /// The point, mm in the machine's frame.
    pub point_mm: Option<[f64; 2]>,
}

impl Place {
    /// A stroke's place in its file, with the point on the machine.
    pub fn of_stroke(
        file: &str,
        span: drawing::Span,
        stroke: usize,
        pen: u16,
        point: drawing::Point,
    ) -> Self {
        Self {
            file: file.to_owned(),
            byte: Some(span.start),
            end: Some(span.end),
            line: None,
            stroke: Some(stroke + 1),
            pen: Some(pen),
            point_mm: Some([point.x, point.y].map(round::mm)),
        }
    }
}

/// An exit code and its meaning.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ExitCode {
    /// The code.
    pub code: u8,
    /// A word for it.
    pub name: &'static str,
    /// The meaning, the same for all commands.
    pub meaning: &'static str,
}

/// The exit codes of the program.
pub const EXIT_CODES: [ExitCode; 5] = [
    ExitCode {
        code: 0,
        name: "done",
        meaning: "the command did what was asked, and a plan that was verified holds",
    },
    ExitCode {
        code: 1,
        name: "refused",
        meaning: "an input (drawing, plan) cannot be used as asked: not a drawing, no ink, out of reach, \
                  verification failed, or a warning with --strict",
    },
    ExitCode { code: 2, name: "invalid request", meaning: "the command line or the machine file is wrong" },
    ExitCode {
        code: 3,
        name: "input or output failed",
        meaning: "a file or port cannot be read or written, or the machine does not answer",
    },
    ExitCode { code: 130, name: "interrupted", meaning: "Ctrl-C or a termination request while sending" },
];

macro_rules! codes {
    ($($variant:ident $name:literal $exit:literal $meaning:literal)*) => {
        /// The kind of a failure or warning.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
        #[serde(rename_all = "kebab-case")]
        pub enum Code {
            $(#[doc = $meaning] $variant,)*
        }

        impl Code {
            /// All kinds, in the order of their exit codes.
            pub const ALL: &[Self] = &[$(Self::$variant),*];

            /// The stable name, as serialized.
            pub fn name(self) -> &'static str {
                match self { $(Self::$variant => $name),* }
            }

            /// The exit code of a failure of this kind; 0 for kinds that are warnings only.
            pub fn exit_code(self) -> u8 {
                match self { $(Self::$variant => $exit),* }
            }

            /// The meaning, as a sentence.
            pub fn meaning(self) -> &'static str {
                match self { $(Self::$variant => $meaning),* }
            }
        }
    };
}

codes! {
    SeveralPages "several-pages" 0 "The file has several pages, and one of them was used."
    BeyondSheet "beyond-sheet" 0 "Ink reaches beyond the sheet."
    FormatLoss "format-loss" 0 "The output format or the machine does not carry something that the plan has."
    PlanMismatch "plan-mismatch" 0 "A plan states something else than the machine or drawing that it is verified with."
    MotionOnly "motion-only" 0 "Only the motion was verified: no drawing was given."
    SheetNotReached "sheet-not-reached" 0 "The machine cannot draw on all of its sheet."
    LostBytes "lost-bytes" 0 "The emulated controller lost bytes because its buffer was full."
    PenMissing "pen-missing" 0 "No stroke has a pen that an option names."
    PenColors "pen-colors" 0 "Several drawings give a pen different colours."
    UnstableLoop "unstable-loop" 0 "The feedback loop of a motor is unstable."
    Foreign "foreign" 1 "The input is no drawing that is read, or not a drawing at all."
    NotAPlan "not-a-plan" 1 "The input is no plan, or a plan that is damaged or truncated."
    NoInk "no-ink" 1 "The drawing has no ink."
    OutOfReach "out-of-reach" 1 "A stroke leaves the reach of the machine."
    NoPlacement "no-placement" 1 "No placement of the drawing fits the sheet and the machine."
    TooLong "too-long" 1 "The plan would have too many rows."
    Format "format" 1 "The output format or the machine cannot represent the plan."
    OverLimit "over-limit" 1 "The plan exceeds the limits of the motors."
    Verification "verification" 1 "The certificate does not hold."
    InkError "ink-error" 1 "Predicted ink strays or is missed by more than --within allows."
    Undetermined "undetermined" 1 "A record does not determine all parameters of a motor."
    Differs "differs" 1 "Two files differ, and --exit-code was given."
    Build "build" 1 "Outputs of a project could not be made, or are not what it makes."
    Strict "strict" 1 "There was a warning, and --strict was given."
    Drawing "drawing" 1 "The drawing or plan cannot be used for another reason, which the message states."
    Usage "usage" 2 "The command line is wrong."
    MachineFile "machine-file" 2 "The machine file is wrong."
    Io "io" 3 "A file or port cannot be read or written, or the machine does not answer."
    Interrupted "interrupted" 130 "Interrupted by the user."
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn code_names_are_those_serialized_and_exit_codes_are_listed() {
        for code in Code::ALL {
            assert_eq!(serde_json::to_value(code).unwrap(), code.name());
            assert!(EXIT_CODES.iter().any(|exit| exit.code == code.exit_code()), "{code:?}");
        }
    }
}
