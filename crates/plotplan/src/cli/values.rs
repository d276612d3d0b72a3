//! Values of options as text: lengths, angles, places, pens.

use compiler::layout::Crop;
pub(super) use compiler::option::{align, angle, grid, hatch, length, scale, time};

use super::{PageChoice, Place};

/// The name of a file, a machine, a port or the like.
pub(super) fn name() -> clap::builder::NonEmptyStringValueParser {
    clap::builder::NonEmptyStringValueParser::new()
}

/// A positive length in mm.
pub(super) fn distance(text: &str) -> Result<f64, String> {
    length(text).and_then(|mm| if mm > 0.0 { Ok(mm) } else { Err("expected a positive length".into()) })
}

/// A number of processes.
pub(super) fn jobs(text: &str) -> Result<usize, String> {
    text.parse()
        .ok()
        .filter(|jobs| (1..=1024).contains(jobs))
        .ok_or_else(|| "expected a number from 1".to_owned())
}

pub(super) fn page(text: &str) -> Result<PageChoice, String> {
    match text {
        "all" => Ok(PageChoice::All),
        number => number
            .parse()
            .map(PageChoice::Number)
            .map_err(|_| "expected the number of a page, or `all`".to_owned()),
    }
}

pub(super) fn pen(text: &str) -> Result<u16, String> {
    let pen = text.trim().parse::<u16>().ok();
    pen.ok_or_else(|| "expected numbers of pens with commas between, such as 2,1".to_owned())
}

pub(super) fn pen_pair(text: &str) -> Result<(u16, u16), String> {
    let what = "expected pairs of pens such as 2=1,4=2";
    let (from, to) = text.split_once('=').ok_or(what)?;
    let pen = |text: &str| text.trim().parse::<u16>().ok().filter(|pen| *pen > 0).ok_or(what);
    Ok((pen(from)?, pen(to)?))
}

pub(super) fn crop(text: &str) -> Result<Crop, String> {
    if text == "sheet" {
        return Ok(Crop::Sheet);
    }
    let what = "expected `sheet`, or a window X,Y,WIDTH,HEIGHT such as 10mm,10mm,5cm,5cm";
    let lengths: Vec<&str> = text.split(',').collect();
    let [x, y, width, height] = lengths[..] else { return Err(what.to_owned()) };
    let window = [length(x)?, length(y)?, length(width)?, length(height)?];
    if !(window[2] > 0.0 && window[3] > 0.0) {
        return Err("the width and height of the window must be positive".to_owned());
    }
    Ok(Crop::Window(window))
}

pub(super) fn ticks(text: &str) -> Result<f64, String> {
    let ticks = text.trim().parse::<f64>().ok().filter(|ticks| ticks.abs() >= 1.0 && ticks.abs() <= 1e9);
    ticks.ok_or_else(|| "expected a number of ticks from 1 to 1e9, such as 3200".to_owned())
}

pub(super) fn dpi(text: &str) -> Result<f64, String> {
    let dpi = text.trim().parse::<f64>().ok().filter(|dpi| (1.0..=100_000.0).contains(dpi));
    dpi.ok_or_else(|| format!("{text} is not a number from 1 to 100000"))
}

pub(super) fn positions(text: &str) -> Result<(f64, f64), String> {
    let (up, down) =
        text.split_once(',').ok_or("expected two numbers with a comma between, such as 40,90")?;
    let number = |text: &str| {
        let value = text.trim().parse::<f64>().ok().filter(|value| value.abs() <= 30_000.0);
        value.ok_or_else(|| format!("{text} is not a number between -30000 and 30000"))
    };
    Ok((number(up)?, number(down)?))
}

#[cfg(unix)]
pub(super) fn fault(text: &str) -> Result<backends::Fault, String> {
    use backends::Fault;
    use backends::homing::SwitchFault;
    let what = "a fault is KIND=N or KIND=N:TIME, such as lost-answer=5 or unplugged=2s:1s";
    let (kind, value) = text.split_once('=').ok_or(what)?;
    let (first, second) = value.split_once(':').map_or((value, None), |(a, b)| (a, Some(b)));
    let number = |text: &str| text.parse::<u64>().map_err(|_| format!("{text} is not a whole number"));
    let microseconds = |text: &str| Ok::<u64, String>((time(text)? * 1e6).round() as u64);
    let lasting = || microseconds(second.ok_or(what)?);
    Ok(match kind {
        "lost-answer" => Fault::LostAnswer(number(first)?),
        "late-answer" => Fault::LateAnswer(number(first)?, lasting()?),
        "garbled-answer" => Fault::GarbledAnswer(number(first)?),
        "garbled-byte" => Fault::GarbledByte(number(first)?),
        "full-buffer" => Fault::FullBuffer(microseconds(first)?, lasting()?),
        "unplugged" => Fault::Unplugged(microseconds(first)?, lasting()?),
        "held" => Fault::Held(microseconds(first)?, lasting()?),
        "power-cut" => Fault::PowerCut(microseconds(first)?),
        "limit" => Fault::Limit(microseconds(first)?),
        "switch-broken" => Fault::Switch(SwitchFault::Broken(number(first)?.min(1) as u8)),
        "switch-stuck" => Fault::Switch(SwitchFault::Stuck(number(first)?.min(1) as u8)),
        _ => return Err(what.to_owned()),
    })
}

/// Two lengths with a comma between, or `best`.
pub(super) fn place(text: &str) -> Result<Place, String> {
    if text == "best" {
        return Ok(Place::Best);
    }
    let (x, y) = compiler::option::place(text).map_err(|error| format!("{error}, or `best`"))?;
    Ok(Place::At(x, y))
}
