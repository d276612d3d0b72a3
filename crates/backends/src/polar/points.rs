//! Points of the polar robot: what its table and its C arrays have in common.

use drawing::Point;

use crate::Setpoint;
use crate::Unrepresentable;

/// A point as the robot takes it: mm from the pivot, and degrees that grow clockwise from 0 on the left.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PolarPoint {
    pub(crate) r: f64,
    pub(crate) theta: f64,
    pub(crate) at: Point,
}

impl PolarPoint {
    /// The robot's own `theta = atan(x / y) + 90`, in a form that also holds for y = 0.
    fn new(at: Point) -> Self {
        Self { r: libm::hypot(at.x, at.y), theta: 180.0 - libm::atan2(at.y, at.x).to_degrees(), at }
    }
}

/// Straight lines in (r, theta) between neighbours stay so close to the plan, mm.
const TOLERANCE_MM: f64 = 0.05;
/// Neighbours are no further apart, mm: the robot's own drawing has 4.4 mm at the most.
const FARTHEST_MM: f64 = 2.0;

/// The points of a plan's only stroke.
///
/// # Errors
/// When there are several strokes, or a point is not within 48 < r < 138 mm, 0 < theta < 180 degrees.
pub(crate) fn points(
    setpoints: impl IntoIterator<Item = Setpoint>,
    format: &'static str,
) -> Result<Vec<PolarPoint>, Unrepresentable> {
    let mut strokes = 0;
    let mut pen = 0;
    let mut all = Vec::new();
    for (row, setpoint) in (0..).zip(setpoints) {
        let ends = pen != 0;
        strokes += u64::from(setpoint.row.pen != pen && setpoint.row.pen != 0);
        pen = setpoint.row.pen;
        if ends || pen != 0 {
            let point = PolarPoint::new(setpoint.at);
            let slack = 1e-9;
            let inside = |value: f64, low: f64, high: f64| value >= low - slack && value <= high + slack;
            if !(inside(point.r, 48.0, 138.0) && inside(point.theta, 0.0, 180.0)) {
                let range = "48 to 138 mm from its pivot, 0 to 180 degrees";
                return Err(Unrepresentable::Range {
                    row,
                    x: setpoint.at.x,
                    y: setpoint.at.y,
                    format,
                    range,
                });
            }
            all.push(point);
        }
    }
    if strokes > 1 {
        return Err(Unrepresentable::NoPenLift { format, strokes });
    }
    all.dedup();
    Ok(thin(&all))
}

/// As few of the points as stand for all of them.
fn thin(all: &[PolarPoint]) -> Vec<PolarPoint> {
    let mut kept: Vec<PolarPoint> = all.first().copied().into_iter().collect();
    let mut from = 0;
    while from + 1 < all.len() {
        let mut to = from + 1;
        while to + 1 < all.len() && stands_for(&all[from..=to + 1]) {
            to += 1;
        }
        kept.push(all[to]);
        from = to;
    }
    kept
}

/// Whether the first and the last of the points stand for all.
fn stands_for(points: &[PolarPoint]) -> bool {
    let (a, b) = (points[0], points[points.len() - 1]);
    if (b.at - a.at).hypot2() > FARTHEST_MM * FARTHEST_MM {
        return false;
    }
    points.iter().all(|p| {
        // The nearest place on the way, by the larger of the two differences.
        let (dr, dt) = (b.r - a.r, b.theta - a.theta);
        let share = if dr.abs() > a.r * dt.to_radians().abs() {
            (p.r - a.r) / dr
        } else if dt != 0.0 {
            (p.theta - a.theta) / dt
        } else {
            0.0
        };
        if !(0.0..=1.0).contains(&share) {
            return false;
        }
        let off = [p.r - (a.r + share * dr), p.r * (p.theta - (a.theta + share * dt)).to_radians()];
        libm::hypot(off[0], off[1]) <= TOLERANCE_MM
    })
}
