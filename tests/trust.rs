//! What the threat model of docs/trust.md promises about files, memory and time, each line with a test;
//! and that every test named there exists. `cargo xtask trust` sets `PLOTPLAN_KILLS` and `PLOTPLAN_SEED`.
#![cfg(target_os = "linux")]
#![expect(clippy::disallowed_methods, reason = "campaigns are set by the environment and take time")]

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::time::Instant;

use test_support::{Program, Random, TestDir, stderr};

const PATH: &str = env!("CARGO_BIN_EXE_plotplan");
const PROGRAM: Program = Program::new(PATH);

fn setting(name: &str, default: u64) -> u64 {
    std::env::var(name).map_or(default, |text| text.parse().expect("a number"))
}

/// A folder with a drawing of some hundred lines.
fn folder() -> TestDir {
    let dir = TestDir::new();
    let mut hpgl = "IN;SP1;".to_owned();
    for k in 0..200 {
        let (x, y) = (200 + 37 * k, 400 + 1000 * (k % 2));
        write!(hpgl, "PU{x},{y};PD{},{};", x + 300, y + 500).expect("text");
    }
    dir.write("d.hpgl", hpgl + "PU;");
    dir
}

/// Runs a shell script in the folder; `$plotplan` is the program.
fn shell(dir: &TestDir, script: &str) -> Output {
    let mut command = Command::new("sh");
    command.args(["-c", script]).current_dir(dir.path()).env("plotplan", PATH);
    command.env("XDG_CONFIG_HOME", dir.path().join("config")).output().expect("a shell")
}

/// Names of files that the program began to write.
fn temporary(dir: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(dir).expect("the folder").map(|entry| entry.expect("an entry").path());
    entries.filter(|path| path.to_string_lossy().contains(".plotplan-")).collect()
}

/// SIGKILL at random times: the output is what it was before, or the whole new plan. A kill may leave a
/// hidden temporary file, which is never taken for a plan.
#[test]
fn killed_program_leaves_no_half_file() {
    let dir = folder();
    let arguments = ["convert", "d.hpgl", "-m", "corexy", "-f", "csv", "-o", "p.csv"];
    let start = Instant::now();
    PROGRAM.succeed(&dir, &arguments.join(" "));
    let whole_time = start.elapsed();
    let whole = dir.bytes("p.csv");
    let mut random = Random(setting("PLOTPLAN_SEED", 20_261_126));
    let (mut before, mut after, mut left) = (0, 0, 0);
    let kills = setting("PLOTPLAN_KILLS", 12);
    for _ in 0..kills {
        dir.write("p.csv", "as before");
        let mut child = Command::new(PATH);
        child.args(arguments).current_dir(dir.path()).stderr(std::process::Stdio::null());
        let mut child = child.spawn().expect("the program starts");
        // Most of them while it writes: in the last quarter.
        let share = if random.below(3) == 0 { random.unit() } else { 0.75 + 0.35 * random.unit() };
        std::thread::sleep(whole_time.mul_f64(share));
        let _ = child.kill();
        child.wait().expect("it ends");
        let found = dir.bytes("p.csv");
        assert!(found == b"as before" || found == whole, "{} of {} bytes", found.len(), whole.len());
        if found == whole {
            after += 1;
        } else {
            before += 1;
        }
        for path in temporary(dir.path()) {
            left += 1;
            fs::remove_file(path).expect("a temporary file");
        }
    }
    println!("{kills} kills: {before} files as before, {after} whole plans, {left} temporary files left");
    assert!(before > 0, "no kill came early");
}

/// A limit on the size of files ends writing early: exit code 3, the old file as before, nothing else left.
#[test]
fn file_too_large_for_its_limit_leaves_the_old_file() {
    let dir = folder();
    dir.write("p.csv", "as before");
    for blocks in [0, 1, 16] {
        let script = format!(
            "trap '' XFSZ; ulimit -f {blocks}; \"$plotplan\" convert d.hpgl -m corexy -f csv -o p.csv"
        );
        let output = shell(&dir, &script);
        assert_eq!(output.status.code(), Some(3), "{blocks} blocks: {}", stderr(&output));
        let said = stderr(&output);
        assert!(said.contains("File too large") && !said.contains(".plotplan-"), "{said}");
        assert_eq!(dir.text("p.csv"), "as before", "{blocks} blocks");
        assert_eq!(temporary(dir.path()), [] as [PathBuf; 0]);
    }
}

/// A full device is an error, through `-o` and through standard output.
#[test]
fn full_disk_is_an_error() {
    let dir = folder();
    for script in [
        "\"$plotplan\" convert d.hpgl -m corexy -o /dev/full",
        "\"$plotplan\" convert d.hpgl -m corexy > /dev/full",
        "\"$plotplan\" preview d.hpgl -f svg > /dev/full",
        "\"$plotplan\" info d.hpgl > /dev/full",
        "\"$plotplan\" machine show corexy > /dev/full",
    ] {
        let output = shell(&dir, script);
        assert_eq!(output.status.code(), Some(3), "{script}: {}", stderr(&output));
        assert!(stderr(&output).contains("No space left on device"), "{script}: {}", stderr(&output));
    }
}

/// A folder without write permission: exit code 3, before the plan is computed or after, and no file.
/// Permissions do not bind root: then the program runs as another user.
#[test]
fn read_only_folder_is_an_error() {
    use std::os::unix::fs::PermissionsExt as _;
    let dir = folder();
    let closed = dir.path().join("closed");
    fs::create_dir(&closed).expect("a folder");
    fs::write(closed.join("p.csv"), "as before").expect("a file");
    for (path, mode) in [(dir.path(), 0o755), (&closed, 0o555), (&closed.join("p.csv"), 0o444)] {
        fs::set_permissions(path, fs::Permissions::from_mode(mode)).expect("permissions");
    }
    let script = "as_user=; [ \"$(id -u)\" = 0 ] && as_user='setpriv --reuid=65534 --regid=65534 --clear-groups'\n\
                  $as_user \"$plotplan\" convert d.hpgl -m corexy -o closed/p.csv";
    let output = shell(&dir, script);
    let names = fs::read_dir(&closed).expect("the folder").count();
    fs::set_permissions(&closed, fs::Permissions::from_mode(0o755)).expect("permissions");
    assert_eq!(output.status.code(), Some(3), "{}", stderr(&output));
    assert!(stderr(&output).contains("permission denied"), "{}", stderr(&output));
    assert_eq!(names, 1);
    assert_eq!(dir.text("closed/p.csv"), "as before");
}

/// Address space and processor time that no input may exceed. The address space includes the stacks of
/// threads and what the allocator reserves.
const CEILINGS: &str = "ulimit -v 2000000; ulimit -t 60";

/// Inputs that ask for much with few bytes: name, contents, and what is done with them.
fn hostile() -> Vec<(&'static str, Vec<u8>, &'static str)> {
    let svg = |inside: &str| {
        format!("<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"100mm\" height=\"100mm\" viewBox=\"0 0 100 100\">{inside}</svg>")
            .into_bytes()
    };
    let entities = {
        let mut text = "<!DOCTYPE svg [<!ENTITY a \"aaaaaaaaaa\">".to_owned();
        for pair in "abcdefghij".as_bytes().windows(2) {
            let inside = format!("&{};", char::from(pair[0])).repeat(10);
            write!(text, "<!ENTITY {} \"{inside}\">", char::from(pair[1])).expect("text");
        }
        format!("{text}]><svg xmlns=\"http://www.w3.org/2000/svg\"><text>&j;</text></svg>").into_bytes()
    };
    let uses = {
        let mut text = "<defs><path id=\"u0\" d=\"M0 0L1 1\"/>".to_owned();
        for k in 1..12 {
            let inside = format!("<use href=\"#u{}\"/>", k - 1).repeat(10);
            write!(text, "<g id=\"u{k}\">{inside}</g>").expect("text");
        }
        svg(&format!("{text}</defs><use href=\"#u11\" stroke=\"red\"/>"))
    };
    let plan = |rows: &str| {
        format!(
            "# plotplan: 1\n# machine: corexy\n# limits A: 4000 30000\n# limits B: 4000 30000\n# placement: 1 0 0 1 0 0\n\
             # period_us: 10000\nt_us,pen,A,B\n{rows}"
        )
        .into_bytes()
    };
    vec![
        ("entities.svg", entities, "check"),
        ("uses.svg", uses, "check"),
        ("nested.svg", svg(&"<g>".repeat(200_000)), "check"),
        ("dashes.svg", svg("<path stroke-dasharray=\"1e-9\" stroke=\"red\" d=\"M0 0L90 90\"/>"), "check"),
        (
            "huge.svg",
            svg("<path stroke=\"red\" d=\"M0 0L1e300 1e300M0 0A1e200 1e-200 0 0 1 1e9 0\"/>"),
            "check",
        ),
        ("hatch.svg", svg("<rect width=\"1e9\" height=\"1e9\"/>"), "check --hatch 0.001mm"),
        ("circles.hpgl", "CI30000,0.01;".repeat(2000).into_bytes(), "check"),
        ("replots.hpgl", format!("IN;SP1;{}RP32767;", "PD0,0,400,400;PU;".repeat(100)).into_bytes(), "check"),
        ("fill.hpgl", b"IN;SP1;FT3,0.001,0;RA32767,32767;".to_vec(), "check"),
        (
            "wedges.hpgl",
            format!("IN;SP1;FT4,1,45;{}", "WG32767,0,360,0.01;".repeat(50)).into_bytes(),
            "check",
        ),
        ("labels.hpgl", format!("IN;SP1;SI100,100;LB{}\x03", "W".repeat(1_000_000)).into_bytes(), "check"),
        ("symbols.hpgl", format!("IN;SP1;SMx;PD{}0,0;", "1,1,".repeat(1_000_000)).into_bytes(), "check"),
        (
            "lines.hpgl",
            format!("IN;SP1;LT1,0.0001;PD{}0,0;", "9999,0,0,9999,".repeat(10_000)).into_bytes(),
            "check",
        ),
        ("points.hpgl", format!("IN;SP1;PD{}0,0;", "1,1,2,3,".repeat(1_000_000)).into_bytes(), "check"),
        (
            "polygon.hpgl",
            format!("IN;SP1;PM0;PD{}0,0;PM2;FP;", "9,9,1,7,".repeat(300_000)).into_bytes(),
            "check",
        ),
        ("encoded.hpgl", [b"IN;SP1;PE".as_slice(), &b"=~~~~~~~~~~".repeat(100_000), b";"].concat(), "check"),
        ("far.csv", plan("0,0,0,0\n10000,1,9223372036854775807,-9223372036854775808\n"), "verify"),
        ("late.csv", plan("0,0,0,0\n18446744073709551615,0,0,0\n"), "verify"),
        (
            "nested.json",
            format!("{{\"format\":\"plotplan\",\"rows\":{}", "[".repeat(1_000_000)).into_bytes(),
            "verify",
        ),
        ("ink.csv", plan("0,0,0,0\n10000,1,0,0\n20000,1,2000000000,0\n30000,0,0,0\n40000,0,0,0\n"), "verify"),
        ("brackets.toml", format!("a = {}", "[".repeat(1_000_000)).into_bytes(), "machine check"),
        ("tables.toml", format!("[{}a]\n", "a.".repeat(300_000)).into_bytes(), "machine check"),
    ]
}

/// No panic, no signal and no more than the ceilings, whatever the file asks for.
#[test]
fn hostile_inputs_stay_below_the_ceilings() {
    let dir = TestDir::new();
    for (name, contents, command) in hostile() {
        dir.write(name, contents);
        let start = Instant::now();
        let (command, options) =
            command.split_once(" --").map_or((command, String::new()), |(c, o)| (c, format!("--{o}")));
        let script = format!("{CEILINGS}; \"$plotplan\" {command} {name} {options} --quiet");
        let output = shell(&dir, &script);
        let said = stderr(&output);
        let code = output.status.code();
        println!("{name}: exit {code:?} after {:.1} s", start.elapsed().as_secs_f64());
        assert!(matches!(code, Some(0..=3)), "{name}: {:?}: {said}", output.status);
        assert!(!said.contains("panicked") && said.len() < 20_000, "{name}: {said}");
    }
}

/// What a drawing refers to is not opened: a named pipe without a writer would block.
#[test]
fn drawings_open_no_other_file() {
    let dir = TestDir::new();
    let made = Command::new("mkfifo").arg(dir.path().join("pipe")).status().expect("mkfifo");
    assert!(made.success());
    let pipe = dir.path().join("pipe").display().to_string();
    let start = "<!DOCTYPE svg [<!ENTITY x SYSTEM \"PIPE\">]>";
    let body = "<svg xmlns=\"http://www.w3.org/2000/svg\" xmlns:xlink=\"http://www.w3.org/1999/xlink\" width=\"9mm\" height=\"9mm\">\
                <?xml-stylesheet href=\"PIPE\"?><style>@import url(PIPE); @font-face { font-family: f; src: url(PIPE) }</style>\
                <image href=\"PIPE\" width=\"9\" height=\"9\"/><use xlink:href=\"PIPE#a\"/>\
                <path clip-path=\"url(PIPE#c)\" stroke=\"red\" d=\"M0 0L9 9\"/><text font-family=\"f\">a</text></svg>";
    for (name, text) in [("a.svg", body.to_owned()), ("b.svg", start.to_owned() + body)] {
        for (scheme, kind) in [("", "path"), ("file://", "URL")] {
            dir.write(name, text.replace("PIPE", &format!("{scheme}{pipe}")));
            for options in ["", "--text outlines"] {
                let output = shell(&dir, &format!("timeout 30 \"$plotplan\" check {name} {options} --quiet"));
                assert!(matches!(output.status.code(), Some(0 | 1)), "{name}, {kind}: {:?}", output.status);
            }
        }
    }
}

/// Names in files cannot send escape sequences to the terminal, in messages or on standard output.
#[test]
fn messages_contain_no_control_characters() {
    let dir = TestDir::new();
    dir.write("a.hpgl", b"IN;SP1;PU400,400;\x1b]0;x\x07\x9bPD1200,400;X\x1b[31mX;LB\x1b[2J\x03PU;");
    dir.write(
        "b.svg",
        "<svg xmlns=\"http://www.w3.org/2000/svg\" xmlns:inkscape=\"http://www.inkscape.org/namespaces/inkscape\" \
         width=\"9mm\" height=\"9mm\"><g inkscape:groupmode=\"layer\" inkscape:label=\"1 \u{9b}31m\u{85}\"><path \
         d=\"M0 0L5 5\" stroke=\"\u{9b}2J\" font-family=\"\u{9b}\"/><text font-family=\"\u{9b}2J\">a</text></g></svg>",
    );
    let shown = PROGRAM.stdout_of(&dir, "machine show corexy");
    dir.write("name.toml", shown.replacen("name = \"corexy\"", "name = \"a\\u001b[31m\\u009bb\"", 1));
    dir.write("motor.toml", shown.replacen("name = \"A\"", "name = \"A\\u001b[31m\"", 1));
    dir.write("key.toml", format!("\"a\\u001b[31m\" = 1\n{shown}"));
    dir.write("c.hpgl", "IN;SP1;PU400,400;PD1200,400;PU;");
    PROGRAM.succeed(&dir, "convert c.hpgl -m corexy -f csv -o p.csv");
    dir.write("p.csv", dir.text("p.csv").replacen("machine: corexy", "machine: co\u{1b}[31m\u{9b}", 1));
    for arguments in [
        "check a.hpgl",
        "info a.hpgl",
        "check b.svg",
        "info b.svg",
        "machine check name.toml",
        "machine check motor.toml",
        "machine check key.toml",
        "convert c.hpgl -m name.toml -o x.csv",
        "convert c.hpgl -m motor.toml -f csv",
        "verify p.csv -m corexy",
        "verify p.csv",
        "info p.csv",
        "preview p.csv -o x.svg",
        "explain \u{1b}[31m",
        "machine show \u{1b}[31m",
    ] {
        let output = PROGRAM.run(&dir, arguments);
        for bytes in [&output.stdout, &output.stderr] {
            let text = String::from_utf8_lossy(bytes);
            let control = text.chars().find(|c| c.is_control() && !"\n\t".contains(*c));
            assert_eq!(control, None, "plotplan {}: {text:?}", arguments.escape_debug());
        }
    }
}

/// Every test that docs/trust.md names exists, in the file that it names.
#[test]
fn every_test_of_the_threat_model_exists() {
    let top = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let page = fs::read_to_string(top.join("docs/trust.md")).expect("docs/trust.md");
    let (_, model) = page.split_once("## Threat model").expect("a threat model");
    let (model, _) = model.split_once("\n## ").expect("a section after it");
    let lines: Vec<&str> =
        model.lines().filter(|line| line.starts_with("| ") && !line.contains("| test |")).collect();
    assert!(lines.len() > 15, "{} lines", lines.len());
    for line in lines {
        let last = line.trim_end_matches('|').rsplit('|').next().unwrap_or_default();
        let named: Vec<&str> = last.split('`').skip(1).step_by(2).collect();
        assert!(!named.is_empty(), "no test: {line}");
        for test in named {
            let (file, name) = test.split_once("::").unwrap_or_else(|| panic!("FILE::TEST: {test}"));
            let source = fs::read_to_string(top.join(file)).unwrap_or_else(|_| panic!("no file {file}"));
            let is_there = source.contains(&format!("fn {name}("))
                || source.contains(&format!("test(\"{name}"))
                || source.contains(&format!("test('{name}"));
            assert!(is_there, "no test {name} in {file}");
        }
    }
}
