//! Where a drawing lies on the machine.

use drawing::{Affine, Drawing, Point, Rect, Segment, Vec2};
use kinematics::Machine;

use crate::PlanError;

/// What was asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlacementOptions {
    /// Counterclockwise rotation of the drawing, rad. The lower-left corner of the ink's bounding box stays in place.
    pub rotate_rad: f64,
    /// How large and where.
    pub scale: Scale,
}

/// How large a drawing becomes and where its origin goes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Scale {
    /// Scaled by a factor about the drawing's origin, which goes to `origin`, in mm from the sheet's lower-left corner.
    Explicit {
        /// The factor; 1 is life-size.
        scale: f64,
        /// Where the drawing's (0, 0) goes.
        origin: Vec2,
    },
    /// As large as the sheet and the machine's reach allow, as near to the middle of the sheet as that leaves.
    Fit,
}

impl Default for PlacementOptions {
    /// Life-size, the drawing's origin at the sheet's lower-left corner.
    fn default() -> Self {
        Self { rotate_rad: 0.0, scale: Scale::Explicit { factor: 1.0, origin: Vec2::ZERO } }
    }
}

/// The map from drawing mm to machine mm that the options asks for.
///
/// # Errors
/// When a number is not finite, the scale not positive, or nothing fits.
pub fn place(machine: &Machine, drawing: &Drawing, options: &PlacementOptions) -> Result<Affine, PlanError> {
    let bounds = drawing.bounding_box().ok_or(PlanError::NoInk)?;
    let setting = |what: &str| PlanError::Setting { what: what.into() };
    if !options.rotate_rad.is_finite() {
        return Err(setting("the rotation must be a finite angle"));
    }
    let turned = rotation_about_corner(drawing, bounds, options.rotate_rad);
    match options.scale {
        Scale::Explicit { factor, origin_mm } => {
            if !(scale > 0.0 && scale.is_finite() && origin.is_finite()) {
                return Err(setting("the scale must be a positive number and the place finite"));
            }
            let sheet = machine.sheet();
            let corner = Vec2::new(sheet.x0, sheet.y0) + origin;
            Ok(Affine::translate(corner) * Affine::scale(scale) * turned)
        }
        Scale::Fit => {
            let mut turned_drawing = drawing.clone();
            turned_drawing.transform(turned);
            Ok(fit(machine, &turned_drawing)? * turned)
        }
    }
}

/// Rotation after which the lower-left corner of the ink's bounding box is where it was. Quarter turns are exact.
fn rotation_about_corner(drawing: &Drawing, bounds: Rect, angle: f64) -> Affine {
    if angle == 0.0 {
        return Affine::IDENTITY;
    }
    let quarters = angle / std::f64::consts::FRAC_PI_2;
    let (sin, cos) = if (quarters - quarters.round()).abs() < 1e-12 {
        [(0.0, 1.0), (1.0, 0.0), (0.0, -1.0), (-1.0, 0.0)][quarters.round().rem_euclid(4.0) as usize % 4]
    } else {
        libm::sincos(angle)
    };
    let rotation = Affine::new([cos, sin, -sin, cos, 0.0, 0.0]);
    let mut turned = drawing.clone();
    turned.transform(rotation);
    let after = turned.bounding_box().unwrap_or(bounds);
    Affine::translate((bounds.x0 - after.x0, bounds.y0 - after.y0)) * rotation
}

/// How many points of the ink decide where it fits, at most, before the whole of it is checked.
const SAMPLES_A_SIDE: f64 = 250.0;
/// Translations tried to either side of the middle along each axis.
const GRID: i32 = 24;
/// The scale is found to this share of itself.
const PRECISION: f64 = 1e-4;

/// The largest scale, with its translation, at which all ink lies on the sheet and within reach.
///
/// Reach need not be convex (the half ring of a polar machine has a hole that a drawing may lie around), so this is a
/// search: bisection over the scale, and for each scale a grid of translations from the middle outwards, refined around
/// the best. Only a sample of the ink is looked at; the exact check of every segment then either accepts the placement
/// or gives an offending point, which joins the sample, and the search goes on from there. Deterministic: no clock, no
/// chance, ties by the order of the grid.
fn fit(machine: &Machine, drawing: &Drawing) -> Result<Affine, PlanError> {
    let bounds = drawing.bounding_box().ok_or(PlanError::NoInk)?;
    let sheet = machine.sheet();
    let mut search = Search { machine, sheet, bounds, points: sample(drawing, bounds) };
    let across = if bounds.width() > 0.0 { sheet.width() / bounds.width() } else { f64::INFINITY };
    let up = if bounds.height() > 0.0 { sheet.height() / bounds.height() } else { f64::INFINITY };
    let largest = across.min(up);
    // A single dot has no size: it stays as it is.
    let largest = if largest.is_finite() { largest } else { 1.0 };
    let mut high = largest;
    for round in 0..200 {
        let Some((scale, shift)) = search.largest(high) else { break };
        let placement = Affine::translate(shift) * Affine::scale(scale);
        match first_fault(machine, sheet, drawing, placement) {
            None => return Ok(placement),
            Some(offending) => {
                search.points.insert(0, placement.inverse() * offending);
                // Points that the sample missed can only make it smaller: by a hair at first, ever more if that does not end.
                high = scale * (1.0 - 1e-5 * f64::from(round));
            }
        }
    }
    Err(PlanError::NoPlacement {
        why: "no size of it lies on the sheet and within the machine's reach".into(),
    })
}

struct Search<'a> {
    machine: &'a Machine,
    sheet: Rect,
    bounds: Rect,
    /// Those that ruled out a translation move to the front, so that most are ruled out at once.
    points: Vec<Point>,
}

impl Search<'_> {
    /// The largest scale up to `high` at which the sample fits, with a translation.
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

    /// Grows a placement that fits by trying nearby ones, in ever smaller steps.
    fn refine(&mut self, scale: f64, shift: Vec2) -> (f64, Vec2) {
        let (mut scale, mut shift) = (scale, shift);
        let middle = self.bounds.center().to_vec2();
        let mut growth = 0.02;
        while growth > 0.1 * PRECISION {
            let larger = scale * (1.0 + growth);
            // Growing about the drawing's middle, moved by up to what the growth amounts to.
            let about = shift + (scale - larger) * middle;
            let reach = 0.5 * growth * scale * self.bounds.width().max(self.bounds.height());
            let moved = from_the_middle(6).into_iter().map(|(x, y)| about + reach * Vec2::new(x, y));
            match moved.into_iter().find(|shift| self.fits(larger, *shift)) {
                Some(found) => (scale, shift) = (larger, found),
                None => growth *= 0.5,
            }
        }
        (scale, shift)
    }

    /// A translation that puts the scaled sample on the sheet and within reach, as near to the middle as the grid has one.
    fn translation(&mut self, scale: f64) -> Option<Vec2> {
        let (bounds, sheet) = (self.bounds, self.sheet);
        let low = Vec2::new(sheet.x0 - scale * bounds.x0, sheet.y0 - scale * bounds.y0);
        let high = Vec2::new(sheet.x1 - scale * bounds.x1, sheet.y1 - scale * bounds.y1);
        let room = (high - low).max_zero();
        let middle = 0.5 * (low + high);
        let shifts =
            from_the_middle(GRID).into_iter().map(|(x, y)| middle + 0.5 * Vec2::new(room.x * x, room.y * y));
        shifts.into_iter().find(|shift| self.fits(scale, *shift))
    }

    fn fits(&mut self, scale: f64, shift: Vec2) -> bool {
        let offending = self.points.iter().position(|point| {
            let at = (scale * point.to_vec2() + shift).to_point();
            !on_sheet(self.sheet, at) || self.machine.check_point(at).is_err()
        });
        if let Some(index) = offending {
            let point = self.points.remove(index);
            self.points.insert(0, point);
        }
        offending.is_none()
    }
}

trait MaxZero {
    fn max_zero(self) -> Self;
}

impl MaxZero for Vec2 {
    fn max_zero(self) -> Self {
        Self::new(self.x.max(0.0), self.y.max(0.0))
    }
}

/// The points of a grid over the square from -1 to 1, `2 half + 1` a side, by their distance from the middle.
fn from_the_middle(half: i32) -> Vec<(f64, f64)> {
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

/// Points of the ink, one for every cell of a grid over its bounding box that it passes through, and its extremes.
fn sample(drawing: &Drawing, bounds: Rect) -> Vec<Point> {
    let side = bounds.width().max(bounds.height()) / SAMPLES_A_SIDE;
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
fn first_fault(machine: &Machine, sheet: Rect, drawing: &Drawing, placement: Affine) -> Option<Point> {
    let fault = |segment: &Segment| {
        let mut off = None;
        // The sheet is convex: for a straight piece its end tells.
        segment.flatten(1e-3, |point| {
            if off.is_none() && !on_sheet(sheet, point) {
                off = Some(point);
            }
        });
        off.or_else(|| machine.check_segment(segment).err().map(|out| out.point))
    };
    drawing.strokes.iter().find_map(|stroke| {
        let start = placement * stroke.start();
        let dot = (!on_sheet(sheet, start) || machine.check_point(start).is_err()).then_some(start);
        dot.or_else(|| stroke.segments().find_map(|segment| fault(&segment.transformed(placement))))
    })
}

/// How far ink reaches beyond the sheet, mm; 0 when all of it lies on the sheet. `placed` is in machine mm.
pub fn beyond_sheet(machine: &Machine, placed: &Drawing) -> f64 {
    let sheet = machine.sheet();
    placed.bounding_box().map_or(0.0, |ink| {
        [sheet.x0 - ink.x0, ink.x1 - sheet.x1, sheet.y0 - ink.y0, ink.y1 - sheet.y1]
            .into_iter()
            .fold(0.0, f64::max)
    })
}
