//! An opened drawing, and its last plan.

use std::collections::BTreeSet;

use compiler::import::{self, Document, Page};
use compiler::layout::{self, Part};
use compiler::machine_file::MachineFile;
use compiler::pipeline::{self, Request, Step};
use compiler::report::{CertificateReport, Code, DrawingReport, Finding, Summary};
use compiler::scene;
use compiler::view::{self, DrawingView, SourceFile, View, description};
use drawing::{Affine, Drawing, Span};
use kinematics::Machine;
use plan::{Header, Row};
use planner::{PlacementOptions, PlanError, Scale};
use serde_json::{Value, json};
use viewer::Columns;

use crate::emulated::Emulated;
use crate::job::Job;
use crate::problem::{About, Problem, Problems};
use crate::sending::Sending;

/// Chords of outlines deviate from the drawing by at most this, mm.
const OUTLINE_MM: f64 = 0.05;

/// A drawing's file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct File {
    name: String,
    bytes: Vec<u8>,
}

/// The worker of a page: a drawing of one file or several, and the last plan made of it.
#[derive(Debug, Default)]
pub struct Studio {
    files: Vec<File>,
    /// The files as they were read with these options.
    read: Option<(import::Options, Vec<Document>)>,
    /// What the program warns of besides: of each file, and of all.
    warnings: (Vec<Option<Finding>>, Vec<Finding>),
    /// The last plan that was no draft.
    planned: Option<Planned>,
    /// What the viewer needs of the machine, whose outlines take longer than a draft: file, paper, description.
    described: Option<(String, String, Value)>,
    /// The conversation with a machine, and the emulated machine at the other end of a rehearsal.
    pub(crate) sending: Option<Sending>,
    pub(crate) emulated: Option<Emulated>,
}

/// An answer: a JSON object, and columns that it describes for `viewer/js/columns.js`.
#[derive(Clone, Debug, PartialEq)]
pub struct Reply {
    /// The object.
    pub json: Value,
    /// The columns' bytes.
    pub columns: Vec<u8>,
}

/// A plan with all that outputs need of it.
#[derive(Clone, Debug)]
pub(crate) struct Planned {
    job: Job,
    pub(crate) file: MachineFile,
    pub(crate) machine: Machine,
    pub(crate) page: Page,
    pub(crate) page_number: usize,
    pub(crate) request: Request,
    pub(crate) header: Header,
    pub(crate) rows: Vec<Row>,
    pub(crate) exact: Vec<[f64; 2]>,
    /// In the order drawn, machine mm.
    pub(crate) drawn: Drawing,
    placed: Drawing,
    pub(crate) summary: Summary,
    pub(crate) certificate: CertificateReport,
    /// What the path leaves of the tolerance, mm.
    pub(crate) spare_mm: f64,
    beyond_sheet_mm: f64,
}

impl File {
    fn source(&self) -> SourceFile<'_> {
        SourceFile { name: &self.name, path: &self.name, bytes: &self.bytes }
    }
}

impl Studio {
    /// Opens a drawing's file in place of those before.
    pub fn open(&mut self, name: &str, bytes: &[u8]) {
        self.files.clear();
        self.add(name, bytes);
    }

    /// Lays another file over those that are open.
    pub fn add(&mut self, name: &str, bytes: &[u8]) {
        self.files.push(File { name: name.to_owned(), bytes: bytes.to_vec() });
        (self.read, self.planned) = (None, None);
    }

    /// What to call the drawing: the files' names.
    pub fn name(&self) -> String {
        self.names().collect::<Vec<_>>().join(" + ")
    }

    /// The files' names.
    pub(crate) fn names(&self) -> impl Iterator<Item = &str> {
        self.files.iter().map(|file| &*file.name)
    }

    /// SHA-256 of the files, one after the other.
    pub(crate) fn sha256(&self) -> String {
        import::sha256(&self.files.iter().map(|file| &*file.bytes).collect::<Vec<_>>().concat())
    }

    /// The last plan of this job.
    pub(crate) fn planned_before(&self, job: &Job) -> Option<&Planned> {
        self.planned.as_ref().filter(|planned| planned.job == *job)
    }

    /// Reads the files as the job asks.
    fn read(&mut self, job: &Job) -> Result<&[Document], Problems> {
        for File { name, bytes } in &self.files {
            if bytes.iter().all(u8::is_ascii_whitespace) {
                return Err(Problem::new(About::Drawing, format!("{name} is empty")).into());
            }
            if plan::file::is_plan(bytes) {
                return Err(Problem::new(About::Drawing, format!("{name} is a plan, not a drawing"))
                    .with_help("`plotplan preview` shows plans")
                    .into());
            }
        }
        let options = job.options.reading()?;
        if self.read.as_ref().is_none_or(|(given, _)| *given != options) {
            let formats: Vec<&str> = self.files.iter().map(|file| import::format(&file.bytes)).collect();
            let read = self.files.iter().zip(&formats).map(|(File { name, bytes }, format)| {
                import::read(bytes, &options.for_format(format, &formats))
                    .map_err(|error| Problem::new(About::Drawing, format!("{name}: {error}")).into())
            });
            let documents = read.collect::<Result<Vec<Document>, Problems>>()?;
            self.read = Some((options, documents));
        }
        Ok(self.read.as_ref().map_or(&[][..], |(_, documents)| documents))
    }

    /// The drawing as the job reads and arranges it, and the number of the page that the job asks for.
    pub(crate) fn page(&mut self, job: &Job) -> Result<(Page, usize), Problems> {
        let number = job.options.page()?;
        let layout = job.options.layout()?;
        self.read(job)?;
        let documents = self.read.as_ref().map_or(&[][..], |(_, documents)| documents);
        let mut parts = Vec::new();
        let mut warnings = Vec::new();
        for (file, document) in self.files.iter().zip(documents) {
            let File { name, bytes } = file;
            let pages = &document.pages;
            let wrong = |option, what| Problem { option: Some(option), ..Problem::new(About::Option, what) };
            let what = || format!("{name} has {} pages, not page {number}", pages.len());
            let page = pages.get(number - 1).cloned().ok_or_else(|| wrong("page", what()))?;
            let missing = layout.check_pens(name, &layout::pens_of(pages));
            let missing = missing.map_err(|what| wrong("only-pens", what))?;
            warnings.push(missing.map(|what| Finding::warning(Code::PenMissing, &what)));
            parts.push(Part { page, length: bytes.len(), format: document.format });
        }
        let (page, conflicts) = layout::compose(parts, &layout);
        let more = conflicts.iter().map(|conflict| {
            Finding::warning(Code::PenColors, &conflict.text(&self.files[conflict.page].name))
        });
        let mut others: Vec<Finding> = more.collect();
        if let [document] = documents {
            let asked = (!job.options.page.trim().is_empty()).then_some(number);
            let found = layout::several_pages(&self.name(), document.pages.len(), asked);
            others.extend(found.map(|what| {
                let severity = if asked.is_some() { "note" } else { "warning" };
                Finding { severity: severity.to_owned(), ..Finding::warning(Code::SeveralPages, &what) }
            }));
        }
        self.warnings = (warnings, others);
        Ok((page, number))
    }

    /// The job without options that this drawing's format does not have: the page keeps those of SVG when a
    /// drawing of another format is opened.
    pub(crate) fn settled(&self, job: &Job) -> Job {
        let mut job = job.clone();
        if self.files.iter().all(|file| import::format(&file.bytes) != "SVG") {
            (job.options.pens, job.options.hatch) = (String::new(), String::new());
            job.options.outline_fills = false;
        }
        job
    }

    /// What was found in the drawing's files, in the order of the program.
    fn findings(&self) -> Vec<Finding> {
        let documents = self.read.as_ref().map_or(&[][..], |(_, documents)| documents);
        let (of_files, others) = &self.warnings;
        let mut all = Vec::new();
        for (index, (file, document)) in self.files.iter().zip(documents).enumerate() {
            all.extend(document.diagnostics.iter().map(|diagnostic| Finding::of(&file.name, diagnostic)));
            all.extend(of_files.get(index).cloned().flatten());
        }
        all.extend(others.iter().cloned());
        all
    }

    /// Stops where the drawing lacks something or draws nothing, as the program does.
    pub(crate) fn refuse_unusable(&self, page: &Page) -> Result<(), Problems> {
        let Some((_, documents)) = &self.read else { return Ok(()) };
        let found = documents.iter().flat_map(|document| &document.diagnostics);
        let errors = found.filter(|found| found.severity == import::Severity::Error);
        let problems: Vec<Problem> = errors
            .map(|found| Problem {
                help: found.help.clone(),
                bytes: Some([found.span.start, found.span.end]),
                ..Problem::new(About::Drawing, format!("{} {}: {}", found.code, found.place, found.message))
            })
            .collect();
        if !problems.is_empty() {
            return Err(Problems(problems));
        }
        if page.drawing.is_empty() {
            let sizes: Vec<&str> = documents.iter().map(|document| &*document.size).collect();
            let what = format!("{} draws nothing: no ink in its {}", self.name(), sizes.join(" and "));
            return Err(Problem::new(About::Drawing, what).into());
        }
        Ok(())
    }

    /// What the drawing is: of one file as it was read, of several as they lie over each other.
    fn report(&self, page: &Page) -> Option<DrawingReport> {
        let (_, documents) = self.read.as_ref()?;
        if let [document] = &documents[..] {
            return Some(DrawingReport::of(document));
        }
        let format = documents.first()?.format;
        let is_one = documents.iter().all(|document| document.format == format);
        Some(DrawingReport::of(&Document {
            format: if is_one { format } else { "several formats" },
            pages: vec![page.clone()],
            diagnostics: Vec::new(),
            size: format!("{} files", documents.len()),
            facts: Vec::new(),
        }))
    }

    /// The drawing: its report and findings, and as columns its outlines: `count` points and the `pen` of
    /// each stroke, `x` and `y` of each point in micrometres of the drawing's frame.
    ///
    /// # Errors
    /// A file that is no drawing, options that cannot be read.
    pub fn drawing(&mut self, job: &Job) -> Result<Reply, Problems> {
        let job = &self.settled(job);
        let (page, number) = self.page(job)?;
        let [mut counts, mut pens, mut x, mut y] = [const { Vec::new() }; 4];
        let micrometres = |mm: f64| (mm * 1000.0).round() as i64;
        for stroke in &page.drawing.strokes {
            let points = stroke.flatten(OUTLINE_MM);
            counts.push(points.len() as i64);
            pens.push(i64::from(stroke.pen.0));
            x.extend(points.iter().map(|point| micrometres(point.x)));
            y.extend(points.iter().map(|point| micrometres(point.y)));
        }
        let mut columns = Columns::quick();
        for (name, values) in [("count", &counts), ("pen", &pens), ("x", &x), ("y", &y)] {
            columns.numbers(name, values);
        }
        let report = self.report(&page);
        // The pens that can be left out are those of the files.
        let of_file = |document: &Document| document.pages.get(number - 1).map(|page| page.drawing.pens());
        let documents = self.read.as_ref().map_or(&[][..], |(_, documents)| documents);
        let all_pens: BTreeSet<u16> =
            documents.iter().filter_map(of_file).flatten().map(|pen| pen.0).collect();
        let bounds = page.drawing.bounding_box().map(|ink| [ink.x0, ink.y0, ink.x1, ink.y1]);
        let json = json!({
            "name": self.name(),
            "files": self.names().collect::<Vec<_>>(),
            "pens": all_pens,
            "page": number,
            "bounds_mm": bounds,
            "report": report,
            "findings": self.findings(),
            "columns": description(&columns),
        });
        Ok(Reply { json, columns: columns.bytes().to_vec() })
    }

    /// A machine without a drawing, at its start pose, for the viewer.
    ///
    /// # Errors
    /// What is wrong with the machine file.
    pub fn machine(&self, job: &Job) -> Result<Reply, Problems> {
        let (_, machine) = job.read_machine()?;
        Ok(standing(&machine, "No drawing"))
    }

    /// Plans the drawing, for the viewer: `meta` and the columns are those that `viewer/js/viewer.js` shows.
    /// Where the drawing cannot be planned, `problems` are the reasons and the viewer shows the machine.
    ///
    /// # Errors
    /// What is wrong with the machine file, the drawing's file or the options.
    pub fn plan(&mut self, job: &Job, progress: &dyn Fn(Step)) -> Result<Reply, Problems> {
        let job = &self.settled(job);
        let (_, machine) = job.read_machine()?;
        let (page, _) = self.page(job)?;
        self.refuse_unusable(&page)?;
        let reply = if job.draft {
            self.draft(job, &page, &machine)
        } else {
            self.planned(job, progress).map(|planned| self.view(&planned))
        };
        match reply {
            Ok(reply) => Ok(reply),
            Err(problems) => {
                let reply = standing(&machine, &self.name());
                let placed = job
                    .options
                    .placement()
                    .ok()
                    .and_then(|options| planner::place(&machine, &page.drawing, &options).ok());
                let mut json = reply.json;
                json["problems"] = json!(problems.0);
                if let Some(placement) = placed {
                    let mut drawing = page.drawing;
                    drawing.transform(placement);
                    let beyond: Vec<Vec<f64>> = scene::beyond_reach(&drawing, &machine)
                        .iter()
                        .map(|line| line.points.iter().flat_map(|point| [point.x, point.y]).collect())
                        .collect();
                    json["placement"] = json!(placement.as_coeffs());
                    json["beyond_mm"] = json!(beyond);
                }
                Ok(Reply { json, columns: reply.columns })
            }
        }
    }

    /// Plans the drawing. A plan that was made before is made again only if the job is another one.
    pub(crate) fn planned(&mut self, job: &Job, progress: &dyn Fn(Step)) -> Result<Planned, Problems> {
        if let Some(planned) = self.planned_before(job) {
            return Ok(planned.clone());
        }
        let (file, machine) = job.read_machine()?;
        let (page, page_number) = self.page(job)?;
        self.refuse_unusable(&page)?;
        let request = job.request(&page, &machine)?;
        let compiled = pipeline::compile(&page.drawing, &machine, &request, progress)
            .map_err(|error| refusal(&page.drawing, &machine, &request, &error))?;
        if !compiled.may_be_written(false) {
            let failures = compiled.certificate.failures.iter().map(ToString::to_string);
            let what = format!("the certificate does not hold: {}", failures.collect::<Vec<_>>().join("; "));
            return Err(Problem::new(About::Plan, what).into());
        }
        let (rows, exact) = compiled.trajectory.rows().map(|row| (row.row, row.exact)).unzip();
        let (summary, certificate) = (Summary::of(&compiled), CertificateReport::of(&compiled.certificate));
        let spare_mm = compiled.certificate.spare_mm();
        let (header, drawn) = (compiled.header.clone(), compiled.ordered().clone());
        let (placed, beyond_sheet_mm) = (compiled.placed.clone(), compiled.beyond_sheet_mm);
        drop(compiled);
        let planned = Planned {
            job: job.clone(),
            file,
            machine,
            page,
            page_number,
            request,
            header,
            rows,
            exact,
            drawn,
            placed,
            summary,
            certificate,
            spare_mm,
            beyond_sheet_mm,
        };
        self.planned = Some(planned.clone());
        Ok(planned)
    }

    /// What the viewer shows of a plan.
    pub(crate) fn view_of<'a>(&'a self, planned: &'a Planned) -> View<'a> {
        View {
            title: self.name(),
            machine: &planned.machine,
            header: &planned.header,
            rows: &planned.rows,
            exact: Some(&planned.exact),
            drawing: Some(DrawingView {
                drawn: &planned.drawn,
                placed: &planned.placed,
                pens: &planned.page.pens,
                pen_speeds: &planned.request.pen_speeds,
                files: self.files.iter().map(File::source).collect(),
            }),
            tolerance_mm: planned.request.tolerance_mm,
            summary: Some(planned.summary.clone()),
            certificate: Some(planned.certificate.clone()),
            findings: self.findings(),
            prediction: None,
        }
    }

    /// What the viewer needs of the job's machine.
    fn described(&mut self, job: &Job, machine: &Machine) -> Value {
        let (text, paper) = (job.machine.text(), job.options.paper.as_str());
        if let Some((_, _, found)) = self.described.as_ref().filter(|(t, p, _)| t == text && p == paper) {
            return found.clone();
        }
        let found = view::machine(machine);
        self.described = Some((text.to_owned(), paper.to_owned(), found.clone()));
        found
    }

    /// A draft for the viewer. It has no certificate; the bytes of each stroke and the distance of each row from
    /// the drawing come with the full plan.
    fn draft(&mut self, job: &Job, page: &Page, machine: &Machine) -> Result<Reply, Problems> {
        let described = self.described(job, machine);
        let request = job.request(page, machine)?;
        let draft = pipeline::draft(&page.drawing, machine, &request)
            .map_err(|error| refusal(&page.drawing, machine, &request, &error))?;
        let (rows, exact): (Vec<Row>, Vec<[f64; 2]>) =
            draft.trajectory.rows().map(|row| (row.row, row.exact)).unzip();
        let placed = draft.trajectory.drawing();
        let view = View {
            title: self.name(),
            machine,
            header: &draft.header,
            rows: &rows,
            exact: Some(&exact),
            drawing: None,
            tolerance_mm: request.tolerance_mm,
            summary: None,
            certificate: None,
            findings: self.findings(),
            prediction: None,
        };
        let (meta, columns) = view.data_with(&described, Columns::quick());
        let ink = placed.bounding_box().map(|ink| [ink.x0, ink.y0, ink.x1, ink.y1]);
        let json = json!({
            "meta": meta,
            "is_draft": true,
            "placement": draft.header.placement,
            "ink_mm": ink,
            "beyond_sheet_mm": draft.beyond_sheet_mm,
            "problems": [],
        });
        Ok(Reply { json, columns: columns.bytes().to_vec() })
    }

    fn view(&mut self, planned: &Planned) -> Reply {
        let described = self.described(&planned.job, &planned.machine);
        let (meta, columns) = self.view_of(planned).data_with(&described, Columns::quick());
        let ink = planned.placed.bounding_box().map(|ink| [ink.x0, ink.y0, ink.x1, ink.y1]);
        let json = json!({
            "meta": meta,
            "is_draft": false,
            "placement": planned.header.placement,
            "ink_mm": ink,
            "beyond_sheet_mm": planned.beyond_sheet_mm,
            "best_place": planned.summary.best_place,
            "problems": [],
        });
        Reply { json, columns: columns.bytes().to_vec() }
    }
}

/// A machine at its start pose.
fn standing(machine: &Machine, title: &str) -> Reply {
    let ticks = machine.motor_positions(&machine.start()).0.map(|ticks| ticks.round() as i64);
    let rows = [Row { t_us: 0, pen: 0, ticks }];
    let header = Header {
        machine: machine.name().to_owned(),
        motors: pipeline::header_motors(machine),
        placement: Affine::IDENTITY.as_coeffs(),
        period_us: ((machine.parts().period_s * 1e6).round() as u64).max(1),
        lift_overlap_us: 0,
        rounding: plan::Rounding::Nearest,
        pen_colors: std::collections::BTreeMap::new(),
        rows: 1,
        duration_us: 0,
    };
    let view = View {
        title: title.to_owned(),
        machine,
        header: &header,
        rows: &rows,
        exact: None,
        drawing: None,
        tolerance_mm: 0.1,
        summary: None,
        certificate: None,
        findings: Vec::new(),
        prediction: None,
    };
    let (meta, columns) = view.data_into(Columns::quick());
    Reply { json: json!({ "meta": meta, "problems": [] }), columns: columns.bytes().to_vec() }
}

/// Why a drawing cannot be planned, and what would help.
pub(crate) fn refusal(
    drawing: &Drawing,
    machine: &Machine,
    request: &Request,
    error: &PlanError,
) -> Problems {
    let problem = match error {
        PlanError::OutOfReach { source, span: Span { start, end }, .. } => Problem {
            bytes: Some([*start, *end]),
            at_mm: Some([source.point.x, source.point.y]),
            ..Problem::new(
                About::Plan,
                format!("The drawing leaves the reach of {}: {source}.", machine.name()),
            )
            .with_help(what_fits(drawing, machine, request))
        },
        other => Problem::new(About::Plan, capitalized(&other.to_string())),
    };
    problem.into()
}

fn capitalized(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| format!("{}{}.", first.to_uppercase(), letters.as_str()))
}

/// Which button makes the drawing fit.
fn what_fits(drawing: &Drawing, machine: &Machine, request: &Request) -> &'static str {
    let fits = |scale: Scale| {
        let placement = PlacementOptions { scale, ..request.placement };
        let placed = pipeline::place(drawing, machine, &placement, None);
        placed.is_ok_and(|placed| placed.beyond_sheet_mm <= 1e-6)
    };
    let factor = match request.placement.scale {
        Scale::Explicit { factor, .. } | Scale::Aligned { factor, .. } => factor,
        Scale::Fit | Scale::Shrink => 1.0,
    };
    let center = drawing::Vec2::new(0.5, 0.5);
    if fits(Scale::Aligned { factor, align: center }) {
        "It fits at this size in the middle of the sheet: Centre."
    } else if fits(Scale::Fit) {
        "Fit scales it to the sheet."
    } else {
        "Neither Centre nor Fit makes it fit: turn it, or choose another machine."
    }
}
