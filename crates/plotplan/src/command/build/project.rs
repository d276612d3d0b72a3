//! `plotplan.toml`: the plans of a folder, each with the options of `plotplan convert`.

use std::collections::BTreeMap;
use std::ops::Range;

use clap::CommandFactory as _;
use compiler::machine_file::nearest;
use toml_edit::{Document, Item, TableLike, Value};

use crate::cli;

/// The usual name of a project file.
pub(crate) const NAME: &str = "plotplan.toml";
/// Options of `convert` that a project decides itself.
const RESERVED: [&str; 5] = ["output", "report", "message-format", "quiet", "color"];

/// A project file that cannot be used.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{NAME}:{line}: {message}")]
pub(crate) struct ProjectError {
    /// Line, from 1.
    pub(crate) line: usize,
    /// What is wrong, and what to do.
    pub(crate) message: String,
}

/// One `[[plan]]`: a drawing, or several drawn over each other, with an output for each format.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Entry {
    /// Line of the table, from 1.
    pub(crate) line: usize,
    /// The drawings, relative to the project's folder; one may be a pattern such as `art/*.svg`.
    pub(crate) drawings: Vec<String>,
    /// The outputs, relative to the project's folder.
    pub(crate) outputs: Vec<String>,
    /// Options of `convert`, in the order of their names: `--fit`, `--machine=coaxial`.
    pub(crate) options: Vec<String>,
}

/// Reads a project file. `[options]` holds for all plans; keys of a `[[plan]]` replace it.
pub(crate) fn parse(text: &str) -> Result<Vec<Entry>, ProjectError> {
    let at = |span: Option<Range<usize>>, message: String| {
        let byte = span.map_or(0, |span| span.start.min(text.len()));
        ProjectError { line: 1 + text[..byte].matches('\n').count(), message }
    };
    let document = Document::parse(text).map_err(|error| at(error.span(), error.message().to_owned()))?;
    let mut shared = Options::new();
    for (key, item) in document.iter() {
        match (key, item) {
            ("options", Item::Table(table)) => {
                shared = options(table, &[]).map_err(|(span, message)| at(span, message))?;
            }
            ("plan", Item::ArrayOfTables(_)) => {}
            ("plan", _) => return Err(at(item.span(), "a plan is a table of its own: [[plan]]".to_owned())),
            (other, _) => {
                let span = document.get_key_value(other).and_then(|(key, _)| key.span());
                let message = format!("unknown key `{other}`: a project has [options] and [[plan]]");
                return Err(at(span, message));
            }
        }
    }
    let plans = document.get("plan").and_then(Item::as_array_of_tables);
    let entries: Result<Vec<Entry>, ProjectError> = plans
        .into_iter()
        .flatten()
        .map(|table| {
            let entry =
                entry(table, &shared).map_err(|(span, message)| at(span.or(table.span()), message))?;
            let line = at(table.span(), String::new()).line;
            Ok(Entry { line, ..entry })
        })
        .collect();
    match entries {
        Ok(entries) if entries.is_empty() => {
            Err(at(None, "it has no [[plan]]; `plotplan init` shows how one looks".to_owned()))
        }
        other => other,
    }
}

/// Options by name; `None` is an option switched off.
type Options = BTreeMap<String, Option<Vec<String>>>;
/// Where an error is, and what.
type Wrong = (Option<Range<usize>>, String);

fn entry(table: &toml_edit::Table, shared: &Options) -> Result<Entry, Wrong> {
    let files = |key: &str| match table.get(key) {
        Some(item) => {
            let files =
                texts(item).filter(|files| !files.is_empty() && files.iter().all(|file| !file.is_empty()));
            files.ok_or_else(|| (item.span(), format!("`{key}` is a file name, or a list of them")))
        }
        None => Err((None, format!("this [[plan]] has no `{key}`"))),
    };
    let (drawings, outputs) = (files("drawing")?, files("output")?);
    let mut all = shared.clone();
    all.extend(options(table, &["drawing", "output"])?);
    let mut arguments = Vec::new();
    for (name, values) in all {
        match values {
            None => {}
            Some(values) if values.is_empty() => arguments.push(format!("--{name}")),
            Some(values) => arguments.extend(values.iter().map(|value| format!("--{name}={value}"))),
        }
    }
    Ok(Entry { line: 0, drawings, outputs, options: arguments })
}

/// The options of a table, less the keys that are none.
fn options(table: &dyn TableLike, others: &[&str]) -> Result<Options, Wrong> {
    let command = cli::Arguments::command();
    let convert = command.find_subcommand("convert").unwrap_or(&command);
    let is_flag = |argument: &clap::Arg| !argument.get_action().takes_values();
    let mut found = Options::new();
    for (key, item) in table.iter().filter(|(key, _)| !others.contains(key)) {
        let span = table.get_key_value(key).and_then(|(key, _)| key.span());
        let name = key.replace('_', "-");
        if RESERVED.contains(&name.as_str()) {
            return Err((span, format!("`{key}` is not an option of a plan here")));
        }
        let named = |argument: &&clap::Arg| argument.get_long() == Some(&*name);
        let Some(argument) = convert.get_arguments().find(named) else {
            let longs = convert.get_arguments().filter_map(clap::Arg::get_long);
            let hint = nearest(&name, longs.chain(others.iter().copied())).map_or_else(
                || "keys are options of `plotplan convert`".to_owned(),
                |near| format!("did you mean `{}`?", near.replace('-', "_")),
            );
            return Err((span, format!("unknown key `{key}`: {hint}")));
        };
        let values = match (is_flag(argument), item.as_bool(), texts(item)) {
            (true, Some(true), _) => Some(Vec::new()),
            (true, Some(false), _) => None,
            (true, None, _) => return Err((item.span(), format!("`{key}` is true or false"))),
            (false, None, Some(values)) if !values.is_empty() => Some(values),
            (false, ..) => {
                return Err((
                    item.span(),
                    format!("`{key}` takes a value as on the command line of `plotplan convert`"),
                ));
            }
        };
        found.insert(name, values);
    }
    Ok(found)
}

/// A value or a list of values as the command line takes them.
fn texts(item: &Item) -> Option<Vec<String>> {
    let text = |value: &Value| match value {
        Value::String(text) => Some(text.value().clone()),
        Value::Integer(number) => Some(number.value().to_string()),
        Value::Float(number) => Some(number.value().to_string()),
        _ => None,
    };
    match item.as_value()? {
        Value::Array(values) => values.iter().map(text).collect(),
        value => Some(vec![text(value)?]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn error(text: &str) -> String {
        parse(text).expect_err("refused").to_string()
    }

    #[test]
    fn plans_take_shared_options_and_replace_them() {
        let text = "[options]\nmachine = \"coaxial\"\nfit = true\ntolerance = \"0.05mm\"\n\n\
                    [[plan]]\ndrawing = \"a.hpgl\"\noutput = [\"a.ticks\", \"a.csv\"]\nfit = false\nonly_pens = [1, 3]\n\n\
                    [[plan]]\ndrawing = [\"a.hpgl\", \"b.svg\"]\noutput = \"ab.ticks\"\nscale = 0.5\ntolerance = \"1mm\"\n";
        let entries = parse(text).unwrap();
        assert_eq!(entries[0].line, 6);
        assert_eq!(entries[0].outputs, ["a.ticks", "a.csv"]);
        assert_eq!(
            entries[0].options,
            ["--machine=coaxial", "--only-pens=1", "--only-pens=3", "--tolerance=0.05mm"]
        );
        assert_eq!(entries[1].drawings, ["a.hpgl", "b.svg"]);
        assert_eq!(entries[1].options, ["--fit", "--machine=coaxial", "--scale=0.5", "--tolerance=1mm"]);
    }

    #[test]
    fn project_errors_name_line_key_and_nearest_option() {
        let plan = "[[plan]]\ndrawing = \"a.hpgl\"\noutput = \"a.ticks\"\n";
        for (text, expected) in [
            ("", "plotplan.toml:1: it has no [[plan]]"),
            ("[options\n", "plotplan.toml:1: "),
            ("\n[plans]\n", "plotplan.toml:2: unknown key `plans`"),
            ("[plan]\ndrawing = \"a\"\n", "a plan is a table of its own"),
            ("[[plan]]\noutput = \"a.ticks\"\n", "plotplan.toml:1: this [[plan]] has no `drawing`"),
            ("[[plan]]\ndrawing = 7.5\noutput = []\n", "plotplan.toml:3: `output` is a file name"),
            (
                &format!("{plan}tolerence = \"1mm\"\n"),
                "plotplan.toml:4: unknown key `tolerence`: did you mean `tolerance`?",
            ),
            (&format!("{plan}report = \"json\"\n"), "plotplan.toml:4: `report` is not an option"),
            (&format!("{plan}fit = 1\n"), "plotplan.toml:4: `fit` is true or false"),
            (&format!("{plan}scale = true\n"), "plotplan.toml:4: `scale` takes a value"),
        ] {
            assert!(error(text).contains(expected), "{text}: {}", error(text));
        }
    }
}
