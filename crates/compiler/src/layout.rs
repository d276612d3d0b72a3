//! What is drawn of a drawing, before it is placed: pens, several drawings in one, copies; and the
//! crop after it is placed.

use std::collections::{BTreeMap, BTreeSet};

use drawing::{Affine, Drawing, Pen, Rect, Side, Vec2};
use serde::Serialize;

use crate::import::{Page, PenSettings};

/// How the drawing of a page is composed.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Layout {
    /// The pens that draw, by the file's numbers; all if `None`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub only_pens: Option<Vec<u16>>,
    /// Pens with other numbers: the file's number and the new one. Others keep theirs.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub pen_map: Vec<(u16, u16)>,
    /// A grid of copies; one copy if `None`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub copies: Option<Copies>,
    /// What is kept of the placed drawing; all if `None`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub crop: Option<Crop>,
}

/// A grid of copies of a drawing.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Copies {
    /// Copies along x.
    pub columns: u16,
    /// Copies along y.
    pub rows: u16,
    /// Distance between the bounding boxes of neighbours, mm.
    pub gap_mm: f64,
}

/// A window that a placed drawing is cut at.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Crop {
    /// The sheet.
    Sheet,
    /// A window: lower-left corner from that of the sheet, width and height, mm.
    Window([f64; 4]),
}

impl Crop {
    /// The window on a sheet, in the sheet's frame, mm.
    pub fn window(&self, sheet: Rect) -> Rect {
        match *self {
            Self::Sheet => sheet,
            Self::Window([x, y, width, height]) => {
                let corner = Vec2::new(sheet.x0 + x, sheet.y0 + y);
                Rect::new(corner.x, corner.y, corner.x + width, corner.y + height)
            }
        }
    }
}

/// The part of a placed drawing that the crop keeps; all of it without a crop.
#[must_use]
pub fn cropped(drawing: Drawing, crop: Option<Crop>, sheet: Rect) -> Drawing {
    match crop {
        None => drawing,
        Some(crop) => drawing.clipped(crop.window(sheet), Side::Inside),
    }
}

impl Layout {
    /// Whether it changes nothing.
    pub fn is_default(&self) -> bool {
        *self == Self::default()
    }

    /// Selects and renumbers the pens of a page. Settings of pens that become one are those of the
    /// lowest number, with the least speed of all.
    pub fn apply_pens(&self, page: &mut Page) {
        if let Some(only) = &self.only_pens {
            page.drawing.strokes.change_pens(|pen| only.contains(&pen.0).then_some(pen));
            page.pens.retain(|pen, _| only.contains(&pen.0));
        }
        if self.pen_map.is_empty() {
            return;
        }
        page.drawing.strokes.change_pens(|pen| Some(self.mapped(pen)));
        let mut pens = BTreeMap::new();
        for (pen, settings) in std::mem::take(&mut page.pens) {
            add_settings(&mut pens, self.mapped(pen), settings);
        }
        page.pens = pens;
    }

    /// Checks the pens that the layout names against those of the file called `name`: what to warn of.
    ///
    /// # Errors
    /// A choice of pens that leaves nothing.
    pub fn check_pens(&self, name: &str, pens: &BTreeSet<u16>) -> Result<Option<String>, String> {
        if pens.is_empty() {
            return Ok(None);
        }
        let list = |pens: &[u16]| pens.iter().map(u16::to_string).collect::<Vec<_>>().join(", ");
        let have = || format!("{name} draws with pens {}", list(&pens.iter().copied().collect::<Vec<_>>()));
        let only = self.only_pens.as_deref().unwrap_or_default();
        if !only.is_empty() && !only.iter().any(|pen| pens.contains(pen)) {
            return Err(format!("--only-pens {} leaves nothing: {}", list(only), have()));
        }
        let mapped = self.pen_map.iter().map(|(from, _)| *from);
        let missing: BTreeSet<u16> =
            only.iter().copied().chain(mapped).filter(|pen| !pens.contains(pen)).collect();
        let missing: Vec<u16> = missing.into_iter().collect();
        Ok((!missing.is_empty()).then(|| format!("no stroke has pen {}: {}", list(&missing), have())))
    }

    /// The number that a pen of the file gets.
    pub fn mapped(&self, pen: Pen) -> Pen {
        let found = self.pen_map.iter().find(|(from, _)| *from == pen.0);
        found.map_or(pen, |&(_, to)| Pen(to))
    }

    /// Repeats the drawing in a grid, rows from the bottom up, each from left to right.
    pub fn apply_copies(&self, drawing: &mut Drawing) {
        let (Some(copies), Some(bounds)) = (self.copies, drawing.bounding_box()) else { return };
        let pitch = Vec2::new(bounds.width() + copies.gap_mm, bounds.height() + copies.gap_mm);
        let one = drawing.strokes.clone();
        for row in 0..copies.rows {
            for column in 0..copies.columns {
                if (row, column) == (0, 0) {
                    continue;
                }
                let shift = Vec2::new(pitch.x * f64::from(column), pitch.y * f64::from(row));
                let mut copy = one.clone();
                copy.transform(Affine::translate(shift));
                drawing.strokes.append(copy);
            }
        }
    }
}

fn add_settings(pens: &mut BTreeMap<Pen, PenSettings>, pen: Pen, settings: PenSettings) {
    let Some(known) = pens.get_mut(&pen) else {
        pens.insert(pen, settings);
        return;
    };
    known.speed_mm_s = known.speed_mm_s.into_iter().chain(settings.speed_mm_s).reduce(f64::min);
    known.width_mm = known.width_mm.or(settings.width_mm);
    known.name = known.name.take().or(settings.name);
    known.color = known.color.or(settings.color);
}

/// A pen that has two colours in an overlay.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ColorConflict {
    /// The pen.
    pub pen: Pen,
    /// Its colour in the drawings before, which it keeps.
    pub kept: [u8; 3],
    /// Its colour in this drawing.
    pub lost: [u8; 3],
    /// Index of this drawing.
    pub page: usize,
}

impl ColorConflict {
    /// The warning, with the name of this drawing's file.
    pub fn text(&self, name: &str) -> String {
        let hex = |[red, green, blue]: [u8; 3]| format!("#{red:02x}{green:02x}{blue:02x}");
        let (pen, lost, kept) = (self.pen.0, hex(self.lost), hex(self.kept));
        format!("pen {pen} is {lost} in {name} but {kept} before: it keeps the first colour")
    }
}

/// What to report where one of `pages` pages is taken: a warning if none was asked for, otherwise a note.
pub fn several_pages(name: &str, pages: usize, asked: Option<usize>) -> Option<String> {
    match (pages, asked) {
        (0 | 1, _) => None,
        (_, None) => Some(format!("{name} has {pages} pages; this is page 1, --page takes another")),
        (_, Some(page)) => Some(format!("{name} has {pages} pages; this is page {page}")),
    }
}

/// The numbers of the pens that a document's pages draw with.
pub fn pens_of(pages: &[Page]) -> BTreeSet<u16> {
    pages.iter().flat_map(|page| page.drawing.pens()).map(|pen| pen.0).collect()
}

/// Numbers the pens of pages that are numbered by colour (`by_color`, one for each page) so that a
/// colour has one pen in all pages. A pen keeps its number where no other colour has it; those of the
/// other pages always do.
pub fn number_colors_together(pages: &mut [Page], by_color: &[bool]) {
    let mut color_of: BTreeMap<Pen, [u8; 3]> = BTreeMap::new();
    let mut fixed: BTreeSet<Pen> = BTreeSet::new();
    for (page, _) in pages.iter().zip(by_color).filter(|(_, by_color)| !**by_color) {
        fixed.extend(page.drawing.pens());
        for (&pen, settings) in &page.pens {
            color_of
                .extend(settings.color.filter(|_| !color_of.contains_key(&pen)).map(|color| (pen, color)));
        }
    }
    for (page, _) in pages.iter_mut().zip(by_color).filter(|(_, by_color)| **by_color) {
        let is_used = |pen: u16, color_of: &BTreeMap<Pen, [u8; 3]>| {
            color_of.contains_key(&Pen(pen)) || page.pens.contains_key(&Pen(pen)) || fixed.contains(&Pen(pen))
        };
        let mut map = Vec::new();
        for (&pen, settings) in &page.pens {
            let Some(color) = settings.color else { continue };
            let same = color_of.iter().find(|(_, known)| **known == color).map(|(pen, _)| *pen);
            let new = match same {
                Some(same) => same,
                None if !color_of.contains_key(&pen) => pen,
                None => match (1..=u16::MAX).find(|&number| !is_used(number, &color_of)) {
                    Some(free) => Pen(free),
                    None => pen,
                },
            };
            color_of.entry(new).or_insert(color);
            map.push((pen.0, new.0));
        }
        Layout { pen_map: map, ..Layout::default() }.apply_pens(page);
    }
}

/// Draws pages over each other in one frame, the first one first.
///
/// Each page comes with the length of its source. Spans are those of the sources one after the
/// other.
pub fn overlay(pages: Vec<(Page, usize)>) -> (Page, Vec<ColorConflict>) {
    let mut all = Page::default();
    let mut conflicts = Vec::new();
    let mut offset = 0;
    for (index, (page, length)) in pages.into_iter().enumerate() {
        let mut strokes = page.drawing.strokes;
        strokes.shift_sources(offset);
        all.drawing.strokes.append(strokes);
        for (pen, settings) in page.pens {
            let known = all.pens.get(&pen).and_then(|known| known.color);
            if let (Some(kept), Some(lost)) = (known, settings.color)
                && kept != lost
            {
                conflicts.push(ColorConflict { pen, kept, lost, page: index });
            }
            add_settings(&mut all.pens, pen, settings);
        }
        offset += length;
    }
    (all, conflicts)
}

/// The page of one of several drawings.
#[derive(Clone, Debug)]
pub struct Part {
    /// The page as it was read.
    pub page: Page,
    /// The length of its file, bytes.
    pub length: usize,
    /// The format of its file.
    pub format: &'static str,
}

/// One page of several drawings that lie over each other, the first one first: pens chosen and
/// renumbered, colours numbered together, then copied. A single drawing is only arranged.
pub fn compose(mut parts: Vec<Part>, layout: &Layout) -> (Page, Vec<ColorConflict>) {
    // Numbers that an option names are those of the files.
    let are_free = parts.len() > 1 && layout.pen_map.is_empty() && layout.only_pens.is_none();
    let is_by_color = |part: &Part| are_free && part.format == "SVG" && is_numbered_by_color(&part.page);
    let by_color: Vec<bool> = parts.iter().map(is_by_color).collect();
    for part in &mut parts {
        layout.apply_pens(&mut part.page);
    }
    let lengths: Vec<usize> = parts.iter().map(|part| part.length).collect();
    let mut pages: Vec<Page> = parts.into_iter().map(|part| part.page).collect();
    if pages.len() > 1 {
        number_colors_together(&mut pages, &by_color);
    }
    let (mut page, conflicts) = match <[Page; 1]>::try_from(pages) {
        Ok([page]) => (page, Vec::new()),
        Err(pages) => overlay(pages.into_iter().zip(lengths).collect()),
    };
    layout.apply_copies(&mut page.drawing);
    (page, conflicts)
}

/// Whether an SVG's pens are numbered by colour: it has at most one layer, and that has no number.
fn is_numbered_by_color(page: &Page) -> bool {
    let mut names = page.pens.values().filter_map(|pen| pen.name.as_deref());
    let Some(first) = names.next() else { return true };
    let text = first.trim_start_matches(['!', ' ']).to_ascii_lowercase();
    let has_number = text.starts_with("pen") || text.starts_with(|first: char| first.is_ascii_digit());
    !has_number && names.all(|name| name == first)
}

#[cfg(test)]
mod tests {
    use drawing::{Point, Stroke};

    use super::*;

    fn page(pens: &[u16]) -> Page {
        let stroke = |&pen: &u16| {
            let points = vec![Point::ZERO, Point::new(10.0, f64::from(pen))];
            Stroke::polyline(Pen(pen), points, drawing::Span { start: 1, end: 2 }).unwrap()
        };
        let settings = |pen: u16| PenSettings {
            color: Some([pen as u8, 0, 0]),
            speed_mm_s: Some(f64::from(pen)),
            ..PenSettings::default()
        };
        Page {
            drawing: Drawing { strokes: pens.iter().map(stroke).collect() },
            pens: pens.iter().map(|&pen| (Pen(pen), settings(pen))).collect(),
        }
    }

    #[test]
    fn pens_are_selected_by_the_files_numbers_and_swapped_at_once() {
        let mut page = page(&[1, 2, 3, 4]);
        let layout = Layout {
            only_pens: Some(vec![1, 2, 4]),
            pen_map: vec![(1, 2), (2, 1), (4, 1)],
            ..Layout::default()
        };
        layout.apply_pens(&mut page);
        let pens: Vec<u16> = page.drawing.strokes.iter().map(|stroke| stroke.pen.0).collect();
        assert_eq!(pens, [2, 1, 1]);
        // Pen 1 is the file's pens 2 and 4: colour of pen 2, speed of the slower one.
        assert_eq!(page.pens[&Pen(1)].color, Some([2, 0, 0]));
        assert_eq!(page.pens[&Pen(1)].speed_mm_s, Some(2.0));
        assert_eq!(page.pens[&Pen(2)].color, Some([1, 0, 0]));
    }

    #[test]
    fn copies_make_a_grid_with_gaps() {
        let mut drawing = page(&[4]).drawing;
        let one = drawing.length();
        let copies = Some(Copies { columns: 3, rows: 2, gap_mm: 5.0 });
        Layout { copies, ..Layout::default() }.apply_copies(&mut drawing);
        assert_eq!(drawing.strokes.len(), 6);
        assert!((drawing.length() - 6.0 * one).abs() < 1e-9);
        assert_eq!(drawing.bounding_box(), Some(Rect::new(0.0, 0.0, 40.0, 13.0)));
    }

    #[test]
    fn overlay_keeps_order_spans_and_the_first_colour() {
        let mut red = page(&[1]);
        red.pens.get_mut(&Pen(1)).unwrap().color = Some([255, 0, 0]);
        let (all, conflicts) = overlay(vec![(page(&[1, 2]), 100), (red, 50), (page(&[3]), 10)]);
        let starts: Vec<usize> = all.drawing.strokes.iter().map(|stroke| stroke.source().start).collect();
        assert_eq!(starts, [1, 1, 101, 151]);
        assert_eq!(conflicts, [ColorConflict { pen: Pen(1), kept: [1, 0, 0], lost: [255, 0, 0], page: 1 }]);
        assert_eq!(all.pens[&Pen(1)].color, Some([1, 0, 0]));
    }

    #[test]
    fn colours_have_one_pen_in_all_drawings() {
        let with_colors = |colors: &[(u16, u8)]| {
            let mut page = page(&colors.iter().map(|color| color.0).collect::<Vec<_>>());
            for &(pen, red) in colors {
                page.pens.get_mut(&Pen(pen)).unwrap().color = Some([red, 0, 0]);
            }
            page
        };
        let mut pages = [with_colors(&[(1, 10), (2, 20)]), with_colors(&[(1, 20), (2, 30), (3, 10)])];
        number_colors_together(&mut pages, &[true; 2]);
        let pens =
            |page: &Page| -> Vec<u16> { page.drawing.strokes.iter().map(|stroke| stroke.pen.0).collect() };
        assert_eq!(pens(&pages[0]), [1, 2]);
        assert_eq!(pens(&pages[1]), [2, 4, 1]);
        assert_eq!(pages[1].pens[&Pen(4)].color, Some([30, 0, 0]));
        let mut pages = [with_colors(&[(1, 10), (2, 20)]), with_colors(&[(2, 10), (1, 30), (3, 20)])];
        number_colors_together(&mut pages, &[true, false]);
        assert_eq!(pens(&pages[0]), [2, 3]);
        assert_eq!(pens(&pages[1]), [2, 1, 3]);
    }

    #[test]
    fn crop_windows_are_measured_from_the_sheets_corner() {
        let sheet = Rect::new(-50.0, 10.0, 150.0, 110.0);
        assert_eq!(Crop::Window([5.0, 5.0, 10.0, 20.0]).window(sheet), Rect::new(-45.0, 15.0, -35.0, 35.0));
        assert_eq!(Crop::Sheet.window(sheet), sheet);
        let drawing = page(&[1]).drawing;
        let right = cropped(drawing.clone(), Some(Crop::Window([55.0, -20.0, 100.0, 100.0])), sheet);
        assert!((right.length() - 0.5 * drawing.length()).abs() < 1e-9);
        assert_eq!(cropped(drawing.clone(), None, sheet), drawing);
    }
}
