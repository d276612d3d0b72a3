//! How well the ink covers the drawing.
//!
//! Each straight piece of the drawing is divided into short cells. The distance to one run is
//! convex along a cell, so the cell is covered to within the larger value at its ends; the smallest
//! bound over all runs is kept. A cell beside the common point `v` of two consecutive runs is
//! divided at `m`, the point nearest to `v`: each run covers one part.

use crate::{
    DeviationStats, Location,
    histogram::Histogram,
    run::Run,
    target::{BLOCK, Piece, Target},
};

/// A part of the drawing that is too far from all ink.
#[derive(Clone, Copy, Debug)]
pub(crate) struct UncoveredPart {
    pub(crate) pen: u16,
    /// The largest distance.
    pub(crate) mm: f64,
    /// Whether `mm` is only a lower bound.
    pub(crate) is_lower_bound: bool,
    /// Uncovered length.
    pub(crate) length: f64,
    /// Number of strokes with an uncovered part.
    pub(crate) strokes: u64,
    pub(crate) location: Location,
}

/// A run in the frame of one piece of the drawing.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LocalRun {
    ends: [(f64, f64); 2],
    vector: (f64, f64),
    /// 1 / length²; 0 for a dot.
    inverse: f64,
    error: f64,
}

impl LocalRun {
    pub(crate) fn new(piece: &Piece, run: &Run) -> Self {
        let ends = [piece.local(run.from), piece.local(run.to)];
        let vector = (ends[1].0 - ends[0].0, ends[1].1 - ends[0].1);
        let square = vector.0 * vector.0 + vector.1 * vector.1;
        let inverse = if square > 0.0 { 1.0 / square } else { 0.0 };
        Self { ends, vector, inverse, error: run.error + piece.error }
    }

    /// Squared distance from the point at `along` on the piece to the run.
    fn square_at(&self, along: f64) -> f64 {
        let (x, y) = (along - self.ends[0].0, -self.ends[0].1);
        let t = ((x * self.vector.0 + y * self.vector.1) * self.inverse).clamp(0.0, 1.0);
        let (x, y) = (x - t * self.vector.0, y - t * self.vector.1);
        x * x + y * y
    }
}

/// Bounds of the distance from each cell of the drawing to the ink.
#[derive(Clone, Debug)]
pub(crate) struct Cover {
    /// Upper bound for each cell, mm; infinite if no ink came near.
    cells: Vec<f32>,
    /// The largest bound of each block.
    blocks: Vec<f32>,
    /// Whether only the middles of the cells are sampled.
    sparse: bool,
}

impl Cover {
    pub(crate) fn new(target: &Target) -> Self {
        Self {
            cells: vec![f32::INFINITY; target.cells],
            blocks: vec![f32::INFINITY; target.blocks],
            sparse: target.sparse_mm > 0.0,
        }
    }

    /// Whether all cells of a piece are covered to within `mm`; false if that is not known. NaN is not.
    pub(crate) fn is_nearer(&self, piece: &Piece, mm: f64) -> bool {
        piece.cells as usize <= BLOCK && f64::from(self.blocks[piece.first_block as usize]) <= mm
    }

    /// Updates the cells of a piece with the distance to a run.
    pub(crate) fn run(&mut self, piece: &Piece, run: &LocalRun, radius: f64) {
        let [(x0, y0), (x1, y1)] = run.ends;
        let (low, high) = (x0.min(x1), x0.max(x1));
        // Lower bound of the distance from the run to the line of the piece.
        let aside = y0.min(y1).max(-y0.max(y1)).max(0.0);
        if high + radius < 0.0 || low - radius > piece.length || aside > radius {
            return;
        }
        let count = piece.cells as usize;
        let cell = piece.length / f64::from(piece.cells);
        // The cells within the radius along the piece.
        let (first, last) = if piece.length > 0.0 {
            (
                ((low - radius) / cell) as usize,
                (((high + radius) / cell) as usize).saturating_add(1).min(count),
            )
        } else {
            (0, 1)
        };
        let (error, limit) = (run.error as f32, radius as f32);
        for block in first / BLOCK..last.div_ceil(BLOCK) {
            let from = block * BLOCK;
            let to = (from + BLOCK).min(count);
            let (start, end) = (from as f64 * cell, to as f64 * cell);
            let beyond = (low - end).max(start - high).max(0.0);
            let worst = &mut self.blocks[piece.first_block as usize + block];
            // No cell of the block can improve.
            if f64::from(*worst) * f64::from(*worst) <= aside * aside + beyond * beyond {
                continue;
            }
            let cells = &mut self.cells[piece.first_cell as usize..][from..to];
            let near = &mut cells[first.saturating_sub(from)..last.min(to) - from];
            let start = from.max(first) as f64 * cell + if self.sparse { 0.5 * cell } else { 0.0 };
            let mut squares = [0.0; BLOCK + 1];
            for (index, square) in (0..).zip(&mut squares[..=near.len()]) {
                *square = run.square_at(start + f64::from(index) * cell);
            }
            // Plain comparisons, which the compiler vectorizes.
            let ends = if self.sparse { &squares[..] } else { &squares[1..] };
            for ((covered, at_start), at_end) in near.iter_mut().zip(&squares).zip(ends) {
                let square = if at_end > at_start { *at_end } else { *at_start };
                let kept = bound(square as f32, error, limit);
                *covered = if kept < *covered { kept } else { *covered };
            }
            *worst = cells
                .iter()
                .fold(0.0, |largest, covered| if *covered > largest { *covered } else { largest });
        }
    }

    /// Updates the cell beside the common point of two consecutive runs.
    pub(crate) fn joint(&mut self, piece: &Piece, before: &Run, next: &LocalRun, radius: f64) {
        let (along, across) = next.ends[0];
        let middle = along.clamp(0.0, piece.length);
        let joint = (along - middle) * (along - middle) + across * across;
        if joint > radius * radius {
            return;
        }
        let cell = piece.length / f64::from(piece.cells);
        let index = if cell > 0.0 { ((middle / cell) as usize).min(piece.cells as usize - 1) } else { 0 };
        let covered = &mut self.cells[piece.first_cell as usize + index];
        if self.sparse || f64::from(*covered) * f64::from(*covered) <= joint {
            return;
        }
        let before = LocalRun::new(piece, before);
        let (start, end) = (index as f64 * cell, (index + 1) as f64 * cell);
        let square = (before.square_at(start).max(next.square_at(end)))
            .min(next.square_at(start).max(before.square_at(end)))
            .max(joint);
        *covered = covered.min(bound(square as f32, before.error.max(next.error) as f32, radius as f32));
    }

    /// The distances from the drawing to the ink, and for each pen the part farther than `allowed`.
    /// `unknown_mm` is a lower bound for cells that no run came near.
    pub(crate) fn drawing_to_ink(
        &self,
        target: &Target,
        allowed: f64,
        unknown_mm: f64,
    ) -> (DeviationStats, Vec<UncoveredPart>) {
        let mut distances = Histogram::new();
        let (mut max_mm, mut is_lower_bound) = (0.0_f64, false);
        let mut uncovered = Vec::new();
        for strokes in &target.pens {
            let mut part: Option<UncoveredPart> = None;
            let mut uncovered_strokes = Vec::new();
            for piece in &strokes.pieces {
                let cell = piece.length / f64::from(piece.cells);
                let first = piece.first_cell as usize;
                for (index, covered) in self.cells[first..first + piece.cells as usize].iter().enumerate() {
                    let unknown = *covered == f32::INFINITY;
                    let mm = if unknown { unknown_mm } else { f64::from(*covered) };
                    distances.add(mm, cell);
                    max_mm = max_mm.max(mm);
                    is_lower_bound |= unknown;
                    if mm <= allowed {
                        continue;
                    }
                    let stroke = piece.stroke as usize;
                    uncovered_strokes.push(stroke);
                    let part = part.get_or_insert(UncoveredPart {
                        pen: strokes.pen,
                        mm: 0.0,
                        is_lower_bound: false,
                        length: 0.0,
                        strokes: 0,
                        location: Location::default(),
                    });
                    part.length += cell;
                    part.is_lower_bound |= unknown;
                    if mm > part.mm {
                        part.mm = mm;
                        part.location = Location {
                            point_mm: Some(piece.at((index as f64 + 0.5) * cell)),
                            stroke: Some(stroke),
                            source: target.sources.get(stroke).copied(),
                            ..Location::default()
                        };
                    }
                }
                uncovered_strokes.dedup();
            }
            uncovered_strokes.sort_unstable();
            uncovered_strokes.dedup();
            uncovered
                .extend(part.map(|part| UncoveredPart { strokes: uncovered_strokes.len() as u64, ..part }));
        }
        let p99_mm = distances.percentile(0.99, max_mm);
        (
            DeviationStats { max_mm, p99_mm, is_lower_bound, sampling_error_mm: 0.5 * target.sparse_mm },
            uncovered,
        )
    }
}

/// A distance as it is stored: never rounded down; infinite beyond the radius.
///
/// Rounding square and error to `f32`, the root, the sum and the product cost half a unit in the
/// last place (`EPSILON / 2`) each; `4 EPSILON` covers all of them.
fn bound(square: f32, error: f32, radius: f32) -> f32 {
    let mm = (square.sqrt() + error) * (1.0 + 4.0 * f32::EPSILON);
    if mm <= radius { mm } else { f32::INFINITY }
}
