//! Plans, protocols and machines to try.

#![allow(
    dead_code,
    unreachable_pub,
    clippy::unwrap_used,
    reason = "each user takes its part; plans made here are sound"
)]

use backends::asking::Asking;
use backends::device::{Device, Ebb, FaultInjector, Grbl, Ticks, XyPlotter};
use backends::numbered::Numbered;
use backends::repeating::Repeating;
use backends::{Ink, Script, Session, simulate};
use backends::{Setpoint, ebb, gcode};
use drawing::Point;
use plan::{Header, Limits, Motor, Row, TickTable};

/// Where plans start, ticks.
pub const HOME: [i64; 2] = [800, 0];
const PERIOD_US: u64 = 10_000;
const DROP_US: u64 = 150_000;

pub fn limits() -> Limits {
    Limits { speed: 4000.0, acceleration: 40_000.0, jerk: None }
}

/// A plan of straight strokes in ticks, each from rest to rest, with travel between them.
pub fn plan(strokes: &[(u16, &[[i64; 2]])]) -> TickTable {
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
        lift_overlap_us: 0,
        duration_us: rows.last().unwrap().t_us,
    };
    TickTable { header, rows }
}

/// A square that ends where it began, a zigzag that meets itself, a dot.
pub fn drawing() -> TickTable {
    plan(&[
        (1, &[[1000, 200], [1300, 200], [1300, 500], [1000, 500], [1000, 200]]),
        (2, &[[1500, 300], [1600, 450], [1500, 300], [1450, 280], [1500, 300], [1700, 100]]),
        (1, &[[900, 900]]),
        (1, &[[905, 905], [915, 905]]),
    ])
}

/// Motors straight on x and y, 50 ticks a mm, the plan in the middle of seed 2's range.
fn setpoints(table: &TickTable) -> impl Iterator<Item = Setpoint> + '_ {
    table.rows.iter().map(|row| {
        let exact = row.ticks.map(|ticks| ticks as f64);
        let at = Point::new(60.0 + exact[0] / 50.0, 60.0 + exact[1] / 50.0);
        Setpoint { row: *row, exact, joints: [at.x, at.y], at }
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
pub enum Protocol {
    Ticks,
    XySerial,
    Gcode,
    Ebb,
}

pub const ALL: [Protocol; 4] = [Protocol::Ticks, Protocol::XySerial, Protocol::Gcode, Protocol::Ebb];

impl Protocol {
    pub fn script(self, table: &TickTable) -> Script {
        match self {
            Self::Ticks => Script::ticks(table.clone()),
            Self::XySerial => Script::xy_serial(setpoints(table)).unwrap(),
            Self::Gcode => Script::gcode(gcode::timed(setpoints(table), &options(), false)),
            Self::Ebb => Script::ebb(table.clone(), ebb::Moves::Timed, ebb::Pen::Toggle).unwrap(),
        }
    }

    pub fn session(self, script: Script) -> Box<dyn Session> {
        match self {
            Self::Ticks => Box::new(Numbered::new(script, 8)),
            Self::XySerial => Box::new(Repeating::new(script)),
            Self::Gcode => Box::new(Asking::new(script, 127)),
            Self::Ebb => Box::new(Asking::new(script, 0)),
        }
    }

    pub fn device(self) -> Box<dyn Device> {
        match self {
            Self::Ticks => Box::new(Ticks::new(Some(HOME))),
            Self::XySerial => Box::new(XyPlotter::new(false, 0.0)),
            Self::Gcode => Box::new(Grbl::new()),
            Self::Ebb => Box::new(Ebb::new()),
        }
    }

    /// The ink that is wanted, in the machine's own units, from the plan's rows alone.
    pub fn wanted(self, table: &TickTable) -> Vec<(u16, Vec<[f64; 2]>)> {
        let of = |place: &dyn Fn(&Setpoint) -> [f64; 2], one_pen: bool| {
            let mut ink = Ink::default();
            let all: Vec<Setpoint> = setpoints(table).collect();
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

/// Numbers that look random and are always the same (Knuth's 64-bit linear congruential generator, upper half).
pub struct Random(pub u64);

impl Random {
    pub fn below(&mut self, n: u64) -> u64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) % n
    }
}

/// How many answers a machine gives to the whole plan, and how long that takes.
pub fn measure(protocol: Protocol, table: &TickTable) -> (u64, u64) {
    let lines = protocol.script(table).steps.len() as u64;
    let mut machine = FaultInjector::new(protocol.device(), Vec::new());
    let mut session = protocol.session(protocol.script(table));
    let ended = simulate::run(&mut *session, &mut machine, 0, None, 3_600_000_000);
    (lines, ended.at_us)
}

/// A few short strokes: small enough to try every answer.
pub fn small() -> TickTable {
    plan(&[(1, &[[840, 30], [900, 60], [840, 30]]), (1, &[[830, 40]])])
}
