//! A session and an emulated machine connected in memory: no port, no clock, time jumps to the next event.

use crate::fault_injection::FaultInjector;
use crate::session::{Outcome, Session};

/// The result.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Ended {
    /// How the session ended; `None` if it never did.
    pub outcome: Option<Outcome>,
    /// When, microseconds.
    pub at_us: u64,
}

/// The shortest time between two events on the wire, microseconds.
const WIRE_US: u64 = 200;

/// Runs both until the session has ended and the machine is at rest, or `most_us` have passed. At `stop_us` the session is
/// asked to stop. Time begins at `from_us`.
pub fn run(
    session: &mut dyn Session,
    machine: &mut FaultInjector,
    from_us: u64,
    stop_us: Option<u64>,
    most_us: u64,
) -> Ended {
    let mut now_us = from_us;
    let mut plugged = true;
    let mut stopped = false;
    loop {
        machine.advance(now_us);
        let there = machine.plugged(now_us);
        if there && !plugged {
            session.reconnected(now_us);
        }
        plugged = there;
        if stop_us.is_some_and(|stop_us| now_us >= stop_us) && !stopped {
            stopped = true;
            session.stop(now_us);
        }
        let mut sent_any = false;
        // The operator changes the pen at once.
        if session.waiting_for().is_some() {
            session.resume(now_us);
        }
        if plugged {
            let received = machine.heard(now_us);
            if !received.is_empty() {
                session.receive(&received, now_us);
            }
            let sent = session.transmit(now_us);
            if !sent.is_empty() {
                // Flow control, where the machine has it, lets through what there is room for.
                machine.receive(&sent, now_us);
                sent_any = true;
            }
        }
        let over = session.outcome().is_some();
        let next = machine.wake_us(now_us).into_iter().chain(session.wake_us().filter(|_| plugged && !over));
        let next = next.chain(stop_us.filter(|stop_us| !stopped && *stop_us > now_us)).min();
        let next_us = match next {
            _ if sent_any => now_us + WIRE_US,
            Some(next_us) => next_us.max(now_us + WIRE_US),
            None => return Ended { outcome: session.outcome().cloned(), at_us: now_us },
        };
        if next_us > from_us + most_us {
            return Ended { outcome: session.outcome().cloned(), at_us: now_us };
        }
        now_us = next_us;
    }
}
