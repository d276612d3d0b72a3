//! The commands, one file each.

mod build;
mod calibrate;
mod check;
mod convert;
mod diff;
#[cfg(unix)]
mod emulate;
mod firmware_config;
mod homing;
mod info;
mod jog;
mod machine;
mod new_machine;
mod page;
mod preview;
mod send;
mod simulate;
mod studio;
mod tune;
mod verify;

use backends::pen_plotter::plotter;
use clap::CommandFactory as _;
use compiler::best_place::{BestFor, Search};
use compiler::import::{self, Page, PenSettings};
use compiler::layout::Crop;
use compiler::machine_file;
use compiler::pipeline::{Order, Request};
use compiler::report::Code;
use drawing::{Pen, Vec2};
use kinematics::Machine;
use planner::{Easing, Mirror, PlacementOptions, Scale, TimingLaw};

use crate::cli::{self, Arguments, Command, Planning, SchemaOf};
use crate::failure::Failure;
use crate::output;

/// Runs the command. `command_line` holds the options that shape a plan, as given.
pub(crate) fn run(arguments: &Arguments, command_line: &[String]) -> Result<(), Failure> {
    match &arguments.command {
        Command::Convert(convert) => convert::run(convert, command_line),
        Command::Check(check) => check::run(check),
        Command::Info(info) => info::run(info),
        Command::Verify(verify) => verify::run(verify),
        Command::Preview(preview) => preview::run(preview),
        Command::Simulate(simulate) => simulate::run(simulate),
        Command::Tune(tune) => tune::run(tune),
        Command::Calibrate(calibrate) => calibrate::run(calibrate),
        Command::Send(send) => send::run(send),
        Command::Jog(jog) => jog::run(jog),
        Command::Build(build) => build::run(build),
        Command::Init(init) => build::init(init),
        Command::Diff(diff) => diff::run(diff),
        Command::Studio(studio) => studio::run(studio),
        #[cfg(unix)]
        Command::Emulate(emulate) => emulate::run(emulate),
        Command::Machine(machine) => machine::run(machine),
        Command::Explain(explain) => {
            if explain.code == "codes" {
                return output::write("-", |out| {
                    out.write_all(import::codes().as_bytes())?;
                    Code::ALL.iter().try_for_each(|code| writeln!(out, "{} {}", code.name(), code.meaning()))
                });
            }
            if explain.code == "formats" {
                return output::write("-", |out| out.write_all(cli::format_page().as_bytes()));
            }
            if explain.code == "plotters" {
                return output::write("-", |out| {
                    writeln!(out, "Plotters of files (--plotter, --made-for):\n{}", import::plotters())?;
                    write!(
                        out,
                        "Plotters to write for (convert --format hpgl --plotter):\n{}",
                        plotter::list()
                    )
                });
            }
            let kind = Code::ALL.iter().find(|code| code.name() == explain.code);
            let text = match (import::explain(&explain.code), kind) {
                (Some((title, explanation)), _) => format!("{title}\n\n{explanation}\n"),
                (None, Some(code)) => {
                    let exit = match code.exit_code() {
                        0 => "a warning".to_owned(),
                        exit => format!("exit code {exit}"),
                    };
                    format!("{} ({exit})\n\n{}\n", code.name(), code.meaning())
                }
                (None, None) => {
                    let what = format!(
                        "unknown code {}: diagnostics of drawings have codes such as H0101 and S0101, messages of the program such as {}",
                        explain.code,
                        Code::OutOfReach.name()
                    );
                    return Err(Failure::Usage(anyhow::anyhow!(what)));
                }
            };
            output::write("-", |out| out.write_all(text.as_bytes()))
        }
        Command::Schema(schema) => {
            let text = match (schema.of, schema.markdown) {
                (SchemaOf::Reports, true) => compiler::report::page::markdown(),
                (SchemaOf::Reports, false) => format!("{:#}\n", compiler::report::page::schema()),
                (SchemaOf::Machine, true) => machine_file::markdown(),
                (SchemaOf::Machine, false) => format!("{:#}\n", machine_file::schema()),
            };
            output::write("-", |out| out.write_all(text.as_bytes()))
        }
        Command::Completions(completions) => output::write("-", |out| {
            clap_complete::generate(completions.shell, &mut Arguments::command(), "plotplan", &mut &mut *out);
            Ok(())
        }),
        Command::Man(man) => manual(man.command.as_deref()),
    }
}

/// Prints a page of the manual.
fn manual(command: Option<&str>) -> Result<(), Failure> {
    let mut all = Arguments::command();
    all.build();
    let page = match command {
        None => all,
        Some(name) => match all.find_subcommand(name) {
            // It was built as part of the whole, and knows its whole name.
            Some(found) => found.clone(),
            None => return Err(Failure::Usage(anyhow::anyhow!("there is no command {name}"))),
        },
    };
    output::write("-", |out| clap_mangen::Man::new(page).render(out))
}

/// The request that the options ask for, for this page on this machine.
fn request(planning: &Planning, crop: Option<Crop>, page: &Page, machine: &Machine) -> Request {
    let pen_speeds = match planning.speed {
        cli::Speed::Machine => Vec::new(),
        cli::Speed::File => {
            let of = |(pen, settings): (&Pen, &PenSettings)| settings.speed_mm_s.map(|speed| (*pen, speed));
            page.pens.iter().filter_map(of).filter(|(_, speed)| *speed > 0.0).collect()
        }
    };
    let period = planning.period.unwrap_or(machine.parts().period_s);
    Request {
        tolerance_mm: planning.tolerance,
        period_us: (period * 1e6).round().max(0.0) as u64,
        order: order(planning),
        crop,
        placement: placement(&planning.placement),
        search: search(&planning.placement),
        pen_speeds,
        pen_colors: compiler::scene::pen_colors(page),
        // The pen is off the paper long before it is all the way up.
        lift_overlap_s: if planning.overlap_lifts { 0.5 * machine.pen().lift_time_s } else { 0.0 },
        timing_law: timing_law(planning),
        rounding: match planning.rounding {
            cli::Rounding::Path => plan::Rounding::Path,
            cli::Rounding::Nearest => plan::Rounding::Nearest,
        },
        joint_fit: planning.effort > 0,
        allow_over_limit: planning.allow_over_limit,
    }
}

/// The order that the options ask for.
fn order(planning: &Planning) -> Order {
    match planning.order.unwrap_or(cli::Order::Optimize) {
        cli::Order::File => Order::File,
        cli::Order::Optimize => Order::Optimize(ordering::Options {
            effort: planning.effort,
            dedupe: planning.dedupe,
            keep_direction: planning.keep_direction,
            pen_order: planning.pen_order.as_ref().map(|pens| pens.iter().copied().map(Pen).collect()),
            ..ordering::Options::default()
        }),
    }
}

/// The placement that the options ask for.
fn placement(options: &cli::Placement) -> PlacementOptions {
    let scale = if options.fit {
        Scale::Fit
    } else if options.shrink {
        Scale::Shrink
    } else if let Some((x, y)) = options.align {
        Scale::Aligned { factor: options.scale.unwrap_or(1.0), align: Vec2::new(x, y) }
    } else {
        let origin_mm = match options.place {
            Some(cli::Place::At(x, y)) => Vec2::new(x, y),
            Some(cli::Place::Best) | None => Vec2::ZERO,
        };
        Scale::Explicit { factor: options.scale.unwrap_or(1.0), origin_mm }
    };
    PlacementOptions {
        mirror: options.mirror.map(|mirror| match mirror {
            cli::Mirror::X => Mirror::X,
            cli::Mirror::Y => Mirror::Y,
        }),
        rotate_rad: options.rotate.unwrap_or(0.0),
        scale,
        margin_mm: options.margin,
    }
}

/// The search for the best placement, if the options ask for it.
fn search(options: &cli::Placement) -> Option<Search> {
    let aim = match options.best_for {
        cli::BestFor::Time => BestFor::Time,
        cli::BestFor::Accuracy => BestFor::Accuracy,
    };
    (options.place == Some(cli::Place::Best)).then_some(Search { aim, turns: options.rotate.is_none() })
}

/// The timing law that the options ask for.
fn timing_law(planning: &Planning) -> TimingLaw {
    let fixed_duration =
        |easing: Easing| TimingLaw::FixedDuration { easing, segment_time_s: planning.segment_time };
    match planning.law {
        cli::Law::TimeOptimal => TimingLaw::TimeOptimal,
        cli::Law::Trapezoid => TimingLaw::Trapezoid,
        cli::Law::Linear => fixed_duration(Easing::Linear),
        cli::Law::Sine => fixed_duration(Easing::SineOut),
        cli::Law::Quadratic => fixed_duration(Easing::QuadraticInOut),
    }
}
