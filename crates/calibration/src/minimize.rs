//! Least squares by Levenberg and Marquardt's method, and the derivatives that it needs.

use drawing::Point;
use nalgebra::{DMatrix, DVector};

use crate::fit::Measurements;
use crate::setup::{Model, Setup, Unknown};

/// Steps of the method, at most.
const MOST_STEPS: usize = 200;
/// Steps of central differences, in units of about 1 mm at the pen.
const DIFFERENCE: f64 = 1e-4;

/// A setup with some unknowns free, against measurements. Parameters are scaled so that a unit moves the
/// pen by about 1 mm.
#[derive(Clone)]
pub(crate) struct Problem<'a> {
    pub(crate) nominal: &'a Setup,
    pub(crate) unknowns: &'a [Unknown],
    pub(crate) data: &'a Measurements,
    pub(crate) scales: Vec<f64>,
}

impl<'a> Problem<'a> {
    pub(crate) fn new(nominal: &'a Setup, unknowns: &'a [Unknown], data: &'a Measurements) -> Self {
        // Half the diagonal of the sheet is the distance of a typical place from the axis of a rotation.
        let size_mm = 0.5 * libm::hypot(nominal.sheet_mm[0], nominal.sheet_mm[1]);
        let scales = unknowns.iter().map(|unknown| nominal.scale(*unknown, size_mm)).collect();
        Self { nominal, unknowns, data, scales }
    }

    pub(crate) fn setup(&self, parameters: &DVector<f64>) -> Setup {
        let mut setup = self.nominal.clone();
        for ((unknown, scale), by) in self.unknowns.iter().zip(&self.scales).zip(parameters.iter()) {
            setup.change(*unknown, scale * by);
        }
        setup
    }

    fn model(&self, parameters: &DVector<f64>) -> Option<Model> {
        self.setup(parameters).model().ok()
    }

    /// mm; `None` where the parameters do not make a machine.
    pub(crate) fn residuals(&self, parameters: &DVector<f64>) -> Option<DVector<f64>> {
        let model = self.model(parameters)?;
        let mut residuals = Vec::with_capacity(self.data.equations());
        for touch in &self.data.touches {
            let off = model.touched(touch) - touch.place;
            residuals.extend([off.x, off.y]);
        }
        for distance in &self.data.distances {
            let [a, b] = distance.ticks.map(|ticks| model.pen(ticks));
            residuals.push((a - b).hypot2().sqrt() - distance.mm);
        }
        residuals.iter().all(|residual| residual.is_finite()).then(|| DVector::from_vec(residuals))
    }

    /// Derivatives of the residuals, by central differences.
    pub(crate) fn jacobian(&self, at: &DVector<f64>) -> Option<DMatrix<f64>> {
        let mut jacobian = DMatrix::zeros(self.data.equations(), self.unknowns.len());
        for k in 0..self.unknowns.len() {
            let [ahead, behind] = self.around(at, k).map(|parameters| self.residuals(&parameters));
            jacobian.set_column(k, &((ahead? - behind?) / (2.0 * DIFFERENCE)));
        }
        Some(jacobian)
    }

    /// Derivatives of the pen's place at fixed ticks: two rows.
    pub(crate) fn pen_jacobian(&self, at: &DVector<f64>, ticks: [f64; 2]) -> Option<DMatrix<f64>> {
        let mut jacobian = DMatrix::zeros(2, self.unknowns.len());
        for k in 0..self.unknowns.len() {
            let pen = |parameters: &DVector<f64>| Some(self.model(parameters)?.pen(ticks));
            let [ahead, behind]: [Option<Point>; 2] = self.around(at, k).map(|parameters| pen(&parameters));
            let rate = (ahead? - behind?) / (2.0 * DIFFERENCE);
            jacobian[(0, k)] = rate.x;
            jacobian[(1, k)] = rate.y;
        }
        Some(jacobian)
    }

    fn around(&self, at: &DVector<f64>, k: usize) -> [DVector<f64>; 2] {
        [DIFFERENCE, -DIFFERENCE].map(|by| {
            let mut moved = at.clone();
            moved[k] += by;
            moved
        })
    }

    /// The parameters with the least sum of squares that is reached from `start`, and that sum, mm².
    pub(crate) fn minimize(&self, start: DVector<f64>) -> Option<(DVector<f64>, f64)> {
        let mut at = start;
        let mut residuals = self.residuals(&at)?;
        let mut damping = 1e-3;
        for _ in 0..MOST_STEPS {
            let jacobian = self.jacobian(&at)?;
            let normal = jacobian.transpose() * &jacobian;
            let gradient = jacobian.transpose() * &residuals;
            let mut improved = false;
            while damping < 1e12 {
                let mut damped = normal.clone();
                for k in 0..damped.nrows() {
                    damped[(k, k)] += damping * normal[(k, k)].max(1e-12);
                }
                let step = damped.cholesky().map(|factors| -factors.solve(&gradient));
                let tried = step.map(|step| (&at + &step, step.norm()));
                let tried = tried.and_then(|(to, length)| Some((self.residuals(&to)?, to, length)));
                match tried {
                    Some((found, to, length)) if found.norm_squared() < residuals.norm_squared() => {
                        let gain = 1.0 - found.norm_squared() / residuals.norm_squared();
                        (at, residuals) = (to, found);
                        damping = (damping / 10.0).max(1e-12);
                        improved = gain > 1e-12 && length > 1e-10;
                        break;
                    }
                    _ => damping *= 10.0,
                }
            }
            if !improved {
                break;
            }
        }
        let sum = residuals.norm_squared();
        Some((at, sum))
    }
}
