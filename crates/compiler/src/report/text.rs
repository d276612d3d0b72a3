//! Reports as text.

use std::fmt::Write as _;

use drawing::Drawing;
use kinematics::Machine;
use plan::Rounding;
use verify::{Certificate, Deviation, DeviationStats};

use super::summary::BestPlaceReport;
use crate::best_place::{BestFor, BestPlace};
use crate::pipeline::Compiled;

/// The summary of a plan.
pub fn summary(machine: &Machine, compiled: &Compiled<'_>) -> String {
    let times = compiled.trajectory.times();
    let certificate = &compiled.certificate;
    let mut text = String::new();
    let strokes = compiled.placed.strokes.len();
    let _ = write!(
        text,
        "{}: {}, {} of ink",
        machine.name(),
        pluralize(strokes, "stroke"),
        length(certificate.ink_mm)
    );
    if compiled.strokes != strokes {
        let _ = write!(text, " in {}", pluralize(compiled.strokes, "pen down"));
    }
    let [a, b, ..] = compiled.placement.as_coeffs();
    let scale = libm::hypot(a, b);
    if (scale - 1.0).abs() > 1e-12 {
        let _ = write!(text, ", scaled by {scale:.4}");
    }
    if let Some(best) = &compiled.best_place {
        text.push_str(&best_place(best));
    }
    let _ = writeln!(
        text,
        "\ntime {}: drawing {}, travel {} ({}), pen lifts and drops {}",
        duration(compiled.header.duration_us as f64 * 1e-6),
        duration(times.drawing_s),
        duration(times.travel_s),
        length(certificate.travel_mm),
        duration(times.lifting_s)
    );
    text.push_str(&limited_by_text(compiled));
    let [before, after] = [&compiled.placed, compiled.ordered()].map(pen_changes);
    if before != after {
        let _ = writeln!(text, "{} instead of {before} in the file's order", pluralize(after, "pen change"));
    }
    if let Some(report) = &compiled.ordering {
        let _ = writeln!(
            text,
            "pen up for {:.1} % of the time: {} straight from stroke to stroke instead of {} in the file's order, with lifts and drops {} instead of {}",
            100.0 * (times.travel_s + times.lifting_s) / (compiled.header.duration_us as f64 * 1e-6),
            length(report.travel_mm_after),
            length(report.travel_mm_before),
            duration(report.travel_cost_after),
            duration(report.travel_cost_before)
        );
    }
    text
}

/// Where the search put the drawing, and what that gained.
fn best_place(best: &BestPlace) -> String {
    let report = BestPlaceReport::of(best);
    let [x, y] = report.place_mm;
    let (aim, unit) = match best.aim {
        BestFor::Time => ("the shortest time", " s"),
        BestFor::Accuracy => ("the finest resolution", " mm"),
    };
    let gain = match best.centered {
        Some(centered) => {
            let change = 100.0 * (best.figure / centered - 1.0);
            format!(
                "{:.3}{unit}, {change:+.1} % of {centered:.3}{unit} in the middle of the sheet",
                best.figure
            )
        }
        None => format!("{:.3}{unit}; in the middle of the sheet it cannot be drawn", best.figure),
    };
    let compared = report.compared;
    format!(
        "\nplaced for {aim} by --place {x},{y} --rotate {}: {gain}; {compared} places compared",
        report.rotate_deg
    )
}

/// The drawing time by what limited the speed, s; the longest first.
pub(super) fn limited_by(compiled: &Compiled<'_>) -> Vec<(String, f64)> {
    let limiting = compiled.trajectory.limiting();
    let mut by =
        vec![("the pen's speed".to_owned(), limiting.pen_s), ("rows in turns".to_owned(), limiting.rows_s)];
    for (k, motor) in compiled.header.motors.iter().enumerate() {
        by.push((format!("speed of {}", motor.name), limiting.speed_s[k]));
        by.push((format!("acceleration of {}", motor.name), limiting.acceleration_s[k]));
        by.push((format!("jerk of {}", motor.name), limiting.jerk_s[k]));
        by.push((format!("acceleration of {} in corners and curves", motor.name), limiting.turning_s[k]));
    }
    by.retain(|(_, time)| *time > 0.0);
    by.sort_by(|a, b| b.1.total_cmp(&a.1));
    by
}

fn limited_by_text(compiled: &Compiled<'_>) -> String {
    let by = limited_by(compiled);
    let total: f64 = by.iter().map(|(_, time)| time).sum();
    let shares = by.iter().map(|(what, time)| (what, 100.0 * time / total));
    let shares: Vec<String> = shares
        .filter(|(_, share)| *share >= 1.0)
        .map(|(what, share)| format!("{what} {share:.0} %"))
        .collect();
    let mut text = if shares.is_empty() {
        String::new()
    } else {
        format!("drawing is limited by: {}\n", shares.join(", "))
    };
    let blended = compiled.trajectory.blended_strokes();
    if blended > 0 {
        let which = match compiled.strokes {
            1 => "the stroke keeps".to_owned(),
            all => format!("{blended} of {all} strokes keep"),
        };
        let _ = writeln!(text, "{which} blended corners: no spline is faster there");
    }
    text
}

/// A certificate.
pub fn certificate(certificate: &Certificate) -> String {
    let mut text = String::new();
    let _ =
        writeln!(text, "certificate {} (tolerance {} mm)", verdict(certificate), certificate.tolerance_mm);
    if let Some(before) = &certificate.before_rounding {
        deviation_text(&mut text, "before rounding to ticks", before);
    }
    let ticks = match certificate.rounding {
        Rounding::Nearest => "in whole ticks",
        Rounding::Path => "in whole ticks, chosen along the path",
    };
    deviation_text(&mut text, ticks, &certificate.after_rounding);
    text + &details(certificate)
}

/// A certificate of a plan without a drawing to compare it with.
pub fn motion(certificate: &Certificate) -> String {
    format!("motion {}\n{}", verdict(certificate), details(certificate))
}

fn verdict(certificate: &Certificate) -> &'static str {
    if certificate.holds { "holds" } else { "DOES NOT HOLD" }
}

/// Resolution, motor peaks and failures.
fn details(certificate: &Certificate) -> String {
    let mut text = String::new();
    let _ = writeln!(
        text,
        "  drawing resolution of this machine here (half a tick): {:.4} mm worst, {:.4} mm RMS",
        certificate.quantization_error.worst_mm, certificate.quantization_error.rms_mm
    );
    // Whole ticks alone do not separate the motion from its rounding.
    if certificate.motors.iter().any(|peak| peak.speed_ticks_s.is_none()) {
        text.push_str(
            "  shares of limits are taken from whole ticks, with the rounding error added to each limit\n",
        );
    }
    for peak in &certificate.motors {
        let _ = write!(
            text,
            "  motor {}: speed at most {:.1} % of its limit (99.9 %: {:.1}), acceleration {:.1} % (99.9 %: {:.1})",
            peak.name,
            100.0 * peak.speed_share,
            100.0 * peak.speed_share_p999,
            100.0 * peak.acceleration_share,
            100.0 * peak.acceleration_share_p999
        );
        if let Some(jerk) = &peak.jerk {
            let _ =
                write!(text, ", jerk {:.1} % (99.9 %: {:.1})", 100.0 * jerk.share, 100.0 * jerk.share_p999);
        }
        text.push('\n');
    }
    if let (Some(ticks), Some(shift)) = (certificate.largest_rounding_ticks, certificate.largest_shift_mm) {
        let _ = write!(text, "  no drift: every row is within {ticks:.3} ticks of the exact position");
        let half_tick = certificate.quantization_error.worst_mm;
        match certificate.rounding {
            Rounding::Nearest => text.push('\n'),
            Rounding::Path => {
                let _ = writeln!(
                    text,
                    ", the pen at most {shift:.4} mm early or late;\n  \
                     rows are chosen within half a tick of the path ({half_tick:.4} mm), motion between \
                     rows is replayed"
                );
            }
        }
    }
    for failure in &certificate.failures {
        let _ = writeln!(text, "  FAILED: {failure}");
    }
    text
}

fn deviation_text(text: &mut String, what: &str, deviation: &Deviation) {
    let stats = |stats: &DeviationStats| {
        let more = if stats.is_lower_bound { "more than " } else { "" };
        format!("{more}{:.4} mm (99 %: {:.4})", stats.max_mm, stats.p99_mm)
    };
    let _ = writeln!(
        text,
        "  {what}: max deviation ink to drawing {}, drawing to ink {}",
        stats(&deviation.ink_to_drawing),
        stats(&deviation.drawing_to_ink)
    );
}

/// Pen changes while the strokes are drawn in their order.
pub(super) fn pen_changes(drawing: &Drawing) -> usize {
    let mut pen = None;
    let is_change = |stroke: drawing::Stroke| pen.replace(stroke.pen).is_some_and(|last| last != stroke.pen);
    drawing.strokes.iter().map(is_change).filter(|change| *change).count()
}

/// A count with its noun: `1 stroke`, `3 strokes`.
pub fn pluralize(count: usize, thing: &str) -> String {
    format!("{count} {thing}{}", if count == 1 { "" } else { "s" })
}

/// A length in mm, or in m from 1 m on.
pub fn length(mm: f64) -> String {
    if mm >= 1000.0 { format!("{:.2} m", mm / 1000.0) } else { format!("{mm:.1} mm") }
}

/// A duration with hours and minutes where there are any: `1 h 02 min 05 s`.
pub fn duration(seconds: f64) -> String {
    let tenths = (seconds * 10.0).round() as u64;
    let (minutes, rest) = (tenths / 600, tenths % 600);
    let (hours, minutes) = (minutes / 60, minutes % 60);
    if hours > 0 {
        format!("{hours} h {minutes:02} min {:02} s", rest / 10)
    } else if minutes > 0 {
        format!("{minutes} min {:02}.{} s", rest / 10, rest % 10)
    } else {
        format!("{}.{} s", rest / 10, rest % 10)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_read_well() {
        assert_eq!(duration(0.04), "0.0 s");
        assert_eq!(duration(59.96), "1 min 00.0 s");
        assert_eq!(duration(3725.0), "1 h 02 min 05 s");
    }
}
