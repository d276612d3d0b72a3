//! `plotplan machine new`: a commented machine file from a few answers.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use drawing::{Line, Point, Rect, Segment};
use kinematics::Machine;

use crate::machine_file::{MachineFile, MachineFileError};
use crate::paper;

/// A question about a new machine.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Question {
    /// What `--set` calls the answer.
    pub key: &'static str,
    /// The question.
    pub text: &'static str,
    /// The answer where none is given.
    pub default: &'static str,
}

const fn ask(key: &'static str, text: &'static str, default: &'static str) -> Question {
    Question { key, text, default }
}

/// The kinds of machines that can be made, with a line about each.
pub const KINDS: &[(&str, &str)] = &[
    ("cartesian", "a table: one motor for each axis, or one or two belts (CoreXY, H-bot)"),
    ("two-link", "an arm of two links"),
    ("polar", "a turning rail with a sliding rack"),
    ("five-bar", "two arms that hold the pen together"),
    ("polargraph", "a pen that hangs from two cords"),
];

const TABLE: &[Question] = &[
    ask("width", "Travel along x", "300mm"),
    ask("height", "Travel along y", "200mm"),
    ask("belt", "How do the motors move it: direct, corexy or hbot", "direct"),
    ask("counts", "Ticks per mm of each motor (steps or encoder counts)", "80/mm"),
];
const ARM: &[Question] = &[
    ask("l1", "Length of the first link, from the base to the elbow", "200mm"),
    ask("l2", "Length of the second link, from the elbow to the pen", "200mm"),
    ask("elbow", "On which side of the line from base to pen is the elbow: left or right", "left"),
    ask("motor2", "Where is the second motor: base (belt to the elbow, ratio 1) or elbow", "base"),
    ask("counts", "Ticks per turn of each motor", "3200/rev"),
];
const RAIL: &[Question] = &[
    ask("r_min", "Smallest distance of the pen from the pivot", "50mm"),
    ask("r_max", "Largest distance of the pen from the pivot", "200mm"),
    ask("rack_offset", "Distance at which the rack passes the pivot, to its left", "0mm"),
    ask("counts", "Ticks per turn of the motor that turns the rail", "3200/rev"),
    ask("counts2", "Ticks per mm of the motor of the rack", "80/mm"),
];
const TWO_ARMS: &[Question] = &[
    ask("base", "Distance between the two bases", "80mm"),
    ask("proximal", "Length of the links at the bases", "100mm"),
    ask("distal", "Length of the links at the pen", "140mm"),
    ask("counts", "Ticks per turn of each motor", "3200/rev"),
];
const CORDS: &[Question] = &[
    ask("anchors", "Distance between the places where the cords leave their pulleys", "700mm"),
    ask("below", "How far below the anchors the sheet begins", "200mm"),
    ask("counts", "Ticks per mm of cord", "80/mm"),
];
/// Asked of every machine.
const COMMON: &[Question] = &[
    ask("speed", "Largest speed of the motors", ""),
    ask("acceleration", "Largest acceleration of the motors", ""),
    ask("pen_speed", "Largest speed of the pen while it draws", "60mm/s"),
    ask("lift", "Time that the pen takes to go up or down", "150ms"),
    ask("sheet", "The sheet: A4, A5, letter, WIDTHxHEIGHT, with ,landscape or ,portrait", ""),
];

/// The questions about a machine of this kind; `None` for an unknown kind.
pub fn questions(kind: &str) -> Option<Vec<Question>> {
    let (own, speeds, sheet) = match kind {
        "cartesian" => (TABLE, ["100mm/s", "1000mm/s2"], "A5,landscape"),
        "two-link" => (ARM, ["60deg/s", "300deg/s2"], "A5,landscape"),
        "polar" => (RAIL, ["", ""], "100x70mm"),
        "five-bar" => (TWO_ARMS, ["60deg/s", "300deg/s2"], "100x70mm"),
        "polargraph" => (CORDS, ["50mm/s", "200mm/s2"], "A4"),
        _ => return None,
    };
    let common = COMMON.iter().filter_map(|question| match question.key {
        // A turning joint and a sliding one have limits of their own.
        "speed" | "acceleration" if kind == "polar" => None,
        "speed" => Some(Question { default: speeds[0], ..*question }),
        "acceleration" => Some(Question { default: speeds[1], ..*question }),
        "sheet" => Some(Question { default: sheet, ..*question }),
        _ => Some(*question),
    });
    Some(own.iter().copied().chain(common).collect())
}

/// Why no machine file can be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum NewMachineError {
    /// An answer to a question that is not asked.
    #[error("{key} is not asked about a {kind} machine; known: {known}")]
    Unknown {
        /// The key.
        key: String,
        /// The kind of the machine.
        kind: String,
        /// Keys of the questions.
        known: String,
    },
    /// An answer that cannot be.
    #[error("{key}: {why}")]
    Answer {
        /// The key.
        key: &'static str,
        /// What is wrong.
        why: String,
    },
    /// The answers do not make a machine.
    #[error("these answers make no machine")]
    Machine(#[from] MachineFileError),
}

/// Answers by the keys of the questions, defaults included.
struct Answers<'a> {
    given: &'a BTreeMap<String, String>,
    questions: &'a [Question],
}

impl Answers<'_> {
    fn get(&self, key: &str) -> &str {
        let default = self.questions.iter().find(|question| question.key == key).map_or("", |q| q.default);
        self.given.get(key).map_or(default, String::as_str)
    }

    /// The length of an answer, mm.
    fn mm(&self, key: &'static str) -> Result<f64, NewMachineError> {
        crate::quantity::length_mm(self.get(key), false)
            .map_err(|error| NewMachineError::Answer { key, why: error.to_string() })
    }

    /// One of these words.
    fn choice(&self, key: &'static str, words: &[&str]) -> Result<&str, NewMachineError> {
        let answer = self.get(key);
        if words.contains(&answer) {
            return Ok(answer);
        }
        let why = format!("`{answer}` is none of {}", words.join(", "));
        Err(NewMachineError::Answer { key, why })
    }

    /// A TOML string, and a mark if nobody stated the value.
    fn value(&self, key: &str) -> String {
        format!("{:?}{}", self.get(key), self.mark(key))
    }

    fn mark(&self, key: &str) -> &'static str {
        if self.given.contains_key(key) { "" } else { "  # assumed: check it" }
    }
}

/// The machine file of these answers, and whether its sheet is within reach.
///
/// # Errors
/// An answer to a question that is not asked, or that cannot be.
pub fn machine_file(
    name: &str,
    kind: &str,
    given: &BTreeMap<String, String>,
) -> Result<(String, bool), NewMachineError> {
    let questions = questions(kind).ok_or_else(|| NewMachineError::Answer {
        key: "kind",
        why: format!(
            "`{kind}` is none of {}",
            KINDS.iter().map(|(kind, _)| *kind).collect::<Vec<_>>().join(", ")
        ),
    })?;
    if let Some(key) = given.keys().find(|key| questions.iter().all(|question| question.key != *key)) {
        let known = questions.iter().map(|question| question.key).collect::<Vec<_>>().join(", ");
        return Err(NewMachineError::Unknown { key: key.clone(), kind: kind.into(), known });
    }
    let answers = Answers { given, questions: &questions };
    let sheet_mm =
        paper::size_mm(answers.get("sheet")).map_err(|why| NewMachineError::Answer { key: "sheet", why })?;
    let head = head(name, kind, &answers)?;
    let text = |corner: Point| format!("{head}{}", tail(kind, &answers, sheet_mm, corner));
    let machine = |corner: Point| MachineFile::parse(&text(corner)).and_then(|file| file.machine());
    let reaches = |corner: &Point| machine(*corner).is_ok_and(|machine| is_reached(&machine));
    let candidates = corners(kind, &answers, sheet_mm)?;
    // In the middle of the places where all of the sheet is within reach.
    let good: Vec<Point> = candidates.iter().copied().filter(reaches).collect();
    let corner = good.get(good.len() / 2).or(candidates.get(candidates.len() / 2)).copied();
    let corner = corner.unwrap_or(Point::ZERO);
    machine(corner)?;
    Ok((text(corner), !good.is_empty()))
}

/// Whether all edges of the sheet can be drawn.
fn is_reached(machine: &Machine) -> bool {
    let Rect { x0, y0, x1, y1 } = machine.sheet();
    let corners = [(x0, y0), (x1, y0), (x1, y1), (x0, y1), (x0, y0)].map(Point::from);
    let middle = machine.check_point(machine.sheet().center()).is_ok();
    middle
        && corners
            .windows(2)
            .all(|pair| machine.check_segment(&Segment::Line(Line::new(pair[0], pair[1]))).is_ok())
}

/// Places for the lower-left corner of the sheet, in order of their distance from the base.
fn corners(
    kind: &str,
    answers: &Answers<'_>,
    [width, height]: [f64; 2],
) -> Result<Vec<Point>, NewMachineError> {
    /// Distance between two places, mm.
    const STEP_MM: f64 = 5.0;
    let far = match kind {
        "cartesian" => return Ok(vec![Point::ZERO]),
        "polargraph" => {
            let (anchors, below) = (answers.mm("anchors")?, answers.mm("below")?);
            return Ok(vec![Point::new(0.5 * (anchors - width), -below - height)]);
        }
        "two-link" => answers.mm("l1")? + answers.mm("l2")?,
        "polar" => answers.mm("r_max")?,
        _ => answers.mm("proximal")? + answers.mm("distal")?,
    };
    let count = (far / STEP_MM).clamp(1.0, 400.0) as usize;
    Ok((0..=count).map(|k| Point::new(-0.5 * width, (k as f64 * STEP_MM).round())).collect())
}

fn head(name: &str, kind: &str, answers: &Answers<'_>) -> Result<String, NewMachineError> {
    let mut text = format!(
        "# A machine of your own. All keys: docs/machine-files.md. After each change:\n#     plotplan machine check FILE \
         -o reach.svg\nname = {name:?}\n\n[geometry]\nkind = {kind:?}\n"
    );
    let v = |key: &str| answers.value(key);
    let _ = match kind {
        "cartesian" => write!(
            text,
            "\n[joints]                     # how far the pen can go\nx = {{ min = \"0mm\", max = {:?} }}{}\n\
             y = {{ min = \"0mm\", max = {:?} }}{}\n",
            answers.get("width"),
            answers.mark("width"),
            answers.get("height"),
            answers.mark("height")
        ),
        "two-link" => {
            answers.choice("elbow", &["left", "right"])?;
            write!(
                text,
                "l1 = {}\nl2 = {}\nelbow = {}\nmin_dexterity = 0.1          # smallest |sin| of the angle between \
                 the links\n",
                v("l1"),
                v("l2"),
                v("elbow")
            )
        }
        "polar" => write!(
            text,
            "rack_offset = {}\n\n[joints]\nr = {{ min = {:?}, max = {:?} }}\n",
            v("rack_offset"),
            answers.get("r_min"),
            answers.get("r_max")
        ),
        "five-bar" => {
            let half = 0.5 * answers.mm("base")?;
            write!(
                text,
                "base1 = [\"{}mm\", \"0mm\"]\nbase2 = [\"{half}mm\", \"0mm\"]{}\nproximal1 = {}\nproximal2 = {}\n\
                 distal1 = {}\ndistal2 = {}\nelbow1 = \"left\"             # side of the line from base to pen\n\
                 elbow2 = \"right\"\npen = \"left\"                # side of the way from elbow 1 to elbow 2\n",
                -half,
                answers.mark("base"),
                v("proximal"),
                v("proximal"),
                v("distal"),
                v("distal")
            )
        }
        _ => write!(
            text,
            "left = [\"0mm\", \"0mm\"]        # where the cords leave their pulleys; y up\nright = [{:?}, \"0mm\"]{}\n",
            answers.get("anchors"),
            answers.mark("anchors")
        ),
    };
    let matrix = match kind {
        "cartesian" => match answers.choice("belt", &["direct", "corexy", "hbot"])? {
            "corexy" => "[[1, 1], [1, -1]]",
            "hbot" => "[[1, 1], [-1, 1]]",
            _ => "[[1, 0], [0, 1]]",
        },
        "two-link" if answers.choice("motor2", &["base", "elbow"])? == "elbow" => "[[1, 0], [-1, 1]]",
        _ => "[[1, 0], [0, 1]]",
    };
    let _ = write!(
        text,
        "\n[coupling]                   # ticks = counts * (matrix * joints) + offset. A mirrored picture: change\n\
         matrix = {matrix}   # the signs of a row, or make counts negative\n"
    );
    Ok(text)
}

fn tail(kind: &str, answers: &Answers<'_>, [width, height]: [f64; 2], corner: Point) -> String {
    let mut text = String::new();
    let of_rack = [("counts", "60deg/s", "300deg/s2"), ("counts2", "100mm/s", "1000mm/s2")];
    for (motor, (counts, speed, acceleration)) in of_rack.into_iter().enumerate() {
        let (counts, speed, acceleration) = if kind == "polar" {
            let assumed = |value: &str| format!("{value:?}  # assumed: check it");
            (answers.value(counts), assumed(speed), assumed(acceleration))
        } else {
            (answers.value("counts"), answers.value("speed"), answers.value("acceleration"))
        };
        let _ = write!(
            text,
            "\n[[motor]]\nname = \"motor{}\"\ncounts = {counts}\noffset = 0                   # ticks where the row of \
             the matrix is 0; plotplan calibrate finds it\nmax_speed = {speed}\nmax_acceleration = {acceleration}\n",
            motor + 1
        );
    }
    let (lift, center) = (answers.value("lift"), corner + 0.5 * drawing::Vec2::new(width, height));
    let _ = write!(
        text,
        "\n[pen]\nmax_speed = {}\nlift_time = {lift}\ndrop_time = {lift}\n\n[sheet]                      # {}{}; x and \
         y are its lower-left corner\nx = \"{}mm\"\ny = \"{}mm\"\nwidth = \"{width}mm\"\nheight = \"{height}mm\"\n\n\
         [start]                      # where the machine stands when a plan begins and ends\n",
        answers.value("pen_speed"),
        answers.get("sheet"),
        answers.mark("sheet").replace("  # ", ", "),
        corner.x,
        corner.y
    );
    let start = if kind == "cartesian" { Point::ZERO } else { center };
    let _ = write!(text, "x = \"{}mm\"\ny = \"{}mm\"\n\n[plan]\nperiod = \"10ms\"\n", start.x, start.y);
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn defaults_of_every_kind_make_a_machine_whose_sheet_is_within_reach() {
        for (kind, _) in KINDS {
            let (text, reached) = machine_file("mine", kind, &BTreeMap::new()).unwrap();
            let machine = MachineFile::parse(&text).unwrap().machine().unwrap();
            assert!(reached, "{kind}: {text}");
            assert_eq!((machine.name(), machine.mechanism().kind()), ("mine", *kind));
            assert!(text.contains("assumed: check it"));
        }
    }

    #[test]
    fn answers_are_in_the_file_and_wrong_ones_are_named() {
        let answers = |pairs: &[(&str, &str)]| -> BTreeMap<String, String> {
            pairs.iter().map(|(key, value)| ((*key).to_owned(), (*value).to_owned())).collect()
        };
        let given = answers(&[("l1", "206mm"), ("l2", "256mm"), ("motor2", "elbow"), ("sheet", "letter")]);
        let (text, _) = machine_file("arm", "two-link", &given).unwrap();
        assert!(text.contains("l1 = \"206mm\"\n") && text.contains("[[1, 0], [-1, 1]]"), "{text}");
        for (given, said) in [
            (answers(&[("l3", "1mm")]), "l3 is not asked"),
            (answers(&[("elbow", "up")]), "`up` is none of left, right"),
            (answers(&[("sheet", "A99")]), "unknown paper"),
            (answers(&[("l1", "-5mm")]), "make no machine"),
            (answers(&[("l1", "5")]), "l1: `5` has no unit"),
        ] {
            let error = machine_file("arm", "two-link", &given).unwrap_err();
            assert!(error.to_string().contains(said), "{error}");
        }
    }
}
