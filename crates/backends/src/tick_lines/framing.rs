//! Numbers and checksums of tick lines: `NUMBER:LINE*SUM` to the machine, `ok NUMBER*SUM` back.
//!
//! | to the machine | |
//! |---|---|
//! | `NUMBER:LINE*SUM` | a tick line. Line 0 begins a session and is the first line sent |
//! | `where*SUM` | asks for the motors' positions |
//!
//! | from the machine | |
//! |---|---|
//! | `ok NUMBER*SUM` | every line before that number was accepted; this is the next one expected |
//! | `ok NUMBER room BYTES*SUM` | the same as the answer to line 0; BYTES may be in transit without an answer |
//! | `error NUMBER WHY*SUM` | this line cannot be executed |
//! | `at T1 T2 MOVING*SUM` | motor positions, and whether motion is queued (1) or not (0) |
//! | `at unknown*SUM` | the machine was homed and has received nothing since |

use crate::homing::{HomingStep, HomingSteps, StepAnswer};
use crate::status::{Answer, StatusProtocol};
use crate::transmission::sliding_window::{Framing, Reply};

/// The exclusive or of all bytes, as Marlin's checksum.
fn checksum(bytes: &[u8]) -> u8 {
    bytes.iter().fold(0, |sum, byte| sum ^ byte)
}

/// `TEXT*SUM`.
pub(crate) fn framed(text: &str) -> String {
    format!("{text}*{}", checksum(text.as_bytes()))
}

/// The text of `TEXT*SUM`, or `None` if the checksum is wrong.
pub(crate) fn unframed(line: &str) -> Option<&str> {
    let (text, sum) = line.rsplit_once('*')?;
    (sum.parse() == Ok(checksum(text.as_bytes()))).then_some(text)
}

/// Longest name of a machine that is sent: with it a line stays within 70 bytes.
const LONGEST_NAME: usize = 24;

/// The framing of numbered tick lines.
#[derive(Clone, Debug, Default)]
pub(crate) struct TickLineFraming {
    /// `; machine NAME`, which a `begin` line carries: a firmware that knows its own name refuses the
    /// plan of another machine, and any other reader ignores the comment.
    comment: String,
}

impl TickLineFraming {
    /// For plans of this machine. A name that might disturb a line is not sent.
    pub(crate) fn for_machine(name: &str) -> Self {
        let plain = |byte: u8| byte.is_ascii_alphanumeric() || b"-_.".contains(&byte);
        let sent = !name.is_empty() && name.len() <= LONGEST_NAME && name.bytes().all(plain);
        Self { comment: if sent { format!(" ; machine {name}") } else { String::new() } }
    }
}

impl Framing for TickLineFraming {
    fn frame(&self, number: usize, text: &str) -> String {
        let comment = if text.starts_with("begin ") { &self.comment } else { "" };
        let mut line = framed(&format!("{number}:{text}{comment}"));
        line.push('\n');
        line
    }

    fn parse(&self, line: &str) -> Option<Reply> {
        let mut words = unframed(line)?.splitn(3, ' ');
        let (verb, number) = (words.next()?, words.next()?.parse().ok()?);
        match verb {
            "ok" => {
                let room = words.next().and_then(|rest| rest.strip_prefix("room ")?.parse().ok());
                Some(Reply::Next { number, room })
            }
            "error" => {
                let why = words.next().unwrap_or("no reason given").to_owned();
                Some(Reply::Error { number, why })
            }
            _ => None,
        }
    }
}

/// Position reports of a machine that reads numbered tick lines.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct TickLineStatus;

impl StatusProtocol for TickLineStatus {
    fn line_end(&self) -> &'static str {
        "\n"
    }

    fn query(&self) -> String {
        framed("where") + "\n"
    }

    fn parse(&mut self, line: &str) -> Answer {
        let Some(text) = unframed(line) else { return Answer::Other };
        let words: Vec<&str> = text.split(' ').collect();
        match words[..] {
            ["at", "unknown"] => Answer::PositionUnknown,
            ["at", a, b, moving] => match (a.parse(), b.parse()) {
                (Ok(a), Ok(b)) => Answer::Status { position: [a, b], moving: moving != "0", holding: false },
                _ => Answer::Other,
            },
            _ => Answer::Other,
        }
    }

    fn describe(&self, [a, b]: [i64; 2]) -> String {
        format!("{a}, {b} ticks")
    }
}

/// Homing by `home`, then `where` and `status` until the position is known. `needs_stop`: a move goes to a
/// mechanical stop.
pub(crate) fn homing(needs_stop: bool) -> HomingSteps {
    HomingSteps {
        steps: vec![
            HomingStep { text: framed("home") + "\n", repeats: true, parse: begun },
            HomingStep {
                text: framed("where") + "\n" + &framed("status") + "\n",
                repeats: true,
                parse: if needs_stop { found_stop } else { found_switch },
            },
        ],
        abort: b"stop*115\n",
    }
}

/// Whether homing has begun.
fn begun(line: &str) -> StepAnswer {
    match unframed(line).unwrap_or(line) {
        // The answer to the first `home` was lost.
        "ok" | "error homing" => StepAnswer::Done,
        text => match text.strip_prefix("error ").filter(|why| *why != "moving") {
            Some("no switches") => {
                StepAnswer::Failed("the firmware has no switches or stops to home by".to_owned())
            }
            Some(why) => StepAnswer::Failed(format!("the machine does not home: {why}")),
            // A machine that moves is asked again.
            None => StepAnswer::Other,
        },
    }
}

fn found_switch(line: &str) -> StepAnswer {
    found(line, "a switch did not close on the way to it, or did not open on the way back")
}

fn found_stop(line: &str) -> StepAnswer {
    found(line, "no stop was felt within the travel, or the motor did not come away from it")
}

/// Whether homing has ended; `failure` is what state `home` means.
fn found(line: &str, failure: &str) -> StepAnswer {
    let Some(text) = unframed(line) else { return StepAnswer::Other };
    let words: Vec<&str> = text.split(' ').collect();
    match words[..] {
        ["at", _, _, "0"] => StepAnswer::Done,
        ["status", "home", ..] => StepAnswer::Failed(format!("homing has failed: {failure}")),
        ["status", fault @ ("limit" | "stop" | "follow"), ..] => {
            StepAnswer::Failed(format!("homing was stopped: {fault}"))
        }
        _ => StepAnswer::Other,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn framed_line_matches_documentation() {
        let documentation = include_str!("../../../../docs/sending.md");
        for text in ["12:m 1 10000 804 -4", "ok 1 room 127"] {
            assert!(documentation.contains(&format!("`{}`", framed(text))), "{}", framed(text));
        }
    }

    #[test]
    fn begin_line_names_the_machine() {
        let line = |name: &str, text: &str| TickLineFraming::for_machine(name).frame(0, text);
        let framed_line = |text: &str| framed(text) + "\n";
        assert_eq!(line("coaxial", "begin 1 7 350000"), framed_line("0:begin 1 7 350000 ; machine coaxial"));
        assert_eq!(line("coaxial", "s 0 0 800 0"), framed_line("0:s 0 0 800 0"));
        for name in ["", "two words", "star*", "a-name-of-twenty-five-char"] {
            assert_eq!(line(name, "begin 1 7 350000"), framed_line("0:begin 1 7 350000"), "{name}");
        }
        let longest = line("a-name-of-24-characters-", "begin 1 4294967295 4294967295");
        assert!(longest.len() <= 70, "{} bytes", longest.len());
    }

    #[test]
    fn announced_room_is_parsed() {
        let parsed = |text: &str| TickLineFraming::default().parse(&framed(text));
        assert_eq!(parsed("ok 1 room 127"), Some(Reply::Next { number: 1, room: Some(127) }));
        assert_eq!(parsed("ok 1 room"), Some(Reply::Next { number: 1, room: None }));
        assert_eq!(parsed("ok 1"), Some(Reply::Next { number: 1, room: None }));
    }

    #[test]
    fn single_bit_error_fails_checksum() {
        let line = framed("12:m 1 10000 804 -4");
        for at in 0..line.len() {
            for bit in 0..7 {
                let mut bytes = line.clone().into_bytes();
                bytes[at] ^= 1 << bit;
                let changed = String::from_utf8_lossy(&bytes).into_owned();
                assert_ne!(unframed(&changed), unframed(&line), "{changed}");
            }
        }
    }
}
