//! Placement of a drawing on a sheet, within a machine's reach where there is one.

use drawing::{Affine, Drawing, Point, Rect, Segment, Vec2};
use kinematics::Machine;

use crate::error::PlanError;

/// What a drawing is placed on: a machine with its sheet and reach, or a bare sheet ([`Rect`], mm).
pub trait Surface {
    /// The sheet, mm. Edges may be infinite.
    fn sheet(&self) -> Rect;

    /// Whether the pen reaches a point, mm.
    fn reaches(&self, point: Point) -> bool;

    /// A point of the segment that the pen does not reach, mm.
    fn unreachable_point(&self, segment: &Segment) -> Option<Point>;
}

impl Surface for Machine {
    fn sheet(&self) -> Rect {
        Machine::sheet(self)
    }

    fn reaches(&self, point: Point) -> bool {
        self.check_point(point).is_ok()
    }

    fn unreachable_point(&self, segment: &Segment) -> Option<Point> {
        self.check_segment(segment).err().map(|outside| outside.point)
    }
}

/// A sheet without a machine: the pen reaches every point.
impl Surface for Rect {
    fn sheet(&self) -> Rect {
        *self
    }

    fn reaches(&self, _point: Point) -> bool {
        true
    }

    fn unreachable_point(&self, _segment: &Segment) -> Option<Point> {
        None
    }
}

/// Where and how large to place a drawing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlacementOptions {
    /// Reflection of the drawing, before the rotation. The lower-left corner of the ink's bounding
    /// box stays in place.
    pub mirror: Option<Mirror>,
    /// Counterclockwise rotation of the drawing, rad. The lower-left corner of the ink's bounding box
    /// stays in place.
    pub rotate_rad: f64,
    /// Size and position.
    pub scale: Scale,
    /// Distance that [`Scale::Aligned`], [`Scale::Fit`] and [`Scale::Shrink`] keep from the edges of
    /// the sheet, mm.
    pub margin_mm: f64,
}

/// A reflection.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mirror {
    /// Left and right swap: x becomes -x.
    X,
    /// Top and bottom swap: y becomes -y.
    Y,
}

/// The size of the placed drawing and the position of its origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Scale {
    /// Scaled by a factor about the drawing's origin, which is then moved to `origin_mm`.
    Explicit {
        /// The factor; 1 keeps the drawing's size.
        factor: f64,
        /// Position of the drawing's (0, 0), in mm from the sheet's lower-left corner.
        origin_mm: Vec2,
    },
    /// Scaled by a factor; the ink's bounding box is then aligned with the sheet less its margin.
    Aligned {
        /// The factor; 1 keeps the drawing's size.
        factor: f64,
        /// Position of the box between the left (0) and right (1) edge, and between the bottom (0)
        /// and top (1) edge.
        align: Vec2,
    },
    /// As large as the sheet less its margin and the machine's reach allow, as close to the sheet's
    /// center as possible at that size.
    Fit,
    /// As [`Self::Fit`], but never larger than the drawing itself.
    Shrink,
}

impl Default for PlacementOptions {
    /// Actual size, with the drawing's origin at the sheet's lower-left corner.
    fn default() -> Self {
        Self {
            mirror: None,
            rotate_rad: 0.0,
            scale: Scale::Explicit { factor: 1.0, origin_mm: Vec2::ZERO },
            margin_mm: 0.0,
        }
    }
}

/// The map from drawing mm to mm of the surface: machine mm for a machine.
///
/// An explicit placement is not checked against the sheet and the reach; see
/// [`crate::check_reach`] and [`beyond_sheet_mm`].
///
/// # Errors
/// [`PlanError::NoInk`] for an empty drawing, [`PlanError::Setting`] if a number is not finite or
/// the scale is not positive, [`PlanError::NoPlacement`] if no size fits.
pub fn place(
    surface: &dyn Surface,
    drawing: &Drawing,
    options: &PlacementOptions,
) -> Result<Affine, PlanError> {
    let bounds = drawing.bounding_box().ok_or(PlanError::NoInk)?;
    let setting = |what: &'static str| PlanError::Setting { what };
    if !options.rotate_rad.is_finite() {
        return Err(setting("the rotation must be a finite angle"));
    }
    let sheet = surface.sheet();
    let margin = options.margin_mm;
    let inside = sheet.inset(-margin);
    // Sheets may be unbounded: a margin only matters where an edge is finite.
    if !(margin >= 0.0 && margin.is_finite() && inside.x0 < inside.x1 && inside.y0 < inside.y1) {
        return Err(setting("the margin must leave some of the sheet"));
    }
    let rotation = rotation_about_corner(drawing, bounds, options.mirror, options.rotate_rad);
    let valid = |factor: f64| factor > 0.0 && factor.is_finite();
    match options.scale {
        Scale::Explicit { factor, origin_mm } => {
            if !(valid(factor) && origin_mm.is_finite()) {
                return Err(setting("the scale must be a positive number and the place finite"));
            }
            let corner = Vec2::new(sheet.x0, sheet.y0) + origin_mm;
            Ok(Affine::translate(corner) * Affine::scale(factor) * rotation)
        }
        Scale::Aligned { factor, align } => {
            if !valid(factor) {
                return Err(setting("the scale must be a positive number"));
            }
            let scaled = Affine::scale(factor) * rotation;
            let mut placed = drawing.clone();
            placed.transform(scaled);
            let ink = placed.bounding_box().unwrap_or(bounds);
            let free = inside.size() - ink.size();
            let corner = Vec2::new(inside.x0 + align.x * free.width, inside.y0 + align.y * free.height);
            Ok(Affine::translate(corner - Vec2::new(ink.x0, ink.y0)) * scaled)
        }
        Scale::Fit | Scale::Shrink => {
            let mut rotated = drawing.clone();
            rotated.transform(rotation);
            let largest = if options.scale == Scale::Fit { f64::INFINITY } else { 1.0 };
            Ok(fit(surface, inside, &rotated, largest)? * rotation)
        }
    }
}

/// The reflection and rotation that keep the lower-left corner of the ink's bounding box in place.
/// Multiples of 90 degrees are exact.
fn rotation_about_corner(drawing: &Drawing, bounds: Rect, mirror: Option<Mirror>, angle: f64) -> Affine {
    if angle == 0.0 && mirror.is_none() {
        return Affine::IDENTITY;
    }
    let quarters = angle / std::f64::consts::FRAC_PI_2;
    let (sin, cos) = if (quarters - quarters.round()).abs() < 1e-12 {
        [(0.0, 1.0), (1.0, 0.0), (0.0, -1.0), (-1.0, 0.0)][quarters.round().rem_euclid(4.0) as usize % 4]
    } else {
        libm::sincos(angle)
    };
    let reflection = match mirror {
        None => Affine::IDENTITY,
        Some(Mirror::X) => Affine::new([-1.0, 0.0, 0.0, 1.0, 0.0, 0.0]),
        Some(Mirror::Y) => Affine::new([1.0, 0.0, 0.0, -1.0, 0.0, 0.0]),
    };
    let rotation = Affine::new([cos, sin, -sin, cos, 0.0, 0.0]) * reflection;
    let mut turned = drawing.clone();
    turned.transform(rotation);
    let after = turned.bounding_box().unwrap_or(bounds);
    Affine::translate((bounds.x0 - after.x0, bounds.y0 - after.y0)) * rotation
}

/// Resolution of the ink's sample, in cells along the longer side of its bounding box.
const SAMPLES_PER_SIDE: f64 = 250.0;
/// Number of translations tried on either side of the center along each axis.
const GRID: i32 = 24;
/// Relative precision of the scale.
const PRECISION: f64 = 1e-4;

/// The largest scale up to `most`, with its translation, at which all ink lies on `sheet` and within
/// reach.
///
/// The set of placements that fit need not be convex (the half ring of a polar machine has a hole
/// that a drawing may enclose), so this is a search: bisection over the scale, and for each scale a
/// grid of translations from the center outwards, refined around the best. The search looks at a
/// sample of the ink. The exact check of every segment then either accepts the placement or returns a
/// violating point, which is added to the sample, and the search continues. Deterministic: ties are
/// broken by the order of the grid.
fn fit(surface: &dyn Surface, sheet: Rect, drawing: &Drawing, most: f64) -> Result<Affine, PlanError> {
    let bounds = drawing.bounding_box().ok_or(PlanError::NoInk)?;
    let mut search = Search { surface, sheet, bounds, points: sample(drawing, bounds) };
    let across = if bounds.width() > 0.0 { sheet.width() / bounds.width() } else { f64::INFINITY };
    let up = if bounds.height() > 0.0 { sheet.height() / bounds.height() } else { f64::INFINITY };
    let largest = across.min(up).min(most);
    // A single dot has no extent: it keeps its scale.
    let largest = if largest.is_finite() { largest } else { 1.0 };
    let mut high = largest;
    for round in 0..200 {
        let Some((scale, shift)) = search.largest(high) else { break };
        let placement = Affine::translate(shift) * Affine::scale(scale);
        match first_violation(surface, sheet, drawing, placement) {
            None => return Ok(placement),
            Some(offending) => {
                search.points.insert(0, placement.inverse() * offending);
                // More points only reduce the scale: by 1e-5 at first, by more in each later round.
                high = scale * (1.0 - 1e-5 * f64::from(round));
            }
        }
    }
    Err(PlanError::NoPlacement { why: "no size of it lies on the sheet and within the machine's reach" })
}

struct Search<'a> {
    surface: &'a dyn Surface,
    sheet: Rect,
    bounds: Rect,
    /// The sample. A point that rules out a translation moves to the front, since it is likely to rule
    /// out the next one.
    points: Vec<Point>,
}

impl Search<'_> {
    /// The largest scale up to `high` at which the sample fits, with its translation.
    fn largest(&mut self, high: f64) -> Option<(f64, Vec2)> {
        if let Some(shift) = self.translation(high) {
            return Some((high, shift));
        }
        let (mut low, mut high, mut best) = (0.0, high, None);
        while high - low > PRECISION * high && high > 1e-9 {
            let middle = 0.5 * (low + high);
            match self.translation(middle) {
                Some(shift) => {
                    best = Some((middle, shift));
                    low = middle;
                }
                None => high = middle,
            }
        }
        best.map(|(scale, shift)| self.refine(scale, shift))
    }

    /// Enlarges a placement that fits by trying nearby translations, with decreasing steps.
    fn refine(&mut self, scale: f64, shift: Vec2) -> (f64, Vec2) {
        let (mut scale, mut shift) = (scale, shift);
        let middle = self.bounds.center().to_vec2();
        let mut growth = 0.02;
        while growth > 0.1 * PRECISION {
            let larger = scale * (1.0 + growth);
            // Enlarged about the drawing's center, and moved by at most half the growth.
            let about = shift + (scale - larger) * middle;
            let reach = 0.5 * growth * scale * self.bounds.width().max(self.bounds.height());
            let moved = from_center(6).into_iter().map(|(x, y)| about + reach * Vec2::new(x, y));
            match moved.into_iter().find(|shift| self.fits(larger, *shift)) {
                Some(found) => (scale, shift) = (larger, found),
                None => growth *= 0.5,
            }
        }
        (scale, shift)
    }

    /// The translation nearest to the center, on the grid, that puts the scaled sample on the sheet and
    /// within reach.
    fn translation(&mut self, scale: f64) -> Option<Vec2> {
        let (bounds, sheet) = (self.bounds, self.sheet);
        let low = Vec2::new(sheet.x0 - scale * bounds.x0, sheet.y0 - scale * bounds.y0);
        let high = Vec2::new(sheet.x1 - scale * bounds.x1, sheet.y1 - scale * bounds.y1);
        let free = Vec2::new((high - low).x.max(0.0), (high - low).y.max(0.0));
        let middle = 0.5 * (low + high);
        let shifts =
            from_center(GRID).into_iter().map(|(x, y)| middle + 0.5 * Vec2::new(free.x * x, free.y * y));
        shifts.into_iter().find(|shift| self.fits(scale, *shift))
    }

    fn fits(&mut self, scale: f64, shift: Vec2) -> bool {
        let offending = self.points.iter().position(|point| {
            let at = (scale * point.to_vec2() + shift).to_point();
            !on_sheet(self.sheet, at) || !self.surface.reaches(at)
        });
        if let Some(index) = offending {
            let point = self.points.remove(index);
            self.points.insert(0, point);
        }
        offending.is_none()
    }
}

/// The points of a grid over the square from -1 to 1, `2 half + 1` per side, sorted by their distance
/// from the center.
fn from_center(half: i32) -> Vec<(f64, f64)> {
    let mut cells: Vec<(i32, i32)> =
        (-half..=half).flat_map(|y| (-half..=half).map(move |x| (x, y))).collect();
    cells.sort_by_key(|(x, y)| (x * x + y * y, *y, *x));
    let share = |k: i32| f64::from(k) / f64::from(half);
    cells.into_iter().map(|(x, y)| (share(x), share(y))).collect()
}

fn on_sheet(sheet: Rect, p: Point) -> bool {
    let slack = 1e-9 * (1.0 + sheet.width().max(sheet.height()));
    p.x >= sheet.x0 - slack && p.x <= sheet.x1 + slack && p.y >= sheet.y0 - slack && p.y <= sheet.y1 + slack
}

/// Points of the ink: one for every cell of a grid over its bounding box that the ink passes through,
/// and its extreme points.
fn sample(drawing: &Drawing, bounds: Rect) -> Vec<Point> {
    let side = bounds.width().max(bounds.height()) / SAMPLES_PER_SIDE;
    let mut taken = std::collections::BTreeSet::new();
    let mut points = Vec::new();
    let mut add = |p: Point| {
        let cell =
            if side > 0.0 { ((p.x / side).floor() as i64, (p.y / side).floor() as i64) } else { (0, 0) };
        let extreme = p.x == bounds.x0 || p.x == bounds.x1 || p.y == bounds.y0 || p.y == bounds.y1;
        if taken.insert(cell) || extreme {
            points.push(p);
        }
    };
    for stroke in &drawing.strokes {
        let vertices = stroke.flatten(side.max(1e-3));
        add(vertices[0]);
        for pair in vertices.windows(2) {
            let along = pair[1] - pair[0];
            let steps = if side > 0.0 { (along.hypot2().sqrt() / side).ceil().min(1e4) as usize } else { 1 };
            for step in 1..=steps {
                add(pair[0] + (step as f64 / steps as f64) * along);
            }
        }
    }
    points.dedup();
    points
}

/// The first point of the placed drawing that is off the sheet or out of reach, machine mm.
fn first_violation(
    surface: &dyn Surface,
    sheet: Rect,
    drawing: &Drawing,
    placement: Affine,
) -> Option<Point> {
    let fault = |segment: &Segment| {
        let mut outside = None;
        // The sheet is convex, so for a line its end is sufficient.
        segment.flatten(1e-3, |point| {
            if outside.is_none() && !on_sheet(sheet, point) {
                outside = Some(point);
            }
        });
        outside.or_else(|| surface.unreachable_point(segment))
    };
    drawing.strokes.iter().find_map(|stroke| {
        let start = placement * stroke.start();
        let dot = (!on_sheet(sheet, start) || !surface.reaches(start)).then_some(start);
        dot.or_else(|| stroke.segments().find_map(|segment| fault(&segment.transformed(placement))))
    })
}

/// The largest distance of ink outside the sheet, mm; 0 if all of it lies on the sheet. `placed` is
/// in mm of the surface.
pub fn beyond_sheet_mm(surface: &dyn Surface, placed: &Drawing) -> f64 {
    let sheet = surface.sheet();
    placed.bounding_box().map_or(0.0, |ink| {
        [sheet.x0 - ink.x0, ink.x1 - sheet.x1, sheet.y0 - ink.y0, ink.y1 - sheet.y1]
            .into_iter()
            .fold(0.0, f64::max)
    })
}
