//! Random mechanisms of every registered kind.

use std::sync::Arc;

use drawing::Point;
use kinematics::mechanism::{KINDS, ParameterError, Parameters};
use kinematics::{JointPos, Mechanism};
use proptest::prelude::*;

/// Answers a mechanism's questions for its parameters with random values: the first length is from
/// 60 to 300 mm, and every further length is 0.3 to 3 times the first.
struct RandomParameters {
    first_mm: f64,
    ratios: std::vec::IntoIter<f64>,
    choices: std::vec::IntoIter<usize>,
    lengths: usize,
}

impl Parameters for RandomParameters {
    fn length_mm(&mut self, _key: &'static str) -> Result<f64, ParameterError> {
        self.lengths += 1;
        if self.lengths == 1 {
            return Ok(self.first_mm);
        }
        Ok(self.first_mm * self.ratios.next().expect("more lengths than the generator has ratios"))
    }

    fn choice(
        &mut self,
        _key: &'static str,
        choices: &'static [&'static str],
    ) -> Result<usize, ParameterError> {
        Ok(self.choices.next().expect("more choices than the generator has") % choices.len())
    }
}

/// A random mechanism: every kind in [`KINDS`] equally often.
pub fn mechanism() -> impl Strategy<Value = Arc<dyn Mechanism>> {
    // Logarithmic, so that a ratio and its inverse are equally likely.
    let ratio = (-1.0..1.0f64).prop_map(|exponent| libm::pow(10.0 / 3.0, exponent));
    let ratios = proptest::collection::vec(ratio, 8);
    let choices = proptest::collection::vec(any::<usize>(), 8);
    (0..KINDS.len(), 60.0..300.0f64, ratios, choices).prop_map(|(kind, first_mm, ratios, choices)| {
        let (ratios, choices) = (ratios.into_iter(), choices.into_iter());
        KINDS[kind]
            .mechanism(&mut RandomParameters { first_mm, ratios, choices, lengths: 0 })
            .expect("the generator answers every question")
    })
}

/// The pose for a point, on the turn about the base that is nearest to `near`; `None` out of reach.
pub fn unwrapped(mechanism: &dyn Mechanism, p: Point, near: &JointPos) -> Option<JointPos> {
    let q = mechanism.inverse(p).ok()?;
    Some(match mechanism.full_rotation() {
        Some(rotation) => q + rotation * ((near[0] - q[0]) / rotation[0]).round(),
        None => q,
    })
}
