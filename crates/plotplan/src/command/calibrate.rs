//! `plotplan calibrate`: a machine file from touched places.

use anyhow::{Context as _, anyhow};
use calibration::{CalibrationError, Fit, Measurements, Options, Parameter, Setup};
use compiler::calibrate::{self, Marks};
use compiler::report::Code;
use compiler::report::calibration::{self as report, CalibrationReport};

use crate::cli::{Calibrate, Free};
use crate::failure::Failure;
use crate::machines::LoadedMachine;
use crate::{input, machines, output, session, terminal};

pub(crate) fn run(arguments: &Calibrate) -> Result<(), Failure> {
    let toml = machines::machine_toml(&arguments.machine)?;
    let loaded = machines::machine(&arguments.machine)?;
    let marks = Marks::of(&loaded.machine);
    if arguments.pattern {
        if marks.places.len() < 4 {
            let what =
                "fewer than four marks are within reach of the sheet: move the sheet in the machine file";
            return Err(Failure::Drawing(anyhow!(what)));
        }
        let text = calibrate::pattern(&marks);
        let to = if arguments.report_only() { "-" } else { &arguments.output };
        return output::write(to, |out| out.write_all(text.as_bytes()));
    }
    let motors = loaded.machine.motors().each_ref().map(|motor| motor.name.as_str());
    let nominal = calibrate::setup(&loaded.file, &loaded.machine)
        .ok_or_else(|| Failure::Usage(anyhow!("this mechanism cannot be calibrated")))?;
    let nominal = match arguments.corners {
        Some(size) => Setup { sheet_mm: size, ..nominal },
        None => nominal,
    };
    let data = measurements(arguments, motors, &marks)?;
    let options = Options {
        pointing_mm: arguments.pointing,
        groups: match arguments.free {
            Free::Pose => 1,
            Free::Lengths => 2,
            Free::All => usize::MAX,
        },
    };
    let fit = match calibration::fit(&nominal, &data, &options) {
        Ok(fit) => fit,
        Err(error) => return refuse_error(&error, arguments, &nominal, &data, &options, motors),
    };
    let mut all = CalibrationReport::of(&fit, &nominal, &data, motors);
    if fit.is_bad {
        all.alternatives = others(arguments, &nominal, &data, &options, motors);
    }
    let text = all.text(loaded.machine.name(), data.equations());
    let (alternatives, worst) = (all.alternatives.clone(), all.worst.clone());
    session::report(|report| report.calibration = Some(all));
    if arguments.output != "-" {
        output::report(&text)?;
    }
    if let Some(message) = elbow(&nominal, &fit, &data) {
        return refuse(&message);
    }
    if fit.is_bad {
        let mut message = format!("{:.2} mm RMS is too much for pointing and rounding", fit.rms_mm);
        if !alternatives.is_empty() {
            message = format!("{message}. These fit:\n{}", alternatives.join("\n"));
        } else if let Some(worst) = worst {
            message = format!(
                "{message}; without touch {} the others fit within {:.2} mm RMS (--without {})",
                worst.touch, worst.rms_mm, worst.touch
            );
        }
        return refuse(&message);
    }
    write(arguments, &toml, &loaded, &nominal, &fit)
}

/// Writes the machine file, checked.
fn write(
    arguments: &Calibrate,
    toml: &str,
    loaded: &LoadedMachine,
    nominal: &Setup,
    fit: &Fit,
) -> Result<(), Failure> {
    let text = calibrate::calibrated(toml, &loaded.machine, nominal, &fit.setup)
        .map_err(|what| Failure::Drawing(anyhow!("the machine file: {what}")))?;
    let parsed = compiler::machine_file::MachineFile::parse(&text).and_then(|file| file.machine());
    parsed.context("the calibrated machine").map_err(Failure::Drawing)?;
    if arguments.report_only() {
        return Ok(());
    }
    output::write(&arguments.output, |out| out.write_all(text.as_bytes()))
}

fn measurements(arguments: &Calibrate, motors: [&str; 2], marks: &Marks) -> Result<Measurements, Failure> {
    let mut data = Measurements::default();
    let read = |file: &str| {
        let input = input::read(file)?;
        Ok((input.name, String::from_utf8_lossy(&input.bytes).into_owned()))
    };
    let wrong = |name: &str, what: String| Failure::Drawing(anyhow!("{name}: {what}"));
    if let Some(file) = &arguments.touches {
        let (name, text) = read(file)?;
        let corners = arguments.corners.map(calibrate::corners);
        let touches = calibrate::read_touches(&text, motors, corners).map_err(|what| wrong(&name, what))?;
        data.touches.extend(touches);
    }
    if let Some(file) = &arguments.drawn {
        let (name, text) = read(file)?;
        data.touches.extend(calibrate::read_drawn(&text, marks).map_err(|what| wrong(&name, what))?);
    }
    if let Some(file) = &arguments.distances {
        let (name, text) = read(file)?;
        data.distances = calibrate::read_distances(&text, marks).map_err(|what| wrong(&name, what))?;
    }
    let mut without = arguments.without.clone();
    without.sort_unstable();
    without.dedup();
    for touch in without.into_iter().rev() {
        if touch == 0 || touch > data.touches.len() {
            let what = format!("--without {touch}: there are {} touches", data.touches.len());
            return Err(Failure::Usage(anyhow!(what)));
        }
        data.touches.remove(touch - 1);
    }
    Ok(data)
}

/// Sentences about other readings that fit.
fn others(
    arguments: &Calibrate,
    nominal: &Setup,
    data: &Measurements,
    options: &Options,
    motors: [&str; 2],
) -> Vec<String> {
    let are_corners =
        arguments.corners.is_some() && arguments.without.is_empty() && arguments.drawn.is_none();
    let found = calibration::alternatives(nominal, data, options, are_corners);
    found.iter().take(3).map(|(what, rms_mm)| report::alternative(what, *rms_mm, motors)).collect()
}

fn refuse_error(
    error: &CalibrationError,
    arguments: &Calibrate,
    nominal: &Setup,
    data: &Measurements,
    options: &Options,
    motors: [&str; 2],
) -> Result<(), Failure> {
    let mut message = error.to_string();
    if let CalibrationError::Undetermined { helpful: Some(helpful), .. } = error {
        message = format!("{message}: {}", report::advice(helpful));
    }
    if *error == CalibrationError::NoFit {
        let others = others(arguments, nominal, data, options, motors);
        message = std::iter::once(message).chain(others).collect::<Vec<_>>().join("\n");
    }
    refuse(&message)
}

fn refuse(message: &str) -> Result<(), Failure> {
    terminal::error(Code::Undetermined, message);
    Err(Failure::Refused)
}

/// What is wrong with the side of the elbow: that of the file, if no touch has it, or that of a touch.
fn elbow(nominal: &Setup, fit: &Fit, data: &Measurements) -> Option<String> {
    let Some(Parameter::Choice(side)) = nominal.geometry.get("elbow") else { return None };
    let name = |left: bool| if left { "left" } else { "right" };
    let found: Vec<Option<bool>> =
        data.touches.iter().map(|touch| fit.setup.is_elbow_left(touch.ticks)).collect();
    for (index, (touch, found)) in data.touches.iter().zip(&found).enumerate() {
        if let (Some(stated), Some(found)) = (touch.elbow_left, found)
            && stated != *found
        {
            let number = index + 1;
            return Some(format!(
                "touch {number} is stated with the elbow on the {}; its ticks have it on the {}",
                name(stated),
                name(*found)
            ));
        }
    }
    let is_left = side == "left";
    let stated = data.touches.iter().any(|touch| touch.elbow_left.is_some());
    let other = !stated && !found.is_empty() && found.iter().all(|found| *found == Some(!is_left));
    other.then(|| {
        format!(
            "all touches were made with the elbow on the {}; the machine file has elbow = \"{side}\": change it, \
             or a motor counts the other way",
            name(!is_left)
        )
    })
}
