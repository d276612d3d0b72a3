//! Whether a plotter can draw a program: its instructions, and its limits as it reports them.

use drawing::{Point, Rect};

use super::plotter::Plotter;
use super::state::mnemonic;
use crate::program::Program;

/// What the plotter reported about itself.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Limits {
    /// Its answer to `OH`: left, bottom, right, top.
    pub(crate) hard_clip: Option<[i64; 4]>,
    /// Its answer to `OP`: x1, y1, x2, y2.
    pub(crate) points: Option<[i64; 4]>,
    /// Instructions after which its position was compared.
    pub(crate) confirmed: usize,
}

/// Ink may lie this far beyond the limits: labels are not drawn with the plotter's own letters.
const ROUNDING_UNITS: f64 = 1.0;

/// Which instruction the plotter cannot execute, and why; `None` if it knows them all.
pub(crate) fn instruction_fault(program: &Program, plotter: &Plotter) -> Option<String> {
    for line in &program.lines {
        let name = mnemonic(&line.text);
        if !name.is_empty() && !plotter.knows(&name) {
            return Some(format!(
                "{} does not know the instruction {name} (stroke {}): write the drawing for it with convert --format hpgl --plotter {}",
                plotter.title, line.row, plotter.name
            ));
        }
        let bytes = line.text.chars().count();
        if bytes > plotter.buffer_bytes {
            return Some(format!(
                "an instruction of {bytes} bytes ({name}) does not fit the plotter's buffer of {} bytes",
                plotter.buffer_bytes
            ));
        }
    }
    None
}

/// Why the plotter cannot draw the program; `None` if it can.
pub(crate) fn fault(program: &Program, plotter: &Plotter, limits: &Limits) -> Option<String> {
    if let Some(why) = instruction_fault(program, plotter) {
        return Some(why);
    }
    let ink = ink_units(program, limits)?;
    let (clip, source) = match limits.hard_clip {
        Some(clip) => (clip, "it reports the limits (OH)"),
        // It cannot be asked: one of its papers must hold the ink.
        None => (largest(plotter), "its largest paper has the limits"),
    };
    let [left, bottom, right, top] = clip.map(|units| units as f64);
    let room = Rect::new(left, bottom, right, top).inflate(ROUNDING_UNITS, ROUNDING_UNITS);
    if room.union(ink) == room {
        return None;
    }
    Some(format!(
        "the drawing needs {:.0},{:.0} to {:.0},{:.0} plotter units, and {source} {left},{bottom} to {right},{top}: load other paper and set its size on the plotter, or convert with --paper and --fit",
        ink.x0, ink.y0, ink.x1, ink.y1
    ))
}

/// The hard-clip limits of the paper with the largest area.
fn largest(plotter: &Plotter) -> [i64; 4] {
    let area = |clip: &[i64; 4]| (clip[2] - clip[0]) * (clip[3] - clip[1]);
    plotter.papers.iter().map(|paper| paper.hard_clip).max_by_key(area).unwrap_or([0; 4])
}

/// The bounds of the program's ink in plotter units, with the plotter's own P1 and P2.
fn ink_units(program: &Program, limits: &Limits) -> Option<Rect> {
    let mut bytes = Vec::new();
    for line in &program.lines {
        bytes.extend(line.text.chars().map(|c| c as u8));
        bytes.push(b'\n');
    }
    // A unit of 1 mm: lengths come out in plotter units.
    let mut options = hpgl::Options { plotter_unit_mm: 1.0, ..hpgl::Options::default() };
    if let Some([x1, y1, x2, y2]) = limits.points.map(|points| points.map(|units| units as f64)) {
        options.scaling_points = (Point::new(x1, y1), Point::new(x2, y2));
        options.automatic = false;
    }
    if let Some([left, bottom, right, top]) = limits.hard_clip.map(|clip| clip.map(|units| units as f64)) {
        options.hard_clip = Rect::new(left, bottom, right, top);
        options.automatic = false;
    }
    let document = hpgl::read(&bytes, &options);
    document.pages.iter().filter_map(|page| page.drawing.bounding_box()).reduce(|all, one| all.union(one))
}
