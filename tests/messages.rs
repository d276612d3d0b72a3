//! Every message of the program, each from a run on a small input, in one snapshot that is read as a
//! newcomer reads it: what is wrong, where, and what to do.

use std::fmt::Write as _;

use assert_cmd::cargo::cargo_bin;
use test_support::TestDir;

const SQUARE: &str = "IN;SP1;PU400,400;PD1200,400,1200,1200,400,1200,400,400;PU;";

fn run(dir: &TestDir, arguments: &str) -> String {
    let mut command = std::process::Command::new(cargo_bin!("plotplan"));
    command.current_dir(dir.path()).args(arguments.split_whitespace());
    command.env("COLUMNS", "100").env("XDG_CONFIG_HOME", dir.path().join("config"));
    command.env_remove("NO_COLOR").env_remove("CLICOLOR_FORCE");
    let output = command.output().expect("the program runs");
    let mut text = String::from_utf8_lossy(&output.stderr).into_owned();
    // What fails is part of the report of verify.
    let stdout = String::from_utf8_lossy(&output.stdout);
    for line in stdout.lines().filter(|line| line.contains("FAILED")) {
        text.extend([line, "\n"]);
    }
    let code = output.status.code().expect("an exit code");
    format!("$ plotplan {arguments}\n{text}[{code}]\n\n")
}

/// Machine files with one mistake each.
fn machines(dir: &TestDir) -> Vec<String> {
    let preset = |name: &str| {
        let preset = compiler::machine_file::PRESETS.iter().find(|preset| preset.name == name);
        preset.expect("a preset").toml
    };
    let mistakes = [
        ("coaxial", "max_speed = \"60deg/s\"", "max_sped = \"60deg/s\""),
        ("coaxial", "l1 = \"206mm\"", "l1 = 206"),
        ("coaxial", "l1 = \"206mm\"", "l1 = \"206\""),
        ("coaxial", "l1 = \"206mm\"", "l1 = \"206deg\""),
        ("coaxial", "l1 = \"206mm\"", "l1 = \"-206mm\""),
        ("coaxial", "l1 = \"206mm\"", "arm = \"206mm\""),
        ("coaxial", "l1 = \"206mm\"", ""),
        ("coaxial", "elbow = \"left\"", "elbow = \"lefft\""),
        ("coaxial", "kind = \"two-link\"", "kind = \"scara\""),
        ("coaxial", "kind = \"two-link\"", ""),
        ("coaxial", "counts = \"3200/rev\"", "counts = 3200"),
        ("coaxial", "counts = \"3200/rev\"", "counts = \"3200\""),
        ("coaxial", "max_acceleration = \"300deg/s2\"", "max_acceleration = \"300deg/s\""),
        ("coaxial", "max_acceleration = \"300deg/s2\"", "max_acceleration = \"0deg/s2\""),
        ("coaxial", "[[1, 0], [0, -1]]", "[[1, 1], [1, 1]]"),
        ("coaxial", "[[1, 0], [0, -1]]", "[[1 - 1/k, 0], [0, -1]]"),
        ("coaxial", "theta = \"90deg\"", "theta = \"400\""),
        ("coaxial", "theta = \"90deg\"", "r = \"90mm\""),
        ("coaxial", "name = \"coaxial\"", ""),
        ("coaxial", "[pen]", "[pens]"),
        ("coaxial", "lift_time = \"150ms\"", "lift_time = \"150\""),
        ("coaxial", "max_speed = \"60mm/s\"", "max_speed = 60"),
        ("polar", "r = { min = \"48mm\"", "r = { min = \"148mm\""),
        ("corexy", "width = \"200mm\"", "width = \"0mm\""),
    ];
    let mut names = Vec::new();
    for (index, (name, from, to)) in mistakes.into_iter().enumerate() {
        let file = format!("m{index:02}.toml");
        let toml = preset(name);
        let changed = toml.replacen(from, to, 1);
        assert_ne!(changed, toml, "{from} is in {name}");
        dir.write(&file, changed);
        names.push(format!("machine check {file}"));
    }
    names
}

/// Command lines with one mistake each.
const ARGUMENTS: &[&str] = &[
    "",
    "plot a.hpgl",
    "convert",
    "convert a.hpgl",
    "convert a.hpgl -m coxial",
    "convert a.hpgl -m typewriter",
    "convert a.hpgl -m nosuch.toml",
    "convert nosuch.hpgl -m corexy",
    "convert a.hpgl -m corexy -o nosuch/plan.csv",
    "convert a.hpgl -m corexy --format gcode",
    "convert a.hpgl -m corexy -f csv -o plan.json",
    "convert a.hpgl -m corexy -o a.hpgl",
    "convert a.hpgl -m corexy --toleranze 1mm",
    "convert a.hpgl -m corexy --tolerance 3parsec",
    "convert a.hpgl -m corexy --tolerance 0",
    "convert a.hpgl -m corexy --period 10",
    "convert a.hpgl -m corexy --scale big",
    "convert a.hpgl -m corexy --rotate left",
    "convert a.hpgl -m corexy --place 10",
    "convert a.hpgl -m corexy --align middle-earth",
    "convert a.hpgl -m corexy --mirror z",
    "convert a.hpgl -m corexy --margin -5mm",
    "convert a.hpgl -m corexy --margin 200mm --fit",
    "convert a.hpgl -m corexy --paper b12",
    "convert a.hpgl -m corexy --fit --scale 2",
    "convert a.hpgl -m corexy --segment-time 2s",
    "convert a.hpgl -m corexy --pen-order red",
    "convert a.hpgl -m corexy -f gcode-grbl --pen-positions up",
    "convert a.hpgl -m corexy -f gcode-grbl --pen-positions 5,-0.5",
    "convert a.hpgl -m corexy --page 3",
    "check a.hpgl --plotter hp7475",
    "check a.hpgl --plotter hp7475a --paper a9",
    "check a.hpgl --hatch 2mm",
    "check a.hpgl --tolerance 1mm",
    "check a.hpgl --only-pens 7",
    "preview a.hpgl -o a.gif",
    "preview a.hpgl -o a.svg --format png",
    "explain H9999",
    "man plot",
    "machine show coxial",
];

/// Drawings and plans that cannot be used.
const INPUTS: &[&str] = &[
    "check a.pdf",
    "check photo.png",
    "check a.gcode",
    "check letter.txt",
    "check m00.toml",
    "check plan.ticks",
    "check empty.hpgl",
    "check broken.svg",
    "check junk.hpgl",
    "check white.hpgl",
    "convert far.hpgl -m coaxial",
    "convert large.hpgl -m polar",
    "convert large.hpgl -m corexy --rotate 45",
    "convert base.hpgl -m arm.toml",
    "convert a.hpgl -m coaxial --place -11mm,0 -o p.csv --strict",
    "convert pages.hpgl -m corexy -o p.csv --strict",
    "convert a.hpgl -m corexy --law linear --segment-time 1ms",
    "convert a.hpgl -m polar -f xy-serial",
    "convert pens.hpgl -m hbot -f xy-serial -o p.txt --strict",
    "machine check polar",
    "verify a.hpgl",
    "verify cut.ticks",
    "verify - -d -",
    "verify plan.ticks -d pens.hpgl",
    "verify plan.ticks -d a.hpgl -m coaxial",
    "verify renamed.ticks -d a.hpgl",
    "verify plan.ticks",
    "send plan.ticks --protocol ticks",
    "send plan.ticks --protocol ticks --port a.hpgl",
    "send plan.ticks --protocol ticks --port /dev/null",
    "send plan.ticks --protocol ticks --port nosuch",
    "send plan.ticks --protocol morse --port nosuch",
    "send plan.ticks --protocol ticks --port tcp:nowhere",
    "send plan.ticks --protocol ticks --dry-run --from 999999",
    "send a.hpgl --protocol ticks --dry-run",
    "send renamed.ticks --protocol gcode --dry-run",
];

#[test]
fn every_message() {
    let dir = TestDir::new();
    dir.write("a.hpgl", SQUARE);
    dir.write("a.pdf", "%PDF-1.4\n");
    dir.write("photo.png", b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR");
    dir.write("a.gcode", "G21\nG90\nG0 X10 Y10\nG1 X20 Y20 F600\n");
    dir.write("letter.txt", "Dear plotter, please draw something nice today.\n");
    dir.write("empty.hpgl", "IN;SP1;PU100,100;SP0;");
    dir.write("broken.svg", "<svg xmlns='http://www.w3.org/2000/svg'><path d='M1 1H9' stroke='#000'/>");
    dir.write("junk.hpgl", "IN;SP1;PU0,0;PD400,0;QA;QB;QC;QE;QF;QG;PD800,9,9;CI;PU;LBno end");
    dir.write("white.hpgl", "IN;NP4;PC2,255,255,255;SP2;PU0,400;PD800,400;PU;SP0;");
    dir.write("far.hpgl", "IN;SP1;PU60000,60000;PD62000,60000,62000,61000;PU;");
    dir.write("large.hpgl", "IN;SP1;PU400,400;PD20000,400;PU;");
    dir.write("base.hpgl", "IN;SP1;PU1000,2000;PD3000,2000;PU;");
    dir.write("pages.hpgl", "IN;SP1;PU0,0;PD400,0;PU;PG;SP1;PU0,0;PD0,400;PU;PG;");
    dir.write("pens.hpgl", "IN;SP1;PU400,400;PD800,400;PU;SP2;PU400,800;PD800,800;PU;");
    let arm = "name = \"arm\"\n[geometry]\nkind = \"two-link\"\nl1 = \"40mm\"\nl2 = \"40mm\"\nelbow = \"left\"\nmin_dexterity = 0\n";
    let motor = |name: &str| {
        format!(
            "[[motor]]\nname = \"{name}\"\ncounts = \"12800/rev\"\nmax_speed = \"200deg/s\"\nmax_acceleration = \"800deg/s2\"\n"
        )
    };
    let tables = "[pen]\nmax_speed = \"80mm/s\"\nlift_time = \"100ms\"\ndrop_time = \"100ms\"\n[sheet]\nx = \"-50mm\"\ny = \"-50mm\"\nwidth = \"100mm\"\nheight = \"100mm\"\n[start]\ntheta = \"0deg\"\npsi = \"100deg\"\n";
    dir.write("arm.toml", format!("{arm}{}{}{tables}", motor("base"), motor("elbow")));
    let commands = machines(&dir);
    run(&dir, "convert a.hpgl -m corexy -o plan.ticks");
    let plan = dir.text("plan.ticks");
    dir.write("cut.ticks", &plan[..plan.len() / 2]);
    dir.write("renamed.ticks", plan.replace("machine: corexy", "machine: mine"));
    let mut text = String::new();
    for (title, commands) in [
        ("machine files", commands.iter().map(String::as_str).collect::<Vec<_>>()),
        ("arguments", ARGUMENTS.to_vec()),
        ("inputs", INPUTS.to_vec()),
    ] {
        let _ = writeln!(text, "== {title}\n");
        for command in commands {
            text += &run(&dir, command);
        }
    }
    // The words of the system differ between systems.
    insta::assert_snapshot!(text.replace(" (os error 2)", ""));
}
