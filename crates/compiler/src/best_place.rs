//! Placement for the shortest plan or the finest resolution: the position on the sheet, and the turn.
//!
//! The duration of a plan has local minima over positions and turns, and no cheap gradient. So a grid
//! of both is compared by an estimate from samples of the ink, the best cells are improved by a pattern
//! search (Hooke and Jeeves 1961), and for the duration the best of those are planned. The effort is a
//! number of placements, never a time: the result is the same on every machine.

use drawing::{Affine, Drawing, Point, Rect, Stroke, Vec2};
use kinematics::{JointPos, Machine};
use planner::{PlacementOptions, PlanError, Scale, place};

/// What a placement is searched for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BestFor {
    /// The least duration of the plan.
    Time,
    /// The finest resolution: the least of the largest quantization errors along the ink.
    Accuracy,
}

impl BestFor {
    /// Its name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Time => "time",
            Self::Accuracy => "accuracy",
        }
    }
}

/// A search for the best placement.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Search {
    /// What the placement is best for.
    pub aim: BestFor,
    /// Whether the drawing may be turned.
    pub turns: bool,
}

/// The best placement that was found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BestPlace {
    /// The placement: explicit, in hundredths of millimetres and degrees, so that it can be written as
    /// options of the command line.
    pub options: PlacementOptions,
    /// What it is best for.
    pub aim: BestFor,
    /// Its figure: the duration, s, or the largest quantization error along the ink, mm.
    pub figure: f64,
    /// The figure of the drawing in the middle of the sheet without a turn; `None` where the machine
    /// cannot draw it there.
    pub centered: Option<f64>,
    /// The number of placements that were compared.
    pub compared: usize,
}

/// Positions along each side of the free area, less one.
const GRID: u32 = 8;
/// Turns that are compared, evenly from 0 to 360 degrees.
const TURNS: u32 = 24;
/// Placements that the pattern search begins from, and its halvings of the step.
const SEEDS: usize = 6;
const HALVINGS: u32 = 3;
/// Steps of one pattern search.
const STEPS: usize = 60;
/// Largest number of samples of the ink, of its corners, and of the travel between strokes.
const SAMPLES: f64 = 400.0;
/// Segments that are planned for the comparison of durations, all placements together.
const PLANNED_SEGMENTS: usize = 40_000;
/// Positions and turns are multiples of 1 / this, mm and degrees.
const PER_UNIT: f64 = 100.0;

/// A piece of the ink: a point with the direction in which it is drawn (a unit vector), and its length.
#[derive(Clone, Copy, Debug)]
struct Ink {
    point: Point,
    direction: Vec2,
    length: f64,
}

/// A corner: where the direction changes by `change`. It stands for `count` corners.
#[derive(Clone, Copy, Debug)]
struct Corner {
    point: Point,
    change: Vec2,
    count: f64,
}

/// Travel between two strokes. It stands for `count` travels.
#[derive(Clone, Copy, Debug)]
struct Travel {
    ends: [Point; 2],
    count: f64,
}

/// Samples of a drawing, drawing mm.
#[derive(Debug, Default)]
struct Samples {
    ink: Vec<Ink>,
    corners: Vec<Corner>,
    travels: Vec<Travel>,
}

impl Samples {
    fn of(drawing: &Drawing) -> Self {
        let mut samples = Self::default();
        let step = drawing.length() / SAMPLES;
        let segments: usize = drawing.strokes.iter().map(|stroke| stroke.segment_count()).sum();
        let stride = (segments as f64 / SAMPLES).ceil().max(1.0) as usize;
        let (mut due, mut number) = (0.5 * step, 0_usize);
        for stroke in &drawing.strokes {
            let mut before: Option<Vec2> = None;
            for segment in stroke.segments() {
                let length = segment.length();
                let direction = |t: f64| {
                    let (a, b) = (segment.eval((t - 1e-3).max(0.0)), segment.eval((t + 1e-3).min(1.0)));
                    let size = drawing::distance(a, b);
                    if size > 0.0 { (b - a) / size } else { Vec2::new(1.0, 0.0) }
                };
                if let Some(before) = before {
                    number += 1;
                    if number.is_multiple_of(stride) {
                        let (point, change) = (segment.start(), direction(0.0) - before);
                        samples.corners.push(Corner { point, change, count: stride as f64 });
                    }
                }
                while due < length {
                    let t = due / length;
                    samples.ink.push(Ink { point: segment.eval(t), direction: direction(t), length: step });
                    due += step;
                }
                due -= length;
                before = Some(direction(1.0));
            }
        }
        if samples.ink.is_empty() {
            let direction = Vec2::new(1.0, 0.0);
            let dot = |stroke: Stroke| Ink { point: stroke.start(), direction, length: 1.0 };
            samples.ink = drawing.strokes.iter().map(dot).collect();
        }
        let pairs = drawing.strokes.iter().zip(drawing.strokes.iter().skip(1));
        let stride = (pairs.len() as f64 / SAMPLES).ceil().max(1.0) as usize;
        let travel =
            |(one, next): (Stroke, Stroke)| Travel { ends: [one.end(), next.start()], count: stride as f64 };
        samples.travels = pairs.step_by(stride).map(travel).collect();
        samples
    }

    /// The figure of a placement; `None` if the machine does not reach one of the samples there.
    fn figure(&self, machine: &Machine, map: Affine, aim: BestFor) -> Option<f64> {
        let pose = |point: Point| {
            let at = map * point;
            machine.check_point(at).ok()?;
            planner::travel_pose(machine, at)
        };
        let turned = |v: Vec2| (map * v.to_point()) - (map * Point::ZERO);
        let (mut sum, mut coarsest) = (0.0, 0.0_f64);
        for ink in &self.ink {
            let pose = pose(ink.point)?;
            match aim {
                BestFor::Accuracy => coarsest = coarsest.max(machine.quantization_error(&pose)),
                BestFor::Time => sum += ink.length * pace(machine, &pose, turned(ink.direction)),
            }
        }
        if aim == BestFor::Accuracy {
            return Some(coarsest);
        }
        for corner in &self.corners {
            sum += corner.count * corner_time(machine, &pose(corner.point)?, turned(corner.change));
        }
        for travel in &self.travels {
            let [from, to] = travel.ends.map(|end| planner::travel_pose(machine, map * end));
            sum += travel.count * planner::travel_time(machine, &from?, &to?);
        }
        Some(sum)
    }
}

/// The least time at constant speed for a movement by `vector`, s.
fn pace(machine: &Machine, pose: &JointPos, vector: Vec2) -> f64 {
    let (rates, _) = machine.motor_derivatives(pose, vector, Vec2::ZERO);
    let by_pen = vector.hypot2().sqrt() / machine.pen().max_speed_mm_s;
    let motors = machine.motors().iter().enumerate();
    motors.fold(by_pen, |time, (k, motor)| time.max(rates[k].abs() / motor.max_speed_ticks_s))
}

/// About what a corner costs, s: half the time in which the motors change the pen's velocity by
/// `change` times its top speed.
fn corner_time(machine: &Machine, pose: &JointPos, change: Vec2) -> f64 {
    let (rates, _) = machine.motor_derivatives(pose, change, Vec2::ZERO);
    let motors = machine.motors().iter().enumerate();
    let time =
        motors.fold(0.0, |time, (k, motor)| f64::max(time, rates[k].abs() / motor.max_acceleration_ticks_s2));
    0.5 * machine.pen().max_speed_mm_s * time
}

/// A position and a turn: shares of the free area along both sides, and degrees.
type Spot = [f64; 3];

/// The placements with one turn: those of the drawing's origin from `low` to `low + free`, mm from the
/// corner of the sheet.
#[derive(Clone, Copy, Debug)]
struct Frame {
    options: PlacementOptions,
    factor: f64,
    /// The placement with the origin at the sheet's corner.
    map: Affine,
    low: Vec2,
    free: Vec2,
}

impl Frame {
    /// `None` if the turned drawing is larger than the sheet less its margin.
    fn new(
        machine: &Machine,
        drawing: &Drawing,
        given: &PlacementOptions,
        rotate_rad: f64,
    ) -> Result<Option<Self>, PlanError> {
        let factor = match given.scale {
            Scale::Explicit { factor, .. } | Scale::Aligned { factor, .. } => factor,
            Scale::Fit | Scale::Shrink => 1.0,
        };
        let with = |scale| PlacementOptions { scale, rotate_rad, ..*given };
        let options = with(Scale::Explicit { factor, origin_mm: Vec2::ZERO });
        let map = place(machine, drawing, &options)?;
        let corner = |share: f64| {
            let aligned = with(Scale::Aligned { factor, align: Vec2::new(share, share) });
            Ok::<Vec2, PlanError>(place(machine, drawing, &aligned)?.translation() - map.translation())
        };
        let (low, high) = (corner(0.0)?, corner(1.0)?);
        let free = high - low;
        Ok((free.x >= 0.0 && free.y >= 0.0).then_some(Self { options, factor, map, low, free }))
    }

    /// The drawing's origin at these shares of the free area.
    fn origin(&self, spot: Spot) -> Vec2 {
        let along = |low: f64, free: f64, share: f64| {
            let exact = low + share * free;
            let multiple = (exact * PER_UNIT).round();
            // Inside the free area, if a multiple of the resolution lies there.
            let inside = |multiple: &f64| (low..=low + free).contains(&(multiple / PER_UNIT));
            [multiple, multiple + 1.0, multiple - 1.0]
                .into_iter()
                .find(inside)
                .map_or(exact, |multiple| multiple / PER_UNIT)
        };
        Vec2::new(along(self.low.x, self.free.x, spot[0]), along(self.low.y, self.free.y, spot[1]))
    }

    fn map_at(&self, spot: Spot) -> Affine {
        self.map.then_translate(self.origin(spot))
    }

    fn options_at(&self, spot: Spot) -> PlacementOptions {
        let scale = Scale::Explicit { factor: self.factor, origin_mm: self.origin(spot) };
        PlacementOptions { scale, ..self.options }
    }
}

/// A search under way.
struct Searcher<'a> {
    drawing: &'a Drawing,
    machine: &'a Machine,
    given: &'a PlacementOptions,
    search: Search,
    samples: Samples,
    /// The latest frame with its turn: most placements that are compared share it.
    frame: Option<(f64, Option<Frame>)>,
    compared: usize,
}

impl Searcher<'_> {
    fn frame(&mut self, degrees: f64) -> Result<Option<Frame>, PlanError> {
        match &self.frame {
            Some((known, frame)) if *known == degrees => Ok(*frame),
            _ => {
                // A rotation that is given keeps its bits.
                let turn = if self.search.turns { degrees.to_radians() } else { self.given.rotate_rad };
                let frame = Frame::new(self.machine, self.drawing, self.given, turn)?;
                self.frame = Some((degrees, frame));
                Ok(frame)
            }
        }
    }

    /// The estimate for a placement; `None` if it is beyond the sheet or out of reach.
    fn estimate(&mut self, spot: Spot) -> Result<Option<f64>, PlanError> {
        let Some(frame) = self.frame(spot[2])? else { return Ok(None) };
        self.compared += 1;
        Ok(self.samples.figure(self.machine, frame.map_at(spot), self.search.aim))
    }

    /// The best cells of the grid, best first.
    fn grid(&mut self) -> Result<Vec<(f64, Spot)>, PlanError> {
        let step = 360.0 / f64::from(TURNS);
        let turns = if self.search.turns { TURNS } else { 1 };
        let mut found = Vec::new();
        for turn in 0..turns {
            let turn = self.given.rotate_rad.to_degrees() + f64::from(turn) * step;
            for cell in 0..(GRID + 1).pow(2) {
                let share = |index: u32| f64::from(index) / f64::from(GRID);
                let spot = [share(cell / (GRID + 1)), share(cell % (GRID + 1)), turn];
                found.extend(self.estimate(spot)?.map(|figure| (figure, spot)));
            }
        }
        found.sort_by(|a, b| a.0.total_cmp(&b.0));
        found.truncate(SEEDS);
        Ok(found)
    }

    /// Improves a placement: a step along each axis in both directions, halved where none helps.
    fn improve(&mut self, (mut least, mut spot): (f64, Spot)) -> Result<(f64, Spot), PlanError> {
        let share = 1.0 / f64::from(GRID);
        let mut step = [share, share, 360.0 / f64::from(TURNS)].map(|step| 0.5 * step);
        let axes = if self.search.turns { 3 } else { 2 };
        let mut halvings = 0;
        for _ in 0..STEPS {
            let mut improved = false;
            for (axis, sign) in (0..axes).flat_map(|axis| [(axis, -1.0), (axis, 1.0)]) {
                let mut near = spot;
                near[axis] += sign * step[axis];
                near[axis] = if axis < 2 {
                    near[axis].clamp(0.0, 1.0)
                } else {
                    (near[axis] * PER_UNIT).round() / PER_UNIT
                };
                let figure = self.estimate(near)?.filter(|figure| *figure < 0.9999 * least);
                if let Some(figure) = figure {
                    (least, spot, improved) = (figure, near, true);
                }
            }
            if !improved {
                halvings += 1;
                if halvings == HALVINGS {
                    break;
                }
                step = step.map(|step| 0.5 * step);
            }
        }
        Ok((least, spot))
    }
}

/// Finds the best placement of `drawing` at the scale, reflection, rotation and margin of `given`.
/// `duration` is the duration of the plan of a placed drawing, s, or `None` if there is none.
///
/// # Errors
/// [`PlanError::NoPlacement`] if no placement that was compared is on the sheet and within reach,
/// [`PlanError::Setting`] for a sheet without edges, and the errors of [`planner::place`].
pub fn best_place(
    drawing: &Drawing,
    machine: &Machine,
    given: &PlacementOptions,
    search: Search,
    duration: &dyn Fn(Drawing) -> Option<f64>,
) -> Result<BestPlace, PlanError> {
    let is_finite = |sheet: Rect| sheet.width().is_finite() && sheet.height().is_finite();
    if !is_finite(machine.sheet()) {
        return Err(PlanError::Setting { what: "a search for the best place needs a sheet with edges" });
    }
    let samples = Samples::of(drawing);
    let mut searcher = Searcher { drawing, machine, given, search, samples, frame: None, compared: 0 };
    let mut found = Vec::new();
    for cell in searcher.grid()? {
        found.push(searcher.improve(cell)?);
    }
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    // Different cells lead to the same minimum.
    found.dedup_by(|a, b| a.1 == b.1);
    let segments: usize = drawing.strokes.iter().map(|stroke| stroke.segment_count() + 1).sum();
    let planned = PLANNED_SEGMENTS / segments.max(1);
    // The samples may miss a part that is out of reach: the placement is checked as a whole.
    let exact = |frame: &Frame, spot: Spot, estimate: f64| {
        let mut placed = drawing.clone();
        placed.transform(frame.map_at(spot));
        planner::check_reach(machine, &placed).ok()?;
        let plans = search.aim == BestFor::Time && planned > 0;
        if plans { duration(placed) } else { Some(estimate) }
    };
    let middle = [0.5, 0.5, given.rotate_rad.to_degrees()];
    let centered = match (searcher.estimate(middle)?, searcher.frame(middle[2])?) {
        (Some(estimate), Some(frame)) => {
            exact(&frame, middle, estimate).map(|figure| (figure, frame.options_at(middle)))
        }
        _ => None,
    };
    let mut reached: Vec<(f64, PlacementOptions)> = centered.into_iter().collect();
    let wanted = match search.aim {
        BestFor::Accuracy => 1,
        BestFor::Time => planned.clamp(1, SEEDS),
    };
    for (estimate, spot) in found {
        let Some(frame) = searcher.frame(spot[2])? else { continue };
        let figure = exact(&frame, spot, estimate);
        reached.extend(figure.map(|figure| (figure, frame.options_at(spot))));
        if reached.len() >= wanted + usize::from(centered.is_some()) {
            break;
        }
    }
    let best = reached.into_iter().min_by(|a, b| a.0.total_cmp(&b.0));
    let why = "no position of it that was tried lies on the sheet and within reach";
    let (figure, options) = best.ok_or(PlanError::NoPlacement { why })?;
    let centered = centered.map(|(figure, _)| figure);
    Ok(BestPlace { options, aim: search.aim, figure, centered, compared: searcher.compared })
}
