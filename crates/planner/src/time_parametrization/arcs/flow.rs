//! The fastest motion from a state over a cell, as arcs on which one bound holds.
//!
//! With `x = m'/a >= 0` and `y = m''/a` of each motor, relative to its limit, a motor's acceleration
//! is `α = x u + y b`, within [-1, 1]. While motor k is at its limit
//!
//! ```text
//! w(s) = x_k² b = w(s0) + 2 (M_k(s) - M_k(s0)),   M' = x
//! ```
//! for any geometry: a motor at its limit moves with constant acceleration. So b is known in closed
//! form, and only the places where another bound takes over are searched. On cells with constant y
//! the other motor's α is monotonic on an arc, and the place where it reaches ±1 is known too. With
//! `W = x_j y_k - y_j x_k`, which is constant there, `u = u0 (x0/x)³` and `α_j = (y_j + W u) / y_k`.

use super::cell::{Bound, Oriented};

/// Relative accuracy of events.
const ACCURACY: f64 = 1e-9;

/// By how much an event must exceed its limit: where both motors are alike, the two would alternate.
const HYSTERESIS: f64 = 5e-10;

/// Places at which an arc is looked at, as shares of it: dense at both ends, because near
/// zero-inertia points there the ceiling is touched only briefly.
const PLACES: [f64; 12] = [0.003, 0.03, 0.12, 0.25, 0.4, 0.55, 0.7, 0.83, 0.93, 0.98, 0.997, 1.0];

/// Largest number of arcs on a cell.
const MAX_ARCS: usize = 24;

/// A part of a cell on which one bound holds, in the direction of the pass.
#[derive(Clone, Copy, Debug)]
pub(super) struct Arc {
    pub(super) from: f64,
    pub(super) to: f64,
    pub(super) bound: Bound,
    /// x² b of its motor at `from`.
    w: f64,
    pub(super) b_from: f64,
    pub(super) b_to: f64,
}

/// Why an arc ends.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Event {
    /// This motor reaches its limit.
    Motor(usize),
    /// A speed limit.
    Cap,
    /// The limit near corners.
    Zone,
    /// No acceleration keeps all limits.
    Beyond,
}

impl Oriented {
    /// b on an arc.
    #[inline]
    pub(super) fn b(&self, arc: &Arc, s: f64) -> f64 {
        match arc.bound {
            Bound::Motor(k) => {
                if s == arc.from {
                    return arc.b_from;
                }
                // At a zero-inertia point, which is an end of the cell, the limit value.
                let s = if self.first(k, s) > 0.0 { s } else { s - 1e-7 * self.length };
                let x = self.first(k, s);
                (arc.w + 2.0 * self.way(k, arc.from, s)) / (x * x)
            }
            Bound::Zone => {
                let [p, beta] = self.zone.unwrap_or_default();
                let way = s - arc.from;
                let z = 2.0 * beta * way / p;
                let growth = if z.abs() < 1e-12 { 2.0 * way / p } else { -libm::expm1(-z) / beta };
                arc.b_from + (1.0 - beta * arc.b_from) * growth
            }
            bound => self.cap_by(bound, s),
        }
    }

    /// u under a bound that holds.
    #[inline]
    pub(super) fn u(&self, bound: Bound, s: f64, b: f64) -> f64 {
        match bound {
            Bound::Motor(k) => {
                let (x, rest) = (self.first(k, s), 1.0 - self.second(k, s) * b);
                if x != 0.0 {
                    rest / x
                } else if rest > 0.0 {
                    f64::INFINITY
                } else {
                    0.0
                }
            }
            Bound::Speed(k) => -self.second(k, s) * b / self.first(k, s),
            Bound::Pen => -0.5 * b * self.square_pen_slope(s) / self.square_pen(s),
            Bound::Zone => self.zone_u(b),
            Bound::Rows | Bound::Ceiling => 0.0,
        }
    }

    #[inline]
    fn zone_u(&self, b: f64) -> f64 {
        self.zone.map_or(f64::INFINITY, |[p, beta]| (1.0 - beta * b) / p)
    }

    /// The largest u of both motors and the zone.
    fn largest_u(&self, s: f64, b: f64) -> f64 {
        self.u(Bound::Motor(0), s, b).min(self.u(Bound::Motor(1), s, b)).min(self.zone_u(b))
    }

    /// The acceleration of motor k relative to its limit.
    #[inline]
    pub(super) fn alpha(&self, k: usize, s: f64, b: f64, u: f64) -> f64 {
        self.first(k, s) * u + self.second(k, s) * b
    }

    /// By how much an arc exceeds another limit at a place, and which; negative where it does not.
    fn event(&self, arc: &Arc, s: f64, strict: bool) -> (f64, Event) {
        let b = self.b(arc, s);
        let u = self.u(arc.bound, s, b);
        let [a0, a1] = [self.alpha(0, s, b, u), self.alpha(1, s, b, u)];
        if !b.is_finite() || a0.is_nan() || a1.is_nan() {
            let other = if let Bound::Motor(k) = arc.bound { 1 - k } else { 0 };
            return (1e3, Event::Motor(other));
        }
        let cap = self.cap(s);
        let is_cap = matches!(arc.bound, Bound::Speed(_) | Bound::Pen | Bound::Rows);
        let over = if is_cap && cap.1 == arc.bound { -1.0 } else { b / cap.0 - 1.0 };
        let faster = match arc.bound {
            Bound::Motor(0) => (a1 - 1.0, Event::Motor(1)),
            Bound::Motor(_) => (a0 - 1.0, Event::Motor(0)),
            _ if a0 > a1 => (a0 - 1.0, Event::Motor(0)),
            _ => (a1 - 1.0, Event::Motor(1)),
        };
        let mut beyond = match arc.bound {
            Bound::Motor(0) => -1.0 - a1,
            Bound::Motor(_) => -1.0 - a0,
            _ => -1.0 - a0.min(a1),
        };
        let mut worst = if over >= faster.0 { (over, Event::Cap) } else { faster };
        if let Some([p, beta]) = self.zone {
            beyond = beyond.max(-p * u + beta * b - 1.0);
            let up = p * u + beta * b - 1.0;
            if arc.bound != Bound::Zone && up > worst.0 {
                worst = (up, Event::Zone);
            }
        }
        // On a speed limit the pass against the motion only looks for a limit that is lower.
        if beyond > worst.0 && (!is_cap || strict) {
            worst = (beyond, Event::Beyond);
        }
        (worst.0.min(1e3) - HYSTERESIS, worst.1)
    }

    /// Positive where the motion cannot stay at the ceiling: the only u there leads below it, or a
    /// speed limit is lower.
    fn leaves_ceiling(&self, s: f64) -> f64 {
        let ceiling = self.ceiling(s);
        if self.cap(s).0 < ceiling {
            return 1.0;
        }
        let (left, right) = ((s - 1e-6 * self.length).max(0.0), (s + 1e-6 * self.length).min(self.length));
        let u = self.largest_u(s, ceiling * (1.0 - 1e-12));
        let slope = (self.ceiling(right) - self.ceiling(left)) / (right - left);
        slope - 2.0 * u - 1e-9 * (slope.abs() + u.abs())
    }

    /// The bound to begin with at s and b, and b, which a speed limit may lower by rounding.
    fn bound_at(&self, s: f64, b: f64, last: Option<(Bound, Event)>) -> (Bound, f64) {
        let us = [self.u(Bound::Motor(0), s, b), self.u(Bound::Motor(1), s, b)];
        let least = us[0].min(us[1]);
        let event = last.map(|(_, event)| event);
        if !matches!(event, Some(Event::Motor(_) | Event::Zone)) {
            let near = if event == Some(Event::Cap) { 1e-7 } else { 1e-12 };
            let (cap, bound) = self.cap(s);
            if b >= cap * (1.0 - near) {
                let u = self.u(bound, s, cap);
                if u.is_finite() && u <= least + 1e-7 * us[0].abs().min(us[1].abs()) && u <= self.zone_u(cap)
                {
                    return (bound, cap);
                }
            }
        }
        match event {
            Some(Event::Motor(k)) => return (Bound::Motor(k), b),
            Some(Event::Zone) => return (Bound::Zone, b),
            _ => {}
        }
        if self.zone_u(b) < least {
            return (Bound::Zone, b);
        }
        let mut k = usize::from(us[1] < us[0]);
        // A motor that reverses here takes over by an event.
        if self.first(k, s) == 0.0 {
            k = 1 - k;
        }
        (Bound::Motor(k), b)
    }

    /// Moves as fast as possible from s with this b to `end`, and returns b there. `strict`: stop
    /// where no acceleration keeps all limits, with an arc at the ceiling to mark it. Otherwise
    /// follow the ceiling there, as a bound on b, until a motion leads below it again.
    pub(super) fn flow(&self, from: f64, end: f64, b: f64, strict: bool, arcs: &mut Vec<Arc>) -> f64 {
        let (mut s, mut b) = (from, b);
        let mut last: Option<(Bound, Event)> = None;
        for _ in 0..MAX_ARCS {
            if s >= end {
                return b;
            }
            let (bound, start) = self.bound_at(s, b, last);
            b = start;
            let w = if let Bound::Motor(k) = bound { self.first(k, s) * self.first(k, s) * b } else { 0.0 };
            let mut arc = Arc { from: s, to: end, bound, w, b_from: b, b_to: b };
            let Some((at, event)) = self.first_event(&arc, end, strict) else {
                arc.b_to = self.b(&arc, end);
                arcs.push(arc);
                return arc.b_to;
            };
            (arc.to, arc.b_to) = (at, self.b(&arc, at));
            if at - s > 1e-15 * self.length {
                arcs.push(arc);
                b = arc.b_to;
            }
            s = at;
            if event == Event::Beyond {
                let resume = if strict || self.is_even { None } else { self.resumption(s, end) };
                let to = resume.unwrap_or(end);
                let b_to = self.ceiling(to).min(self.cap(to).0);
                if to > s {
                    arcs.push(Arc { from: s, to, bound: Bound::Ceiling, w: 0.0, b_from: b, b_to });
                }
                if resume.is_none() {
                    return b_to;
                }
                (s, b, last) = (to, b_to, None);
                continue;
            }
            last = Some((bound, event));
        }
        // Give up: nowhere faster than allowed.
        let b_to = b.min(self.ceiling(end)).min(self.cap(end).0);
        arcs.push(Arc { from: s, to: end, bound: Bound::Ceiling, w: 0.0, b_from: b, b_to });
        b_to
    }

    /// Where a motion can leave the ceiling again.
    fn resumption(&self, s: f64, end: f64) -> Option<f64> {
        let (mut low, mut high) = (s, f64::NAN);
        for part in 1..=8 {
            let at = s + (end - s) * f64::from(part) / 8.0;
            if self.leaves_ceiling(at) > 0.0 {
                high = at;
                break;
            }
            low = at;
        }
        if high.is_nan() {
            return None;
        }
        for _ in 0..50 {
            if high - low <= 1e-12 * self.length {
                break;
            }
            let middle = 0.5 * (low + high);
            if self.leaves_ceiling(middle) > 0.0 { high = middle } else { low = middle }
        }
        Some(high)
    }

    /// Where an arc that is to last until `end` must stop first, and why.
    fn first_event(&self, arc: &Arc, end: f64, strict: bool) -> Option<(f64, Event)> {
        if let (true, None, Bound::Motor(k)) = (self.is_even, self.zone, arc.bound) {
            return self.first_event_on_even(arc, k, end);
        }
        let (mut low, mut low_excess) = (arc.from, -1e-3);
        for share in PLACES {
            let mut at = arc.from + share * (end - arc.from);
            if share == 1.0 && (self.first(0, end) == 0.0 || self.first(1, end) == 0.0) {
                at = end - 1e-6 * (end - arc.from);
            }
            let (excess, event) = self.event(arc, at, strict);
            if excess > 0.0 {
                let mut event = event;
                let at = root((low, low_excess), (at, excess), 1e-13 * self.length, |s| {
                    let (excess, found) = self.event(arc, s, strict);
                    if excess > 0.0 {
                        event = found;
                    }
                    excess
                });
                return Some((at, event));
            }
            (low, low_excess) = (at, excess.min(-1e-300));
        }
        None
    }

    /// The same on a cell with constant m'', at motor k's limit.
    fn first_event_on_even(&self, arc: &Arc, k: usize, end: f64) -> Option<(f64, Event)> {
        let (s, b, other) = (arc.from, arc.b_from, 1 - k);
        let reverses = self.first(k, end) <= 0.0 || self.first(other, end) <= 0.0;
        let mut last = if reverses { end - 1e-6 * (end - s) } else { end };
        let mut event = None;
        let b_last = self.b(arc, last);
        let alpha = self.alpha(other, last, b_last, self.u(arc.bound, last, b_last));
        if alpha.is_nan() || alpha.abs() > 1.0 + ACCURACY {
            let sigma = if alpha < -1.0 { -1.0 } else { 1.0 };
            let (x, yk, yj) = (self.first(k, s), self.second(k, s), self.second(other, s));
            let w = self.first(other, s) * yk - yj * x;
            let u = self.u(arc.bound, s, b);
            let c = libm::cbrt(w * u / (sigma * yk - yj));
            let d = x * (sigma - self.alpha(other, s, b, u)) / ((yj - sigma * yk) * (1.0 + c + c * c));
            last = if d > 0.0 { (s + d).min(end) } else { s };
            event = Some(if sigma < 0.0 { Event::Beyond } else { Event::Motor(other) });
        }
        let over = |s: f64| self.b(arc, s) / self.cap(s).0 - 1.0;
        for at in [0.5 * (s + last), last] {
            let excess = over(at);
            if excess > ACCURACY {
                last = root((s, over(s).min(-1e-300)), (at, excess), 1e-13 * self.length, over);
                event = Some(Event::Cap);
                break;
            }
        }
        event.map(|event| (last, event))
    }

    /// The duration of a part of an arc, s.
    pub(super) fn time(&self, arc: &Arc, from: f64, to: f64) -> f64 {
        let mean = |of: &dyn Fn(f64) -> f64| (to - from) * super::cell::gauss(|t| of(from + t * (to - from)));
        match arc.bound {
            Bound::Motor(k) => {
                let speed = |s: f64| self.first(k, s) * self.b(arc, s).max(0.0).sqrt();
                2.0 * self.way(k, from, to) / (speed(from) + speed(to))
            }
            Bound::Speed(k) => self.way(k, from, to) / self.square_ratio(k).sqrt(),
            Bound::Pen => mean(&|s| self.square_pen(s).sqrt()) / self.square_pen_limit().sqrt(),
            Bound::Rows => (to - from) / self.b(arc, to).sqrt(),
            Bound::Zone => {
                let [p, beta] = self.zone.unwrap_or_default();
                let [v0, v1] = [from, to].map(|s| self.b(arc, s).max(0.0).sqrt());
                // v = tanh(√β t / p) / √β
                let d = (v1 - v0) / (1.0 - beta * v0 * v1);
                let z = beta.sqrt() * d;
                p * d * if z.abs() < 1e-4 { 1.0 + z * z / 3.0 } else { libm::atanh(z) / z }
            }
            Bound::Ceiling => 2.0 * (to - from) / (self.b(arc, from).sqrt() + self.b(arc, to).sqrt()),
        }
    }
}

/// The place between `low`, where a function is negative, and `high`, where it is positive, at which
/// it becomes positive: by the Illinois method with every third step a bisection, which stalls
/// nowhere. The function is positive there, and below the accuracy if that can be resolved.
pub(super) fn root(
    low: (f64, f64),
    high: (f64, f64),
    shortest: f64,
    mut value: impl FnMut(f64) -> f64,
) -> f64 {
    let ((mut low, mut low_value), (mut high, mut high_value)) = (low, high);
    let (mut side, mut at_high) = (0, high_value);
    for step in 0..90 {
        if high - low <= shortest || at_high <= ACCURACY {
            break;
        }
        let secant = (low * high_value - high * low_value) / (high_value - low_value);
        let inside = step < 45 && step % 3 < 2 && secant > low && secant < high;
        let middle = if inside { secant } else { 0.5 * (low + high) };
        let found = value(middle);
        if found > 0.0 {
            (high, high_value, at_high) = (middle, found, found);
            low_value *= if side == 1 { 0.5 } else { 1.0 };
            side = 1;
        } else {
            (low, low_value) = (middle, found.min(-1e-300));
            high_value *= if side == -1 { 0.5 } else { 1.0 };
            side = -1;
        }
    }
    high
}
