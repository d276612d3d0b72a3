//! Animated previews: pages of drawings, plans and simulations. `cargo xtask web-test` opens them in a
//! browser.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use assert_cmd::cargo::cargo_bin;
use tempfile::TempDir;

fn run(dir: &TempDir, words: &str) -> Output {
    let top = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let words = words.replace("examples/", &format!("{}/examples/", top.display()));
    let output = Command::new(cargo_bin("plotplan")).args(words.split(' ')).current_dir(dir.path()).output();
    output.expect("the program starts")
}

fn page(dir: &TempDir, words: &str) -> String {
    let output = run(dir, &format!("{words} -o x.html --quiet"));
    assert!(output.status.success(), "{words}: {}", String::from_utf8_lossy(&output.stderr));
    fs::read_to_string(dir.path().join("x.html")).expect("a page was written")
}

/// What the page states about its plan.
fn meta(page: &str) -> serde_json::Value {
    let text = page.split_once("id=\"plan-meta\">").expect("a page has data").1;
    serde_json::from_str(text.split_once("</script>").expect("which end").0).expect("in JSON")
}

fn columns(meta: &serde_json::Value) -> Vec<String> {
    let list = meta["columns"].as_array().expect("columns").iter();
    list.map(|column| column["name"].as_str().expect("a name").to_owned()).collect()
}

#[test]
fn page_of_a_drawing_holds_rows_source_and_certificate() {
    let dir = TempDir::new().unwrap();
    for machine in ["coaxial", "corexy", "polar", "cartesian", "hbot"] {
        let html = page(&dir, &format!("preview examples/zot.hpgl --machine {machine} --fit"));
        let meta = meta(&html);
        assert_eq!(meta["title"], "zot.hpgl");
        assert_eq!(meta["machine"]["name"], machine);
        assert_eq!(meta["certificate"]["holds"], true);
        assert_eq!(meta["exact"], true);
        let all = ["t", "pen", "a", "b", "deviation", "piece_row", "piece_start", "piece_length", "source"];
        // Where ticks are taken along the path, two more columns have their distance from the nearest.
        let names: Vec<String> =
            columns(&meta).into_iter().filter(|name| !name.starts_with("off_")).collect();
        assert_eq!(names, all);
        assert!(html.len() < 250_000, "{} bytes", html.len());
        assert!(
            !html.contains("http://")
                || html.matches("http://").count() == html.matches("http://www.w3.org/2000/svg").count()
        );
    }
}

#[test]
fn page_is_the_same_every_time_and_knows_no_path() {
    let dir = TempDir::new().unwrap();
    let words = "preview examples/rings.svg --machine corexy --align center";
    let first = page(&dir, words);
    assert_eq!(first, page(&dir, words));
    assert!(!first.contains(env!("CARGO_MANIFEST_DIR")));
    let meta = meta(&first);
    let codes: Vec<&str> =
        meta["diagnostics"].as_array().unwrap().iter().map(|found| found["code"].as_str().unwrap()).collect();
    assert_eq!(codes, ["S0208", "S0220"]);
    assert!(meta["diagnostics"][0]["start"].is_u64());
    assert_eq!(meta["pens"][0]["color"], "#c03028");
}

#[test]
fn page_of_a_plan_has_motion_and_no_source() {
    let dir = TempDir::new().unwrap();
    for format in ["ticks", "csv", "json"] {
        let made =
            run(&dir, &format!("convert examples/zot.hpgl --machine coaxial --format {format} -o plan -q"));
        assert!(made.status.success());
        let meta = meta(&page(&dir, "preview plan"));
        assert_eq!(columns(&meta), ["t", "pen", "a", "b"]);
        assert_eq!(
            (meta["exact"].as_bool(), meta["certificate"]["holds"].as_bool()),
            (Some(false), Some(true))
        );
        assert!(meta["certificate"]["after_rounding"].is_null());
    }
}

#[test]
fn page_of_a_simulation_has_the_predicted_motion() {
    let dir = TempDir::new().unwrap();
    let meta = meta(&page(&dir, "simulate examples/zot.hpgl --machine coaxial"));
    let names = columns(&meta);
    for name in ["deviation", "source", "predicted_t", "predicted_pen", "predicted_a", "predicted_b"] {
        assert!(names.iter().any(|other| other == name), "{name}");
    }
    assert!(meta["prediction"]["sentences"][0].as_str().unwrap().starts_with("Predicted ink to drawing"));
}

#[test]
fn page_needs_a_machine_that_moves() {
    let dir = TempDir::new().unwrap();
    for (words, message) in [
        ("preview examples/zot.hpgl -o x.html", "which machine draws it?"),
        ("machine preview corexy -o x.html", "a machine alone does not move"),
    ] {
        let output = run(&dir, words);
        assert_eq!(output.status.code(), Some(2), "{words}");
        assert!(String::from_utf8_lossy(&output.stderr).contains(message), "{words}");
    }
    assert!(!dir.path().join("x.html").exists());
}

#[test]
fn pictures_color_ink_by_a_quantity_and_show_the_machine() {
    let dir = TempDir::new().unwrap();
    let svg = |words: &str| {
        let output = run(&dir, &format!("preview examples/zot.hpgl --machine coaxial -q -o x.svg {words}"));
        assert!(output.status.success(), "{words}: {}", String::from_utf8_lossy(&output.stderr));
        fs::read_to_string(dir.path().join("x.svg")).unwrap()
    };
    for (words, texts) in [
        ("--color speed", [">pen speed<", ">0.0 mm/s<", " mm/s<"]),
        ("--color-by=limit", [">what limits the pen<", ">the pen's speed<", ">acceleration of arm1<"]),
        ("--color deviation", [">distance from the drawing<", ">0.000 mm<", " mm<"]),
        ("--color order", [">order<", ">0.0 s<", " s<"]),
    ] {
        let picture = svg(words);
        assert!(picture.matches("class=\"colored\"").count() > 1, "{words}");
        for text in texts {
            assert!(picture.contains(text), "{words}: {text}");
        }
    }
    let posed = svg("--at 6s --color pen");
    assert!(
        posed.contains("id=\"machine\"")
            && posed.contains("class=\"ahead\"")
            && posed.contains("id=\"pen1\"")
    );
    assert_eq!(posed.matches("<circle").count(), 3, "base, elbow and pen");
    assert_ne!(posed, svg("--at 7s --color pen"));
    let moving = svg("--animate 9s");
    assert!(moving.contains("dur=\"9.000s\" repeatCount=\"indefinite\"") && moving.len() < 1_000_000);
    assert_eq!(moving, svg("--animate 9s"));

    let made = run(&dir, "convert examples/zot.hpgl --machine coaxial -o plan.ticks -q");
    assert!(made.status.success());
    let refused = run(&dir, "preview plan.ticks --color deviation -o y.svg");
    assert_eq!(refused.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&refused.stderr).contains("does not hold its drawing"));
    assert!(run(&dir, "preview plan.ticks --color limit --at 3s -o y.png").status.success());
}

#[test]
fn ink_out_of_reach_is_red() {
    let dir = TempDir::new().unwrap();
    fs::write(dir.path().join("wide.hpgl"), "IN;SP1;PU4000,4000;PD20000,4000;PU;").unwrap();
    let picture = |words: &str| {
        assert!(run(&dir, &format!("preview {words} --machine hbot -q -o x.svg")).status.success());
        fs::read_to_string(dir.path().join("x.svg")).unwrap()
    };
    let wide = picture("wide.hpgl");
    assert!(wide.contains("stroke=\"#d00020\"") && wide.contains(">out of reach<"));
    assert!(!picture("examples/zot.hpgl --fit").contains("out of reach"));
}

#[test]
fn text_preview_is_braille() {
    let dir = TempDir::new().unwrap();
    let output = run(&dir, "preview examples/house.hpgl --paper a4 --fit -q --format text");
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(text.lines().count() > 20 && text.lines().all(|line| line.chars().count() <= 80));
    assert!(text.chars().all(|c| c == '\n' || ('\u{2800}'..='\u{28ff}').contains(&c)));
    // Where standard output is no terminal, a picture goes there.
    let piped = run(&dir, "preview examples/house.hpgl --paper a4 --fit -q").stdout;
    assert!(piped.starts_with(b"<svg"));
}
