//! Cells of the terminal as places of the machine: the map of the jog screen, and the sheet under the mouse.

use drawing::{Point, Rect as Window, Vec2};
use ratatui::Frame;
use ratatui::layout::{Position, Rect};
use ratatui::style::{Color, Modifier, Style};
use ratatui::symbols::Marker;
use ratatui::text::Line;
use ratatui::widgets::Block;
use ratatui::widgets::canvas::{Canvas, Line as Stroke, Points};

use super::Jogger;
use super::command::CORNERS;

/// The narrowest column that zooming leads to, mm.
const NARROWEST_MM: f64 = 0.02;

/// The part of the machine's plane that an area of the terminal shows. A cell is twice as high as wide.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct View {
    center: Point,
    /// Width of a column, mm; a row has twice as many.
    pub(super) column_mm: f64,
}

/// The cells inside the border.
fn inside(area: Rect) -> Rect {
    Block::bordered().inner(area)
}

impl View {
    /// All of this window, as large as possible.
    pub(super) fn of(window: Window, area: Rect) -> Self {
        let inner = inside(area);
        let (columns, rows) = (f64::from(inner.width.max(1)), f64::from(inner.height.max(1)));
        let column_mm = (window.width() / columns).max(window.height() / (2.0 * rows));
        Self { center: window.center(), column_mm: column_mm.max(NARROWEST_MM) }
    }

    /// The place under the middle of a cell; `None` outside of the area.
    pub(super) fn place(&self, cell: Position, area: Rect) -> Option<Point> {
        let inner = inside(area);
        inner.contains(cell).then(|| {
            let column = f64::from(cell.x) + 0.5 - f64::from(inner.x) - 0.5 * f64::from(inner.width);
            let row = f64::from(cell.y) + 0.5 - f64::from(inner.y) - 0.5 * f64::from(inner.height);
            self.center + self.column_mm * Vec2::new(column, -2.0 * row)
        })
    }

    /// Larger by this factor; what is at `fixed` stays where it is.
    pub(super) fn zoomed(self, factor: f64, fixed: Point, largest_mm: f64) -> Self {
        let column_mm = (self.column_mm / factor).clamp(NARROWEST_MM, largest_mm.max(NARROWEST_MM));
        Self { center: fixed + (column_mm / self.column_mm) * (self.center - fixed), column_mm }
    }

    /// Where `Canvas` must be asked to print a text so that it begins in the cell of this place: it counts one
    /// column and one row less than it has.
    fn print_at(&self, place: Point, area: Rect) -> [f64; 2] {
        let inner = inside(area);
        let [[left, right], [bottom, top]] = self.bounds(area);
        let cell = |from_edge_mm: f64, cell_mm: f64, cells: u16, length_mm: f64| {
            let cell = (from_edge_mm / cell_mm).floor();
            (cell + 0.5) * length_mm / f64::from(cells.max(2) - 1)
        };
        let x = left + cell(place.x - left, self.column_mm, inner.width, right - left);
        let y = top - cell(top - place.y, 2.0 * self.column_mm, inner.height, top - bottom);
        [x, y]
    }

    /// Left and right, bottom and top edge.
    fn bounds(&self, area: Rect) -> [[f64; 2]; 2] {
        let inner = inside(area);
        let half_x = 0.5 * self.column_mm * f64::from(inner.width);
        let half_y = self.column_mm * f64::from(inner.height);
        let Point { x, y } = self.center;
        [[x - half_x, x + half_x], [y - half_y, y + half_y]]
    }
}

/// Reach, sheet and pen.
pub(super) fn window(jogger: &Jogger<'_>, outlines: &[Vec<Point>]) -> Window {
    let points = outlines.iter().flatten().copied();
    let bounds = jogger.machine.sheet().union_pt(jogger.pen());
    points.fold(bounds, |bounds, point| bounds.union_pt(point)).inflate(5.0, 5.0)
}

/// What a map shows.
pub(super) struct Shown<'a> {
    pub(super) pen: Point,
    pub(super) corners: [Point; 4],
    pub(super) outlines: &'a [Vec<Point>],
    /// What was drawn by hand.
    pub(super) strokes: &'a [Vec<Point>],
}

/// Draws a map, to scale.
pub(super) fn show(frame: &mut Frame<'_>, area: Rect, view: View, title: &str, shown: &Shown<'_>) {
    let [x_bounds, y_bounds] = view.bounds(area);
    let canvas = Canvas::default()
        .block(Block::bordered().title(title))
        .marker(Marker::Braille)
        .x_bounds(x_bounds)
        .y_bounds(y_bounds)
        .paint(|context| {
            let line = |a: Point, b: Point, color: Color| Stroke::new(a.x, a.y, b.x, b.y, color);
            for pair in shown.outlines.iter().flat_map(|outline| outline.windows(2)) {
                context.draw(&line(pair[0], pair[1], Color::DarkGray));
            }
            context.layer();
            for corner in 0..4 {
                context.draw(&line(shown.corners[corner], shown.corners[(corner + 1) % 4], Color::Blue));
            }
            context.layer();
            for (at, name) in shown.corners.iter().zip(CORNERS) {
                let [x, y] = view.print_at(*at, area);
                context.print(x, y, Line::styled(name, Style::new().fg(Color::Blue)));
            }
            context.layer();
            for stroke in shown.strokes {
                context.draw(&Points { coords: &[(stroke[0].x, stroke[0].y)], color: Color::Green });
                for pair in stroke.windows(2) {
                    context.draw(&line(pair[0], pair[1], Color::Green));
                }
            }
            // Over the names of the corners.
            context.layer();
            context.draw(&Points { coords: &[(shown.pen.x, shown.pen.y)], color: Color::Red });
            let [x, y] = view.print_at(shown.pen, area);
            context.print(x, y, Line::styled("+", Style::new().fg(Color::Red).add_modifier(Modifier::BOLD)));
        });
    frame.render_widget(canvas, area);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_are_places_and_zoom_keeps_the_place_under_the_mouse() {
        let area = Rect::new(10, 5, 82, 22);
        let window = Window::new(0.0, 0.0, 160.0, 80.0);
        let view = View::of(window, area);
        assert!((view.column_mm - 2.0).abs() < 1e-12, "{view:?}");
        // Inside the border: 80 columns of 2 mm, 20 rows of 4 mm, the first cell at the upper left.
        let first = view.place(Position::new(11, 6), area).expect("a cell");
        assert!(first.distance(Point::new(1.0, 78.0)) < 1e-9, "{first:?}");
        let last = view.place(Position::new(90, 25), area).expect("a cell");
        assert!(last.distance(Point::new(159.0, 2.0)) < 1e-9, "{last:?}");
        assert_eq!(view.place(Position::new(10, 6), area), None);
        let near = view.zoomed(4.0, first, 100.0);
        let again = near.place(Position::new(11, 6), area).expect("a cell");
        assert!(again.distance(first) < 1e-9 && (near.column_mm - 0.5).abs() < 1e-12, "{near:?}");
    }
}
