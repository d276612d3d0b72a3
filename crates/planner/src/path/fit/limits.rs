//! The limits of a machine around a point, as the fit uses them.

use drawing::{Point, Vec2};
use kinematics::{Machine, MotorPos};

/// The machine and the pen's speed.
#[derive(Debug)]
pub struct Limits<'a> {
    machine: &'a Machine,
    /// Largest squared speed of the pen, mm²/s².
    pub(super) square_pen_speed: f64,
    /// The squared ratio of each motor's acceleration limit to its speed limit, 1/s².
    pub(super) square_ratios: [f64; 2],
    /// The time in which each motor builds up its acceleration, s; 0 without a jerk limit.
    pub(super) build_ups_s: [f64; 2],
    /// The derivatives everywhere on a machine with linear kinematics.
    everywhere: Option<MotorForms>,
}

/// How a motor's derivatives follow from those of the pen, near a point, relative to its
/// acceleration limit: `m' = j · p'`, `m'' = j · p'' + p'ᵀ q p'`. Over the width of the tolerance
/// both are even, so they are taken at the samples.
#[derive(Clone, Copy, Debug)]
pub(super) struct MotorForms {
    pub(super) linear: [Vec2; 2],
    /// xx, xy and yy of the symmetric matrix q.
    pub(super) quadratic: [[f64; 3]; 2],
}

impl<'a> Limits<'a> {
    /// For a machine, with the pen at most this fast.
    pub fn new(machine: &'a Machine, pen_mm_s: f64) -> Self {
        let square_ratios = machine.motors().each_ref().map(|motor| {
            let ratio = motor.max_acceleration_ticks_s2 / motor.max_speed_ticks_s;
            ratio * ratio
        });
        let build_ups_s = machine
            .motors()
            .each_ref()
            .map(|motor| motor.max_jerk_ticks_s3.map_or(0.0, |jerk| motor.max_acceleration_ticks_s2 / jerk));
        let square_pen_speed = pen_mm_s * pen_mm_s;
        let mut limits = Self { machine, square_pen_speed, square_ratios, build_ups_s, everywhere: None };
        if machine.mechanism().is_linear() {
            limits.everywhere = limits.evaluate(machine.sheet().center());
        }
        limits
    }

    /// The forms on a machine with linear kinematics, where they are the same everywhere.
    pub(super) fn everywhere(&self) -> Option<MotorForms> {
        self.everywhere
    }

    /// The forms near a point; `None` if it is out of reach.
    pub(super) fn near(&self, p: Point) -> Option<MotorForms> {
        self.everywhere.or_else(|| self.evaluate(p))
    }

    /// A disc within the reach and within this one, around a point of the reach: at an edge at distance d,
    /// moved from it by half of what is outside, so the radius r becomes `(r + d) / 2`, less a margin for
    /// the bulge of a spline between its knots. Twice, for corners of the reach; a disc that has the
    /// outside on opposite sides is kept.
    pub(super) fn disc_within_reach(&self, center: Point, radius: f64) -> (Point, f64) {
        const DIRECTIONS: u32 = 16;
        const MARGIN: f64 = 0.05;
        let is_reached = |p: Point| self.machine.check_point(p).is_ok();
        let (mut disc, mut is_cut) = ((center, radius), false);
        for _ in 0..2 {
            let (center, radius) = disc;
            let outside = (0..DIRECTIONS)
                .map(|k| {
                    Vec2::from(libm::sincos(std::f64::consts::TAU * f64::from(k) / f64::from(DIRECTIONS)))
                })
                .filter(|direction| !is_reached(center + radius * *direction))
                .fold(Vec2::ZERO, |sum, direction| sum + direction);
            let length = outside.hypot2().sqrt();
            if length < 0.1 {
                break;
            }
            let normal = outside / length;
            let (mut inside, mut beyond) = (0.0, radius);
            for _ in 0..20 {
                let middle = 0.5 * (inside + beyond);
                *(if is_reached(center + middle * normal) { &mut inside } else { &mut beyond }) = middle;
            }
            let shift = 0.5 * (radius - inside);
            (disc, is_cut) = ((center - shift * normal, radius - shift), true);
        }
        if is_cut { (disc.0, (1.0 - MARGIN) * disc.1) } else { disc }
    }

    fn evaluate(&self, p: Point) -> Option<MotorForms> {
        let pose = self.machine.mechanism().inverse(p).ok()?;
        let of = |x: f64, y: f64| self.machine.motor_derivatives(&pose, Vec2::new(x, y), Vec2::ZERO);
        let ((x, xx), (y, yy), (_, both)) = (of(1.0, 0.0), of(0.0, 1.0), of(1.0, 1.0));
        let relative = |m: &MotorPos, k: usize| m[k] / self.machine.motors()[k].max_acceleration_ticks_s2;
        Some(MotorForms {
            linear: [0, 1].map(|k| Vec2::new(relative(&x, k), relative(&y, k))),
            quadratic: [0, 1].map(|k| {
                let (xx, yy, both) = (relative(&xx, k), relative(&yy, k), relative(&both, k));
                [xx, 0.5 * (both - xx - yy), yy]
            }),
        })
    }
}

impl MotorForms {
    /// m' and m'' of motor k, and the derivative of m'' by p'.
    #[inline]
    pub(super) fn motor(&self, k: usize, first: Vec2, second: Vec2) -> (f64, f64, Vec2) {
        let (j, half) = (self.linear[k], self.half(k, first));
        (j.dot(first), j.dot(second) + half.dot(first), 2.0 * half)
    }

    /// The product of a motor's second derivatives by the position and a vector.
    #[inline]
    pub(super) fn half(&self, k: usize, vector: Vec2) -> Vec2 {
        let [xx, xy, yy] = self.quadratic[k];
        Vec2::new(xx * vector.x + xy * vector.y, xy * vector.x + yy * vector.y)
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use proptest::prelude::*;
    use test_support::machines;

    use super::*;

    #[test]
    fn forms_give_the_derivatives_of_the_motors() {
        for machine in [machines::corexy(), machines::arm(), machines::polar()] {
            let limits = Limits::new(&machine, 60.0);
            let p = machine.sheet().center() + Vec2::new(3.0, 1.0);
            let pose = machine.mechanism().inverse(p).expect("within reach");
            let (first, second) = (Vec2::new(0.7, -0.4), Vec2::new(0.2, 1.3));
            let (m1, m2) = machine.motor_derivatives(&pose, first, second);
            let forms = limits.near(p).expect("within reach");
            for k in 0..2 {
                let limit = machine.motors()[k].max_acceleration_ticks_s2;
                let (one, two, by_first) = forms.motor(k, first, second);
                assert!((one * limit - m1[k]).abs() < 1e-9 * m1[k].abs());
                assert!((two * limit - m2[k]).abs() < 1e-9 * m2[k].abs());
                let ahead = forms.motor(k, first + Vec2::new(1e-6, 0.0), second).1;
                assert!((by_first.x - (ahead - two) / 1e-6).abs() < 1e-5 * (1.0 + by_first.x.abs()));
            }
        }
    }
    proptest! {
        /// Discs around points of the reach lie within the reach and within the disc before.
        #[test]
        fn discs_at_the_edge_of_the_reach_are_within_it(
            index in 0..3_usize, along in 0.0..TAU, share in 0.0..1.0f64, radius in 0.01..1.0f64,
        ) {
            let machine = [machines::corexy(), machines::arm(), machines::polar()][index].clone();
            let limits = Limits::new(&machine, 60.0);
            let is_reached = |p: Point| machine.check_point(p).is_ok();
            // Up to the radius inside the edge in some direction from the middle of the sheet.
            let direction = Vec2::from(libm::sincos(along));
            let (mut inside, mut outside) = (0.0, 2000.0);
            for _ in 0..60 {
                let middle = 0.5 * (inside + outside);
                *(if is_reached(machine.sheet().center() + middle * direction) { &mut inside } else { &mut outside }) = middle;
            }
            let point = machine.sheet().center() + (inside - share * radius).max(0.0) * direction;
            prop_assume!(is_reached(point));
            let (center, smaller) = limits.disc_within_reach(point, radius);
            prop_assert!((center - point).hypot2().sqrt() + smaller <= radius + 1e-12);
            prop_assert!(smaller > 0.2 * radius);
            for k in 0..100 {
                let edge = center + smaller * Vec2::from(libm::sincos(TAU * f64::from(k) / 100.0));
                prop_assert!(is_reached(edge), "{edge:?} of {center:?}, {smaller}");
            }
        }
    }
}
