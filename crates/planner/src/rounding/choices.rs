//! The choices of a whole plan, kept so that its rows can be generated again without a search.

/// A plan of more rows is searched again: these take 64 MB.
const MOST: u64 = 1 << 26;

/// How far the ticks of each row are from the nearest ones. A choice is at most 1.5 ticks from the exact
/// position, and that at most 0.5 from the nearest ticks: -2 to 2.
#[derive(Clone, Debug, Default)]
pub(crate) struct Choices(Vec<u8>);

impl Choices {
    /// Room for the choices of a plan of this number of rows; `None` if it has too many.
    pub(crate) fn of(rows: u64) -> Option<Self> {
        (rows <= MOST).then(|| Self(Vec::with_capacity(rows as usize)))
    }

    pub(crate) fn push(&mut self, nearest: [i64; 2], chosen: [i64; 2]) {
        let [a, b] = [0, 1].map(|motor| (chosen[motor] - nearest[motor] + 2) as u8);
        debug_assert!(a <= 4 && b <= 4, "a choice is within 2 ticks of the nearest");
        self.0.push(a | b << 4);
    }

    /// The ticks chosen for the row at `index`.
    pub(crate) fn chosen(&self, index: usize, nearest: [i64; 2]) -> [i64; 2] {
        let choice = self.0[index];
        let [a, b] = [choice & 15, choice >> 4].map(|off| i64::from(off) - 2);
        [nearest[0] + a, nearest[1] + b]
    }

    /// Whether there is one for each of this number of rows.
    pub(crate) fn are_complete(&self, rows: u64) -> bool {
        self.0.len() as u64 == rows
    }
}
