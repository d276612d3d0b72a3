//! Conversations with machines: what to say, when to say it again, and how to stop.
//!
//! Nothing here opens a port or reads a clock: a [`Conversation`] is handed the bytes that have come in and the time in
//! microseconds, gives the bytes that are to go out, and says when it wants to be asked again. So every mishap of a
//! wire can be tried in memory, at any speed, as often as one likes; [`simulate`] does. [`device`] has machines to talk to, which
//! behave as their firmwares do and keep the ink they were told to draw.
//!
//! | module | speaks | resends, because |
//! |---|---|---|
//! | [`numbered`] | tick lines, each with a number and a checksum | a machine drops the numbers that it already had |
//! | [`repeating`] | seed 2's lines | each line says the same if it is said twice, and only one is ever on the way |
//! | [`asking`] | G-code (grbl and its kin), EBB | a machine is asked where it stands, and the place tells what it has done |
//! | [`blind`] | anything | it never does: there are no answers |

pub mod asking;
pub mod blind;
pub mod conversation;
pub mod device;
pub mod ink;
pub mod locating;
pub mod numbered;
pub mod repeating;
mod retime;
pub mod script;
pub mod simulate;

pub use conversation::{Conversation, Outcome, Progress};
pub use ink::Ink;
pub use script::{Dialect, Script, ScriptError, Step};
