//! Outlines of fonts for the text of SVG files: the system's, or those of given files.

use std::path::Path;
use std::sync::{Arc, LazyLock};

use anyhow::Context as _;
use compiler::import::{FaceQuery, Fonts, OutlineFonts, OutlineGlyph};
use drawing::{CubicBez, Line, Point, Segment};
use fontdb::{Database, Family, Query, Stretch, Style, Weight};
use ttf_parser::gpos::{PairAdjustment, PositioningSubtable};
use ttf_parser::{Face, GlyphId, OutlineBuilder, Tag};

use crate::cli::{Reading, TextForm};
use crate::failure::Failure;
use crate::input;

/// The fonts that the options ask for; `None` for the stroke font.
pub(crate) fn of(reading: &Reading) -> Result<Option<Fonts>, Failure> {
    if reading.text == TextForm::Strokes {
        return Ok(None);
    }
    if reading.font.is_empty() {
        static SYSTEM: LazyLock<Fonts> = LazyLock::new(|| {
            let mut database = Database::new();
            database.load_system_fonts();
            Fonts(Arc::new(Outlines { database, only: false }))
        });
        return Ok(Some(SYSTEM.clone()));
    }
    let mut database = Database::new();
    for file in &reading.font {
        let bytes = input::read_file(Path::new(file))
            .with_context(|| format!("cannot read the font {file}"))
            .map_err(Failure::Io)?;
        let before = database.len();
        database.load_font_data(bytes);
        if database.len() == before {
            return Err(Failure::Usage(anyhow::anyhow!("{file} is not a font (TrueType, OpenType)")));
        }
    }
    Ok(Some(Fonts(Arc::new(Outlines { database, only: true }))))
}

/// Families for text whose own are not there, where the system names no sans-serif font.
const COMMON: [&str; 5] = ["DejaVu Sans", "Liberation Sans", "Noto Sans", "Arial", "Helvetica"];

/// Fonts by family.
#[derive(Debug)]
struct Outlines {
    database: Database,
    /// All text has these fonts, whatever family it names.
    only: bool,
}

impl Outlines {
    fn find(&self, query: FaceQuery<'_>) -> Option<fontdb::ID> {
        let names = query.families.split(',').map(|name| name.trim().trim_matches(['"', '\'']));
        let mut families: Vec<Family<'_>> = names
            .filter(|name| !name.is_empty())
            .map(|name| match name {
                "serif" => Family::Serif,
                "sans-serif" | "sans" | "Sans" => Family::SansSerif,
                "monospace" => Family::Monospace,
                "cursive" => Family::Cursive,
                "fantasy" => Family::Fantasy,
                name => Family::Name(name),
            })
            .collect();
        families.push(Family::SansSerif);
        families.extend(COMMON.map(Family::Name));
        let style = if query.italic { Style::Italic } else { Style::Normal };
        let query =
            Query { families: &families, weight: Weight(query.weight), stretch: Stretch::Normal, style };
        let any = || self.database.faces().next().map(|face| face.id);
        self.database.query(&query).or_else(any).filter(|_| !self.database.is_empty())
    }
}

impl OutlineFonts for Outlines {
    fn family(&self, query: FaceQuery<'_>) -> Option<String> {
        let face = self.database.face(self.find(query)?)?;
        if self.only {
            // The user's choice needs no report.
            let named = query.families.split(',').next().unwrap_or("").trim().trim_matches(['"', '\'']);
            return Some(if named.is_empty() { "default".to_owned() } else { named.to_owned() });
        }
        face.families.first().map(|(name, _)| name.clone())
    }

    fn glyph(&self, query: FaceQuery<'_>, character: char) -> Option<OutlineGlyph> {
        let draw = |data: &[u8], index: u32| {
            let face = Face::parse(data, index).ok()?;
            let id = face.glyph_index(character)?;
            let em = f64::from(face.units_per_em());
            let mut contours = Contours { em, ..Contours::default() };
            // A blank has no outline.
            let _ = face.outline_glyph(id, &mut contours);
            let advance = f64::from(face.glyph_hor_advance(id)?) / em;
            Some(OutlineGlyph { advance, contours: contours.done })
        };
        self.database.with_face_data(self.find(query)?, draw)?
    }

    fn kerning(&self, query: FaceQuery<'_>, pair: [char; 2]) -> f64 {
        let of_face = |data: &[u8], index: u32| {
            let face = Face::parse(data, index).ok()?;
            let [left, right] = [face.glyph_index(pair[0])?, face.glyph_index(pair[1])?];
            let units = by_positioning(&face, left, right).or_else(|| by_kern_table(&face, left, right))?;
            Some(f64::from(units) / f64::from(face.units_per_em()))
        };
        let font = self.find(query).and_then(|font| self.database.with_face_data(font, of_face));
        font.flatten().unwrap_or(0.0)
    }
}

/// The kerning of a pair by the `GPOS` table, font units; `None` without a `kern` feature. As in layout,
/// the first subtable of a lookup that covers the left glyph decides.
fn by_positioning(face: &Face<'_>, left: GlyphId, right: GlyphId) -> Option<i16> {
    let table = face.tables().gpos?;
    let mut lookups = Vec::new();
    for feature in table.features.into_iter().filter(|feature| feature.tag == Tag::from_bytes(b"kern")) {
        lookups.extend(feature.lookup_indices);
    }
    lookups.sort_unstable();
    lookups.dedup();
    if lookups.is_empty() {
        return None;
    }
    let mut sum = 0;
    for lookup in lookups.into_iter().filter_map(|index| table.lookups.get(index)) {
        let mut pairs =
            lookup.subtables.into_iter::<PositioningSubtable<'_>>().filter_map(|subtable| match subtable {
                PositioningSubtable::Pair(pairs) => Some(pairs),
                _ => None,
            });
        let of_pair = |pairs: PairAdjustment<'_>| {
            let covered = pairs.coverage().get(left)?;
            let (first, _) = match pairs {
                PairAdjustment::Format1 { sets, .. } => sets.get(covered)?.get(right)?,
                PairAdjustment::Format2 { classes, matrix, .. } => {
                    matrix.get((classes.0.get(left), classes.1.get(right)))?
                }
            };
            Some(first.x_advance)
        };
        sum += pairs.find_map(of_pair).unwrap_or(0);
    }
    Some(sum)
}

/// The kerning of a pair by the `kern` table, font units.
fn by_kern_table(face: &Face<'_>, left: GlyphId, right: GlyphId) -> Option<i16> {
    let tables = face.tables().kern?.subtables.into_iter();
    let horizontal = tables.filter(|table| table.horizontal && !table.variable && !table.has_cross_stream);
    horizontal.filter_map(|table| table.glyphs_kerning(left, right)).reduce(|sum, next| sum + next)
}

/// Closed contours, in font sizes.
#[derive(Default)]
struct Contours {
    em: f64,
    done: Vec<Vec<Segment>>,
    current: Vec<Segment>,
    start: Point,
    at: Point,
}

impl Contours {
    fn point(&self, x: f32, y: f32) -> Point {
        Point::new(f64::from(x) / self.em, f64::from(y) / self.em)
    }

    fn push(&mut self, segment: Segment) {
        self.at = segment.end();
        self.current.push(segment);
    }
}

impl OutlineBuilder for Contours {
    fn move_to(&mut self, x: f32, y: f32) {
        self.start = self.point(x, y);
        self.at = self.start;
    }

    fn line_to(&mut self, x: f32, y: f32) {
        let to = self.point(x, y);
        self.push(Segment::Line(Line::new(self.at, to)));
    }

    fn quad_to(&mut self, x1: f32, y1: f32, x: f32, y: f32) {
        let (control, to) = (self.point(x1, y1), self.point(x, y));
        let toward = |end: Point| end + (2.0 / 3.0) * (control - end);
        self.push(Segment::Cubic(CubicBez::new(self.at, toward(self.at), toward(to), to)));
    }

    fn curve_to(&mut self, x1: f32, y1: f32, x2: f32, y2: f32, x: f32, y: f32) {
        let (one, two, to) = (self.point(x1, y1), self.point(x2, y2), self.point(x, y));
        self.push(Segment::Cubic(CubicBez::new(self.at, one, two, to)));
    }

    fn close(&mut self) {
        if self.at != self.start {
            self.push(Segment::Line(Line::new(self.at, self.start)));
        }
        let contour = std::mem::take(&mut self.current);
        if !contour.is_empty() {
            self.done.push(contour);
        }
    }
}
