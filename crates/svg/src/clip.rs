//! Clip paths: strokes are cut where they cross the clip's outline, and stay lines, arcs and
//! cubics.

use std::rc::Rc;

use drawing::{FillRule, Point, Rect, Segment, Vec2};

use crate::meet;
use crate::path::Subpath;

/// Ink on the outline itself stays: half of its line would be visible. So close to the outline
/// counts as on it, mm.
const ON_EDGE_MM: f64 = 1e-7;
/// Pieces shorter than this are rounding errors of crossings, mm.
const SHORTEST_MM: f64 = 1e-9;

/// A region: inside any of its areas and inside all of `within`.
#[derive(Clone, Debug)]
pub(crate) struct Region {
    areas: Vec<Area>,
    within: Option<Rc<Region>>,
    /// Lowest and highest y of all areas.
    heights: (f64, f64),
    /// Areas by bands of y, so that few of many are looked at.
    bands: Vec<Vec<u32>>,
}

/// The inside of closed outlines, clipped itself where `within` is given.
#[derive(Clone, Debug)]
pub(crate) struct Area {
    rule: FillRule,
    edges: Vec<Edge>,
    bounds: Rect,
    /// Edges by bands of y, so that few of many are looked at.
    bands: Vec<Vec<u32>>,
    pub(crate) within: Option<Rc<Region>>,
}

/// A piece of the outline that only rises or only falls.
#[derive(Clone, Debug)]
struct Edge {
    segment: Segment,
    bounds: Rect,
    from_y: f64,
    to_y: f64,
}

/// Bands of a region, at most.
const MOST_BANDS: usize = 1024;

impl Area {
    /// The inside of subpaths (mm), each closed by a line if it is open; `None` if they have no
    /// extent.
    pub(crate) fn new(subpaths: &[Subpath], rule: FillRule) -> Option<Self> {
        let mut edges: Vec<Edge> = Vec::new();
        for subpath in subpaths {
            let first = edges.len();
            let closing = subpath.segments.last().map(Segment::end).filter(|end| *end != subpath.start);
            let closing = closing.map(|end| Segment::Line(drawing::Line::new(end, subpath.start)));
            for segment in subpath.segments.iter().chain(closing.as_ref()) {
                for piece in meet::monotone(segment) {
                    // Edges share their ends exactly, so that no ray slips between two of them.
                    let from_y = edges[first..].last().map_or(subpath.start.y, |edge| edge.to_y);
                    let to_y = piece.end().y;
                    edges.push(Edge { segment: piece, bounds: piece.bounding_box(), from_y, to_y });
                }
            }
            if let Some(last) = edges[first..].last_mut() {
                last.to_y = subpath.start.y;
            }
        }
        let bounds = edges.iter().map(|edge| edge.bounds).reduce(|bounds, other| bounds.union(other))?;
        // So many bands that an edge lies in four of them on average.
        let heights: f64 = edges.iter().map(|edge| edge.bounds.height()).sum();
        let most = 4.0 * edges.len() as f64 * bounds.height() / heights;
        let count = most.min(edges.len() as f64).clamp(1.0, 4096.0) as usize;
        let mut area = Self { rule, edges, bounds, bands: vec![Vec::new(); count], within: None };
        for index in 0..area.edges.len() {
            let bounds = area.edges[index].bounds;
            for band in area.bands_of(bounds.y0, bounds.y1) {
                area.bands[band].push(index as u32);
            }
        }
        Some(area)
    }

    /// The band of a height. `more` bands are added, against rounding at the border of two bands.
    fn band(&self, y: f64, more: f64) -> usize {
        let count = self.bands.len() as f64;
        let scale = count / self.bounds.height().max(1e-12);
        ((y - self.bounds.y0) * scale + more).clamp(0.0, count - 1.0) as usize
    }

    fn bands_of(&self, low: f64, high: f64) -> std::ops::RangeInclusive<usize> {
        self.band(low, -0.01)..=self.band(high, 0.01)
    }

    /// Winding number (or crossings, by even-odd) of a ray to the right.
    fn contains(&self, p: Point, work: &mut u64) -> bool {
        let bounds = self.bounds;
        if p.x < bounds.x0 || p.x > bounds.x1 || p.y < bounds.y0 || p.y > bounds.y1 {
            return false;
        }
        let mut winding = 0;
        let band = &self.bands[self.band(p.y, 0.0)];
        *work = work.saturating_sub(band.len() as u64);
        if *work == 0 {
            return false;
        }
        for &index in band {
            let edge = &self.edges[index as usize];
            let rises = edge.from_y <= p.y && p.y < edge.to_y;
            let falls = edge.to_y <= p.y && p.y < edge.from_y;
            if (rises || falls) && edge.x_at(p) > p.x {
                winding += if self.rule == FillRule::EvenOdd || rises { 1 } else { -1 };
            }
        }
        self.rule.is_inside(winding)
    }
}

impl Edge {
    /// Where the edge has the height of `p`; any point to the same side of `p` will do.
    fn x_at(&self, p: Point) -> f64 {
        if p.x < self.bounds.x0 || p.x > self.bounds.x1 {
            return self.bounds.x0;
        }
        if let Segment::Line(line) = &self.segment {
            let t = (p.y - line.p0.y) / (line.p1.y - line.p0.y);
            return line.p0.x + t.clamp(0.0, 1.0) * (line.p1.x - line.p0.x);
        }
        let rises = self.to_y > self.from_y;
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if (self.segment.eval(middle).y < p.y) == rises { low = middle } else { high = middle }
        }
        self.segment.eval(0.5 * (low + high)).x
    }
}

impl Region {
    pub(crate) fn new(areas: Vec<Area>, within: Option<Rc<Self>>) -> Self {
        let low = areas.iter().map(|area| area.bounds.y0).fold(f64::INFINITY, f64::min);
        let high = areas.iter().map(|area| area.bounds.y1).fold(f64::NEG_INFINITY, f64::max);
        let bands = vec![Vec::new(); areas.len().clamp(1, MOST_BANDS)];
        let mut region = Self { areas, within, heights: (low, high), bands };
        for (index, area) in region.areas.iter().enumerate() {
            let [first, last] = [area.bounds.y0, area.bounds.y1].map(|y| region.band(y));
            for band in &mut region.bands[first..=last] {
                band.push(index as u32);
            }
        }
        region
    }

    /// The band of a height; the nearest one for heights beyond all areas.
    fn band(&self, y: f64) -> usize {
        let count = self.bands.len() as f64;
        let share = (y - self.heights.0) / (self.heights.1 - self.heights.0).max(1e-12);
        (share * count).clamp(0.0, count - 1.0) as usize
    }

    fn contains(&self, p: Point, work: &mut u64) -> bool {
        if self.within.as_ref().is_some_and(|region| !region.contains(p, work)) {
            return false;
        }
        self.bands[self.band(p.y)].iter().any(|&index| {
            *work = work.saturating_sub(1);
            let area = &self.areas[index as usize];
            *work > 0
                && area.contains(p, work)
                && area.within.as_ref().is_none_or(|region| region.contains(p, work))
        })
    }

    /// All crossings of a piece with the region's outlines.
    fn crossings(&self, piece: &Segment, bounds: Rect, cuts: &mut Vec<f64>, work: &mut u64) {
        let reach = bounds.inflate(ON_EDGE_MM, ON_EDGE_MM);
        let range = self.band(reach.y0)..=self.band(reach.y1);
        let visited = self.bands.get(range.clone()).unwrap_or_default().iter().enumerate();
        for (band, index) in visited.flat_map(|(band, all)| all.iter().map(move |&index| (band, index))) {
            let area = &self.areas[index as usize];
            *work = work.saturating_sub(1);
            if *work == 0 {
                return;
            }
            // An area is looked at in the first of its bands.
            let is_first = self.band(area.bounds.y0).max(*range.start()) == range.start() + band;
            if !is_first || !overlap(reach, area.bounds) {
                continue;
            }
            let bands = &area.bands[area.bands_of(bounds.y0, bounds.y1)];
            let mut meet = |edge: &Edge| {
                *work = work.saturating_sub(1);
                if *work > 0 && overlap(reach, edge.bounds) {
                    *work = work.saturating_sub(meet::crossings(piece, &edge.segment, cuts));
                }
            };
            // An edge may lie in many bands: all edges once may be fewer.
            if bands.iter().map(Vec::len).sum::<usize>() < area.edges.len() {
                bands.iter().flatten().for_each(|&index| meet(&area.edges[index as usize]));
            } else {
                area.edges.iter().for_each(meet);
            }
            if let Some(region) = &area.within {
                region.crossings(piece, bounds, cuts, work);
            }
        }
        if let Some(region) = &self.within {
            region.crossings(piece, bounds, cuts, work);
        }
    }

    /// The parts of a piece inside the region, in order, as ranges of its parameter. Every pair
    /// looked at takes one from `work`; without any left, crossings are missed.
    pub(crate) fn inside(&self, piece: &Segment, work: &mut u64) -> Vec<(f64, f64)> {
        let mut cuts = vec![0.0, 1.0];
        self.crossings(piece, piece.bounding_box(), &mut cuts, work);
        cuts.sort_unstable_by(f64::total_cmp);
        let mut parts: Vec<(f64, f64)> = Vec::new();
        let mut from = 0.0;
        for &to in &cuts[1..] {
            let (middle, derivative) = (0.5 * (from + to), piece.derivatives(0.5 * (from + to)).0);
            if (to - from) * derivative.hypot2().sqrt() < SHORTEST_MM && to < 1.0 {
                continue;
            }
            if self.contains_nearly(piece.eval(middle), derivative, work) {
                match parts.last_mut() {
                    Some(last) if last.1 == from => last.1 = to,
                    _ => parts.push((from, to)),
                }
            }
            from = to;
        }
        parts.retain(|&(from, to)| {
            (to - from) * piece.derivatives(0.5 * (from + to)).0.hypot2().sqrt() >= SHORTEST_MM
        });
        parts
    }

    /// Whether a point of a piece, or one of its neighbours across the piece, is inside.
    fn contains_nearly(&self, p: Point, along: Vec2, work: &mut u64) -> bool {
        let length = along.hypot2().sqrt();
        let is_inside = self.contains(p, work);
        if is_inside || length == 0.0 {
            return is_inside;
        }
        let across = ON_EDGE_MM / length * Vec2::new(-along.y, along.x);
        self.contains(p + across, work) || self.contains(p - across, work)
    }

    /// Whether a dot is inside.
    pub(crate) fn has(&self, p: Point, work: &mut u64) -> bool {
        self.contains(p, work)
    }
}

fn overlap(a: Rect, b: Rect) -> bool {
    a.x0 <= b.x1 && b.x0 <= a.x1 && a.y0 <= b.y1 && b.y0 <= a.y1
}
