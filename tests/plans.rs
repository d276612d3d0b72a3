//! Plans of the whole program: the same every time, verified, and shaped by options.

mod harness;

use std::fs;

use harness::{PENS, PRESETS, TINY, TestDir, rows};

#[test]
fn plan_document_settings_make_the_same_plan_again() {
    let dir = TestDir::new();
    let options = "--law=sine --segment-time=900ms --overlap-lifts --effort=0 --dedupe --pen-order=2,1 \
                   --scale=0.5 --place=20mm,1cm --tolerance=0.2mm --period=20ms --allow-over-limit";
    let convert = |options: &str, output: &str| {
        dir.succeed(&format!("convert tiny.hpgl --machine corexy --format json -o {output} {options}"));
        let bytes = fs::read(dir.path().join(output)).expect("a plan document");
        serde_json::from_slice::<serde_json::Value>(&bytes).expect("JSON")
    };
    let first = convert(options, "first.json");
    let settings = &first["settings"];
    let given: Vec<&str> = settings["command_line"]
        .as_array()
        .expect("options")
        .iter()
        .map(|o| o.as_str().expect("text"))
        .collect();
    let again = convert(&given.join(" "), "again.json");
    assert_eq!(first, again, "the document's own options make the same document");
    for (key, value) in [
        ("law", serde_json::json!("sine")),
        ("segment_time_s", serde_json::json!(0.9)),
        ("tolerance_mm", serde_json::json!(0.2)),
        ("period_us", serde_json::json!(20_000)),
        ("allow_over_limit", serde_json::json!(true)),
        ("program", serde_json::json!(concat!("plotplan ", env!("CARGO_PKG_VERSION")))),
    ] {
        assert_eq!(settings[key], value, "{key}");
    }
    assert_eq!(settings["ordering"]["pen_order"], serde_json::json!([2, 1]));
    assert_eq!(settings["placement"]["origin_mm"], serde_json::json!([20.0, 10.0]));
    assert!(settings["lift_overlap_s"].as_f64() > Some(0.0));
}

#[test]
fn plans_are_deterministic() {
    let dir = TestDir::new();
    for format in ["ticks", "csv", "json", "hpgl", "svg"] {
        let machine = if ["hpgl", "svg"].contains(&format) { "" } else { "--machine polar" };
        let command = format!("convert tiny.hpgl {machine} --format {format}");
        let (first, second) = (dir.succeed(&command), dir.succeed(&format!("{command} --output out")));
        assert_eq!(first.out, dir.bytes("out"), "{format}");
        assert_eq!(first.err, second.err, "{format}");
        // The path of the input file is not part of the plan.
        let absolute = dir.path().join("tiny.hpgl").display().to_string();
        assert_eq!(dir.succeed(&command.replace("tiny.hpgl", &absolute)).out, first.out, "{format}");
    }
}

#[test]
fn shown_machine_file_gives_same_plan() {
    let dir = TestDir::new();
    for machine in PRESETS {
        let shown = dir.succeed(&format!("machine show {machine}"));
        dir.write("mine.toml", shown.text());
        assert_eq!(dir.succeed("machine show mine.toml").out, shown.out, "{machine}");
        for format in ["csv", "json"] {
            let plan = |name: &str| {
                dir.succeed(&format!("convert tiny.hpgl --machine {name} --format {format}")).out
            };
            assert_eq!(plan("mine.toml"), plan(machine), "{machine}, {format}");
        }
    }
}

#[test]
fn verify_needs_file_of_custom_machine() {
    let dir = TestDir::new();
    let mine = dir.succeed("machine show coaxial").text().replacen("\"coaxial\"", "\"mine\"", 1);
    dir.write("mine.toml", &mine.replacen("\"206mm\"", "\"200mm\"", 1));
    for format in ["ticks", "csv", "json"] {
        dir.succeed(&format!("convert tiny.hpgl --machine mine.toml --format {format} --output plan"));
        let alone = dir.run("verify plan --drawing tiny.hpgl");
        if format == "json" {
            assert_eq!(alone.code, 0, "a plan document has its machine in it\n{}", alone.err);
        } else {
            assert_eq!(alone.code, 2, "{}", alone.err);
            assert!(alone.err.contains("was made for the machine mine"), "{}", alone.err);
        }
        dir.succeed("verify plan --drawing tiny.hpgl --machine mine.toml");
        // The same ticks draw something else on another arm.
        assert_eq!(dir.run("verify plan --drawing tiny.hpgl --machine coaxial").code, 1);
    }
}

#[test]
fn verify_reads_every_plan_format() {
    let dir = TestDir::new();
    dir.write("other.hpgl", &TINY.replacen("PD200,600", "PD200,640", 1));
    for machine in PRESETS {
        for format in ["ticks", "csv", "json"] {
            dir.succeed(&format!("convert tiny.hpgl --machine {machine} --format {format} --output plan"));
            let said = dir.succeed("verify plan --drawing tiny.hpgl");
            assert!(said.text().starts_with("certificate holds (tolerance 0.1 mm)\n"), "{}", said.text());
            let said = dir.succeed("verify plan --drawing tiny.hpgl --report json");
            let report: serde_json::Value = serde_json::from_str(said.text()).expect("one JSON object");
            assert_eq!(report["certificate"]["holds"], true);
            // This plan does not cover a line that is 1 mm longer.
            let said = dir.run("verify plan --drawing other.hpgl");
            assert_eq!(said.code, 1, "{machine}, {format}");
            assert!(said.text().contains("FAILED"), "{}", said.text());
        }
    }
}

#[test]
fn verify_without_drawing_checks_motion() {
    let dir = TestDir::new();
    dir.succeed("convert tiny.hpgl --machine polar --format csv --output plan.csv");
    let said = dir.succeed("verify plan.csv");
    assert!(said.err.starts_with("warning: without --drawing"), "{}", said.err);
    assert!(said.text().starts_with("motion holds\n"), "{}", said.text());
    let said = dir.succeed("verify plan.csv --report json");
    let report: serde_json::Value = serde_json::from_str(said.text()).expect("one JSON object");
    assert_eq!(report["certificate"]["after_rounding"], serde_json::Value::Null);
    let info = dir.succeed("info plan.csv");
    assert!(info.text().contains("pens     1, 2, 4 pen downs\n"), "{}", info.text());
}

/// A CSV plan with `by` added to one number.
fn tampered(csv: &str, row: usize, column: usize, by: i64) -> String {
    let mut rows = rows(csv);
    rows[row][column] += by;
    let head: Vec<&str> = csv.lines().take_while(|line| !line.starts_with("0,")).collect();
    let row_text = |row: &Vec<i64>| row.iter().map(i64::to_string).collect::<Vec<_>>().join(",");
    let body: Vec<String> = rows.iter().map(row_text).collect();
    format!("{}\n{}\n", head.join("\n"), body.join("\n"))
}

#[test]
fn tampered_plan_fails_verification() {
    let dir = TestDir::new();
    for machine in PRESETS {
        let plan = dir.succeed(&format!("convert tiny.hpgl --machine {machine} --format csv"));
        let csv = plan.text();
        let all = rows(csv);
        assert_eq!(tampered(csv, 0, 2, 0), csv);
        let draws = all.iter().position(|row| row[1] == 1).expect("a row with the pen down");
        let draws =
            (draws..all.len() - 1).find(|row| all[*row][2..] != all[*row + 1][2..]).expect("it moves");
        let travels = all.iter().position(|row| row[2..] != all[0][2..]).expect("it moves");
        for (what, changed) in [
            ("a tick row, drawing", tampered(csv, draws, 2, 40)),
            ("a tick row of the other motor", tampered(csv, draws, 3, -40)),
            ("a tick row, travelling", tampered(csv, travels, 2, 40)),
            ("the start", tampered(csv, 0, 2, 1)),
            ("the end", tampered(csv, all.len() - 1, 3, 2)),
            ("a pen", tampered(csv, draws, 1, 1)),
            ("a pen that is up", tampered(csv, travels, 1, 1)),
        ] {
            dir.write("plan.csv", &changed);
            let said = dir.run("verify plan.csv --drawing tiny.hpgl");
            assert_eq!(said.code, 1, "{machine}: {what} was changed\n{}", said.text());
            assert!(said.text().contains("FAILED: "), "{machine}: {what} was changed\n{}", said.text());
        }
    }
}

#[test]
fn truncated_plan_is_rejected() {
    let dir = TestDir::new();
    for format in ["ticks", "csv", "json"] {
        let plan = dir.succeed(&format!("convert tiny.hpgl --machine corexy --format {format}"));
        let text = plan.text();
        let without_last_line = text.trim_end().rfind('\n').map_or(text.len() / 2, |at| at + 1);
        for end in [without_last_line, text.len() / 2] {
            dir.write("plan", &text[..end]);
            let said = dir.run("verify plan --drawing tiny.hpgl");
            assert_eq!(said.code, 1, "{format} up to byte {end} of {}", text.len());
            assert!(said.err.contains("plan is not a plan that can be used"), "{}", said.err);
        }
    }
}

/// The six coefficients of the placement in a CSV plan.
fn placement(csv: &str) -> Vec<f64> {
    let line = csv.lines().find_map(|line| line.strip_prefix("# placement: ")).expect("a placement");
    line.split(' ').map(|number| number.parse().expect("a number")).collect()
}

#[test]
fn placement_options() {
    let dir = TestDir::new();
    let placed = |wish: &str| {
        placement(dir.succeed(&format!("convert tiny.hpgl --machine coaxial --format csv {wish}")).text())
    };
    // The lower left corner of the sheet is at (12.7, 76.2).
    for (wish, expected) in [
        ("", [1.0, 0.0, 0.0, 1.0, 12.7, 76.2]),
        ("--place 1in,25", [1.0, 0.0, 0.0, 1.0, 38.1, 101.2]),
        ("--place -5mm,2cm", [1.0, 0.0, 0.0, 1.0, 7.7, 96.2]),
        ("--scale 2", [2.0, 0.0, 0.0, 2.0, 12.7, 76.2]),
        ("--scale 2 --place 10,10", [2.0, 0.0, 0.0, 2.0, 22.7, 86.2]),
        // The bounding box (5, 10) to (30, 25) becomes 15 wide and 25 high; its lower left corner stays.
        ("--rotate 90", [0.0, 1.0, -1.0, 0.0, 12.7 + 30.0, 76.2 + 5.0]),
        ("--rotate 90 --scale 2", [0.0, 2.0, -2.0, 0.0, 12.7 + 60.0, 76.2 + 10.0]),
        ("--rotate 180", [-1.0, 0.0, 0.0, -1.0, 12.7 + 35.0, 76.2 + 35.0]),
    ] {
        let found = placed(wish);
        let near = found.iter().zip(expected).all(|(found, expected)| (found - expected).abs() < 1e-9);
        assert!(found.len() == 6 && near, "{wish}: {found:?}, not {expected:?}");
    }
    // 25 mm scaled to 215.9 mm: the width of the sheet, centred vertically.
    let fit = placed("--fit");
    let expected = [8.636, 0.0, 0.0, 8.636, 12.7 - 5.0 * 8.636, 76.2 + 279.4 / 2.0 - 17.5 * 8.636];
    assert!(fit.iter().zip(expected).all(|(found, expected)| (found - expected).abs() < 0.01), "{fit:?}");
}

/// A plan starts and ends with the pen up, even if ink starts there.
#[test]
fn ink_at_start_pose() {
    let dir = TestDir::new();
    dir.write("there.hpgl", "IN;SP1;PU0,0;PD400,0,400,400,0,0;PU;");
    let said = dir.succeed("convert there.hpgl --machine cartesian --format csv");
    let all = rows(said.text());
    assert_eq!(all[0], [0, 0, 0, 0]);
    assert_eq!(all[all.len() - 1][1..], [0, 0, 0]);
    assert!(all.iter().any(|row| row[1] == 1));
}

#[test]
fn settings_in_plan_document() {
    let dir = TestDir::new();
    let plan =
        |options: &str| dir.succeed(&format!("convert tiny.hpgl --machine corexy --format csv {options}"));
    // Period: that of the machine, or of the option; longer only while the motors stand still.
    for (options, period) in [("", 10_000), ("--period 2ms", 2_000), ("--period 250us", 250)] {
        let said = plan(options);
        for pair in rows(said.text()).windows(2) {
            let step = pair[1][0] - pair[0][0];
            let still = pair[0][2..] == pair[1][2..];
            assert!(step == period || still && step > period, "{options}: {pair:?}");
        }
    }
    // File order: pen 1 first, strokes from their first points.
    let said = plan("--order file");
    let downs = pen_downs(said.text());
    // CI starts at the rightmost point of the circle.
    assert_eq!(downs, [(1, 10.0, 10.0), (1, 25.0, 20.0), (2, 5.0, 25.0), (2, 7.5, 22.5)]);
}

/// Positions of all pen-downs in a CSV plan of `corexy`, rounded to 0.25 mm: 92.03 ticks per mm of x + y
/// and x - y.
fn pen_downs(csv: &str) -> Vec<(i64, f64, f64)> {
    let all = rows(csv);
    let downs = all.windows(2).filter(|pair| pair[0][1] == 0 && pair[1][1] != 0).map(|pair| {
        let [a, b] = [pair[1][2], pair[1][3]].map(|ticks| ticks as f64 / 92.032);
        let quarters = |mm: f64| (4.0 * mm).round() / 4.0;
        (pair[1][1], quarters(0.5 * (a + b)), quarters(0.5 * (a - b)))
    });
    downs.collect()
}

#[test]
fn ordering_options() {
    let dir = TestDir::new();
    dir.write("pens.hpgl", PENS);
    let run = |options: &str| {
        let said =
            dir.succeed(&format!("convert pens.hpgl --machine corexy --format csv --report json {options}"));
        let report: serde_json::Value =
            serde_json::from_str(said.err.lines().last().expect("a line")).expect("one JSON object");
        let seconds = |what: &str| report["summary"][what].as_f64().expect("a number");
        (pen_downs(said.text()), [seconds("ink_mm"), seconds("drawing_s"), seconds("travel_mm")])
    };
    let in_file = [(1, 10.0, 10.0), (1, 10.0, 10.0), (2, 10.0, 20.0), (3, 10.0, 30.0)];
    let (file, [ink, drawing, travel]) = run("--order file");
    assert_eq!(file, in_file);
    assert!((ink - 80.0).abs() < 0.1, "{ink}");
    let (kept, _) = run("--keep-direction");
    assert!(kept.iter().all(|(_, x, _)| *x == 10.0), "no stroke from its other end: {kept:?}");
    // Every second line from right to left.
    let (optimized, [all, _, shorter]) = run("");
    let pens = |downs: &[(i64, f64, f64)]| downs.iter().map(|(pen, ..)| *pen).collect::<Vec<_>>();
    assert_eq!(pens(&optimized), [1, 2, 3]);
    assert!(shorter < travel - 30.0, "{shorter} mm of travel, {travel} in the file's order");
    assert!((all - 80.0).abs() < 0.2, "what is drawn twice is drawn twice: {all} mm");
    let (deduped, [once, ..]) = run("--dedupe");
    assert_eq!(pens(&deduped), [1, 2, 3]);
    assert!((once - 60.0).abs() < 0.1, "{once}");
    assert_eq!(pens(&run("--pen-order 3,1").0), [3, 1, 2]);
    // 20 mm at 2 cm/s, the others at the limit of the machine, 60 mm/s.
    let (_, [_, slow, _]) = run("--order file --speed file");
    assert!((slow - drawing - (20.0 / 20.0 - 20.0 / 60.0)).abs() < 0.15, "{slow} s, {drawing} s");
    for effort in 0..=3 {
        let (_, [_, _, travel_mm]) = run(&format!("--effort {effort}"));
        assert!(
            travel_mm <= travel,
            "effort {effort}: {travel_mm} mm of travel, {travel} in the file's order"
        );
    }
}
