//! The image for steppers: every step counted, then faults.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::{Context as _, Result, ensure};

use super::Bench;
use super::rig::{Rig, signal, wait};
use super::trace::{Jitter, STEP_BOUND_US, Steps, Trace, compare, compare_order};

const IMAGE: &str = "uno-steps";
/// Pulse of the lowered pen, us, as in `app/steps.h`.
const PEN_DOWN_US: f64 = 1500.0;
const PEN_UP_US: f64 = 1000.0;
const RANDOM_PLANS: usize = 1000;
const RANDOM_SEED: u64 = 0x2545_F491_4F6C_DD1D;
/// Other plans for a longer run: `COUNT,SEED`.
const RANDOM_VARIABLE: &str = "PLOTPLAN_RANDOM_PLANS";
/// A switch stops the motors within two samples and a step.
const STOP_BOUND_US: f64 = 3000.0;
/// A resumed plan may leave a line in between two ticks of the original.
const RESUME_TICKS: i64 = 1;

pub(super) fn run(bench: &mut Bench) {
    bench.check("zot, every step", |bench| draw(bench, &bench.example("zot.hpgl"), &[]));
    bench.check("house, every step", |bench| draw(bench, &bench.example("house.hpgl"), &[]));
    bench.check("both motors at 20 000 and 16 600 steps/s", full_speed);
    bench.check("random plans up to 20 000 steps/s", random_plans);
    bench.check("1 % of bytes damaged each way, one in a line", damaged_bytes);
    bench.check("reset while drawing", |bench| chip_reset(bench, "reset"));
    bench.check("power lost for half a second while drawing", |bench| chip_reset(bench, "power"));
    bench.check("watchdog ends a hanging program", |bench| chip_reset(bench, "hang"));
    bench.check("Ctrl-C and resume", interrupted);
    bench.check("limit switch while drawing", |bench| stopped(bench, "close1", "limit"));
    bench.check("emergency stop while drawing", |bench| stopped(bench, "close4", "stop"));
    bench.check("homing from ten poses", homing);
    bench.check("homing without a switch fails", homing_fails);
    bench.check("homing against a stop, blind", homing_against_stop);
    bench.check("plan for another machine is refused", other_machine);
}

fn draw(bench: &Bench, drawing: &Path, options: &[&str]) -> Result<String> {
    let plan = bench.plan(drawing, options)?;
    let steps = Steps::read(&plan)?;
    let rig = Rig::start(bench, IMAGE, &[])?;
    rig.draw(bench, &plan)?;
    let [a, b] = steps.end;
    rig.ask_until("where", |answer| answer == format!("at {a} {b} 0"))?;
    let status = rig.ask("status")?;
    let (summary, trace) = rig.finish()?;
    let count = compare_order(&steps, &trace)?;
    ensure!(status.contains(" late 0 "), "{status}");
    let jitter = compare(&steps, &trace)?;
    ensure!(jitter.most() <= STEP_BOUND_US, "steps at {jitter}");
    ensure!(trace.pen_changes(PEN_DOWN_US) == steps.pens, "the pen: {:?}", trace.pens);
    Ok(format!(
        "{count} steps, none lost or gained, each at its time {jitter}; {} pen changes\n      {}",
        steps.pens.len(),
        summary.load()
    ))
}

/// A plan file from a place, of these rows: duration, ticks.
fn write_plan(bench: &Bench, name: &str, start: [i64; 2], rows: &[(u32, [i64; 2])]) -> Result<PathBuf> {
    let mut text = String::from(
        "; plotplan: 1\n; machine: coaxial\n; motors: arm1 arm2\n; limits arm1 speed: 20000\n\
         ; limits arm1 acceleration: 1000000000\n; limits arm2 speed: 20000\n\
         ; limits arm2 acceleration: 1000000000\n; placement a b: 1 0\n; placement c d: 0 1\n\
         ; placement e f: 0 0\n; period_us: 10000\n",
    );
    let total: u64 = rows.iter().map(|row| u64::from(row.0)).sum();
    let _ = writeln!(text, "begin 1 {} {total}\ns 0 0 {} {}", rows.len(), start[0], start[1]);
    for (us, [a, b]) in rows {
        let _ = writeln!(text, "m 0 {us} {a} {b}");
    }
    let _ = writeln!(text, "end 0 {} {total}", rows.len());
    let path = bench.file(name);
    std::fs::write(&path, text)?;
    Ok(path)
}

fn full_speed(bench: &Bench) -> Result<String> {
    let rows: Vec<_> = (1..=200).map(|row| (10_000, [row * 200, row * -166])).collect();
    let plan = write_plan(bench, "fast.ticks", [0, 0], &rows)?;
    let steps = Steps::read(&plan)?;
    let rig = Rig::start(bench, IMAGE, &["--pace", "2"])?;
    rig.draw(bench, &plan)?;
    rig.ask_until("where", |answer| answer.ends_with(" 0"))?;
    let (summary, trace) = rig.finish()?;
    let count = compare_order(&steps, &trace)?;
    let jitter = compare(&steps, &trace)?;
    ensure!(jitter.most() <= STEP_BOUND_US, "steps at {jitter}");
    Ok(format!(
        "{count} steps, each at its time {jitter}; pulses of {:.1} us at least\n      {}",
        summary.number("shortest_pulse") / super::rig::CYCLES_PER_US,
        summary.load()
    ))
}

/// Marsaglia's xorshift.
struct Random(u64);

impl Random {
    fn below(&mut self, bound: i64) -> i64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        ((self.0 >> 20) % bound.unsigned_abs()) as i64
    }
}

/// One after the other on the same machine: each is checked by itself.
fn random_plans(bench: &Bench) -> Result<String> {
    let (plan_count, seed) = match std::env::var(RANDOM_VARIABLE) {
        Ok(value) => {
            let (count, seed) = value.split_once(',').context("PLOTPLAN_RANDOM_PLANS: COUNT,SEED")?;
            (count.parse()?, seed.parse()?)
        }
        Err(_) => (RANDOM_PLANS, RANDOM_SEED),
    };
    let mut random = Random(seed);
    // At 8 times real time a pause of the host of 75 ms emptied the queue.
    let rig = Rig::start(bench, IMAGE, &["--pace", "2"])?;
    let mut plans = Vec::new();
    let mut at = [0, 0];
    for _ in 0..plan_count {
        let start = at;
        let rows: Vec<_> = (0..5 + random.below(8))
            .map(|_| {
                let longest = if random.below(16) == 0 { 100_000 } else { 15_000 };
                let us = 3000 + random.below(longest);
                // Up to the rate limit, both ways, often at rest.
                for tick in &mut at {
                    let most = us / 50;
                    *tick += if random.below(4) == 0 { 0 } else { random.below(2 * most + 1) - most };
                }
                (us as u32, at)
            })
            .collect();
        let plan = write_plan(bench, "random.ticks", start, &rows)?;
        plans.push(Steps::read(&plan)?);
        rig.draw(bench, &plan)?;
        rig.ask_until("where", |answer| answer == format!("at {} {} 0", at[0], at[1]))?;
    }
    let (_, trace) = rig.finish()?;
    let (mut count, mut worst) = (0, Jitter::default());
    let mut rest = trace.motors;
    for plan in &plans {
        let made = [0, 1].map(|motor: usize| {
            let after = rest[motor].split_off(plan.motors[motor].len().min(rest[motor].len()));
            std::mem::replace(&mut rest[motor], after)
        });
        let made = Trace { motors: made, ..Trace::default() };
        count += compare_order(plan, &made)?;
        let jitter = compare(plan, &made)?;
        worst.early_us = worst.early_us.max(jitter.early_us);
        worst.late_us = worst.late_us.max(jitter.late_us);
    }
    ensure!(rest.iter().all(Vec::is_empty), "steps that no plan asked for");
    ensure!(worst.most() <= STEP_BOUND_US, "steps at {worst}");
    Ok(format!("{plan_count} plans, {count} steps, none lost or gained, each at its time {worst}"))
}

/// A small drawing, so that repeats do not take minutes.
fn small_drawing(bench: &Bench) -> Result<PathBuf> {
    let path = bench.file("small.hpgl");
    std::fs::write(&path, "IN;SP1;PU3000,5000;PD3600,5000,3600,5400,3000,5000;PU4000,5200;PD4200,5300;PU;")?;
    Ok(path)
}

fn damaged_bytes(bench: &Bench) -> Result<String> {
    let plan = bench.plan(&small_drawing(bench)?, &[])?;
    let steps = Steps::read(&plan)?;
    let rig = Rig::start(bench, IMAGE, &["--garble-in", "100", "--garble-out", "100", "--pace", "2"])?;
    rig.draw(bench, &plan)?;
    // Until nothing moves: answers to questions are damaged as well.
    std::thread::sleep(Duration::from_secs(2));
    let (summary, trace) = rig.finish()?;
    let count = compare_order(&steps, &trace)?;
    ensure!(trace.pen_changes(PEN_DOWN_US) == steps.pens, "the pen: {:?}", trace.pens);
    ensure!(summary.number("garbled") > 10.0, "only {} bytes were damaged", summary.number("garbled"));
    Ok(format!("{} bytes damaged, {count} steps, none lost or gained", summary.number("garbled")))
}

/// Reset, power loss, or a program that hangs until the watchdog resets it: the sender stops and says so.
fn chip_reset(bench: &Bench, event: &str) -> Result<String> {
    let plan = bench.plan(&bench.example("zot.hpgl"), &[])?;
    let rig = Rig::start(bench, IMAGE, &["--at", &format!("2.0,{event}")])?;
    let output = rig.send(bench, &plan, &[])?;
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    ensure!(!output.status.success() && message.contains("was reset"), "send: {message}");
    let place = rig.ask("where")?;
    ensure!(place == "at unknown", "{place}");
    let status = rig.ask("status")?;
    let cause = match event {
        "hang" => "start watchdog",
        "power" => "start power",
        _ => "start",
    };
    ensure!(status.contains(cause), "{status}");
    let (_, trace) = rig.finish()?;
    let pen = trace.pens.last().context("no pen")?.1;
    ensure!((pen - PEN_UP_US).abs() < 4.0, "the pen is at {pen} us");
    Ok(format!("send stops, pen up, `{place}`, `{status}`"))
}

fn interrupted(bench: &Bench) -> Result<String> {
    let plan = bench.plan(&bench.example("zot.hpgl"), &[])?;
    let steps = Steps::read(&plan)?;
    let rig = Rig::start(bench, IMAGE, &["--pace", "2"])?;
    let sender = rig.start_send(bench, &plan, &[])?;
    std::thread::sleep(Duration::from_secs(3));
    signal(&sender, "INT")?;
    let output = wait(sender)?;
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    ensure!(output.status.code() == Some(130), "send: {message}");
    let row = message.split("--from ").nth(1).and_then(|rest| rest.split_whitespace().next());
    let row = row.with_context(|| format!("no row to resume from: {message}"))?.to_owned();
    rig.ask_until("where", |answer| answer.ends_with(" 0"))?;
    let resumed = rig.send(bench, &plan, &["--from", &row])?;
    ensure!(resumed.status.success(), "resume: {}", String::from_utf8_lossy(&resumed.stderr));
    let [a, b] = steps.end;
    rig.ask_until("where", |answer| answer == format!("at {a} {b} 0"))?;
    let (_, trace) = rig.finish()?;
    let end = trace.positions.last().context("no steps")?.1;
    ensure!(
        [0, 1].iter().all(|&m: &usize| end[m] as i64 == steps.end[m] - steps.start[m]),
        "ends at {end:?}"
    );
    // The ink of both runs covers the ink of the plan.
    let mut drawn = std::collections::BTreeSet::new();
    let mut pens = trace.pens.iter().peekable();
    let mut down = false;
    for (time, at) in &trace.positions {
        while let Some((_, us)) = pens.next_if(|pen| pen.0 <= *time) {
            down = (us - PEN_DOWN_US).abs() < 4.0;
        }
        if down {
            drawn.insert([0, 1].map(|m: usize| at[m] as i64 + steps.start[m]));
        }
    }
    let near = |[a, b]: [i64; 2]| {
        let range = -RESUME_TICKS..=RESUME_TICKS;
        range.clone().any(|i| range.clone().any(|j| drawn.contains(&[a + i, b + j])))
    };
    let missing = steps.ink.iter().filter(|at| !near(**at)).count();
    ensure!(missing == 0, "{missing} of {} places have no ink", steps.ink.len());
    Ok(format!(
        "stopped, resumed from row {row}, all {} places inked, end at the right tick",
        steps.ink.len()
    ))
}

fn stopped(bench: &Bench, event: &str, reason: &str) -> Result<String> {
    let plan = bench.plan(&bench.example("zot.hpgl"), &[])?;
    let rig = Rig::start(bench, IMAGE, &["--at", &format!("3.0,{event}")])?;
    let output = rig.send(bench, &plan, &[])?;
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    ensure!(!output.status.success() && message.contains(reason), "send: {message}");
    let (place, status) = (rig.ask("where")?, rig.ask("status")?);
    ensure!(place == "at unknown" && status.contains(reason), "{place}, {status}");
    let (_, trace) = rig.finish()?;
    let first = trace.positions.first().context("no steps")?.0;
    let last = trace.positions.last().context("no steps")?.0;
    let after = last - first - 3.0e6;
    ensure!(after < STOP_BOUND_US, "the last step came {after:.0} us later");
    let pen = trace.pens.last().context("no pen")?.1;
    ensure!((pen - PEN_UP_US).abs() < 4.0, "the pen is at {pen} us");
    Ok(format!("send ends with `{reason}`; last step within {STOP_BOUND_US} us, pen up"))
}

fn homing(bench: &Bench) -> Result<String> {
    let mut longest = 0.0_f64;
    for pose in 0..10_i64 {
        // `app/homing.h` moves motor 1, then motor 2, towards smaller ticks.
        let start = [pose * 90 - 40, 700 - pose * 60];
        let rig = Rig::start(
            bench,
            "uno-homing",
            &["--switch", "1,0,0", "--switch", "2,1,0", "--start", &format!("{},{}", start[0], start[1])],
        )?;
        let answer = rig.ask("0:begin 1 1 1000")?;
        ensure!(answer == "error 0 home", "a plan before homing: {answer}");
        let answer = rig.ask("home")?;
        ensure!(answer == "ok", "home: {answer}");
        let place = rig.ask_until("where", |answer| answer != "at unknown")?;
        ensure!(place == "at -1600 800 0", "{place}");
        let (_, trace) = rig.finish()?;
        let end = trace.positions.last().context("no steps")?;
        // Backed off by 30 from the first tick at which the switch is open.
        let off = [0, 1].map(|m: usize| (end.1[m] - 30.0).abs());
        ensure!(off[0].max(off[1]) <= 1.0, "from {start:?} it ends at {:?}", end.1);
        longest = longest.max((end.0 - trace.positions[0].0) * 1e-6);
    }
    Ok(format!("each ends within a tick of the same place, after {longest:.1} s at most"))
}

/// Steppers do not feel a stop: they make all steps of the way, and lose those that it holds back, whole cycles of
/// four full steps.
fn homing_against_stop(bench: &Bench) -> Result<String> {
    // Ticks of a cycle: 16 microsteps.
    const CYCLE: i64 = 64;
    let stops = [-40, 20];
    let mut worst = 0;
    for pose in 0..5_i64 {
        let start = [stops[0] + pose * 211, stops[1] + (4 - pose) * 303];
        let places = [0, 1].map(|motor: usize| format!("{motor},{},{CYCLE}", stops[motor]));
        let rig = Rig::start(
            bench,
            "uno-stepstops",
            &["--stop", &places[0], "--stop", &places[1], "--start", &format!("{},{}", start[0], start[1])],
        )?;
        ensure!(rig.ask("home")? == "ok", "home");
        let place = rig.ask_until("where", |answer| answer != "at unknown")?;
        ensure!(place == "at -1600 800 0", "{place}");
        let (summary, _) = rig.finish()?;
        let end = summary.pair("at");
        // Backed off by 30 steps of the field, which led or lagged by up to two full steps.
        let off = [0, 1].map(|m: usize| (end[m] as i64 - stops[m] - 30).abs());
        worst = worst.max(off[0]).max(off[1]);
    }
    ensure!(worst <= CYCLE / 2, "{worst} ticks off, two full steps are {}", CYCLE / 2);
    Ok(format!("each ends within {worst} ticks of the same place; two full steps are {}", CYCLE / 2))
}

fn homing_fails(bench: &Bench) -> Result<String> {
    let rig = Rig::start(bench, "uno-homing", &[])?;
    let answer = rig.ask("home")?;
    ensure!(answer == "ok", "home: {answer}");
    let status = rig.ask_until("status", |answer| !answer.contains("homing"))?;
    ensure!(status.contains("status home "), "{status}");
    ensure!(rig.ask("where")? == "at unknown", "the position is known");
    let (summary, _) = rig.finish()?;
    Ok(format!("`{status}` after {} ticks", summary.pair("at")[0].abs()))
}

fn other_machine(bench: &Bench) -> Result<String> {
    let plan = bench.plan(&small_drawing(bench)?, &[])?;
    let text = std::fs::read_to_string(&plan)?.replace("; machine: coaxial", "; machine: hbot");
    let other = bench.file("other.ticks");
    std::fs::write(&other, text)?;
    let rig = Rig::start(bench, IMAGE, &[])?;
    let output = rig.send(bench, &other, &[])?;
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    ensure!(!output.status.success() && message.contains("machine"), "send: {message}");
    ensure!(rig.ask("0:begin 2 1 1000")? == "error 0 version", "version 2 was accepted");
    let (summary, _) = rig.finish()?;
    ensure!(summary.number("steps") < 0.5, "it moved");
    Ok(message.lines().next().unwrap_or_default().to_owned())
}
