//! Files of touches, of drawn marks and of distances.

use calibration::{Distance, Touch};
use drawing::Point;

use super::Marks;

/// The corners of a sheet in the order in which they are touched.
pub const CORNER_NAMES: [&str; 4] = ["lower left", "lower right", "upper right", "upper left"];

/// The corners of a sheet of this size in that order, mm.
pub fn corners([width, height]: [f64; 2]) -> [Point; 4] {
    [(0.0, 0.0), (width, 0.0), (width, height), (0.0, height)].map(Point::from)
}

/// A row of cells, and its line number from 1.
type Row<'a> = (usize, Vec<&'a str>);

/// The rows of a CSV file: without comments and empty lines; the heading apart, if there is one.
fn rows(text: &str) -> (Option<Vec<String>>, Vec<Row<'_>>) {
    let lines =
        text.lines().enumerate().map(|(k, line)| (k + 1, line.split('#').next().unwrap_or("").trim()));
    let mut rows: Vec<Row<'_>> = lines
        .filter(|(_, line)| !line.is_empty())
        .map(|(number, line)| (number, line.split([',', ';', '\t']).map(str::trim).collect()))
        .collect();
    let is_heading = rows.first().is_some_and(|(_, cells)| cells[0].parse::<f64>().is_err());
    let heading = is_heading.then(|| rows.remove(0).1.into_iter().map(str::to_owned).collect());
    (heading, rows)
}

fn number(row: &Row<'_>, column: usize, what: &str) -> Result<f64, String> {
    let (line, cells) = row;
    let cell = cells.get(column).ok_or_else(|| format!("line {line}: {what} is missing"))?;
    let value = cell.parse::<f64>().ok().filter(|value| value.is_finite());
    value.ok_or_else(|| format!("line {line}: {what} is not a number: {cell}"))
}

/// The columns that state from where each motor came.
const APPROACH: [&str; 2] = ["approach1", "approach2"];

/// The side from which a motor came to a touch: `+` from lower ticks, `-` from higher ones, or nothing.
fn approach(row: &Row<'_>, column: Option<usize>) -> Result<f64, String> {
    match column.and_then(|column| row.1.get(column)).copied() {
        None | Some("") => Ok(0.0),
        Some("+") => Ok(1.0),
        Some("-") => Ok(-1.0),
        Some(other) => Err(format!("line {}: a motor comes from + or -, not {other}", row.0)),
    }
}

/// Touches: `x_mm,y_mm,MOTOR1,MOTOR2[,elbow,approach1,approach2]`, in this order or as a heading names the columns. With
/// `corners`, places are left out: they are the corners in the order of [`CORNER_NAMES`], again from the
/// first one after the fourth.
///
/// # Errors
/// A message with the line.
pub fn read_touches(
    text: &str,
    motors: [&str; 2],
    corners: Option<[Point; 4]>,
) -> Result<Vec<Touch>, String> {
    let (heading, rows) = rows(text);
    let usual = match corners {
        Some(_) => vec![motors[0], motors[1], "elbow", APPROACH[0], APPROACH[1]],
        None => vec!["x_mm", "y_mm", motors[0], motors[1], "elbow", APPROACH[0], APPROACH[1]],
    };
    let names = heading.unwrap_or_else(|| usual.iter().map(|name| (*name).to_owned()).collect());
    if let Some(unknown) = names.iter().find(|name| !usual.contains(&name.as_str())) {
        return Err(format!("unknown column {unknown}; expected {}", usual.join(", ")));
    }
    let column = |name: &str| {
        let found = names.iter().position(|known| known == name);
        found.ok_or_else(|| format!("the column {name} is missing"))
    };
    let ticks = [column(motors[0])?, column(motors[1])?];
    let elbow = column("elbow").ok();
    let approaches = APPROACH.map(|name| column(name).ok());
    let place = if corners.is_some() { None } else { Some([column("x_mm")?, column("y_mm")?]) };
    if let (Some(_), false) = (corners, rows.len().is_multiple_of(4)) {
        return Err(format!("there are {} touches: four corners make four, or a multiple of it", rows.len()));
    }
    let touch = |(index, row): (usize, &Row<'_>)| {
        Ok(Touch {
            place: match (place, corners) {
                (Some([x, y]), _) => Point::new(number(row, x, "x_mm")?, number(row, y, "y_mm")?),
                (None, Some(corners)) => corners[index % 4],
                (None, None) => unreachable!("places are given or corners"),
            },
            ticks: [number(row, ticks[0], motors[0])?, number(row, ticks[1], motors[1])?],
            approach: [approach(row, approaches[0])?, approach(row, approaches[1])?],
            elbow_left: match elbow.and_then(|column| row.1.get(column)).copied() {
                None | Some("") => None,
                Some("left" | "l") => Some(true),
                Some("right" | "r") => Some(false),
                Some(other) => return Err(format!("line {}: elbow is left or right, not {other}", row.0)),
            },
        })
    };
    rows.iter().enumerate().map(touch).collect()
}

/// Marks of the pattern as they were drawn, measured from the lower-left corner of the sheet:
/// `mark,x_mm,y_mm`.
///
/// # Errors
/// A message with the line.
pub fn read_drawn(text: &str, marks: &Marks) -> Result<Vec<Touch>, String> {
    let (_, rows) = rows(text);
    let touch = |row: &Row<'_>| {
        let place = Point::new(number(row, 1, "x_mm")?, number(row, 2, "y_mm")?);
        Ok(Touch { place, ticks: mark(row, 0, marks)?, approach: [0.0; 2], elbow_left: None })
    };
    rows.iter().map(touch).collect()
}

/// Distances between marks of the pattern: `mark,mark,distance_mm`.
///
/// # Errors
/// A message with the line.
pub fn read_distances(text: &str, marks: &Marks) -> Result<Vec<Distance>, String> {
    let (_, rows) = rows(text);
    let distance = |row: &Row<'_>| {
        let ticks = [mark(row, 0, marks)?, mark(row, 1, marks)?];
        Ok(Distance { ticks, mm: number(row, 2, "the distance")? })
    };
    rows.iter().map(distance).collect()
}

/// The ticks at which the mark in a column was drawn.
fn mark(row: &Row<'_>, column: usize, marks: &Marks) -> Result<[f64; 2], String> {
    let number = number(row, column, "the mark")?;
    let found = (number >= 1.0 && number.fract() == 0.0).then(|| marks.ticks(number as usize)).flatten();
    found.ok_or_else(|| format!("line {}: there is no mark {number} in the pattern", row.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_named_or_in_order() {
        let motors = ["arm1", "arm2"];
        let plain = read_touches("# corner\n1,2,800,-3.5\n5,6,7,8,right\n", motors, None).unwrap();
        let named = "arm2,arm1,y_mm,x_mm,elbow\n-3.5,800,2,1,\n8,7,6,5,right";
        assert_eq!(read_touches(named, motors, None).unwrap(), plain);
        assert_eq!(plain[1].elbow_left, Some(false));
        let sides =
            read_touches("x_mm,y_mm,arm1,arm2,approach1,approach2\n1,2,3,4,+,\n1,2,3,4,-,+", motors, None);
        let sides: Vec<[f64; 2]> = sides.unwrap().iter().map(|touch| touch.approach).collect();
        assert_eq!(sides, [[1.0, 0.0], [-1.0, 1.0]]);
        assert!(read_touches("1,2,3,4,left,up", motors, None).unwrap_err().contains("+ or -"));
        let four = read_touches("1,2\n3,4\n5,6\n7,8", motors, Some(corners([10.0, 20.0]))).unwrap();
        assert_eq!((four[2].place, four[2].ticks), (Point::new(10.0, 20.0), [5.0, 6.0]));
    }

    #[test]
    fn errors_give_the_line() {
        let read = |text| read_touches(text, ["a", "b"], None).unwrap_err();
        assert_eq!(read("1,2,3,4\n1,2,3"), "line 2: b is missing");
        assert_eq!(read("1,2,3,x"), "line 1: b is not a number: x");
        assert_eq!(
            read("x_mm,y_mm,a,c\n1,2,3,4"),
            "unknown column c; expected x_mm, y_mm, a, b, elbow, approach1, approach2"
        );
        let corners = Some(corners([1.0, 1.0]));
        assert!(
            read_touches("1,2\n3,4", ["a", "b"], corners).unwrap_err().starts_with("there are 2 touches")
        );
    }
}
