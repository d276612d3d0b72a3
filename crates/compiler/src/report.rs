//! What came of a plan: the summary and the certificate, as text for people and as JSON for programs.

use std::fmt::Write as _;

use drawing::Drawing;
use kinematics::Machine;
use serde_json::{Value, json};
use verify::{Certificate, Deviation, DeviationStats, MotorPeak};

use crate::pipeline::{Compiled, Request};

/// The settings a plan was made with, as JSON.
pub fn settings(request: &Request) -> Value {
    json!({
        "tolerance_mm": request.tolerance_mm,
        "period_us": request.period_us,
        "order": request.order.name(),
    })
}

/// The summary of a plan, as JSON: lengths in mm, times in s.
pub fn summary(compiled: &Compiled<'_>) -> Value {
    let times = compiled.trajectory.times();
    let certificate = &compiled.certificate;
    json!({
        "strokes": compiled.placed.strokes.len(),
        "strokes_drawn": compiled.strokes,
        "dots": certificate.dots,
        "pens": certificate.pens,
        "ink_mm": certificate.ink_mm,
        "travel_mm": certificate.travel_mm,
        "beyond_sheet_mm": compiled.beyond_sheet_mm,
        "rows": compiled.header.rows,
        "duration_s": compiled.header.duration_us as f64 * 1e-6,
        "drawing_s": times.drawing_s,
        "travel_s": times.travel_s,
        "lifting_s": times.lifting_s,
        "limited_by_s": limited_by(compiled).into_iter().map(|(what, time)| (what, json!(time))).collect::<serde_json::Map<_, _>>(),
        "pen_up_share": (times.travel_s + times.lifting_s) / (compiled.header.duration_us as f64 * 1e-6),
        "placement": compiled.placement.as_coeffs(),
        "pen_changes": pen_changes(compiled.ordered()),
        "ordering": compiled.ordering.as_ref().map(|report| json!({
            "strokes_before": report.strokes_before,
            "strokes_after": report.strokes_after,
            "merged": report.merged,
            "duplicates_removed": report.duplicates_removed,
            "travel_mm_before": report.travel_mm_before,
            "travel_mm_after": report.travel_mm_after,
            "travel_s_before": report.travel_cost_before,
            "travel_s_after": report.travel_cost_after,
        })),
    })
}

/// A certificate as JSON.
pub fn certificate(certificate: &Certificate) -> Value {
    json!({
        "holds": certificate.holds,
        "failures": certificate.failures.iter().map(ToString::to_string).collect::<Vec<_>>(),
        "tolerance_mm": certificate.tolerance_mm,
        "before_rounding": certificate.before_rounding.as_ref().map(deviation),
        "after_rounding": deviation(&certificate.after_rounding),
        "tick_floor": {
            "worst_mm": certificate.tick_floor.worst_mm,
            "rms_mm": certificate.tick_floor.rms_mm,
        },
        "largest_rounding_ticks": certificate.largest_rounding_ticks,
        "pens": certificate.pens,
        "motors": certificate.motors.iter().map(motor).collect::<Vec<_>>(),
        "rows": certificate.rows,
        "duration_s": certificate.duration_us as f64 * 1e-6,
        "ink_mm": certificate.ink_mm,
        "travel_mm": certificate.travel_mm,
        "pen_downs": certificate.pen_downs,
        "dots": certificate.dots,
    })
}

fn deviation(deviation: &Deviation) -> Value {
    let stats = |stats: &DeviationStats| {
        json!({
            "max_mm": stats.max_mm,
            "p99_mm": stats.p99_mm,
            "more": stats.is_lower_bound,
            "unseen_mm": stats.sampling_error_mm,
        })
    };
    json!({
        "ink_to_drawing": stats(&deviation.ink_to_drawing),
        "drawing_to_ink": stats(&deviation.drawing_to_ink),
    })
}

fn motor(peak: &MotorPeak) -> Value {
    json!({
        "name": peak.name,
        "speed": peak.speed_ticks_s,
        "speed_limit": peak.speed_limit_ticks_s,
        "speed_share": peak.speed_share,
        "speed_share_p999": peak.speed_share_p999,
        "acceleration": peak.acceleration_ticks_s2,
        "acceleration_limit": peak.acceleration_limit_ticks_s2,
        "acceleration_share": peak.acceleration_share,
        "acceleration_share_p999": peak.acceleration_share_p999,
        "jerk": peak.jerk.map(|peak| json!({
            "jerk": peak.jerk_ticks_s3,
            "limit": peak.limit_ticks_s3,
            "share": peak.share,
            "share_p999": peak.share_p999,
        })),
    })
}

/// The summary of a plan, for people.
pub fn summary_text(machine: &Machine, compiled: &Compiled<'_>) -> String {
    let times = compiled.trajectory.times();
    let certificate = &compiled.certificate;
    let mut text = String::new();
    let strokes = compiled.placed.strokes.len();
    let _ = write!(
        text,
        "{}: {}, {} of ink",
        machine.name(),
        counted(strokes, "stroke"),
        metres(certificate.ink_mm)
    );
    if compiled.strokes != strokes {
        let _ = write!(text, " in {} pen downs", compiled.strokes);
    }
    let [a, b, ..] = compiled.placement.as_coeffs();
    let scale = libm::hypot(a, b);
    if (scale - 1.0).abs() > 1e-12 {
        let _ = write!(text, ", scaled by {scale:.4}");
    }
    let _ = writeln!(
        text,
        "\ntime {}: drawing {}, travel {} ({}), pen lifts and drops {}",
        clock(compiled.header.duration_us as f64 * 1e-6),
        clock(times.drawing_s),
        clock(times.travel_s),
        metres(certificate.travel_mm),
        clock(times.lifting_s)
    );
    text.push_str(&limited_by_text(compiled));
    let [before, after] = [&compiled.placed, compiled.ordered()].map(pen_changes);
    if before != after {
        let _ = writeln!(text, "{} instead of {before} in the file's order", counted(after, "pen change"));
    }
    if let Some(report) = &compiled.ordering {
        let _ = writeln!(
            text,
            "pen up for {:.1} % of the time: {} straight from stroke to stroke instead of {} in the file's order, with lifts and drops {} instead of {}",
            100.0 * (times.travel_s + times.lifting_s) / (compiled.header.duration_us as f64 * 1e-6),
            metres(report.travel_mm_after),
            metres(report.travel_mm_before),
            clock(report.travel_cost_after),
            clock(report.travel_cost_before)
        );
    }
    text
}

/// What kept the drawing time from being shorter, s; the longest first.
fn limited_by(compiled: &Compiled<'_>) -> Vec<(String, f64)> {
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
    if shares.is_empty() { String::new() } else { format!("drawing is limited by: {}\n", shares.join(", ")) }
}

/// A certificate, for people.
pub fn certificate_text(certificate: &Certificate) -> String {
    let mut text = String::new();
    let _ =
        writeln!(text, "certificate {} (tolerance {} mm)", verdict(certificate), certificate.tolerance_mm);
    if let Some(before) = &certificate.before_rounding {
        deviation_text(&mut text, "before rounding to ticks", before);
    }
    deviation_text(&mut text, "in whole ticks", &certificate.after_rounding);
    text + &details(certificate)
}

/// A certificate of a plan that was not compared with a drawing, for people.
pub fn motion_text(certificate: &Certificate) -> String {
    format!("motion {}\n{}", verdict(certificate), details(certificate))
}

fn verdict(certificate: &Certificate) -> &'static str {
    if certificate.holds { "holds" } else { "DOES NOT HOLD" }
}

/// What a certificate says of the machine and its motors, and what failed.
fn details(certificate: &Certificate) -> String {
    let mut text = String::new();
    let _ = writeln!(
        text,
        "  drawing resolution of this machine here (half a tick): {:.4} mm worst, {:.4} mm RMS",
        certificate.tick_floor.worst_mm, certificate.tick_floor.rms_mm
    );
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
    if let Some(rounding) = certificate.largest_rounding_ticks {
        let _ = writeln!(text, "  no drift: every row is within {rounding:.3} ticks of the exact position");
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
        "  {what}: ink strays by at most {}, drawing missed by at most {}",
        stats(&deviation.ink_to_drawing),
        stats(&deviation.drawing_to_ink)
    );
}

/// How often another pen is taken while the strokes are drawn in their order.
fn pen_changes(drawing: &Drawing) -> usize {
    drawing.strokes.windows(2).filter(|pair| pair[0].pen != pair[1].pen).count()
}

/// So many of a thing, for people.
pub fn counted(count: usize, thing: &str) -> String {
    format!("{count} {thing}{}", if count == 1 { "" } else { "s" })
}

/// A length for people.
pub fn metres(mm: f64) -> String {
    if mm >= 1000.0 { format!("{:.2} m", mm / 1000.0) } else { format!("{mm:.1} mm") }
}

/// A time for people: hours and minutes where there are any.
pub fn clock(seconds: f64) -> String {
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
        assert_eq!(clock(0.04), "0.0 s");
        assert_eq!(clock(59.96), "1 min 00.0 s");
        assert_eq!(clock(3725.0), "1 h 02 min 05 s");
    }
}
