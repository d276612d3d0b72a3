//! A closed tour in an array, with exchanges of two or three links.

use super::problem::{End, Problem, mate};

/// The largest number of links that a move exchanges.
pub(crate) const MOST_LINKS: usize = 3;

/// The largest number of strokes that an exchange may rewrite. Without a limit the work of an exchange grows
/// with the number of strokes, and that of the search with its square (D. S. Johnson 1997 limits the length
/// of a reversal likewise). An exchange leaves its longest stretch, at least a third of the tour, in
/// place: up to 150,000 strokes nothing is limited.
const MOST_REWRITTEN: usize = 100_000;

/// Strokes in the order they are visited, each given by the end at which it is entered.
pub(crate) struct Tour {
    entries: Vec<End>,
    /// The index of each stroke in `entries`.
    place: Vec<u32>,
    /// Overwritten ranges since the last `commit` (first index and length); contents in `saved`.
    log: Vec<(u32, u32)>,
    saved: Vec<End>,
}

/// A part of the tour between two removed links.
#[derive(Clone, Copy, Default)]
struct Stretch {
    first: usize,
    length: usize,
    forward: bool,
}

/// The stretches of a tour in the order and directions of the new tour.
pub(crate) struct Plan {
    stretches: [Stretch; MOST_LINKS],
    count: usize,
}

impl Plan {
    /// The number of strokes of a tour of `n` that are rewritten: all but the longest stretch.
    fn rewritten(&self, n: usize) -> usize {
        n - self.stretches[..self.count].iter().map(|stretch| stretch.length).max().unwrap_or(0)
    }
}

impl Tour {
    pub(crate) fn new(entries: Vec<End>) -> Self {
        let mut place = vec![0; entries.len()];
        for (at, &entry) in entries.iter().enumerate() {
            place[entry as usize / 2] = at as u32;
        }
        Self { entries, place, log: Vec::new(), saved: Vec::new() }
    }

    pub(crate) fn len(&self) -> usize {
        self.entries.len()
    }

    fn wrap(&self, place: usize) -> usize {
        if place >= self.entries.len() { place - self.entries.len() } else { place }
    }

    /// The index of the stroke after the link at `end`, and whether `end` is the entry of that
    /// stroke.
    fn gap(&self, end: End) -> (usize, bool) {
        let at = self.place[end as usize / 2] as usize;
        if self.entries[at] == end { (at, true) } else { (self.wrap(at + 1), false) }
    }

    /// The ends of the link before the stroke at an index: the end left and the end entered.
    pub(crate) fn link_before(&self, place: usize) -> [End; 2] {
        let before = if place == 0 { self.entries.len() - 1 } else { place - 1 };
        [mate(self.entries[before]), self.entries[place]]
    }

    /// The other end of the link (pen-up move) at `end`, which the search has in a table of its own.
    #[cfg(test)]
    fn link(&self, end: End) -> End {
        let (gap, entered) = self.gap(end);
        let [left, right] = self.link_before(gap);
        if entered { left } else { right }
    }

    /// The tour after replacing the links `(e0,e1), (e2,e3), …` by `(e1,e2), …, (e_last,e0)`;
    /// `None` if the result is not one tour, or if too many strokes would have to be rewritten.
    ///
    /// The removed links, sorted by index, cut the tour into stretches. Following the new links
    /// must visit all stretches (Helsgaun 2009, section 5.1: the cost of the test depends on the
    /// number of links, not of strokes).
    pub(crate) fn reconnect(&self, ends: &[End]) -> Option<Plan> {
        let count = ends.len() / 2;
        // (index in the tour, index in `ends` of the right end of the link), sorted.
        let mut cuts = [(0, 0); MOST_LINKS];
        for link in 0..count {
            let (gap, entered) = self.gap(ends[2 * link]);
            let cut = (gap, 2 * link + usize::from(!entered));
            let mut at = link;
            while at > 0 && cuts[at - 1].0 > gap {
                cuts[at] = cuts[at - 1];
                at -= 1;
            }
            cuts[at] = cut;
        }
        let mut rank = [0; MOST_LINKS];
        for (at, &(_, right)) in cuts[..count].iter().enumerate() {
            rank[right / 2] = at;
        }
        let mut plan = Plan { stretches: [Stretch::default(); MOST_LINKS], count };
        let (mut cut, mut forward) = (0, true);
        for visited in 0..count {
            let after = if cut + 1 == count { 0 } else { cut + 1 };
            let before = if cut == 0 { count - 1 } else { cut - 1 };
            let (low, high) = if forward { (cut, after) } else { (before, cut) };
            let (first, next) = (cuts[low].0, cuts[high].0);
            let length = if next > first { next - first } else { next + self.entries.len() - first };
            plan.stretches[visited] = Stretch { first, length, forward };
            let leaves = if forward { cuts[high].1 ^ 1 } else { cuts[low].1 };
            let enters = if leaves % 2 == 1 { leaves + 1 } else { leaves + 2 * count - 1 } % (2 * count);
            cut = rank[enters / 2];
            forward = cuts[cut].1 == enters;
            if cut == 0 && forward {
                let is_tour = visited + 1 == count;
                return (is_tour && plan.rewritten(self.entries.len()) <= MOST_REWRITTEN).then_some(plan);
            }
        }
        None
    }

    /// Applies a plan. The longest stretch stays in place, in either direction; the others are
    /// rewritten. Returns the number of strokes rewritten.
    pub(crate) fn apply(&mut self, plan: &Plan) -> usize {
        let mut stretches = plan.stretches;
        let stretches = &mut stretches[..plan.count];
        let mut stays = (0..stretches.len()).max_by_key(|&at| stretches[at].length).unwrap_or(0);
        if !stretches[stays].forward {
            stretches.reverse();
            stays = stretches.len() - 1 - stays;
            for stretch in stretches.iter_mut() {
                stretch.forward = !stretch.forward;
            }
        }
        stretches.rotate_left(stays);
        let n = self.entries.len();
        let window = self.wrap(stretches[0].first + stretches[0].length);
        let length = n - stretches[0].length;
        let base = self.saved.len();
        let until_end = length.min(n - window);
        self.saved.extend_from_slice(&self.entries[window..window + until_end]);
        self.saved.extend_from_slice(&self.entries[..length - until_end]);
        self.log.push((window as u32, length as u32));

        let mut to = window;
        for stretch in &stretches[1..] {
            let offset =
                if stretch.first >= window { stretch.first - window } else { stretch.first + n - window };
            let from = base + offset;
            for step in 0..stretch.length {
                let entry = if stretch.forward {
                    self.saved[from + step]
                } else {
                    mate(self.saved[from + stretch.length - 1 - step])
                };
                self.entries[to] = entry;
                self.place[entry as usize / 2] = to as u32;
                to = if to + 1 == n { 0 } else { to + 1 };
            }
        }
        length
    }

    /// Makes the moves since the last `commit` permanent.
    pub(crate) fn commit(&mut self) {
        self.log.clear();
        self.saved.clear();
    }

    /// Undoes all moves since the last `commit`.
    pub(crate) fn undo(&mut self) {
        while let Some((window, length)) = self.log.pop() {
            let base = self.saved.len() - length as usize;
            let mut to = window as usize;
            for at in base..self.saved.len() {
                let entry = self.saved[at];
                self.entries[to] = entry;
                self.place[entry as usize / 2] = to as u32;
                to = if to + 1 == self.entries.len() { 0 } else { to + 1 };
            }
            self.saved.truncate(base);
        }
    }

    /// The tour in the form of [`Problem::canonical`].
    pub(crate) fn finish(mut self) -> Vec<End> {
        Problem::canonical(&mut self.entries);
        self.entries
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// The links of a tour, by end.
    fn links(entries: &[End]) -> Vec<End> {
        let mut links = vec![0; 2 * entries.len()];
        for (at, &entry) in entries.iter().enumerate() {
            let next = entries[(at + 1) % entries.len()];
            links[mate(entry) as usize] = next;
            links[next as usize] = mate(entry);
        }
        links
    }

    /// The number of strokes on the cycle through stroke 0.
    fn circuit(links: &[End]) -> usize {
        let (mut end, mut count) = (0, 0);
        loop {
            end = links[mate(end) as usize];
            count += 1;
            if end == 0 {
                return count;
            }
        }
    }

    #[test]
    fn exchange_rewrites_a_limited_number_of_strokes() {
        let strokes = 3 * MOST_REWRITTEN;
        let tour = Tour::new((0..strokes as End).map(|stroke| 2 * stroke).collect());
        let reversal = |first: usize, length: usize| {
            let ([a, b], [c, d]) = (tour.link_before(first), tour.link_before(first + length));
            tour.reconnect(&[b, a, c, d]).map(|plan| plan.rewritten(strokes))
        };
        assert_eq!(reversal(1000, MOST_REWRITTEN), Some(MOST_REWRITTEN));
        assert_eq!(reversal(1000, MOST_REWRITTEN + 1), None);
        assert_eq!(reversal(10, strokes - 500), Some(500));
    }

    proptest! {
        /// Regression: two stretches of equal length, one of them reversed, were once confused.
        #[test]
        fn exchange_produces_the_requested_links(
            order in Just((0..9).collect::<Vec<End>>()).prop_shuffle(),
            sides in prop::collection::vec(0..2u32, 9),
            cuts in Just((0..9).collect::<Vec<usize>>()).prop_shuffle(),
            swapped in prop::collection::vec(any::<bool>(), 3),
            count in 2..=3usize,
        ) {
            let entries: Vec<End> = order.iter().zip(sides).map(|(stroke, side)| 2 * stroke + side).collect();
            let mut tour = Tour::new(entries.clone());
            let mut ends: Vec<End> = Vec::new();
            for (&cut, swapped) in cuts.iter().zip(swapped).take(count) {
                let [left, right] = tour.link_before(cut);
                ends.extend(if swapped { [right, left] } else { [left, right] });
            }
            let mut expected = links(&entries);
            for link in 0..count {
                let (a, b) = (ends[2 * link + 1], ends[(2 * link + 2) % (2 * count)]);
                expected[a as usize] = b;
                expected[b as usize] = a;
            }
            let plan = tour.reconnect(&ends);
            prop_assert_eq!(plan.is_some(), circuit(&expected) == entries.len());
            if let Some(plan) = plan {
                tour.apply(&plan);
                prop_assert_eq!(links(&tour.entries), expected.clone());
                for end in 0..18 {
                    prop_assert_eq!(tour.link(end), expected[end as usize]);
                }
                tour.undo();
            }
            prop_assert_eq!(&tour.entries, &entries);
        }
    }
}
