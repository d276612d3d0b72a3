//! The language of jog scripts: one command a line.

use compiler::quantity;
use drawing::Point;

use super::sketch::Stylus;

/// What a key or a line asks for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum JogCommand {
    /// By the step, in this direction.
    Move(f64, f64),
    /// By these lengths, mm.
    By(f64, f64),
    /// To this place of the sheet, mm from its lower-left corner.
    Goto(f64, f64),
    /// One motor by ticks.
    Motor(usize, i64),
    /// The length of a step, mm.
    Step(f64),
    /// Pen down or up.
    Pen(bool),
    /// To a corner of the sheet, in the order in which calibrate takes them.
    Corner(usize),
    /// Homes by switches.
    Home,
    /// Asks the machine where it is.
    Where,
    /// Records a touch.
    Touch(Option<(f64, f64)>),
    /// What the mouse does in the drawing mode; in a script at a place of the sheet, mm.
    Stylus(Stylus),
    /// Ends.
    Quit,
}

/// Short names of the corners.
pub(super) const CORNERS: [&str; 4] = ["ll", "lr", "ur", "ul"];

/// The command of a line; `None` for an empty one or a comment.
pub(super) fn parse(line: &str) -> Result<Option<JogCommand>, String> {
    let line = line.split('#').next().unwrap_or_default();
    let words: Vec<&str> = line.split_whitespace().collect();
    let mm = |text: &str| quantity::length_mm(text, true).map_err(|error| error.to_string());
    let corner = |name: &str| {
        let at = CORNERS.iter().position(|known| *known == name);
        at.ok_or_else(|| format!("`{name}` is no corner: they are {}", CORNERS.join(", ")))
    };
    let command = match words[..] {
        [] => return Ok(None),
        ["left"] => JogCommand::Move(-1.0, 0.0),
        ["right"] => JogCommand::Move(1.0, 0.0),
        ["down"] => JogCommand::Move(0.0, -1.0),
        ["up"] => JogCommand::Move(0.0, 1.0),
        ["left", by] => JogCommand::By(-mm(by)?, 0.0),
        ["right", by] => JogCommand::By(mm(by)?, 0.0),
        ["down", by] => JogCommand::By(0.0, -mm(by)?),
        ["up", by] => JogCommand::By(0.0, mm(by)?),
        ["move", x, y] => JogCommand::By(mm(x)?, mm(y)?),
        ["goto", x, y] => JogCommand::Goto(mm(x)?, mm(y)?),
        ["step", by] => {
            let step = mm(by)?;
            if !(0.001..=1000.0).contains(&step) {
                return Err(format!("a step is from 0.001 to 1000 mm, not {by}"));
            }
            JogCommand::Step(step)
        }
        ["motor", which @ ("1" | "2"), ticks] => {
            let ticks = ticks.parse::<i64>().ok().filter(|ticks| ticks.abs() < 1 << 40);
            JogCommand::Motor(usize::from(which == "2"), ticks.ok_or("a motor turns by whole ticks")?)
        }
        ["pen", "up"] => JogCommand::Pen(false),
        ["pen", "down"] => JogCommand::Pen(true),
        ["corner", name] => JogCommand::Corner(corner(name)?),
        ["home"] => JogCommand::Home,
        ["where"] => JogCommand::Where,
        ["touch"] => JogCommand::Touch(None),
        ["touch", x, y] => JogCommand::Touch(Some((mm(x)?, mm(y)?))),
        ["press", x, y] => JogCommand::Stylus(Stylus::Press(Point::new(mm(x)?, mm(y)?))),
        ["drag", x, y] => JogCommand::Stylus(Stylus::Drag(Point::new(mm(x)?, mm(y)?))),
        ["release"] => JogCommand::Stylus(Stylus::Release),
        ["quit"] => JogCommand::Quit,
        _ => {
            return Err(format!(
                "`{}` is none of left, right, up, down [MM], move X Y, goto X Y, step MM, motor 1|2 TICKS, pen up|down, \
                 corner ll|lr|ur|ul, home, where, touch [X Y], press X Y, drag X Y, release, quit",
                line.trim()
            ));
        }
    };
    Ok(Some(command))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_of_a_script() {
        for (line, command) in [
            ("left", JogCommand::Move(-1.0, 0.0)),
            ("  up 2.5mm # higher", JogCommand::By(0.0, 2.5)),
            ("down 1in", JogCommand::By(0.0, -25.4)),
            ("motor 2 -15", JogCommand::Motor(1, -15)),
            ("corner ur", JogCommand::Corner(2)),
            ("touch 1cm 20", JogCommand::Touch(Some((10.0, 20.0)))),
            ("drag 1cm 20", JogCommand::Stylus(Stylus::Drag(Point::new(10.0, 20.0)))),
        ] {
            assert_eq!(parse(line), Ok(Some(command)), "{line}");
        }
        assert_eq!(parse(" # nothing"), Ok(None));
        for wrong in
            ["jump", "left 5s", "motor 3 1", "motor 1 0.5", "step 0", "corner mm", "pen", "goto 1", "press 1"]
        {
            assert!(parse(wrong).is_err(), "{wrong}");
        }
    }
}
