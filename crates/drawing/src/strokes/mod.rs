//! The strokes of a drawing in one list of bytes.
//!
//! A stroke in memory of its own takes 40 bytes, an allocation, and 16 bytes a vertex. Packed, it
//! takes a header of 15 bytes and a body: a polyline on a lattice 2 or 4 bytes a step, an arc its
//! parameters (`code.rs`). A label is one entry for all its strokes: its text, and how it is
//! lettered. Strokes are made when they are asked for, and an affine map is applied then.

mod code;

use std::collections::BTreeSet;
use std::fmt;
use std::sync::Arc;

use kurbo::{Affine, Point};

use crate::path::Path;
use crate::stroke::packed;
use crate::{Pen, Pitch, Span, Stroke, Trail};

use code::Kind;

/// How text is drawn: font, size and frame.
///
/// A drawing holds a label as text; this makes its strokes, the same ones at each call.
pub trait Lettering: fmt::Debug + Send + Sync {
    /// Calls `to` with the vertices of every stroke of the text in turn, mm. The text is what was
    /// given to [`Strokes::push_label`].
    fn draw(&self, text: &[u8], to: &mut dyn FnMut(&[Point]));
}

/// The strokes of a drawing, packed; in the order in which they are drawn.
///
/// They can be read in sequence ([`Self::iter`], by value) and appended to. Other changes pass over
/// all of them. A consumer that needs them in any order collects them into a `Vec`.
#[derive(Clone, Default)]
pub struct Strokes {
    /// Entries, each a header and a body, in lists of about [`CHUNK`] bytes: one list would be copied
    /// when it grows.
    chunks: Vec<Vec<u8>>,
    /// The number of strokes: labels have several.
    len: usize,
    letterings: Vec<Arc<dyn Lettering>>,
    /// Maps of all strokes, applied one after the other: a product would round differently.
    maps: Vec<Affine>,
}

/// A list of entries of this length gets no more, bytes.
const CHUNK: usize = 1 << 16;

/// What all entries begin with.
#[derive(Clone, Copy, Debug)]
struct Header {
    kind: Kind,
    pen: Pen,
    source: [u32; 2],
    /// Length of the body.
    bytes: usize,
}

/// The size of a [`Header`]: kind, pen, first byte and length of the source, length of the body.
const HEADER: usize = 1 + 2 + 4 + 4 + 4;
const PEN: usize = 1;
const SOURCE: usize = PEN + 2;
const BYTES: usize = SOURCE + 8;

impl Header {
    /// The header at the beginning of a list of entries; `None` at its end.
    #[inline]
    fn read(code: &[u8]) -> Option<Self> {
        let header = code.get(..HEADER)?;
        let word = |at: usize| u32::from_le_bytes(std::array::from_fn(|k| header[at + k]));
        Some(Self {
            kind: Kind::of_byte(header[0])?,
            pen: Pen(u16::from_le_bytes([header[PEN], header[PEN + 1]])),
            source: [word(SOURCE), word(SOURCE + 4)],
            bytes: word(BYTES) as usize,
        })
    }

    /// The number of strokes of the entry with this body.
    #[inline]
    fn strokes(&self, body: &[u8]) -> usize {
        if self.kind == Kind::Label { code::label_strokes(body) } else { 1 }
    }
}

impl Strokes {
    /// The number of strokes.
    pub fn len(&self) -> usize {
        self.len
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// The strokes one after the other, each made when it is asked for.
    pub fn iter(&self) -> Iter<'_> {
        Iter { strokes: self, cursor: Cursor::default() }
    }

    /// All of them, each by itself.
    pub fn to_vec(&self) -> Vec<Stroke> {
        self.iter().collect()
    }

    /// The stroke of this index. Takes time proportional to the index.
    pub fn get(&self, index: usize) -> Option<Stroke> {
        self.iter().nth(index)
    }

    /// Their pens, each once, in ascending order.
    pub fn pens(&self) -> Vec<Pen> {
        let mut pens = BTreeSet::new();
        let mut last = None;
        self.entries(|header, _| {
            if last != Some(header.pen) {
                last = Some(header.pen);
                pens.insert(header.pen);
            }
        });
        pens.into_iter().collect()
    }

    /// Appends a stroke.
    pub fn push(&mut self, stroke: &Stroke) {
        self.apply_maps();
        self.add(stroke.pen, stroke.source, 1, |code| code::write(&stroke.path, code));
    }

    /// Appends a stroke along a trail; none without vertices. Coordinates that are multiples of
    /// `pitch` take less memory.
    #[inline]
    pub fn push_trail(&mut self, pen: Pen, source: Span, trail: &Trail, pitch: Option<Pitch>) {
        if trail.is_empty() {
            return;
        }
        self.apply_maps();
        self.add(pen, packed(source), 1, |code| code::write_trail(trail, pitch, code));
    }

    /// Appends a label: `strokes` strokes that `lettering` makes of `text`. The lettering of the label
    /// before is used again if it is the same object.
    pub fn push_label(
        &mut self,
        pen: Pen,
        source: Span,
        lettering: &Arc<dyn Lettering>,
        text: &[u8],
        strokes: u32,
    ) {
        if strokes == 0 {
            return;
        }
        self.apply_maps();
        if !self.letterings.last().is_some_and(|last| Arc::ptr_eq(last, lettering)) {
            self.letterings.push(Arc::clone(lettering));
        }
        let index = self.letterings.len() as u32 - 1;
        self.add(pen, packed(source), strokes as usize, |code| {
            code::write_label(index, strokes, text, code);
            Kind::Label
        });
    }

    /// Maps every point. Takes constant time.
    pub fn transform(&mut self, map: Affine) {
        self.maps.push(map);
    }

    /// Gives strokes other pens, and drops those whose pen becomes `None`.
    pub fn change_pens(&mut self, mut pen: impl FnMut(Pen) -> Option<Pen>) {
        for code in &mut self.chunks {
            let (mut from, mut to) = (0, 0);
            while let Some(header) = Header::read(&code[from..]) {
                let next = from + HEADER + header.bytes;
                if let Some(Pen(number)) = pen(header.pen) {
                    code.copy_within(from..next, to);
                    code[to + PEN..to + PEN + 2].copy_from_slice(&number.to_le_bytes());
                    to += next - from;
                } else {
                    self.len -= header.strokes(&code[from + HEADER..next]);
                }
                from = next;
            }
            code.truncate(to);
        }
    }

    /// Shifts the sources of all strokes: they begin `offset` bytes later.
    pub fn shift_sources(&mut self, offset: usize) {
        let offset = u32::try_from(offset).unwrap_or(u32::MAX);
        for code in &mut self.chunks {
            let mut at = 0;
            while let Some(header) = Header::read(&code[at..]) {
                let start = header.source[0].saturating_add(offset);
                code[at + SOURCE..at + SOURCE + 4].copy_from_slice(&start.to_le_bytes());
                at += HEADER + header.bytes;
            }
        }
    }

    /// Appends other strokes.
    pub fn append(&mut self, other: Self) {
        if self.is_empty() {
            *self = other;
        } else {
            self.extend(other);
        }
    }

    /// Changes strokes one after the other. Labels become strokes of their own.
    pub fn update(&mut self, mut change: impl FnMut(&mut Stroke)) {
        *self = std::mem::take(self)
            .into_iter()
            .map(|mut stroke| {
                change(&mut stroke);
                stroke
            })
            .collect();
    }

    /// Releases memory reserved for further strokes.
    pub fn shrink_to_fit(&mut self) {
        self.chunks.last_mut().into_iter().for_each(Vec::shrink_to_fit);
        self.letterings.shrink_to_fit();
    }

    /// Calls `to` with every entry.
    fn entries(&self, mut to: impl FnMut(Header, &[u8])) {
        for code in &self.chunks {
            let mut at = 0;
            while let Some(header) = Header::read(&code[at..]) {
                let body = at + HEADER;
                at = body + header.bytes;
                to(header, &code[body..at]);
            }
        }
    }

    /// Appends an entry of that many strokes; `body` appends its body and returns its kind.
    #[inline]
    fn add(&mut self, pen: Pen, source: [u32; 2], strokes: usize, body: impl FnOnce(&mut Vec<u8>) -> Kind) {
        // The first list grows as it is filled: most drawings are small.
        if self.chunks.last().is_none_or(|chunk| chunk.len() >= CHUNK) {
            let room = if self.chunks.is_empty() { 0 } else { CHUNK + CHUNK / 16 };
            self.chunks.push(Vec::with_capacity(room));
        }
        let Some(code) = self.chunks.last_mut() else { return };
        let at = code.len();
        let mut header = [0; HEADER];
        header[PEN..SOURCE].copy_from_slice(&pen.0.to_le_bytes());
        header[SOURCE..SOURCE + 4].copy_from_slice(&source[0].to_le_bytes());
        header[SOURCE + 4..BYTES].copy_from_slice(&source[1].to_le_bytes());
        code.extend_from_slice(&header);
        code[at] = body(code) as u8;
        let bytes = (code.len() - at - HEADER) as u32;
        code[at + BYTES..at + HEADER].copy_from_slice(&bytes.to_le_bytes());
        self.len += strokes;
    }

    /// Applies the maps to all strokes, so that others can be appended.
    #[inline]
    fn apply_maps(&mut self) {
        if !self.maps.is_empty() {
            self.update(|_| {});
        }
    }

    /// Makes the strokes of the entry at `at`: the one, or those of a label.
    fn expand(&self, header: Header, body: &[u8]) -> Made {
        let finished = |path: Path| {
            let mut stroke = Stroke { pen: header.pen, source: header.source, path };
            for map in &self.maps {
                stroke.transform(*map);
            }
            stroke
        };
        if header.kind != Kind::Label {
            return Made::One(code::read(header.kind, body).map(finished));
        }
        let (lettering, text) = code::label(body);
        let mut label = Vec::with_capacity(header.strokes(body));
        if let Some(lettering) = self.letterings.get(lettering) {
            lettering.draw(text, &mut |points| {
                label.extend(Path::polyline(points.to_vec()).map(finished));
            });
        }
        debug_assert_eq!(label.len(), header.strokes(body), "a label has another number of strokes");
        Made::Label(label)
    }
}

enum Made {
    One(Option<Stroke>),
    Label(Vec<Stroke>),
}

/// A position in a list of strokes.
#[derive(Clone, Debug, Default)]
struct Cursor {
    /// The list of the next entry, and where it begins there.
    chunk: usize,
    at: usize,
    /// What is left of the label before it.
    label: std::vec::IntoIter<Stroke>,
    /// The number of strokes made.
    made: usize,
}

impl Cursor {
    /// The next entry with its body.
    fn entry<'a>(&mut self, strokes: &'a Strokes) -> Option<(Header, &'a [u8])> {
        loop {
            let code = strokes.chunks.get(self.chunk)?;
            if let Some(header) = Header::read(&code[self.at..]) {
                let body = self.at + HEADER;
                return Some((header, &code[body..body + header.bytes]));
            }
            (self.chunk, self.at) = (self.chunk + 1, 0);
        }
    }

    fn next(&mut self, strokes: &Strokes) -> Option<Stroke> {
        let stroke = loop {
            if let Some(stroke) = self.label.next() {
                break stroke;
            }
            let (header, body) = self.entry(strokes)?;
            self.at += HEADER + body.len();
            match strokes.expand(header, body) {
                Made::One(Some(stroke)) => break stroke,
                Made::One(None) => {}
                Made::Label(label) => self.label = label.into_iter(),
            }
        };
        self.made += 1;
        Some(stroke)
    }

    /// Skips up to `count` strokes, and makes the one after them.
    fn nth(&mut self, strokes: &Strokes, mut count: usize) -> Option<Stroke> {
        while count > 0 && self.label.len() == 0 {
            let (header, body) = self.entry(strokes)?;
            let skipped = header.strokes(body);
            if skipped > count {
                break;
            }
            self.at += HEADER + body.len();
            self.made += skipped;
            count -= skipped;
        }
        for _ in 0..count {
            self.next(strokes)?;
        }
        self.next(strokes)
    }
}

/// Iterator over [`Strokes`]; each stroke is made when it is asked for.
#[derive(Clone, Debug)]
pub struct Iter<'a> {
    strokes: &'a Strokes,
    cursor: Cursor,
}

/// Iterator over [`Strokes`] that it owns.
#[derive(Clone, Debug)]
pub struct IntoIter {
    strokes: Strokes,
    cursor: Cursor,
}

impl Iterator for Iter<'_> {
    type Item = Stroke;

    fn next(&mut self) -> Option<Stroke> {
        self.cursor.next(self.strokes)
    }

    fn nth(&mut self, count: usize) -> Option<Stroke> {
        self.cursor.nth(self.strokes, count)
    }

    fn size_hint(&self) -> (usize, Option<usize>) {
        let left = self.strokes.len - self.cursor.made;
        (left, Some(left))
    }
}

impl Iterator for IntoIter {
    type Item = Stroke;

    fn next(&mut self) -> Option<Stroke> {
        let before = self.cursor.chunk;
        let stroke = self.cursor.next(&self.strokes);
        // What has been read is not needed any more.
        for read in before..self.cursor.chunk {
            self.strokes.chunks[read] = Vec::new();
        }
        stroke
    }

    fn nth(&mut self, count: usize) -> Option<Stroke> {
        self.cursor.nth(&self.strokes, count)
    }

    fn size_hint(&self) -> (usize, Option<usize>) {
        let left = self.strokes.len - self.cursor.made;
        (left, Some(left))
    }
}

impl ExactSizeIterator for Iter<'_> {}
impl ExactSizeIterator for IntoIter {}

impl<'a> IntoIterator for &'a Strokes {
    type Item = Stroke;
    type IntoIter = Iter<'a>;

    fn into_iter(self) -> Iter<'a> {
        self.iter()
    }
}

impl IntoIterator for Strokes {
    type Item = Stroke;
    type IntoIter = IntoIter;

    fn into_iter(self) -> IntoIter {
        IntoIter { strokes: self, cursor: Cursor::default() }
    }
}

impl Extend<Stroke> for Strokes {
    fn extend<I: IntoIterator<Item = Stroke>>(&mut self, strokes: I) {
        strokes.into_iter().for_each(|stroke| self.push(&stroke));
    }
}

impl FromIterator<Stroke> for Strokes {
    fn from_iter<I: IntoIterator<Item = Stroke>>(strokes: I) -> Self {
        let mut packed = Self::default();
        packed.extend(strokes);
        packed.shrink_to_fit();
        packed
    }
}

impl From<Vec<Stroke>> for Strokes {
    fn from(strokes: Vec<Stroke>) -> Self {
        strokes.into_iter().collect()
    }
}

impl PartialEq for Strokes {
    fn eq(&self, other: &Self) -> bool {
        self.len == other.len && self.iter().eq(other)
    }
}

impl fmt::Debug for Strokes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_list().entries(self).finish()
    }
}
