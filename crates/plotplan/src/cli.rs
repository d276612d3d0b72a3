//! The arguments of the command line.

use std::path::Path;
use std::sync::LazyLock;

use backends::pen_plotter::plotter::Plotter;
use backends::{Backend, EncodeOptions, PenActuator};
use clap::builder::PossibleValue;
use clap::parser::ValueSource;
use clap::{ArgMatches, Args, CommandFactory as _, Parser, Subcommand, ValueEnum};
use clap_complete::Shell;
use compiler::layout::{Copies, Crop};
use compiler::{import, quantity};

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
    /// With `--format hpgl`, `--plotter` is the plotter to write for.
    pub(crate) fn settle(&mut self) {
        if let Command::Convert(convert) = &mut self.command {
            convert.settle();
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
    /// Send a plan to a machine
    Send(Send),
    /// Emulate a controller on a pseudo-terminal
    #[cfg(unix)]
    #[command(alias = "device")]
    Emulate(Emulate),
    /// List, show and check machines
    #[command(subcommand)]
    Machine(Machine),
    /// Explain a diagnostic's code
    Explain(Explain),
    /// Print the JSON schema of reports (--report json)
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
        EncodeOptions { pen_actuator, pen_positions: self.pen_positions, legacy_moves: false }
    }
}

/// How a drawing's file is read.
#[derive(Debug, Args)]
pub(crate) struct Reading {
    /// Which page of the file to take, from 1; with `convert`, `all` writes one file for each page [default: the first,
    /// with a warning if there are more]
    #[arg(long, value_name = "N|all", value_parser = page)]
    pub(crate) page: Option<PageChoice>,
    /// Plotter that the file was made for (see `plotplan explain plotters`) [default: from the file]. With `convert --format
    /// hpgl`: the plotter to write for, or a TOML file with its limits
    #[arg(long, value_name = "NAME")]
    pub(crate) plotter: Option<String>,
    /// Plotter and paper that the file was made for, where --plotter is another one
    #[arg(long, value_name = "NAME[,PAPER]")]
    pub(crate) made_for: Option<String>,
    /// The sheet on the machine: A4, A3,landscape, letter or 200x300mm. With --plotter: the paper of that plotter
    #[arg(long, value_name = "PAPER", value_parser = name())]
    pub(crate) paper: Option<String>,
    /// HP-GL: draw the ink of pens that the file makes white (PC), or leave it out
    #[arg(long, value_name = "HOW", value_enum, default_value_t = WhitePens::Draw)]
    pub(crate) white_pens: WhitePens,
    /// SVG: how pens are numbered
    #[arg(long, value_enum, default_value_t = Pens::Layers)]
    pub(crate) pens: Pens,
    /// SVG: hatch filled areas with lines this far apart, at this angle (0deg if not given)
    #[arg(long, value_name = "SPACING[,ANGLE]", value_parser = hatch)]
    pub(crate) hatch: Option<import::Hatch>,
    /// SVG: draw the outlines of shapes that have a fill but no stroke
    #[arg(long)]
    pub(crate) outline_fills: bool,
    /// SVG: how text is drawn
    #[arg(long, value_enum, default_value_t = TextForm::Strokes)]
    pub(crate) text: TextForm,
    /// With --text outlines: a font file to use instead of the system's fonts
    #[arg(long, value_name = "FILE")]
    pub(crate) font: Vec<String>,
    /// SVG: pixels per inch; 96, or 72 for old files of Illustrator, if not given
    #[arg(long, value_name = "NUMBER", value_parser = dpi)]
    pub(crate) dpi: Option<f64>,
    #[command(flatten)]
    pub(crate) layout: Layout,
    /// Treat warnings as errors
    #[arg(long)]
    pub(crate) strict: bool,
}

/// A page of a drawing's file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum PageChoice {
    /// The page of this number, from 1.
    Number(usize),
    /// All pages, each on its own.
    All,
}

/// What is drawn of a drawing.
#[derive(Debug, Args)]
pub(crate) struct Layout {
    /// Draw only these pens, by their numbers in the file
    #[arg(long, value_name = "PEN,PEN,...", value_delimiter = ',', value_parser = clap::value_parser!(u16).range(1..))]
    pub(crate) only_pens: Option<Vec<u16>>,
    /// Renumber pens: the file's pen OLD becomes pen NEW
    #[arg(long, value_name = "OLD=NEW,...", value_delimiter = ',', value_parser = pen_pair)]
    pub(crate) pen_map: Vec<(u16, u16)>,
    /// Repeat the drawing in a grid of columns and rows, such as 3x2
    #[arg(long, value_name = "COLUMNSxROWS", value_parser = grid)]
    pub(crate) copies: Option<(u16, u16)>,
    /// Distance between the copies
    #[arg(long, value_name = "LENGTH", default_value = "0mm", value_parser = length, allow_negative_numbers = true)]
    pub(crate) gap: f64,
    /// Cut the placed drawing at the edges of the sheet, or of a window X,Y,W,H from the sheet's lower-left corner
    #[arg(long, value_name = "sheet|X,Y,W,H", value_parser = crop, allow_hyphen_values = true)]
    pub(crate) crop: Option<Crop>,
}

impl Layout {
    /// The same for the compiler.
    pub(crate) fn to_layout(&self) -> compiler::layout::Layout {
        compiler::layout::Layout {
            only_pens: self.only_pens.clone(),
            pen_map: self.pen_map.clone(),
            copies: self.copies.map(|(columns, rows)| Copies { columns, rows, gap_mm: self.gap }),
            crop: self.crop,
        }
    }
}

impl Reading {
    /// The page to take; the first unless another one was asked for.
    pub(crate) fn page(&self) -> PageChoice {
        self.page.unwrap_or(PageChoice::Number(1))
    }

    /// The options of the drawing's importer.
    pub(crate) fn options(&self, fonts: Option<import::Fonts>) -> import::Options {
        let made_for = self.made_for.as_ref().map(|text| match text.split_once(',') {
            Some((plotter, paper)) => (plotter.to_owned(), Some(paper.to_owned())),
            None => (text.clone(), None),
        });
        let by_plotter = || self.plotter.as_ref().map(|plotter| (plotter.clone(), self.paper.clone()));
        let (plotter, paper) = made_for.or_else(by_plotter).unzip();
        import::Options {
            fonts,
            plotter,
            paper: paper.flatten(),
            skip_white_pens: self.white_pens == WhitePens::Skip,
            svg: import::SvgOptions {
                pens: match self.pens {
                    Pens::Layers => import::PenRule::Layers,
                    Pens::Colors => import::PenRule::Colors,
                    Pens::One => import::PenRule::One,
                },
                hatch: self.hatch,
                outline_fills: self.outline_fills,
                dpi: self.dpi,
            },
        }
    }
}

/// What is done with the ink of white pens.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum WhitePens {
    /// It is drawn, with a warning
    Draw,
    /// It is left out
    Skip,
}

/// How the text of an SVG file is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum TextForm {
    /// In the built-in stroke font: the same everywhere
    Strokes,
    /// As outlines of the system's fonts, or of --font
    Outlines,
}

/// How the pens of an SVG file are numbered.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Pens {
    /// By the number that a layer's name begins with, other layers in their order; by colour without layers
    Layers,
    /// By colour, in order of appearance
    #[value(alias = "colours")]
    Colors,
    /// Pen 1 for everything
    One,
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
    /// Ordering effort, from 0 to 3
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
    /// Move the drawing's origin to X,Y from the sheet's lower-left corner
    #[arg(long, value_name = "X,Y", value_parser = place, allow_hyphen_values = true)]
    pub(crate) place: Option<(f64, f64)>,
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
    #[arg(short, long, value_name = "OUT", value_parser = name())]
    pub(crate) output: String,
    /// Format of the picture [default: by the extension of --output; svg on standard output]
    #[arg(short, long, value_enum)]
    pub(crate) format: Option<PictureFormat>,
    /// The machine to show it on; a plan knows its own
    #[arg(short, long, value_name = "NAME|FILE.toml", value_parser = name())]
    pub(crate) machine: Option<String>,
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
    /// For ebb: SM moves, which every firmware version executes
    #[arg(long)]
    pub(crate) stepper_moves: bool,
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
    /// Fault to inject: lost-answer=N, late-answer=N:TIME, garbled-answer=N, full-buffer=AT:TIME, unplugged=AT:TIME, garbled-byte=N, held=AT:TIME, power-cut=AT
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
    /// For xy-serial: homed before
    #[arg(long)]
    pub(crate) homed: bool,
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
    /// Check a machine file: validity, and reach of its sheet
    Check {
        /// Machine file, or the name of a preset
        #[arg(value_parser = name())]
        file: String,
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
}

impl std::fmt::Display for FirmwareDrive {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Step => "step",
            Self::Dc => "dc",
            Self::Servo => "servo",
        })
    }
}

#[derive(Debug, Args)]
pub(crate) struct Explain {
    /// The code, such as H0101; or `plotters` for the plotters and papers that are known
    pub(crate) code: String,
}

#[derive(Debug, Args)]
pub(crate) struct Schema {
    /// Print the page docs/reports.md instead
    #[arg(long)]
    pub(crate) markdown: bool,
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

/// What convert writes.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Format {
    /// A firmware's format
    Backend(&'static dyn Backend),
    /// A table of ticks against time
    Csv,
    /// A plan document with machine, settings and certificate
    Json,
    /// The drawing as understood, as clean HP-GL
    Hpgl,
    /// The drawing as understood, as SVG in mm
    Svg,
}

impl Format {
    fn name_and_help(self) -> Option<(&'static str, &'static str)> {
        Some(match self {
            Self::Backend(backend) => (backend.name(), backend.format_help()?),
            Self::Csv => ("csv", "A table of ticks against time"),
            Self::Json => ("json", "A plan document with machine, settings and certificate"),
            Self::Hpgl => ("hpgl", "The drawing as understood, as clean HP-GL"),
            Self::Svg => ("svg", "The drawing as understood, as SVG in mm"),
        })
    }
}

impl Default for Format {
    /// Tick lines.
    fn default() -> Self {
        Self::value_variants()[0]
    }
}

impl Format {
    pub(crate) fn name(self) -> &'static str {
        self.name_and_help().map_or("", |(name, _)| name)
    }

    /// The format that files with the extension of this name hold; `None` for names without one, and
    /// for extensions that leave the format open.
    pub(crate) fn of_extension(output: &str) -> Option<Self> {
        let extension = Path::new(output).extension()?.to_str()?.to_ascii_lowercase();
        match extension.as_str() {
            "ticks" => Some(Self::default()),
            "csv" => Some(Self::Csv),
            "json" => Some(Self::Json),
            "hpgl" | "plt" => Some(Self::Hpgl),
            "svg" => Some(Self::Svg),
            _ => None,
        }
    }

    /// Whether a file of that extension cannot hold this format. Some firmwares' formats are CSV or
    /// JSON, too.
    fn contradicts(self, by_extension: Self) -> bool {
        let is_firmwares = matches!(self, Self::Backend(_)) && self.name() != "ticks";
        let is_table = matches!(by_extension, Self::Csv | Self::Json);
        self.name() != by_extension.name() && !(is_firmwares && is_table)
    }
}

impl ValueEnum for Format {
    fn value_variants<'a>() -> &'a [Self] {
        static ALL: LazyLock<Vec<Format>> = LazyLock::new(|| {
            let written = backends::ALL.iter().copied().filter(|backend| backend.format_help().is_some());
            let mut all: Vec<Format> = written.map(Format::Backend).collect();
            // After the tick lines.
            all.splice(1..1, [Format::Csv, Format::Json]);
            all.extend([Format::Hpgl, Format::Svg]);
            all
        });
        &ALL
    }

    fn to_possible_value(&self) -> Option<PossibleValue> {
        self.name_and_help().map(|(name, help)| PossibleValue::new(name).help(help))
    }
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
            #[cfg(unix)]
            Self::Emulate(_) => "emulate",
            Self::Machine(Machine::List) => "machine list",
            Self::Machine(Machine::Show { .. }) => "machine show",
            Self::Machine(Machine::Check { .. }) => "machine check",
            Self::Machine(Machine::Preview { .. }) => "machine preview",
            Self::Explain(_) => "explain",
            Self::Schema(_) => "schema",
            Self::Completions(_) => "completions",
            Self::Man(_) => "man",
            Self::Simulate(_) => "simulate",
            Self::Tune(_) => "tune",
        }
    }
}

/// Whether standard output holds the report itself, so that its JSON form goes there.
pub(crate) fn reports_on_stdout(command: &str) -> bool {
    ["check", "info", "verify", "simulate", "tune", "machine check", "machine list"].contains(&command)
}

fn align(text: &str) -> Result<(f64, f64), String> {
    let (mut x, mut y) = (0.5, 0.5);
    for word in text.split('-') {
        match word {
            "left" => x = 0.0,
            "right" => x = 1.0,
            "bottom" => y = 0.0,
            "top" => y = 1.0,
            "center" | "centre" | "middle" => {}
            _ => {
                return Err("expected center, left, right, top, bottom or a corner such as top-left".into());
            }
        }
    }
    Ok((x, y))
}

fn scale(text: &str) -> Result<f64, String> {
    let (number, unit) = text.strip_suffix('%').map_or((text, 1.0), |number| (number, 0.01));
    let factor = number.trim().parse::<f64>().ok().map(|factor| factor * unit);
    factor
        .filter(|factor| *factor > 0.0 && factor.is_finite())
        .ok_or_else(|| "expected a positive factor such as 0.5, or a percentage such as 50%".to_owned())
}

/// The name of a file, a machine, a port or the like.
fn name() -> clap::builder::NonEmptyStringValueParser {
    clap::builder::NonEmptyStringValueParser::new()
}

/// An angle in rad, at most a full turn; a bare number is in degrees.
fn angle(text: &str) -> Result<f64, String> {
    let degrees = text.trim().parse::<f64>().ok().filter(|degrees| degrees.is_finite());
    let angle = match degrees {
        Some(degrees) => degrees.to_radians(),
        None => quantity::angle_rad(text).map_err(|_| {
            "expected an angle in degrees such as 90, or with a unit such as 1.57rad".to_owned()
        })?,
    };
    if angle.abs() > std::f64::consts::TAU + 1e-9 {
        return Err("expected an angle of at most a full turn: -360 to 360 degrees".to_owned());
    }
    Ok(angle)
}

fn length(text: &str) -> Result<f64, String> {
    quantity::length_mm(text, true).map_err(|error| error.to_string())
}

/// Spacing of a hatch, and its angle after a comma.
fn hatch(text: &str) -> Result<import::Hatch, String> {
    let (spacing, direction) = text.split_once(',').unwrap_or((text, "0"));
    let spacing_mm = length(spacing)?;
    if !(1e-3..1e4).contains(&spacing_mm) {
        return Err("the spacing must be between 0.001 mm and 10 m".into());
    }
    Ok(import::Hatch { spacing_mm, angle_rad: angle(direction)? })
}

fn page(text: &str) -> Result<PageChoice, String> {
    match text {
        "all" => Ok(PageChoice::All),
        number => number
            .parse()
            .map(PageChoice::Number)
            .map_err(|_| "expected the number of a page, or `all`".to_owned()),
    }
}

fn pen(text: &str) -> Result<u16, String> {
    let pen = text.trim().parse::<u16>().ok();
    pen.ok_or_else(|| "expected numbers of pens with commas between, such as 2,1".to_owned())
}

fn pen_pair(text: &str) -> Result<(u16, u16), String> {
    let what = "expected pairs of pens such as 2=1,4=2";
    let (from, to) = text.split_once('=').ok_or(what)?;
    let pen = |text: &str| text.trim().parse::<u16>().ok().filter(|pen| *pen > 0).ok_or(what);
    Ok((pen(from)?, pen(to)?))
}

fn grid(text: &str) -> Result<(u16, u16), String> {
    let what = "expected columns and rows such as 3x2, from 1 to 1000";
    let (columns, rows) = text.split_once('x').ok_or(what)?;
    let count = |text: &str| text.trim().parse::<u16>().ok().filter(|n| (1..=1000).contains(n)).ok_or(what);
    Ok((count(columns)?, count(rows)?))
}

fn crop(text: &str) -> Result<Crop, String> {
    if text == "sheet" {
        return Ok(Crop::Sheet);
    }
    let what = "expected `sheet`, or a window X,Y,WIDTH,HEIGHT such as 10mm,10mm,5cm,5cm";
    let lengths: Vec<&str> = text.split(',').collect();
    let [x, y, width, height] = lengths[..] else { return Err(what.to_owned()) };
    let window = [length(x)?, length(y)?, length(width)?, length(height)?];
    if !(window[2] > 0.0 && window[3] > 0.0) {
        return Err("the width and height of the window must be positive".to_owned());
    }
    Ok(Crop::Window(window))
}

fn ticks(text: &str) -> Result<f64, String> {
    let ticks = text.trim().parse::<f64>().ok().filter(|ticks| ticks.abs() >= 1.0 && ticks.abs() <= 1e9);
    ticks.ok_or_else(|| "expected a number of ticks from 1 to 1e9, such as 3200".to_owned())
}

fn dpi(text: &str) -> Result<f64, String> {
    let dpi = text.trim().parse::<f64>().ok().filter(|dpi| (1.0..=100_000.0).contains(dpi));
    dpi.ok_or_else(|| format!("{text} is not a number from 1 to 100000"))
}

fn positions(text: &str) -> Result<(f64, f64), String> {
    let (up, down) =
        text.split_once(',').ok_or("expected two numbers with a comma between, such as 40,90")?;
    let number = |text: &str| {
        let value = text.trim().parse::<f64>().ok().filter(|value| value.abs() <= 30_000.0);
        value.ok_or_else(|| format!("{text} is not a number between -30000 and 30000"))
    };
    Ok((number(up)?, number(down)?))
}

#[cfg(unix)]
fn fault(text: &str) -> Result<backends::Fault, String> {
    use backends::Fault;
    let what = "a fault is KIND=N or KIND=N:TIME, such as lost-answer=5 or unplugged=2s:1s";
    let (kind, value) = text.split_once('=').ok_or(what)?;
    let (first, second) = value.split_once(':').map_or((value, None), |(a, b)| (a, Some(b)));
    let number = |text: &str| text.parse::<u64>().map_err(|_| format!("{text} is not a whole number"));
    let microseconds = |text: &str| Ok::<u64, String>((time(text)? * 1e6).round() as u64);
    let lasting = || microseconds(second.ok_or(what)?);
    Ok(match kind {
        "lost-answer" => Fault::LostAnswer(number(first)?),
        "late-answer" => Fault::LateAnswer(number(first)?, lasting()?),
        "garbled-answer" => Fault::GarbledAnswer(number(first)?),
        "garbled-byte" => Fault::GarbledByte(number(first)?),
        "full-buffer" => Fault::FullBuffer(microseconds(first)?, lasting()?),
        "unplugged" => Fault::Unplugged(microseconds(first)?, lasting()?),
        "held" => Fault::Held(microseconds(first)?, lasting()?),
        "power-cut" => Fault::PowerCut(microseconds(first)?),
        _ => return Err(what.to_owned()),
    })
}

fn time(text: &str) -> Result<f64, String> {
    quantity::time_s(text).map_err(|error| error.to_string())
}

fn place(text: &str) -> Result<(f64, f64), String> {
    let (x, y) =
        text.split_once(',').ok_or("a place is two lengths with a comma between, such as 10mm,2cm")?;
    Ok((length(x)?, length(y)?))
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
