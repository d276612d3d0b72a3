//! Plans and every emulated backend to send them to.

#![allow(
    dead_code,
    unreachable_pub,
    clippy::unwrap_used,
    reason = "each user takes its part; plans made here are sound"
)]

use backends::{
    ALL, Backend, Device, EmulatorOptions, EncodeOptions, FaultInjector, Ink, InkFrame, PenActuator,
    PenNumbers, PlanSource, Program, RowIter, Session, SessionOptions, simulate,
};
use drawing::Rect;
use kinematics::{Cartesian, JointPos, JointRange, Machine, MachineParts, PenLimits};
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
        rounding: plan::Rounding::Nearest,
        pen_colors: std::collections::BTreeMap::new(),
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

/// A Cartesian machine with 50 ticks a mm whose plans lie in the middle of the single-belt plotter's range.
pub fn machine() -> Machine {
    let motor = |name: &str| kinematics::Motor {
        name: name.into(),
        ticks_per_unit: 50.0,
        offset_ticks: -3000.0,
        max_speed_ticks_s: 4000.0,
        max_acceleration_ticks_s2: 40_000.0,
        max_jerk_ticks_s3: None,
        backlash_ticks: 0.0,
    };
    Machine::new(MachineParts {
        name: "made up".into(),
        mechanism: std::sync::Arc::new(Cartesian),
        joints: [JointRange::FREE; 2],
        min_manipulability: 0.0,
        coupling: [[1.0, 0.0], [0.0, 1.0]],
        motors: [motor("a"), motor("b")],
        pen: PenLimits {
            max_speed_mm_s: 80.0,
            max_travel_speed_mm_s: f64::INFINITY,
            lift_time_s: 0.15,
            drop_time_s: 0.15,
        },
        pen_servo: None,
        pen_offsets_mm: std::collections::BTreeMap::new(),
        homing: None,
        sheet: Rect::new(0.0, 0.0, 250.0, 250.0),
        start: JointPos::from([76.0, 60.0]),
        period_s: 0.01,
    })
    .unwrap()
}

/// A backend with an emulator, and how its programs move the pen.
#[derive(Clone, Copy, Debug)]
pub struct Setup {
    pub backend: &'static dyn Backend,
    pub encode: EncodeOptions,
}

/// The pen settings of the command line: default, actuator, positions, both.
fn pen_settings() -> Vec<EncodeOptions> {
    let actuators = [None, Some(PenActuator::Servo), Some(PenActuator::Z)];
    let positions = [None, Some((30.0, 80.0))];
    let all = actuators.into_iter().flat_map(|pen_actuator| {
        positions.map(|pen_positions| EncodeOptions {
            pen_actuator,
            pen_positions,
            legacy_moves: false,
            spare_mm: 0.0,
        })
    });
    all.collect()
}

/// Every backend that can be emulated with its default pen setting.
pub fn backends() -> Vec<Setup> {
    let emulated = ALL.iter().copied().filter(|backend| backend.emulator_help().is_some());
    emulated.map(|backend| Setup { backend, encode: EncodeOptions::default() }).collect()
}

/// Every backend that can be emulated with every pen setting that changes its program.
pub fn setups() -> Vec<Setup> {
    let table = small();
    let mut setups: Vec<(Setup, Vec<String>)> = Vec::new();
    for Setup { backend, .. } in backends() {
        for encode in pen_settings() {
            let setup = Setup { backend, encode };
            let lines: Vec<String> = setup.program(&table).lines.into_iter().map(|line| line.text).collect();
            if setups.iter().all(|(_, known)| *known != lines) {
                setups.push((setup, lines));
            }
        }
    }
    setups.into_iter().map(|(setup, _)| setup).collect()
}

impl Setup {
    pub fn of(name: &str) -> Self {
        Self { backend: backends::find(name).unwrap(), encode: EncodeOptions::default() }
    }

    pub fn program(self, table: &TickTable) -> Program {
        let rows =
            || -> RowIter<'_> { Box::new(table.rows.iter().map(|row| (*row, row.ticks.map(|t| t as f64)))) };
        let machine = machine();
        let source = PlanSource::new(&table.header, &rows).on_machine(&machine);
        self.backend.program(&source, &self.encode).unwrap()
    }

    pub fn session(self, program: Program) -> Box<dyn Session> {
        self.backend.session(program, &SessionOptions::default()).unwrap()
    }

    pub fn device(self) -> Box<dyn Device> {
        let options = EmulatorOptions { start: Some(HOME), ..EmulatorOptions::default() };
        self.backend.emulator(&options).unwrap()
    }

    /// Whether the protocol's lines have checksums.
    pub fn detects_errors(self) -> bool {
        self.backend.name() == "ticks"
    }

    /// The expected ink in the machine's own units, from the plan's rows alone.
    pub fn wanted(self, table: &TickTable) -> Vec<(u16, Vec<[f64; 2]>)> {
        let position = |row: &Row| match self.backend.ink_frame() {
            InkFrame::Ticks => row.ticks.map(|ticks| ticks as f64),
            InkFrame::TicksFromStart => [0, 1].map(|motor| (row.ticks[motor] - HOME[motor]) as f64),
            InkFrame::Millimetres(decimals) => {
                let unit = (0..decimals).fold(1.0, |unit, _| unit * 10.0);
                row.ticks.map(|ticks| ((60.0 + ticks as f64 / 50.0) * unit).round() / unit)
            }
            InkFrame::PlotterUnits => row.ticks.map(|ticks| ((60.0 + ticks as f64 / 50.0) / 0.025).round()),
        };
        let sent = self.backend.pens() == PenNumbers::Sent;
        let mut ink = Ink::default();
        for pair in table.rows.windows(2) {
            ink.pen(if sent { pair[0].pen } else { pair[0].pen.min(1) }, position(&pair[0]));
            ink.go(position(&pair[1]));
        }
        ink.lines()
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
pub fn measure(setup: Setup, table: &TickTable) -> (u64, u64) {
    let lines = setup.program(table).lines.len() as u64;
    let mut machine = FaultInjector::new(setup.device(), Vec::new());
    let mut session = setup.session(setup.program(table));
    let ended = simulate::run(&mut *session, &mut machine, 0, None, 3_600_000_000);
    (lines, ended.at_us)
}

/// A few short strokes: small enough to try every answer.
pub fn small() -> TickTable {
    plan(&[(1, &[[840, 30], [900, 60], [840, 30]]), (1, &[[830, 40]])])
}
