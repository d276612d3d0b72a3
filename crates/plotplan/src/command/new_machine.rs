//! `plotplan machine new`: questions, and a commented machine file of the answers.

use std::collections::BTreeMap;
use std::io::{BufRead as _, IsTerminal as _};
use std::path::Path;

use anyhow::anyhow;
use compiler::new_machine::{self, KINDS, Question};
use compiler::report::Code;

use crate::failure::Failure;
use crate::{output, terminal};

pub(super) fn run(
    kind: Option<&str>,
    to: &str,
    name: Option<&str>,
    set: &[String],
    defaults: bool,
) -> Result<(), Failure> {
    let mut answers = BTreeMap::new();
    for answer in set {
        let (key, value) = answer.split_once('=').ok_or_else(|| {
            Failure::Usage(anyhow!("--set {answer}: an answer is KEY=VALUE, such as l1=206mm"))
        })?;
        answers.insert(key.trim().to_owned(), value.trim().to_owned());
    }
    if to != "-" && Path::new(to).exists() {
        return Err(Failure::Usage(anyhow!("{to} exists: machine new does not replace a file")));
    }
    let kind = match kind {
        Some(kind) => kind.to_owned(),
        None if defaults => {
            return Err(Failure::Usage(anyhow!("which kind of machine? {}", kinds().join("; "))));
        }
        None => ask_kind()?,
    };
    if !defaults {
        for question in new_machine::questions(&kind).unwrap_or_default() {
            if !answers.contains_key(question.key)
                && let Some(answer) = ask(&question)?
            {
                answers.insert(question.key.to_owned(), answer);
            }
        }
    }
    let stem = Path::new(to).file_stem().and_then(|stem| stem.to_str()).filter(|_| to != "-");
    let name = name.or(stem).unwrap_or(&kind);
    let (text, is_reached) = new_machine::machine_file(name, &kind, &answers)
        .map_err(|error| Failure::Usage(anyhow::Error::new(error)))?;
    output::write(to, |out| out.write_all(text.as_bytes()))?;
    if !is_reached {
        let what = "the machine cannot reach all of the sheet: choose a smaller one, or change [sheet]";
        terminal::warning(Code::SheetNotReached, what);
    }
    if to != "-" {
        terminal::say(&format!("wrote {to}: look at it with\n  plotplan machine check {to} -o reach.svg\n"));
    }
    Ok(())
}

fn kinds() -> Vec<String> {
    KINDS.iter().map(|(kind, about)| format!("{kind}: {about}")).collect()
}

fn ask_kind() -> Result<String, Failure> {
    for kind in kinds() {
        terminal::always(&format!("  {kind}\n"));
    }
    let question = Question { key: "kind", text: "Which kind of machine", default: KINDS[0].0 };
    Ok(ask(&question)?.unwrap_or_else(|| question.default.to_owned()))
}

/// The answer to a question; `None` for an empty line, which takes the default.
fn ask(question: &Question) -> Result<Option<String>, Failure> {
    terminal::always(&format!("{} [{}]: ", question.text, question.default));
    let stdin = std::io::stdin();
    let mut line = String::new();
    let count = stdin.lock().read_line(&mut line).map_err(|error| Failure::Io(error.into()))?;
    if count == 0 {
        let what = "standard input ended: give the answers with --set, or --defaults";
        return Err(Failure::Usage(anyhow!(what)));
    }
    if !stdin.is_terminal() {
        terminal::always("\n");
    }
    let line = line.trim();
    Ok((!line.is_empty()).then(|| line.to_owned()))
}
