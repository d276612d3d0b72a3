//! Pictures of drawings and of plans on their machine.
//!
//! | module | what |
//! |---|---|
//! | [`svg`] | a drawing as SVG in mm |
//! | [`scene`] | a drawing or a plan on its machine, as SVG |
//! | [`png`] | the same scene in pixels |

mod palette;
pub mod png;
pub mod scene;
pub mod svg;

pub use palette::{Colour, PenColors, ink_color};
pub use scene::{Ink, InkLine, LEVELS, Scene, Shades};
