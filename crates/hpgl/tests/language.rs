//! Points of the language by HP's manuals: one test a point. docs/hpgl-support.md gives the sources.

mod common;

use common::check;

#[test]
fn open_comment_ends_at_semicolon() {
    // With and without a blank before the quote that is never closed.
    check(b"IN;SP1;CO\"a PD9,9;PD400,0;", &["1: 0,0 400,0"], &["H0112"]);
    check(b"IN;SP1;CO \"a PD9,9;PD400,0;", &["1: 0,0 400,0"], &["H0112"]);
}

#[test]
fn vendor_commands_are_skipped_whole() {
    // Roland's and engravers' own commands: `!RO90` must not turn, `!DR` is no label direction.
    check(
        b"!DR 0;\nIN;SP1;PU0,0;PD1000,0;PU;!RO90;PU0,500;PD1000,500;PU;",
        &["1: 0,0 1000,0", "1: 0,500 1000,500"],
        &["H0120"],
    );
    check(b"IN;SP1;!PZ-20,40;!mc1PD400,0;", &["1: 0,0 400,0"], &["H0120"]);
    // A stray `!` before a file is no command.
    check(b"!IN;SP1;PD400,0;", &["1: 0,0 400,0"], &["H0102"]);
}
