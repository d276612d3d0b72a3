//! Every conversation with every machine and every mishap, in memory: the ink is the plan's, once.

#![allow(clippy::unwrap_used, reason = "plans made here are sound")]

use drawing::Point;
use formats::{Instant, ebb, gcode};
use plan::{Header, Limits, Motor, Row, TickTable};
use sending::asking::Asking;
use sending::device::{Device, Ebb, Fault, Faulty, Grbl, Ticks, XyPlotter};
use sending::numbered::Numbered;
use sending::repeating::Repeating;
use sending::{Conversation, Ink, Outcome, Script, simulate};

/// Where plans start, ticks.
const HOME: [i64; 2] = [800, 0];
const PERIOD_US: u64 = 10_000;
const DROP_US: u64 = 150_000;

fn limits() -> Limits {
    Limits { speed: 4000.0, acceleration: 40_000.0, jerk: None }
}

/// A plan of straight strokes in ticks, each from rest to rest, with travel between them.
fn plan(strokes: &[(u16, &[[i64; 2]])]) -> TickTable {
    let mut rows = vec![Row { t_us: 0, pen: 0, ticks: HOME }];
    let go = |rows: &mut Vec<Row>, to: [i64; 2]| {
        let from = rows.last().unwrap().ticks;
        let far = (to[0] - from[0]).abs().max((to[1] - from[1]).abs()) as f64;
        let seconds = f64::max(1.5 * far / limits().speed, (6.0 * far / limits().acceleration).sqrt());
        let periods = (seconds * 1e6 / PERIOD_US as f64).ceil() as u64;
        for k in 1..=periods {
            let u = k as f64 / periods as f64;
            let s = u * u * (3.0 - 2.0 * u);
            let Row { t_us, pen, .. } = *rows.last().unwrap();
            let ticks = [0, 1].map(|m| from[m] + (s * (to[m] - from[m]) as f64).round() as i64);
            rows.push(Row { t_us: t_us + PERIOD_US, pen, ticks });
        }
    };
    let pen = |rows: &mut Vec<Row>, pen: u16| {
        if rows.len() == 1 {
            let first = rows[0];
            rows.push(Row { t_us: PERIOD_US, ..first });
        }
        let last = rows.last_mut().unwrap();
        last.pen = pen;
        let rest = Row { t_us: last.t_us + DROP_US, ..*last };
        rows.push(rest);
    };
    for (number, points) in strokes {
        go(&mut rows, points[0]);
        pen(&mut rows, *number);
        for point in &points[1..] {
            go(&mut rows, *point);
        }
        pen(&mut rows, 0);
    }
    go(&mut rows, HOME);
    let motor = |name: &str| Motor { name: name.into(), limits: limits() };
    let header = Header {
        machine: "made up".into(),
        motors: [motor("a"), motor("b")],
        placement: [1.0, 0.0, 0.0, 1.0, 0.0, 0.0],
        period_us: PERIOD_US,
        rows: rows.len() as u64,
        duration_us: rows.last().unwrap().t_us,
    };
    TickTable { header, rows }
}

/// A square that ends where it began, a zigzag that meets itself, a dot.
fn drawing() -> TickTable {
    plan(&[
        (1, &[[1000, 200], [1300, 200], [1300, 500], [1000, 500], [1000, 200]]),
        (2, &[[1500, 300], [1600, 450], [1500, 300], [1450, 280], [1500, 300], [1700, 100]]),
        (1, &[[900, 900]]),
        (1, &[[905, 905], [915, 905]]),
    ])
}

/// Motors straight on x and y, 50 ticks a mm, the plan in the middle of seed 2's range.
fn instants(table: &TickTable) -> impl Iterator<Item = Instant> + '_ {
    table.rows.iter().map(|row| {
        let exact = row.ticks.map(|ticks| ticks as f64);
        let at = Point::new(60.0 + exact[0] / 50.0, 60.0 + exact[1] / 50.0);
        Instant { row: *row, exact, joints: [at.x, at.y], at }
    })
}

fn options() -> gcode::Options {
    gcode::Options {
        flavour: gcode::Flavour::Grbl,
        pen: gcode::Pen::Servo { up: 40, down: 90 },
        pen_s: [0.15, 0.15],
        travel_mm_s: 80.0,
        chord_mm: 0.01,
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Protocol {
    Ticks,
    XySerial,
    Gcode,
    Ebb,
}

const ALL: [Protocol; 4] = [Protocol::Ticks, Protocol::XySerial, Protocol::Gcode, Protocol::Ebb];

impl Protocol {
    fn script(self, table: &TickTable) -> Script {
        match self {
            Self::Ticks => Script::ticks(table.clone()),
            Self::XySerial => Script::xy_serial(instants(table)).unwrap(),
            Self::Gcode => Script::gcode(gcode::timed(instants(table), &options(), false)),
            Self::Ebb => Script::ebb(table.clone(), ebb::Moves::Timed, ebb::Pen::Toggle).unwrap(),
        }
    }

    fn converse(self, script: Script) -> Box<dyn Conversation> {
        match self {
            Self::Ticks => Box::new(Numbered::new(script, 8)),
            Self::XySerial => Box::new(Repeating::new(script)),
            Self::Gcode => Box::new(Asking::new(script, 127)),
            Self::Ebb => Box::new(Asking::new(script, 0)),
        }
    }

    fn device(self) -> Box<dyn Device> {
        match self {
            Self::Ticks => Box::new(Ticks::new(Some(HOME))),
            Self::XySerial => Box::new(XyPlotter::new(false, 0.0)),
            Self::Gcode => Box::new(Grbl::new()),
            Self::Ebb => Box::new(Ebb::new()),
        }
    }

    /// The ink that is wanted, in the machine's own units, from the plan's rows alone.
    fn wanted(self, table: &TickTable) -> Vec<(u16, Vec<[f64; 2]>)> {
        let of = |place: &dyn Fn(&Instant) -> [f64; 2], one_pen: bool| {
            let mut ink = Ink::default();
            let all: Vec<Instant> = instants(table).collect();
            for pair in all.windows(2) {
                let pen = if one_pen { pair[0].row.pen.min(1) } else { pair[0].row.pen };
                ink.pen(pen, place(&pair[0]));
                ink.go(place(&pair[1]));
            }
            ink.lines()
        };
        match self {
            Self::Ticks => of(&|i| i.exact, false),
            Self::XySerial => of(&|i| [i.at.x, i.at.y].map(|mm| (mm * 10.0).round() / 10.0), true),
            Self::Gcode => of(&|i| [i.at.x, i.at.y].map(|mm| (mm * 1000.0).round() / 1000.0), true),
            Self::Ebb => of(&|i| [0, 1].map(|m| i.exact[m] - HOME[m] as f64), true),
        }
    }
}

/// Lets it go to its end and gives the ink.
fn run(protocol: Protocol, table: &TickTable, faults: Vec<Fault>) -> Faulty {
    let what = format!("{protocol:?} {faults:?}");
    let mut machine = Faulty::new(protocol.device(), faults);
    let mut conversation = protocol.converse(protocol.script(table));
    let ended = simulate::run(&mut *conversation, &mut machine, 0, None, 3_600_000_000);
    assert_eq!(ended.outcome, Some(Outcome::Done), "{what}: {:?}", conversation.progress());
    // Numbered lines may be said again faster than they are read; the others must never be.
    assert!(protocol == Protocol::Ticks || machine.device().lost_bytes() == 0, "{what}: bytes lost");
    assert!(!machine.device().pen_is_down(), "{what}: the pen stays down");
    let ink = machine.device().ink().lines();
    assert_eq!(ink, protocol.wanted(table), "{what}");
    machine
}

#[test]
fn a_plan_is_drawn_as_it_is() {
    for protocol in ALL {
        run(protocol, &drawing(), Vec::new());
    }
}

/// Numbers that look random and are always the same (Knuth's 64-bit linear congruential generator, upper half).
struct Random(u64);

impl Random {
    fn below(&mut self, n: u64) -> u64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) % n
    }
}

/// How many answers a machine gives to the whole plan, and how long that takes.
fn measure(protocol: Protocol, table: &TickTable) -> (u64, u64) {
    let lines = protocol.script(table).steps.len() as u64;
    let mut machine = Faulty::new(protocol.device(), Vec::new());
    let mut conversation = protocol.converse(protocol.script(table));
    let ended = simulate::run(&mut *conversation, &mut machine, 0, None, 3_600_000_000);
    (lines, ended.at_us)
}

/// A few short strokes: small enough to try every answer.
fn small() -> TickTable {
    plan(&[(1, &[[840, 30], [900, 60], [840, 30]]), (1, &[[830, 40]])])
}

#[test]
fn every_single_answer_may_be_lost_late_or_garbled() {
    let table = small();
    for protocol in ALL {
        let (lines, _) = measure(protocol, &table);
        for number in 0..lines + 4 {
            run(protocol, &table, vec![Fault::LostAnswer(number)]);
            run(protocol, &table, vec![Fault::LateAnswer(number, 700_000)]);
            run(protocol, &table, vec![Fault::LateAnswer(number, 5_300_000)]);
            run(protocol, &table, vec![Fault::GarbledAnswer(number)]);
        }
    }
}

#[test]
fn the_wire_may_go_away_at_any_time() {
    let table = small();
    for protocol in ALL {
        let (_, lasts_us) = measure(protocol, &table);
        for k in 0..150 {
            let at_us = lasts_us * k / 150;
            run(protocol, &table, vec![Fault::Unplugged(at_us, 400_000)]);
            run(protocol, &table, vec![Fault::Unplugged(at_us, 20_000_000)]);
        }
    }
}

#[test]
fn the_machine_may_take_nothing_for_a_while() {
    let table = small();
    for protocol in ALL {
        let (_, lasts_us) = measure(protocol, &table);
        for k in 0..60 {
            let at_us = lasts_us * k / 60;
            run(protocol, &table, vec![Fault::FullBuffer(at_us, 300_000)]);
            // Longer than anybody waits for an answer, but not for so long that it is given up.
            if protocol != Protocol::XySerial {
                run(protocol, &table, vec![Fault::FullBuffer(at_us, 6_000_000)]);
            }
        }
    }
}

#[test]
fn tick_lines_with_a_wrong_bit_are_said_again() {
    let table = small();
    for byte in 0..2000 {
        run(Protocol::Ticks, &table, vec![Fault::GarbledByte(byte)]);
    }
}

/// Stops at `stop_us`, then goes on in a second conversation with the same machine, or with one that was homed since.
fn stop_and_go_on(protocol: Protocol, table: &TickTable, stop_us: u64, faults: Vec<Fault>, homed: bool) {
    let what = format!("{protocol:?} stopped at {stop_us} us, {faults:?}, homed: {homed}");
    let script = protocol.script(table);
    let mut machine = Faulty::new(protocol.device(), faults);
    let mut conversation = protocol.converse(script.clone());
    let ended = simulate::run(&mut *conversation, &mut machine, 0, Some(stop_us), 3_600_000_000);
    let row = match ended.outcome {
        Some(Outcome::Stopped { row }) => row,
        Some(Outcome::Done) => {
            return assert_eq!(machine.device().ink().lines(), protocol.wanted(table), "{what}");
        }
        other => panic!("{what}: {other:?}"),
    };
    assert!(!machine.device().pen_is_down(), "{what}: the pen stays down");
    // As soon as the limits allow: a tenth of a second, what the machine had in its queue, and the lift.
    let left = ended.at_us - stop_us;
    // Seed 2's plotter hears nothing while it homes, and then goes to the middle first; a lost answer has to be waited for.
    assert!(left < 10_000_000, "{what}: stops only after {left} us");
    let standing = match protocol {
        Protocol::Ticks | Protocol::Ebb if homed => Some(HOME),
        _ => None,
    };
    let rest = script.from_row(row, standing).unwrap();
    let mut ink = machine.device().ink().clone();
    let (mut second, from_us) = if homed {
        let device: Box<dyn Device> = match protocol {
            Protocol::XySerial => Box::new(XyPlotter::new(true, 0.0)),
            _ => protocol.device(),
        };
        (Faulty::new(device, Vec::new()), 0)
    } else {
        (machine, ended.at_us + 1_000_000)
    };
    let mut conversation = protocol.converse(rest);
    let ended = simulate::run(&mut *conversation, &mut second, from_us, None, 3_600_000_000);
    assert_eq!(ended.outcome, Some(Outcome::Done), "{what}, gone on with from row {row}");
    if homed {
        ink.append(second.device().ink());
    } else {
        ink = second.device().ink().clone();
    }
    assert_eq!(ink.lines(), protocol.wanted(table), "{what}, gone on with from row {row}");
}

#[test]
fn a_plan_may_be_stopped_and_gone_on_with_at_any_time() {
    let table = drawing();
    for protocol in ALL {
        let (_, lasts_us) = measure(protocol, &table);
        for k in 0..300 {
            stop_and_go_on(protocol, &table, lasts_us * k / 300, Vec::new(), k % 2 == 0);
        }
    }
}

#[test]
fn it_may_be_stopped_in_the_middle_of_a_mishap() {
    let table = drawing();
    let mut random = Random(7);
    for protocol in ALL {
        let (lines, lasts_us) = measure(protocol, &table);
        for k in 0..200 {
            let stop_us = random.below(lasts_us);
            let fault = match k % 4 {
                0 => Fault::LostAnswer(random.below(lines)),
                1 => Fault::LateAnswer(random.below(lines), random.below(1_000_000)),
                2 => Fault::GarbledAnswer(random.below(lines)),
                _ => Fault::Unplugged(stop_us.saturating_sub(random.below(200_000)), 300_000),
            };
            stop_and_go_on(protocol, &table, stop_us, vec![fault], false);
        }
    }
}

#[test]
fn motors_that_stop_and_set_out_anywhere_keep_to_their_limits() {
    let table = drawing();
    for protocol in [Protocol::Ticks, Protocol::Ebb] {
        let script = protocol.script(&table);
        for sent in 2..script.steps.len() {
            let (tail, row) = script.stopping(sent);
            let resumed = script.from_row(row, None).unwrap();
            let within = |rows: &[Row]| {
                for three in rows.windows(3) {
                    for motor in 0..2 {
                        let speed = |a: &Row, b: &Row| {
                            (b.ticks[motor] - a.ticks[motor]) as f64 / ((b.t_us - a.t_us) as f64 * 1e-6)
                        };
                        let seconds = ((three[2].t_us - three[1].t_us).max(three[1].t_us - three[0].t_us))
                            as f64
                            * 1e-6;
                        let change = (speed(&three[1], &three[2]) - speed(&three[0], &three[1])).abs();
                        // Four ticks: three rounded positions at two different distances.
                        let shortest = ((three[2].t_us - three[1].t_us).min(three[1].t_us - three[0].t_us))
                            as f64
                            * 1e-6;
                        let most = limits().acceleration * seconds + 2.0 / shortest;
                        assert!(
                            change <= most * 1.0001,
                            "{protocol:?} {sent}: {change} of {most} at {three:?}"
                        );
                    }
                }
            };
            within(&resumed.table().unwrap().rows);
            if protocol == Protocol::Ticks {
                let mut rows: Vec<Row> = Vec::new();
                let mut t_us = 0;
                for step in
                    script.steps[..sent].iter().chain(&tail).filter(|step| step.text.starts_with("m "))
                {
                    t_us += step.lasts_us;
                    rows.push(Row { t_us, pen: 0, ticks: step.place.unwrap() });
                }
                within(&rows);
                assert!(tail.iter().map(|step| step.lasts_us).sum::<u64>() < 1_000_000);
            }
        }
    }
}

#[test]
fn many_mishaps_in_one_plan() {
    let table = drawing();
    let mut random = Random(6);
    for protocol in ALL {
        let (lines, lasts_us) = measure(protocol, &table);
        for _ in 0..200 {
            let faults = (0..6).map(|_| match random.below(5) {
                0 => Fault::LostAnswer(random.below(lines)),
                1 => Fault::LateAnswer(random.below(lines), random.below(3_000_000)),
                2 => Fault::GarbledAnswer(random.below(lines)),
                3 => Fault::FullBuffer(random.below(lasts_us), random.below(500_000)),
                _ => Fault::Unplugged(random.below(lasts_us), random.below(3_000_000)),
            });
            run(protocol, &table, faults.collect());
        }
    }
}
