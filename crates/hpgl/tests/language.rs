//! Points of the language by HP's manuals: one test a point. docs/hpgl-support.md gives the sources.

mod common;

use common::check;

#[test]
fn open_comment_ends_at_semicolon() {
    // With and without a blank before the quote that is never closed.
    check(b"IN;SP1;CO\"a PD9,9;PD400,0;", &["1: 0,0 400,0"], &["H0112"]);
    check(b"IN;SP1;CO \"a PD9,9;PD400,0;", &["1: 0,0 400,0"], &["H0112"]);
}
