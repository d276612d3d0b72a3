//! Bounds on work and memory for damaged or hostile files. A file of 20 MB stays below all of them
//! unless it multiplies itself.

/// Bytes of text after decompression.
pub(crate) const TEXT_BYTES: usize = 256 << 20;
/// Bytes that entities may expand to.
pub(crate) const ENTITY_BYTES: u64 = 64 << 20;
/// Elements inside each other, with `use` and markers counted as elements.
pub(crate) const DEPTH: usize = 200;
/// Attributes of one element: their names are compared with each other.
pub(crate) const ATTRIBUTES: usize = 2000;
/// Namespace declarations, each counted once for every element below that declares another.
pub(crate) const NAMESPACES: u64 = 20_000_000;
/// Elements drawn, with every instance of `use`, markers and clip paths counted.
pub(crate) const ELEMENTS: u64 = 3_000_000;
/// Bytes of attributes read, with every instance counted.
pub(crate) const ATTRIBUTE_BYTES: u64 = 400_000_000;
/// Pieces (lines, arcs, cubics) of the result.
pub(crate) const PIECES: u64 = 10_000_000;
/// Steps of matching selectors.
pub(crate) const SELECTOR_STEPS: u64 = 20_000_000;
/// Bytes of one selector.
pub(crate) const SELECTOR_BYTES: usize = 400;
/// At-rules inside each other.
pub(crate) const AT_RULES: usize = 20;
/// Dashes of the whole drawing.
pub(crate) const DASHES: u64 = 2_000_000;
/// Crossings of hatch lines with outlines.
pub(crate) const HATCH_CROSSINGS: u64 = 5_000_000;
/// Edges of clip paths built.
pub(crate) const CLIP_EDGES: u64 = 2_000_000;
/// Pairs of pieces and clip edges looked at; a pair of curves that come close counts a thousand
/// times.
pub(crate) const CLIP_PAIRS: u64 = 150_000_000;
/// Largest distance from the page's origin, mm.
pub(crate) const COORDINATE_MM: f64 = 25e6;
/// Different findings kept.
pub(crate) const FINDINGS: usize = 200;
