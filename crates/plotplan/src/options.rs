//! Options that would have no effect are refused, for all commands in one place.

use std::sync::OnceLock;

use clap::ArgMatches;
use clap::parser::ValueSource;

use crate::cli::{self, Format};
use crate::failure::Failure;

/// Options of planning proper.
const PLANNING: [&str; 13] = [
    "tolerance",
    "period",
    "order",
    "effort",
    "dedupe",
    "keep_direction",
    "pen_order",
    "speed",
    "overlap_lifts",
    "law",
    "segment_time",
    "rounding",
    "allow_over_limit",
];
/// Options of planning that drawings have no use for: they hold no motion.
const MOTION: [&str; 8] =
    ["tolerance", "period", "speed", "overlap_lifts", "law", "segment_time", "rounding", "allow_over_limit"];
/// Options of placement.
const PLACEMENT: [&str; 9] =
    ["fit", "shrink", "align", "place", "for", "scale", "rotate", "mirror", "margin"];
/// Options of placement that need a sheet.
const ON_SHEET: [&str; 3] = ["fit", "shrink", "align"];
/// Options of the ordering that `--order file` leaves out; `--effort 0` has an effect on paths too.
const ORDERING: [&str; 3] = ["effort", "keep_direction", "pen_order"];
/// Options of pictures of a plan.
const MOVING: [&str; 3] = ["color_by", "at", "animate"];
/// Options of the firmware's pen.
const PEN: [&str; 2] = ["pen_by", "pen_positions"];
/// Options of the reader of a drawing.
const READING: [&str; 16] = [
    "page",
    "plotter",
    "made_for",
    "paper",
    "white_pens",
    "pens",
    "hatch",
    "outline_fills",
    "text",
    "font",
    "dpi",
    "only_pens",
    "pen_map",
    "copies",
    "gap",
    "crop",
];

/// The first option given that has no effect, and why: `--scale has no effect with --format svg`.
pub(crate) fn without_effect(matches: &ArgMatches) -> Option<String> {
    let (command, given) = matches.subcommand()?;
    let options = Given(given);
    let of_command = match command {
        "convert" => convert(&options),
        "preview" => preview(&options),
        "check" | "info" => drawing(&options),
        "simulate" => simulate(&options),
        "tune" => tune(&options),
        "verify" if !options.has("drawing") => options.refuse(&READING, "without --drawing"),
        _ => None,
    };
    of_command
        .or_else(|| best_place(&options, command))
        .or_else(|| options.refuse(&["gap"], "without --copies").filter(|_| !options.has("copies")))
        .or_else(|| {
            let is_outlines = options.text("text") == "outlines";
            options.refuse(&["font"], "without --text outlines").filter(|_| !is_outlines)
        })
}

/// Why the first option given that is for drawings only has no effect on a plan. Whether the input is
/// a plan shows only when it is read.
static ON_PLANS: OnceLock<Option<String>> = OnceLock::new();

/// Remembers the options for [`refuse_on_plan`].
pub(crate) fn remember(matches: &ArgMatches) {
    let options = matches.subcommand().map(|(_, given)| Given(given));
    let all = [&READING[..], &PLANNING, &PLACEMENT].concat();
    let _ = ON_PLANS.set(options.and_then(|options| options.refuse(&all, "on a plan")));
}

/// Refuses options that are for drawings, where the input is a plan.
pub(crate) fn refuse_on_plan() -> Result<(), Failure> {
    match ON_PLANS.get().and_then(Option::clone) {
        Some(what) => Err(Failure::Usage(anyhow::anyhow!(what))),
        None => Ok(()),
    }
}

/// The options of one command.
struct Given<'a>(&'a ArgMatches);

impl Given<'_> {
    /// Whether the option stands on the command line.
    fn has(&self, id: &str) -> bool {
        self.0.try_contains_id(id).is_ok() && self.0.value_source(id) == Some(ValueSource::CommandLine)
    }

    /// The option's value as text; its default if it is not given.
    fn text(&self, id: &str) -> String {
        let raw = self.0.try_get_raw(id).ok().flatten();
        raw.and_then(|mut values| values.next())
            .map(|text| text.to_string_lossy().into_owned())
            .unwrap_or_default()
    }

    /// The message for the first of these options that is given.
    fn refuse(&self, ids: &[&str], why: &str) -> Option<String> {
        let id = ids.iter().find(|id| self.has(id))?;
        Some(format!("--{} has no effect {why}", id.replace('_', "-")))
    }

    /// `--paper` is the sheet on the machine, unless `--plotter` makes it that plotter's.
    fn has_machine_paper(&self) -> bool {
        self.has("paper") && !self.has("plotter")
    }

    /// Whether `--plotter` names the plotter to write for; its paper is the sheet then.
    fn has_target(&self) -> bool {
        self.has("plotter") && cli::is_target(&self.text("plotter"))
    }
}

/// The format of `convert`, by name or by the output's extension.
fn format_of(options: &Given<'_>) -> String {
    match options.text("format") {
        given if given.is_empty() => {
            Format::of_extension(&options.text("output")).unwrap_or_default().name().to_owned()
        }
        given => given,
    }
}

fn convert(options: &Given<'_>) -> Option<String> {
    let format = format_of(options);
    if format == "hpgl" || format == "svg" {
        let why = format!("with --format {format}");
        let no_motion = format!("{why}: it holds no motion");
        return options
            .refuse(&["hpgl2"], &why)
            .filter(|_| format == "svg")
            .or_else(|| options.refuse(&MOTION, &no_motion))
            .or_else(|| options.refuse(&PEN, &why))
            .or_else(|| {
                let without = format!("{why} without --order optimize");
                options.refuse(&ORDERING, &without).filter(|_| options.text("order") != "optimize")
            })
            .or_else(|| {
                let why = "with --format hpgl and --plotter";
                options
                    .refuse(&["hpgl2", "machine"], why)
                    .filter(|_| format == "hpgl" && options.has_target())
            })
            .or_else(|| sheet(options).filter(|_| format != "hpgl" || !options.has_target()))
            .or_else(|| margin(options));
    }
    let has_pen = format.starts_with("gcode") || format.starts_with("ebb");
    options
        .refuse(&["hpgl2"], "without --format hpgl")
        .or_else(|| options.refuse(&PEN, &format!("with --format {format}")).filter(|_| !has_pen))
        .or_else(|| planning(options))
}

/// Rules among the options of planning.
fn planning(options: &Given<'_>) -> Option<String> {
    let law = options.text("law");
    let is_fixed_duration = ["linear", "sine", "quadratic"].contains(&law.as_str());
    options
        .refuse(&["segment_time"], &format!("with --law {law}"))
        .filter(|_| !is_fixed_duration)
        .or_else(|| {
            let ids = if options.text("effort") == "0" { &ORDERING[1..] } else { &ORDERING[..] };
            options.refuse(ids, "with --order file").filter(|_| options.text("order") == "file")
        })
        .or_else(|| margin(options))
}

fn simulate(options: &Given<'_>) -> Option<String> {
    if options.has("step") {
        let why = "with --step";
        return options
            .refuse(&["drawing", "within", "setpoints"], why)
            .or_else(|| options.refuse(&PLANNING, why))
            .or_else(|| options.refuse(&PLACEMENT, why))
            .or_else(|| options.refuse(&READING, why));
    }
    planning(options)
}

fn tune(options: &Given<'_>) -> Option<String> {
    let why = if options.has("from_step") {
        "with --from-step"
    } else if options.has("drawing") {
        return planning(options);
    } else {
        "without --drawing"
    };
    options.refuse(&PLANNING, why).or_else(|| options.refuse(&PLACEMENT, why)).or_else(|| {
        // The paper is the sheet of the test pattern.
        let reading: Vec<&str> = READING.into_iter().filter(|id| *id != "paper").collect();
        options.refuse(&reading, why)
    })
}

/// `--margin` is for placements that look at the sheet's edges.
fn margin(options: &Given<'_>) -> Option<String> {
    let has_margin = ON_SHEET.iter().any(|id| options.has(id)) || options.text("place") == "best";
    options.refuse(&["margin"], "without --fit, --shrink, --align or --place best").filter(|_| !has_margin)
}

/// `--place best` compares plans: it needs a command that makes one.
fn best_place(options: &Given<'_>, command: &str) -> Option<String> {
    if options.text("place") != "best" {
        return options.refuse(&["for"], "without --place best");
    }
    let plans = match command {
        "convert" => !["hpgl", "svg"].contains(&format_of(options).as_str()),
        "preview" => is_page(options) || MOVING.iter().any(|id| options.has(id)),
        "info" => options.has("machine"),
        "check" => false,
        _ => true,
    };
    (!plans).then(|| "--place best has no effect without a plan".to_owned())
}

/// Options that need a sheet, where no machine and no paper gives one.
fn sheet(options: &Given<'_>) -> Option<String> {
    if options.has("machine") || options.has_machine_paper() {
        return None;
    }
    let option = ON_SHEET.iter().find(|id| options.has(id)).copied();
    let option = option.or_else(|| (options.text("crop") == "sheet").then_some("crop sheet"));
    option.map(|option| format!("--{option} needs a sheet: give --paper or --machine"))
}

/// For `check` and `info`, which show the file's drawing where there is no machine.
fn drawing(options: &Given<'_>) -> Option<String> {
    if options.has("machine") {
        return planning(options);
    }
    let why = "without --machine";
    if options.has_machine_paper() {
        // The drawing is placed on that sheet.
        return options.refuse(&PLANNING, why).or_else(|| margin(options));
    }
    options
        .refuse(&PLANNING, why)
        .or_else(|| options.refuse(&PLACEMENT, "without --machine or --paper"))
        .or_else(|| sheet(options))
}

fn preview(options: &Given<'_>) -> Option<String> {
    if is_page(options) {
        return options.refuse(&MOVING, "on a page, which shows all of it").or_else(|| planning(options));
    }
    if MOVING.iter().any(|id| options.has(id)) {
        return planning(options);
    }
    options
        .refuse(&PLANNING, "on a preview, which shows the file's order")
        .or_else(|| sheet(options))
        .or_else(|| margin(options))
}

/// Whether a preview is a page, which shows a plan.
fn is_page(options: &Given<'_>) -> bool {
    let output = options.text("output").to_ascii_lowercase();
    let by_extension = [".html", ".htm"].iter().any(|extension| output.ends_with(extension));
    options.text("format") == "html" || by_extension && !options.has("format")
}

#[cfg(test)]
mod tests {
    use std::fmt::Write as _;

    use clap::CommandFactory as _;

    use super::*;
    use crate::cli::Arguments;

    /// Each option with a value that it takes.
    const VALUES: [(&str, Option<&str>); 43] = [
        ("--color-by", Some("speed")),
        ("--at", Some("2s")),
        ("--animate", Some("9s")),
        ("--tolerance", Some("0.2mm")),
        ("--period", Some("20ms")),
        ("--order", Some("optimize")),
        ("--effort", Some("1")),
        ("--dedupe", None),
        ("--keep-direction", None),
        ("--pen-order", Some("2,1")),
        ("--speed", Some("file")),
        ("--overlap-lifts", None),
        ("--law", Some("trapezoid")),
        ("--segment-time", Some("1s")),
        ("--rounding", Some("nearest")),
        ("--allow-over-limit", None),
        ("--fit", None),
        ("--shrink", None),
        ("--align", Some("center")),
        ("--place", Some("1,1")),
        ("--place", Some("best")),
        ("--for", Some("time")),
        ("--scale", Some("2")),
        ("--rotate", Some("90")),
        ("--mirror", Some("x")),
        ("--margin", Some("5mm")),
        ("--paper", Some("a4")),
        ("--hpgl2", None),
        ("--pen-by", Some("servo")),
        ("--pen-positions", Some("1,2")),
        ("--page", Some("2")),
        ("--plotter", Some("hp7475a")),
        ("--made-for", Some("hp7475a")),
        ("--only-pens", Some("1,3")),
        ("--pen-map", Some("2=1,4=2")),
        ("--copies", Some("3x2")),
        ("--gap", Some("5mm")),
        ("--crop", Some("sheet")),
        ("--split", Some("pens")),
        ("--text", Some("outlines")),
        ("--font", Some("a.ttf")),
        ("--machine", Some("corexy")),
        ("--white-pens", Some("skip")),
    ];

    /// `-` where the option is no option of the command, `yes` where it has an effect, else the reason.
    fn verdict(words: &[&str], option: &str, value: Option<&str>) -> String {
        let words = words.iter().copied().chain([option]).chain(value);
        match Arguments::command().try_get_matches_from(words) {
            Err(error) if error.kind() == clap::error::ErrorKind::UnknownArgument => "-".to_owned(),
            Err(error) => format!("{:?}", error.kind()),
            Ok(matches) => without_effect(&matches).unwrap_or_else(|| "yes".to_owned()),
        }
    }

    #[test]
    fn every_option_of_every_command_and_format() {
        let mut table = String::new();
        let mut row = |words: &[&str]| {
            let _ = writeln!(table, "{}", words[1..].join(" "));
            for (option, value) in VALUES {
                let _ = writeln!(table, "  {option:<18} {}", verdict(words, option, value));
            }
        };
        let formats = ["ticks", "csv", "json", "hpgl", "svg"];
        let all = formats.into_iter().chain(backends::ALL.iter().map(|backend| backend.name()));
        let mut seen = Vec::new();
        for format in all {
            let words = ["plotplan", "convert", "x.hpgl", "--format", format];
            let is_format = Arguments::command().try_get_matches_from(words).is_ok();
            if is_format && !seen.contains(&format) {
                seen.push(format);
                row(&words);
            }
        }
        row(&["plotplan", "convert", "x.svg", "--format", "hpgl", "--plotter", "draftpro"]);
        row(&["plotplan", "convert", "x.hpgl", "--order", "file"]);
        row(&["plotplan", "convert", "x.hpgl", "--law", "sine"]);
        row(&["plotplan", "convert", "x.hpgl", "--format", "hpgl", "--order", "optimize"]);
        row(&["plotplan", "convert", "x.hpgl", "--format", "svg", "--paper", "a4", "--fit"]);
        row(&["plotplan", "convert", "x.hpgl", "--format", "svg", "--machine", "corexy"]);
        for command in ["check", "info"] {
            row(&["plotplan", command, "x.hpgl"]);
            row(&["plotplan", command, "x.hpgl", "-mcorexy"]);
        }
        row(&["plotplan", "preview", "x.hpgl", "-ox.svg"]);
        row(&["plotplan", "preview", "x.hpgl", "-ox.svg", "-mcorexy"]);
        row(&["plotplan", "preview", "x.hpgl", "-ox.svg", "--paper", "a4"]);
        row(&["plotplan", "preview", "x.hpgl", "-ox.html", "-mcorexy"]);
        row(&["plotplan", "preview", "x.hpgl", "-ox.svg", "-mcorexy", "--at", "1s"]);
        row(&["plotplan", "simulate", "x.hpgl", "-mcoaxial"]);
        row(&["plotplan", "simulate", "-mcoaxial", "--step", "3200"]);
        row(&["plotplan", "tune", "-mcoaxial"]);
        row(&["plotplan", "tune", "-mcoaxial", "-dx.hpgl"]);
        row(&["plotplan", "tune", "--from-step", "x.csv"]);
        row(&["plotplan", "calibrate", "coaxial", "x.csv"]);
        row(&["plotplan", "calibrate", "coaxial", "--pattern"]);
        row(&["plotplan", "verify", "x.csv"]);
        row(&["plotplan", "verify", "x.csv", "-dx.hpgl"]);
        insta::assert_snapshot!(table);
    }
}
