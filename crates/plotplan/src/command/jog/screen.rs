//! The full screen of `plotplan jog`.

use std::io::stdout;
use std::sync::Once;
use std::time::Duration;

use anyhow::Context as _;
use compiler::calibrate::CORNER_NAMES;
use drawing::Point;
use kinematics::reach_outlines;
use ratatui::crossterm::event::{
    self, DisableMouseCapture, EnableMouseCapture, Event, KeyCode, KeyEvent, KeyEventKind, KeyModifiers,
    MouseButton, MouseEvent, MouseEventKind,
};
use ratatui::crossterm::execute;
use ratatui::layout::{Constraint, Layout, Position, Rect};
use ratatui::style::{Color, Modifier, Style};
use ratatui::text::Line;
use ratatui::widgets::{Block, Paragraph, Wrap};
use ratatui::{DefaultTerminal, Frame};

use super::canvas::{self, Shown, View};
use super::command::JogCommand;
use super::sketch::{Sketch, Stylus};
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
    "h home by switches   w ask where it is   m draw with the mouse   q quit",
];
/// Keys of the drawing mode.
const MOUSE_KEYS: &str = "button draws  wheel + - zoom  s sheet  0 reach  Esc stops  m keys  q quit";
/// With this variable in the environment `!` makes the program panic: a test looks at the terminal afterwards.
const PANIC_VARIABLE: &str = "PLOTPLAN_TEST_PANIC";
/// A notch of the wheel zooms by this.
const ZOOM: f64 = 1.25;
/// The planner may leave the way of the mouse, which has the steps of cells, by this share of a column.
const SMOOTHING: f64 = 0.5;
/// The least and the largest tolerance of lines drawn by hand, mm.
const TOLERANCES_MM: [f64; 2] = [0.05, 2.0];

/// What the screen shows besides the machine.
struct Screen {
    /// Index of the step.
    step: usize,
    message: String,
    is_error: bool,
    outlines: Vec<Vec<Point>>,
    sketch: Sketch,
    /// What the drawing mode shows; `None` in the mode of keys.
    mouse: Option<View>,
    /// Where the map was drawn.
    map: Rect,
}

/// A terminal in raw mode with its own screen; as it was before when this is dropped, and before a panic is
/// printed. `ratatui::init` installs a hook for the latter, which does not know about the mouse.
struct Raw(DefaultTerminal);

static MOUSE_HOOK: Once = Once::new();

impl Raw {
    fn new() -> Result<Self, Failure> {
        MOUSE_HOOK.call_once(|| {
            let print = std::panic::take_hook();
            std::panic::set_hook(Box::new(move |panic| {
                let _ = execute!(stdout(), DisableMouseCapture);
                print(panic);
            }));
        });
        let terminal = ratatui::try_init()
            .context("the full screen needs a terminal; --commands FILE takes a script")
            .map_err(Failure::Io)?;
        Ok(Self(terminal))
    }
}

impl Drop for Raw {
    fn drop(&mut self) {
        // The hooks did it before the panic was printed; again, it would move the cursor over the message.
        if !std::thread::panicking() {
            let _ = execute!(stdout(), DisableMouseCapture);
            ratatui::restore();
        }
    }
}

pub(super) fn run(jogger: &mut Jogger<'_>) -> Result<(), Failure> {
    let mut raw = Raw::new()?;
    let mut screen = Screen {
        step: 1,
        message: "ready".to_owned(),
        is_error: false,
        outlines: reach_outlines(jogger.machine),
        sketch: Sketch::default(),
        mouse: None,
        map: Rect::ZERO,
    };
    jogger.step_mm = STEPS_MM[screen.step];
    loop {
        draw(&mut raw.0, &Facts::of(jogger, &screen), &mut screen)?;
        if let Some(step) = screen.sketch.next() {
            screen.say("drawing; Esc stops".to_owned(), false);
            let tolerance_mm = screen.tolerance_mm();
            let facts = Facts::of(jogger, &screen);
            let mut stops = || screen.collect(&mut raw.0, &facts, jogger.machine);
            let done = jogger_draws(jogger, &step, tolerance_mm, &mut stops);
            screen.report(done, jogger)?;
            continue;
        }
        let Some(event) = next_event(POLL)? else {
            if jogger.wire.is_interrupted() {
                return Err(Failure::Interrupted);
            }
            continue;
        };
        let Event::Key(key) = event else {
            screen.accept(&event, jogger.machine);
            continue;
        };
        let may_panic = key.code == KeyCode::Char('!') && std::env::var_os(PANIC_VARIABLE).is_some();
        assert!(!may_panic, "{PANIC_VARIABLE} is set");
        if screen.view_key(key, jogger)? {
            continue;
        }
        let Some(command) = screen.command(key, jogger.corner) else { continue };
        if command == JogCommand::Quit {
            return Ok(());
        }
        if !matches!(command, JogCommand::Step(_)) {
            screen.say("moving; Esc stops".to_owned(), false);
            draw(&mut raw.0, &Facts::of(jogger, &screen), &mut screen)?;
        }
        let mut stops =
            || matches!(next_event(Duration::ZERO), Ok(Some(Event::Key(key))) if key.code == KeyCode::Esc);
        let done = jogger.obey(command, &mut stops);
        screen.report(done, jogger)?;
    }
}

/// The next event that matters within this time.
fn next_event(within: Duration) -> Result<Option<Event>, Failure> {
    let failed = |error: std::io::Error| Failure::Io(anyhow::Error::new(error).context("cannot read keys"));
    if !event::poll(within).map_err(failed)? {
        return Ok(None);
    }
    Ok(Some(event::read().map_err(failed)?).filter(|event| !is_release(event)))
}

fn is_release(event: &Event) -> bool {
    matches!(event, Event::Key(key) if key.kind == KeyEventKind::Release)
}

impl Screen {
    fn say(&mut self, message: String, is_error: bool) {
        (self.message, self.is_error) = (message, is_error);
    }

    /// Shows what became of a command.
    fn report(&mut self, done: Result<String, JogError>, jogger: &Jogger<'_>) -> Result<(), Failure> {
        match done {
            Ok(said) => self.say(said, false),
            Err(JogError::Refused(what)) => {
                self.sketch.stop();
                let pen = if jogger.is_down { "; the pen is down" } else { "" };
                self.say(format!("not moved: {what}{pen}"), true);
            }
            Err(JogError::Failed(failure)) => return Err(failure),
        }
        if let Some(what) = self.sketch.take_complaint() {
            self.say(format!("left out: {what}"), true);
        }
        Ok(())
    }

    /// How far the planner may leave the way of the mouse, mm.
    fn tolerance_mm(&self) -> f64 {
        let column_mm = self.mouse.map_or(0.0, |view| view.column_mm);
        (SMOOTHING * column_mm).clamp(TOLERANCES_MM[0], TOLERANCES_MM[1])
    }

    /// The keys that change what is shown; whether this was one of them.
    fn view_key(&mut self, key: KeyEvent, jogger: &Jogger<'_>) -> Result<bool, Failure> {
        let failed =
            |error: std::io::Error| Failure::Io(anyhow::Error::new(error).context("cannot use the mouse"));
        let all = canvas::window(jogger, &self.outlines);
        let sheet = jogger.machine.sheet().inflate(2.0, 2.0);
        match (key.code, &mut self.mouse) {
            (KeyCode::Char('m'), None) => {
                execute!(stdout(), EnableMouseCapture).map_err(failed)?;
                self.mouse = Some(View::of(sheet, self.map));
                self.say("draw with the left button held".to_owned(), false);
                // The map becomes larger.
                self.map = Rect::ZERO;
            }
            (KeyCode::Char('m'), Some(_)) => {
                execute!(stdout(), DisableMouseCapture).map_err(failed)?;
                (self.mouse, self.map) = (None, Rect::ZERO);
                self.sketch.stop();
                self.say("ready".to_owned(), false);
            }
            (KeyCode::Char('0'), Some(view)) => *view = View::of(all, self.map),
            (KeyCode::Char('s'), Some(view)) => *view = View::of(sheet, self.map),
            (KeyCode::Char('+' | '='), Some(_)) => self.zoom(ZOOM, jogger.pen()),
            (KeyCode::Char('-'), Some(_)) => self.zoom(1.0 / ZOOM, jogger.pen()),
            _ => return Ok(false),
        }
        Ok(true)
    }

    fn zoom(&mut self, factor: f64, fixed: Point) {
        /// A column shows at most this much, mm.
        const WIDEST_MM: f64 = 100.0;
        if let Some(view) = &mut self.mouse {
            *view = view.zoomed(factor, fixed, WIDEST_MM);
        }
    }

    /// Takes what the mouse does.
    fn accept(&mut self, event: &Event, machine: &kinematics::Machine) {
        let (Event::Mouse(MouseEvent { kind, column, row, .. }), Some(view)) = (event, self.mouse) else {
            return;
        };
        let place = view.place(Position::new(*column, *row), self.map);
        let stylus = match (kind, place) {
            (MouseEventKind::Down(MouseButton::Left), Some(place)) => Stylus::Press(place),
            (MouseEventKind::Drag(MouseButton::Left), Some(place)) => Stylus::Drag(place),
            (MouseEventKind::Up(MouseButton::Left), _) => Stylus::Release,
            (MouseEventKind::ScrollUp, Some(place)) => return self.zoom(ZOOM, place),
            (MouseEventKind::ScrollDown, Some(place)) => return self.zoom(1.0 / ZOOM, place),
            _ => return,
        };
        self.sketch.add(stylus, machine);
    }

    /// Takes what the mouse does while the machine moves; whether it is to stop.
    fn collect(
        &mut self,
        terminal: &mut DefaultTerminal,
        facts: &Facts,
        machine: &kinematics::Machine,
    ) -> bool {
        let mut is_new = false;
        while let Ok(Some(event)) = next_event(Duration::ZERO) {
            if matches!(event, Event::Key(key) if key.code == KeyCode::Esc) {
                return true;
            }
            self.accept(&event, machine);
            is_new = true;
        }
        // A screen that cannot be drawn is reported when the machine is at rest.
        is_new && draw(terminal, facts, self).is_err()
    }

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

/// Draws a step of the sketch; on a refusal the pen goes up.
fn jogger_draws(
    jogger: &mut Jogger<'_>,
    step: &super::sketch::Step,
    tolerance_mm: f64,
    stops: &mut dyn FnMut() -> bool,
) -> Result<String, JogError> {
    let done = jogger.draw(step, tolerance_mm, stops);
    if let Err(JogError::Refused(_)) = &done
        && jogger.is_down
    {
        jogger.set_pen(false, &mut || false)?;
    }
    done.map(|()| jogger.place())
}

/// What is known of the machine: it is shown while the machine moves.
struct Facts {
    name: String,
    pen: Point,
    corners: [Point; 4],
    lines: Vec<Line<'static>>,
    /// Reach, sheet and pen.
    window: drawing::Rect,
    /// The sheet with a margin.
    sheet: drawing::Rect,
}

impl Facts {
    fn of(jogger: &Jogger<'_>, screen: &Screen) -> Self {
        Self {
            name: jogger.machine.name().to_owned(),
            pen: jogger.pen(),
            corners: [0, 1, 2, 3].map(|corner| jogger.corner_at(corner)),
            lines: lines(jogger, screen.step),
            window: canvas::window(jogger, &screen.outlines),
            sheet: jogger.machine.sheet().inflate(2.0, 2.0),
        }
    }
}

fn draw(terminal: &mut DefaultTerminal, facts: &Facts, screen: &mut Screen) -> Result<(), Failure> {
    let drawn = terminal.draw(|frame| show(frame, facts, screen));
    drawn
        .map(|_| ())
        .map_err(|error| Failure::Io(anyhow::Error::new(error).context("cannot draw the screen")))
}

fn show(frame: &mut Frame<'_>, facts: &Facts, screen: &mut Screen) {
    let (keys, sizes) = match screen.mouse {
        None => (KEYS.map(Line::from).to_vec(), [8, 4]),
        Some(_) => (vec![Line::from(MOUSE_KEYS)], [8, 3]),
    };
    let rows =
        [Constraint::Min(sizes[0]), Constraint::Length(sizes[1]), Constraint::Length(keys.len() as u16 + 2)];
    let [top, message, bottom] = Layout::vertical(rows).areas(frame.area());
    let shown = Shown {
        pen: facts.pen,
        corners: facts.corners,
        outlines: &screen.outlines,
        strokes: &screen.sketch.strokes,
    };
    let map = if let Some(view) = &mut screen.mouse {
        if screen.map.area() == 0 {
            *view = View::of(facts.sheet, top);
        }
        let title = format!(
            " {}: a column is {:.2} mm, a row {:.2} mm ",
            facts.name,
            view.column_mm,
            2.0 * view.column_mm
        );
        canvas::show(frame, top, *view, &title, &shown);
        top
    } else {
        let [left, map] = Layout::horizontal([Constraint::Length(34), Constraint::Min(20)]).areas(top);
        let block = Block::bordered().title(format!(" {} ", facts.name));
        frame.render_widget(Paragraph::new(facts.lines.clone()).block(block), left);
        canvas::show(frame, map, View::of(facts.window, map), " reach, sheet, pen ", &shown);
        map
    };
    screen.map = map;
    let color = if screen.is_error { Color::Red } else { Color::Reset };
    frame.render_widget(
        Paragraph::new(screen.message.as_str())
            .style(Style::new().fg(color))
            .wrap(Wrap { trim: true })
            .block(Block::bordered()),
        message,
    );
    frame.render_widget(Paragraph::new(keys).block(Block::bordered().title(" keys ")), bottom);
}

fn lines(jogger: &Jogger<'_>, step: usize) -> Vec<Line<'static>> {
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
    lines.push(Line::from(format!("step {} mm, {} ticks", STEPS_MM[step], TICKS[step])));
    let corner = jogger.corner.map_or("none", |corner| CORNER_NAMES[corner]);
    lines.push(Line::from(format!("corner {corner}, touches {}", jogger.touches)));
    lines
}
