//! Compact storage of polylines on a lattice.
//!
//! Plotters use integer units, so most points are multiples of one length and close to their
//! predecessor. Such a polyline is stored as its first point and differences of one or two bytes a
//! coordinate: 2 to 4 bytes a vertex instead of 16. The encoding is lossless: a polyline whose
//! points would not be restored bit for bit is not stored this way.

use kurbo::Point;
use std::num::NonZeroU32;

/// The spacing of a lattice: an integer number of picometres, up to 4.29 mm.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pitch(NonZeroU32);

const PICOMETRES_A_MM: f64 = 1e9;

impl Pitch {
    /// The spacing in mm; `None` unless it is an integer number of picometres from 1 to 2^32 - 1.
    pub fn from_mm(mm: f64) -> Option<Self> {
        let pitch = Self(NonZeroU32::new((mm * PICOMETRES_A_MM).round() as u32)?);
        (pitch.mm() == mm).then_some(pitch)
    }

    /// The spacing, mm. Both operands are integers, so the quotient is the `f64` nearest to the
    /// decimal number.
    fn mm(self) -> f64 {
        f64::from(self.0.get()) / PICOMETRES_A_MM
    }

    fn per_mm(self) -> f64 {
        PICOMETRES_A_MM / f64::from(self.0.get())
    }

    /// The multiple of the pitch that has exactly the bits of this coordinate, mm.
    pub(crate) fn multiple(self, mm: f64) -> Option<i32> {
        let cell = nearest(mm, self.per_mm());
        (self.at(cell).to_bits() == mm.to_bits()).then_some(cell)
    }

    /// The coordinate of a multiple, mm.
    pub(crate) fn at(self, cell: i32) -> f64 {
        self.mm() * f64::from(cell)
    }

    /// The pitch as four bytes.
    pub(crate) fn code(self) -> [u8; 4] {
        self.0.get().to_le_bytes()
    }

    /// The pitch of four bytes that [`Self::code`] made.
    pub(crate) fn of_code(code: [u8; 4]) -> Option<Self> {
        NonZeroU32::new(u32::from_le_bytes(code)).map(Self)
    }
}

/// 1.5 * 2^52: the low bits of `x + ROUND` are `x` rounded to an integer, ties to even.
const ROUND: f64 = 6_755_399_441_055_744.0;

/// The lattice index nearest to a coordinate; unspecified beyond 2^31 steps.
#[inline]
fn nearest(coordinate: f64, per_mm: f64) -> i32 {
    (coordinate * per_mm + ROUND).to_bits() as i32
}

/// Layout of [`Steps`]: bytes a coordinate difference, pitch, first point, differences.
const PITCH: usize = 1;
const START: usize = PITCH + 4;
const STEPS: usize = START + 8;

/// Two points on a lattice.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pair {
    pitch: Pitch,
    ends: [[i32; 2]; 2],
}

/// Points on a lattice. The pitch is part of the bytes: a field of its own would make every stroke
/// larger.
#[derive(Clone, Debug)]
pub(crate) struct Steps {
    code: Box<[u8]>,
}

/// What [`encode`] wrote.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Form {
    Pair,
    Steps,
}

/// Appends the code of a polyline to `code`. `None` without points, if a point is off the lattice,
/// or if a difference needs more than two bytes (unless there are two points only).
#[inline]
pub(crate) fn encode(points: &[Point], pitch: Pitch, code: &mut Vec<u8>) -> Option<Form> {
    let (mm, per_mm) = (pitch.mm(), pitch.per_mm());
    let cell = |p: Point| [nearest(p.x, per_mm), nearest(p.y, per_mm)];
    let lies_on = |p: Point, [x, y]: [i32; 2]| mm * f64::from(x) == p.x && mm * f64::from(y) == p.y;
    let first = cell(*points.first()?);
    let mut at = first;
    let mut exact = true;
    let mut longest = 0;
    for &point in points {
        let next = cell(point);
        exact &= lies_on(point, next);
        longest |= size(next[0].wrapping_sub(at[0])) | size(next[1].wrapping_sub(at[1]));
        at = next;
    }
    if !exact {
        return None;
    }
    if points.len() == 2 {
        Pair { pitch, ends: [first, at] }.write(code);
        return Some(Form::Pair);
    }
    // A difference that wraps around still leads from one point to the next, because decoding
    // wraps around too.
    let width: u8 = match longest {
        0..=0x7f => 1,
        0x80..=0x7fff => 2,
        _ => return None,
    };
    code.reserve(STEPS + 2 * usize::from(width) * (points.len() - 1));
    code.push(width);
    code.extend(pitch.0.get().to_le_bytes());
    code.extend(first[0].to_le_bytes());
    code.extend(first[1].to_le_bytes());
    at = first;
    for &point in &points[1..] {
        let next = cell(point);
        let (dx, dy) = (next[0].wrapping_sub(at[0]), next[1].wrapping_sub(at[1]));
        if width == 1 {
            code.extend([dx as u8, dy as u8]);
        } else {
            let ([a, b], [c, d]) = ((dx as i16).to_le_bytes(), (dy as i16).to_le_bytes());
            code.extend([a, b, c, d]);
        }
        at = next;
    }
    Some(Form::Steps)
}

/// The magnitude bits of a difference: the number, or its complement if it is negative.
fn size(step: i32) -> u32 {
    (step ^ (step >> 31)) as u32
}

impl Pair {
    /// Appends 20 bytes: pitch, then both points.
    pub(crate) fn write(&self, code: &mut Vec<u8>) {
        code.extend(self.pitch.code());
        let [[a, b], [c, d]] = self.ends;
        code.extend([a, b, c, d].iter().flat_map(|cell| cell.to_le_bytes()));
    }

    /// The pair that [`Self::write`] wrote.
    pub(crate) fn read(code: &[u8]) -> Option<Self> {
        let mut words = code.chunks_exact(4).map(|word| std::array::from_fn(|k| word[k]));
        let pitch = Pitch::of_code(words.next()?)?;
        let mut cells = words.map(i32::from_le_bytes);
        let mut point = || Some([cells.next()?, cells.next()?]);
        Some(Self { pitch, ends: [point()?, point()?] })
    }

    pub(crate) fn points(&self) -> [Point; 2] {
        let mm = self.pitch.mm();
        self.ends.map(|[x, y]| Point::new(mm * f64::from(x), mm * f64::from(y)))
    }
}

impl Steps {
    /// From a code of the form [`Form::Steps`].
    pub(crate) fn of_code(code: &[u8]) -> Self {
        Self { code: code.into() }
    }

    pub(crate) fn code(&self) -> &[u8] {
        &self.code
    }

    /// The number of points.
    pub(crate) fn len(&self) -> usize {
        1 + (self.code.len() - STEPS) / self.bytes_a_step()
    }

    fn bytes_a_step(&self) -> usize {
        2 * usize::from(self.code[0])
    }

    fn word(&self, at: usize) -> [u8; 4] {
        std::array::from_fn(|k| self.code[at + k])
    }

    fn pitch_mm(&self) -> f64 {
        f64::from(u32::from_le_bytes(self.word(PITCH))) / PICOMETRES_A_MM
    }

    fn first(&self) -> [i32; 2] {
        [START, START + 4].map(|at| i32::from_le_bytes(self.word(at)))
    }

    pub(crate) fn start(&self) -> Point {
        let ([x, y], mm) = (self.first(), self.pitch_mm());
        Point::new(mm * f64::from(x), mm * f64::from(y))
    }

    pub(crate) fn points(&self) -> Points<'_> {
        let steps = self.code[STEPS..].chunks_exact(self.bytes_a_step());
        Points { mm: self.pitch_mm(), at: Some(self.first()), steps }
    }
}

/// Iterator over the points of [`Steps`].
#[derive(Clone, Debug)]
pub(crate) struct Points<'a> {
    mm: f64,
    at: Option<[i32; 2]>,
    steps: std::slice::ChunksExact<'a, u8>,
}

impl Iterator for Points<'_> {
    type Item = Point;

    #[inline]
    fn next(&mut self) -> Option<Point> {
        let [x, y] = self.at?;
        let signed = |byte: u8| i32::from(byte as i8);
        self.at = self.steps.next().map(|step| match *step {
            [dx, dy] => [x.wrapping_add(signed(dx)), y.wrapping_add(signed(dy))],
            [a, b, c, d] => [
                x.wrapping_add(i32::from(i16::from_le_bytes([a, b]))),
                y.wrapping_add(i32::from(i16::from_le_bytes([c, d]))),
            ],
            _ => [x, y],
        });
        Some(Point::new(self.mm * f64::from(x), self.mm * f64::from(y)))
    }

    fn size_hint(&self) -> (usize, Option<usize>) {
        let left = usize::from(self.at.is_some()) + self.steps.len();
        (left, Some(left))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn back(points: &[Point], pitch: Pitch) -> Option<Vec<Point>> {
        let mut code = Vec::new();
        encode(points, pitch, &mut code).map(|form| match form {
            Form::Pair => Pair::read(&code).unwrap().points().to_vec(),
            Form::Steps => {
                let steps = Steps::of_code(&code);
                assert_eq!(steps.len(), points.len());
                steps.points().collect()
            }
        })
    }

    fn on(pitch: f64, cells: &[(i32, i32)]) -> Vec<Point> {
        cells.iter().map(|&(x, y)| Point::new(pitch * f64::from(x), pitch * f64::from(y))).collect()
    }

    #[test]
    fn lattice_points_are_restored_bit_for_bit() {
        for mm in [0.025, 0.024_88] {
            let pitch = Pitch::from_mm(mm).unwrap();
            for cells in [
                &[(7, -3)][..],
                &[(0, 0), (i32::MAX, i32::MIN)],
                &[(10_364, 7961), (10_365, 7962), (10_300, 7900), (10_237, 7834)],
                &[(-5, 5), (-133, 132), (-5, 5)],
                &[(0, 0), (32_767, -32_768), (-1, -1)],
                &[(0, 0), (127, -128), (0, 0)],
                &[(0, 0), (128, 0), (0, -129)],
            ] {
                let points = on(mm, cells);
                assert_eq!(back(&points, pitch).as_deref(), Some(&points[..]), "{cells:?}");
            }
        }
    }

    #[test]
    fn off_lattice_points_and_pitches_are_rejected() {
        let pitch = Pitch::from_mm(0.025).unwrap();
        assert!(back(&[], pitch).is_none());
        assert!(back(&[Point::new(0.01, 0.0)], pitch).is_none());
        assert!(back(&[Point::new(0.025, f64::NAN)], pitch).is_none());
        assert!(back(&[Point::new(0.025, f64::INFINITY)], pitch).is_none());
        assert!(back(&[Point::new(0.025 * 4_294_967_296.0, 0.0)], pitch).is_none());
        assert!(back(&on(0.025, &[(0, 0), (32_768, 0), (0, 0)]), pitch).is_none());
        assert!(Pitch::from_mm(0.0).is_none());
        assert!(Pitch::from_mm(-0.025).is_none());
        assert!(Pitch::from_mm(1e-10).is_none());
        assert!(Pitch::from_mm(1.0 / 3.0).is_none());
        assert!(Pitch::from_mm(5.0).is_none());
    }
}
