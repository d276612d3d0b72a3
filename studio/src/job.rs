//! What the page asks for: a machine and the options of the command line, as text.

use compiler::best_place::{BestFor, Search};
use compiler::import::{self, PenRule, SvgOptions};
use compiler::layout::{Copies, Layout};
use compiler::machine_file::{MachineFile, MachineFileError, PRESETS};
use compiler::option;
use compiler::pipeline::{Order, Request};
use compiler::report::BestPlaceReport;
use drawing::{Pen, Vec2};
use kinematics::Machine;
use planner::{Easing, Mirror, PlacementOptions, Rounding, Scale, TimingLaw};
use serde::Deserialize;

use crate::problem::{About, Problem, Problems};

/// The tolerance without `--tolerance`, mm.
const TOLERANCE_MM: f64 = 0.1;
/// The time of a segment without `--segment-time`, s.
const SEGMENT_TIME_S: f64 = 0.5;
/// The effort without `--effort`.
const EFFORT: u8 = 2;
/// A draft is planned with this many times the tolerance.
const DRAFT_TOLERANCE: f64 = 4.0;

/// A drawing to be planned. The drawing itself is that of [`crate::Studio::open`].
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Job {
    /// The machine.
    pub machine: MachineChoice,
    /// The options.
    pub options: Options,
    /// Quick and coarse, while something is dragged: file order, smoothest paths, four times the
    /// tolerance. Outputs are never drafts.
    pub draft: bool,
}

/// A preset, or a machine file.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct MachineChoice {
    /// Name of the preset, or of the machine file.
    pub name: String,
    /// The text of the machine file; the preset's if empty.
    pub toml: String,
}

/// Options of `convert`, as text on its command line without the name of the option; empty where not
/// given.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Options {
    /// `--tolerance`
    pub tolerance: String,
    /// `--period`
    pub period: String,
    /// `--order`: `optimize` or `file`
    pub order: String,
    /// `--effort`: 0 to 3
    pub effort: String,
    /// `--speed`: `machine` or `file`
    pub speed: String,
    /// `--law`: `time-optimal`, `trapezoid`, `linear`, `sine` or `quadratic`
    pub law: String,
    /// `--segment-time`, with one of the last three
    pub segment_time: String,
    /// `--rounding`: `path` or `nearest`
    pub rounding: String,
    /// `--fit`
    pub fit: bool,
    /// `--shrink`
    pub shrink: bool,
    /// `--align`
    pub align: String,
    /// `--place`: two lengths, or `best`
    pub place: String,
    /// `--for`: `time` or `accuracy`, with `--place best`
    #[serde(rename = "for")]
    pub best_for: String,
    /// `--scale`
    pub scale: String,
    /// `--rotate`
    pub rotate: String,
    /// `--mirror`: `x` or `y`
    pub mirror: String,
    /// `--margin`
    pub margin: String,
    /// `--page`
    pub page: String,
    /// `--paper`
    pub paper: String,
    /// `--only-pens`
    pub only_pens: String,
    /// `--copies`
    pub copies: String,
    /// `--gap`, with `--copies`
    pub gap: String,
    /// SVG: `--pens`: `layers`, `colors` or `one`
    pub pens: String,
    /// SVG: `--hatch`
    pub hatch: String,
    /// SVG: `--outline-fills`
    pub outline_fills: bool,
}

/// Which commands take an option.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Use {
    /// Plans.
    Motion,
    /// Plans, and drawings that are written in another order.
    Order,
    /// Everything that lies on a sheet.
    Place,
    /// Everything.
    Reading,
}

/// What a command line is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum For {
    /// A plan.
    Plan,
    /// A drawing.
    Drawing,
    /// A picture of the placed drawing.
    Picture,
}

impl Options {
    /// The options given, in the order of the program's help.
    fn given(&self) -> Vec<(Use, String)> {
        let text = |of: Use, name: &str, value: &str| {
            (!value.trim().is_empty()).then(|| (of, format!("--{name}={}", value.trim())))
        };
        let flag = |of: Use, name: &str, is_set: bool| is_set.then(|| (of, format!("--{name}")));
        [
            text(Use::Motion, "tolerance", &self.tolerance),
            text(Use::Motion, "period", &self.period),
            text(Use::Order, "order", &self.order),
            text(Use::Order, "effort", &self.effort),
            text(Use::Motion, "speed", &self.speed),
            text(Use::Motion, "law", &self.law),
            text(Use::Motion, "segment-time", self.segment_time_given()),
            text(Use::Motion, "rounding", &self.rounding),
            flag(Use::Place, "fit", self.fit),
            flag(Use::Place, "shrink", self.shrink),
            text(Use::Place, "align", &self.align),
            text(Use::Place, "place", &self.place),
            text(Use::Place, "for", if self.is_best_place() { &self.best_for } else { "" }),
            text(Use::Place, "scale", &self.scale),
            text(Use::Place, "rotate", &self.rotate),
            text(Use::Place, "mirror", &self.mirror),
            text(Use::Place, "margin", &self.margin),
            text(Use::Reading, "page", &self.page),
            text(Use::Reading, "paper", &self.paper),
            text(Use::Reading, "pens", &self.pens),
            text(Use::Reading, "hatch", &self.hatch),
            flag(Use::Reading, "outline-fills", self.outline_fills),
            text(Use::Reading, "only-pens", &self.only_pens),
            text(Use::Reading, "copies", &self.copies),
            text(Use::Reading, "gap", if self.copies.trim().is_empty() { "" } else { &self.gap }),
        ]
        .into_iter()
        .flatten()
        .collect()
    }

    /// Whether the best place is searched for.
    pub(crate) fn is_best_place(&self) -> bool {
        self.place.trim() == "best"
    }

    /// The time of a segment, if the law has one.
    fn segment_time_given(&self) -> &str {
        if ["linear", "sine", "quadratic"].contains(&self.law.trim()) { &self.segment_time } else { "" }
    }

    /// With the place that was found instead of a search.
    pub(crate) fn found(&self, best: &BestPlaceReport) -> Self {
        let [x, y] = best.place_mm;
        let rotate = if best.rotate_deg == 0.0 { String::new() } else { best.rotate_deg.to_string() };
        Self { place: format!("{x}mm,{y}mm"), rotate, margin: String::new(), ..self.clone() }
    }

    /// The options that a command of this kind takes.
    pub(crate) fn words(&self, purpose: For) -> Vec<String> {
        let is_ordered = self.order.trim() == "optimize";
        let takes = |of: Use| match purpose {
            For::Plan => true,
            For::Drawing => of != Use::Motion && (of != Use::Order || is_ordered),
            For::Picture => matches!(of, Use::Place | Use::Reading),
        };
        self.given().into_iter().filter(|(of, _)| takes(*of)).map(|(_, word)| word).collect()
    }

    /// How the drawing's file is read.
    ///
    /// # Errors
    /// Options that cannot be read.
    pub(crate) fn reading(&self) -> Result<import::Options, Problems> {
        let pens = choice(
            "pens",
            &self.pens,
            &[("layers", PenRule::Layers), ("colors", PenRule::Colors), ("one", PenRule::One)],
        )?;
        let hatch = parsed("hatch", &self.hatch, option::hatch)?;
        let svg = SvgOptions {
            pens: pens.unwrap_or_default(),
            hatch,
            outline_fills: self.outline_fills,
            dpi: None,
        };
        Ok(import::Options { svg, ..import::Options::default() })
    }

    /// What is drawn of the drawing.
    ///
    /// # Errors
    /// Options that cannot be read.
    pub(crate) fn layout(&self) -> Result<Layout, Problems> {
        let gap_mm = parsed("gap", &self.gap, option::length)?.unwrap_or_default();
        let copies = parsed("copies", &self.copies, option::grid)?;
        Ok(Layout {
            only_pens: parsed("only-pens", &self.only_pens, option::pens)?,
            copies: copies.map(|(columns, rows)| Copies { columns, rows, gap_mm }),
            ..Layout::default()
        })
    }

    /// The machine with the sheet that is asked for.
    pub(crate) fn on_paper(&self, machine: Machine) -> Result<Machine, Problems> {
        match parsed("paper", &self.paper, compiler::paper::size_mm)? {
            None => Ok(machine),
            Some([width_mm, height_mm]) => {
                let wrong = |error: kinematics::MachineError| Problem {
                    option: Some("paper"),
                    ..Problem::new(About::Option, format!("--paper {}: {error}", self.paper))
                };
                machine.with_sheet_size(width_mm, height_mm).map_err(|error| wrong(error).into())
            }
        }
    }

    /// The search for the best place, if one is asked for.
    fn search(&self) -> Result<Option<Search>, Problems> {
        let aim = choice("for", &self.best_for, &[("time", BestFor::Time), ("accuracy", BestFor::Accuracy)])?;
        let turns = self.rotate.trim().is_empty();
        Ok(self.is_best_place().then_some(Search { aim: aim.unwrap_or(BestFor::Time), turns }))
    }

    /// The page, from 1.
    pub(crate) fn page(&self) -> Result<usize, Problems> {
        let number =
            |text: &str| text.parse().ok().filter(|page| *page > 0).ok_or("expected a number from 1".into());
        Ok(parsed("page", &self.page, number)?.unwrap_or(1))
    }

    /// The order of the strokes; in drawings the file's unless another one is given.
    pub(crate) fn order(&self, is_plan: bool) -> Result<Order, Problems> {
        let effort = self.effort()?;
        let optimize = Order::Optimize(ordering::Options { effort, ..ordering::Options::default() });
        let given = choice("order", &self.order, &[("optimize", true), ("file", false)])?;
        Ok(if given.unwrap_or(is_plan) { optimize } else { Order::File })
    }

    fn effort(&self) -> Result<u8, Problems> {
        let level =
            |text: &str| text.parse().ok().filter(|level| *level <= 3).ok_or("expected 0 to 3".to_owned());
        Ok(parsed("effort", &self.effort, level)?.unwrap_or(EFFORT))
    }

    /// Where the drawing goes.
    pub(crate) fn placement(&self) -> Result<PlacementOptions, Problems> {
        let factor = parsed("scale", &self.scale, option::scale)?.unwrap_or(1.0);
        let scale = if self.fit {
            Scale::Fit
        } else if self.shrink {
            Scale::Shrink
        } else if let Some((x, y)) = parsed("align", &self.align, option::align)? {
            Scale::Aligned { factor, align: Vec2::new(x, y) }
        } else {
            let place = if self.is_best_place() { "" } else { &self.place };
            let (x, y) = parsed("place", place, option::place)?.unwrap_or_default();
            Scale::Explicit { factor, origin_mm: Vec2::new(x, y) }
        };
        Ok(PlacementOptions {
            mirror: choice("mirror", &self.mirror, &[("x", Mirror::X), ("y", Mirror::Y)])?,
            rotate_rad: parsed("rotate", &self.rotate, option::angle)?.unwrap_or_default(),
            scale,
            margin_mm: parsed("margin", &self.margin, option::length)?.unwrap_or_default(),
        })
    }
}

/// The value of an option; `None` where it is not given.
fn parsed<T>(
    name: &'static str,
    text: &str,
    parse: impl Fn(&str) -> Result<T, String>,
) -> Result<Option<T>, Problems> {
    let text = text.trim();
    if text.is_empty() {
        return Ok(None);
    }
    let wrong = |what: String| Problem {
        option: Some(name),
        ..Problem::new(About::Option, format!("--{name} {text}: {what}"))
    };
    parse(text).map(Some).map_err(|what| wrong(what).into())
}

/// One of several names.
fn choice<T: Copy>(name: &'static str, text: &str, known: &[(&str, T)]) -> Result<Option<T>, Problems> {
    parsed(name, text, |text| {
        let found = known.iter().find(|(name, _)| *name == text);
        let names = || known.iter().map(|(name, _)| *name).collect::<Vec<_>>().join(", ");
        found.map(|(_, value)| *value).ok_or_else(|| format!("expected one of {}", names()))
    })
}

impl Job {
    /// The machine with its sheet, and its file.
    ///
    /// # Errors
    /// What is wrong with the machine file or the paper.
    pub(crate) fn read_machine(&self) -> Result<(MachineFile, Machine), Problems> {
        let (file, machine) = self.machine.read()?;
        Ok((file, self.options.on_paper(machine)?))
    }

    /// The request for a page of a drawing.
    ///
    /// # Errors
    /// Options that cannot be read.
    pub(crate) fn request(&self, page: &import::Page, machine: &Machine) -> Result<Request, Problems> {
        let options = &self.options;
        let is_file_speed = choice("speed", &options.speed, &[("machine", false), ("file", true)])?;
        let of =
            |(pen, settings): (&Pen, &import::PenSettings)| settings.speed_mm_s.map(|speed| (*pen, speed));
        let pen_speeds = match is_file_speed {
            Some(true) => page.pens.iter().filter_map(of).filter(|(_, speed)| *speed > 0.0).collect(),
            _ => Vec::new(),
        };
        let period_s = parsed("period", &options.period, option::time)?.unwrap_or(machine.parts().period_s);
        let segment_time_s = parsed("segment-time", options.segment_time_given(), option::time)?;
        let segment_time_s = segment_time_s.unwrap_or(SEGMENT_TIME_S);
        let fixed = |easing| TimingLaw::FixedDuration { easing, segment_time_s };
        let law = choice(
            "law",
            &options.law,
            &[
                ("time-optimal", TimingLaw::TimeOptimal),
                ("trapezoid", TimingLaw::Trapezoid),
                ("linear", fixed(Easing::Linear)),
                ("sine", fixed(Easing::SineOut)),
                ("quadratic", fixed(Easing::QuadraticInOut)),
            ],
        )?;
        let rounding = choice(
            "rounding",
            &options.rounding,
            &[("path", Rounding::Path), ("nearest", Rounding::Nearest)],
        )?;
        let request = Request {
            tolerance_mm: parsed("tolerance", &options.tolerance, option::length)?.unwrap_or(TOLERANCE_MM),
            period_us: (period_s * 1e6).round().max(0.0) as u64,
            order: options.order(true)?,
            search: options.search()?,
            crop: None,
            placement: options.placement()?,
            pen_speeds,
            pen_colors: compiler::scene::pen_colors(page),
            lift_overlap_s: 0.0,
            timing_law: law.unwrap_or(TimingLaw::TimeOptimal),
            rounding: rounding.unwrap_or(Rounding::Path),
            joint_fit: options.effort()? > 0,
            allow_over_limit: false,
        };
        Ok(if self.draft { drafted(request) } else { request })
    }
}

/// The same, in less time.
fn drafted(request: Request) -> Request {
    Request {
        tolerance_mm: DRAFT_TOLERANCE * request.tolerance_mm,
        order: Order::File,
        // A search takes hundreds of plans.
        search: None,
        timing_law: TimingLaw::TimeOptimal,
        rounding: Rounding::Nearest,
        joint_fit: false,
        ..request
    }
}

impl MachineChoice {
    /// The preset of this name, if the text is that of it.
    fn preset(&self) -> Option<&'static str> {
        let preset = PRESETS.iter().find(|preset| preset.name == self.name)?;
        (self.toml.is_empty() || self.toml == preset.toml).then_some(preset.name)
    }

    /// The text of the machine file.
    pub fn text(&self) -> &str {
        let preset = PRESETS.iter().find(|preset| preset.name == self.name);
        if self.toml.is_empty() { preset.map_or("", |preset| preset.toml) } else { &self.toml }
    }

    /// What `--machine` is given: the preset, or the file's name.
    pub fn word(&self) -> String {
        if let Some(name) = self.preset() {
            return name.to_owned();
        }
        let stem: String =
            self.name.chars().map(|c| if c.is_ascii_alphanumeric() || c == '-' { c } else { '_' }).collect();
        format!("{}.toml", if stem.is_empty() { "machine" } else { &stem })
    }

    /// The machine.
    ///
    /// # Errors
    /// What is wrong with the file, with its line.
    pub fn read(&self) -> Result<(MachineFile, Machine), Problems> {
        let text = self.text();
        let file = MachineFile::parse(text).map_err(|error| problem(&error, text))?;
        let machine = file.machine().map_err(|error| problem(&error, text))?;
        Ok((file, machine))
    }
}

/// The problem of a machine file.
fn problem(error: &MachineFileError, text: &str) -> Problems {
    let line = error.line_in(text);
    let (message, help) = match error {
        MachineFileError::Syntax(syntax) => (syntax.message.clone(), syntax.help.clone()),
        other => {
            let causes = std::iter::successors(Some(other as &dyn std::error::Error), |error| error.source());
            (causes.map(ToString::to_string).collect::<Vec<_>>().join(": "), None)
        }
    };
    Problem { help, line, ..Problem::new(About::Machine, message) }.into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn machine_file_problems_have_their_line() {
        let toml = PRESETS[0].toml.replacen("l1 = \"206mm\"", "l1 = \"206deg\"", 1);
        let line = toml.lines().position(|line| line.contains("206deg")).map(|line| line + 1);
        let choice = MachineChoice { name: "coaxial".to_owned(), toml };
        let problems = choice.read().expect_err("an angle is no length");
        assert_eq!((problems.0[0].about, problems.0[0].line), (About::Machine, line));
        assert_eq!(choice.word(), "coaxial.toml");
    }

    #[test]
    fn option_problems_name_the_option() {
        let options = Options { rotate: "1mm".to_owned(), ..Options::default() };
        let problems = options.placement().expect_err("a length is no angle");
        assert_eq!(problems.0[0].option, Some("rotate"));
        assert!(problems.to_string().starts_with("--rotate 1mm: expected an angle"), "{problems}");
    }

    #[test]
    fn words_are_those_that_the_command_takes() {
        let options = Options {
            tolerance: "0.2mm".to_owned(),
            order: "file".to_owned(),
            rotate: "90".to_owned(),
            fit: true,
            hatch: "1mm,45".to_owned(),
            ..Options::default()
        };
        let words = |purpose| options.words(purpose).join(" ");
        assert_eq!(words(For::Plan), "--tolerance=0.2mm --order=file --fit --rotate=90 --hatch=1mm,45");
        assert_eq!(words(For::Drawing), "--fit --rotate=90 --hatch=1mm,45");
        assert_eq!(words(For::Picture), "--fit --rotate=90 --hatch=1mm,45");
    }
}
