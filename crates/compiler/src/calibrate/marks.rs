//! The pattern of numbered crosses, and the ticks at which a machine draws them.

use std::fmt::Write as _;

use drawing::{Point, Vec2};
use kinematics::Machine;

/// Crosses each way over the sheet.
const EACH_WAY: u32 = 5;
/// Half the length of a cross, and the size of the box right above it that holds its number, mm.
const ARM_MM: f64 = 4.0;
const LABEL_MM: Vec2 = Vec2::new(7.0, 5.0);

/// The marks of a machine's pattern: those of a grid over its sheet that it can draw with their numbers.
#[derive(Clone, Debug, PartialEq)]
pub struct Marks {
    /// mm from the lower-left corner of the sheet.
    pub places: Vec<Point>,
    ticks: Vec<[f64; 2]>,
}

impl Marks {
    /// The marks of a machine.
    pub fn of(machine: &Machine) -> Self {
        let sheet = machine.sheet();
        let corner = Vec2::new(sheet.x0, sheet.y0);
        let inset = ARM_MM + 1.0;
        let inner =
            Vec2::new(sheet.width() - 2.0 * inset - LABEL_MM.x, sheet.height() - 2.0 * inset - LABEL_MM.y);
        let mut marks = Self { places: Vec::new(), ticks: Vec::new() };
        for k in 0..EACH_WAY * EACH_WAY {
            let share = |k: u32| f64::from(k) / f64::from(EACH_WAY - 1);
            let (x, y) = (share(k % EACH_WAY) * inner.x, share(k / EACH_WAY) * inner.y);
            let place = Point::new(inset + x.max(0.0), inset + y.max(0.0));
            let around = [
                Vec2::ZERO,
                Vec2::new(ARM_MM, 0.0),
                Vec2::new(-ARM_MM, 0.0),
                Vec2::new(0.0, ARM_MM),
                Vec2::new(0.0, -ARM_MM),
                Vec2::new(1.0, 1.0) + LABEL_MM,
            ];
            if around.iter().any(|off| machine.check_point(place + corner + *off).is_err()) {
                continue;
            }
            let Ok(pose) = machine.pose_near(place + corner, &machine.start()) else { continue };
            marks.places.push(place);
            marks.ticks.push(machine.motor_positions(&pose).0.map(f64::round));
        }
        marks
    }

    /// The ticks of a mark, by its number from 1.
    pub(super) fn ticks(&self, number: usize) -> Option<[f64; 2]> {
        self.ticks.get(number.checked_sub(1)?).copied()
    }
}

/// The pattern of a machine as an HP-GL drawing in the frame of its sheet.
pub fn pattern(marks: &Marks) -> String {
    let mut text = String::from("IN;SP1;SI0.2,0.3;");
    for (index, place) in marks.places.iter().enumerate() {
        // Plotter units of 0.025 mm.
        let unit = |x: f64, y: f64| {
            let [x, y] = [place.x + x, place.y + y].map(|mm| (mm / 0.025).round() as i64);
            format!("{x},{y}")
        };
        let [left, right] = [unit(-ARM_MM, 0.0), unit(ARM_MM, 0.0)];
        let [below, above] = [unit(0.0, -ARM_MM), unit(0.0, ARM_MM)];
        let label = unit(1.5, 1.5);
        let _ = write!(text, "\nPU{left};PD{right};PU{below};PD{above};PU{label};LB{}\u{3};", index + 1);
    }
    text.push_str("\nPU;SP0;\n");
    text
}
