//! Every emulated backend with every fault and every pen setting, in memory: the ink is the plan's, once.

#![allow(clippy::unwrap_used, reason = "plans made here are sound")]

mod common;

use backends::{
    EmulatorOptions, EncodeOptions, Fault, FaultInjector, Outcome, PenActuator, PlanSource, PositionQuery,
    Progress, ReportedPosition, RowIter, Session, SessionOptions, Waiting, simulate,
};
use common::{HOME, Random, Setup, backends, drawing, limits, measure, setups, small};
use kinematics::Machine;
use plan::{Row, TickTable};
use proptest::prelude::*;

const HOUR_US: u64 = 3_600_000_000;

/// Sends the plan and checks the ink.
fn run(setup: Setup, table: &TickTable, faults: Vec<Fault>) -> FaultInjector {
    let what = format!("{setup:?} {faults:?}");
    let mut machine = FaultInjector::new(setup.device(), faults);
    let mut session = setup.session(setup.program(table));
    let ended = simulate::run(&mut *session, &mut machine, 0, None, HOUR_US);
    assert_eq!(ended.outcome, Some(Outcome::Done), "{what}: {:?}", session.progress());
    // Lines with checksums may be retransmitted faster than they are read; the others must never be.
    assert!(setup.detects_errors() || machine.device().lost_bytes() == 0, "{what}: bytes lost");
    assert!(!machine.device().pen_is_down(), "{what}: the pen stays down");
    let ink = machine.device().ink().lines();
    assert_eq!(ink, setup.wanted(table), "{what}");
    machine
}

#[test]
fn fault_free_session_draws_the_plan() {
    for setup in setups() {
        run(setup, &drawing(), Vec::new());
    }
}

#[test]
fn pen_settings_cover_servo_and_z_axis() {
    let setups = setups();
    let of = |name: &str| setups.iter().filter(|setup| setup.backend.name() == name).count();
    assert_eq!((of("ticks"), of("xy-serial"), of("ebb"), of("gcode-grbl")), (1, 1, 3, 4));
}

#[test]
fn every_answer_lost_late_or_garbled() {
    let table = small();
    for setup in setups() {
        let (lines, _) = measure(setup, &table);
        for number in 0..lines + 4 {
            run(setup, &table, vec![Fault::LostAnswer(number)]);
            run(setup, &table, vec![Fault::LateAnswer(number, 700_000)]);
            run(setup, &table, vec![Fault::LateAnswer(number, 5_300_000)]);
            run(setup, &table, vec![Fault::GarbledAnswer(number)]);
        }
    }
}

#[test]
fn unplugged_at_any_time() {
    let table = small();
    for setup in setups() {
        let (_, duration_us) = measure(setup, &table);
        for k in 0..150 {
            let at_us = duration_us * k / 150;
            run(setup, &table, vec![Fault::Unplugged(at_us, 400_000)]);
            run(setup, &table, vec![Fault::Unplugged(at_us, 20_000_000)]);
        }
    }
}

#[test]
fn receive_buffer_full_at_any_time() {
    let table = small();
    for setup in setups() {
        let (_, duration_us) = measure(setup, &table);
        for k in 0..60 {
            let at_us = duration_us * k / 60;
            run(setup, &table, vec![Fault::FullBuffer(at_us, 300_000)]);
            // Longer than any acknowledgement is waited for. The single-belt plotter is given up after that.
            if setup.backend.name() != "xy-serial" {
                run(setup, &table, vec![Fault::FullBuffer(at_us, 6_000_000)]);
            }
        }
    }
}

#[test]
fn garbled_bytes_of_tick_lines_are_retransmitted() {
    let table = small();
    for byte in 0..2000 {
        run(Setup::of("ticks"), &table, vec![Fault::GarbledByte(byte)]);
    }
}

#[test]
fn six_faults_in_one_plan() {
    let table = drawing();
    let mut random = Random(6);
    for setup in setups() {
        let (lines, duration_us) = measure(setup, &table);
        for _ in 0..100 {
            let faults = (0..6).map(|_| match random.below(5) {
                0 => Fault::LostAnswer(random.below(lines)),
                1 => Fault::LateAnswer(random.below(lines), random.below(3_000_000)),
                2 => Fault::GarbledAnswer(random.below(lines)),
                3 => Fault::FullBuffer(random.below(duration_us), random.below(500_000)),
                _ => Fault::Unplugged(random.below(duration_us), random.below(3_000_000)),
            });
            run(setup, &table, faults.collect());
        }
    }
}

/// Stops at `stop_us`, then resumes in a second session with the same machine, or with one that was homed since.
fn stop_and_resume(setup: Setup, table: &TickTable, stop_us: u64, faults: Vec<Fault>, homed: bool) {
    let what = format!("{setup:?} stopped at {stop_us} us, {faults:?}, homed: {homed}");
    let program = setup.program(table);
    let mut machine = FaultInjector::new(setup.device(), faults);
    let mut session = setup.session(program.clone());
    let ended = simulate::run(&mut *session, &mut machine, 0, Some(stop_us), HOUR_US);
    let row = match ended.outcome {
        Some(Outcome::Stopped { row }) => row,
        Some(Outcome::Done) => {
            return assert_eq!(machine.device().ink().lines(), setup.wanted(table), "{what}");
        }
        other => panic!("{what}: {other:?}"),
    };
    assert!(!machine.device().pen_is_down(), "{what}: the pen stays down");
    // As soon as the limits allow: a tenth of a second, what the machine had in its queue, and the lift. The single-belt
    // plotter receives nothing while it homes, and then goes to the middle first; a lost answer has to be waited for.
    let left = ended.at_us - stop_us;
    assert!(left < 10_000_000, "{what}: stops only after {left} us");
    let position = program.start_position().filter(|_| homed);
    let rest = program.from_row(row, position).unwrap();
    let mut ink = machine.device().ink().clone();
    let (mut second, from_us) = if homed {
        let options = EmulatorOptions { start: Some(HOME), homed: true, ..EmulatorOptions::default() };
        (FaultInjector::new(setup.backend.emulator(&options).unwrap(), Vec::new()), 0)
    } else {
        (machine, ended.at_us + 1_000_000)
    };
    let mut session = setup.session(rest);
    let ended = simulate::run(&mut *session, &mut second, from_us, None, HOUR_US);
    assert_eq!(ended.outcome, Some(Outcome::Done), "{what}, resumed from row {row}");
    if homed {
        ink.append(second.device().ink());
    } else {
        ink = second.device().ink().clone();
    }
    assert_eq!(ink.lines(), setup.wanted(table), "{what}, resumed from row {row}");
}

#[test]
fn stop_and_resume_at_any_time() {
    let table = drawing();
    for setup in setups() {
        let (_, duration_us) = measure(setup, &table);
        for k in 0..150 {
            stop_and_resume(setup, &table, duration_us * k / 150, Vec::new(), k % 2 == 0);
        }
    }
}

#[test]
fn stop_during_a_fault() {
    let table = drawing();
    let mut random = Random(7);
    for setup in setups() {
        let (lines, duration_us) = measure(setup, &table);
        for k in 0..100 {
            let stop_us = random.below(duration_us);
            let fault = match k % 4 {
                0 => Fault::LostAnswer(random.below(lines)),
                1 => Fault::LateAnswer(random.below(lines), random.below(1_000_000)),
                2 => Fault::GarbledAnswer(random.below(lines)),
                _ => Fault::Unplugged(stop_us.saturating_sub(random.below(200_000)), 300_000),
            };
            stop_and_resume(setup, &table, stop_us, vec![fault], false);
        }
    }
}

/// A session that is paused at a time and is not resumed; pen changes are confirmed at once.
struct Paused {
    session: Box<dyn Session>,
    at_us: u64,
    /// What the machine waited for, in order.
    waits: Vec<String>,
}

impl Session for Paused {
    fn receive(&mut self, bytes: &[u8], now_us: u64) {
        self.session.receive(bytes, now_us);
    }

    fn transmit(&mut self, now_us: u64) -> Vec<u8> {
        if now_us >= self.at_us {
            self.at_us = u64::MAX;
            self.session.pause();
        }
        if let Some(Waiting::Machine(what)) = self.session.waiting_for() {
            self.waits.push(what);
            self.session.resume(now_us);
        }
        self.session.transmit(now_us)
    }

    fn wake_us(&self) -> Option<u64> {
        self.session.wake_us().into_iter().chain((self.at_us != u64::MAX).then_some(self.at_us)).min()
    }

    fn stop(&mut self, now_us: u64) {
        self.session.stop(now_us);
    }

    fn reconnected(&mut self, now_us: u64) {
        self.session.reconnected(now_us);
    }

    fn pause(&mut self) {
        self.session.pause();
    }

    fn waiting_for(&self) -> Option<Waiting> {
        None
    }

    fn resume(&mut self, now_us: u64) {
        self.session.resume(now_us);
    }

    fn progress(&self) -> Progress {
        self.session.progress()
    }

    fn outcome(&self) -> Option<&Outcome> {
        self.session.outcome()
    }
}

#[test]
fn pause_at_the_next_pen_up_and_resume() {
    let table = drawing();
    for setup in setups() {
        let (_, duration_us) = measure(setup, &table);
        let mut pauses = 0;
        for k in 0..40 {
            let what = format!("{setup:?} paused at {k}/40");
            let mut machine = FaultInjector::new(setup.device(), Vec::new());
            let session = setup.session(setup.program(&table));
            let mut session = Paused { session, at_us: duration_us * k / 40, waits: Vec::new() };
            let ended = simulate::run(&mut session, &mut machine, 0, None, HOUR_US);
            if ended.outcome.is_none() {
                pauses += 1;
                assert_eq!(session.session.waiting_for(), Some(Waiting::Operator), "{what}");
                assert!(!machine.device().pen_is_down(), "{what}: the pen is down");
                assert!(session.progress().lines < session.progress().of_lines, "{what}");
                let resumed_us = ended.at_us + 60_000_000;
                session.resume(resumed_us);
                let ended = simulate::run(&mut session, &mut machine, resumed_us, None, HOUR_US);
                assert_eq!(ended.outcome, Some(Outcome::Done), "{what}");
            }
            assert_eq!(machine.device().ink().lines(), setup.wanted(&table), "{what}");
        }
        assert!(pauses > 20, "{setup:?}: {pauses} pauses");
    }
}

#[test]
fn pauses_name_the_pen_and_park_the_machine() {
    let setup = Setup::of("gcode-grbl");
    let program = setup.program(&drawing());
    let mut machine = FaultInjector::new(setup.device(), Vec::new());
    let mut session = Paused { session: setup.session(program.clone()), at_us: u64::MAX, waits: Vec::new() };
    let ended = simulate::run(&mut session, &mut machine, 0, None, HOUR_US);
    assert_eq!(ended.outcome, Some(Outcome::Done));
    assert_eq!(session.waits, ["put in pen 1", "put in pen 2", "put in pen 1"]);
    // The plan starts at 76, 60 mm.
    let lines: Vec<&str> = program.lines.iter().map(|line| line.text.as_str()).collect();
    let pauses: Vec<usize> = (0..lines.len()).filter(|line| lines[*line] == "M0").collect();
    assert_eq!(pauses.len(), 3);
    for pause in &pauses[1..] {
        assert_eq!(lines[pause - 1], "G0 X76 Y60");
        assert!(lines[pause + 1].starts_with("G0 X"), "{}", lines[pause + 1]);
    }
}

#[test]
fn gcode_travel_durations_use_the_travel_speed() {
    let table = drawing();
    let mut parts = common::machine().parts().clone();
    parts.pen.max_travel_speed_mm_s = 160.0;
    let machine = Machine::new(parts).unwrap();
    let rows =
        || -> RowIter<'_> { Box::new(table.rows.iter().map(|row| (*row, row.ticks.map(|t| t as f64)))) };
    let source = PlanSource::new(&table.header, &rows).on_machine(&machine);
    let gcode = backends::find("gcode-grbl").unwrap();
    let program = gcode.program(&source, &EncodeOptions::default()).unwrap();
    let park = program.lines.iter().rposition(|line| line.text == "G0 X76 Y60").unwrap();
    let before = program.lines[..park].iter().rev().find_map(|line| line.position).unwrap();
    let way_um = libm::hypot((before[0] - 76_000) as f64, (before[1] - 60_000) as f64);
    let expected_us = way_um / 1000.0 / 160.0 * 1e6;
    let duration_us = program.lines[park].duration_us as f64;
    assert!((duration_us - expected_us).abs() < 10.0, "{duration_us} us instead of {expected_us}");
}

/// Sends a plan of 40 strokes to a reader of tick lines with this receive buffer: bytes lost, lines retransmitted.
fn with_receive_buffer(buffer: usize, announces_room: bool) -> (u64, u64) {
    let points: Vec<[[i64; 2]; 2]> = (0..40).map(|k| [[1000 + 10 * k, 200], [1000 + 10 * k, 500]]).collect();
    let strokes: Vec<(u16, &[[i64; 2]])> = points.iter().map(|points| (1, &points[..])).collect();
    let table = common::plan(&strokes);
    let setup = Setup::of("ticks");
    let options = EmulatorOptions {
        start: Some(HOME),
        buffer: Some(buffer),
        announces_room,
        ..EmulatorOptions::default()
    };
    let mut machine = FaultInjector::new(setup.backend.emulator(&options).unwrap(), Vec::new());
    let mut session = setup.session(setup.program(&table));
    let ended = simulate::run(&mut *session, &mut machine, 0, None, HOUR_US);
    assert_eq!(ended.outcome, Some(Outcome::Done), "{buffer} bytes");
    assert_eq!(machine.device().ink().lines(), setup.wanted(&table), "{buffer} bytes");
    // Retransmissions may not cost more than a tenth of the plan's time.
    let late_us = ended.at_us.saturating_sub(table.header.duration_us);
    assert!(late_us < table.header.duration_us / 10, "{buffer} bytes: {late_us} us late");
    (machine.device().lost_bytes(), session.progress().retransmitted)
}

#[test]
fn window_adapts_to_a_receive_buffer_of_64_bytes() {
    for buffer in [40, 64, 128, 256, 512] {
        let (_, retransmitted) = with_receive_buffer(buffer, false);
        assert!(retransmitted <= 60, "{buffer} bytes: {retransmitted} lines retransmitted");
    }
}

#[test]
fn announced_room_is_never_exceeded() {
    for buffer in [40, 64, 128, 256, 512] {
        assert_eq!(with_receive_buffer(buffer, true), (0, 0), "{buffer} bytes");
    }
}

#[test]
fn reset_machine_is_reported() {
    let setup = Setup::of("ticks");
    let mut session = setup.session(setup.program(&drawing()));
    let _ = session.transmit(0);
    session.receive(
        b"ok 1*21
",
        1000,
    );
    assert!(!session.transmit(2000).is_empty());
    session.receive(
        b"ok 0*20
",
        3000,
    );
    session.receive(
        b"ok 0*20
",
        4000,
    );
    let Some(Outcome::Failed { row: 0, why, .. }) = session.outcome() else {
        panic!("{:?}", session.outcome())
    };
    assert!(why.contains("the machine was reset"), "{why}");
}

/// The machine's report, queried in memory.
fn queried_position(setup: Setup, machine: &mut FaultInjector, from_us: u64) -> ReportedPosition {
    let mut query = PositionQuery::new(setup.backend.status().unwrap());
    let mut now_us = from_us;
    loop {
        let bytes = query.transmit(now_us);
        machine.receive(&bytes, now_us);
        query.receive(&machine.heard(now_us));
        if let Some(found) = query.found() {
            return found.clone();
        }
        now_us += 10_000;
        machine.advance(now_us);
    }
}

#[test]
fn resume_after_the_step_counters_were_cleared() {
    let table = drawing();
    for setup in backends().into_iter().filter(|setup| setup.backend.status().is_some()) {
        let program = setup.program(&table);
        let (_, duration_us) = measure(setup, &table);
        let mut machine = FaultInjector::new(setup.device(), Vec::new());
        let mut session = setup.session(program.clone());
        let ended = simulate::run(&mut *session, &mut machine, 0, Some(duration_us / 2), HOUR_US);
        let Some(Outcome::Stopped { row }) = ended.outcome else { panic!("{ended:?}") };
        // Switched off and on, and moved home by hand: the counters are at their start again.
        let mut ink = machine.device().ink().clone();
        let mut machine = FaultInjector::new(setup.device(), Vec::new());
        let position = match queried_position(setup, &mut machine, 0) {
            ReportedPosition::At(position) => Some(position),
            ReportedPosition::Unknown => program.start_position(),
            other => panic!("{setup:?}: {other:?}"),
        };
        assert_eq!(position.and_then(|position| program.row_at_position(row, position)), None, "{setup:?}");
        let mut session = setup.session(program.from_row(row, position).unwrap());
        let ended = simulate::run(&mut *session, &mut machine, 60_000_000, None, HOUR_US);
        assert_eq!(ended.outcome, Some(Outcome::Done), "{setup:?}");
        ink.append(machine.device().ink());
        assert_eq!(ink.lines(), setup.wanted(&table), "{setup:?}");
    }
}

#[test]
fn ebb_lifts_with_the_programs_pen_setting_on_failure() {
    let positions = Some((20_000.0, 9_000.0));
    for (encode, lift) in [
        (EncodeOptions::default(), "SP,1,500\r"),
        (
            EncodeOptions { pen_actuator: Some(PenActuator::Servo), ..EncodeOptions::default() },
            "S2,16000,4,0,500\r",
        ),
        (EncodeOptions { pen_positions: positions, ..EncodeOptions::default() }, "S2,20000,4,0,500\r"),
    ] {
        let setup = Setup { encode, ..Setup::of("ebb") };
        let mut session = setup.session(setup.program(&drawing()));
        let _ = session.transmit(0);
        session.receive(b"QM,0,0,0,0\r\n0,0\r\nOK\r\n", 1000);
        let _ = session.transmit(400_000);
        session.receive(b"!8 Err: out of range\r\n", 500_000);
        assert_eq!(String::from_utf8(session.transmit(600_000)).unwrap(), lift);
        assert!(matches!(session.outcome(), Some(Outcome::Failed { .. })));
    }
}

#[test]
fn stopped_and_resumed_motion_keeps_the_limits() {
    let table = drawing();
    for setup in [Setup::of("ticks"), Setup::of("ebb")] {
        let program = setup.program(&table);
        for sent in 2..program.lines.len() {
            let (tail, row) = program.stop_sequence(sent);
            let resumed = program.from_row(row, None).unwrap();
            let within = |rows: &[Row]| {
                for three in rows.windows(3) {
                    for motor in 0..2 {
                        let speed = |a: &Row, b: &Row| {
                            (b.ticks[motor] - a.ticks[motor]) as f64 / ((b.t_us - a.t_us) as f64 * 1e-6)
                        };
                        let times = [three[1].t_us - three[0].t_us, three[2].t_us - three[1].t_us];
                        let [shortest, longest] =
                            [times[0].min(times[1]), times[0].max(times[1])].map(|us| us as f64 * 1e-6);
                        let change = (speed(&three[1], &three[2]) - speed(&three[0], &three[1])).abs();
                        // Three rounded positions at two distances are four ticks.
                        let most = limits().acceleration * longest + 2.0 / shortest;
                        assert!(change <= most * 1.0001, "{setup:?} {sent}: {change} of {most} at {three:?}");
                    }
                }
            };
            within(&resumed.table().unwrap().rows);
            if setup.backend.name() == "ticks" {
                let mut rows: Vec<Row> = Vec::new();
                let mut t_us = 0;
                let sent = program.lines[..sent].iter().chain(&tail);
                for line in sent.filter(|line| line.text.starts_with("m ")) {
                    t_us += line.duration_us;
                    rows.push(Row { t_us, pen: 0, ticks: line.position.unwrap() });
                }
                within(&rows);
                assert!(tail.iter().map(|line| line.duration_us).sum::<u64>() < 1_000_000);
            }
        }
    }
}

#[test]
fn tick_line_error_lifts_the_pen() {
    // Lines are missing in the middle of a stroke: the reader's counts no longer agree at its end.
    let setup = Setup::of("ticks");
    let mut program = setup.program(&drawing());
    let sync = program.lines.iter().skip(2).position(|line| line.text.starts_with("s ")).unwrap() + 2;
    program.lines.remove(sync - 10);
    let mut machine = FaultInjector::new(setup.device(), Vec::new());
    let mut session = setup.session(program);
    let ended = simulate::run(&mut *session, &mut machine, 0, None, HOUR_US);
    let Some(Outcome::Failed { why, .. }) = ended.outcome else { panic!("{:?}", ended.outcome) };
    assert!(why.contains("lines are missing or doubled"), "{why}");
    assert!(!machine.device().pen_is_down(), "the pen stays down");
}

#[test]
fn silent_machine_fails_without_acknowledged_rows() {
    for setup in backends() {
        let mut session = setup.session(setup.program(&drawing()));
        let mut now_us = 0;
        while session.outcome().is_none() {
            let _ = session.transmit(now_us);
            now_us = session.wake_us().unwrap_or(now_us).max(now_us + 1000);
        }
        let Some(Outcome::Failed { row: 0, why, .. }) = session.outcome() else {
            panic!("{setup:?}: {:?}", session.outcome())
        };
        assert!(why.contains("nothing was received"), "{setup:?}: {why}");
        assert_eq!(session.progress().lines, 0);
    }
}

#[test]
fn failure_names_what_was_received() {
    for setup in backends() {
        let mut session = setup.session(setup.program(&drawing()));
        let mut now_us = 0;
        while session.outcome().is_none() {
            let _ = session.transmit(now_us);
            session.receive(b"what?\r\n", now_us);
            now_us = session.wake_us().unwrap_or(now_us).max(now_us + 1000);
        }
        let Some(Outcome::Failed { why, .. }) = session.outcome() else { panic!("{setup:?}") };
        assert!(why.contains("the machine last sent `what?`"), "{setup:?}: {why}");
    }
}

#[test]
fn early_acknowledgement_of_the_single_belt_plotter_cuts_corners_by_a_millimetre() {
    let table = drawing();
    let setup = Setup::of("xy-serial");
    let options = EmulatorOptions { homed: true, answers_within_mm: 1.0, ..EmulatorOptions::default() };
    let mut machine = FaultInjector::new(setup.backend.emulator(&options).unwrap(), Vec::new());
    let mut session = setup.session(setup.program(&table));
    let ended = simulate::run(&mut *session, &mut machine, 0, None, HOUR_US);
    assert_eq!(ended.outcome, Some(Outcome::Done));
    let (drawn, wanted) = (machine.device().ink().lines(), setup.wanted(&table));
    assert_eq!(drawn.len(), wanted.len());
    let points =
        |lines: &[(u16, Vec<[f64; 2]>)]| lines.iter().flat_map(|(_, line)| line.clone()).collect::<Vec<_>>();
    let (drawn, wanted) = (points(&drawn), points(&wanted));
    let nearest = |p: &[f64; 2]| {
        drawn.iter().map(|q| (p[0] - q[0]).abs().max((p[1] - q[1]).abs())).fold(f64::INFINITY, f64::min)
    };
    let off = wanted.iter().map(nearest).fold(0.0, f64::max);
    assert!(off > 0.1 && off <= 1.0, "{off} mm");
}

proptest! {
    #[test]
    fn ebb_makes_exactly_the_steps_of_any_plan(
        moves in proptest::collection::vec((0..3_u16, 4_000..60_000_u64, -90..90_i64, -90..90_i64), 1..80),
        legacy_moves in any::<bool>(),
    ) {
        let mut table = small();
        table.rows = vec![Row { t_us: 0, pen: 0, ticks: HOME }];
        let rows = &mut table.rows;
        for (pen, duration_us, a, b) in moves {
            let last = rows[rows.len() - 1];
            // The motors stand still while the pen moves.
            let (a, b) = if pen == last.pen { (a, b) } else { (0, 0) };
            let ticks = [last.ticks[0] + a, last.ticks[1] + b];
            rows.push(Row { t_us: last.t_us + duration_us, pen: last.pen, ticks });
            let here = rows.len() - 1;
            rows[here].pen = pen;
        }
        let encode = EncodeOptions { legacy_moves, ..EncodeOptions::default() };
        let setup = Setup { encode, ..Setup::of("ebb") };
        let mut board = setup.device();
        let mut now_us = 0;
        for line in setup.program(&table).lines {
            board.receive(format!("{}\r", line.text).as_bytes(), now_us);
            while let Some(next_us) = board.wake_us() {
                now_us = next_us;
                board.advance(now_us);
            }
        }
        board.receive(b"QS\r", now_us);
        let answers = board.answers().concat();
        let answers = String::from_utf8_lossy(&answers).into_owned();
        prop_assert!(!answers.contains("Err"), "{}", answers);
        let end = table.rows[table.rows.len() - 1].ticks;
        let counters = format!("{},{}\r\n", end[0] - HOME[0], end[1] - HOME[1]);
        prop_assert!(answers.contains(&counters), "{} in {}", counters, answers);
    }

    #[test]
    fn arbitrary_bytes_cause_no_panic(
        bytes in proptest::collection::vec(any::<u8>(), 0..200),
        words in proptest::collection::vec("(ok|ok [0-9]{1,3}|ok 1 room [0-9]{1,20}|at -?[0-9]{1,3} [0-9]{1,3} 0|[01]|<Idle\\|MPos:[0-9.]{1,6},[0-9.]{1,5},0>|QM,[01],0,0|-?[0-9]{1,4},[0-9]{1,4}|error:[0-9]|[GMFXYZ][-0-9.]{1,7}|m [0-9]{1,20} [0-9]{1,20} 1 1|LT,[0-9]{1,3},-?[0-9]{1,10},0,0,0)", 0..30),
    ) {
        let text = words.join("\r\n") + "\r\n";
        for setup in backends() {
            let mut session = setup.session(setup.program(&small()));
            let mut device = setup.device();
            for (k, sent) in [&bytes[..], text.as_bytes(), &bytes[..]].into_iter().enumerate() {
                let now_us = 3_000_000 * k as u64;
                session.receive(sent, now_us);
                let _ = session.transmit(now_us);
                device.receive(sent, now_us);
                let _ = (device.answers(), session.progress());
            }
        }
        for backend in backends::ALL {
            let Some(program) = backend.parse_program(text.as_bytes()) else { continue };
            for sent in 0..=program.lines.len() {
                let (_, row) = program.stop_sequence(sent);
                let _ = program.from_row(row, None);
            }
            let _ = backend.session(program, &SessionOptions::default());
        }
    }
}
