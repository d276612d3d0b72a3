//! Arbitrary answers of a controller: no session panics, sends without end, or says that it is done
//! while lines have not been acknowledged.
#![no_main]

use backends::Outcome;
use libfuzzer_sys::fuzz_target;

#[path = "../../crates/backends/tests/common/mod.rs"]
mod common;

/// The operator asks for a stop at this piece of an answer.
const STOP_BYTE: u8 = 0x1b;
/// The wire comes back.
const RECONNECT_BYTE: u8 = 0x18;

fuzz_target!(|bytes: &[u8]| {
    let [which, bytes @ ..] = bytes else { return };
    let setups = common::backends();
    let setup = setups[usize::from(*which) % setups.len()];
    let program = setup.program(&common::small());
    let mut session = setup.session(program);
    let mut now_us = 0;
    let mut sent = 0;
    for piece in bytes.split_inclusive(|byte| *byte == b'\n') {
        sent += session.transmit(now_us).len();
        match piece[0] {
            STOP_BYTE => session.stop(now_us),
            RECONNECT_BYTE => session.reconnected(now_us),
            _ => session.receive(piece, now_us),
        }
        if session.waiting_for().is_some() {
            session.resume(now_us);
        }
        sent += session.transmit(now_us).len();
        // To the next thing that the session waits for, or a little further for some bytes.
        let wake_us = session.wake_us().unwrap_or(now_us).max(now_us);
        now_us = if piece.len() % 2 == 0 { wake_us } else { now_us + 20_000 };
    }
    let progress = session.progress();
    assert!(progress.lines <= progress.of_lines);
    if session.outcome() == Some(&Outcome::Done) {
        // A session may add lines: xy-serial goes to the middle first.
        assert!(!progress.acknowledged || progress.lines == progress.of_lines, "{progress:?}");
    }
    // A line is sent again after an answer or a time-out, so a bounded number of times for each piece.
    assert!(sent < 100_000 + 20_000 * bytes.len(), "{sent} bytes for {} bytes", bytes.len());
});
