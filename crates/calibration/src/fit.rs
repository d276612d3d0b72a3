//! The fit: starts, unknowns freed one group after the other, and its statistics.

use drawing::Point;
use nalgebra::{DMatrix, DVector};

use crate::minimize::Problem;
use crate::setup::{InvalidSetup, Parameter, Setup, Unknown};

/// The largest condition of the scaled problem for which its unknowns count as determined.
pub const LARGEST_CONDITION: f64 = 1e3;

/// Starts that are followed to the end, besides the machine file's own.
const STARTS: usize = 8;
/// Points over the sheet, each way, at which the page error is predicted.
const PAGE_POINTS: u32 = 9;
/// Residuals beyond this many standard deviations of the pointing do not come from pointing.
const TOO_LARGE: f64 = 5.0;

/// A motor's backlash is free if it came to at least this many touches from either side.
const FROM_EITHER_SIDE: usize = 3;

/// A place on the sheet, and the ticks while the pen is there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Touch {
    /// mm from the lower-left corner of the sheet.
    pub place: Point,
    /// Positions of the motors, ticks.
    pub ticks: [f64; 2],
    /// From where each motor came: 1 from lower ticks, -1 from higher ones, 0 if that is not known.
    pub approach: [f64; 2],
    /// Whether the elbow was on the left, if that was written down.
    pub elbow_left: Option<bool>,
}

/// The distance between two places where the pen was.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Distance {
    /// Positions of the motors at both, ticks.
    pub ticks: [[f64; 2]; 2],
    /// The distance, mm.
    pub mm: f64,
}

/// What was measured.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Measurements {
    /// Touched places.
    pub touches: Vec<Touch>,
    /// Distances.
    pub distances: Vec<Distance>,
}

impl Measurements {
    /// Two for each touch, one for each distance.
    pub fn equations(&self) -> usize {
        2 * self.touches.len() + self.distances.len()
    }

    fn without(&self, touch: usize) -> Self {
        let mut rest = self.clone();
        rest.touches.remove(touch);
        rest
    }
}

/// Options of a fit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// Standard deviation of a touch along x and along y, mm, without the rounding to ticks.
    pub pointing_mm: f64,
    /// Groups of [`Setup::unknowns`] to free, at most.
    pub groups: usize,
}

impl Default for Options {
    /// 0.25 mm, all groups.
    fn default() -> Self {
        Self { pointing_mm: 0.25, groups: usize::MAX }
    }
}

/// A found value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Value {
    /// What.
    pub unknown: Unknown,
    /// Change from the machine file: mm, rad, or a share.
    pub change: f64,
    /// Its standard deviation, in the same unit.
    pub deviation: f64,
}

/// The fit without one touch.
#[derive(Clone, Debug, PartialEq)]
pub struct LeftOut {
    /// Index of the touch.
    pub touch: usize,
    /// How far the pen would be from that place, mm.
    pub off_mm: f64,
    /// RMS residual of the others, mm.
    pub rms_mm: f64,
    /// The machine that comes out.
    pub setup: Setup,
}

/// Distances between where the pen is sent and where it draws, mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PageError {
    /// Root mean square over the sheet.
    pub rms_mm: f64,
    /// The largest on the sheet.
    pub worst_mm: f64,
}

/// A measurement that would determine an unknown best.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Helpful {
    /// Place on the sheet, mm from its lower-left corner.
    pub place: Point,
    /// Whether with the elbow on the side that the machine file does not have.
    pub other_elbow: bool,
}

/// The result of a fit.
#[derive(Clone, Debug, PartialEq)]
pub struct Fit {
    /// The machine with all found values.
    pub setup: Setup,
    /// The values.
    pub values: Vec<Value>,
    /// Unknowns that the measurements do not determine, and what would.
    pub kept: Vec<(Vec<Unknown>, Option<Helpful>)>,
    /// From each touched place to the pen, mm.
    pub residuals: Vec<drawing::Vec2>,
    /// Root mean square of their lengths (and of the residuals of distances), mm.
    pub rms_mm: f64,
    /// Equations less unknowns.
    pub freedom: usize,
    /// Standard deviation of one equation, mm: that of pointing and rounding, or of the residuals if larger.
    pub sigma_mm: f64,
    /// Whether the residuals are too large for pointing and rounding.
    pub is_bad: bool,
    /// Ratio of the largest singular value of the scaled problem to the smallest.
    pub condition: f64,
    /// What the calibrated machine will miss by.
    pub page: PageError,
    /// The touch without which the others fit best.
    pub worst: Option<LeftOut>,
}

/// Why nothing can be calibrated.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CalibrationError {
    /// The measurements do not even determine the pose.
    #[error("{equations} equations do not determine {unknowns} unknowns")]
    Undetermined {
        /// Of the measurements.
        equations: usize,
        /// Number of unknowns of the pose.
        unknowns: usize,
        /// What would help.
        helpful: Option<Helpful>,
    },
    /// No start leads to a machine.
    #[error("no machine of this kind fits the measurements")]
    NoFit,
    /// See [`InvalidSetup`].
    #[error(transparent)]
    Setup(#[from] InvalidSetup),
}

/// A machine fitted with some unknowns free.
pub(crate) struct Solution {
    pub(crate) unknowns: Vec<Unknown>,
    pub(crate) parameters: DVector<f64>,
    pub(crate) sum: f64,
    kept: Vec<Vec<Unknown>>,
}

impl Solution {
    pub(crate) fn setup(&self, nominal: &Setup, data: &Measurements) -> Setup {
        Problem::new(nominal, &self.unknowns, data).setup(&self.parameters)
    }
}

/// The groups of unknowns that these measurements can say something about.
fn groups(nominal: &Setup, data: &Measurements) -> Vec<Vec<Unknown>> {
    let mut groups = nominal.unknowns();
    if data.touches.is_empty() {
        // Distances do not change when the machine moves as a whole.
        let rigid = [Unknown::SheetX, Unknown::SheetY, Unknown::Offset(0)];
        let is_linear = nominal.mechanism().is_ok_and(|mechanism| mechanism.is_linear());
        groups[0].retain(|unknown| !rigid.contains(unknown) && !is_linear);
    }
    for motor in 0..2 {
        let from = |side: f64| data.touches.iter().filter(|touch| touch.approach[motor] * side > 0.0).count();
        if from(1.0).min(from(-1.0)) >= FROM_EITHER_SIDE {
            groups[0].push(Unknown::Backlash(motor));
        }
    }
    groups
}

/// Solves for the pose from several starts, then frees one group after the other.
pub(crate) fn solve(
    nominal: &Setup,
    data: &Measurements,
    most_groups: usize,
) -> Result<Solution, CalibrationError> {
    let mut groups = groups(nominal, data).into_iter().take(most_groups.max(1));
    let pose = groups.next().unwrap_or_default();
    let problem = Problem::new(nominal, &pose, data);
    if data.equations() <= pose.len() {
        return Err(CalibrationError::Undetermined {
            equations: data.equations(),
            unknowns: pose.len(),
            helpful: helpful(nominal, nominal, &pose, data),
        });
    }
    let starts = starts(&problem);
    let best = starts
        .into_iter()
        .filter_map(|start| problem.minimize(start))
        .min_by(|a, b| a.1.total_cmp(&b.1))
        .ok_or(CalibrationError::NoFit)?;
    if condition(&problem, &best.0).is_none() {
        return Err(CalibrationError::Undetermined {
            equations: data.equations(),
            unknowns: pose.len(),
            helpful: helpful(nominal, &problem.setup(&best.0), &pose, data),
        });
    }
    let mut solution = Solution { unknowns: pose, parameters: best.0, sum: best.1, kept: Vec::new() };
    for group in groups {
        let unknowns = [solution.unknowns.clone(), group.clone()].concat();
        let problem = Problem::new(nominal, &unknowns, data);
        let start = solution.parameters.clone().resize_vertically(unknowns.len(), 0.0);
        let found = (data.equations() > unknowns.len()).then(|| problem.minimize(start)).flatten();
        match found.filter(|(parameters, _)| condition(&problem, parameters).is_some()) {
            Some((parameters, sum)) if solution.kept.is_empty() => {
                solution = Solution { unknowns, parameters, sum, kept: Vec::new() };
            }
            _ => solution.kept.push(group),
        }
    }
    Ok(solution)
}

/// The condition of the scaled problem; `None` beyond the largest one.
fn condition(problem: &Problem<'_>, at: &DVector<f64>) -> Option<f64> {
    let singular = problem.jacobian(at)?.singular_values();
    let (most, least) = (singular.max(), singular.min());
    let condition = most / least;
    (problem.unknowns.is_empty() || condition <= LARGEST_CONDITION).then_some(condition)
}

/// Where the search begins: the machine file's own values, and those offsets of the motors, on a grid,
/// with which a translation of the sheet fits best.
fn starts(problem: &Problem<'_>) -> Vec<DVector<f64>> {
    let zero = DVector::zeros(problem.unknowns.len());
    let index = |unknown| problem.unknowns.iter().position(|free| *free == unknown);
    let mut starts = vec![zero.clone()];
    if let Some(turn) = index(Unknown::Turn) {
        let quarter = std::f64::consts::FRAC_PI_2 / problem.scales[turn];
        starts.extend((1..4).map(|k| {
            let mut start = zero.clone();
            start[turn] = f64::from(k) * quarter;
            start
        }));
        return starts;
    }
    let grid = |motor: usize| -> Vec<f64> {
        match index(Unknown::Offset(motor)) {
            None => vec![0.0],
            // mm
            Some(k) if problem.scales[k] == 1.0 => (-4..=4).map(|step| 50.0 * f64::from(step)).collect(),
            Some(k) => {
                let step = std::f64::consts::TAU / 24.0 / problem.scales[k];
                (-12..12).map(|turn| f64::from(turn) * step).collect()
            }
        }
    };
    let mut scored: Vec<(f64, DVector<f64>)> = Vec::new();
    for (first, second) in grid(0).iter().flat_map(|a| grid(1).into_iter().map(move |b| (*a, b))) {
        let mut start = zero.clone();
        for (motor, offset) in [first, second].into_iter().enumerate() {
            if let Some(k) = index(Unknown::Offset(motor)) {
                start[k] = offset;
            }
        }
        let Some(residuals) = problem.residuals(&start) else { continue };
        let touches = problem.data.touches.len();
        let mean = |axis: usize| (0..touches).map(|k| residuals[2 * k + axis]).sum::<f64>() / touches as f64;
        for (axis, unknown) in [Unknown::SheetX, Unknown::SheetY].into_iter().enumerate() {
            if let (Some(k), true) = (index(unknown), touches > 0) {
                start[k] = mean(axis);
            }
        }
        let Some(residuals) = problem.residuals(&start) else { continue };
        scored.push((residuals.norm_squared(), start));
    }
    scored.sort_by(|a, b| a.0.total_cmp(&b.0));
    starts.extend(scored.into_iter().take(STARTS).map(|(_, start)| start));
    starts
}

/// Fits a machine to measurements.
///
/// # Errors
/// When the measurements do not determine the pose, or the setup is no machine.
pub fn fit(nominal: &Setup, data: &Measurements, options: &Options) -> Result<Fit, CalibrationError> {
    nominal.mechanism()?;
    let solution = solve(nominal, data, options.groups)?;
    let problem = Problem::new(nominal, &solution.unknowns, data);
    let setup = problem.setup(&solution.parameters);
    let residuals = problem.residuals(&solution.parameters).ok_or(CalibrationError::NoFit)?;
    let freedom = data.equations() - solution.unknowns.len();
    let expected = expected_mm(&setup, data, options);
    let found = (solution.sum / freedom as f64).sqrt();
    let sigma_mm = expected.max(found);
    let jacobian = problem.jacobian(&solution.parameters).ok_or(CalibrationError::NoFit)?;
    let covariance = (jacobian.transpose() * &jacobian).try_inverse().ok_or(CalibrationError::NoFit)?
        * (sigma_mm * sigma_mm);
    let values = (0..solution.unknowns.len()).map(|k| Value {
        unknown: solution.unknowns[k],
        change: problem.scales[k] * solution.parameters[k],
        deviation: problem.scales[k] * covariance[(k, k)].max(0.0).sqrt(),
    });
    let kept = solution.kept.iter().map(|group| {
        let unknowns = [solution.unknowns.clone(), group.clone()].concat();
        (group.clone(), helpful(nominal, &setup, &unknowns, data))
    });
    let touches = data.touches.len();
    let distances = residuals.rows(2 * touches, data.distances.len()).norm_squared();
    let touched = residuals.rows(0, 2 * touches).norm_squared();
    Ok(Fit {
        values: values.collect(),
        kept: kept.collect(),
        residuals: (0..touches).map(|k| drawing::Vec2::new(residuals[2 * k], residuals[2 * k + 1])).collect(),
        rms_mm: ((touched + distances) / (touches + data.distances.len()) as f64).sqrt(),
        freedom,
        sigma_mm,
        is_bad: found > TOO_LARGE * expected,
        condition: condition(&problem, &solution.parameters).unwrap_or(f64::INFINITY),
        page: page_error(&problem, &solution.parameters, &setup, &covariance),
        worst: worst(nominal, data, options, solution.unknowns.len()),
        setup,
    })
}

/// Standard deviation of one equation from pointing and from rounding to ticks, mm.
fn expected_mm(setup: &Setup, data: &Measurements, options: &Options) -> f64 {
    let Ok(model) = setup.model() else { return options.pointing_mm };
    let touched = data.touches.iter().map(|touch| (touch.ticks, touch.approach));
    let drawn = data.distances.iter().flat_map(|distance| distance.ticks).map(|ticks| (ticks, [0.0; 2]));
    let all: Vec<f64> =
        touched.chain(drawn).map(|(ticks, approach)| model.rounding_mm(ticks, approach)).collect();
    let square = all.iter().map(|mm| mm * mm).sum::<f64>() / all.len().max(1) as f64;
    (options.pointing_mm * options.pointing_mm + 0.5 * square).sqrt()
}

/// The error of the pen at fixed ticks that the uncertainty of the unknowns leaves, over the sheet.
fn page_error(
    problem: &Problem<'_>,
    at: &DVector<f64>,
    setup: &Setup,
    covariance: &DMatrix<f64>,
) -> PageError {
    let near = problem.data.touches.first().map_or(setup.offset_ticks, |touch| touch.ticks);
    let (mut sum, mut worst, mut count) = (0.0, 0.0_f64, 0);
    for place in places(setup.sheet_mm, PAGE_POINTS) {
        let ticks = setup.ticks(place, near);
        let Some(jacobian) = ticks.and_then(|ticks| problem.pen_jacobian(at, ticks)) else { continue };
        let square = (&jacobian * covariance * jacobian.transpose()).trace();
        if square.is_finite() {
            (sum, worst, count) = (sum + square, worst.max(square), count + 1);
        }
    }
    PageError { rms_mm: (sum / f64::from(count.max(1))).sqrt(), worst_mm: worst.sqrt() }
}

/// Points over a sheet, its edges included.
fn places(sheet_mm: [f64; 2], each_way: u32) -> impl Iterator<Item = Point> {
    let share = move |k: u32| f64::from(k) / f64::from(each_way - 1);
    (0..each_way * each_way)
        .map(move |k| Point::new(sheet_mm[0] * share(k % each_way), sheet_mm[1] * share(k / each_way)))
}

/// The touch without which the others fit best, if enough are left. All are fitted with as many unknowns
/// as their measurements determine, no more than `most`.
fn worst(nominal: &Setup, data: &Measurements, options: &Options, most: usize) -> Option<LeftOut> {
    let left_out = |touch: usize| {
        let rest = data.without(touch);
        let mut groups = options.groups.min(nominal.unknowns().len());
        let solution = loop {
            let solution = solve(nominal, &rest, groups).ok()?;
            if solution.unknowns.len() <= most || groups == 1 {
                break solution;
            }
            groups -= 1;
        };
        let setup = solution.setup(nominal, &rest);
        let off = setup.pen(data.touches[touch].ticks).ok()? - data.touches[touch].place;
        let rms_mm = (solution.sum / (rest.touches.len() + rest.distances.len()) as f64).sqrt();
        let spare = (rest.equations() - solution.unknowns.len()) as f64;
        Some((solution.sum / spare, LeftOut { touch, off_mm: off.hypot2().sqrt(), rms_mm, setup }))
    };
    let all = (0..data.touches.len()).filter_map(left_out);
    all.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, left_out)| left_out)
}

/// The touch, of corners, edges and centre of the sheet, on either side of the elbow, after which the
/// smallest singular value is largest.
fn helpful(nominal: &Setup, setup: &Setup, unknowns: &[Unknown], data: &Measurements) -> Option<Helpful> {
    let problem = Problem::new(nominal, unknowns, data);
    let zero = DVector::zeros(unknowns.len());
    let present = problem.jacobian(&zero)?;
    let near = data.touches.first().map_or(setup.offset_ticks, |touch| touch.ticks);
    let mut best: Option<(f64, Helpful)> = None;
    for other_elbow in [false, true] {
        let mut posed = setup.clone();
        if other_elbow {
            let Some(Parameter::Choice(elbow)) = posed.geometry.get_mut("elbow") else { continue };
            *elbow = if elbow == "left" { "right".into() } else { "left".into() };
        }
        for place in places(setup.sheet_mm, 3) {
            let rows = posed.ticks(place, near).and_then(|ticks| problem.pen_jacobian(&zero, ticks));
            let Some(rows) = rows else { continue };
            let mut all = present.clone().resize_vertically(present.nrows() + 2, 0.0);
            all.rows_mut(present.nrows(), 2).copy_from(&rows);
            // Fewer rows than unknowns have singular values of their own: count those that are missing as 0.
            let normal = (all.transpose() * &all).symmetric_eigenvalues();
            let least = normal.min();
            if best.is_none_or(|(most, _)| least > most * (1.0 + 1e-9) + 1e-12) {
                best = Some((least, Helpful { place, other_elbow }));
            }
        }
    }
    best.map(|(_, helpful)| helpful)
}
