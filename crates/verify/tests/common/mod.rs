//! Test machines, and a generator of tick tables that uses no planner.

#![allow(dead_code, unreachable_pub, reason = "each test uses its own part")]

use drawing::{Drawing, Pen, Point, Rect, Span, Stroke};
use kinematics::{
    Cartesian, JointPos, JointRange, Machine, MachineParts, Mechanism, Motor, PenLimits, Polar, TwoLink,
};
use plan::{Header, Limits, Row};
use verify::{Certificate, Timing, Verifier};

/// Time between rows, us.
pub const PERIOD_US: u64 = 10_000;

fn motor(name: &str, counts: f64, offset: f64, max_speed: f64, max_acceleration: f64) -> Motor {
    Motor {
        name: name.into(),
        ticks_per_unit: counts,
        offset_ticks: offset,
        max_speed_ticks_s: max_speed,
        max_acceleration_ticks_s2: max_acceleration,
        max_jerk_ticks_s3: None,
        backlash_ticks: 0.0,
    }
}

fn parts(
    name: &str,
    mechanism: impl Mechanism + 'static,
    motors: [Motor; 2],
    start: JointPos,
) -> MachineParts {
    MachineParts {
        name: name.into(),
        mechanism: std::sync::Arc::new(mechanism),
        joints: [JointRange::FREE; 2],
        min_manipulability: 0.0,
        coupling: [[1.0, 0.0], [0.0, 1.0]],
        motors,
        pen: PenLimits {
            max_speed_mm_s: 100.0,
            max_travel_speed_mm_s: f64::INFINITY,
            lift_time_s: 0.15,
            drop_time_s: 0.2,
        },
        pen_servo: None,
        pen_offsets_mm: std::collections::BTreeMap::new(),
        homing: None,
        sheet: Rect::new(0.0, 0.0, 200.0, 200.0),
        start,
        period_s: 0.01,
    }
}

/// x and y at 100 ticks/mm, 100 mm/s and 1000 mm/s²; joints from 0 to 200 mm; starts at (0, 0).
pub fn cartesian() -> Machine {
    let motors = [motor("x", 100.0, 0.0, 1e4, 1e5), motor("y", 100.0, 0.0, 1e4, 1e5)];
    let mut parts = parts("cartesian", Cartesian, motors, JointPos::new(0.0, 0.0));
    parts.joints = [JointRange { min: 0.0, max: 200.0 }; 2];
    Machine::new(parts).expect("a sound machine")
}

/// The coaxial arm (report 1): both motors on the base, 3200 ticks a turn, stretched up at the
/// start.
pub fn arm() -> Machine {
    let counts = 3200.0 / std::f64::consts::TAU;
    let up = std::f64::consts::FRAC_PI_2;
    let motors = [motor("arm1", counts, 0.0, 533.3, 2666.7), motor("arm2", -counts, 800.0, 533.3, 2666.7)];
    let arm = TwoLink { l1_mm: 206.0, l2_mm: 256.0, elbow_left: true };
    Machine::new(parts("arm", arm, motors, JointPos::new(up, up))).expect("a sound machine")
}

/// Angle and radius, the angle in steps of 1/2000 rad.
pub fn polar() -> Machine {
    let motors = [motor("phi", 2000.0, 0.0, 4e3, 4e4), motor("r", 100.0, 0.0, 1e4, 1e5)];
    Machine::new(parts("polar", Polar::default(), motors, JointPos::new(0.5, 60.0))).expect("a sound machine")
}

/// The header of a plan for a machine.
pub fn header(machine: &Machine) -> Header {
    Header {
        machine: machine.name().into(),
        motors: machine.motors().clone().map(|motor| plan::Motor {
            name: motor.name,
            limits: Limits {
                speed: motor.max_speed_ticks_s,
                acceleration: motor.max_acceleration_ticks_s2,
                jerk: motor.max_jerk_ticks_s3,
            },
        }),
        placement: [1.0, 0.0, 0.0, 1.0, 0.0, 0.0],
        period_us: PERIOD_US,
        rows: 0,
        lift_overlap_us: 0,
        rounding: plan::Rounding::Nearest,
        pen_colors: std::collections::BTreeMap::new(),
        duration_us: 0,
    }
}

pub fn timing() -> Timing {
    Timing { period_us: PERIOD_US, lift_overlap_us: 0, rounding: plan::Rounding::Nearest }
}

/// A drawing of polylines; stroke `i` has the source byte `i`.
pub fn drawing(strokes: &[(u16, &[(f64, f64)])]) -> Drawing {
    let strokes = strokes.iter().enumerate().filter_map(|(index, (pen, points))| {
        let points = points.iter().map(|(x, y)| Point::new(*x, *y)).collect();
        Stroke::polyline(Pen(*pen), points, Span { start: index, end: index + 1 })
    });
    Drawing { strokes: strokes.collect() }
}

/// Generates rows: straight lines of the pen, each from rest to rest with `s = 3 u² - 2 u³`.
#[derive(Clone)]
pub struct Plotter<'a> {
    pub machine: &'a Machine,
    pub rows: Vec<Row>,
    pub exact: Vec<[f64; 2]>,
    pub period_us: u64,
    /// Speed of the motors as a share of their limits.
    pub limit_share: f64,
    joints: JointPos,
}

impl<'a> Plotter<'a> {
    pub fn new(machine: &'a Machine) -> Self {
        let mut plotter = Self {
            machine,
            rows: Vec::new(),
            exact: Vec::new(),
            period_us: PERIOD_US,
            limit_share: 0.95,
            joints: machine.start(),
        };
        plotter.push(0, 0);
        plotter
    }

    fn push(&mut self, t_us: u64, pen: u16) {
        let exact = self.machine.motor_positions(&self.joints);
        let ticks = [exact[0].round() as i64, exact[1].round() as i64];
        self.rows.push(Row { t_us, pen, ticks });
        self.exact.push([exact[0], exact[1]]);
    }

    fn last(&self) -> Row {
        self.rows[self.rows.len() - 1]
    }

    pub fn rest(&mut self, seconds: f64) -> &mut Self {
        let Row { t_us, pen, .. } = self.last();
        self.push(t_us + (seconds * 1e6).round() as u64, pen);
        self
    }

    /// Lowers or lifts the pen, and waits.
    pub fn pen(&mut self, pen: u16) -> &mut Self {
        let last = self.rows.len() - 1;
        // In the first row the pen is up.
        if last == 0 {
            self.rest(self.period_us as f64 * 1e-6);
        }
        let last = self.rows.len() - 1;
        self.rows[last].pen = pen;
        let PenLimits { lift_time_s: lift_time, drop_time_s: drop_time, .. } = *self.machine.pen();
        self.rest(if pen == 0 { lift_time } else { drop_time })
    }

    /// Follows a path, `u` from 0 to 1, as fast as the motors allow.
    fn follow(&mut self, path: impl Fn(f64) -> JointPos) -> &mut Self {
        let ticks = |u: f64| self.machine.motor_positions(&path(u * u * (3.0 - 2.0 * u)));
        let dt = self.period_us as f64 * 1e-6;
        let too_fast = |steps: usize| {
            let at = |k: usize| ticks((k as f64 / steps as f64).min(1.0));
            (0..steps).any(|k| {
                // Mirrored before the first step: a start from rest.
                let (a, b, c) = (at(k.abs_diff(1)), at(k), at(k + 1));
                (0..2).any(|m| {
                    let motor = &self.machine.motors()[m];
                    (c[m] - b[m]).abs() > self.limit_share * motor.max_speed_ticks_s * dt
                        || (c[m] - 2.0 * b[m] + a[m]).abs()
                            > self.limit_share * motor.max_acceleration_ticks_s2 * dt * dt
                })
            })
        };
        let mut steps = 1;
        while too_fast(steps) {
            steps += 1 + steps / 64;
        }
        let Row { t_us, pen, .. } = self.last();
        let poses: Vec<JointPos> = (1..=steps)
            .map(|k| {
                let u = k as f64 / steps as f64;
                path(u * u * (3.0 - 2.0 * u))
            })
            .collect();
        for (k, pose) in poses.into_iter().enumerate() {
            self.joints = pose;
            self.push(t_us + (k as u64 + 1) * self.period_us, pen);
        }
        self
    }

    /// A straight line of the pen.
    pub fn line(&mut self, x: f64, y: f64) -> &mut Self {
        let from = self.machine.mechanism().forward(&self.joints);
        let (machine, near, to) = (self.machine, self.joints, Point::new(x, y));
        self.follow(|u| machine.pose_near(from.lerp(to, u), &near).expect("a point within reach"))
    }

    /// A straight line in joint space.
    pub fn travel(&mut self, x: f64, y: f64) -> &mut Self {
        let to = self.machine.pose_near(Point::new(x, y), &self.joints).expect("a point within reach");
        self.travel_to(to)
    }

    pub fn travel_to(&mut self, to: JointPos) -> &mut Self {
        let from = self.joints;
        self.follow(|u| from + (to - from) * u)
    }

    pub fn stroke(&mut self, pen: u16, points: &[(f64, f64)]) -> &mut Self {
        self.travel(points[0].0, points[0].1).pen(pen);
        for (x, y) in &points[1..] {
            self.line(*x, *y);
        }
        self.pen(0)
    }

    pub fn park(&mut self) -> &mut Self {
        self.travel_to(self.machine.start())
    }

    pub fn verify(&self, drawing: &Drawing, tolerance: f64) -> Certificate {
        self.verify_as(drawing, tolerance, true)
    }

    pub fn verify_as(&self, drawing: &Drawing, tolerance: f64, exact: bool) -> Certificate {
        let timing =
            Timing { period_us: self.period_us, lift_overlap_us: 0, rounding: plan::Rounding::Nearest };
        let mut verifier = Verifier::new(self.machine, drawing, timing, tolerance);
        for (index, row) in self.rows.iter().enumerate() {
            verifier.row(*row, exact.then(|| self.exact[index]));
        }
        verifier.finish()
    }
}

/// The messages of all failures.
pub fn sentences(certificate: &Certificate) -> Vec<String> {
    certificate.failures.iter().map(ToString::to_string).collect()
}
