//! Random mechanisms of every registered kind.

use std::sync::Arc;

use drawing::Point;
use kinematics::mechanism::{KINDS, ParameterError, Parameters};
use kinematics::{JointPos, Mechanism};
use proptest::prelude::*;

use crate::machines::point_within;

/// Answers a mechanism's questions for its parameters with random values: the first length is from
/// 60 to 300 mm, and every further length is 0.3 to 3 times the first. Optional lengths are 0 to 0.1
/// times the first, half of them not given. Points are on opposite sides of the origin, up to 1.5 times
/// the first length from it, a quarter of them in the origin.
struct RandomParameters {
    first_mm: f64,
    ratios: std::vec::IntoIter<f64>,
    choices: std::vec::IntoIter<usize>,
    lengths: usize,
    apart: (f64, f64),
    points: usize,
    optional: Option<f64>,
}

impl Parameters for RandomParameters {
    fn length_mm(&mut self, _key: &'static str) -> Result<f64, ParameterError> {
        self.lengths += 1;
        if self.lengths == 1 {
            return Ok(self.first_mm);
        }
        Ok(self.first_mm * self.ratios.next().expect("more lengths than the generator has ratios"))
    }

    fn optional_length_mm(&mut self, _key: &'static str) -> Result<Option<f64>, ParameterError> {
        Ok(self.optional.map(|share| share * self.first_mm))
    }

    fn point_mm(&mut self, _key: &'static str) -> Result<Point, ParameterError> {
        self.points += 1;
        let side = if self.points == 1 { -self.first_mm } else { self.first_mm };
        Ok(Point::new(side * self.apart.0, side * self.apart.1))
    }

    fn choice(
        &mut self,
        _key: &'static str,
        choices: &'static [&'static str],
    ) -> Result<usize, ParameterError> {
        Ok(self.choices.next().expect("more choices than the generator has") % choices.len())
    }
}

/// A random mechanism with a reach: every kind in [`KINDS`] about equally often.
pub fn mechanism() -> impl Strategy<Value = Arc<dyn Mechanism>> {
    // Logarithmic, so that a ratio and its inverse are equally likely.
    let ratio = (-1.0..1.0f64).prop_map(|exponent| libm::pow(10.0 / 3.0, exponent));
    let ratios = proptest::collection::vec(ratio, 8);
    let choices = proptest::collection::vec(any::<usize>(), 8);
    let apart = prop_oneof![1 => Just((0.0, 0.0)), 3 => (0.05..1.5f64, -0.3..0.3f64)];
    let optional = proptest::option::of(-0.1..0.1f64);
    let kind = 0..KINDS.len();
    (kind, 60.0..300.0f64, ratios, choices, apart, optional).prop_filter_map(
        "no reach",
        |(kind, first_mm, ratios, choices, apart, optional)| {
            let (ratios, choices) = (ratios.into_iter(), choices.into_iter());
            let mut parameters =
                RandomParameters { first_mm, ratios, choices, lengths: 0, apart, points: 0, optional };
            let mechanism =
                KINDS[kind].mechanism(&mut parameters).expect("the generator answers every question");
            mechanism.validate().ok()?;
            let directions = (0..24).map(|k| f64::from(k) / 24.0 * std::f64::consts::TAU);
            let reached = directions.filter(|to| point_within(&*mechanism, *to, 0.5, 0.3).is_some()).count();
            (reached >= 2).then_some(mechanism)
        },
    )
}

/// The pose for a point, on the turn about the base that is nearest to `near`; `None` out of reach.
pub fn unwrapped(mechanism: &dyn Mechanism, p: Point, near: &JointPos) -> Option<JointPos> {
    let q = mechanism.inverse(p).ok()?;
    Some(match mechanism.full_rotation() {
        Some(rotation) => q + rotation * ((near[0] - q[0]) / rotation[0]).round(),
        None => q,
    })
}
