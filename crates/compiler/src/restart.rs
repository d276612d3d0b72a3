//! Closed strokes that start where the joint limits let the pen go all the way around.
//!
//! A closed stroke around the base turns a joint by a full rotation. With a joint range of little more
//! than that, most of its points are no place to start, although the stroke can be drawn.

use drawing::{Segment, Stroke};
use kinematics::Machine;

/// Places at which a start is tried, at most.
const STARTS: usize = 72;
/// The trial follows chords of at most this deviation, mm; the planner decides.
const CHORD_MM: f64 = 0.05;

/// The same closed stroke with another start, from which the joints stay within their limits all the
/// way; `None` for open strokes, and if there is no such start.
pub(crate) fn restarted(machine: &Machine, stroke: &Stroke) -> Option<Stroke> {
    if !stroke.is_closed() || stroke.is_dot() {
        return None;
    }
    let segments: Vec<Segment> = stroke.segments().collect();
    let per_segment = STARTS.div_ceil(segments.len()).max(1);
    let every = segments.len().div_ceil(STARTS).max(1);
    let starts = (0..segments.len())
        .step_by(every)
        .flat_map(|index| (0..per_segment).map(move |part| (index, part as f64 / per_segment as f64)));
    // Vertices before places inside of segments: there the pen slows down anyway.
    let mut starts: Vec<(usize, f64)> = starts.collect();
    starts.sort_by(|a, b| (a.1 > 0.0).cmp(&(b.1 > 0.0)));
    starts
        .into_iter()
        .map(|(index, t)| from(stroke, &segments, index, t))
        .find(|candidate| stays_within_limits(machine, candidate))
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

/// Whether the joints stay within their limits from one of the poses at the start.
fn stays_within_limits(machine: &Machine, stroke: &Stroke) -> bool {
    let points = stroke.flatten(CHORD_MM);
    let Ok(poses) = machine.poses(points[0], &machine.start()) else { return false };
    poses.into_iter().any(|start| {
        let mut pose = start;
        points.iter().all(|point| match machine.pose_near(*point, &pose) {
            Ok(next) => {
                pose = next;
                machine.joint_fault(&next).is_none()
            }
            Err(_) => false,
        })
    })
}
