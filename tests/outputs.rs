//! Drawings as output, pens, crop, copies, and several files in one command.

use std::fmt::Write as _;

use test_support::{Program, TestDir};

const PROGRAM: Program = Program::new(env!("CARGO_BIN_EXE_plotplan"));

/// Squares of 20 mm: pen 1 at (10, 10), pen 2 at (60, 10), pen 1 at (20, 60) mm.
const SQUARES: &str = "IN;SP1;PU400,400;PD1200,400,1200,1200,400,1200,400,400;PU;SP2;PU2400,400;PD3200,400,3200,1200,\
                       2400,1200,2400,400;PU;SP1;PU800,2400;PD1600,2400,1600,3200,800,3200,800,2400;PU;";
/// A circle of 20 mm radius about (50, 250) mm of an A4 page, red, in a layer with a number.
const CIRCLE: &str = r##"<svg xmlns="http://www.w3.org/2000/svg" xmlns:inkscape="http://www.inkscape.org/namespaces/inkscape" width="210mm" height="297mm" viewBox="0 0 210 297"><g inkscape:groupmode="layer" inkscape:label="4 red"><circle cx="50" cy="47" r="20" fill="none" stroke="#cc0000"/></g></svg>"##;

fn drawings() -> TestDir {
    let dir = TestDir::new();
    dir.write("a.hpgl", SQUARES);
    dir.write("b.svg", CIRCLE);
    dir
}

/// Ink of a file by `check`: strokes, length, bounds and pens.
fn check(dir: &TestDir, file: &str) -> String {
    let text = PROGRAM.stdout_of(dir, &format!("check {file}"));
    text.lines().last().unwrap_or_default().to_owned()
}

#[test]
fn hpgl_output_honours_placement_and_crop() {
    let dir = drawings();
    for (options, expected) in [
        ("", "240.0 mm of ink from 10.00, 10.00 to 80.00, 80.00"),
        ("--scale 0.5", "120.0 mm of ink from 5.00, 5.00 to 40.00, 40.00"),
        ("--place 5,0", "240.0 mm of ink from 15.00, 10.00 to 85.00, 80.00"),
        ("--mirror x", "240.0 mm of ink from 10.00, 10.00 to 80.00, 80.00"),
        ("--rotate 90 --scale 2", "480.0 mm of ink from 20.00, 20.00 to 160.00, 160.00"),
        ("--paper A4 --align top-right", "240.0 mm of ink from 140.00, 227.00 to 210.00, 297.00"),
        (
            "--paper A4 --align top-right --margin 10mm",
            "240.0 mm of ink from 130.00, 217.00 to 200.00, 287.00",
        ),
        ("--paper 84x1000mm --fit --margin 7mm", "240.0 mm of ink from 7.00, 465.00 to 77.00, 535.00"),
        ("--paper 200x200 --shrink", "240.0 mm of ink from 65.00, 65.00 to 135.00, 135.00"),
        ("--crop 20,10,100,100", "200.0 mm of ink from 20.00, 10.00 to 80.00, 80.00"),
        ("--paper 70x70 --crop sheet", "160.0 mm of ink from 10.00, 10.00 to 70.00, 70.00"),
        ("--machine corexy --place 1,1", "240.0 mm of ink from 11.00, 11.00 to 81.00, 81.00"),
    ] {
        PROGRAM.stdout_of(&dir, &format!("convert a.hpgl -o out.hpgl {options}"));
        let found = check(&dir, "out.hpgl");
        assert!(found.contains(expected), "{options}: {found}, expected {expected}");
    }
    // Nothing changes without options.
    PROGRAM.stdout_of(&dir, "convert a.hpgl -o once.hpgl");
    PROGRAM.stdout_of(&dir, "convert once.hpgl -o twice.hpgl");
    assert_eq!(dir.text("once.hpgl"), dir.text("twice.hpgl"));
}

#[test]
fn drawing_output_for_a_machine_plans_as_the_drawing_does() {
    let dir = drawings();
    let options = "--machine coaxial --fit --rotate 30";
    PROGRAM.stdout_of(&dir, &format!("convert a.hpgl {options} -o direct.csv"));
    PROGRAM.stdout_of(&dir, &format!("convert a.hpgl {options} --order optimize -o placed.svg"));
    PROGRAM.stdout_of(&dir, "convert placed.svg --machine coaxial --order file -o later.csv");
    let ticks = |file: &str| -> Vec<String> {
        dir.text(file)
            .lines()
            .filter(|line| line.starts_with(|c: char| c.is_ascii_digit()))
            .map(str::to_owned)
            .collect()
    };
    let (direct, later) = (ticks("direct.csv"), ticks("later.csv"));
    let difference = direct.len().abs_diff(later.len());
    assert!(difference * 50 < direct.len(), "{} rows, {} rows", direct.len(), later.len());
}

#[test]
fn svg_output_keeps_sheet_colours_and_arcs() {
    let dir = drawings();
    PROGRAM.stdout_of(&dir, "convert b.svg -o out.svg --paper A3,landscape --crop 40,240,20,100");
    let svg = dir.text("out.svg");
    assert!(
        svg.contains(r#"width="420.000mm" height="297.000mm" viewBox="0.000 -297.000 420.000 297.000""#),
        "{svg}"
    );
    assert!(svg.contains(r##"inkscape:label="pen 4" stroke="#cc0000""##), "{svg}");
    let paths = svg.lines().filter(|line| line.starts_with("<path"));
    assert!(paths.clone().count() == 1 && paths.clone().all(|path| path.contains("A20.000 20.000")), "{svg}");
    assert!(PROGRAM.stdout_of(&dir, "info out.svg").contains("#cc0000"));
    for picture in ["p.svg --paper A4", "q.svg --machine corexy"] {
        PROGRAM.stdout_of(&dir, &format!("preview b.svg -o {picture}"));
        assert!(dir.text(&picture[..5]).contains(r##"id="pen4" stroke="#cc0000""##));
    }
}

#[test]
fn pens_are_selected_and_renumbered() {
    let dir = drawings();
    for (options, expected) in [
        ("--only-pens 2", "1 stroke, 80.0 mm of ink from 60.00, 10.00 to 80.00, 30.00 mm, pens 2"),
        ("--pen-map 2=5", "3 strokes, 240.0 mm of ink from 10.00, 10.00 to 80.00, 80.00 mm, pens 1, 5"),
        (
            "--pen-map 1=2,2=1 --only-pens 1",
            "2 strokes, 160.0 mm of ink from 10.00, 10.00 to 40.00, 80.00 mm, pens 2",
        ),
    ] {
        let text = PROGRAM.stdout_of(&dir, &format!("check a.hpgl {options}"));
        assert!(text.contains(expected), "{options}: {text}");
        PROGRAM.stdout_of(&dir, &format!("convert a.hpgl {options} -o out.hpgl"));
        assert!(check(&dir, "out.hpgl").contains(expected), "{options}");
    }
    assert!(PROGRAM.fail(&dir, "convert a.hpgl --only-pens 3,7 -o x.hpgl", 1).contains("leaves nothing"));
    let output = PROGRAM.run(&dir, "check a.hpgl --only-pens 2,7");
    assert!(String::from_utf8_lossy(&output.stderr).contains("no stroke has pen 7"));
    // A plan of selected pens is verified with the same selection.
    PROGRAM.stdout_of(&dir, "convert a.hpgl --machine corexy --only-pens 2 --crop 0,0,70,70 -o plan.csv");
    PROGRAM.stdout_of(&dir, "verify plan.csv --drawing a.hpgl --only-pens 2 --crop 0,0,70,70");
    PROGRAM.fail(&dir, "verify plan.csv --drawing a.hpgl", 1);
}

#[test]
fn ordering_of_drawing_outputs_reduces_travel_and_removes_duplicates() {
    let dir = TestDir::new();
    let mut file = "IN;SP1;".to_owned();
    for k in [0, 7, 2, 9, 4, 1, 8, 3, 6, 5, 0, 7] {
        write!(file, "PU{0},0;PD{0},400;", 400 * k).expect("text");
    }
    dir.write("lines.hpgl", file);
    PROGRAM.stdout_of(&dir, "convert lines.hpgl -o same.hpgl");
    assert_eq!(dir.text("same.hpgl").matches("PU").count(), 13);
    PROGRAM.stdout_of(&dir, "convert lines.hpgl --dedupe -o single.hpgl");
    let single = dir.text("single.hpgl");
    assert_eq!(single.matches("PU").count(), 11);
    assert!(single.starts_with("IN;\nSP1;\nPU0,0;PD0,400;\nPU2800,0;"), "the file's order stays: {single}");
    let output = PROGRAM.run(&dir, "convert lines.hpgl --dedupe --order optimize -o sorted.hpgl");
    let report = String::from_utf8_lossy(&output.stderr).into_owned();
    // Up and down over 90 mm.
    assert!(report.contains("strokes  10 of 12"), "{report}");
    assert!(report.contains("travel   90.0 mm"), "{report}");
    let sorted = dir.text("sorted.hpgl");
    let starts = ["SP1;\nPU0,0;PD0,400;\nPU400,400;", "SP1;\nPU0,400;PD0,0;\nPU400,0;"];
    let ends = ["SP1;\nPU3600,0;PD3600,400;\nPU3200,400;", "SP1;\nPU3600,400;PD3600,0;\nPU3200,0;"];
    assert!(starts.iter().chain(&ends).any(|start| sorted.contains(start)), "{sorted}");
    PROGRAM.stdout_of(&dir, "convert lines.hpgl --dedupe --order file --machine corexy -o plan.csv");
}

#[test]
fn options_that_need_a_sheet_ask_for_one() {
    let dir = drawings();
    for option in ["--fit", "--align center", "--shrink", "--crop sheet"] {
        let message = PROGRAM.fail(&dir, &format!("convert a.hpgl -o x.svg {option}"), 2);
        assert!(message.contains("needs a sheet: give --paper or --machine"), "{message}");
    }
    assert!(PROGRAM.fail(&dir, "convert a.hpgl -o x.svg --law sine", 2).contains("it holds no motion"));
    assert!(PROGRAM.fail(&dir, "convert a.hpgl -o x.svg --effort 1", 2).contains("--order optimize"));
    assert!(PROGRAM.fail(&dir, "convert a.hpgl -o x.svg --gap 5mm", 2).contains("without --copies"));
    assert!(
        PROGRAM.fail(&dir, "convert a.hpgl -o x.svg --crop 500,500,5,5", 1).contains("no ink lies within")
    );
}

#[test]
fn several_files_are_drawn_over_each_other() {
    let dir = drawings();
    PROGRAM.stdout_of(&dir, "convert a.hpgl b.svg -o both.svg");
    let found = check(&dir, "both.svg");
    assert!(found.starts_with("4 strokes, 365.7 mm of ink"), "{found}");
    assert!(found.ends_with("pens 1, 2, 4"), "{found}");
    PROGRAM.stdout_of(&dir, "convert a.hpgl b.svg --hatch 2mm --copies 3x2 --gap 5mm -o grid.hpgl");
    assert!(
        check(&dir, "grid.hpgl").starts_with("24 strokes, 2.19 m of ink"),
        "{}",
        check(&dir, "grid.hpgl")
    );
    assert!(PROGRAM.fail(&dir, "convert a.hpgl a.hpgl --hatch 2mm -o x.hpgl", 2).contains("no effect"));
    PROGRAM.stdout_of(&dir, "preview a.hpgl b.svg -o both.png");
    // A plan of two drawings names both, and verifies against both.
    PROGRAM.stdout_of(&dir, "convert a.hpgl b.svg --machine corexy --fit -o both.json");
    assert!(dir.text("both.json").contains("a.hpgl + b.svg"));
    PROGRAM.stdout_of(&dir, "verify both.json --drawing a.hpgl --drawing b.svg");
}

#[test]
fn pages_and_pens_are_written_to_files_of_their_own() {
    let dir = drawings();
    dir.write("pages.hpgl", "IN;SP1;PU0,0;PD400,0;PG;SP2;PU0,0;PD800,0;SP3;PU0,0;PD0,400;PG;");
    PROGRAM.stdout_of(&dir, "convert pages.hpgl --page all -o out-%p.hpgl");
    assert!(check(&dir, "out-1.hpgl").starts_with("1 stroke, 10.0 mm"));
    assert!(check(&dir, "out-2.hpgl").starts_with("2 strokes, 30.0 mm"));
    PROGRAM.stdout_of(&dir, "convert pages.hpgl --page 2 --split pens -o pen%p.hpgl");
    assert!(check(&dir, "pen2.hpgl").starts_with("1 stroke, 20.0 mm"));
    assert!(check(&dir, "pen3.hpgl").starts_with("1 stroke, 10.0 mm"));
    PROGRAM.stdout_of(&dir, "convert pages.hpgl --page all --split pens -m corexy -o p%p-n%n.json");
    for file in ["p1-n1.json", "p2-n2.json", "p2-n3.json"] {
        assert!(PROGRAM.stdout_of(&dir, &format!("info {file}")).contains("plan"), "{file}");
    }
    // The plan document's own options make the same plan again.
    let document: serde_json::Value = serde_json::from_str(&dir.text("p2-n3.json")).expect("JSON");
    let options = document["settings"]["command_line"].as_array().expect("a list");
    let options: Vec<&str> = options.iter().filter_map(|option| option.as_str()).collect();
    PROGRAM.stdout_of(&dir, &format!("convert pages.hpgl -m corexy -o again.json {}", options.join(" ")));
    let rows = |file: &str| {
        serde_json::from_str::<serde_json::Value>(&dir.text(file)).expect("JSON")["rows"].clone()
    };
    assert_eq!(rows("again.json"), rows("p2-n3.json"));
    assert!(PROGRAM.fail(&dir, "convert pages.hpgl --page all -o one.hpgl", 2).contains("%p"));
    assert!(
        PROGRAM
            .fail(&dir, "convert a.hpgl --split pens -o x.hpgl", 2)
            .contains("--split pens writes several files")
    );
}

#[test]
fn folder_takes_a_file_for_each_drawing() {
    let dir = drawings();
    dir.write("c.pdf", "%PDF-1.4\n");
    let message = PROGRAM.fail(&dir, "convert a.hpgl b.svg c.pdf -o plans/ -m corexy --fit", 1);
    assert!(message.contains("a.hpgl -> plans/a.ticks: "), "{message}");
    assert!(message.contains("c.pdf: this is a PDF document"), "{message}");
    assert!(message.ends_with("2 of 3 drawings converted\n"), "{message}");
    for plan in ["plans/a.ticks", "plans/b.ticks"] {
        assert!(PROGRAM.stdout_of(&dir, &format!("info {plan}")).contains("corexy"));
    }
    PROGRAM.stdout_of(&dir, "convert a.hpgl b.svg -o plans --format hpgl");
    assert_eq!(check(&dir, "plans/a.hpgl"), check(&dir, "a.hpgl"));
    PROGRAM.stdout_of(&dir, "convert a.hpgl b.svg -o plans/%f-small.svg --scale 0.1");
    assert!(check(&dir, "plans/a-small.svg").contains("24.0 mm of ink"));
    // An output never replaces an input, whichever is read first; two outputs never share a name.
    let message = PROGRAM.fail(&dir, "convert b.svg a.hpgl -o ./%f.hpgl", 1);
    assert!(message.contains("an output does not replace an input"), "{message}");
    assert_eq!(dir.text("a.hpgl"), SQUARES);
    assert!(
        PROGRAM
            .fail(&dir, "convert a.hpgl plans/a.hpgl -o plans/ --format svg", 2)
            .contains("would both be written")
    );
}

#[test]
fn options_for_drawings_are_refused_on_plans() {
    let dir = drawings();
    PROGRAM.stdout_of(&dir, "convert a.hpgl -m corexy -o plan.csv");
    for command in
        ["info plan.csv --only-pens 1", "info plan.csv --page 2", "preview plan.csv -o x.svg --scale 2"]
    {
        assert!(PROGRAM.fail(&dir, command, 2).contains("has no effect on a plan"), "{command}");
    }
}
