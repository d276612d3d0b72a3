//! What new users met in their first hour with the program, as named tests.

use std::fs;

use test_support::{Program, TestDir};

const PROGRAM: Program = Program::new(env!("CARGO_BIN_EXE_plotplan"));

const SQUARE: &str = "IN;SP1;PU400,400;PD1200,400,1200,1200,400,1200,400,400;PU;";
/// A square of 20 mm whose lower-left corner is at 600, 600 mm: beyond every preset.
const FAR: &str = "IN;SP1;PU24000,24000;PD24800,24000,24800,24800,24000,24800,24000,24000;PU;";

/// Bounding box of the pen-down rows of a plan on the table, mm.
fn ink_bounds(dir: &TestDir, plan: &str) -> [f64; 4] {
    let text = PROGRAM.stdout_of(dir, &format!("info {plan}"));
    assert!(text.contains("ink"), "{text}");
    let rows: Vec<Vec<f64>> = dir
        .text(plan)
        .lines()
        .filter(|line| line.starts_with(|c: char| c.is_ascii_digit()))
        .map(|line| line.split(',').map(|number| number.parse().expect("a number")).collect())
        .collect();
    let mut bounds = [f64::INFINITY, f64::INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY];
    for pair in rows.windows(2).filter(|pair| pair[0][1] != 0.0) {
        for row in pair {
            let [x, y] = [row[2] / 80.0, row[3] / 80.0];
            bounds = [bounds[0].min(x), bounds[1].min(y), bounds[2].max(x), bounds[3].max(y)];
        }
    }
    bounds
}

fn assert_near(found: [f64; 4], expected: [f64; 4]) {
    // Corners are blended within the tolerance of 0.1 mm.
    assert!(
        found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 0.15),
        "{found:?}, expected {expected:?}"
    );
}

#[test]
fn output_never_replaces_an_input() {
    let dir = TestDir::new();
    dir.write("a.hpgl", SQUARE);
    let machine = PROGRAM.stdout_of(&dir, "machine show cartesian");
    dir.write("m.toml", &machine);
    for command in
        ["convert a.hpgl -o a.hpgl", "convert a.hpgl -m m.toml -o m.toml", "preview a.hpgl -o link.svg"]
    {
        #[cfg(unix)]
        if command.contains("link") {
            std::os::unix::fs::symlink("a.hpgl", dir.path().join("link.svg")).expect("a link");
        }
        let said = PROGRAM.refuse(&dir, command, 2);
        assert!(said.contains("an output does not replace an input"), "{said}");
    }
    assert_eq!(dir.text("a.hpgl"), SQUARE);
    assert_eq!(dir.text("m.toml"), machine);
}

#[test]
fn placement_options_take_effect() {
    let dir = TestDir::new();
    dir.write("a.hpgl", SQUARE);
    let bounds = |options: &str| {
        PROGRAM.stdout_of(
            &dir,
            &format!("convert a.hpgl -m cartesian -f csv -o plan.csv --order file {options}"),
        );
        ink_bounds(&dir, "plan.csv")
    };
    assert_near(bounds(""), [10.0, 10.0, 30.0, 30.0]);
    assert_near(bounds("--scale 200%"), [20.0, 20.0, 60.0, 60.0]);
    assert_near(bounds("--align center"), [140.0, 140.0, 160.0, 160.0]);
    assert_near(bounds("--align top-right --margin 10mm"), [270.0, 270.0, 290.0, 290.0]);
    assert_near(bounds("--align bottom-left --paper A4 --margin 1cm"), [10.0, 10.0, 30.0, 30.0]);
    assert_near(bounds("--align top-right --paper A4,landscape --margin 0mm"), [277.0, 190.0, 297.0, 210.0]);
    assert_near(bounds("--fit --margin 50mm"), [50.0, 50.0, 250.0, 250.0]);
    assert_near(bounds("--shrink"), [140.0, 140.0, 160.0, 160.0]);
    assert_near(bounds("--rotate 90deg"), [10.0, 10.0, 30.0, 30.0]);
}

#[test]
fn mirror_swaps_left_and_right() {
    let dir = TestDir::new();
    // An L: its corner is at the lower left; mirrored, at the lower right.
    dir.write("l.hpgl", "IN;SP1;PU0,1600;PD0,0,800,0;PU;");
    PROGRAM.stdout_of(
        &dir,
        "convert l.hpgl -m cartesian -f csv -o plan.csv --order file --place 50,50 --mirror x",
    );
    let plan = dir.text("plan.csv");
    assert!(plan.contains("# placement: -1 0 0 1 70 50"), "{plan}");
}

#[test]
fn far_drawing_is_offered_a_placement_at_its_size() {
    let dir = TestDir::new();
    dir.write("far.hpgl", FAR);
    let said = PROGRAM.refuse(&dir, "convert far.hpgl -m cartesian", 1);
    assert!(said.contains("--align center puts it on the sheet at this size"), "{said}");
    PROGRAM.stdout_of(&dir, "convert far.hpgl -m cartesian --align center -o plan.ticks");
    let place =
        said.split("(as --place ").nth(1).and_then(|rest| rest.split(' ').next()).expect("a placement");
    PROGRAM.stdout_of(&dir, &format!("convert far.hpgl -m cartesian --place {place} --strict -o plan.ticks"));
}

#[test]
fn plan_of_own_machine_needs_no_further_words() {
    let dir = TestDir::new();
    dir.write("a.hpgl", SQUARE);
    let own = PROGRAM
        .stdout_of(&dir, "machine show cartesian")
        .replace("name = \"cartesian\"", "name = \"lisas-table\"");
    fs::create_dir_all(dir.path().join("config/plotplan/machines")).expect("a folder");
    dir.write("config/plotplan/machines/lisa.toml", &own);
    PROGRAM.stdout_of(&dir, "convert a.hpgl -m lisa -o plan.ticks");
    for command in ["info plan.ticks", "verify plan.ticks -d a.hpgl", "preview plan.ticks -o plan.svg"] {
        PROGRAM.stdout_of(&dir, command);
    }
    // Elsewhere the message names the way out.
    fs::remove_dir_all(dir.path().join("config")).expect("the folder goes");
    let said = PROGRAM.refuse(&dir, "info plan.ticks", 2);
    assert!(said.contains("--machine FILE.toml"), "{said}");
}

#[test]
fn foreign_file_is_named_in_one_line() {
    let dir = TestDir::new();
    dir.write("a.pdf", "%PDF-1.4\n1 0 obj\n<</Type/Catalog>>\nendobj\n");
    dir.write("cut.cut", "H1*G71*M70*D2*M15*X5668Y1730M31*S:XL-AN:ARKA*D2*M15*X5928Y1730*M14*X6638Y0*M0*");
    dir.write("a.gcode", "G21\nG90\nG0 X10 Y10\nG1 X20 Y20 F600\n");
    let machine = PROGRAM.stdout_of(&dir, "machine show polar");
    dir.write("m.toml", machine);
    for (file, what) in [
        ("a.pdf", "a PDF document"),
        ("cut.cut", "a cutting machine's file"),
        ("a.gcode", "G-code"),
        ("m.toml", "a machine file"),
    ] {
        for command in ["convert FILE -m corexy", "check FILE", "info FILE", "preview FILE -o x.svg"] {
            let said = PROGRAM.refuse(&dir, &command.replace("FILE", file), 1);
            assert!(said.contains(what) && said.lines().count() == 1, "{said}");
        }
    }
    assert!(!dir.path().join("x.svg").exists());
}

#[test]
fn plan_is_not_taken_for_a_drawing() {
    let dir = TestDir::new();
    dir.write("a.hpgl", SQUARE);
    PROGRAM.stdout_of(&dir, "convert a.hpgl -m cartesian -o plan.ticks");
    for command in ["check plan.ticks", "convert plan.ticks -m cartesian", "verify plan.ticks -d plan.ticks"]
    {
        let said = PROGRAM.refuse(&dir, command, 1);
        assert!(said.contains("is a plan, not a drawing"), "{said}");
    }
}

#[test]
fn options_without_effect_are_refused() {
    let dir = TestDir::new();
    dir.write("a.hpgl", SQUARE);
    for command in [
        "convert a.hpgl --format svg --law sine",
        "convert a.hpgl --format hpgl --effort 3",
        "convert a.hpgl -m corexy --segment-time 2s",
        "convert a.hpgl -m corexy --hpgl2",
        "convert a.hpgl -m corexy --pen-by servo",
        "convert a.hpgl -m corexy --order file --effort 3",
        "check a.hpgl --tolerance 1mm",
    ] {
        let said = PROGRAM.refuse(&dir, command, 2);
        assert!(said.contains("has no effect"), "plotplan {command}\n{said}");
    }
}

#[test]
fn format_follows_the_extension_of_the_output() {
    let dir = TestDir::new();
    dir.write("a.hpgl", SQUARE);
    for (name, begins) in
        [("p.csv", "# plotplan: 1"), ("p.json", "{"), ("p.ticks", "; plotplan: 1"), ("p", "; plotplan: 1")]
    {
        PROGRAM.stdout_of(&dir, &format!("convert a.hpgl -m corexy -o {name}"));
        assert!(dir.text(name).starts_with(begins), "{name}");
    }
    for (name, begins) in [("p.svg", "<svg"), ("p.plt", "IN;")] {
        PROGRAM.stdout_of(&dir, &format!("convert a.hpgl -o {name}"));
        assert!(dir.text(name).contains(begins), "{name}");
    }
    for command in ["convert a.hpgl -m corexy -f csv -o x.json", "convert a.hpgl -f svg -o x.csv"] {
        let said = PROGRAM.refuse(&dir, command, 2);
        assert!(said.contains("contradicts the extension"), "{said}");
    }
    assert!(!dir.path().join("x.json").exists());
}
