//! `cargo xtask peers`: compares our drawings with those of hp2xx, file by file.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use anyhow::{Context as _, Result};
use drawing::Point;
use rstar::primitives::Line;
use rstar::{PointDistance as _, RTree};

/// Relative difference in length that needs a note.
const ALIKE: f64 = 0.005;
/// Hausdorff distance up to which the summary counts shapes as equal, mm.
const NEAR_MM: f64 = 0.05;
/// Chord error of our flattening, mm; far below that of hp2xx, which writes chords of 5 degrees.
const CHORD_MM: f64 = 0.001;
const PLOTTER_UNIT_MM: f64 = 0.025;
const LIMIT: Duration = Duration::from_secs(60);
/// Largest number of samples a distance is measured from: uniform along all ink, and as many line
/// ends.
const MOST_SAMPLES: f64 = 20_000.0;
const FINEST_STEP_MM: f64 = 0.02;

pub(crate) const NOTES: &str = include_str!("peers.toml");

type Polylines = Vec<Vec<Point>>;

/// The reason for a difference, and which of the two programs is right.
struct Note {
    right: String,
    why: String,
}

/// The result for one file.
struct Row {
    name: String,
    ours_mm: f64,
    /// `None` if hp2xx fails.
    theirs_mm: Option<f64>,
    apart_mm: Option<f64>,
    /// Whether it has text or fills, which no two readers draw alike.
    text_or_fill: bool,
}

impl Row {
    fn alike(&self, part: f64) -> bool {
        let theirs = self.theirs_mm.unwrap_or(0.0);
        (self.ours_mm - theirs).abs() <= part * self.ours_mm.max(theirs)
    }
}

/// Compares all drawings below the folders and our own; true if every difference in length has a
/// note.
pub(crate) fn run(folders: &[PathBuf]) -> Result<bool> {
    if Command::new("hp2xx").arg("-q").stdin(Stdio::null()).output().is_err() {
        println!("skipped: hp2xx is not installed");
        return Ok(true);
    }
    let notes = notes()?;
    let mut files = Vec::new();
    let own = ["tests/drawings", "examples"].map(|folder| crate::top().join(folder));
    for folder in own.iter().chain(folders) {
        let mut found = Vec::new();
        crate::corpus::find(folder, &mut found)?;
        found.sort();
        files.extend(found);
    }
    let work = tempfile::tempdir()?;
    println!("{:<58} {:>12} {:>12} {:>8} {:>9}", "file", "ours mm", "hp2xx mm", "ratio", "apart mm");
    let mut rows = Vec::new();
    let mut unexplained = 0;
    for file in &files {
        let row = compare(file, work.path())?;
        let show = |number: Option<f64>, digits: usize| {
            number.map_or_else(|| "-".to_owned(), |number| format!("{number:.digits$}"))
        };
        println!(
            "{:<58} {:>12.2} {:>12} {:>8} {:>9}{}",
            row.name.chars().take(58).collect::<String>(),
            row.ours_mm,
            show(row.theirs_mm, 2),
            show(row.theirs_mm.map(|theirs| row.ours_mm / theirs).filter(|ratio| ratio.is_finite()), 4),
            show(row.apart_mm, 3),
            if row.text_or_fill { "  text or fill" } else { "" }
        );
        if !row.alike(ALIKE) {
            let why = notes.get(&row.name);
            for note in why.into_iter().flatten() {
                println!("    right: {}. {}", note.right, note.why);
            }
            if why.is_none() {
                println!("    NO NOTE in peers.toml");
                unexplained += 1;
            }
        }
        rows.push(row);
    }
    summary(&rows);
    println!("{unexplained} unexplained");
    Ok(unexplained == 0)
}

fn summary(rows: &[Row]) {
    for (title, plain) in [("without text and fills", true), ("with text or fills", false)] {
        let mine: Vec<&Row> = rows.iter().filter(|row| row.text_or_fill != plain).collect();
        let count = |holds: &dyn Fn(&Row) -> bool| mine.iter().filter(|row| holds(row)).count();
        println!(
            "{} files {title}: {} within 0.1 % in length, {} within 0.5 %, {} of them within \
             {NEAR_MM} mm in shape; hp2xx failed on {}",
            mine.len(),
            count(&|row| row.alike(0.001)),
            count(&|row| row.alike(ALIKE)),
            count(&|row| row.alike(ALIKE) && row.apart_mm.is_some_and(|apart| apart <= NEAR_MM)),
            count(&|row| row.theirs_mm.is_none()),
        );
    }
}

/// The notes of every file: the reasons listed for it in peers.toml.
fn notes() -> Result<BTreeMap<String, Vec<Note>>> {
    let table: toml::Table = NOTES.parse().context("peers.toml")?;
    let part = |name: &str| {
        table.get(name).and_then(|part| part.as_table()).with_context(|| format!("peers.toml: no {name}"))
    };
    let (reasons, files) = (part("reason")?, part("files")?);
    let note = |name: &toml::Value| {
        let reason = name.as_str().and_then(|name| reasons.get(name));
        let word = |key: &str| reason.and_then(|reason| reason.get(key)?.as_str()).map(str::to_owned);
        let (Some(right), Some(why)) = (word("right"), word("why")) else {
            anyhow::bail!("peers.toml: no reason {name}");
        };
        Ok(Note { right, why })
    };
    let of_file = |(file, names): (&String, &toml::Value)| {
        let names = names.as_array().with_context(|| format!("peers.toml: {file} has no list"))?;
        Ok((file.clone(), names.iter().map(note).collect::<Result<_>>()?))
    };
    files.iter().map(of_file).collect()
}

fn compare(file: &Path, work: &Path) -> Result<Row> {
    let bytes = std::fs::read(file).with_context(|| format!("cannot read {}", file.display()))?;
    let document = hpgl::read(&bytes, &hpgl::Options::default());
    // hp2xx draws all pages on one.
    let strokes = document.pages.iter().flat_map(|page| &page.drawing.strokes);
    let mut ours: Polylines = strokes.map(|stroke| stroke.flatten(CHORD_MM)).collect();
    let theirs = hp2xx(file, work)?.map(|text| polylines(&text, PLOTTER_UNIT_MM));
    let is_finite = |lines: &Polylines| lines.iter().flatten().all(|p| p.x.is_finite() && p.y.is_finite());
    let theirs = theirs.filter(|lines| !lines.is_empty() && is_finite(lines));
    let used = |name: &[u8; 2]| document.summary.used.iter().any(|(mnemonic, _)| mnemonic.0 == *name);
    let text_or_fill = [b"LB", b"PB", b"SM", b"FP", b"RA", b"RR", b"WG", b"UC"].into_iter().any(used);
    let name = file.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
    let ours_mm = length(&ours);
    let mut row = Row { name, ours_mm, theirs_mm: None, apart_mm: None, text_or_fill };
    if let Some(mut theirs) = theirs {
        row.theirs_mm = Some(length(&theirs));
        to_origin(&mut ours);
        to_origin(&mut theirs);
        row.apart_mm = distance(&ours, &theirs);
    }
    Ok(row)
}

/// Runs a command without input and output; whether it succeeds within the time.
pub(crate) fn runs(command: &mut Command, limit: Duration) -> Result<bool> {
    let child = command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null()).spawn();
    let mut child = child.with_context(|| format!("cannot start {}", command.get_program().display()))?;
    let began = Instant::now();
    loop {
        if let Some(status) = child.try_wait()? {
            return Ok(status.success());
        }
        if began.elapsed() > limit {
            child.kill()?;
            child.wait()?;
            return Ok(false);
        }
        std::thread::sleep(Duration::from_millis(2));
    }
}

/// The output of hp2xx for a file, as HP-GL in plotter units at true size; `None` if it fails.
fn hp2xx(file: &Path, work: &Path) -> Result<Option<String>> {
    let output = work.join("hp2xx.hpgl");
    let _ = std::fs::remove_file(&output);
    let mut command = Command::new("hp2xx");
    command.args(["-q", "-t", "-m", "hpgl", "-f"]);
    command.args([output.as_os_str(), file.canonicalize()?.as_os_str()]).current_dir(work);
    let done = runs(&mut command, LIMIT)?;
    Ok(std::fs::read(&output).ok().filter(|_| done).map(|bytes| String::from_utf8_lossy(&bytes).into_owned()))
}

/// The polylines in the output of hp2xx or Inkscape: `PUx,y;PDx,y,x,y;...`, absolute.
pub(crate) fn polylines(text: &str, unit_mm: f64) -> Polylines {
    let mut lines: Polylines = Vec::new();
    let mut at: Option<Point> = None;
    let mut drawing = false;
    for command in text.split(';') {
        let Some((name, rest)) = command.trim().split_at_checked(2) else { continue };
        if !matches!(name, "PU" | "PD") {
            continue;
        }
        let numbers = rest.split(',').map_while(|number| number.trim().parse::<f64>().ok());
        let numbers: Vec<f64> = numbers.collect();
        drawing &= name == "PD";
        for pair in numbers.chunks_exact(2) {
            let to = Point::new(pair[0] * unit_mm, pair[1] * unit_mm);
            if let ("PD", Some(from)) = (name, at) {
                if !drawing {
                    lines.push(vec![from]);
                }
                if let Some(line) = lines.last_mut() {
                    line.push(to);
                }
                drawing = true;
            }
            at = Some(to);
        }
    }
    lines
}

pub(crate) fn length(lines: &[Vec<Point>]) -> f64 {
    lines.iter().flat_map(|line| line.windows(2)).map(|pair| (pair[1] - pair[0]).hypot()).sum()
}

/// Moves the lower left corner of the bounding box to the origin: hp2xx does not keep its position.
fn to_origin(lines: &mut Polylines) {
    let points = || lines.iter().flatten();
    let x = points().map(|p| p.x).fold(f64::INFINITY, f64::min);
    let y = points().map(|p| p.y).fold(f64::INFINITY, f64::min);
    for point in lines.iter_mut().flatten() {
        *point -= drawing::Vec2::new(x, y);
    }
}

/// The Hausdorff distance, from samples on both sides; `None` if a side is empty or not finite.
fn distance(a: &[Vec<Point>], b: &[Vec<Point>]) -> Option<f64> {
    let one = farthest(a, &index(b))?;
    Some(one.max(farthest(b, &index(a))?))
}

/// The lines of a drawing, without dots: hp2xx keeps only some of those, as lines of the length of
/// a rounding error.
fn pieces(lines: &[Vec<Point>]) -> impl Iterator<Item = (Point, Point)> + '_ {
    let ends = lines.iter().flat_map(|line| line.windows(2)).map(|pair| (pair[0], pair[1]));
    // rstar has no distance to a line of length 0 (0 / 0).
    ends.filter(|(a, b)| (*b - *a).hypot() > CHORD_MM)
}

pub(crate) fn index(lines: &[Vec<Point>]) -> RTree<Line<[f64; 2]>> {
    RTree::bulk_load(pieces(lines).map(|(a, b)| Line::new([a.x, a.y], [b.x, b.y])).collect())
}

pub(crate) fn farthest(lines: &[Vec<Point>], to: &RTree<Line<[f64; 2]>>) -> Option<f64> {
    let step = (length(lines) / MOST_SAMPLES).max(FINEST_STEP_MM);
    if !step.is_finite() {
        return None;
    }
    let every = pieces(lines).count() / MOST_SAMPLES as usize + 1;
    let mut farthest = 0.0_f64;
    // Distance to the next sample.
    let mut next = 0.0;
    for (number, (from, end)) in pieces(lines).enumerate() {
        let length = (end - from).hypot();
        let mut look = |t: f64| {
            let p = from.lerp(end, t);
            let squared = to.nearest_neighbor(&[p.x, p.y])?.distance_2(&[p.x, p.y]);
            farthest = farthest.max(squared);
            Some(())
        };
        if number.is_multiple_of(every) {
            look(0.0)?;
            look(1.0)?;
        }
        while next < length {
            look(next / length)?;
            next += step;
        }
        next -= length;
    }
    Some(farthest.sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn polylines_of_hp2xx_output() {
        let text = "SP1;PA;PU0.000000,0.000000;PD400.000000,0.0;PD400.0,400.0;PA;PU40,40;PD40,0;";
        let lines = polylines(text, PLOTTER_UNIT_MM);
        assert_eq!(lines.len(), 2);
        assert!((length(&lines) - 21.0).abs() < 1e-12);
    }

    #[test]
    fn polylines_of_inkscape_output() {
        let lines = polylines("IN;PU;SP1;PU0,0;PD400,0,400,400,;PU0,400;PD40,400;PU;SP0;PU0,0;IN; ", 0.025);
        assert_eq!(lines.len(), 2);
        assert!((length(&lines) - 21.0).abs() < 1e-12);
    }

    #[test]
    fn distance_is_symmetric_hausdorff() {
        let line = |y: f64| vec![vec![Point::new(0.0, y), Point::new(10.0, y)]];
        let mut two = line(0.0);
        two.extend(line(3.0));
        two.push(vec![Point::new(5.0, 8.0); 2]);
        two.push(vec![Point::new(5.0, 9.0)]);
        assert_eq!(distance(&line(0.0), &two), Some(3.0));
        assert!(distance(&line(0.0), &line(0.0)).is_some_and(|apart| apart < 1e-9));
        assert_eq!(distance(&line(0.0), &[]), None);
    }

    #[test]
    fn every_note_names_the_right_program() {
        for (file, notes) in notes().unwrap() {
            assert!(!notes.is_empty(), "{file}");
            assert!(notes.iter().all(|note| note.right == "plotplan" || note.right == "both"), "{file}");
        }
    }
}
