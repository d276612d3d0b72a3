//! The studio: its outputs are the program's bytes, and its server answers its own page only.
#![allow(clippy::unwrap_used, reason = "a test fails by a panic")]

use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::net::TcpStream;
use std::path::Path;
use std::process::{Child, Command, Stdio};

use compiler::machine_file::PRESETS;
use studio::{Job, Kind, Options, Studio};

const PROGRAM: &str = env!("CARGO_BIN_EXE_plotplan");

/// A job on a preset.
fn job(machine: &str, options: Options) -> Job {
    let mut job = Job { options, ..Job::default() };
    machine.clone_into(&mut job.machine.name);
    job
}

/// Runs the command of an output in a folder with the drawing, and compares the bytes.
fn assert_same_bytes(folder: &Path, studio: &mut Studio, job: &Job, kind: Kind<'_>) {
    let output = studio.output(job, kind, &|_| {}).unwrap_or_else(|problems| panic!("{kind:?}: {problems}"));
    let done = Command::new(PROGRAM).args(&output.words[1..]).current_dir(folder).output().unwrap();
    let said = String::from_utf8_lossy(&done.stderr);
    assert!(done.status.success(), "{}: {said}", output.words.join(" "));
    let written = std::fs::read(folder.join(&output.name)).unwrap();
    assert!(written == output.bytes, "{}: other bytes", output.words.join(" "));
}

fn opened(folder: &Path, example: &str) -> Studio {
    let top = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let bytes = std::fs::read(top.join("examples").join(example)).unwrap();
    std::fs::write(folder.join(example), &bytes).unwrap();
    let mut studio = Studio::default();
    studio.open(example, &bytes);
    studio
}

#[test]
fn every_format_has_the_bytes_of_the_program() {
    let folder = tempfile::tempdir().unwrap();
    let mut studio = opened(folder.path(), "zot.hpgl");
    let fit = Options { fit: true, ..Options::default() };
    let mut compared = 0;
    for format in studio::formats() {
        // Some formats are for one machine.
        let names = ["coaxial", "cartesian"].into_iter().chain(PRESETS.iter().map(|preset| preset.name));
        let found = names.into_iter().find(|machine| {
            studio.output(&job(machine, fit.clone()), Kind::Format(format.name), &|_| {}).is_ok()
        });
        let machine = found.unwrap_or_else(|| panic!("no machine for {}", format.name));
        assert_same_bytes(folder.path(), &mut studio, &job(machine, fit.clone()), Kind::Format(format.name));
        compared += 1;
    }
    assert!(compared >= 10, "{compared} formats");
    let on_arm = job("coaxial", fit);
    for kind in [Kind::Picture("svg"), Kind::Picture("png"), Kind::Page] {
        assert_same_bytes(folder.path(), &mut studio, &on_arm, kind);
    }
}

#[test]
fn every_option_has_the_bytes_of_the_program() {
    let folder = tempfile::tempdir().unwrap();
    let mut studio = opened(folder.path(), "rings.svg");
    let text = |text: &str| text.to_owned();
    let all = [
        Options {
            tolerance: text("0.2mm"),
            period: text("8ms"),
            align: text("center"),
            ..Options::default()
        },
        Options {
            order: text("file"),
            rounding: text("nearest"),
            shrink: true,
            margin: text("5mm"),
            ..Options::default()
        },
        Options {
            effort: text("0"),
            place: text("70.5mm,12mm"),
            scale: text("0.75"),
            rotate: text("30"),
            ..Options::default()
        },
        Options {
            law: text("trapezoid"),
            speed: text("file"),
            fit: true,
            mirror: text("x"),
            ..Options::default()
        },
        Options {
            pens: text("one"),
            hatch: text("3mm,45"),
            outline_fills: true,
            fit: true,
            page: text("1"),
            ..Options::default()
        },
    ];
    for options in all {
        let job = job("corexy", options);
        for kind in [Kind::Format("ticks"), Kind::Format("json"), Kind::Format("svg"), Kind::Page] {
            assert_same_bytes(folder.path(), &mut studio, &job, kind);
        }
    }
}

#[test]
fn paper_pens_copies_laws_and_best_place_have_the_bytes_of_the_program() {
    let folder = tempfile::tempdir().unwrap();
    let text = |text: &str| text.to_owned();
    let drawing = b"IN;SP1;PU400,400;PD1200,400,1200,800;SP2;PU400,800;PD600,900;PU;";
    std::fs::write(folder.path().join("a.hpgl"), drawing).unwrap();
    let mut studio = Studio::default();
    studio.open("a.hpgl", drawing);
    let all = [
        Options { paper: text("A5,landscape"), fit: true, margin: text("4mm"), ..Options::default() },
        Options { only_pens: text("2"), align: text("center"), ..Options::default() },
        Options { copies: text("3x2"), gap: text("2.5mm"), fit: true, ..Options::default() },
        Options {
            law: text("sine"),
            segment_time: text("800ms"),
            align: text("center"),
            ..Options::default()
        },
        Options { place: text("best"), ..Options::default() },
        Options { place: text("best"), best_for: text("accuracy"), paper: text("A4"), ..Options::default() },
    ];
    for options in all {
        let job = job("coaxial", options);
        for kind in [
            Kind::Format("ticks"),
            Kind::Format("json"),
            Kind::Format("svg"),
            Kind::Picture("svg"),
            Kind::Picture("png"),
            Kind::Page,
        ] {
            assert_same_bytes(folder.path(), &mut studio, &job, kind);
        }
    }
}

#[test]
fn several_files_have_the_bytes_of_the_program() {
    let folder = tempfile::tempdir().unwrap();
    let mut studio = opened(folder.path(), "rings.svg");
    let text = |text: &str| text.to_owned();
    let drawing = b"IN;SP3;PU400,400;PD1200,400,1200,800;PU;";
    std::fs::write(folder.path().join("b.hpgl"), drawing).unwrap();
    studio.add("b.hpgl", drawing);
    for options in [
        Options { fit: true, ..Options::default() },
        Options { fit: true, only_pens: text("1,3"), pens: text("colors"), ..Options::default() },
    ] {
        let job = job("corexy", options);
        for kind in [
            Kind::Format("ticks"),
            Kind::Format("json"),
            Kind::Format("svg"),
            Kind::Picture("svg"),
            Kind::Page,
        ] {
            assert_same_bytes(folder.path(), &mut studio, &job, kind);
        }
    }
}

#[test]
fn own_machine_file_has_the_bytes_of_the_program() {
    let folder = tempfile::tempdir().unwrap();
    let mut studio = opened(folder.path(), "zot.hpgl");
    let mut job = job("coaxial", Options { fit: true, ..Options::default() });
    job.machine.toml = PRESETS[0].toml.replacen("l1 = \"206mm\"", "l1 = \"216mm\"", 1);
    assert_ne!(job.machine.toml, PRESETS[0].toml);
    std::fs::write(folder.path().join(job.machine.word()), &job.machine.toml).unwrap();
    for kind in [Kind::Format("ticks"), Kind::Format("json"), Kind::Picture("svg"), Kind::Page] {
        assert_same_bytes(folder.path(), &mut studio, &job, kind);
    }
}

/// A server that ends with the test.
struct Served {
    child: Child,
    port: u16,
}

impl Drop for Served {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl Served {
    fn of(folder: &Path) -> Self {
        let mut child = Command::new(PROGRAM)
            .args(["studio", "--no-open", "--port", "0", "--files"])
            .arg(folder)
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let mut line = String::new();
        BufReader::new(child.stderr.take().unwrap()).read_line(&mut line).unwrap();
        let port = line.split("127.0.0.1:").nth(1).and_then(|rest| rest.split('/').next());
        let port = port.and_then(|port| port.parse().ok()).unwrap_or_else(|| panic!("{line}"));
        Self { child, port }
    }

    /// Status and text of the answer.
    fn answer(&self, request: &str) -> (u16, String) {
        let mut stream = TcpStream::connect(("127.0.0.1", self.port)).unwrap();
        let request = request.replace("PORT", &self.port.to_string());
        stream.write_all(format!("{request}Connection: close\r\n\r\n").as_bytes()).unwrap();
        let mut text = String::new();
        stream.read_to_string(&mut text).unwrap();
        let status =
            text.split(' ').nth(1).and_then(|status| status.parse().ok()).unwrap_or_else(|| panic!("{text}"));
        (status, text)
    }
}

#[test]
fn server_answers_its_own_page_only() {
    let folder = tempfile::tempdir().unwrap();
    let files = folder.path().join("files");
    std::fs::create_dir_all(files.join("js")).unwrap();
    std::fs::write(files.join("index.html"), "<p>the page</p>").unwrap();
    std::fs::write(files.join("js/main.js"), "1;").unwrap();
    std::fs::write(folder.path().join("secret"), "secret").unwrap();
    let served = Served::of(&files);
    let own = "Host: 127.0.0.1:PORT\r\n";
    let (status, text) = served.answer(&format!("GET / HTTP/1.1\r\n{own}"));
    assert_eq!(status, 200);
    assert!(text.ends_with("<p>the page</p>"), "{text}");
    for header in
        ["Content-Security-Policy: default-src 'none';", "X-Content-Type-Options: nosniff", "text/html"]
    {
        assert!(text.contains(header), "{header}: {text}");
    }
    assert_eq!(served.answer(&format!("GET /js/main.js?x=1 HTTP/1.1\r\n{own}")).0, 200);
    assert_eq!(
        served.answer("GET / HTTP/1.1\r\nHost: localhost:PORT\r\nOrigin: http://localhost:PORT\r\n").0,
        200
    );
    for path in
        ["/../secret", "/js/../../secret", "/%2e%2e/secret", "//secret", "/js", "/js/", "/js/main.js/"]
    {
        let (status, text) = served.answer(&format!("GET {path} HTTP/1.1\r\n{own}"));
        assert!((400..500).contains(&status), "{path}: {status}");
        assert!(!text.contains("\r\n\r\nsecret"), "{path}");
    }
    for headers in [
        "Host: evil.example\r\n",
        "Host: evil.example:PORT\r\n",
        "Host: 127.0.0.1:PORT\r\nOrigin: http://evil.example\r\n",
        "Host: 127.0.0.1:PORT\r\nOrigin: null\r\n",
        "Host: 127.0.0.1:PORT\r\nOrigin: https://127.0.0.1:PORT\r\n",
        "",
    ] {
        assert_eq!(served.answer(&format!("GET / HTTP/1.1\r\n{headers}")).0, 403, "{headers}");
    }
    assert_eq!(served.answer(&format!("POST / HTTP/1.1\r\n{own}Content-Length: 0\r\n")).0, 405);
}

#[test]
fn program_without_the_studio_names_what_to_do() {
    // Built by `cargo test`, where PLOTPLAN_STUDIO is not set.
    if option_env!("PLOTPLAN_STUDIO").is_some() {
        return;
    }
    let done = Command::new(PROGRAM).args(["studio", "--no-open", "--port", "0"]).output().unwrap();
    let said = String::from_utf8_lossy(&done.stderr);
    assert_eq!(done.status.code(), Some(2), "{said}");
    assert!(said.contains("cargo xtask web") && said.contains("--files"), "{said}");
}
