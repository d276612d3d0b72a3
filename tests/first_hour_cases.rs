//! Small inputs on which the program once did the wrong thing, by their kinds. The inputs are our own.

use test_support::{Program, TestDir, stderr, stdout};

const PROGRAM: Program = Program::new(env!("CARGO_BIN_EXE_plotplan"));

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
        let output = PROGRAM.run(&dir, "convert circle.hpgl -m arm.toml -o plan.csv");
        assert!(output.status.success(), "{name}: {}", stderr(&output));
        PROGRAM.succeed(&dir, "verify plan.csv -m arm.toml --drawing circle.hpgl");
    }
    dir.write("circle.hpgl", "IN;SP1;PU2000,2000;CI1200;PU;");
    PROGRAM.succeed(&dir, "convert circle.hpgl -m arm.toml --fit -o plan.csv");
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
            let output = PROGRAM.run(&dir, &format!("convert a.hpgl -m {machine} -o plan.csv"));
            let text = stderr(&output);
            for (promise, options) in
                [("--align center puts it", "--align center"), ("--fit makes it fit", "--fit")]
            {
                if text.contains(promise) {
                    PROGRAM.succeed(&dir, &format!("convert a.hpgl -m {machine} -o plan.csv {options}"));
                }
            }
        }
    }
}

#[test]
fn point_at_the_base_is_refused_with_one_message_that_makes_sense() {
    let dir = TestDir::new();
    let free = ARM.replace("theta = { min = \"-185deg\", max = \"185deg\" }", "");
    let with =
        |least: &str| free.replace("elbow = \"left\"", &format!("elbow = \"left\"\nmin_dexterity = {least}"));
    dir.write("cross.hpgl", "IN;SP1;PU1000,2000;PD3000,2000;PU;");
    dir.write("arm.toml", with("0"));
    let text = PROGRAM.refuse(&dir, "convert cross.hpgl -m arm.toml", 2);
    assert!(text.contains("min_dexterity must be at least 0.001, not 0"), "{text}");
    dir.write("arm.toml", with("0.001"));
    let text = PROGRAM.fail(&dir, "convert cross.hpgl -m arm.toml", 1);
    assert!(text.contains("the arm would have to fold completely"), "{text}");
    assert!(!text.contains("0.00 mm too near") && !text.contains("manipulability 0.000"), "{text}");
}

#[test]
fn singularity_names_the_key_that_moves_it() {
    let dir = TestDir::new();
    let polar = String::from_utf8(PROGRAM.succeed(&dir, "machine show polar").stdout).expect("text");
    let wide = polar.replace("min = \"48mm\"", "min = \"0mm\"");
    assert_ne!(wide, polar);
    dir.write("polar.toml", &wide);
    // 0.5 mm above the pole of the machine, which is at 138, 0 on its sheet.
    dir.write("line.hpgl", "IN;SP1;PU4000,20;PD7000,20;PU;");
    let text = PROGRAM.fail(&dir, "convert line.hpgl -m polar.toml", 1);
    assert!(text.contains("min_dexterity in [geometry]"), "{text}");
    let near = wide.replace("kind = \"polar\" ", "min_dexterity = 0.04\nkind = \"polar\" ");
    assert_ne!(near, wide);
    dir.write("near.toml", near);
    PROGRAM.succeed(&dir, "convert line.hpgl -m near.toml -o plan.csv");
}

/// The preset's half ring, with a rack that goes in as far as the pole.
fn polar_to_the_pole() -> String {
    let preset = compiler::machine_file::PRESETS.iter().find(|preset| preset.name == "polar");
    let toml = preset.expect("a preset").toml;
    let ranged = toml.replace("r = { min = \"48mm\"", "r = { min = \"0mm\"");
    assert_ne!(ranged, toml);
    ranged
}

#[test]
fn lines_through_the_pole_are_drawn_with_a_lift_there() {
    let dir = TestDir::new();
    dir.write("polar.toml", polar_to_the_pole());
    // The pole is at 138, 0 on the sheet: 5520, 0.
    for (name, downs, drawing) in [
        ("through along the edge", 2, "IN;SP1;PU0,0;PD8000,0;PU;"),
        ("bent at the pole", 2, "IN;SP1;PU1520,1000;PD5520,0,7520,2000;PU;"),
        ("there and back", 2, "IN;SP1;PU5520,3000;PD5520,0,5520,3000;PU;"),
        ("from the pole", 1, "IN;SP1;PU5520,0;PD5520,2000,3520,2000;PU;"),
        ("to the pole after a corner", 1, "IN;SP1;PU3520,2000;PD5520,2000,5520,0;PU;"),
        ("two strokes that meet there", 2, "IN;SP1;PU3520,2000;PD5520,0;PU;PU5520,0;PD7520,2000;PU;"),
    ] {
        dir.write("pole.hpgl", drawing);
        PROGRAM.succeed(&dir, "convert pole.hpgl -m polar.toml -o plan.csv");
        let output = PROGRAM.succeed(&dir, "verify plan.csv -m polar.toml -d pole.hpgl");
        let text = stdout(&output);
        assert!(text.contains("certificate holds"), "{name}: {text}");
        let rows: Vec<String> = dir
            .text("plan.csv")
            .lines()
            .filter(|line| !line.starts_with('#'))
            .map(ToOwned::to_owned)
            .collect();
        let pens: Vec<&str> = rows[1..].iter().map(|row| row.split(',').nth(1).expect("a pen")).collect();
        let lowered = pens.windows(2).filter(|pair| pair[0] == "0" && pair[1] != "0").count();
        assert_eq!(lowered, downs, "{name}");
    }
    // A curve through the pole cannot be drawn: the rail would have to turn by its tangent.
    dir.write("pole.hpgl", "IN;SP1;PU5520,0;PD;AA5520,1000,180;PU;");
    let message = PROGRAM.fail(&dir, "convert pole.hpgl -m polar.toml", 1);
    assert!(message.contains("min_dexterity"), "{message}");
}

#[test]
fn empty_file_is_called_empty() {
    let dir = TestDir::new();
    for (content, what) in [
        ("", "is empty"),
        (" \r\n", "holds blanks and line ends only"),
        ("IN;SP1;PU;", "draws nothing: no ink in its 3 commands"),
    ] {
        dir.write("a.hpgl", content);
        for command in ["info a.hpgl", "check a.hpgl", "convert a.hpgl -m corexy", "preview a.hpgl -o a.svg"]
        {
            let message = PROGRAM.fail(&dir, command, 1);
            assert!(message.contains(&format!("a.hpgl {what}")), "{command}: {message}");
        }
    }
}

#[test]
fn sheet_without_a_machine_is_looked_at() {
    let dir = TestDir::new();
    dir.write("a.hpgl", "IN;SP1;PU0,0;PD16000,11000;PU;");
    for command in ["check", "info"] {
        let beyond = PROGRAM.succeed(&dir, &format!("{command} a.hpgl --paper A4"));
        assert!(stderr(&beyond).contains("190.00 mm beyond the sheet"), "{}", stderr(&beyond));
        let fits = PROGRAM.succeed(&dir, &format!("{command} a.hpgl --paper A4 --fit --margin 10mm"));
        let text = stdout(&fits);
        assert!(text.contains("all of it on the sheet"), "{text}");
        PROGRAM.fail(&dir, &format!("{command} a.hpgl --paper A4 --strict"), 1);
    }
}

#[test]
fn colours_of_several_drawings_have_a_pen_each() {
    let dir = TestDir::new();
    for (name, color) in [("a", "red"), ("b", "blue"), ("c", "red")] {
        let svg = format!(
            "<svg xmlns='http://www.w3.org/2000/svg' width='90mm' height='90mm'><path d='M9 9h90' stroke='{color}'/></svg>"
        );
        dir.write(&format!("{name}.svg"), svg);
    }
    let output = PROGRAM.succeed(&dir, "convert a.svg b.svg c.svg -o all.svg");
    assert_eq!(stderr(&output), "");
    let svg = dir.text("all.svg");
    let strokes_of = |layer: &str| {
        svg.split(layer)
            .nth(1)
            .map_or(0, |rest| rest.split("</g>").next().unwrap_or("").matches("<path").count())
    };
    assert_eq!((strokes_of("id=\"pen1\""), strokes_of("id=\"pen2\"")), (2, 1), "{svg}");
}

#[test]
fn white_pens_are_reported_or_skipped() {
    let dir = TestDir::new();
    dir.write("white.hpgl", "IN;NP4;PC2,255,255,255;SP1;PU0,0;PD800,0;PU;SP2;PU0,400;PD800,400;PU;SP0;");
    let drawn = PROGRAM.succeed(&dir, "check white.hpgl");
    assert!(stderr(&drawn).contains("warning[H0229]: pen 2 is white (PC)"), "{}", stderr(&drawn));
    assert!(stderr(&drawn).contains("--white-pens skip"), "{}", stderr(&drawn));
    assert!(String::from_utf8_lossy(&drawn.stdout).contains("pens 1, 2"));
    let skipped = PROGRAM.succeed(&dir, "check white.hpgl --white-pens skip --strict");
    assert!(String::from_utf8_lossy(&skipped.stdout).contains("20.0 mm of ink"), "{}", stderr(&skipped));
    assert!(stderr(&skipped).contains("note[H0229]"), "{}", stderr(&skipped));
    dir.write("a.svg", "<svg xmlns='http://www.w3.org/2000/svg'><path d='M0 0H9' stroke='#000'/></svg>");
    assert!(PROGRAM.fail(&dir, "check a.svg --white-pens skip", 2).contains("no effect"));
}

#[test]
fn page_that_was_not_asked_for_is_a_warning() {
    let dir = TestDir::new();
    dir.write("pages.hpgl", "IN;SP1;PU0,0;PD400,0;PU;PG;SP1;PU0,0;PD0,400;PU;PG;");
    for command in
        ["convert pages.hpgl -m corexy -o p.csv", "preview pages.hpgl -o p.svg", "check pages.hpgl -m corexy"]
    {
        let output = PROGRAM.succeed(&dir, command);
        assert!(stderr(&output).contains("has 2 pages; this is page 1"), "{command}: {}", stderr(&output));
        PROGRAM.fail(&dir, &format!("{command} --strict"), 1);
        PROGRAM.succeed(&dir, &format!("{command} --strict --page 1"));
        PROGRAM.succeed(&dir, &format!("{command} --strict --page 2"));
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
            let output = PROGRAM.run(&dir, &command.replace("FILE", file));
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
    PROGRAM.succeed(&dir, "preview circle.hpgl -o circle.svg");
    let svg = dir.text("circle.svg");
    assert!(svg.contains("A2.000 2.000"), "{svg}");
    // To standard output as well, in both formats.
    assert_eq!(String::from_utf8_lossy(&PROGRAM.succeed(&dir, "preview circle.hpgl -o -").stdout), svg);
    let png = PROGRAM.succeed(&dir, "preview circle.hpgl -o - --format png").stdout;
    assert!(png.starts_with(b"\x89PNG\r\n\x1a\n"));
    assert!(PROGRAM.fail(&dir, "preview circle.hpgl -o circle.svg --format png", 2).contains("contradicts"));
}

#[test]
fn picture_of_a_machine_shows_reach_sheet_start_and_resolution() {
    let dir = TestDir::new();
    dir.write("arm.toml", ARM);
    for machine in ["coaxial", "polar", "cartesian", "arm.toml"] {
        let svg = String::from_utf8(PROGRAM.succeed(&dir, &format!("machine preview {machine} -o -")).stdout)
            .expect("SVG");
        for part in ["id=\"reach\"", "id=\"sheet\"", "id=\"start\"", "id=\"shades\"", "tick floor"] {
            assert!(svg.contains(part), "{machine}: no {part}");
        }
        let size = svg.len();
        assert!(size < 400_000, "{machine}: {size} bytes");
    }
    PROGRAM.succeed(&dir, "machine preview coaxial -o arm.png");
    assert!(dir.bytes("arm.png").starts_with(b"\x89PNG\r\n\x1a\n"));
    assert!(PROGRAM.fail(&dir, "machine preview coxial -o arm.png", 2).contains("did you mean coaxial?"));
}

#[test]
fn pen_positions_of_a_z_axis_have_fractions() {
    let dir = TestDir::new();
    dir.write("a.hpgl", "IN;SP1;PU400,400;PD1200,400;PU;");
    let command = "convert a.hpgl -m cartesian -f gcode-grbl -o a.gcode --pen-positions 5,-0.5";
    PROGRAM.succeed(&dir, &format!("{command} --pen-by z"));
    let gcode = dir.text("a.gcode");
    assert!(gcode.contains("Z-0.5") && gcode.contains("Z5\n"), "{gcode}");
    assert!(PROGRAM.fail(&dir, command, 2).contains("a servo takes whole numbers"));
}

#[test]
fn info_of_a_gcode_file_of_ours() {
    let dir = TestDir::new();
    dir.write("a.hpgl", "IN;SP1;PU400,400;PD1200,400;PU;SP2;PU2000,2000;CI400;PU;");
    let command = "convert a.hpgl -m cartesian -o a.gcode --format";
    for format in ["gcode-grbl", "gcode-marlin", "gcode-klipper"] {
        PROGRAM.succeed(&dir, &format!("{command} {format}"));
        let report = PROGRAM.succeed(&dir, "info a.gcode --report json").stdout;
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
    let text = String::from_utf8(PROGRAM.succeed(&dir, "info a.gcode").stdout).expect("text");
    assert!(text.contains("(G-code)") && text.contains("pen 2"), "{text}");
}

#[test]
fn empty_names_are_refused() {
    let dir = TestDir::new();
    dir.write("a.hpgl", "IN;SP1;PU400,400;PD800,800;PU;");
    for (option, file) in [("--machine=", "a.hpgl"), ("--output=", "a.hpgl"), ("--paper=", "a.hpgl")] {
        let message = PROGRAM.refuse(&dir, &format!("convert {file} {option}"), 2);
        assert!(message.contains("a value is required"), "{message}");
    }
    let message = PROGRAM.refuse(&dir, "send a.ticks --protocol ticks --port=", 2);
    assert!(message.contains("a value is required"), "{message}");
}

#[test]
fn folder_that_is_missing_is_named() {
    let dir = TestDir::new();
    dir.write("a.hpgl", "IN;SP1;PU400,400;PD800,800;PU;");
    let message = PROGRAM.fail(&dir, "convert a.hpgl -m corexy -o no/such/plan.csv", 3);
    assert!(message.contains("there is no folder no/such"), "{message}");
}

#[test]
fn plan_is_shown_on_its_own_machine_only() {
    let dir = TestDir::new();
    dir.write("a.hpgl", "IN;SP1;PU400,400;PD800,800;PU;");
    PROGRAM.succeed(&dir, "convert a.hpgl -m corexy -o plan.ticks");
    for command in ["info plan.ticks -m polar", "preview plan.ticks -m polar -o x.svg"] {
        let message = PROGRAM.refuse(&dir, command, 2);
        assert!(message.contains("the plan was made for machine corexy, not for polar"), "{message}");
    }
    // The same motors under another name: a warning.
    let preset = compiler::machine_file::PRESETS.iter().find(|preset| preset.name == "corexy");
    dir.write("mine.toml", preset.expect("a preset").toml.replace("name = \"corexy\"", "name = \"mine\""));
    let output = PROGRAM.succeed(&dir, "preview plan.ticks -m mine.toml -o x.svg");
    assert!(stderr(&output).contains("warning"), "{}", stderr(&output));
}

#[test]
fn drawing_is_not_taken_for_a_plan() {
    let dir = TestDir::new();
    dir.write("a.hpgl", "IN;SP1;PU400,400;PD800,800;PU;");
    dir.write("a.svg", "<svg xmlns='http://www.w3.org/2000/svg'><path d='M0 0L9 9' stroke='red'/></svg>");
    dir.write("a.pdf", "%PDF-1.4\n");
    for (file, what) in [("a.hpgl", "a drawing (HP-GL)"), ("a.svg", "a drawing (SVG)"), ("a.pdf", "PDF")] {
        let message = PROGRAM.fail(&dir, &format!("verify {file}"), 1);
        assert!(message.contains(what) && message.contains("not a plan"), "{message}");
    }
}

#[test]
fn every_code_of_a_message_is_explained() {
    let dir = TestDir::new();
    for code in compiler::report::Code::ALL {
        let text = PROGRAM.stdout_of(&dir, &format!("explain {}", code.name()));
        assert!(text.contains(code.meaning()), "{text}");
    }
    assert!(PROGRAM.refuse(&dir, "explain nonsense", 2).contains("H0101"));
}

#[test]
fn numbers_beyond_all_sense_are_refused() {
    let dir = TestDir::new();
    dir.write("a.hpgl", "IN;SP1;PU400,400;PD800,800;PU;");
    for (option, what) in [("--rotate 1e308", "a full turn"), ("--tolerance 1e9", "to 10 mm")] {
        let message = PROGRAM.refuse(&dir, &format!("convert a.hpgl -m corexy {option}"), 2);
        assert!(message.contains(what), "{message}");
    }
    let message = PROGRAM.fail(&dir, "convert a.hpgl -m corexy --place 1e300,0", 1);
    assert!(message.contains("1.00e300"), "{message}");
    assert!(message.lines().all(|line| line.len() < 300), "{message}");
}

#[test]
fn machine_file_errors_give_the_line_of_the_value() {
    let dir = TestDir::new();
    let preset = compiler::machine_file::PRESETS.iter().find(|preset| preset.name == "coaxial");
    let toml = preset.expect("a preset").toml;
    for (from, to) in [("l1 = \"206mm\"", "l1 = \"206deg\""), ("theta = \"90deg\"", "theta = \"400\"")] {
        let changed = toml.replacen(from, to, 1);
        let line = changed.lines().position(|line| line.contains(to)).expect("the line") + 1;
        dir.write("m.toml", changed);
        let message = PROGRAM.fail(&dir, "machine check m.toml", 2);
        assert!(message.contains(&format!("line {line}: ")), "{message}");
    }
}

#[test]
fn resuming_beyond_the_end_is_refused_before_the_port_is_opened() {
    let dir = TestDir::new();
    dir.write("a.hpgl", "IN;SP1;PU400,400;PD800,800;PU;PU0,0;PD400,0;PU;");
    PROGRAM.succeed(&dir, "convert a.hpgl -m corexy -o plan.ticks");
    let strokes = PROGRAM.refuse(&dir, "send a.hpgl --protocol hpgl --port no-port --from 99", 2);
    assert!(strokes.contains("the drawing has 2 strokes: --from takes 0 to 2, not 99"), "{strokes}");
    let rows = PROGRAM.refuse(&dir, "send plan.ticks --protocol ticks --port no-port --from 99999", 2);
    assert!(rows.contains("the plan has rows 0 to"), "{rows}");
}

#[test]
fn plan_of_an_unknown_machine_asks_for_its_file() {
    let dir = TestDir::new();
    dir.write("a.hpgl", "IN;SP1;PU400,400;PD800,800;PU;");
    let preset = compiler::machine_file::PRESETS.iter().find(|preset| preset.name == "corexy");
    dir.write("mine.toml", preset.expect("a preset").toml.replace("name = \"corexy\"", "name = \"mine\""));
    PROGRAM.succeed(&dir, "convert a.hpgl -m mine.toml -o plan.ticks");
    for command in ["info plan.ticks", "preview plan.ticks -o x.svg", "verify plan.ticks"] {
        let message = PROGRAM.refuse(&dir, command, 2);
        assert!(message.contains("plan.ticks was made for the machine mine"), "{message}");
        assert!(message.contains("--machine FILE.toml") && !message.contains("did you mean"), "{message}");
    }
}

#[test]
fn axidraw_is_fast_enough_for_its_own_format_only() {
    let dir = TestDir::new();
    // Long travel along the directions in which one motor does all the work.
    dir.write("a.hpgl", "IN;SP1;PU0,0;PD400,400;PU8000,8000;PD8400,8400;PU0,8000;PD400,7600;PU;");
    PROGRAM.succeed(&dir, "convert a.hpgl -m axidraw --format ebb -o a.ebb");
}

#[test]
fn text_outside_of_layers_does_not_take_the_name_of_one() {
    let dir = TestDir::new();
    dir.write(
        "a.svg",
        "<svg xmlns='http://www.w3.org/2000/svg' xmlns:inkscape='http://www.inkscape.org/namespaces/inkscape' width='90mm' height='90mm'>\
         <g inkscape:groupmode='layer' inkscape:label='1 black'><path d='M9 9h90' stroke='black'/></g>\
         <path d='M9 99h90' stroke='black'/></svg>",
    );
    let text = PROGRAM.stdout_of(&dir, "info a.svg");
    assert_eq!(text.matches("\"1 black\"").count(), 1, "{text}");
}
