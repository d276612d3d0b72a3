//! Every session with every machine and every fault, in memory: the ink is the plan's, once.

#![allow(clippy::unwrap_used, reason = "plans made here are sound")]

mod common;

use backends::device::{Device, Ebb, Fault, FaultInjector, XyPlotter};
use backends::ebb;
use backends::{Dialect, Outcome, Script, simulate};
use common::{ALL, HOME, Protocol, Random, drawing, limits, measure, small};
use plan::{Row, TickTable};
use proptest::prelude::*;

/// Lets it go to its end and gives the ink.
fn run(protocol: Protocol, table: &TickTable, faults: Vec<Fault>) -> FaultInjector {
    let what = format!("{protocol:?} {faults:?}");
    let mut machine = FaultInjector::new(protocol.device(), faults);
    let mut session = protocol.session(protocol.script(table));
    let ended = simulate::run(&mut *session, &mut machine, 0, None, 3_600_000_000);
    assert_eq!(ended.outcome, Some(Outcome::Done), "{what}: {:?}", session.progress());
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
        let (_, duration_us) = measure(protocol, &table);
        for k in 0..150 {
            let at_us = duration_us * k / 150;
            run(protocol, &table, vec![Fault::Unplugged(at_us, 400_000)]);
            run(protocol, &table, vec![Fault::Unplugged(at_us, 20_000_000)]);
        }
    }
}

#[test]
fn the_machine_may_take_nothing_for_a_while() {
    let table = small();
    for protocol in ALL {
        let (_, duration_us) = measure(protocol, &table);
        for k in 0..60 {
            let at_us = duration_us * k / 60;
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

/// Stops at `stop_us`, then goes on in a second session with the same machine, or with one that was homed since.
fn stop_and_go_on(protocol: Protocol, table: &TickTable, stop_us: u64, faults: Vec<Fault>, homed: bool) {
    let what = format!("{protocol:?} stopped at {stop_us} us, {faults:?}, homed: {homed}");
    let script = protocol.script(table);
    let mut machine = FaultInjector::new(protocol.device(), faults);
    let mut session = protocol.session(script.clone());
    let ended = simulate::run(&mut *session, &mut machine, 0, Some(stop_us), 3_600_000_000);
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
        (FaultInjector::new(device, Vec::new()), 0)
    } else {
        (machine, ended.at_us + 1_000_000)
    };
    let mut session = protocol.session(rest);
    let ended = simulate::run(&mut *session, &mut second, from_us, None, 3_600_000_000);
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
        let (_, duration_us) = measure(protocol, &table);
        for k in 0..300 {
            stop_and_go_on(protocol, &table, duration_us * k / 300, Vec::new(), k % 2 == 0);
        }
    }
}

#[test]
fn it_may_be_stopped_in_the_middle_of_a_fault() {
    let table = drawing();
    let mut random = Random(7);
    for protocol in ALL {
        let (lines, duration_us) = measure(protocol, &table);
        for k in 0..200 {
            let stop_us = random.below(duration_us);
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
            let (tail, row) = script.stopping(&script.steps[..sent]);
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
                    t_us += step.duration_us;
                    rows.push(Row { t_us, pen: 0, ticks: step.place.unwrap() });
                }
                within(&rows);
                assert!(tail.iter().map(|step| step.duration_us).sum::<u64>() < 1_000_000);
            }
        }
    }
}

#[test]
fn many_fault_in_one_plan() {
    let table = drawing();
    let mut random = Random(6);
    for protocol in ALL {
        let (lines, duration_us) = measure(protocol, &table);
        for _ in 0..200 {
            let faults = (0..6).map(|_| match random.below(5) {
                0 => Fault::LostAnswer(random.below(lines)),
                1 => Fault::LateAnswer(random.below(lines), random.below(3_000_000)),
                2 => Fault::GarbledAnswer(random.below(lines)),
                3 => Fault::FullBuffer(random.below(duration_us), random.below(500_000)),
                _ => Fault::Unplugged(random.below(duration_us), random.below(3_000_000)),
            });
            run(protocol, &table, faults.collect());
        }
    }
}

#[test]
fn a_machine_that_cannot_follow_lifts_its_pen() {
    // Lines are missing in the middle of a stroke: the reader's counts no longer agree at its end.
    let mut script = Protocol::Ticks.script(&drawing());
    let sync = script.steps.iter().skip(2).position(|step| step.text.starts_with("s ")).unwrap() + 2;
    script.steps.remove(sync - 10);
    let mut machine = FaultInjector::new(Protocol::Ticks.device(), Vec::new());
    let mut session = Protocol::Ticks.session(script);
    let ended = simulate::run(&mut *session, &mut machine, 0, None, 3_600_000_000);
    let Some(Outcome::Failed { why, .. }) = ended.outcome else { panic!("{:?}", ended.outcome) };
    assert!(why.contains("lines are missing or doubled"), "{why}");
    assert!(!machine.device().pen_is_down(), "the pen stays down");
}

#[test]
fn the_single_belt_plotters_own_program_cuts_corners_by_a_millimetre() {
    let table = drawing();
    // It takes a place for reached from within 1 mm in both directions.
    let mut machine = FaultInjector::new(Box::new(XyPlotter::new(true, 1.0)), Vec::new());
    let mut session = Protocol::XySerial.session(Protocol::XySerial.script(&table));
    let ended = simulate::run(&mut *session, &mut machine, 0, None, 3_600_000_000);
    assert_eq!(ended.outcome, Some(Outcome::Done));
    let (drawn, wanted) = (machine.device().ink().lines(), Protocol::XySerial.wanted(&table));
    assert_eq!(drawn.len(), wanted.len());
    let farthest = |lines: &[(u16, Vec<[f64; 2]>)], from: &[(u16, Vec<[f64; 2]>)]| {
        let points = |lines: &[(u16, Vec<[f64; 2]>)]| {
            lines.iter().flat_map(|(_, line)| line.clone()).collect::<Vec<_>>()
        };
        let from = points(from);
        let nearest = |p: [f64; 2]| {
            from.iter().map(|q| (p[0] - q[0]).abs().max((p[1] - q[1]).abs())).fold(f64::INFINITY, f64::min)
        };
        points(lines).into_iter().map(nearest).fold(0.0, f64::max)
    };
    let off = farthest(&wanted, &drawn);
    assert!(off > 0.1 && off <= 1.0, "{off} mm");
}

proptest! {
    #[test]
    fn an_ebb_makes_exactly_the_steps_of_any_plan(
        moves in proptest::collection::vec((0..3_u16, 4_000..60_000_u64, -90..90_i64, -90..90_i64), 1..80),
        stepper in any::<bool>(),
    ) {
        let mut rows = vec![Row { t_us: 0, pen: 0, ticks: HOME }];
        for (pen, duration_us, a, b) in moves {
            let last = rows[rows.len() - 1];
            // Nothing is moved while the pen is.
            let (a, b) = if pen == last.pen { (a, b) } else { (0, 0) };
            rows.push(Row { t_us: last.t_us + duration_us, pen: last.pen, ticks: [last.ticks[0] + a, last.ticks[1] + b] });
            let here = rows.len() - 1;
            rows[here].pen = pen;
        }
        let kind = if stepper { ebb::Moves::Stepper } else { ebb::Moves::Timed };
        let commands = ebb::commands(rows.iter().copied(), kind, ebb::Pen::Toggle).unwrap();
        let mut board = Ebb::new();
        let mut now_us = 0;
        for command in commands {
            board.receive(format!("{}\r", command.text).as_bytes(), now_us);
            while let Some(next_us) = board.wake_us() {
                now_us = next_us;
                board.advance(now_us);
            }
        }
        board.receive(b"QS\r", now_us);
        let answers = board.answers().concat();
        let answers = String::from_utf8_lossy(&answers).into_owned();
        prop_assert!(!answers.contains("Err"), "{}", answers);
        let end = rows[rows.len() - 1].ticks;
        let counters = format!("{},{}\r\n", end[0] - HOME[0], end[1] - HOME[1]);
        prop_assert!(answers.contains(&counters), "{} in {}", counters, answers);
    }

    #[test]
    fn nobody_panics_whatever_is_said(
        bytes in proptest::collection::vec(any::<u8>(), 0..200),
        words in proptest::collection::vec("(ok|ok [0-9]{1,3}|at -?[0-9]{1,3} [0-9]{1,3} 0|[01]|<Idle\\|MPos:[0-9.]{1,6},[0-9.]{1,5},0>|QM,[01],0,0|-?[0-9]{1,4},[0-9]{1,4}|error:[0-9]|[GMFXYZ][-0-9.]{1,7}|m [0-9]{1,20} [0-9]{1,20} 1 1|LT,[0-9]{1,3},-?[0-9]{1,10},0,0,0)", 0..30),
    ) {
        let text = words.join("\r\n") + "\r\n";
        for protocol in ALL {
            let mut session = protocol.session(protocol.script(&small()));
            let mut device = protocol.device();
            for (k, said) in [&bytes[..], text.as_bytes(), &bytes[..]].into_iter().enumerate() {
                let now_us = 3_000_000 * k as u64;
                session.receive(said, now_us);
                let _ = session.transmit(now_us);
                device.receive(said, now_us);
                let _ = (device.answers(), session.progress());
            }
        }
        for dialect in [Dialect::Gcode, Dialect::XySerial] {
            let script = Script::of_lines(dialect, &text);
            for sent in 0..=script.steps.len() {
                let (_, row) = script.stopping(&script.steps[..sent]);
                let _ = script.from_row(row, None);
            }
        }
    }
}
