//! An EBB's answers: `OK`, `!N Err: ...`, `QM,C,M1,M2,FIFO` (is it moving) and `A,B` (step counters, for `QS`).

use crate::status::{Answer, StatusProtocol};

/// Positions are steps since the counters were cleared.
#[derive(Clone, Copy, Debug)]
pub(super) struct EbbStatus {
    /// Whether the motors were moving in the last `QM`. True until a report proves the opposite: it may be lost.
    moving: bool,
}

impl Default for EbbStatus {
    fn default() -> Self {
        Self { moving: true }
    }
}

/// Two whole numbers with a comma between.
fn pair(line: &str) -> Option<[i64; 2]> {
    let (a, b) = line.split_once(',')?;
    Some([a.trim().parse().ok()?, b.trim().parse().ok()?])
}

impl StatusProtocol for EbbStatus {
    fn line_end(&self) -> &'static str {
        "\r"
    }

    fn query(&self) -> String {
        "QM\rQS\r".to_owned()
    }

    fn begin_query(&mut self) {
        self.moving = true;
    }

    fn parse(&mut self, line: &str) -> Answer {
        if line.eq_ignore_ascii_case("ok") {
            return Answer::Ack;
        }
        if let Some(state) = line.strip_prefix("QM,") {
            self.moving = state.split(',').any(|word| word != "0");
            return Answer::Other;
        }
        if line.starts_with('!') {
            return Answer::Error(line.to_owned());
        }
        match pair(line) {
            Some(position) => Answer::Status { position, moving: self.moving, holding: false },
            None => Answer::Other,
        }
    }

    fn acknowledges_queries(&self) -> bool {
        true
    }

    fn describe(&self, [a, b]: [i64; 2]) -> String {
        format!("{a}, {b} steps from its start")
    }
}
