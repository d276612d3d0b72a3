//! The compiler from pen-plotter drawings to motor motion, as a library.
//!
//! [`import`] reads drawings of every recognized format, [`machine_file`] reads machines,
//! [`pipeline`] takes a drawing to a certified plan, [`report`] describes the result. Nothing here
//! knows a command line, a terminal, a port or a clock, so it also builds for
//! `wasm32-unknown-unknown`. The binary `plotplan` is a thin layer on top.

pub mod import;
pub mod machine_file;
pub mod paper;
pub mod pipeline;
pub mod quantity;
pub mod replay;
pub mod report;
mod same_ink;
pub mod scene;
pub mod settings;
