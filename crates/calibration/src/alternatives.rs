//! What else would explain the measurements: a motor that counts the other way, corners touched in
//! another order.

use crate::fit::{Measurements, Options, solve};
use crate::setup::Setup;

/// Another reading of the measurements.
#[derive(Clone, Debug, PartialEq)]
pub enum Alternative {
    /// These motors count the other way.
    Reversed([bool; 2]),
    /// The corners were touched in this order: the first touch is at the corner `order[0]`, counted
    /// counterclockwise from the lower left.
    Order([usize; 4]),
}

/// The alternatives that fit at least four times as well as the machine file does, and about as well as the
/// best of them, with their RMS residuals, mm; best first. Orders of corners are tried if the touches
/// are corners in an order that somebody was asked to follow.
pub fn alternatives(
    nominal: &Setup,
    data: &Measurements,
    options: &Options,
    are_corners: bool,
) -> Vec<(Alternative, f64)> {
    let rms = |setup: &Setup, data: &Measurements| {
        let solution = solve(setup, data, options.groups).ok()?;
        Some((solution.sum / (data.touches.len() + data.distances.len()) as f64).sqrt())
    };
    let Some(given) = rms(nominal, data) else { return Vec::new() };
    let mut found: Vec<(Alternative, f64)> = Vec::new();
    for reversed in [[true, false], [false, true], [true, true]] {
        let mut setup = nominal.clone();
        for (ticks_per_unit, is_reversed) in setup.ticks_per_unit.iter_mut().zip(reversed) {
            if is_reversed {
                *ticks_per_unit = -*ticks_per_unit;
            }
        }
        found.extend(rms(&setup, data).map(|rms| (Alternative::Reversed(reversed), rms)));
    }
    if are_corners && data.touches.len() >= 4 && data.touches.len().is_multiple_of(4) {
        let places: Vec<_> = data.touches[..4].iter().map(|touch| touch.place).collect();
        for order in orders() {
            let mut other = data.clone();
            for (k, touch) in other.touches.iter_mut().enumerate() {
                touch.place = places[order[k % 4]];
            }
            found.extend(rms(nominal, &other).map(|rms| (Alternative::Order(order), rms)));
        }
    }
    found.sort_by(|a, b| a.1.total_cmp(&b.1));
    let best = found.first().map_or(f64::INFINITY, |(_, rms)| *rms);
    found.retain(|(_, rms)| *rms < 0.25 * given && *rms <= 2.0 * best + 1e-6);
    found
}

/// All orders of four but the given one and the half turn, which a rectangle does not tell from it.
fn orders() -> Vec<[usize; 4]> {
    let mut orders = Vec::new();
    for code in 0..256_usize {
        let order = [code & 3, code >> 2 & 3, code >> 4 & 3, code >> 6 & 3];
        let is_permutation = (0..4).all(|corner| order.contains(&corner));
        if is_permutation && order != [0, 1, 2, 3] && order != [2, 3, 0, 1] {
            orders.push(order);
        }
    }
    orders
}
