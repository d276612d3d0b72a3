//! `cargo run --release -p plotplan-sending --example fault`: how many fault of each kind are tried in memory, and how often ink was
//! lost or drawn twice. The table in docs/sending.md is what it prints.

#![allow(clippy::print_stdout, reason = "it prints a table")]

#[path = "../tests/common/mod.rs"]
mod common;

use backends::device::{Fault, FaultInjector};
use backends::{Outcome, simulate};
use common::{ALL, Protocol, Random, drawing, measure};
use plan::TickTable;

/// Runs of each kind and protocol.
const RUNS: u64 = 2000;

/// A kind of fault: its name, and how to make one for a machine that gives so many answers in so many microseconds.
type Kind = (&'static str, fn(&mut Random, u64, u64) -> Vec<Fault>);

const KINDS: [Kind; 6] = [
    ("answer lost", |random, answers, _| vec![Fault::LostAnswer(random.below(answers))]),
    ("answer late, up to 6 s", |random, answers, _| {
        vec![Fault::LateAnswer(random.below(answers), random.below(6_000_000))]
    }),
    ("answer garbled", |random, answers, _| vec![Fault::GarbledAnswer(random.below(answers))]),
    ("buffer full, up to 1 s", |random, _, duration_us| {
        vec![Fault::FullBuffer(random.below(duration_us), random.below(1_000_000))]
    }),
    ("unplugged, up to 30 s", |random, _, duration_us| {
        vec![Fault::Unplugged(random.below(duration_us), random.below(30_000_000))]
    }),
    ("six of these at once", |random, answers, duration_us| {
        (0..6)
            .map(|_| match random.below(5) {
                0 => Fault::LostAnswer(random.below(answers)),
                1 => Fault::LateAnswer(random.below(answers), random.below(3_000_000)),
                2 => Fault::GarbledAnswer(random.below(answers)),
                3 => Fault::FullBuffer(random.below(duration_us), random.below(500_000)),
                _ => Fault::Unplugged(random.below(duration_us), random.below(3_000_000)),
            })
            .collect()
    }),
];

/// Whether the plan is drawn to its end, as it is and once.
fn holds(protocol: Protocol, table: &TickTable, faults: Vec<Fault>) -> bool {
    let mut machine = FaultInjector::new(protocol.device(), faults);
    let mut session = protocol.session(protocol.script(table));
    let ended = simulate::run(&mut *session, &mut machine, 0, None, 3_600_000_000);
    ended.outcome == Some(Outcome::Done) && machine.device().ink().lines() == protocol.wanted(table)
}

/// Whether a plan that is stopped at `stop_us` and gone on with is drawn as it is and once.
fn holds_if_stopped(protocol: Protocol, table: &TickTable, stop_us: u64, faults: Vec<Fault>) -> bool {
    let script = protocol.script(table);
    let mut machine = FaultInjector::new(protocol.device(), faults);
    let mut session = protocol.session(script.clone());
    let ended = simulate::run(&mut *session, &mut machine, 0, Some(stop_us), 3_600_000_000);
    if let Some(Outcome::Stopped { row }) = ended.outcome {
        let Ok(rest) = script.from_row(row, None) else { return false };
        let mut session = protocol.session(rest);
        let from_us = ended.at_us + 1_000_000;
        let ended = simulate::run(&mut *session, &mut machine, from_us, None, 3_600_000_000);
        if machine.device().pen_is_down() || ended.outcome != Some(Outcome::Done) {
            return false;
        }
    } else if ended.outcome != Some(Outcome::Done) {
        return false;
    }
    machine.device().ink().lines() == protocol.wanted(table)
}

fn main() {
    let table = drawing();
    let mut random = Random(20);
    println!("| fault | ticks | xy-serial | gcode | ebb |\n|---|---|---|---|---|");
    let mut row = |name: &str, of: &mut dyn FnMut(Protocol, u64, u64, &mut Random) -> bool| {
        let cells = ALL.map(|protocol| {
            let (answers, duration_us) = measure(protocol, &table);
            let wrong = (0..RUNS).filter(|_| !of(protocol, answers, duration_us, &mut random)).count();
            format!("{wrong} of {RUNS}")
        });
        println!("| {name} | {} |", cells.join(" | "));
    };
    for (name, kind) in KINDS {
        row(name, &mut |protocol, answers, duration_us, random| {
            holds(protocol, &table, kind(random, answers, duration_us))
        });
    }
    row("Ctrl-C, gone on with", &mut |protocol, _, duration_us, random| {
        holds_if_stopped(protocol, &table, random.below(duration_us), Vec::new())
    });
    row("Ctrl-C and an answer lost", &mut |protocol, answers, duration_us, random| {
        let faults = vec![Fault::LostAnswer(random.below(answers))];
        holds_if_stopped(protocol, &table, random.below(duration_us), faults)
    });
    let mut garbled = |protocol: Protocol| {
        let wrong = (0..RUNS).filter(|_| {
            let (lines, _) = measure(protocol, &table);
            !holds(protocol, &table, vec![Fault::GarbledByte(random.below(lines * 25))])
        });
        wrong.count()
    };
    println!(
        "| byte garbled on its way to the machine | {} of {RUNS} | - | - | - |",
        garbled(Protocol::Ticks)
    );
}
