//! Plotter units in millimetres, and limits of coordinates.

/// Size of the plotter unit of HP-GL/2 and most HP-GL plotters, mm: 40 units a millimetre, 1016 an
/// inch, exactly.
pub const PLOTTER_UNIT_MM: f64 = 0.025;

/// Size of the plotter unit of the HP 7475A, mm: 1021 units an inch as measured on the machine.
pub const PLOTTER_UNIT_7475A_MM: f64 = 0.024_88;

/// Coordinates beyond this many plotter units (25 km) are taken for damage, never for a drawing.
pub(crate) const SANE_PLU: f64 = 1e9;

/// Largest number that HP-GL/2 allows in a parameter: -2^30 to 2^30 - 1.
pub(crate) const LARGEST_NUMBER: f64 = 1_073_741_824.0;
