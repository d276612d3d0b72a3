//! Klipper's step commands as text: `queue_step oid=%c interval=%u count=%hu add=%hi`, the form its own tools print.
//!
//! A micro-controller makes `count` steps, the first `interval` clock ticks after the step before, each later one `add`
//! ticks further apart (`MCU_Commands`, "Stepper commands"). Intervals are below 2^31, counts below 2^16, `add` is 16 bits. Motors
//! move evenly between rows, so a step falls where a motor passes the middle between two positions, to the clock tick.
//! A real run still needs Klipper's clock synchronisation: this is the motion, not the session.

use std::io::Write;

use plan::Row;

use plan::file::text::Text;

use crate::backend::{Backend, EncodeOptions, PenNumbers, PlanSource};
use crate::{Unrepresentable, WriteError};

/// Step commands of Klipper's micro-controllers.
#[derive(Clone, Copy, Debug)]
pub(crate) struct KlipperSteps;

impl Backend for KlipperSteps {
    fn name(&self) -> &'static str {
        NAME
    }

    fn format_help(&self) -> Option<&'static str> {
        Some("Klipper's step commands")
    }

    fn pens(&self) -> PenNumbers {
        PenNumbers::Dropped
    }

    fn write(
        &self,
        plan: &PlanSource<'_>,
        _options: &EncodeOptions,
        out: &mut dyn Write,
    ) -> Result<(), WriteError> {
        check(plan.rows())?;
        write(plan.rows(), out)
    }
}

/// The format's name.
const NAME: &str = "klipper-steps";
/// The clock that the intervals count, ticks a second.
const CLOCK_HZ: u64 = 16_000_000;
/// Intervals are shorter than this, clock ticks; `check_line` of Klipper's host demands it.
const LONGEST: u64 = 1 << 31;
/// `count` has 16 bits.
const MOST_STEPS: u64 = 65_535;

/// One motor's steps.
struct Stepper {
    oid: usize,
    /// Clock of its last step.
    clock: u64,
    forward: Option<bool>,
    /// The run not written yet: interval and count.
    run: Option<(u64, u64)>,
}

impl Stepper {
    fn flush<W: Write + ?Sized>(&mut self, text: &mut Text<'_, W>) {
        if let Some((interval, count)) = self.run.take() {
            text.str("queue_step oid=").int(self.oid).str(" interval=").int(interval);
            text.str(" count=").int(count).str(" add=0\n");
        }
    }

    fn step<W: Write + ?Sized>(&mut self, text: &mut Text<'_, W>, at: u64) {
        let interval = at - self.clock;
        if interval >= LONGEST {
            self.flush(text);
            // One tick before, so that the interval is a legal one.
            text.str("reset_step_clock oid=").int(self.oid).str(" clock=").int((at - 1) & 0xFFFF_FFFF);
            text.byte(b'\n');
            self.run = Some((1, 1));
        } else {
            match &mut self.run {
                Some((same, count)) if *same == interval && *count < MOST_STEPS => *count += 1,
                _ => {
                    self.flush(text);
                    self.run = Some((interval, 1));
                }
            }
        }
        self.clock = at;
    }
}

/// The clock at a time of the plan.
fn clock_of(t_us: u64) -> u64 {
    t_us * (CLOCK_HZ / 1_000_000)
}

/// Whether no two steps of a motor fall on one clock tick.
fn check(rows: impl Iterator<Item = Row>) -> Result<(), Unrepresentable> {
    let mut before: Option<Row> = None;
    for (index, row) in (0..).zip(rows) {
        if let Some(last) = before {
            let us = row.t_us - last.t_us;
            let steps = [0, 1].map(|motor| row.ticks[motor].abs_diff(last.ticks[motor]));
            if let Some(steps) = steps.into_iter().find(|steps| *steps >= clock_of(us)) {
                let (format, most) = (NAME, CLOCK_HZ);
                return Err(Unrepresentable::TooFast { row: index, steps, us, format, most });
            }
        }
        before = Some(row);
    }
    Ok(())
}

/// Writes a plan that passed [`check`]: both steppers' commands, each in the order of time, and the pen's.
///
/// # Errors
/// An error of the writer.
fn write<W: Write + ?Sized>(rows: impl IntoIterator<Item = Row>, out: &mut W) -> Result<(), WriteError> {
    let mut text = Text::new(out);
    text.str("# clock_hz: ").int(CLOCK_HZ).str("\n# stepper oid 0 and 1, pen oid 2\n");
    text.str("reset_step_clock oid=0 clock=0\nreset_step_clock oid=1 clock=0\n");
    let mut steppers = [0, 1].map(|oid| Stepper { oid, clock: 0, forward: None, run: None });
    let mut before: Option<Row> = None;
    let mut down = false;
    for row in rows {
        if let Some(last) = before {
            if (last.pen != 0) != down {
                down = last.pen != 0;
                for stepper in &mut steppers {
                    stepper.flush(&mut text);
                }
                pen(&mut text, down, clock_of(last.t_us));
            }
            let (from, to) = (clock_of(last.t_us), clock_of(row.t_us));
            for (motor, stepper) in steppers.iter_mut().enumerate() {
                let steps = row.ticks[motor] - last.ticks[motor];
                let count = steps.unsigned_abs();
                if count > 0 && stepper.forward != Some(steps > 0) {
                    stepper.flush(&mut text);
                    stepper.forward = Some(steps > 0);
                    text.str("set_next_step_dir oid=").int(motor).str(" dir=").int(u8::from(steps > 0));
                    text.byte(b'\n');
                }
                for k in 0..count {
                    // Halfway between two positions: (k + 1/2) / count of the time, rounded up.
                    let share = (2 * u128::from(k) + 1) * u128::from(to - from);
                    stepper.step(&mut text, from + share.div_ceil(2 * u128::from(count)) as u64);
                }
            }
            text.flush_if_full()?;
        }
        before = Some(row);
    }
    for stepper in &mut steppers {
        stepper.flush(&mut text);
    }
    if down && let Some(last) = before {
        pen(&mut text, false, clock_of(last.t_us));
    }
    Ok(text.finish()?)
}

fn pen<W: Write + ?Sized>(text: &mut Text<'_, W>, down: bool, clock: u64) {
    text.str("queue_digital_out oid=2 clock=").int(clock & 0xFFFF_FFFF).str(" on_ticks=");
    text.int(u8::from(down)).byte(b'\n');
}
