//! The arguments of the command line.

mod device;
mod format;
mod ink;
mod project;
mod reading;
mod studio;
mod values;

use std::path::Path;

use backends::pen_plotter::plotter::Plotter;
use clap::parser::ValueSource;
use clap::{ArgMatches, Args, CommandFactory as _, Parser, Subcommand, ValueEnum};
use clap_complete::Shell;

#[cfg(unix)]
pub(crate) use device::Emulate;
pub(crate) use device::{Datum, Flow, Jog, PenLift, Send};
pub(crate) use format::{Format, markdown as format_page};
pub(crate) use ink::{InkColor, with_ink_color};
pub(crate) use project::{Build, Diff, Init};
pub(crate) use reading::{PageChoice, Reading, TextForm};
pub(crate) use studio::Studio;
use values::{align, angle, length, name, pen, place, scale, ticks, time};

/// Compiles pen-plotter drawings (HPGL, HP-GL/2, SVG) to motor motion.
///
/// `plotplan convert drawing.hpgl --machine coaxial` writes the plan to standard output: a table of motor ticks against
/// time, certified to draw the drawing within a tolerance and inside the motors' limits.
#[derive(Debug, Parser)]
#[command(name = "plotplan", version = env!("PLOTPLAN_VERSION"), max_term_width = 100, after_help = exit_codes())]
pub(crate) struct Arguments {
    #[command(subcommand)]
    pub(crate) command: Command,
    #[command(flatten)]
    pub(crate) messages: Messages,
}

/// How every command reports.
#[derive(Clone, Debug, Args)]
#[command(next_help_heading = "Messages")]
pub(crate) struct Messages {
    /// How to report: `json` is one object on the last line, also on failure (docs/reports.md)
    #[arg(long, value_enum, global = true, default_value_t = ReportForm::Text)]
    pub(crate) report: ReportForm,
    /// How to write diagnostics, warnings and errors to standard error
    #[arg(long, value_enum, global = true, value_name = "FORM", default_value_t = MessageFormat::Human)]
    pub(crate) message_format: MessageFormat,
    /// Print errors only
    #[arg(short, long, global = true)]
    pub(crate) quiet: bool,
    /// Print all diagnostics, not only the first five of a kind
    #[arg(long, global = true)]
    pub(crate) all: bool,
    /// Colour in messages; `auto` is colour on a terminal, unless `NO_COLOR` is set
    #[arg(long, value_enum, global = true, value_name = "WHEN", default_value_t = Color::Auto)]
    pub(crate) color: Color,
}

/// When messages have colour.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Color {
    /// On a terminal, unless `NO_COLOR` is set
    Auto,
    /// Always
    Always,
    /// Never
    Never,
}

impl Arguments {
    /// Options that stand for others: with `--format hpgl`, `--plotter` is the plotter to write for.
    pub(crate) fn settle(&mut self) {
        match &mut self.command {
            Command::Convert(convert) => convert.settle(),
            Command::Diff(diff) if diff.json => self.messages.report = ReportForm::Json,
            _ => {}
        }
    }
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Turn a drawing into a plan for a machine, or into a clean drawing
    Convert(Convert),
    /// Report problems in a drawing file, and whether a machine can draw it
    Check(Check),
    /// Lengths, pens, bounds, duration of a drawing or a plan
    Info(Info),
    /// Recompute a plan's certificate
    Verify(Verify),
    /// Draw a picture of a drawing or a plan on its machine
    Preview(Preview),
    /// Predict what a machine's motors and feedback loop draw
    Simulate(Simulate),
    /// Find the gains of a machine's feedback loop, or its motor's parameters from a recorded step
    Tune(Tune),
    /// Find a machine's start pose, lengths and counts from touched corners or measured marks
    Calibrate(Calibrate),
    /// Send a plan to a machine
    Send(Send),
    /// Move a machine by hand: keys in a full screen, or a script
    Jog(Jog),
    /// Make the plans of a project, `plotplan.toml`, that are out of date
    Build(Build),
    /// Write a project file for a folder of drawings
    Init(Init),
    /// Compare two plans, drawings or machine files, in any mix
    Diff(Diff),
    /// Serve the page that sketches, places and plans drawings in the browser
    Studio(Studio),
    /// Emulate a controller on a pseudo-terminal
    #[cfg(unix)]
    #[command(alias = "device")]
    Emulate(Emulate),
    /// List, show and check machines
    #[command(subcommand)]
    Machine(Machine),
    /// Explain a diagnostic's code
    Explain(Explain),
    /// Print the JSON schema of reports (--report json), or of machine files
    Schema(Schema),
    /// Print a completion script for a shell
    Completions(Completions),
    /// Print the manual page of plotplan or of one of its commands
    Man(Man),
}

#[derive(Debug, Args)]
pub(crate) struct Convert {
    /// Drawings to read; `-` for standard input. Several are drawn over each other in one frame, or converted one by one
    /// if --output is a folder
    #[arg(required = true, value_name = "FILE", value_parser = name())]
    pub(crate) files: Vec<String>,
    /// Machine: a preset's name (see `plotplan machine list`) or a machine file
    #[arg(short, long, value_name = "NAME|FILE.toml", value_parser = name())]
    pub(crate) machine: Option<String>,
    /// Where to write; `-` for standard output. A folder takes one file for each drawing. In a name, `%f` stands for the
    /// drawing's name without extension, `%p` for the page (or the pen, with --split pens only), `%n` for the pen
    #[arg(short, long, value_name = "OUT", default_value = "-", value_parser = name())]
    pub(crate) output: String,
    /// Write one file for each pen
    #[arg(long, value_enum)]
    pub(crate) split: Option<Split>,
    /// Output format; `hpgl` and `svg` write the normalized drawing and need no machine [default: by the extension of
    /// --output, else ticks]
    #[arg(short, long, value_enum)]
    pub(crate) format: Option<Format>,
    /// With `--format hpgl`: write encoded polylines (PE) of HP-GL/2
    #[arg(long)]
    pub(crate) hpgl2: bool,
    /// The plotter and paper to write for, of `--plotter` and `--paper`.
    #[arg(skip)]
    pub(crate) target: Option<(String, Option<String>)>,
    #[command(flatten)]
    pub(crate) pen: PenLift,
    #[command(flatten)]
    pub(crate) planning: Planning,
    #[command(flatten)]
    pub(crate) reading: Reading,
}

impl Convert {
    fn settle(&mut self) {
        let is_hpgl = matches!(self.format(), Ok(Format::Hpgl));
        if let Some(name) = self.reading.plotter.take_if(|name| is_hpgl && is_target(name)) {
            self.target = Some((name, self.reading.paper.take()));
        }
    }

    /// The format asked for, by name or by the extension of the output.
    pub(crate) fn format(&self) -> Result<Format, String> {
        let of_extension = || Format::of_extension(&self.output);
        match (self.format, of_extension()) {
            (None, by_extension) => Ok(by_extension.unwrap_or_default()),
            (Some(format), Some(by_extension)) if format.contradicts(by_extension) => {
                Err(format!("--format {} contradicts the extension of {}", format.name(), self.output))
            }
            (Some(format), _) => Ok(format),
        }
    }
}

/// Whether `--plotter` names a plotter to write for, and not only one to read files of.
pub(crate) fn is_target(name: &str) -> bool {
    let is_file = Path::new(name).extension().is_some_and(|extension| extension.eq_ignore_ascii_case("toml"));
    is_file || Plotter::named(name).is_ok()
}

/// What each file holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Split {
    /// The strokes of one pen
    Pens,
}

/// How diagnostics are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum MessageFormat {
    /// With a window of the file
    Human,
    /// One line each, with file, byte, severity, code and message
    Short,
    /// One JSON object a line
    Json,
}

/// How a plan is made.
#[expect(clippy::struct_excessive_bools, reason = "a flag of the command line is a bool")]
#[derive(Debug, Args)]
pub(crate) struct Planning {
    /// Largest distance between drawing and pen, before rounding to ticks
    #[arg(long, value_name = "LENGTH", default_value = "0.1mm", value_parser = length)]
    pub(crate) tolerance: f64,
    /// Time between rows [default: the machine's]
    #[arg(long, value_name = "TIME", value_parser = time)]
    pub(crate) period: Option<f64>,
    /// Order of the strokes [default: optimize; for --format hpgl and svg: file]
    #[arg(long, value_enum)]
    pub(crate) order: Option<Order>,
    /// Effort, from 0 to 3: of the ordering; with 0 the smoothest paths are planned instead of the
    /// fastest
    #[arg(long, value_name = "LEVEL", default_value_t = 2, value_parser = clap::value_parser!(u8).range(0..=3))]
    pub(crate) effort: u8,
    /// Remove duplicate strokes
    #[arg(long)]
    pub(crate) dedupe: bool,
    /// Never reverse strokes
    #[arg(long)]
    pub(crate) keep_direction: bool,
    /// Order of the pens; those not named come after, in the file's order
    #[arg(long, value_name = "PEN,PEN,...", value_delimiter = ',', value_parser = pen)]
    pub(crate) pen_order: Option<Vec<u16>>,
    /// Source of the drawing speed
    #[arg(long, value_enum, default_value_t = Speed::Machine)]
    pub(crate) speed: Speed,
    /// Start to travel when the pen is half way up, instead of fully up
    #[arg(long)]
    pub(crate) overlap_lifts: bool,
    /// Timing law of the strokes
    #[arg(long, value_enum, default_value_t = Law::TimeOptimal)]
    pub(crate) law: Law,
    /// With --law linear, sine or quadratic: duration of each segment
    #[arg(long, value_name = "TIME", default_value = "500ms", value_parser = time)]
    pub(crate) segment_time: f64,
    /// Choice of whole motor ticks: along the path, or nearest to the exact position
    #[arg(long, value_enum, default_value_t = Rounding::Path)]
    pub(crate) rounding: Rounding,
    /// Write the plan even if it exceeds the motors' limits, as laws of fixed duration may
    #[arg(long)]
    pub(crate) allow_over_limit: bool,
    #[command(flatten)]
    pub(crate) placement: Placement,
}

/// Where a drawing goes on the sheet.
#[derive(Debug, Args)]
pub(crate) struct Placement {
    /// Enlarge or reduce the drawing to the largest size that sheet, margin and machine allow
    #[arg(long, conflicts_with_all = ["place", "scale", "align", "shrink"])]
    pub(crate) fit: bool,
    /// As --fit, but never enlarge
    #[arg(long, conflicts_with_all = ["place", "scale", "align"])]
    pub(crate) shrink: bool,
    /// Align the ink with the sheet less its margin: center, left, right, top, bottom, top-left, ...
    #[arg(long, value_name = "WHERE", conflicts_with = "place", value_parser = align)]
    pub(crate) align: Option<(f64, f64)>,
    /// Move the drawing's origin to X,Y from the sheet's lower-left corner; or find the best position, and turn unless
    /// --rotate is given
    #[arg(long, value_name = "X,Y|best", value_parser = place, allow_hyphen_values = true)]
    pub(crate) place: Option<Place>,
    /// With --place best: what it is best for
    #[arg(id = "for", long, value_enum, default_value_t = BestFor::Time)]
    pub(crate) best_for: BestFor,
    /// Scale the drawing about its origin: 0.5 or 50%
    #[arg(long, value_name = "FACTOR|PERCENT%", value_parser = scale, allow_negative_numbers = true)]
    pub(crate) scale: Option<f64>,
    /// Rotate the drawing counterclockwise, in degrees, its lower-left corner staying in place
    #[arg(long, value_name = "ANGLE", value_parser = angle, allow_hyphen_values = true)]
    pub(crate) rotate: Option<f64>,
    /// Mirror the drawing before rotating it: x swaps left and right, y swaps top and bottom
    #[arg(long, value_enum)]
    pub(crate) mirror: Option<Mirror>,
    /// Distance that --fit, --shrink and --align keep from the edges of the sheet
    #[arg(long, value_name = "LENGTH", default_value = "0mm", value_parser = length, allow_hyphen_values = true)]
    pub(crate) margin: f64,
}

/// The position of a drawing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Place {
    /// Its origin from the sheet's lower-left corner, mm.
    At(f64, f64),
    /// The best one.
    Best,
}

/// What a position is best for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum BestFor {
    /// The shortest plan
    Time,
    /// The finest resolution: the least of the largest quantization errors along the ink
    Accuracy,
}

/// A reflection.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Mirror {
    /// Left and right
    X,
    /// Top and bottom
    Y,
}

#[derive(Debug, Args)]
pub(crate) struct Check {
    /// Drawing to read; `-` for standard input
    #[arg(value_parser = name())]
    pub(crate) file: String,
    /// Also check whether this machine can draw it
    #[arg(short, long, value_name = "NAME|FILE.toml", value_parser = name())]
    pub(crate) machine: Option<String>,
    #[command(flatten)]
    pub(crate) reading: Reading,
    #[command(flatten)]
    pub(crate) planning: Planning,
}

#[derive(Debug, Args)]
pub(crate) struct Info {
    /// Drawing or plan to read; `-` for standard input
    #[arg(value_parser = name())]
    pub(crate) file: String,
    /// For a drawing: also plan it for this machine. For a plan of a machine that is no preset: its file
    #[arg(short, long, value_name = "NAME|FILE.toml", value_parser = name())]
    pub(crate) machine: Option<String>,
    #[command(flatten)]
    pub(crate) reading: Reading,
    #[command(flatten)]
    pub(crate) planning: Planning,
}

#[derive(Debug, Args)]
pub(crate) struct Verify {
    /// Plan to verify; `-` for standard input
    #[arg(value_parser = name())]
    pub(crate) plan: String,
    /// The drawing it should draw; without it only motion is verified. Give it once for each of several drawings
    #[arg(short, long, value_name = "FILE", value_parser = name())]
    pub(crate) drawing: Vec<String>,
    /// Machine whose limits apply [default: of the plan document, else the preset the plan names]
    #[arg(short, long, value_name = "NAME|FILE.toml", value_parser = name())]
    pub(crate) machine: Option<String>,
    /// Largest distance between drawing and pen that the plan was made for; a plan document knows its own
    #[arg(long, value_name = "LENGTH", value_parser = length)]
    pub(crate) tolerance: Option<f64>,
    #[command(flatten)]
    pub(crate) reading: Reading,
}

#[derive(Debug, Args)]
pub(crate) struct Preview {
    /// Plan, or drawings, which are drawn over each other; `-` for standard input
    #[arg(required = true, value_name = "FILE", value_parser = name())]
    pub(crate) files: Vec<String>,
    /// Picture to write: NAME.svg or NAME.png, or NAME.html: the plan as it is drawn, in one page for the browser; `-` for
    /// standard output
    #[arg(short, long, value_name = "OUT", default_value = "-", value_parser = name())]
    pub(crate) output: String,
    /// Format of the picture [default: by the extension of --output; on standard output text for a terminal, else svg]
    #[arg(short, long, value_enum)]
    pub(crate) format: Option<PictureFormat>,
    /// The machine to show it on; a plan knows its own
    #[arg(short, long, value_name = "NAME|FILE.toml", value_parser = name())]
    pub(crate) machine: Option<String>,
    /// Colour the ink of a plan by a quantity, with a legend (also --color)
    #[arg(long, value_name = "WHAT", value_enum)]
    pub(crate) color_by: Option<InkColor>,
    /// Draw the machine in its pose at this time of the plan; ink that is to come is grey
    #[arg(long, value_name = "TIME", value_parser = time)]
    pub(crate) at: Option<f64>,
    /// SVG: draw the plan over and over, in this time
    #[arg(long, value_name = "TIME", value_parser = time, conflicts_with_all = ["at", "color_by"])]
    pub(crate) animate: Option<f64>,
    #[command(flatten)]
    pub(crate) reading: Reading,
    #[command(flatten)]
    pub(crate) planning: Planning,
}

/// The format of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum PictureFormat {
    /// Scalable, one unit is one mm
    Svg,
    /// Pixels, 1600 along the longer side
    Png,
    /// A page for the browser that shows machine and pen in motion; it needs no network
    Html,
    /// Braille characters, for a terminal
    Text,
}

#[derive(Debug, Args)]
pub(crate) struct Simulate {
    /// Plan or drawing; `-` for standard input
    #[arg(required_unless_present = "step", value_parser = name())]
    pub(crate) file: Option<String>,
    /// Machine with a `[drive]` table; for a plan document only to take another drive
    #[arg(short, long, value_name = "NAME|FILE.toml", value_parser = name())]
    pub(crate) machine: Option<String>,
    /// For a plan: the drawing that the ink is compared with, instead of the plan's own ink
    #[arg(short, long, value_name = "FILE", value_parser = name())]
    pub(crate) drawing: Vec<String>,
    /// Exit with 1 when ink strays or is missed by more than this
    #[arg(long, value_name = "LENGTH", value_parser = length)]
    pub(crate) within: Option<f64>,
    /// Write the predicted ink over the drawing (NAME.svg, NAME.png; NAME.html: in motion, in one page for the browser), or
    /// the motion every 2 ms (NAME.csv); with --step its response (NAME.svg, NAME.csv)
    #[arg(short, long, value_name = "OUT", value_parser = name())]
    pub(crate) output: Option<String>,
    /// Setpoints, instead of those of the drive
    #[arg(long, value_enum)]
    pub(crate) setpoints: Option<Setpoints>,
    /// Simulate a step of the setpoint by this many ticks, instead of a plan
    #[arg(long, value_name = "TICKS", allow_negative_numbers = true, value_parser = ticks)]
    pub(crate) step: Option<f64>,
    /// With --step: the motor [default: the first]
    #[arg(long, value_name = "NAME", requires = "step")]
    pub(crate) motor: Option<String>,
    /// With --step: simulated time
    #[arg(long, value_name = "TIME", default_value = "3s", value_parser = time, requires = "step")]
    pub(crate) duration: f64,
    #[command(flatten)]
    pub(crate) reading: Reading,
    #[command(flatten)]
    pub(crate) planning: Planning,
}

#[derive(Debug, Args)]
pub(crate) struct Tune {
    /// Machine with a `[drive]` table
    #[arg(short, long, value_name = "NAME|FILE.toml", required_unless_present = "from_step", value_parser = name())]
    pub(crate) machine: Option<String>,
    /// Drawing whose ink error is to be least [default: a test pattern of lines, corners and a circle]
    #[arg(short, long, value_name = "FILE", value_parser = name())]
    pub(crate) drawing: Vec<String>,
    /// Identify a motor from a record of a step response instead: rows of time in s, position in ticks, duty in percent
    #[arg(long, value_name = "FILE.csv", conflicts_with_all = ["machine", "drawing", "output", "loop_period"])]
    pub(crate) from_step: Option<String>,
    /// Period of the feedback loop, instead of the machine's
    #[arg(long, value_name = "TIME", value_parser = time)]
    pub(crate) loop_period: Option<f64>,
    /// Write the machine file with the new gains, its comments kept
    #[arg(short, long, value_name = "FILE.toml", value_parser = name())]
    pub(crate) output: Option<String>,
    #[command(flatten)]
    pub(crate) reading: Reading,
    #[command(flatten)]
    pub(crate) planning: Planning,
}

#[derive(Debug, Args)]
pub(crate) struct Calibrate {
    /// Machine: a preset's name or a machine file
    #[arg(value_name = "MACHINE")]
    pub(crate) machine: String,
    /// Touches: rows of `x_mm,y_mm,MOTOR1,MOTOR2[,elbow]`, where x and y are mm from the sheet's lower-left corner, and the
    /// motors' columns are ticks while the pen is there
    #[arg(value_name = "TOUCHES.csv", required_unless_present_any = ["drawn", "distances", "pattern"])]
    pub(crate) touches: Option<String>,
    /// The touches are the corners of this sheet, and have ticks only: lower left, lower right, upper right, upper left,
    /// and again from the first for a second round
    #[arg(long, value_name = "NAME|WxH", value_parser = compiler::paper::size_mm, requires = "touches")]
    pub(crate) corners: Option<[f64; 2]>,
    /// Marks of the pattern, measured with a ruler: rows of `mark,x_mm,y_mm`
    #[arg(long, value_name = "FILE.csv")]
    pub(crate) drawn: Option<String>,
    /// Distances between marks of the pattern: rows of `mark,mark,distance_mm`
    #[arg(long, value_name = "FILE.csv")]
    pub(crate) distances: Option<String>,
    /// Write the pattern of numbered crosses for this machine, as HP-GL, instead
    #[arg(long, conflicts_with_all = ["touches", "drawn", "distances", "without", "free", "pointing"])]
    pub(crate) pattern: bool,
    /// Where to write the calibrated machine file, its comments kept, or the pattern; `-` for standard output [default: the
    /// report only]
    #[arg(short, long, value_name = "FILE", default_value = "", hide_default_value = true)]
    pub(crate) output: String,
    /// Standard deviation of a touch along x and along y
    #[arg(long, value_name = "LENGTH", value_parser = length, default_value = "0.25mm")]
    pub(crate) pointing: f64,
    /// What may change: the pose (offsets and the place of the sheet), also lengths or counts, or all that the touches determine
    #[arg(long, value_enum, default_value = "all")]
    pub(crate) free: Free,
    /// Leave these touches out, by their numbers
    #[arg(long, value_name = "N", value_delimiter = ',')]
    pub(crate) without: Vec<usize>,
}

impl Calibrate {
    /// Whether nothing is written.
    pub(crate) fn report_only(&self) -> bool {
        self.output.is_empty()
    }
}

/// Unknowns of a calibration.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Free {
    /// Offsets of the motors and the place of the sheet
    Pose,
    /// Also link lengths, or counts
    Lengths,
    /// All that the touches determine
    All,
}

/// How a plan becomes setpoints.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Setpoints {
    /// The vertices of the drawing, each when the last one is reached
    Vertices,
    /// Each row until the next one
    Held,
    /// Linear interpolation between rows
    Interpolated,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Machine {
    /// List the machines that come with plotplan, and your own in the configuration folder
    List,
    /// Print a machine as a file that can be changed and given to --machine
    Show {
        /// Name of a preset, or a machine file
        #[arg(value_parser = name())]
        name: String,
        /// Print the machine header of the firmware instead, for this drive [default: as `[drive]` of
        /// the machine says, else step]
        #[arg(long, value_enum, value_name = "DRIVE", num_args = 0..=1)]
        #[expect(clippy::option_option, reason = "the option, and its value")]
        firmware_config: Option<Option<FirmwareDrive>>,
    },
    /// Write a commented file for a machine of your own; asks for what the options leave open
    New {
        /// Kind of machine: cartesian, two-link, polar, five-bar, polargraph
        kind: Option<String>,
        /// File to write; `-` for standard output
        #[arg(short, long, value_name = "FILE.toml", value_parser = name())]
        output: String,
        /// Name of the machine [default: that of the file]
        #[arg(long)]
        name: Option<String>,
        /// An answer, such as l1=206mm; --set help=1 is an error that lists the keys
        #[arg(long, value_name = "KEY=VALUE")]
        set: Vec<String>,
        /// Ask nothing: take the defaults for what the options leave open
        #[arg(long)]
        defaults: bool,
    },
    /// Check a machine file: validity, and reach of its sheet
    Check {
        /// Machine file, or the name of a preset
        #[arg(value_parser = name())]
        file: String,
        /// Also write a picture of it, as `machine preview` does: NAME.svg or NAME.png
        #[arg(short, long, value_name = "OUT", value_parser = name())]
        output: Option<String>,
    },
    /// Draw a picture of a machine: reach, sheet, start pose, and its resolution as shades
    Preview {
        /// Name of a preset, or a machine file
        #[arg(value_parser = name())]
        name: String,
        /// Picture to write: NAME.svg or NAME.png; `-` for standard output
        #[arg(short, long, value_name = "OUT", value_parser = name())]
        output: String,
        /// Format of the picture [default: by the extension of --output; svg on standard output]
        #[arg(short, long, value_enum)]
        format: Option<PictureFormat>,
    },
}

/// How the firmware moves the motors.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum FirmwareDrive {
    /// Step and direction pins
    Step,
    /// DC motors with encoders
    Dc,
    /// RC servos
    Servo,
    /// DC motors with encoders, on a board with MicroPython: the module config.py
    Micropython,
}

impl std::fmt::Display for FirmwareDrive {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Step => "step",
            Self::Dc => "dc",
            Self::Servo => "servo",
            Self::Micropython => "micropython",
        })
    }
}

#[derive(Debug, Args)]
pub(crate) struct Explain {
    /// The code, such as H0101; `codes` lists them, `plotters` the plotters and papers that are known, `formats` the
    /// formats and protocols as a page
    pub(crate) code: String,
}

#[derive(Debug, Args)]
pub(crate) struct Schema {
    /// Of what
    #[arg(value_enum, default_value = "reports")]
    pub(crate) of: SchemaOf,
    /// Print it as a page instead: docs/reports.md, docs/machine-keys.md
    #[arg(long)]
    pub(crate) markdown: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum SchemaOf {
    /// --report json
    Reports,
    /// Machine files: every key
    Machine,
}

#[derive(Debug, Args)]
pub(crate) struct Man {
    /// The command, such as convert
    pub(crate) command: Option<String>,
}

#[derive(Debug, Args)]
pub(crate) struct Completions {
    /// The shell
    #[arg(value_enum)]
    pub(crate) shell: Shell,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum ReportForm {
    /// For people
    Text,
    /// One JSON object on the last line, see docs/reports.md
    Json,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Order {
    /// The least time with the pen up; without a machine the least travel
    Optimize,
    /// As in the file
    File,
}

/// How the pen speeds up and slows down over the paper.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Law {
    /// As fast as the motors can, corners rounded within the tolerance
    TimeOptimal,
    /// As fast as the motors can from vertex to vertex, with a rest at each
    Trapezoid,
    /// Each segment evenly in --segment-time
    Linear,
    /// Each segment in --segment-time, fast at first: sin(pi x / 2)
    Sine,
    /// Each segment in --segment-time, from rest to rest: 2 x² and back
    Quadratic,
}

/// How rows take whole motor ticks.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Rounding {
    /// Within 1.5 ticks, so that the motion from row to row stays near the path
    Path,
    /// The nearest ticks
    Nearest,
}

/// Source of the drawing speed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Speed {
    /// The machine's
    Machine,
    /// The file's (VS) where it gives one, and never more than the machine's
    File,
}

/// The table of exit codes, for the help of the program.
fn exit_codes() -> String {
    let line =
        |exit: &compiler::report::ExitCode| format!("  {:<4} {}: {}", exit.code, exit.name, exit.meaning);
    let lines: Vec<String> = compiler::report::EXIT_CODES.iter().map(line).collect();
    format!("Exit codes:\n{}", lines.join("\n"))
}

impl Command {
    /// The name as it is typed: `convert`, `machine check`.
    pub(crate) fn name(&self) -> &'static str {
        match self {
            Self::Convert(_) => "convert",
            Self::Check(_) => "check",
            Self::Info(_) => "info",
            Self::Verify(_) => "verify",
            Self::Preview(_) => "preview",
            Self::Send(_) => "send",
            Self::Jog(_) => "jog",
            Self::Build(_) => "build",
            Self::Init(_) => "init",
            Self::Diff(_) => "diff",
            Self::Studio(_) => "studio",
            #[cfg(unix)]
            Self::Emulate(_) => "emulate",
            Self::Machine(Machine::List) => "machine list",
            Self::Machine(Machine::New { .. }) => "machine new",
            Self::Machine(Machine::Show { .. }) => "machine show",
            Self::Machine(Machine::Check { .. }) => "machine check",
            Self::Machine(Machine::Preview { .. }) => "machine preview",
            Self::Explain(_) => "explain",
            Self::Schema(_) => "schema",
            Self::Completions(_) => "completions",
            Self::Man(_) => "man",
            Self::Simulate(_) => "simulate",
            Self::Tune(_) => "tune",
            Self::Calibrate(_) => "calibrate",
        }
    }
}

/// Whether standard output holds the report itself, so that its JSON form goes there.
pub(crate) fn reports_on_stdout(command: &str) -> bool {
    ["check", "info", "verify", "diff", "simulate", "tune", "calibrate", "machine check", "machine list"]
        .contains(&command)
}

/// Options that choose files or the form of reports: the plan does not depend on them.
const NOT_OF_THE_PLAN: [&str; 5] = ["files", "machine", "output", "format", "strict"];

/// The options of `convert` that shape the plan, as given, in the order of the help: with them, the
/// same drawing and the same machine, `convert` makes the same plan.
pub(crate) fn plan_options(matches: &ArgMatches) -> Vec<String> {
    let Some(("convert", given)) = matches.subcommand() else {
        return Vec::new();
    };
    let convert = Arguments::command().find_subcommand("convert").cloned().unwrap_or_default();
    let mut options = Vec::new();
    for argument in convert.get_arguments() {
        let id = argument.get_id().as_str();
        let (Some(long), Some(ValueSource::CommandLine)) = (argument.get_long(), given.value_source(id))
        else {
            continue;
        };
        if NOT_OF_THE_PLAN.contains(&id) {
            continue;
        }
        if argument.get_action().takes_values() {
            let values = given.get_raw(id).into_iter().flatten().map(|value| value.to_string_lossy());
            options.push(format!("--{long}={}", values.collect::<Vec<_>>().join(",")));
        } else {
            options.push(format!("--{long}"));
        }
    }
    options
}
