//! Strokes that other strokes draw already.

use drawing::{Point, Segment, Stroke};

use crate::touch::square;

/// A piece as a set of points: its ends and what lies a quarter of the way from each, to the tolerance of touching,
/// the same in either direction.
type Piece = [[i64; 2]; 4];

fn piece(segment: &Segment) -> Piece {
    // Half a square off, so that coordinates that are round numbers are nowhere near the edge of a square.
    let at = |t| {
        let p = segment.eval(t);
        square(Point::new(p.x + 0.25e-6, p.y + 0.25e-6))
    };
    let forward = [at(0.0), at(0.25), at(0.75), at(1.0)];
    let mut backward = forward;
    backward.reverse();
    forward.min(backward)
}

/// Removes strokes, all of one pen, all of whose pieces are pieces of others, later ones first; dots that lie on a
/// vertex of a stroke or on another dot are such as well.
pub(crate) fn dedupe(strokes: Vec<Stroke>) -> Vec<Stroke> {
    let mut pieces: Vec<(Piece, u32)> = Vec::new();
    for stroke in &strokes {
        for segment in stroke.segments() {
            pieces.push((piece(&segment), pieces.len() as u32));
        }
    }
    pieces.sort_unstable();
    // How often each piece is drawn, by the number of the piece.
    let mut number = vec![0; pieces.len()];
    let mut drawn: Vec<u32> = Vec::new();
    for same in pieces.chunk_by(|a, b| a.0 == b.0) {
        for &(_, at) in same {
            number[at as usize] = drawn.len();
        }
        drawn.push(same.len() as u32);
    }
    let dot = |p: Point| square(Point::new(p.x + 0.25e-6, p.y + 0.25e-6));
    let lines = strokes.iter().filter(|stroke| !stroke.is_dot());
    let mut inked: Vec<([i64; 2], usize)> =
        lines.flat_map(Stroke::points).map(|vertex| (dot(vertex), 0)).collect();
    inked.extend(
        strokes.iter().enumerate().filter(|(_, s)| s.is_dot()).map(|(at, s)| (dot(s.start()), at + 1)),
    );
    inked.sort_unstable();

    let mut end = number.len();
    let mut keep = vec![true; strokes.len()];
    for (at, stroke) in strokes.iter().enumerate().rev() {
        if stroke.is_dot() {
            let first = inked.partition_point(|&(point, _)| point < dot(stroke.start()));
            keep[at] = inked[first].1 == at + 1;
            continue;
        }
        let own = &number[end - stroke.segment_count()..end];
        end -= own.len();
        for &piece in own {
            drawn[piece] -= 1;
        }
        keep[at] = own.iter().any(|&piece| drawn[piece] == 0);
        if keep[at] {
            for &piece in own {
                drawn[piece] += 1;
            }
        }
    }
    strokes.into_iter().zip(keep).filter_map(|(stroke, keep)| keep.then_some(stroke)).collect()
}
