//! A conversation and a machine, put together in memory: no port, no clock, time jumps to where something happens.

use crate::conversation::{Conversation, Outcome};
use crate::device::Faulty;

/// What came of it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Ended {
    /// How the conversation ended; nothing if it never did.
    pub outcome: Option<Outcome>,
    /// When, microseconds.
    pub at_us: u64,
}

/// Between two bytes that come in over the wire nothing is faster than this, microseconds.
const WIRE_US: u64 = 200;

/// Lets both talk until the conversation has ended and the machine rests, or `most_us` have gone by. At `stop_us` the
/// conversation is told to stop. Time begins at `from_us`.
pub fn run(
    conversation: &mut dyn Conversation,
    machine: &mut Faulty,
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
            conversation.reconnected(now_us);
        }
        plugged = there;
        if stop_us.is_some_and(|stop_us| now_us >= stop_us) && !stopped {
            stopped = true;
            conversation.stop(now_us);
        }
        let mut talked = false;
        // Whoever watches changes the pen at once.
        if conversation.waits_for_hand() {
            conversation.go_on();
        }
        if plugged {
            let heard = machine.heard(now_us);
            if !heard.is_empty() {
                conversation.receive(&heard, now_us);
            }
            let said = conversation.transmit(now_us);
            if !said.is_empty() {
                // Flow control, where the machine has it, lets through what there is room for.
                machine.receive(&said, now_us);
                talked = true;
            }
        }
        let over = conversation.outcome().is_some();
        let next =
            machine.wake_us(now_us).into_iter().chain(conversation.wake_us().filter(|_| plugged && !over));
        let next = next.chain(stop_us.filter(|stop_us| !stopped && *stop_us > now_us)).min();
        let next_us = match next {
            _ if talked => now_us + WIRE_US,
            Some(next_us) => next_us.max(now_us + WIRE_US),
            None => return Ended { outcome: conversation.outcome().cloned(), at_us: now_us },
        };
        if next_us > from_us + most_us {
            return Ended { outcome: conversation.outcome().cloned(), at_us: now_us };
        }
        now_us = next_us;
    }
}
