//! `cargo run --release -p plotplan-backends --example fault_injection`: injects faults of each kind in memory and counts how
//! often ink was lost, drawn twice or out of place. The table in docs/sending.md is what it prints.

#![allow(clippy::print_stdout, reason = "it prints a table")]

#[path = "../tests/common/mod.rs"]
mod common;

use backends::{Fault, FaultInjector, Outcome, simulate};
use common::{Random, Setup, backends, drawing, measure};
use plan::TickTable;

/// Runs of each kind and protocol.
const RUNS: u64 = 2000;
const HOUR_US: u64 = 3_600_000_000;

/// A kind of fault: its name, and how to make one for a machine that gives this many answers in this many microseconds.
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
    ("six of these combined", |random, answers, duration_us| {
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
fn holds(setup: Setup, table: &TickTable, faults: Vec<Fault>) -> bool {
    let mut machine = FaultInjector::new(setup.device(), faults);
    let mut session = setup.session(setup.program(table));
    let ended = simulate::run(&mut *session, &mut machine, 0, None, HOUR_US);
    ended.outcome == Some(Outcome::Done) && machine.device().ink().lines() == setup.wanted(table)
}

/// Whether a plan that is stopped at `stop_us` and resumed is drawn as it is and once.
fn holds_if_stopped(setup: Setup, table: &TickTable, stop_us: u64, faults: Vec<Fault>) -> bool {
    let program = setup.program(table);
    let mut machine = FaultInjector::new(setup.device(), faults);
    let mut session = setup.session(program.clone());
    let ended = simulate::run(&mut *session, &mut machine, 0, Some(stop_us), HOUR_US);
    if let Some(Outcome::Stopped { row }) = ended.outcome {
        let Ok(rest) = program.from_row(row, None) else { return false };
        let mut session = setup.session(rest);
        let ended = simulate::run(&mut *session, &mut machine, ended.at_us + 1_000_000, None, HOUR_US);
        if machine.device().pen_is_down() || ended.outcome != Some(Outcome::Done) {
            return false;
        }
    } else if ended.outcome != Some(Outcome::Done) {
        return false;
    }
    machine.device().ink().lines() == setup.wanted(table)
}

fn main() {
    let table = drawing();
    let mut random = Random(20);
    let setups = backends();
    let names: Vec<&str> =
        setups.iter().filter_map(|setup| setup.backend.protocol()).map(|(name, _)| name).collect();
    println!("| fault | {} |\n|---{}|", names.join(" | "), "|---".repeat(names.len()));
    let mut row = |name: &str, of: &mut dyn FnMut(Setup, u64, u64, &mut Random) -> bool| {
        let cells = setups.iter().map(|setup| {
            let (answers, duration_us) = measure(*setup, &table);
            let wrong = (0..RUNS).filter(|_| !of(*setup, answers, duration_us, &mut random)).count();
            format!("{wrong} of {RUNS}")
        });
        println!("| {name} | {} |", cells.collect::<Vec<_>>().join(" | "));
    };
    for (name, kind) in KINDS {
        row(name, &mut |setup, answers, duration_us, random| {
            holds(setup, &table, kind(random, answers, duration_us))
        });
    }
    row("Ctrl-C, then resumed", &mut |setup, _, duration_us, random| {
        holds_if_stopped(setup, &table, random.below(duration_us), Vec::new())
    });
    row("Ctrl-C and an answer lost", &mut |setup, answers, duration_us, random| {
        let faults = vec![Fault::LostAnswer(random.below(answers))];
        holds_if_stopped(setup, &table, random.below(duration_us), faults)
    });
    let cells = setups.iter().map(|setup| {
        if !setup.detects_errors() {
            return "-".to_owned();
        }
        let (lines, _) = measure(*setup, &table);
        let wrong =
            (0..RUNS).filter(|_| !holds(*setup, &table, vec![Fault::GarbledByte(random.below(lines * 25))]));
        format!("{} of {RUNS}", wrong.count())
    });
    println!("| byte garbled on the way to the controller | {} |", cells.collect::<Vec<_>>().join(" | "));
}
