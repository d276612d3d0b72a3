//! How much of the search is done.

/// A part of the whole search, between two shares of it.
#[derive(Clone, Copy)]
pub(crate) struct Progress<'a> {
    report: &'a dyn Fn(f64),
    from: f64,
    to: f64,
}

impl<'a> Progress<'a> {
    /// The whole search.
    pub(crate) fn new(report: &'a dyn Fn(f64)) -> Self {
        Self { report, from: 0.0, to: 1.0 }
    }

    /// The part of this one between two shares of it.
    pub(crate) fn part(self, from: f64, to: f64) -> Self {
        let at = |share: f64| self.from + share * (self.to - self.from);
        Self { from: at(from), to: at(to), ..self }
    }

    /// Reports that this share of the part is done.
    pub(crate) fn done(self, share: f64) {
        (self.report)(self.part(0.0, share.min(1.0)).to);
    }
}
