//! Bodies of the entries of [`Strokes`](super::Strokes); see [`Kind`] for their forms. Lossless: what
//! would not be restored bit for bit is written in a more general form.

use kurbo::{Point, Vec2};

use crate::lattice::{self, Form, Pair, Steps};
use crate::path::{Curve, Path};
use crate::{EllipticArc, Pitch, Trail};

/// What an entry holds. Numbers are little endian.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub(super) enum Kind {
    /// A line between lattice points: [`Pair::write`].
    Pair = 0,
    /// A polyline on a lattice: [`Steps::code`].
    Steps,
    /// A polyline: coordinates, `f64`.
    Line,
    /// One arc: flags, then what they do not give ([`ArcFlags`]).
    Arc,
    /// Number of vertices; vertices; each curve: segment, 0 and an arc's numbers, or 1 and control
    /// points.
    Free,
    /// A label: index of its lettering, number of strokes, text.
    Label,
}

impl Kind {
    #[inline]
    pub(super) fn of_byte(byte: u8) -> Option<Self> {
        [Self::Pair, Self::Steps, Self::Line, Self::Arc, Self::Free, Self::Label]
            .get(usize::from(byte))
            .copied()
    }
}

/// Flags of an arc: what of it follows from the rest. Its numbers follow in the order of the flags.
struct ArcFlags;

impl ArcFlags {
    /// Centre, `a` and the start are multiples of a pitch (4 bytes), `i32`; otherwise `f64`.
    const LATTICE: u8 = 1;
    /// `b` is `a`, a quarter turn counterclockwise or clockwise.
    const LEFT: u8 = 2;
    const RIGHT: u8 = 4;
    /// `start_rad` is 0.
    const FROM_ZERO: u8 = 8;
    /// `sweep_rad` is a whole number of degrees, `i16`.
    const DEGREES: u8 = 16;
    /// The first vertex is the arc's first point.
    const STARTS_ON_ARC: u8 = 32;
    /// The last vertex is the arc's last point, or the first vertex.
    const ENDS_ON_ARC: u8 = 64;
    const CLOSED: u8 = 128;
}

/// Appends the body of a path, and returns its kind.
pub(super) fn write(path: &Path, code: &mut Vec<u8>) -> Kind {
    match path {
        Path::Pair(pair) => {
            pair.write(code);
            Kind::Pair
        }
        Path::Steps(steps) => {
            code.extend_from_slice(steps.code());
            Kind::Steps
        }
        Path::Line(points) => {
            write_points(points, code);
            Kind::Line
        }
        Path::Free(trail) => write_trail(trail, None, code),
    }
}

/// Appends the body of a path of at least one vertex, and returns its kind.
#[inline]
pub(super) fn write_trail(trail: &Trail, pitch: Option<Pitch>, code: &mut Vec<u8>) -> Kind {
    match (trail.curves.as_slice(), trail.vertices.as_slice()) {
        ([], points) => match pitch.and_then(|pitch| lattice::encode(points, pitch, code)) {
            Some(Form::Pair) => Kind::Pair,
            Some(Form::Steps) => Kind::Steps,
            None => {
                write_points(points, code);
                Kind::Line
            }
        },
        ([(_, Curve::Arc(arc))], [start, end]) => {
            write_arc(arc, [*start, *end], pitch, code);
            Kind::Arc
        }
        _ => {
            write_free(trail, code);
            Kind::Free
        }
    }
}

/// The path of a body.
pub(super) fn read(kind: Kind, body: &[u8]) -> Option<Path> {
    let mut reader = Reader(body);
    match kind {
        Kind::Pair => Pair::read(body).map(Path::Pair),
        Kind::Steps => Some(Path::Steps(Steps::of_code(body))),
        Kind::Line => {
            let points = body.chunks_exact(16).filter_map(|chunk| Reader(chunk).point());
            Some(Path::Line(points.collect()))
        }
        Kind::Arc => read_arc(&mut reader),
        Kind::Free => read_free(&mut reader),
        Kind::Label => None,
    }
}

pub(super) fn write_label(lettering: u32, strokes: u32, text: &[u8], code: &mut Vec<u8>) {
    code.extend(lettering.to_le_bytes());
    code.extend(strokes.to_le_bytes());
    code.extend_from_slice(text);
}

/// The number of strokes of a label.
pub(super) fn label_strokes(body: &[u8]) -> usize {
    let mut reader = Reader(body);
    reader.u32().and_then(|_| reader.u32()).unwrap_or(0) as usize
}

/// The index of a label's lettering, and its text.
pub(super) fn label(body: &[u8]) -> (usize, &[u8]) {
    let mut reader = Reader(body);
    let lettering = reader.u32().unwrap_or(u32::MAX) as usize;
    reader.u32();
    (lettering, reader.0)
}

fn write_points(points: &[Point], code: &mut Vec<u8>) {
    code.reserve(16 * points.len());
    for point in points {
        write_point(*point, code);
    }
}

fn write_point(point: Point, code: &mut Vec<u8>) {
    code.extend(point.x.to_le_bytes());
    code.extend(point.y.to_le_bytes());
}

fn write_arc(arc: &EllipticArc, [start, end]: [Point; 2], pitch: Option<Pitch>, code: &mut Vec<u8>) {
    let at = code.len();
    let mut flags = 0;
    let mut set = |flag: u8, holds: bool| {
        flags |= if holds { flag } else { 0 };
        !holds
    };
    let EllipticArc { center, a, b, start_rad, sweep_rad } = *arc;
    code.push(0);
    let starts_off_arc = set(ArcFlags::STARTS_ON_ARC, is(start, arc.eval(0.0)));
    let start = starts_off_arc.then_some(start);
    let numbers =
        [center.x, center.y, a.x, a.y].into_iter().chain(start.iter().flat_map(|start| [start.x, start.y]));
    let on_lattice = pitch.and_then(|pitch| {
        code.extend(pitch.code());
        numbers.clone().try_for_each(|number| {
            code.extend(pitch.multiple(number)?.to_le_bytes());
            Some(())
        })
    });
    if set(ArcFlags::LATTICE, on_lattice.is_some()) {
        code.truncate(at + 1);
        numbers.for_each(|number| code.extend(number.to_le_bytes()));
    }
    let is_left = is(b.to_point(), left_of(a).to_point());
    if set(ArcFlags::LEFT, is_left) && set(ArcFlags::RIGHT, is(b.to_point(), right_of(a).to_point())) {
        write_point(b.to_point(), code);
    }
    if set(ArcFlags::FROM_ZERO, start_rad.to_bits() == 0) {
        code.extend(start_rad.to_le_bytes());
    }
    let degrees = sweep_rad.to_degrees().round().clamp(f64::from(i16::MIN), f64::from(i16::MAX));
    if set(ArcFlags::DEGREES, degrees.to_radians().to_bits() == sweep_rad.to_bits()) {
        code.extend(sweep_rad.to_le_bytes());
    } else {
        code.extend((degrees as i16).to_le_bytes());
    }
    let start = start.unwrap_or_else(|| arc.eval(0.0));
    if set(ArcFlags::CLOSED, is(end, start)) && set(ArcFlags::ENDS_ON_ARC, is(end, arc.eval(1.0))) {
        write_point(end, code);
    }
    code[at] = flags;
}

fn read_arc(reader: &mut Reader<'_>) -> Option<Path> {
    let flags = reader.take::<1>()?[0];
    let has = |flag: u8| flags & flag != 0;
    let pitch = if has(ArcFlags::LATTICE) { Some(Pitch::of_code(reader.take()?)?) } else { None };
    let mut coordinates = || {
        let mut number = || match pitch {
            Some(pitch) => reader.u32().map(|cell| pitch.at(cell as i32)),
            None => reader.f64(),
        };
        Some(Point::new(number()?, number()?))
    };
    let (center, a) = (coordinates()?, coordinates()?.to_vec2());
    let start = if has(ArcFlags::STARTS_ON_ARC) { None } else { Some(coordinates()?) };
    let b = if has(ArcFlags::LEFT) {
        left_of(a)
    } else if has(ArcFlags::RIGHT) {
        right_of(a)
    } else {
        reader.point()?.to_vec2()
    };
    let start_rad = if has(ArcFlags::FROM_ZERO) { 0.0 } else { reader.f64()? };
    let sweep_rad = if has(ArcFlags::DEGREES) {
        f64::from(i16::from_le_bytes(reader.take()?)).to_radians()
    } else {
        reader.f64()?
    };
    let arc = EllipticArc { center, a, b, start_rad, sweep_rad };
    let start = start.unwrap_or_else(|| arc.eval(0.0));
    let end = if has(ArcFlags::CLOSED) {
        start
    } else if has(ArcFlags::ENDS_ON_ARC) {
        arc.eval(1.0)
    } else {
        reader.point()?
    };
    Some(Path::Free(Box::new(Trail { vertices: vec![start, end], curves: vec![(0, Curve::Arc(arc))] })))
}

fn write_free(trail: &Trail, code: &mut Vec<u8>) {
    code.extend((trail.vertices.len() as u32).to_le_bytes());
    write_points(&trail.vertices, code);
    for (segment, curve) in &trail.curves {
        code.extend((*segment as u32).to_le_bytes());
        match curve {
            Curve::Arc(EllipticArc { center, a, b, start_rad, sweep_rad }) => {
                code.push(0);
                write_points(
                    &[*center, a.to_point(), b.to_point(), Point::new(*start_rad, *sweep_rad)],
                    code,
                );
            }
            Curve::Cubic(c1, c2) => {
                code.push(1);
                write_points(&[*c1, *c2], code);
            }
        }
    }
}

fn read_free(reader: &mut Reader<'_>) -> Option<Path> {
    let count = reader.u32()? as usize;
    let vertices: Vec<Point> = (0..count).map_while(|_| reader.point()).collect();
    let mut curves = Vec::new();
    while let Some(segment) = reader.u32() {
        let curve = if reader.take::<1>()? == [0] {
            let (center, a, b) = (reader.point()?, reader.point()?.to_vec2(), reader.point()?.to_vec2());
            Curve::Arc(EllipticArc { center, a, b, start_rad: reader.f64()?, sweep_rad: reader.f64()? })
        } else {
            Curve::Cubic(reader.point()?, reader.point()?)
        };
        curves.push((segment as usize, curve));
    }
    (vertices.len() == count && count > 0).then(|| Path::Free(Box::new(Trail { vertices, curves })))
}

/// A vector, a quarter turn counterclockwise. The difference makes zeros positive, as maps do.
fn left_of(v: Vec2) -> Vec2 {
    Vec2::new(0.0 - v.y, v.x)
}

/// A vector, a quarter turn clockwise.
fn right_of(v: Vec2) -> Vec2 {
    Vec2::new(v.y, 0.0 - v.x)
}

/// Whether two points have the same bits.
fn is(a: Point, b: Point) -> bool {
    a.x.to_bits() == b.x.to_bits() && a.y.to_bits() == b.y.to_bits()
}

/// Reads numbers off a list of bytes.
struct Reader<'a>(&'a [u8]);

impl Reader<'_> {
    fn take<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (first, rest) = self.0.split_first_chunk()?;
        self.0 = rest;
        Some(*first)
    }

    fn u32(&mut self) -> Option<u32> {
        self.take().map(u32::from_le_bytes)
    }

    fn f64(&mut self) -> Option<f64> {
        self.take().map(f64::from_le_bytes)
    }

    fn point(&mut self) -> Option<Point> {
        Some(Point::new(self.f64()?, self.f64()?))
    }
}
