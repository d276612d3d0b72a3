//! Closed strokes that start where the joint limits let the pen go all the way around.
//!
//! A closed stroke around the base turns a joint by a full rotation. With a joint range of little more
//! than that, most of its points are no place to start, although the stroke can be drawn.

use drawing::{Segment, Stroke};
use kinematics::{JointPos, Machine};

/// Places at which a start is tried, at most.
const STARTS: usize = 72;
/// Ends at most this far apart are one point, mm.
const CLOSED_MM: f64 = 1e-6;
/// The trial follows chords of at most this deviation, mm; the planner decides.
const CHORD_MM: f64 = 0.05;

/// The same closed stroke with another start, from which the joints stay within their limits all the
/// way; `None` for open strokes, and if there is no such start.
pub(crate) fn restarted(machine: &Machine, stroke: &Stroke) -> Option<Stroke> {
    // An arc's computed end may differ from the start in the last digits.
    let gap_mm = (stroke.end() - stroke.start()).hypot2().sqrt();
    if gap_mm > CLOSED_MM || stroke.is_dot() {
        return None;
    }
    let segments: Vec<Segment> = stroke.segments().collect();
    let per_segment = STARTS.div_ceil(segments.len()).max(1);
    let every = segments.len().div_ceil(STARTS).max(1);
    let starts = (0..segments.len())
        .step_by(every)
        .flat_map(|index| (0..per_segment).map(move |part| (index, part as f64 / per_segment as f64)));
    let mut best: Option<(f64, Stroke)> = None;
    for (index, t) in starts {
        let candidate = from(stroke, &segments, index, t);
        let Some(margin) = margin(machine, &candidate) else { continue };
        if best.as_ref().is_none_or(|(most, _)| margin > *most) {
            best = Some((margin, candidate));
        }
    }
    best.map(|(_, stroke)| stroke)
}

/// The stroke from a place on one of its segments.
fn from(stroke: &Stroke, segments: &[Segment], index: usize, t: f64) -> Stroke {
    let (before, after) = segments.split_at(index);
    let first = if t > 0.0 { after[0].part(t, 1.0) } else { after[0] };
    let mut restarted = Stroke::new(stroke.pen, first.start(), stroke.source());
    restarted.push(first);
    after[1..].iter().chain(before).for_each(|segment| restarted.push(*segment));
    if t > 0.0 {
        restarted.push(after[0].part(0.0, t));
    }
    restarted
}

/// The least distance of the rotating joints from their limits along the stroke, rad, from the best pose
/// at its start; `None` if a joint leaves its range from each of them.
fn margin(machine: &Machine, stroke: &Stroke) -> Option<f64> {
    let points = stroke.flatten(CHORD_MM);
    let poses = machine.poses(points[0], &machine.start()).ok()?;
    let rotation = machine.mechanism().full_rotation()?;
    let along = |start: JointPos| {
        let mut pose = start;
        let mut least = f64::INFINITY;
        for point in &points {
            pose = machine.pose_near(*point, &pose).ok()?;
            for (k, range) in machine.parts().joints.iter().enumerate() {
                let within = (pose[k] - range.min).min(range.max - pose[k]);
                // The other joints take the same way from every start.
                if rotation[k] != 0.0 || within < 0.0 {
                    least = least.min(within);
                }
            }
        }
        (least >= 0.0).then_some(least)
    };
    poses.into_iter().filter_map(along).reduce(f64::max)
}
