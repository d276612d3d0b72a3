//! The full screen of `plotplan jog`.

use std::time::Duration;

use anyhow::Context as _;
use compiler::calibrate::CORNER_NAMES;
use kinematics::reach_outlines;
use ratatui::crossterm::event::{self, Event, KeyCode, KeyEvent, KeyEventKind, KeyModifiers};
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::{Color, Modifier, Style};
use ratatui::symbols::Marker;
use ratatui::text::Line;
use ratatui::widgets::canvas::{Canvas, Line as Stroke, Points};
use ratatui::widgets::{Block, Paragraph, Wrap};
use ratatui::{DefaultTerminal, Frame};

use super::command::{CORNERS, JogCommand};
use super::{JogError, Jogger};
use crate::failure::Failure;

/// Steps of the keys 1 to 4, mm.
const STEPS_MM: [f64; 4] = [0.1, 1.0, 2.0, 10.0];
/// Ticks by which Shift and an arrow turn a motor, for each step.
const TICKS: [i64; 4] = [1, 10, 20, 100];
/// The screen waits this long for a key.
const POLL: Duration = Duration::from_millis(100);
/// Keys, as they are shown.
const KEYS: [&str; 4] = [
    "arrows pen by the step   Shift+left/right motor 1, Shift+up/down motor 2",
    "1 2 3 4 step 0.1 1 2 10 mm   d pen down   u pen up   Esc stops a motion",
    "c next corner of the sheet   C the one before   t record a touch there",
    "h home by switches   w ask where it is   q quit",
];

/// What the screen shows besides the machine.
struct Screen {
    /// Index of the step.
    step: usize,
    message: String,
    is_error: bool,
    outlines: Vec<Vec<drawing::Point>>,
}

/// A terminal in raw mode with its own screen; as it was before when this is dropped. `ratatui::init` also
/// restores it before a panic is printed.
struct Raw(DefaultTerminal);

impl Raw {
    fn new() -> Result<Self, Failure> {
        let terminal = ratatui::try_init()
            .context("the full screen needs a terminal; --commands FILE takes a script")
            .map_err(Failure::Io)?;
        Ok(Self(terminal))
    }
}

impl Drop for Raw {
    fn drop(&mut self) {
        ratatui::restore();
    }
}

pub(super) fn run(jogger: &mut Jogger<'_>) -> Result<(), Failure> {
    let mut raw = Raw::new()?;
    let mut screen = Screen {
        step: 1,
        message: "ready".to_owned(),
        is_error: false,
        outlines: reach_outlines(jogger.machine),
    };
    jogger.step_mm = STEPS_MM[screen.step];
    loop {
        draw(&mut raw.0, jogger, &screen)?;
        let Some(key) = next_key(POLL)? else {
            if jogger.wire.is_interrupted() {
                return Err(Failure::Interrupted);
            }
            continue;
        };
        let Some(command) = screen.command(key, jogger.corner) else { continue };
        if command == JogCommand::Quit {
            return Ok(());
        }
        if !matches!(command, JogCommand::Step(_)) {
            (screen.message, screen.is_error) = ("moving; Esc stops".to_owned(), false);
            draw(&mut raw.0, jogger, &screen)?;
        }
        let mut stops = || matches!(next_key(Duration::ZERO), Ok(Some(key)) if key.code == KeyCode::Esc);
        (screen.message, screen.is_error) = match jogger.obey(command, &mut stops) {
            Ok(said) => (said, false),
            Err(JogError::Refused(what)) => (format!("not moved: {what}"), true),
            Err(JogError::Failed(failure)) => return Err(failure),
        };
    }
}

/// The next key that is pressed within this time.
fn next_key(within: Duration) -> Result<Option<KeyEvent>, Failure> {
    let failed = |error: std::io::Error| Failure::Io(anyhow::Error::new(error).context("cannot read keys"));
    if !event::poll(within).map_err(failed)? {
        return Ok(None);
    }
    Ok(match event::read().map_err(failed)? {
        Event::Key(key) if key.kind != KeyEventKind::Release => Some(key),
        _ => None,
    })
}

impl Screen {
    /// What a key asks for.
    fn command(&mut self, key: KeyEvent, corner: Option<usize>) -> Option<JogCommand> {
        let shift = key.modifiers.contains(KeyModifiers::SHIFT);
        let ticks = TICKS[self.step];
        Some(match key.code {
            KeyCode::Left if shift => JogCommand::Motor(0, -ticks),
            KeyCode::Right if shift => JogCommand::Motor(0, ticks),
            KeyCode::Down if shift => JogCommand::Motor(1, -ticks),
            KeyCode::Up if shift => JogCommand::Motor(1, ticks),
            KeyCode::Left => JogCommand::Move(-1.0, 0.0),
            KeyCode::Right => JogCommand::Move(1.0, 0.0),
            KeyCode::Down => JogCommand::Move(0.0, -1.0),
            KeyCode::Up => JogCommand::Move(0.0, 1.0),
            KeyCode::Char('c') if key.modifiers.contains(KeyModifiers::CONTROL) => JogCommand::Quit,
            KeyCode::Char(digit @ '1'..='4') => {
                self.step = digit as usize - '1' as usize;
                JogCommand::Step(STEPS_MM[self.step])
            }
            KeyCode::Char('d') => JogCommand::Pen(true),
            KeyCode::Char('u') => JogCommand::Pen(false),
            KeyCode::Char('c') => JogCommand::Corner(corner.map_or(0, |corner| (corner + 1) % 4)),
            KeyCode::Char('C') => JogCommand::Corner(corner.map_or(0, |corner| (corner + 3) % 4)),
            KeyCode::Char('t') => JogCommand::Touch(None),
            KeyCode::Char('h') => JogCommand::Home,
            KeyCode::Char('w') => JogCommand::Where,
            KeyCode::Char('q') => JogCommand::Quit,
            _ => return None,
        })
    }
}

fn draw(terminal: &mut DefaultTerminal, jogger: &Jogger<'_>, screen: &Screen) -> Result<(), Failure> {
    let drawn = terminal.draw(|frame| show(frame, jogger, screen));
    drawn
        .map(|_| ())
        .map_err(|error| Failure::Io(anyhow::Error::new(error).context("cannot draw the screen")))
}

fn show(frame: &mut Frame<'_>, jogger: &Jogger<'_>, screen: &Screen) {
    let rows = [Constraint::Min(8), Constraint::Length(4), Constraint::Length(KEYS.len() as u16 + 2)];
    let [top, message, keys] = Layout::vertical(rows).areas(frame.area());
    let [facts, map] = Layout::horizontal([Constraint::Length(34), Constraint::Min(20)]).areas(top);
    frame.render_widget(
        Paragraph::new(lines(jogger, screen))
            .block(Block::bordered().title(format!(" {} ", jogger.machine.name()))),
        facts,
    );
    show_map(frame, map, jogger, screen);
    let color = if screen.is_error { Color::Red } else { Color::Reset };
    frame.render_widget(
        Paragraph::new(screen.message.as_str())
            .style(Style::new().fg(color))
            .wrap(Wrap { trim: true })
            .block(Block::bordered()),
        message,
    );
    frame.render_widget(
        Paragraph::new(KEYS.map(Line::from).to_vec()).block(Block::bordered().title(" keys ")),
        keys,
    );
}

fn lines(jogger: &Jogger<'_>, screen: &Screen) -> Vec<Line<'static>> {
    let (pen, pose) = (jogger.pen(), jogger.pose());
    let sheet = jogger.machine.sheet();
    let mechanism = jogger.machine.mechanism();
    let strong = Style::new().add_modifier(Modifier::BOLD);
    let mut lines = vec![
        Line::styled(format!("x {:9.2} mm  y {:9.2} mm", pen.x, pen.y), strong),
        Line::from(format!("sheet {:5.1}          {:7.1} mm", pen.x - sheet.x0, pen.y - sheet.y0)),
        Line::styled(format!("pen {}", if jogger.is_down { "down" } else { "up" }), strong),
    ];
    let kinds = mechanism.joint_kinds();
    for (index, name) in mechanism.joint_names().into_iter().enumerate() {
        lines.push(Line::from(match kinds[index] {
            kinematics::JointKind::Revolute => format!("{name:<8} {:9.2} deg", pose[index].to_degrees()),
            kinematics::JointKind::Prismatic => format!("{name:<8} {:9.2} mm", pose[index]),
        }));
    }
    for (motor, ticks) in jogger.machine.motors().iter().zip(jogger.ticks) {
        lines.push(Line::from(format!("{:<8.8} {ticks:9} ticks", motor.name)));
    }
    let margins = jogger.margins().map(|mm| if mm >= 999.0 { "far".to_owned() } else { format!("{mm:.1}") });
    lines.push(Line::from("to the edge of reach, mm:"));
    lines.push(Line::from(format!("  left {} right {}", margins[0], margins[1])));
    lines.push(Line::from(format!("  down {} up {}", margins[2], margins[3])));
    lines.push(Line::from(format!("step {} mm, {} ticks", STEPS_MM[screen.step], TICKS[screen.step])));
    let corner = jogger.corner.map_or("none", |corner| CORNER_NAMES[corner]);
    lines.push(Line::from(format!("corner {corner}, touches {}", jogger.touches)));
    lines
}

/// Reach, sheet and pen, to scale.
fn show_map(frame: &mut Frame<'_>, area: Rect, jogger: &Jogger<'_>, screen: &Screen) {
    let sheet = jogger.machine.sheet();
    let pen = jogger.pen();
    let points = screen.outlines.iter().flatten().copied();
    let all = points.fold(sheet.union_pt(pen), |bounds, point| bounds.union_pt(point)).inflate(5.0, 5.0);
    // A braille cell is twice as high as it is wide.
    let (width, height) = (f64::from(area.width.max(3) - 2), 2.0 * f64::from(area.height.max(3) - 2));
    let scale = (all.width() / width).max(all.height() / height);
    let (half_x, half_y) = (0.5 * scale * width, 0.5 * scale * height);
    let center = all.center();
    let canvas = Canvas::default()
        .block(Block::bordered().title(" reach, sheet, pen "))
        .marker(Marker::Braille)
        .x_bounds([center.x - half_x, center.x + half_x])
        .y_bounds([center.y - half_y, center.y + half_y])
        .paint(|context| {
            for outline in &screen.outlines {
                for pair in outline.windows(2) {
                    context.draw(&Stroke::new(pair[0].x, pair[0].y, pair[1].x, pair[1].y, Color::DarkGray));
                }
            }
            context.layer();
            let corners = [0, 1, 2, 3, 0].map(|corner: usize| jogger.corner_at(corner));
            for pair in corners.windows(2) {
                context.draw(&Stroke::new(pair[0].x, pair[0].y, pair[1].x, pair[1].y, Color::Blue));
            }
            context.layer();
            for (corner, name) in CORNERS.iter().enumerate() {
                let at = jogger.corner_at(corner);
                context.print(at.x, at.y, Line::styled(*name, Style::new().fg(Color::Blue)));
            }
            // Over the names of the corners.
            context.layer();
            context.draw(&Points { coords: &[(pen.x, pen.y)], color: Color::Red });
            context.print(
                pen.x,
                pen.y,
                Line::styled("+", Style::new().fg(Color::Red).add_modifier(Modifier::BOLD)),
            );
        });
    frame.render_widget(canvas, area);
}
