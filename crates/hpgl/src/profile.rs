//! The plotter that a file is read for, where the file does not define it.

use drawing::{Point, Rect};

use crate::units::{PLOTTER_UNIT_7475A_MM, PLOTTER_UNIT_MM};

/// Properties of the plotter that the file does not define.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// Size of a plotter unit, mm: 0.025 by default.
    pub plotter_unit_mm: f64,
    /// The scaling points P1 and P2 until the file sets others, plotter units.
    pub scaling_points: (Point, Point),
    /// The area that the plotter can reach, plotter units. `RO` turns within it and `IR` measures
    /// by it.
    pub hard_clip: Rect,
    /// Whether ink outside `hard_clip` is cut off, as the plotter does. Not by default: many files
    /// are made for larger plotters than the one that is assumed.
    pub clips_at_limits: bool,
    /// Whether the file may choose scaling points and hard clip: by the paper that `PS` names by
    /// its code, and by being HP-GL/2, where P1 and P2 are the corners of the page.
    pub automatic: bool,
    /// The byte that ends labels until `DT` names another; ETX (3) if nothing is given.
    pub label_terminator: Option<u8>,
}

impl Default for Options {
    /// An HP 7475A with A4 paper (its P1, P2 and hard clip limits), but with the plotter unit of
    /// all other machines; the file may choose otherwise.
    fn default() -> Self {
        let [a4, ..] = PAPERS_7475A;
        Self { automatic: true, clips_at_limits: false, ..Self::on(PLOTTER_UNIT_MM, a4) }
    }
}

impl Options {
    fn on(plotter_unit_mm: f64, paper: &Paper) -> Self {
        let [x1, y1, x2, y2] = paper.scaling_points;
        let [left, bottom, right, top] = paper.hard_clip;
        Self {
            plotter_unit_mm,
            scaling_points: (Point::new(x1, y1), Point::new(x2, y2)),
            hard_clip: Rect::new(left, bottom, right, top),
            clips_at_limits: true,
            automatic: false,
            label_terminator: None,
        }
    }

    /// The options of one of the [`plotters`] with one of its papers (its first if none is named),
    /// in any case; `None` if there is no such plotter or paper.
    pub fn for_plotter(plotter: &str, paper: Option<&str>) -> Option<Self> {
        let plotter = PLOTTERS.iter().find(|known| known.name.eq_ignore_ascii_case(plotter))?;
        let paper = match paper {
            None => plotter.papers.first()?,
            Some(paper) => plotter.papers.iter().find(|known| known.name.eq_ignore_ascii_case(paper))?,
        };
        Some(Self::on(plotter.unit_mm, paper))
    }
}

/// A plotter that files were made for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plotter {
    /// Its name in options: `hp7475a`.
    pub name: &'static str,
    /// What it is.
    pub title: &'static str,
    /// Size of its plotter unit, mm.
    pub unit_mm: f64,
    /// The papers that it takes.
    pub papers: &'static [Paper],
}

/// A paper in a plotter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Paper {
    /// Its name in options: `a4`.
    pub name: &'static str,
    /// Default P1 and P2, plotter units: x1, y1, x2, y2.
    pub scaling_points: [f64; 4],
    /// Where the pen can go, plotter units: left, bottom, right, top.
    pub hard_clip: [f64; 4],
}

/// The plotters whose geometry is built in.
pub fn plotters() -> &'static [Plotter] {
    PLOTTERS
}

/// Scaling points and hard clip of the 7475A. The hard clip limits are those that vpype writes
/// files for, the scaling points of A4 and A3 those that firmware emulating the machine has.
const PAPERS_7475A: &[Paper; 4] = &[
    Paper {
        name: "a4",
        scaling_points: [603.0, 521.0, 10603.0, 7721.0],
        hard_clip: [0.0, 0.0, 11040.0, 7721.0],
    },
    Paper {
        name: "a3",
        scaling_points: [170.0, 602.0, 15370.0, 10602.0],
        hard_clip: [0.0, 0.0, 16158.0, 11040.0],
    },
    Paper {
        name: "a",
        scaling_points: [250.0, 596.0, 10250.0, 7796.0],
        hard_clip: [0.0, 0.0, 10365.0, 7962.0],
    },
    Paper {
        name: "b",
        scaling_points: [522.0, 259.0, 15722.0, 10259.0],
        hard_clip: [0.0, 0.0, 16640.0, 10365.0],
    },
];

/// A page of HP-GL/2: P1 and P2 are its corners, the origin is the lower left one.
const fn page(name: &'static str, width_mm: f64, height_mm: f64) -> Paper {
    let area = [0.0, 0.0, width_mm * 40.0, height_mm * 40.0];
    Paper { name, scaling_points: area, hard_clip: area }
}

/// A sheet with the origin in its middle, as large plotters have it; P1 and P2 are the corners of
/// what the pen reaches.
const fn centred(name: &'static str, half_width: f64, half_height: f64) -> Paper {
    let area = [-half_width, -half_height, half_width, half_height];
    Paper { name, scaling_points: area, hard_clip: area }
}

const PLOTTERS: &[Plotter] = &[
    Plotter { name: "hp7475a", title: "HP 7475A", unit_mm: PLOTTER_UNIT_7475A_MM, papers: PAPERS_7475A },
    Plotter {
        name: "hp7550a",
        title: "HP 7550A, taken with the 7475A's scaling points and its own plotter unit",
        unit_mm: PLOTTER_UNIT_MM,
        papers: PAPERS_7475A,
    },
    Plotter {
        name: "centred",
        title: "large plotters with the origin in the middle of the sheet (DraftMaster, Artisan)",
        unit_mm: PLOTTER_UNIT_MM,
        papers: &[
            centred("a1", 16068.0, 11303.0),
            centred("a2", 11115.0, 7937.0),
            centred("a3", 7686.0, 5397.0),
            centred("a4", 5146.0, 3746.0),
        ],
    },
    Plotter {
        name: "hpgl2",
        title: "HP-GL/2 and RTL: the whole page, its corners as scaling points",
        unit_mm: PLOTTER_UNIT_MM,
        papers: &[
            page("a4", 297.0, 210.0),
            page("a3", 420.0, 297.0),
            page("a2", 594.0, 420.0),
            page("a1", 841.0, 594.0),
            page("a0", 1189.0, 841.0),
            page("letter", 279.4, 215.9),
            page("tabloid", 431.8, 279.4),
        ],
    },
];

/// What `PS` with a code means on the 7475A: 0 to 3 the larger paper, 4 to 127 the smaller one.
pub(crate) fn paper_of_code(code: f64) -> &'static Paper {
    let [a4, a3, ..] = PAPERS_7475A;
    if code < 4.0 { a3 } else { a4 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn plotter_lookup_by_name() {
        let a3 = Options::for_plotter("HP7475A", Some("A3")).map(|options| options.hard_clip);
        assert_eq!(a3, Some(Rect::new(0.0, 0.0, 16158.0, 11040.0)));
        assert!(Options::for_plotter("hp7475a", Some("a0")).is_none());
        assert!(Options::for_plotter("pencil", None).is_none());
        for plotter in plotters() {
            let options = Options::for_plotter(plotter.name, None);
            assert!(options.is_some_and(|options| options.hard_clip.area() > 0.0), "{}", plotter.name);
        }
    }
}
