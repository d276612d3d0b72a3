//! What plotters can do: one data file each in `plotters/`.

use std::sync::LazyLock;

use drawing::{Affine, Rect};
use serde::Deserialize;

/// The built-in data files: name and text. A new plotter is one file and one line here.
const FILES: &[(&str, &str)] = &[
    ("hp7440a", include_str!("../../plotters/hp7440a.toml")),
    ("hp7470a", include_str!("../../plotters/hp7470a.toml")),
    ("hp7475a", include_str!("../../plotters/hp7475a.toml")),
    ("hp7550a", include_str!("../../plotters/hp7550a.toml")),
    ("hp7580b", include_str!("../../plotters/hp7580b.toml")),
    ("draftpro", include_str!("../../plotters/draftpro.toml")),
    ("designjet", include_str!("../../plotters/designjet.toml")),
    ("roland-dxy", include_str!("../../plotters/roland-dxy.toml")),
    ("generic", include_str!("../../plotters/generic.toml")),
];

/// How a plotter keeps its buffer from overflowing.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Handshake {
    /// The sender asks for the free room (`ESC.B`).
    Polling,
    /// The plotter sends XOFF and XON.
    XonXoff,
    /// The plotter drops DTR, which the cable connects to CTS.
    Hardware,
}

/// The largest coordinate of HP-GL, plotter units.
const LARGEST_COORDINATE: i64 = 32_767;

/// A sheet in a plotter.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Paper {
    /// Its name: `a4`.
    pub name: String,
    /// Where the pen can go, plotter units: left, bottom, right, top.
    pub hard_clip: [i64; 4],
    /// Default P1 and P2, plotter units: x1, y1, x2, y2; `None` if unknown.
    pub scaling_points: Option<[i64; 4]>,
    /// The instruction that selects it, if there is one.
    #[serde(default)]
    pub select: String,
    /// Whether two independent sources give these limits.
    #[serde(default)]
    pub checked: bool,
}

/// A plotter: its units, limits, buffer, instructions and handshakes.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Plotter {
    /// Its name on the command line; for a file of the user's, the file's name.
    #[serde(skip)]
    pub name: String,
    /// What it is.
    pub title: String,
    /// Its answers to `OI`; empty if any answer is taken.
    #[serde(default)]
    pub identification: Vec<String>,
    /// Size of a plotter unit, mm.
    pub unit_mm: f64,
    /// How many pens it holds.
    pub pens: u16,
    /// Size of its input buffer, bytes.
    pub buffer_bytes: usize,
    /// How the buffer can be kept from overflowing.
    pub handshakes: Vec<Handshake>,
    /// Highest speed with the pen down, cm/s, as `VS` takes it.
    pub max_speed_cm_s: f64,
    /// The instructions that it knows; empty if unknown.
    #[serde(default)]
    commands: String,
    /// What precedes the drawing, before `IN`.
    #[serde(default)]
    pub prologue: String,
    /// What follows the drawing.
    #[serde(default)]
    pub epilogue: String,
    /// The sheets that it takes.
    #[serde(rename = "paper")]
    pub papers: Vec<Paper>,
}

/// Why there is no such plotter or paper.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PlotterError {
    /// No plotter has this name.
    #[error("unknown plotter `{name}`; known: {known}, or a TOML file with the limits of another one")]
    Unknown {
        /// The name asked for.
        name: String,
        /// All names.
        known: String,
    },
    /// The plotter does not take this paper.
    #[error("{plotter} has no paper `{paper}`; it takes {known}")]
    Paper {
        /// The plotter's name.
        plotter: String,
        /// The paper asked for.
        paper: String,
        /// All papers.
        known: String,
    },
    /// The data file cannot be used.
    #[error("{file}: {what}")]
    File {
        /// Name of the file.
        file: String,
        /// What is wrong with it.
        what: String,
    },
}

/// All built-in plotters, in the order of the command line's help.
pub fn plotters() -> &'static [Plotter] {
    static ALL: LazyLock<Vec<Plotter>> = LazyLock::new(|| {
        // A test reads every file.
        FILES.iter().filter_map(|(name, text)| Plotter::parse(name, text).ok()).collect()
    });
    &ALL
}

impl Plotter {
    /// The built-in plotter of this name, in any case.
    ///
    /// # Errors
    /// When there is none.
    pub fn named(name: &str) -> Result<&'static Self, PlotterError> {
        let found = plotters().iter().find(|plotter| plotter.name.eq_ignore_ascii_case(name));
        found.ok_or_else(|| {
            let known: Vec<&str> = plotters().iter().map(|plotter| plotter.name.as_str()).collect();
            PlotterError::Unknown { name: name.to_owned(), known: known.join(", ") }
        })
    }

    /// What is assumed of a plotter that is not known.
    ///
    /// # Panics
    /// Never: a test reads every built-in file.
    pub fn generic() -> &'static Self {
        &plotters()[plotters().len() - 1]
    }

    /// The built-in plotter that answers `OI` like this; the revision after a comma does not count.
    pub fn identified(answer: &str) -> Option<&'static Self> {
        plotters().iter().find(|plotter| !plotter.identification.is_empty() && plotter.answers_as(answer))
    }

    /// Reads a data file.
    ///
    /// # Errors
    /// A file that is no TOML, has unknown keys or impossible values.
    pub fn parse(name: &str, text: &str) -> Result<Self, PlotterError> {
        let file = |what: String| PlotterError::File { file: name.to_owned(), what };
        let mut plotter: Self = toml::from_str(text).map_err(|error| file(error.to_string()))?;
        name.clone_into(&mut plotter.name);
        match plotter.fault() {
            None => Ok(plotter),
            Some(what) => Err(file(what)),
        }
    }

    /// What is impossible about it.
    fn fault(&self) -> Option<String> {
        if !(self.unit_mm > 1e-4 && self.unit_mm < 1.0) {
            return Some(format!("unit_mm is {}; a plotter unit has 0.0001 to 1 mm", self.unit_mm));
        }
        if self.buffer_bytes < 40 || self.pens == 0 || self.papers.is_empty() {
            return Some(
                "needs a buffer_bytes of 40 or more, at least one pen and at least one [[paper]]".into(),
            );
        }
        if self.max_speed_cm_s.is_nan() || self.max_speed_cm_s <= 0.0 {
            return Some("max_speed_cm_s must be positive".into());
        }
        if self.handshakes.is_empty() {
            return Some("handshakes must name polling, xon-xoff or hardware".into());
        }
        self.papers.iter().find_map(|paper| {
            let [left, bottom, right, top] = paper.hard_clip;
            let is_area = left < right && bottom < top;
            let is_small = self.is_hpgl2() || paper.hard_clip.iter().all(|u| u.abs() <= LARGEST_COORDINATE);
            (!is_area || !is_small).then(|| {
                format!(
                    "hard_clip of paper `{}` is not left, bottom, right, top in plotter units",
                    paper.name
                )
            })
        })
    }

    /// Whether it is entered as HP-GL/2, which has no limit of 16 bits.
    fn is_hpgl2(&self) -> bool {
        self.prologue.contains("%-1B") || self.prologue.contains("%0B") || self.prologue.contains("%1B")
    }

    /// The paper of this name (the first if none is given), in any case.
    ///
    /// # Errors
    /// When it does not take such a paper.
    pub fn paper(&self, name: Option<&str>) -> Result<&Paper, PlotterError> {
        let wanted = match name.unwrap_or_default().to_ascii_lowercase() {
            name if name == "letter" => "a".to_owned(),
            name if name == "tabloid" => "b".to_owned(),
            name => name,
        };
        let found = self.papers.iter().find(|paper| wanted.is_empty() || paper.name == wanted);
        found.ok_or_else(|| {
            let known: Vec<&str> = self.papers.iter().map(|paper| paper.name.as_str()).collect();
            PlotterError::Paper { plotter: self.name.clone(), paper: wanted, known: known.join(", ") }
        })
    }

    /// Whether it knows the instruction; true if its instructions are unknown.
    pub fn knows(&self, mnemonic: &str) -> bool {
        self.commands.is_empty() || self.commands.split_ascii_whitespace().any(|known| known == mnemonic)
    }

    /// Whether it has this handshake.
    pub fn has(&self, handshake: Handshake) -> bool {
        self.handshakes.contains(&handshake)
    }

    /// Whether it answers `OI` like this.
    pub fn answers_as(&self, answer: &str) -> bool {
        let model = answer.split(',').next().unwrap_or_default().trim();
        self.identification.is_empty() || self.identification.iter().any(|own| own == model)
    }

    /// The longest instruction that is written for it, bytes: a third of its buffer, so that one is
    /// drawn while the next one arrives, and never more than senders of others take.
    pub fn line_bytes(&self) -> usize {
        (self.buffer_bytes / 3).clamp(36, 120)
    }
}

/// A sheet in a plotter, and how it lies in front of the operator.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sheet<'a> {
    /// The plotter.
    pub plotter: &'a Plotter,
    /// Its paper.
    pub paper: &'a Paper,
    /// Whether the drawing is turned by a quarter: its x axis along the plotter's y axis.
    pub turned: bool,
}

impl<'a> Sheet<'a> {
    /// The sheet named by `--paper`: `a4`, `a4,landscape`, `a4,portrait`. The plotter's own
    /// orientation, unless one is asked for.
    ///
    /// # Errors
    /// When the plotter does not take such a paper.
    pub fn named(plotter: &'a Plotter, paper: Option<&str>) -> Result<Self, PlotterError> {
        let (name, orientation) = match paper.and_then(|paper| paper.split_once(',')) {
            Some((name, orientation)) => (Some(name), Some(orientation)),
            None => (paper, None),
        };
        let known = plotter.paper(name.map(str::trim))?;
        let [left, bottom, right, top] = known.hard_clip;
        let is_landscape = right - left >= top - bottom;
        let turned = match orientation.map(str::trim) {
            None => false,
            Some("landscape") => !is_landscape,
            Some("portrait") => is_landscape,
            Some(_) => {
                let (plotter, paper) = (plotter.name.clone(), paper.unwrap_or_default().to_owned());
                let known = "NAME, NAME,landscape or NAME,portrait".to_owned();
                return Err(PlotterError::Paper { plotter, paper, known });
            }
        };
        Ok(Self { plotter, paper: known, turned })
    }

    /// What the pen reaches as the drawing sees it, mm: its lower left corner is the origin.
    pub fn area_mm(&self) -> Rect {
        let [left, bottom, right, top] = self.paper.hard_clip.map(|units| units as f64);
        let (width, height) = ((right - left) * self.plotter.unit_mm, (top - bottom) * self.plotter.unit_mm);
        if self.turned { Rect::new(0.0, 0.0, height, width) } else { Rect::new(0.0, 0.0, width, height) }
    }

    /// From mm on the sheet to plotter units.
    ///
    /// Not turned: `(X, Y) = (left, bottom) + (x, y) / unit`. Turned clockwise by a quarter:
    /// `(X, Y) = (left, top) + (y, -x) / unit`. Computed here and not left to `RO`, which small
    /// plotters lack and which each handles in its own way.
    pub fn to_units(&self) -> Affine {
        let [left, bottom, _, top] = self.paper.hard_clip.map(|units| units as f64);
        let per_mm = 1.0 / self.plotter.unit_mm;
        if self.turned {
            Affine::new([0.0, -per_mm, per_mm, 0.0, left, top])
        } else {
            Affine::new([per_mm, 0.0, 0.0, per_mm, left, bottom])
        }
    }
}

/// The built-in plotters with their papers, one a line.
pub fn list() -> String {
    use std::fmt::Write as _;

    let mut text = String::new();
    for plotter in plotters() {
        let _ = writeln!(text, "{:<11} {}", plotter.name, plotter.title);
        for paper in &plotter.papers {
            let sheet = Sheet { plotter, paper, turned: false };
            let area = sheet.area_mm();
            let [left, bottom, right, top] = paper.hard_clip;
            let mark = if paper.checked { "" } else { "  one source: compare with OH" };
            let _ = writeln!(
                text,
                "            {:<4} {:6.1} x {:6.1} mm  ({left},{bottom} to {right},{top}){mark}",
                paper.name,
                area.width(),
                area.height()
            );
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use drawing::Point;

    use super::*;

    #[test]
    fn every_plotter_file_is_read() -> Result<(), PlotterError> {
        for (name, text) in FILES {
            let plotter = Plotter::parse(name, text)?;
            assert_eq!(Plotter::named(name)?, &plotter);
            // The encoder needs these on every plotter.
            for needed in ["IN", "SP", "PU", "PD", "PA"] {
                assert!(plotter.knows(needed), "{name} lacks {needed}");
            }
        }
        assert_eq!(plotters().len(), FILES.len());
        assert_eq!(Plotter::generic().name, "generic");
        Ok(())
    }

    #[test]
    fn sheet_corners_are_hard_clip_corners() {
        for plotter in plotters() {
            for paper in &plotter.papers {
                for turned in [false, true] {
                    let sheet = Sheet { plotter, paper, turned };
                    let area = sheet.area_mm();
                    let corners = [Point::new(0.0, 0.0), Point::new(area.x1, area.y1)];
                    let [a, b] = corners.map(|corner| sheet.to_units() * corner);
                    let units = Rect::from_points(a, b);
                    let clip = paper.hard_clip.map(|u| u as f64);
                    let off =
                        [units.x0 - clip[0], units.y0 - clip[1], units.x1 - clip[2], units.y1 - clip[3]];
                    assert!(
                        off.iter().all(|off| off.abs() < 1e-6),
                        "{} {}: {off:?}",
                        plotter.name,
                        paper.name
                    );
                    // A rotation, never a reflection.
                    assert!(sheet.to_units().determinant() > 0.0, "{}", plotter.name);
                }
            }
        }
    }

    #[test]
    fn papers_by_name_and_orientation() -> Result<(), PlotterError> {
        let plotter = Plotter::named("HP7475A")?;
        assert!(!Sheet::named(plotter, Some("A4"))?.turned);
        assert!(!Sheet::named(plotter, Some("A4,landscape"))?.turned);
        assert!(Sheet::named(plotter, Some("a3,portrait"))?.turned);
        assert_eq!(Sheet::named(plotter, Some("letter"))?.paper.name, "a");
        assert!(Sheet::named(plotter, Some("a0")).is_err());
        assert!(Sheet::named(plotter, Some("a4,upright")).is_err());
        // The long side of the 7580's A4 lies along y.
        let large = Plotter::named("hp7580b")?;
        assert!(!Sheet::named(large, Some("a4,portrait"))?.turned);
        assert!(Sheet::named(large, Some("a4,landscape"))?.turned);
        assert_eq!(Plotter::identified("7550A").map(|plotter| plotter.name.as_str()), Some("hp7550a"));
        assert_eq!(Plotter::identified("7475A,1"), Some(plotter));
        assert_eq!(Plotter::identified("what?"), None);
        Ok(())
    }

    #[test]
    fn impossible_data_files_are_refused() {
        let (_, good) = FILES[FILES.len() - 1];
        for (from, to) in [
            ("unit_mm = 0.025", "unit_mm = 25"),
            ("buffer_bytes = 60", "buffer_bytes = 0"),
            ("pens = 8", "pens = 8\npencils = 1"),
            ("[0, 0, 10880, 7640]", "[0, 0, 10880, 40000]"),
            ("[0, 0, 10880, 7640]", "[0, 7640, 10880, 0]"),
            ("max_speed_cm_s = 38.1", "max_speed_cm_s = 0"),
        ] {
            let bad = good.replace(from, to);
            assert_ne!(bad, good, "{from}");
            assert!(matches!(Plotter::parse("own.toml", &bad), Err(PlotterError::File { .. })), "{to}");
        }
    }
}
