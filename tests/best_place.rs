//! `--place best`: the search for the fastest or finest place, in the program.

use serde_json::Value;
use test_support::{Program, TestDir, stderr, stdout};

const PLOTPLAN: Program = Program::new(env!("CARGO_BIN_EXE_plotplan"));

/// A zigzag of 30 by 15 mm.
const ZIGZAG: &str =
    "IN;SP1;PU400,400;PD600,1000,800,400,1000,1000,1200,400,1400,1000,1600,400;PU;PA400,400;PD1600,400;PU;";

fn folder() -> TestDir {
    let dir = TestDir::new();
    dir.write("zigzag.hpgl", ZIGZAG);
    dir
}

fn report(dir: &TestDir, arguments: &str) -> Value {
    let output = PLOTPLAN.succeed(dir, &format!("{arguments} --report json"));
    let last = stderr(&output).lines().last().map(str::to_owned).expect("a report");
    serde_json::from_str(&last).expect("JSON")
}

#[test]
fn options_that_it_prints_make_the_same_plan() {
    let dir = folder();
    for aim in ["time", "accuracy"] {
        let searched = format!("convert zigzag.hpgl -m coaxial -f ticks --place best --for {aim}");
        let output = PLOTPLAN.succeed(&dir, &searched);
        let said = stderr(&output);
        let line = said.lines().find(|line| line.starts_with("placed for")).expect("a line on the place");
        let words: Vec<&str> = line.split([' ', ':']).collect();
        let value = |option: &str| {
            let at = words.iter().position(|word| *word == option).expect("the option");
            words[at + 1]
        };
        let by_hand = format!(
            "convert zigzag.hpgl -m coaxial -f ticks --place={} --rotate={}",
            value("--place"),
            value("--rotate")
        );
        assert_eq!(PLOTPLAN.stdout_of(&dir, &by_hand), stdout(&output), "{line}");
    }
}

#[test]
fn duration_is_that_of_the_plan_and_below_that_in_the_middle() {
    let dir = folder();
    let plan = "convert zigzag.hpgl -m coaxial -o zigzag.ticks";
    let best = report(&dir, &format!("{plan} --place best"));
    let centered = report(&dir, &format!("{plan} --align center"));
    let (best, centered) = (&best["outputs"][0]["summary"], &centered["outputs"][0]["summary"]);
    let found = &best["best_place"];
    assert_eq!(found["duration_s"], best["duration_s"], "{found}");
    // The middle in hundredths of a millimetre.
    let middle = found["centered_duration_s"].as_f64().expect("a duration");
    assert!((middle - centered["duration_s"].as_f64().expect("a duration")).abs() < 0.05, "{found}");
    assert!(found["duration_s"].as_f64().expect("a duration") < 0.95 * middle, "{found}");
}

/// On the polar machine a tick of the table moves the pen in proportion to the radius.
#[test]
fn finest_place_of_a_polar_machine_is_near_its_pole() {
    let dir = folder();
    let plan = "convert zigzag.hpgl -m polar -o zigzag.ticks";
    let best = report(&dir, &format!("{plan} --place best --for accuracy --margin 5mm"));
    let centered = report(&dir, &format!("{plan} --align center"));
    let worst = |report: &Value| {
        report["outputs"][0]["certificate"]["tick_floor"]["worst_mm"].as_f64().expect("a number")
    };
    let found = &best["outputs"][0]["summary"]["best_place"];
    let figure = found["quantization_error_mm"].as_f64().expect("a number");
    assert!((figure - worst(&best)).abs() < 0.03 * figure, "{figure}, certified {}", worst(&best));
    assert!(worst(&best) < 0.95 * worst(&centered), "{} of {}", worst(&best), worst(&centered));
    assert!(best["outputs"][0]["summary"]["beyond_sheet_mm"] == 0.0, "{best}");
}

#[test]
fn rotation_that_is_given_is_kept() {
    let dir = folder();
    let best = report(&dir, "convert zigzag.hpgl -m coaxial -o zigzag.ticks --place best --rotate 30");
    assert_eq!(best["outputs"][0]["summary"]["best_place"]["rotate_deg"], 30.0);
}

#[test]
fn search_is_refused_where_nothing_is_planned_or_nothing_fits() {
    let dir = folder();
    let refused = |arguments: &str, code: i32| PLOTPLAN.refuse(&dir, arguments, code);
    let no_plan = "--place best has no effect without a plan";
    for arguments in [
        "convert zigzag.hpgl -m coaxial -f hpgl --place best",
        "check zigzag.hpgl -m coaxial --place best",
        "preview zigzag.hpgl -m coaxial -o x.svg --place best",
    ] {
        assert!(refused(arguments, 2).contains(no_plan), "{arguments}");
    }
    assert!(
        refused("convert zigzag.hpgl -m coaxial --for accuracy", 2)
            .contains("--for has no effect without --place best")
    );
    let too_large = refused("convert zigzag.hpgl -m coaxial --place best --scale 100", 1);
    assert!(too_large.contains("no position of it that was tried lies on the sheet"), "{too_large}");
}
