//! Pictures of drawings and of plans on their machine.
//!
//! | module | what |
//! |---|---|
//! | [`svg`] | a drawing as SVG in mm |
//! | [`scene`] | a drawing or a plan on its machine, as SVG |
//! | [`png`] | the same scene in pixels |
//! | [`braille`] | the same scene in characters, for a terminal |
//! | [`animation`] | a plan as it is drawn, as an SVG that moves |

pub mod animation;
pub mod braille;
mod overlay;
mod palette;
pub mod png;
pub mod scene;
pub mod svg;

pub use overlay::{BEYOND, ColoredLine, Key, KeyColors, Label, MachinePose, Overlay};
pub use palette::{Colour, PenColors, ink_color};
pub use scene::{Ink, InkLine, LEVELS, Scene, Shades};
