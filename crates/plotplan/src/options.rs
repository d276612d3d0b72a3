//! Options that would have no effect are refused, for all commands in one place.

use clap::ArgMatches;
use clap::parser::ValueSource;

use crate::cli::Format;

/// Options of planning proper.
const PLANNING: [&str; 12] = [
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
    "allow_over_limit",
];
/// Options of placement.
const PLACEMENT: [&str; 8] = ["fit", "shrink", "align", "place", "scale", "rotate", "mirror", "margin"];
/// Options of the ordering that `--order file` leaves out.
const ORDERING: [&str; 4] = ["effort", "dedupe", "keep_direction", "pen_order"];
/// Options of the firmware's pen.
const PEN: [&str; 2] = ["pen_by", "pen_positions"];
/// Options of the reader of a drawing.
const READING: [&str; 7] = ["page", "plotter", "paper", "pens", "hatch", "outline_fills", "dpi"];

/// The first option given that has no effect, and why: `--scale has no effect with --format svg`.
pub(crate) fn without_effect(matches: &ArgMatches) -> Option<String> {
    let (command, given) = matches.subcommand()?;
    let options = Given(given);
    match command {
        "convert" => convert(&options),
        "check" | "info" | "preview" => drawing(command, &options),
        "verify" if !options.has("drawing") => options.refuse(&READING, "without --drawing"),
        _ => None,
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
}

fn convert(options: &Given<'_>) -> Option<String> {
    let format = match options.text("format") {
        given if given.is_empty() => {
            Format::of_extension(&options.text("output")).unwrap_or_default().name().to_owned()
        }
        given => given,
    };
    if format == "hpgl" || format == "svg" {
        let why = format!("with --format {format}: it writes the drawing as it is");
        let hpgl2 = options.refuse(&["hpgl2"], &why).filter(|_| format == "svg");
        let paper = options.has_machine_paper().then(|| format!("--paper has no effect {why}"));
        return hpgl2
            .or_else(|| options.refuse(&["machine"], &why))
            .or_else(|| options.refuse(&PLANNING, &why))
            .or_else(|| options.refuse(&PLACEMENT, &why))
            .or_else(|| options.refuse(&PEN, &why))
            .or(paper);
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
    let has_margin = ["fit", "shrink", "align"].iter().any(|id| options.has(id));
    options
        .refuse(&["segment_time"], &format!("with --law {law}"))
        .filter(|_| !is_fixed_duration)
        .or_else(|| {
            options.refuse(&ORDERING, "with --order file").filter(|_| options.text("order") == "file")
        })
        .or_else(|| options.refuse(&["margin"], "without --fit, --shrink or --align").filter(|_| !has_margin))
}

fn drawing(command: &str, options: &Given<'_>) -> Option<String> {
    if !options.has("machine") {
        let why = "without --machine";
        let paper = options.has_machine_paper().then(|| format!("--paper has no effect {why}"));
        return options.refuse(&PLANNING, why).or_else(|| options.refuse(&PLACEMENT, why)).or(paper);
    }
    if command == "preview" {
        return options
            .refuse(&PLANNING, "on a preview, which shows the file's order")
            .or_else(|| planning(options));
    }
    planning(options)
}

#[cfg(test)]
mod tests {
    use std::fmt::Write as _;

    use clap::CommandFactory as _;

    use super::*;
    use crate::cli::Arguments;

    /// Each option with a value that it takes.
    const VALUES: [(&str, Option<&str>); 27] = [
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
        ("--allow-over-limit", None),
        ("--fit", None),
        ("--shrink", None),
        ("--align", Some("center")),
        ("--place", Some("1,1")),
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
        ("--machine", Some("corexy")),
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
        row(&["plotplan", "convert", "x.hpgl", "--order", "file"]);
        row(&["plotplan", "convert", "x.hpgl", "--law", "sine"]);
        for command in ["check", "info"] {
            row(&["plotplan", command, "x.hpgl"]);
            row(&["plotplan", command, "x.hpgl", "-mcorexy"]);
        }
        row(&["plotplan", "preview", "x.hpgl", "-ox.svg"]);
        row(&["plotplan", "preview", "x.hpgl", "-ox.svg", "-mcorexy"]);
        row(&["plotplan", "verify", "x.csv"]);
        row(&["plotplan", "verify", "x.csv", "-dx.hpgl"]);
        insta::assert_snapshot!(table);
    }
}
