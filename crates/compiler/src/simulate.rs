//! From a plan and a drive to predicted ink and its report.

use std::io::{self, Write};

use drawing::{Drawing, Point};
use kinematics::Machine;
use plan::Row;
use simulation::{
    Drive, Feedback, InkError, InkRecorder, Job, Margins, MotorPlant, Outcome, Sample, SimulationError,
    StepResponse, Target, Vertex,
};

/// Curves become vertices for firmware that knows nothing else; their chords deviate by at most this,
/// mm, as when HP-GL is written by a drawing program.
const VERTEX_CHORD_MM: f64 = 0.1;

/// What is simulated.
#[derive(Clone, Copy, Debug)]
pub struct Plan<'a> {
    /// The machine.
    pub machine: &'a Machine,
    /// The rows of the plan.
    pub rows: &'a [Row],
    /// Time between rows, microseconds.
    pub period_us: u64,
    /// The drawing in machine mm, in the order drawn.
    pub drawing: &'a Drawing,
}

/// A simulation with its ink.
#[derive(Clone, Debug)]
pub struct Simulated {
    /// Motors, times.
    pub outcome: Outcome,
    /// The ink compared with the drawing.
    pub ink: InkError,
    /// Lines of ink with their pens, machine mm.
    pub lines: Vec<(u16, Vec<Point>)>,
    /// Margins of the motors' loops; `None` for those without a PID loop.
    pub margins: [Option<Margins>; 2],
}

/// The vertices of the drawing, for firmware that follows nothing else.
pub fn vertices(plan: &Plan<'_>) -> Vec<Vertex> {
    let strokes = plan.drawing.strokes.iter();
    simulation::vertices(plan.machine, strokes.map(|stroke| (stroke.pen.0, stroke.flatten(VERTEX_CHORD_MM))))
}

/// Simulates a plan; `observe` gets a sample every 2 ms.
///
/// # Errors
/// When there is nothing to simulate, or a motor runs away.
pub fn simulate(
    plan: &Plan<'_>,
    drive: &Drive,
    mut observe: impl FnMut(&Sample),
) -> Result<Simulated, SimulationError> {
    let vertices = vertices(plan);
    let job = Job { machine: plan.machine, rows: plan.rows, period_us: plan.period_us, vertices: &vertices };
    let mut recorder = InkRecorder::new(plan.machine);
    let outcome = simulation::simulate(&job, drive, |sample| {
        recorder.observe(sample);
        observe(sample);
    })?;
    Ok(Simulated {
        outcome,
        ink: recorder.compare(&Target::new(plan.drawing)),
        lines: recorder.lines(),
        margins: margins(drive),
    })
}

/// The margins of both loops; `None` for motors without a PID loop.
pub fn margins(drive: &Drive) -> [Option<Margins>; 2] {
    [0, 1].map(|index: usize| match (&drive.motors[index].plant, &drive.feedback) {
        (MotorPlant::Dc(motor), Feedback::Pid(gains, _)) => simulation::margins(gains, motor, drive.period_s),
        _ => None,
    })
}

/// Writes a step response as SVG: position over time with the setpoint.
///
/// # Errors
/// Whatever the writer says.
pub fn step_svg<W: Write + ?Sized>(response: &StepResponse, step: f64, out: &mut W) -> io::Result<()> {
    /// Size of the plot and its margin.
    const WIDTH: f64 = 640.0;
    const HEIGHT: f64 = 360.0;
    const MARGIN: f64 = 48.0;
    let points = &response.points;
    let end_s = points.last().map_or(1.0, |point| point.t_s).max(1e-9);
    let (mut low, mut high) = (step.min(0.0), step.max(0.0));
    for point in points {
        (low, high) = (low.min(point.position), high.max(point.position));
    }
    let room = 0.05 * (high - low);
    (low, high) = (low - room, high + room);
    let x = |t: f64| MARGIN + t / end_s * WIDTH;
    let y = |position: f64| MARGIN + (high - position) / (high - low) * HEIGHT;
    let (width, height) = (WIDTH + 2.0 * MARGIN, HEIGHT + 2.0 * MARGIN);
    writeln!(
        out,
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {width} {height}\" font-family=\"sans-serif\" font-size=\"12\">"
    )?;
    writeln!(out, "<rect width=\"{width}\" height=\"{height}\" fill=\"#ffffff\"/>")?;
    writeln!(
        out,
        "<rect x=\"{MARGIN}\" y=\"{MARGIN}\" width=\"{WIDTH}\" height=\"{HEIGHT}\" fill=\"none\" stroke=\"#555555\"/>"
    )?;
    for part in 0..=4 {
        let share = f64::from(part) / 4.0;
        let (t, position) = (share * end_s, low + share * (high - low));
        writeln!(
            out,
            "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{t:.2} s</text>",
            x(t),
            MARGIN + HEIGHT + 18.0
        )?;
        writeln!(
            out,
            "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{position:.0}</text>",
            MARGIN - 4.0,
            y(position) + 4.0
        )?;
    }
    writeln!(
        out,
        "<path d=\"M{MARGIN} {:.2}H{:.1}\" stroke=\"#9cc8f0\" stroke-width=\"2\"/>",
        y(step),
        MARGIN + WIDTH
    )?;
    write!(out, "<path fill=\"none\" stroke=\"#000000\" stroke-width=\"1.5\" d=\"")?;
    for (index, point) in points.iter().enumerate() {
        let command = if index == 0 { 'M' } else { ' ' };
        write!(out, "{command}{:.2} {:.2}", x(point.t_s), y(point.position))?;
    }
    writeln!(out, "\"/>\n</svg>")
}
