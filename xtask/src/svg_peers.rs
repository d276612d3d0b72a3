//! The SVG importer against usvg: length of the outlines of all visible shapes, and the largest
//! distance of our ink from usvg's.
//!
//! usvg resolves styles, `use`, markers and visibility by itself. It does not apply clip paths and
//! dashes to its paths, so our ink may be shorter where a file has them, but all of it must lie on
//! usvg's outlines. Both read without fonts, so text is left out.

use std::path::{Path, PathBuf};

use anyhow::{Context as _, Result};
use drawing::{CubicBez, Line, Point, Segment};
use usvg::tiny_skia_path::PathSegment;

use crate::peers::{farthest, index, length};

/// Chords stay this close to curves, mm.
const CHORD_MM: f64 = 0.002;
/// Our ink lies this close to usvg's outlines, mm per mm of the page's longer side: usvg computes
/// in `f32` and makes cubics of arcs, 0.027 mm off at a radius of 100 mm.
const ALIKE_PER_MM: f64 = 5e-4;
/// Lengths are alike within this part.
const ALIKE_LENGTH: f64 = 0.01;

/// Compares every SVG file of a folder; true if all ink lies on usvg's outlines.
pub(crate) fn run(folder: &Path) -> Result<bool> {
    let files = drawings(folder)?;
    println!("{:<40} {:>11} {:>11} {:>8} {:>9}", "drawing", "ours, mm", "usvg, mm", "length", "off, mm");
    let mut alike = true;
    for file in files {
        let name = file.file_name().unwrap_or_default().to_string_lossy().into_owned();
        match compare(&file) {
            Ok(row) => {
                let part = if row.theirs > 0.0 { row.ours / row.theirs - 1.0 } else { 0.0 };
                let is_off = row.off_mm > row.limit_mm && row.same_page;
                alike &= !is_off;
                let remark = match (is_off, row.same_page, part.abs() > ALIKE_LENGTH) {
                    (true, ..) => "ink beside usvg's outlines",
                    (_, false, _) => "another size of the page: not compared",
                    (_, _, true) => row.cause,
                    _ => "",
                };
                println!(
                    "{name:<40} {:>11.1} {:>11.1} {:>7.2}% {:>9.4} {remark}",
                    row.ours,
                    row.theirs,
                    100.0 * part,
                    row.off_mm
                );
            }
            Err(error) => println!("{name:<40} {error:#}"),
        }
    }
    Ok(alike)
}

/// The SVG files of a folder, or the one file.
pub(crate) fn drawings(folder: &Path) -> Result<Vec<PathBuf>> {
    if folder.is_file() {
        return Ok(vec![folder.to_owned()]);
    }
    let mut files: Vec<PathBuf> = std::fs::read_dir(folder)
        .with_context(|| format!("no folder {}", folder.display()))?
        .filter_map(|entry| Some(entry.ok()?.path()))
        .filter(|path| path.extension().is_some_and(|e| e == "svg" || e == "svgz"))
        .collect();
    files.sort();
    Ok(files)
}

struct Row {
    ours: f64,
    theirs: f64,
    off_mm: f64,
    limit_mm: f64,
    /// Whether both read the same size of the page; a width in percent is of nothing that is known.
    same_page: bool,
    /// What the file has that only one side applies.
    cause: &'static str,
}

fn compare(file: &Path) -> Result<Row> {
    let bytes = std::fs::read(file)?;
    let options = svg::Options { outline_fills: true, ..svg::Options::default() };
    let ours = svg::read(&bytes, &options);
    let ink: Vec<Vec<Point>> = ours.drawing.strokes.iter().map(|stroke| stroke.flatten(CHORD_MM)).collect();
    let tree = usvg::Tree::from_data(&bytes, &usvg::Options::default()).context("usvg cannot read it")?;
    let mut theirs = Theirs { height_mm: ours.page_mm[1], ..Theirs::default() };
    theirs.group(tree.root());
    let off_mm = if ink.iter().all(|line| line.len() < 2) {
        0.0
    } else {
        farthest(&ink, &index(&theirs.lines)).context("usvg draws nothing near")?
    };
    let [width, height] = ours.page_mm;
    let cause = match (theirs.has_clips, theirs.has_dashes) {
        (true, true) => "clip paths and dashes, which usvg keeps apart",
        (true, false) => "clip paths, which usvg keeps apart",
        (false, true) => "dashes, which usvg keeps apart",
        (false, false) => "other",
    };
    let size = tree.size();
    let their_page = [size.width(), size.height()].map(|px| f64::from(px) * 25.4 / 96.0);
    let same_page = [width, height].iter().zip(their_page).all(|(a, b)| (a - b).abs() <= 0.01 + 1e-3 * b);
    let limit_mm = ALIKE_PER_MM * width.max(height).max(100.0);
    Ok(Row { ours: ours.drawing.length(), theirs: length(&theirs.lines), off_mm, limit_mm, same_page, cause })
}

/// The outlines of usvg's paths in mm, y up from the page's lower edge.
#[derive(Default)]
struct Theirs {
    height_mm: f64,
    lines: Vec<Vec<Point>>,
    has_clips: bool,
    has_dashes: bool,
}

impl Theirs {
    fn group(&mut self, group: &usvg::Group) {
        self.has_clips |= group.clip_path().is_some();
        for node in group.children() {
            match node {
                usvg::Node::Group(group) => self.group(group),
                usvg::Node::Path(path) if path.is_visible() => self.path(path),
                _ => {}
            }
        }
    }

    fn path(&mut self, path: &usvg::Path) {
        if path.stroke().is_none() && path.fill().is_none() {
            return;
        }
        self.has_dashes |= path.stroke().is_some_and(|stroke| stroke.dasharray().is_some());
        let map = path.abs_transform();
        let mm = 25.4 / 96.0;
        let height = self.height_mm;
        let at = |point: usvg::tiny_skia_path::Point| {
            let (x, y) = (f64::from(point.x), f64::from(point.y));
            let [sx, kx, tx] = [map.sx, map.kx, map.tx].map(f64::from);
            let [ky, sy, ty] = [map.ky, map.sy, map.ty].map(f64::from);
            Point::new(mm * (sx * x + kx * y + tx), height - mm * (ky * x + sy * y + ty))
        };
        let (mut from, mut start) = (Point::ZERO, Point::ZERO);
        for segment in path.data().segments() {
            let piece = match segment {
                PathSegment::MoveTo(to) => {
                    from = at(to);
                    start = from;
                    self.lines.push(vec![from]);
                    continue;
                }
                PathSegment::LineTo(to) => Segment::Line(Line::new(from, at(to))),
                PathSegment::QuadTo(control, to) => {
                    let (control, to) = (at(control), at(to));
                    let toward = |end: Point| end + (2.0 / 3.0) * (control - end);
                    Segment::Cubic(CubicBez::new(from, toward(from), toward(to), to))
                }
                PathSegment::CubicTo(one, two, to) => {
                    Segment::Cubic(CubicBez::new(from, at(one), at(two), at(to)))
                }
                PathSegment::Close => Segment::Line(Line::new(from, start)),
            };
            if let Some(line) = self.lines.last_mut() {
                piece.flatten(CHORD_MM, |point| line.push(point));
            }
            from = piece.end();
        }
    }
}
