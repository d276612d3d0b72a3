//! Setpoints: what the firmware asks of the motors, from the rows of a plan or from vertices.

use plan::Row;

use crate::controller::Setpoint;

/// How a plan becomes setpoints.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SetpointKind {
    /// Only the vertices of the strokes, without time: the next one follows when both motors are
    /// near enough, as in the firmware of report 1.
    Vertices,
    /// The last row, until the next one.
    Held,
    /// Linear interpolation between rows.
    #[default]
    Interpolated,
}

/// A vertex for [`SetpointKind::Vertices`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Vertex {
    /// The pen while the motors move to it; 0 for up.
    pub pen: u16,
    /// Motor positions, ticks.
    pub ticks: [f64; 2],
}

/// Least distance of the points of a difference, s: closer together, rounding to ticks shows.
const DIFFERENCE_S: f64 = 0.01;

/// The rows of a plan as functions of time. Each reader has its own cursor, so that rows are found
/// without searching as long as time goes forward.
#[derive(Clone, Debug)]
pub(crate) struct Rows<'a> {
    all: &'a [Row],
    cursors: [usize; 5],
    difference_us: f64,
}

impl<'a> Rows<'a> {
    pub(crate) fn new(rows: &'a [Row], period_us: u64) -> Self {
        Self { all: rows, cursors: [0; 5], difference_us: (period_us as f64).max(DIFFERENCE_S * 1e6) }
    }

    /// Index of the last row at or before the time.
    fn find(rows: &[Row], cursor: &mut usize, t_us: f64) -> usize {
        // 1e-3 us: the time of a row itself, whatever its rounding.
        let t_us = t_us + 1e-3;
        while *cursor + 1 < rows.len() && rows[*cursor + 1].t_us as f64 <= t_us {
            *cursor += 1;
        }
        while *cursor > 0 && rows[*cursor].t_us as f64 > t_us {
            *cursor -= 1;
        }
        *cursor
    }

    fn interpolated(rows: &[Row], cursor: &mut usize, t_us: f64) -> [f64; 2] {
        let index = Self::find(rows, cursor, t_us);
        let from = &rows[index];
        let Some(to) = rows.get(index + 1) else { return from.ticks.map(|ticks| ticks as f64) };
        let share = ((t_us - from.t_us as f64) / (to.t_us - from.t_us) as f64).clamp(0.0, 1.0);
        [0, 1].map(|k: usize| from.ticks[k] as f64 + share * (to.ticks[k] - from.ticks[k]) as f64)
    }

    /// Positions by linear interpolation, ticks.
    pub(crate) fn position(&mut self, t_us: f64) -> [f64; 2] {
        Self::interpolated(self.all, &mut self.cursors[0], t_us)
    }

    /// The pen, and the ticks of the row.
    pub(crate) fn row(&mut self, t_us: f64) -> Row {
        let index = Self::find(self.all, &mut self.cursors[0], t_us);
        self.all[index]
    }

    /// Speeds and accelerations by central differences over the period of the rows, at least 10 ms:
    /// `v = (p(t + T) - p(t - T)) / 2T`, `a = (p(t + 2T) - 2 p(t) + p(t - 2T)) / 4T²`.
    pub(crate) fn rates(&mut self, t_us: f64) -> ([f64; 2], [f64; 2]) {
        let d = self.difference_us;
        let [here, c1, c2, c3, c4] = &mut self.cursors;
        let middle = Self::interpolated(self.all, here, t_us);
        let near = [Self::interpolated(self.all, c1, t_us - d), Self::interpolated(self.all, c2, t_us + d)];
        let far = [
            Self::interpolated(self.all, c3, t_us - 2.0 * d),
            Self::interpolated(self.all, c4, t_us + 2.0 * d),
        ];
        let d_s = d * 1e-6;
        let speed = [0, 1].map(|k: usize| (near[1][k] - near[0][k]) / (2.0 * d_s));
        let acceleration =
            [0, 1].map(|k: usize| (far[1][k] - 2.0 * middle[k] + far[0][k]) / (4.0 * d_s * d_s));
        (speed, acceleration)
    }

    /// The setpoints at a time.
    pub(crate) fn setpoints(&mut self, t_us: f64, kind: SetpointKind, with_rates: bool) -> [Setpoint; 2] {
        let position = match kind {
            SetpointKind::Held => self.row(t_us).ticks.map(|ticks| ticks as f64),
            _ => self.position(t_us),
        };
        let (speed, acceleration) = if with_rates { self.rates(t_us) } else { ([0.0; 2], [0.0; 2]) };
        [0, 1].map(|k: usize| Setpoint {
            position: position[k],
            speed: speed[k],
            acceleration: acceleration[k],
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(t_us: u64, a: i64) -> Row {
        Row { t_us, pen: 1, ticks: [a, -a] }
    }

    #[test]
    fn rows_are_held_or_interpolated() {
        let rows = [row(0, 0), row(10_000, 10), row(20_000, 40), row(60_000, 40)];
        let mut plan = Rows::new(&rows, 10_000);
        assert_eq!(plan.position(5_000.0), [5.0, -5.0]);
        assert_eq!(plan.position(15_000.0), [25.0, -25.0]);
        assert_eq!(plan.position(-1.0), [0.0, 0.0]);
        assert_eq!(plan.position(1e9), [40.0, -40.0]);
        let at = |plan: &mut Rows<'_>, kind| plan.setpoints(15_000.0, kind, true)[0];
        assert_eq!(at(&mut plan, SetpointKind::Held).position, 10.0);
        let setpoint = at(&mut plan, SetpointKind::Interpolated);
        // (40 - 5) / 20 ms; (40 - 50 + 0) / (20 ms)².
        assert!((setpoint.speed - 1750.0).abs() < 1e-9);
        assert!((setpoint.acceleration + 25_000.0).abs() < 1e-6);
    }
}
