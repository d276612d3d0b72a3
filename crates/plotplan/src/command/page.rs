//! The animated preview: a plan and the viewer in one HTML file.

use compiler::pipeline::Request;
use compiler::report::{CertificateReport, Finding, Summary};
use compiler::view::{DrawingView, SourceFile, View};
use compiler::{import, replay};
use drawing::Drawing;
use kinematics::Machine;
use plan::{Header, Row};

use crate::cli::Preview;
use crate::failure::Failure;
use crate::input::{self, Input, Inputs};
use crate::{machines, options, output, session};

/// The tolerance of plans that state none.
const DEFAULT_TOLERANCE_MM: f64 = 0.1;

/// A plan that was made from a drawing, with all that a page shows of it.
pub(super) struct Planned {
    pub(super) header: Header,
    pub(super) rows: Vec<Row>,
    exact: Vec<[f64; 2]>,
    /// In the order drawn, machine mm.
    pub(super) drawn: Drawing,
    placed: Drawing,
    page: import::Page,
    request: Request,
    summary: Summary,
    certificate: CertificateReport,
}

/// Plans a drawing.
pub(super) fn planned(
    inputs: &Inputs,
    page: &import::Page,
    machine: &Machine,
    request: Request,
) -> Result<Planned, Failure> {
    let compiled = super::convert::compile(inputs, &page.drawing, machine, &request)?;
    let (rows, exact) = compiled.trajectory.rows().map(|row| (row.row, row.exact)).unzip();
    Ok(Planned {
        header: compiled.header.clone(),
        rows,
        exact,
        drawn: compiled.ordered().clone(),
        placed: compiled.placed.clone(),
        page: page.clone(),
        summary: Summary::of(&compiled),
        certificate: CertificateReport::of(&compiled.certificate),
        request,
    })
}

impl Planned {
    /// The view of the plan.
    /// `rows` and `drawn` are its own, which the caller may have taken.
    pub(super) fn view<'a>(
        &'a self,
        inputs: &'a Inputs,
        machine: &'a Machine,
        rows: &'a [Row],
        drawn: &'a Drawing,
    ) -> View<'a> {
        let file =
            |input: &'a Input| SourceFile { name: &input.name, path: &input.path, bytes: &input.bytes };
        View {
            title: inputs.name(),
            machine,
            header: &self.header,
            rows,
            exact: Some(&self.exact),
            drawing: Some(DrawingView {
                drawn,
                placed: &self.placed,
                pens: &self.page.pens,
                pen_speeds: &self.request.pen_speeds,
                files: inputs.all().iter().map(file).collect(),
            }),
            tolerance_mm: self.request.tolerance_mm,
            summary: Some(self.summary.clone()),
            certificate: Some(self.certificate.clone()),
            findings: findings(),
            prediction: None,
        }
    }
}

/// What was found up to now.
fn findings() -> Vec<Finding> {
    let mut found = Vec::new();
    session::report(|report| found.clone_from(&report.diagnostics));
    found
}

/// Makes something of the view of drawings on a machine.
pub(super) fn of_drawing<T>(
    inputs: &Inputs,
    arguments: &Preview,
    make: impl FnOnce(&View<'_>) -> Result<T, Failure>,
) -> Result<T, Failure> {
    let Some(name) = &arguments.machine else {
        let what = "this shows a plan: which machine draws it? Give --machine NAME or --machine FILE.toml";
        return Err(Failure::Usage(anyhow::anyhow!(what)));
    };
    let machine = machines::machine_with_paper(name, &arguments.reading)?.machine;
    let drawn = input::drawings(inputs, &arguments.reading)?;
    input::use_page(inputs, &drawn, &arguments.reading)?;
    let crop = arguments.reading.layout.crop;
    let request = super::request(&arguments.planning, crop, drawn.page(), &machine);
    let planned = planned(inputs, drawn.page(), &machine, request)?;
    make(&planned.view(inputs, &machine, &planned.rows, &planned.drawn))
}

/// Makes something of the view of a plan file, whose rows hold whole ticks.
pub(super) fn of_plan<T>(
    input: &Input,
    machine: Option<&str>,
    make: impl FnOnce(&View<'_>) -> Result<T, Failure>,
) -> Result<T, Failure> {
    options::refuse_on_plan()?;
    let (plan, machine) = super::verify::plan(input, machine)?;
    let stated = plan.document.as_ref().and_then(|document| document.settings["tolerance_mm"].as_f64());
    let tolerance_mm = stated.unwrap_or(DEFAULT_TOLERANCE_MM);
    let certificate = replay::certify(&plan, &machine.machine, None, tolerance_mm);
    let view = View {
        tolerance_mm,
        certificate: Some(CertificateReport::of_motion(&certificate)),
        ..of_rows(&input.name, &machine.machine, &plan.table.header, &plan.table.rows)
    };
    make(&view)
}

/// The view of rows without a drawing.
pub(super) fn of_rows<'a>(name: &str, machine: &'a Machine, header: &'a Header, rows: &'a [Row]) -> View<'a> {
    View {
        title: name.to_owned(),
        machine,
        header,
        rows,
        exact: None,
        drawing: None,
        tolerance_mm: DEFAULT_TOLERANCE_MM,
        summary: None,
        certificate: None,
        findings: findings(),
        prediction: None,
    }
}

/// Writes a page.
pub(super) fn write(to: &str, html: &str) -> Result<(), Failure> {
    output::write(to, |out| out.write_all(html.as_bytes()))
}
