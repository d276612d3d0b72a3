//! Arcs, circles, wedges, rectangles and curves. Their mathematics is done in current units, where
//! a circle is a circle whatever the scale does to it afterwards.

use drawing::{CubicBez, EllipticArc, Line, Point, Rect, Segment, Vec2};

use super::Interpreter;
use crate::codes;
use crate::units::SANE_PLU;

/// The chord angle of arcs that name none, degrees.
const DEFAULT_CHORD: f64 = 5.0;

/// Chords of less than this (degrees) are a slip: on the largest sheet they would be shorter than a
/// plotter unit.
const LEAST_CHORD: f64 = 1e-3;

/// Sine and cosine of an angle in degrees, exact at multiples of 90.
fn sincos_degrees(degrees: f64) -> (f64, f64) {
    let turn = libm::fmod(degrees, 360.0);
    match if turn < 0.0 { turn + 360.0 } else { turn } {
        0.0 => (0.0, 1.0),
        90.0 => (1.0, 0.0),
        180.0 => (0.0, -1.0),
        270.0 => (-1.0, 0.0),
        angle => libm::sincos(angle.to_radians()),
    }
}

pub(super) fn turned(v: Vec2, degrees: f64) -> Vec2 {
    let (sin, cos) = sincos_degrees(degrees);
    Vec2::new(cos * v.x - sin * v.y, sin * v.x + cos * v.y)
}

/// A sweep without its idle turns: one whole turn at the most, and what leads on to the end.
fn without_idle_turns(sweep: f64) -> f64 {
    if sweep.abs() <= 360.0 { sweep } else { 360.0_f64.copysign(sweep) + libm::fmod(sweep, 360.0) }
}

/// An arc about a centre: smooth, or in chords of an angle (degrees).
fn arc(center: Point, from: Point, sweep: f64, chord: Option<f64>) -> Vec<Segment> {
    let radius = from - center;
    match chord {
        None => vec![Segment::Arc(EllipticArc {
            center,
            a: radius,
            b: Vec2::new(-radius.y, radius.x),
            start_rad: 0.0,
            sweep_rad: sweep.to_radians(),
        })],
        Some(chord) => {
            let count = (sweep.abs() / chord).ceil().max(1.0) as usize;
            let end = center + turned(radius, sweep);
            let mut at = from;
            (1..=count)
                .map(|step| {
                    let to = if step == count {
                        end
                    } else {
                        center + turned(radius, sweep * step as f64 / count as f64)
                    };
                    let line = Line::new(at, to);
                    at = to;
                    Segment::Line(line)
                })
                .collect()
        }
    }
}

/// The centre of the circle through three points, and the sweep in degrees from the first over the
/// second to the third; nothing where they lie on a line.
fn circle_through(a: Point, b: Point, c: Point) -> Option<(Point, f64)> {
    let (u, v) = (b - a, c - a);
    let cross = u.cross(v);
    let size = u.hypot2().max(v.hypot2());
    if cross.abs() <= 1e-12 * size {
        return None;
    }
    let (uu, vv) = (u.hypot2(), v.hypot2());
    // The foot of the perpendicular bisectors: |w|^2 = |w - u|^2 = |w - v|^2.
    let w = Vec2::new(v.y * uu - u.y * vv, u.x * vv - v.x * uu) / (2.0 * cross);
    let center = a + w;
    let (from, to) = (a - center, c - center);
    let mut sweep = libm::atan2(from.cross(to), from.dot(to)).to_degrees();
    // Left of the chord means counterclockwise.
    if cross > 0.0 && sweep < 0.0 {
        sweep += 360.0;
    } else if cross < 0.0 && sweep > 0.0 {
        sweep -= 360.0;
    }
    Some((center, sweep))
}

impl Interpreter {
    /// The chord angle in degrees to draw an arc with, or nothing where it is to be smooth.
    ///
    /// Plotters draw arcs in chords of 5 degrees by default because they have to, not because
    /// anybody wants to see them: such arcs are smooth here. A chord angle above that is a drawing
    /// instruction (CI with 120 is the usual way to draw a triangle) and is kept.
    fn chord(&mut self, parameter: Option<f64>, radius: f64) -> Option<f64> {
        let parameter = parameter?.abs();
        let degrees = if self.chords_by_deviation {
            // A chord of angle c leaves its arc by r (1 - cos(c/2)).
            let ratio = (parameter / radius).min(2.0);
            2.0 * libm::acos(1.0 - ratio).to_degrees()
        } else {
            libm::fmod(parameter, 360.0)
        };
        let degrees = if degrees > 180.0 { 360.0 - degrees } else { degrees };
        if 0.0 < degrees && degrees < LEAST_CHORD {
            let mnemonic = self.mnemonic;
            self.report(codes::TOO_MANY_CHORDS, || {
                format!("`{mnemonic}` asks for {:.3e} chords a turn; the arc is smooth", 360.0 / degrees)
            });
        }
        (degrees > DEFAULT_CHORD).then_some(degrees)
    }

    /// Draws, or keeps for the polygon, a path in current units that begins at the pen and leaves
    /// it at its end.
    fn follow(&mut self, path: &[Segment]) {
        let Some(last) = path.last() else { return };
        let end = self.frame.plu_of_user(last.end());
        if !self.is_sane(end) || !self.is_sane_path(path) {
            return;
        }
        let map = self.frame.user_to_mm();
        if self.polygon.is_open() {
            for segment in path {
                self.polygon.segment(segment.transformed(map), self.down);
            }
        } else if self.down {
            self.ink();
            for segment in path {
                self.tracer.segment(&segment.transformed(map));
            }
        }
        self.set_pen_position(end);
    }

    fn is_sane_path(&mut self, path: &[Segment]) -> bool {
        let corners = |bounds: Rect| [Point::new(bounds.x0, bounds.y0), Point::new(bounds.x1, bounds.y1)];
        path.iter().all(|segment| {
            let near = |corner: Point| {
                let corner = self.frame.plu_of_user(corner);
                corner.x.abs() < SANE_PLU && corner.y.abs() < SANE_PLU
            };
            if corners(segment.loose_box()).into_iter().all(near) {
                return true;
            }
            corners(segment.bounding_box()).into_iter().all(|corner| {
                let corner = self.frame.plu_of_user(corner);
                self.is_sane(corner)
            })
        })
    }

    pub(super) fn arc_absolute(&mut self, p: &[f64]) {
        match *p {
            [x, y, sweep] => self.arc_about(Point::new(x, y), sweep, None),
            [x, y, sweep, chord, ..] => self.arc_about(Point::new(x, y), sweep, Some(chord)),
            _ => self.report_dropped("a centre and an angle"),
        }
    }

    pub(super) fn arc_relative(&mut self, p: &[f64]) {
        match *p {
            [dx, dy, sweep] => self.arc_about(self.user_offset(dx, dy), sweep, None),
            [dx, dy, sweep, chord, ..] => self.arc_about(self.user_offset(dx, dy), sweep, Some(chord)),
            _ => self.report_dropped("a centre and an angle"),
        }
    }

    fn arc_about(&mut self, center: Point, sweep: f64, chord: Option<f64>) {
        let from = self.user_position();
        let radius = (from - center).hypot2().sqrt();
        if sweep == 0.0 || radius == 0.0 {
            return;
        }
        let chord = self.chord(chord, radius);
        if sweep.abs() > 360.0 {
            let mnemonic = self.mnemonic;
            self.report(codes::TOO_MANY_CHORDS, || {
                format!(
                    "`{mnemonic}` goes round {:.1} times; turns that draw nothing new are drawn once",
                    sweep.abs() / 360.0
                )
            });
        }
        self.follow(&arc(center, from, without_idle_turns(sweep), chord));
    }

    pub(super) fn arc_through_absolute(&mut self, p: &[f64]) {
        match *p {
            [xi, yi, xe, ye] => self.arc_through(Point::new(xi, yi), Point::new(xe, ye), None),
            [xi, yi, xe, ye, chord, ..] => {
                self.arc_through(Point::new(xi, yi), Point::new(xe, ye), Some(chord));
            }
            _ => self.report_dropped("two points"),
        }
    }

    pub(super) fn arc_through_relative(&mut self, p: &[f64]) {
        match *p {
            [dxi, dyi, dxe, dye] => {
                self.arc_through(self.user_offset(dxi, dyi), self.user_offset(dxe, dye), None);
            }
            [dxi, dyi, dxe, dye, chord, ..] => {
                self.arc_through(self.user_offset(dxi, dyi), self.user_offset(dxe, dye), Some(chord));
            }
            _ => self.report_dropped("two points"),
        }
    }

    /// An arc through the pen position, `inter` and `end`. Where there is none, what GhostPDL
    /// draws: all equal, a dot; start equal to end, the circle with the diameter to `inter`; two
    /// others equal, or all on a line with `inter` between, a line; `inter` beyond the end or
    /// before the start, the line to it and back to the end.
    fn arc_through(&mut self, inter: Point, end: Point, chord: Option<f64>) {
        let start = self.user_position();
        let line = |from, to| Segment::Line(Line::new(from, to));
        let none = |this: &mut Self| {
            this.report(codes::DEGENERATE_ARC, || "the points of the arc lie on a line".into());
        };
        if start == inter && inter == end {
            none(self);
            if self.down && !self.polygon.is_open() {
                self.ink();
                self.tracer.line(self.position_mm, self.position_mm);
            }
        } else if start == end {
            let center = start.midpoint(inter);
            let chord = self.chord(chord, (start - center).hypot2().sqrt());
            self.follow(&arc(center, start, 360.0, chord));
        } else if start == inter || inter == end {
            none(self);
            self.follow(&[line(start, end)]);
        } else if let Some((center, sweep)) = circle_through(start, inter, end) {
            let chord = self.chord(chord, (start - center).hypot2().sqrt());
            let mut path = arc(center, start, sweep, chord);
            // The end that the file names, not the one that the centre's rounding gives.
            if let Some(Segment::Line(last)) = path.last_mut() {
                last.p1 = end;
            }
            self.follow(&path);
            let end = self.frame.plu_of_user(end);
            if self.is_sane(end) {
                self.set_pen_position(end);
            }
        } else {
            none(self);
            let between = (inter - start).dot(end - inter) >= 0.0;
            if between {
                self.follow(&[line(start, end)]);
            } else {
                self.follow(&[line(start, inter), line(inter, end)]);
            }
        }
    }

    pub(super) fn bezier_absolute(&mut self, p: &[f64]) {
        self.beziers(p, false);
    }

    pub(super) fn bezier_relative(&mut self, p: &[f64]) {
        self.beziers(p, true);
    }

    /// Cubic curves from the pen on, each by three points; relative ones count all three from where
    /// the curve begins.
    fn beziers(&mut self, p: &[f64], relative: bool) {
        let curves = p.chunks_exact(6);
        if p.len() < 6 {
            self.report_dropped("three points a curve");
            return;
        }
        if !curves.remainder().is_empty() {
            self.report(codes::ODD_COORDINATES, || "points that make no whole curve are skipped".into());
        }
        for curve in curves {
            let from = self.user_position();
            let base = if relative { from.to_vec2() } else { Vec2::ZERO };
            let at = |index: usize| Point::new(curve[index], curve[index + 1]) + base;
            self.follow(&[Segment::Cubic(CubicBez::new(from, at(0), at(2), at(4)))]);
        }
    }

    /// Draws a closed path in current units around the pen, which stays where it is and as it is.
    fn edge(&mut self, path: &[Segment]) {
        self.ink();
        let map = self.frame.user_to_mm();
        self.tracer.outline(path.iter().map(|segment| (segment.transformed(map), true)));
    }

    /// The polygon buffer keeps the last shape, so that `EP` and `FP` can use it again.
    fn keep(&mut self, path: &[Segment]) {
        let map = self.frame.user_to_mm();
        let outline: Vec<Segment> = path.iter().map(|segment| segment.transformed(map)).collect();
        self.polygon.set(&outline);
    }

    /// `CI`: a circle about the pen, drawn whether it is up or down. A negative radius begins at
    /// the other side.
    pub(super) fn circle(&mut self, p: &[f64]) {
        let Some(&radius) = p.first() else {
            self.report_dropped("a radius");
            return;
        };
        let center = self.user_position();
        if radius == 0.0 {
            if !self.polygon.is_open() {
                self.ink();
                self.tracer.dot(self.position_mm);
            }
            return;
        }
        let chord = self.chord(p.get(1).copied(), radius.abs());
        let path = arc(center, center + Vec2::new(radius, 0.0), 360.0, chord);
        if self.polygon.is_open() {
            if self.is_sane_path(&path) {
                let map = self.frame.user_to_mm();
                let outline: Vec<Segment> = path.iter().map(|segment| segment.transformed(map)).collect();
                self.polygon.add_outline(&outline);
            }
        } else if self.is_sane_path(&path) {
            self.edge(&path);
        }
    }

    fn rectangle(&self, corner: Point) -> [Segment; 4] {
        let from = self.user_position();
        let corners = [from, Point::new(corner.x, from.y), corner, Point::new(from.x, corner.y)];
        std::array::from_fn(|k| Segment::Line(Line::new(corners[k], corners[(k + 1) % 4])))
    }

    /// The far corner of a rectangle, if the parameters give one and rectangles are allowed here.
    fn corner(&mut self, p: &[f64], relative: bool) -> Option<Point> {
        let corner = match *p {
            [x, y, ..] if relative => self.user_offset(x, y),
            [x, y, ..] => Point::new(x, y),
            _ => {
                self.report_dropped("a corner");
                return None;
            }
        };
        self.leaves_polygons_alone().then_some(corner)
    }

    /// Whether a polygon is not being defined; within one, shapes are not allowed.
    pub(super) fn leaves_polygons_alone(&mut self) -> bool {
        if self.polygon.is_open() {
            let mnemonic = self.mnemonic;
            self.report(codes::NOT_IN_POLYGON, || format!("`{mnemonic}` is not allowed in a polygon"));
        }
        !self.polygon.is_open()
    }

    fn edge_rectangle(&mut self, corner: Option<Point>) {
        if let Some(corner) = corner {
            let path = self.rectangle(corner);
            if self.is_sane_path(&path) {
                self.tracer.discard_dot();
                self.keep(&path);
                self.edge(&path);
            }
        }
    }

    pub(super) fn edge_rectangle_absolute(&mut self, p: &[f64]) {
        let corner = self.corner(p, false);
        self.edge_rectangle(corner);
    }

    pub(super) fn edge_rectangle_relative(&mut self, p: &[f64]) {
        let corner = self.corner(p, true);
        self.edge_rectangle(corner);
    }

    fn fill_rectangle(&mut self, corner: Option<Point>) {
        if let Some(corner) = corner {
            let path = self.rectangle(corner);
            if self.is_sane_path(&path) {
                self.keep(&path);
                self.fill_outlines(false);
            }
        }
    }

    pub(super) fn fill_rectangle_absolute(&mut self, p: &[f64]) {
        let corner = self.corner(p, false);
        self.fill_rectangle(corner);
    }

    pub(super) fn fill_rectangle_relative(&mut self, p: &[f64]) {
        let corner = self.corner(p, true);
        self.fill_rectangle(corner);
    }

    /// The outline of a wedge about the pen: radius, start angle, sweep. A whole turn is a circle
    /// without radii.
    fn wedge(&mut self, p: &[f64]) -> Option<Vec<Segment>> {
        let [radius, start, sweep, ref rest @ ..] = *p else {
            self.report_dropped("a radius and two angles");
            return None;
        };
        if !self.leaves_polygons_alone() || radius == 0.0 || sweep == 0.0 {
            return None;
        }
        let center = self.user_position();
        let from = center + turned(Vec2::new(radius, 0.0), start);
        let chord = self.chord(rest.first().copied(), radius.abs());
        if sweep.abs() >= 360.0 {
            return Some(arc(center, from, 360.0_f64.copysign(sweep), chord));
        }
        let mut path = vec![Segment::Line(Line::new(center, from))];
        path.extend(arc(center, from, sweep, chord));
        let end = path[path.len() - 1].end();
        path.push(Segment::Line(Line::new(end, center)));
        Some(path)
    }

    pub(super) fn edge_wedge(&mut self, p: &[f64]) {
        if let Some(path) = self.wedge(p)
            && self.is_sane_path(&path)
        {
            self.keep(&path);
            self.edge(&path);
        }
    }

    pub(super) fn fill_wedge(&mut self, p: &[f64]) {
        if let Some(path) = self.wedge(p)
            && self.is_sane_path(&path)
        {
            self.keep(&path);
            self.fill_outlines(false);
        }
    }
}
