//! Small inputs on which the program once did the wrong thing, by their kinds. The inputs are our own.

use std::process::Output;

use assert_cmd::cargo::cargo_bin;
use test_support::TestDir;

/// An arm of two equal links at the middle of its sheet, whose base turns by little more than a full
/// turn.
const ARM: &str = r#"
name = "turntable"
[geometry]
kind = "two-link"
l1 = "40mm"
l2 = "40mm"
elbow = "left"
[joints]
theta = { min = "-185deg", max = "185deg" }
[coupling]
matrix = [[1, 0], [-1, 1]]
[[motor]]
name = "base"
counts = "12800/rev"
max_speed = "200deg/s"
max_acceleration = "800deg/s2"
[[motor]]
name = "elbow"
counts = "12800/rev"
max_speed = "200deg/s"
max_acceleration = "800deg/s2"
[pen]
max_speed = "80mm/s"
lift_time = "100ms"
drop_time = "100ms"
[sheet]
x = "-50mm"
y = "-50mm"
width = "100mm"
height = "100mm"
[start]
theta = "0deg"
psi = "100deg"
"#;

fn run(dir: &TestDir, arguments: &str) -> Output {
    let mut command = std::process::Command::new(cargo_bin!("plotplan"));
    command.current_dir(dir.path()).args(arguments.split_whitespace());
    command.env("COLUMNS", "200").env("XDG_CONFIG_HOME", dir.path().join("config"));
    command.output().expect("the program runs")
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn succeed(dir: &TestDir, arguments: &str) -> Output {
    let output = run(dir, arguments);
    assert!(output.status.success(), "plotplan {arguments}\n{}", stderr(&output));
    output
}

fn fail(dir: &TestDir, arguments: &str, code: i32) -> String {
    let output = run(dir, arguments);
    assert_eq!(output.status.code(), Some(code), "plotplan {arguments}\n{}", stderr(&output));
    stderr(&output)
}

#[test]
fn closed_circle_around_the_base_starts_where_the_joint_allows_it() {
    let dir = TestDir::new();
    dir.write("arm.toml", ARM);
    // Around the base at several sizes, and in both directions.
    for (name, circle) in [
        ("small", "IN;SP1;PU2000,2000;CI800;PU;"),
        ("large", "IN;SP1;PU2000,2000;CI1600;PU;"),
        ("backwards", "IN;SP1;PU2000,3200;PD;AA2000,2000,-360;PU;"),
        ("square", "IN;SP1;PU1000,1000;PD3000,1000,3000,3000,1000,3000,1000,1000;PU;"),
    ] {
        dir.write("circle.hpgl", circle);
        let output = run(&dir, "convert circle.hpgl -m arm.toml -o plan.csv");
        assert!(output.status.success(), "{name}: {}", stderr(&output));
        succeed(&dir, "verify plan.csv -m arm.toml --drawing circle.hpgl");
    }
    dir.write("circle.hpgl", "IN;SP1;PU2000,2000;CI1200;PU;");
    succeed(&dir, "convert circle.hpgl -m arm.toml --fit -o plan.csv");
}

/// A help text is checked by doing it.
#[test]
fn placement_that_a_message_promises_works() {
    let dir = TestDir::new();
    dir.write("arm.toml", ARM.replace("185deg", "100deg"));
    for drawing in [
        "IN;SP1;PU2000,2000;CI1200;PU;",
        "IN;SP1;PU9000,9000;PD9400,9000,9400,9400;PU;",
        "IN;SP1;PU0,2000;PD4000,2000;PU;",
    ] {
        dir.write("a.hpgl", drawing);
        for machine in ["arm.toml", "polar", "coaxial"] {
            let output = run(&dir, &format!("convert a.hpgl -m {machine} -o plan.csv"));
            let text = stderr(&output);
            for (promise, options) in
                [("--align center puts it", "--align center"), ("--fit makes it fit", "--fit")]
            {
                if text.contains(promise) {
                    succeed(&dir, &format!("convert a.hpgl -m {machine} -o plan.csv {options}"));
                }
            }
        }
    }
}

#[test]
fn point_at_the_base_is_refused_with_one_message_that_makes_sense() {
    let dir = TestDir::new();
    let zero = ARM.replace("elbow = \"left\"", "elbow = \"left\"\nmin_dexterity = 0");
    dir.write("arm.toml", zero.replace("theta = { min = \"-185deg\", max = \"185deg\" }", ""));
    dir.write("cross.hpgl", "IN;SP1;PU1000,2000;PD3000,2000;PU;");
    let text = fail(&dir, "convert cross.hpgl -m arm.toml", 1);
    assert!(text.contains("the arm would have to fold completely"), "{text}");
    assert!(!text.contains("0.00 mm too near") && !text.contains("manipulability 0.000"), "{text}");
}

#[test]
fn singularity_names_the_key_that_moves_it() {
    let dir = TestDir::new();
    let polar = String::from_utf8(succeed(&dir, "machine show polar").stdout).expect("text");
    let wide = polar.replace("min = \"48mm\"", "min = \"0mm\"");
    assert_ne!(wide, polar);
    dir.write("polar.toml", &wide);
    // 0.5 mm above the pole of the machine, which is at 138, 0 on its sheet.
    dir.write("line.hpgl", "IN;SP1;PU4000,20;PD7000,20;PU;");
    let text = fail(&dir, "convert line.hpgl -m polar.toml", 1);
    assert!(text.contains("min_dexterity in [geometry]"), "{text}");
    let near = wide.replace("kind = \"polar\" ", "min_dexterity = 0.04\nkind = \"polar\" ");
    assert_ne!(near, wide);
    dir.write("near.toml", near);
    succeed(&dir, "convert line.hpgl -m near.toml -o plan.csv");
}

#[test]
fn white_pens_are_reported_or_skipped() {
    let dir = TestDir::new();
    dir.write("white.hpgl", "IN;NP4;PC2,255,255,255;SP1;PU0,0;PD800,0;PU;SP2;PU0,400;PD800,400;PU;SP0;");
    let drawn = succeed(&dir, "check white.hpgl");
    assert!(stderr(&drawn).contains("warning[H0229]: pen 2 is white (PC)"), "{}", stderr(&drawn));
    assert!(stderr(&drawn).contains("--white-pens skip"), "{}", stderr(&drawn));
    assert!(String::from_utf8_lossy(&drawn.stdout).contains("pens 1, 2"));
    let skipped = succeed(&dir, "check white.hpgl --white-pens skip --strict");
    assert!(String::from_utf8_lossy(&skipped.stdout).contains("20.0 mm of ink"), "{}", stderr(&skipped));
    assert!(stderr(&skipped).contains("note[H0229]"), "{}", stderr(&skipped));
    dir.write("a.svg", "<svg xmlns='http://www.w3.org/2000/svg'><path d='M0 0H9' stroke='#000'/></svg>");
    assert!(fail(&dir, "check a.svg --white-pens skip", 2).contains("no effect"));
}

#[test]
fn page_that_was_not_asked_for_is_a_warning() {
    let dir = TestDir::new();
    dir.write("pages.hpgl", "IN;SP1;PU0,0;PD400,0;PU;PG;SP1;PU0,0;PD0,400;PU;PG;");
    for command in
        ["convert pages.hpgl -m corexy -o p.csv", "preview pages.hpgl -o p.svg", "check pages.hpgl -m corexy"]
    {
        let output = succeed(&dir, command);
        assert!(stderr(&output).contains("has 2 pages; this is page 1"), "{command}: {}", stderr(&output));
        fail(&dir, &format!("{command} --strict"), 1);
        succeed(&dir, &format!("{command} --strict --page 1"));
        succeed(&dir, &format!("{command} --strict --page 2"));
    }
}

/// "error" in a message means that the command fails, whichever command and file.
#[test]
fn error_always_means_an_exit_code() {
    let dir = TestDir::new();
    dir.write("radius.hpgl", "IN;SP1;PU0,0;CI;PD800,0;PU;");
    dir.write("huge.hpgl", "IN;SP1;PU0,0;PD400,0,99999999999,0,400,400;PU;");
    dir.write("letter.hpgl", "IN;SP1;PU400,400;PD800,400;PU;LB\u{2603}\u{3};");
    dir.write("photo.svg", "<svg xmlns='http://www.w3.org/2000/svg' width='20mm' height='20mm' viewBox='0 0 20 20'><path d='M1 1H9' stroke='#000'/><image href='a.png' width='5' height='5'/></svg>");
    dir.write("broken.svg", "<svg xmlns='http://www.w3.org/2000/svg'><path d='M1 1H9' stroke='#000'/>");
    dir.write("empty.hpgl", "IN;SP1;PU0,0;");
    for file in ["radius.hpgl", "huge.hpgl", "letter.hpgl", "photo.svg", "broken.svg", "empty.hpgl"] {
        let mut codes = Vec::new();
        for command in [
            "convert FILE -m corexy -o p.csv",
            "convert FILE -f hpgl -o p.hpgl",
            "check FILE",
            "check FILE -m corexy",
            "info FILE",
            "preview FILE -o p.svg",
        ] {
            let output = run(&dir, &command.replace("FILE", file));
            let text = stderr(&output);
            let is_error = text.lines().any(|line| line.starts_with("error"));
            assert_eq!(is_error, !output.status.success(), "{command}, {file}: {text}");
            codes.push(output.status.code());
        }
        codes.dedup();
        assert_eq!(codes.len(), 1, "{file} has one verdict: {codes:?}");
    }
}

#[test]
fn preview_keeps_arcs() {
    let dir = TestDir::new();
    dir.write("circle.hpgl", "IN;SP1;PU0,0;CI80;PU;");
    succeed(&dir, "preview circle.hpgl -o circle.svg");
    let svg = dir.text("circle.svg");
    assert!(svg.contains("A2.000 2.000"), "{svg}");
    // To standard output as well, in both formats.
    assert_eq!(String::from_utf8_lossy(&succeed(&dir, "preview circle.hpgl -o -").stdout), svg);
    let png = succeed(&dir, "preview circle.hpgl -o - --format png").stdout;
    assert!(png.starts_with(b"\x89PNG\r\n\x1a\n"));
    assert!(fail(&dir, "preview circle.hpgl -o circle.svg --format png", 2).contains("contradicts"));
}

#[test]
fn picture_of_a_machine_shows_reach_sheet_start_and_resolution() {
    let dir = TestDir::new();
    dir.write("arm.toml", ARM);
    for machine in ["coaxial", "polar", "cartesian", "arm.toml"] {
        let svg =
            String::from_utf8(succeed(&dir, &format!("machine preview {machine} -o -")).stdout).expect("SVG");
        for part in ["id=\"reach\"", "id=\"sheet\"", "id=\"start\"", "id=\"shades\"", "tick floor"] {
            assert!(svg.contains(part), "{machine}: no {part}");
        }
        let size = svg.len();
        assert!(size < 400_000, "{machine}: {size} bytes");
    }
    succeed(&dir, "machine preview coaxial -o arm.png");
    assert!(dir.bytes("arm.png").starts_with(b"\x89PNG\r\n\x1a\n"));
    assert!(fail(&dir, "machine preview coxial -o arm.png", 2).contains("did you mean coaxial?"));
}

#[test]
fn pen_positions_of_a_z_axis_have_fractions() {
    let dir = TestDir::new();
    dir.write("a.hpgl", "IN;SP1;PU400,400;PD1200,400;PU;");
    let command = "convert a.hpgl -m cartesian -f gcode-grbl -o a.gcode --pen-positions 5,-0.5";
    succeed(&dir, &format!("{command} --pen-by z"));
    let gcode = dir.text("a.gcode");
    assert!(gcode.contains("Z-0.5") && gcode.contains("Z5\n"), "{gcode}");
    assert!(fail(&dir, command, 2).contains("a servo takes whole numbers"));
}

#[test]
fn info_of_a_gcode_file_of_ours() {
    let dir = TestDir::new();
    dir.write("a.hpgl", "IN;SP1;PU400,400;PD1200,400;PU;SP2;PU2000,2000;CI400;PU;");
    let command = "convert a.hpgl -m cartesian -o a.gcode --format";
    for format in ["gcode-grbl", "gcode-marlin", "gcode-klipper"] {
        succeed(&dir, &format!("{command} {format}"));
        let report = succeed(&dir, "info a.gcode --report json").stdout;
        let report: serde_json::Value = serde_json::from_slice(&report).expect("JSON");
        let program = &report["program_file"];
        let number = |key: &str| program[key].as_f64().expect("a number");
        let ink = 20.0 + 20.0 * std::f64::consts::PI;
        assert!((number("ink_mm") - ink).abs() < 0.1, "{format}: {program}");
        let bounds: Vec<f64> = program["bounds_mm"]
            .as_array()
            .expect("bounds")
            .iter()
            .filter_map(serde_json::Value::as_f64)
            .collect();
        let near =
            bounds.iter().zip([10.0, 10.0, 60.0, 60.0]).all(|(found, right)| (found - right).abs() < 0.1);
        assert!(near, "{format}: {bounds:?}");
        assert_eq!(program["pauses"], 2, "{format}: the first pen and the second");
        assert!(number("drawing_s") > 0.3 && number("drawing_s") < 5.0, "{format}: {program}");
    }
    let text = String::from_utf8(succeed(&dir, "info a.gcode").stdout).expect("text");
    assert!(text.contains("(G-code)") && text.contains("pen 2"), "{text}");
}
