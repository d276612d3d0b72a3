//! grbl's answers: `ok`, `error:N`, `ALARM:N`, and reports such as `<Idle|MPos:1.000,2.000,0.000|...>`.

use crate::status::{Answer, StatusProtocol};

/// grbl reports positions in whole steps: half a step of deviation, micrometres. 25 steps/mm are the coarsest axis for
/// which this holds.
pub(super) const POSITION_TOLERANCE_UM: u64 = 20;

/// Positions are work coordinates in micrometres.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct GrblStatus {
    /// Offset of the work coordinates, micrometres. Only some reports contain it.
    offset_um: [i64; 2],
}

impl GrblStatus {
    /// Position in work coordinates, and the state, of a report.
    fn report<'a>(&mut self, line: &'a str) -> Option<([i64; 2], &'a str)> {
        let mut words = line.strip_prefix('<')?.strip_suffix('>')?.split('|');
        let state = words.next()?;
        let (mut machine, mut work) = (None, None);
        for word in words {
            if let Some(at) = word.strip_prefix("WCO:").and_then(micrometres) {
                self.offset_um = at;
            } else if let Some(at) = word.strip_prefix("MPos:").and_then(micrometres) {
                machine = Some(at);
            } else if let Some(at) = word.strip_prefix("WPos:").and_then(micrometres) {
                work = Some(at);
            }
        }
        let offset = self.offset_um;
        let position = work.or(machine.map(|at| [0, 1].map(|axis| at[axis] - offset[axis])))?;
        Some((position, state))
    }
}

/// x and y of `X,Y,Z` in mm.
fn micrometres(text: &str) -> Option<[i64; 2]> {
    let mut words = text.split(',').map(|word| word.parse::<f64>().ok().filter(|mm| mm.abs() < 1e9));
    let mut next = || Some((words.next()?? * 1000.0).round() as i64);
    Some([next()?, next()?])
}

impl StatusProtocol for GrblStatus {
    fn line_end(&self) -> &'static str {
        "\n"
    }

    fn query(&self) -> String {
        "?".to_owned()
    }

    fn ends_partial_line(&self) -> bool {
        // `?` is understood at any time.
        false
    }

    fn parse(&mut self, line: &str) -> Answer {
        if line.eq_ignore_ascii_case("ok") {
            return Answer::Ack;
        }
        if line.starts_with("error") {
            return Answer::Error(line.to_owned());
        }
        if line.starts_with("ALARM") || line.starts_with("<Alarm") {
            let what = format!("the machine is in alarm (`{line}`): home it or unlock it first");
            return Answer::Alarm(what);
        }
        let Some((position, state)) = self.report(line) else { return Answer::Other };
        Answer::Status { position, moving: state != "Idle", holding: state.starts_with("Hold") }
    }

    fn position_tolerance(&self) -> u64 {
        POSITION_TOLERANCE_UM
    }

    fn reports_at_rest(&self) -> u32 {
        // grbl may be idle for a moment between two lines.
        2
    }

    fn is_pause(&self, text: &str) -> bool {
        text.starts_with(super::program::PAUSE)
    }

    fn cycle_start(&self) -> &'static str {
        "~"
    }

    fn describe(&self, [x, y]: [i64; 2]) -> String {
        format!("{}, {} mm", super::millimetres(x), super::millimetres(y))
    }
}
