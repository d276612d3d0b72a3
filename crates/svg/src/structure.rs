//! XML: limits checked before parsing, repairs of undeclared prefixes, and the tree.

use std::collections::BTreeMap;

use roxmltree::{Document, Error, ParsingOptions};

use crate::codes;
use crate::diagnostics::{Findings, Place};
use crate::limits;

/// Namespaces of prefixes that files use without declaring them.
const USUAL: &[(&str, &str)] = &[
    ("xlink", "http://www.w3.org/1999/xlink"),
    ("inkscape", "http://www.inkscape.org/namespaces/inkscape"),
    ("sodipodi", "http://sodipodi.sourceforge.net/DTD/sodipodi-0.dtd"),
    ("svg", "http://www.w3.org/2000/svg"),
];

/// Parses the text and hands its tree to `work`; gives the text back for lines and columns, with
/// what was inserted to repair it. No result (and a finding) where the text cannot be parsed.
pub(crate) fn with_tree<T>(
    mut text: String,
    findings: &mut Findings,
    work: impl Fn(&Document<'_>, &mut Findings) -> T,
) -> (Option<T>, String) {
    if let Err((at, message)) = check(&text) {
        let place = || Place { range: at..at, ..Place::default() };
        findings.report(codes::TOO_COMPLEX, "", place, || (message.into(), None));
        return (None, text);
    }
    for _ in 0..20 {
        let options = ParsingOptions { allow_dtd: true, ..ParsingOptions::default() };
        let (prefix, place) = match Document::parse_with_options(&text, options) {
            Ok(tree) => {
                let result = work(&tree, findings);
                return (Some(result), text);
            }
            Err(Error::UnknownNamespace(prefix, place)) => (prefix, place),
            Err(error) => {
                let at = offset(&text, error.pos());
                let message = error.to_string();
                let message = message.split(" at ").next().unwrap_or_default();
                let place = || Place { range: at..at, ..Place::default() };
                findings
                    .report(codes::BAD_XML, "", place, || (format!("the file is no XML: {message}"), None));
                return (None, text);
            }
        };
        let at = offset(&text, place);
        let Some(insert) = end_of_root_name(&text).filter(|_| is_name(&prefix)) else { break };
        let uri = USUAL.iter().find(|usual| usual.0 == prefix).map_or("unknown", |usual| usual.1);
        let declaration = format!(" xmlns:{prefix}=\"{uri}\"");
        let already = findings.inserted.map_or(0, |inserted| inserted.1);
        findings.inserted = Some((insert, already + declaration.len()));
        let at = if at > insert { at + declaration.len() } else { at };
        text.insert_str(insert, &declaration);
        let place = || Place { range: at..at, ..Place::default() };
        findings.report(codes::UNDECLARED_PREFIX, &prefix, place, || {
            let help = format!("add xmlns:{prefix}=\"{uri}\" to the svg element");
            (format!("the prefix {prefix}: is not declared"), Some(help))
        });
    }
    let message = || ("the file is no XML: its prefixes are not declared".into(), None);
    findings.report(codes::BAD_XML, "", Place::default, message);
    (None, text)
}

fn is_name(prefix: &str) -> bool {
    !prefix.is_empty() && prefix.chars().all(|c| c.is_alphanumeric() || "_-.".contains(c))
}

/// The byte of a place that the parser names by row and column of characters.
fn offset(text: &str, place: roxmltree::TextPos) -> usize {
    let mut start = 0;
    for _ in 1..place.row {
        match text[start..].find('\n') {
            Some(end) => start += end + 1,
            None => break,
        }
    }
    let column = place.col.saturating_sub(1) as usize;
    text[start..].char_indices().nth(column).map_or(text.len(), |(at, _)| start + at)
}

/// Where an attribute can be inserted into the root element.
fn end_of_root_name(text: &str) -> Option<usize> {
    let mut found = None;
    tags(text, |tag| {
        if let Tag::Open { name_end, .. } = tag {
            found = Some(name_end);
        }
        found.is_none()
    });
    found
}

/// A piece of markup, seen roughly: enough to bound work, not to judge well-formedness.
#[derive(Clone, Copy, Debug)]
enum Tag {
    Open { at: usize, name_end: usize, attributes: usize, namespaces: u64, empty: bool },
    Close,
    Doctype { start: usize, end: usize },
}

/// Calls `visit` for every tag until it returns false.
fn tags(text: &str, mut visit: impl FnMut(Tag) -> bool) {
    let bytes = text.as_bytes();
    let mut at = 0;
    while let Some(open) = text[at..].find('<').map(|open| at + open) {
        let rest = &text[open..];
        let skip = |end: &str| rest.find(end).map_or(text.len(), |found| open + found + end.len());
        let mut go_on = true;
        at = if rest.starts_with("<!--") {
            skip("-->")
        } else if rest.starts_with("<![CDATA[") {
            skip("]]>")
        } else if rest.starts_with("<?") {
            skip("?>")
        } else if rest.starts_with("<!") {
            let end = end_of_doctype(bytes, open);
            go_on = visit(Tag::Doctype { start: open, end });
            end
        } else if rest.starts_with("</") {
            go_on = visit(Tag::Close);
            open + 2
        } else {
            let (tag, end) = open_tag(bytes, open);
            go_on = visit(tag);
            end
        };
        if !go_on || at >= text.len() {
            break;
        }
    }
}

/// The tag at `open`, and the byte after it.
fn open_tag(bytes: &[u8], open: usize) -> (Tag, usize) {
    let mut at = open + 1;
    while bytes.get(at).is_some_and(|byte| !byte.is_ascii_whitespace() && !b"/>".contains(byte)) {
        at += 1;
    }
    let (name_end, mut attributes, mut namespaces) = (at, 0, 0);
    loop {
        match bytes.get(at) {
            None => break,
            Some(b'>') => {
                let empty = bytes[at - 1] == b'/';
                return (Tag::Open { at: open, name_end, attributes, namespaces, empty }, at + 1);
            }
            Some(quote @ (b'"' | b'\'')) => {
                attributes += 1;
                let end = bytes[at + 1..].iter().position(|byte| byte == quote);
                at = end.map_or(bytes.len(), |end| at + 1 + end);
            }
            Some(b'x') if bytes[at..].starts_with(b"xmlns") => namespaces += 1,
            Some(_) => {}
        }
        at += 1;
    }
    (Tag::Open { at: open, name_end, attributes, namespaces, empty: false }, bytes.len())
}

fn end_of_doctype(bytes: &[u8], start: usize) -> usize {
    let (mut at, mut subset) = (start, false);
    while let Some(&byte) = bytes.get(at) {
        match byte {
            b'[' => subset = true,
            b']' => subset = false,
            b'"' | b'\'' => {
                let end = bytes[at + 1..].iter().position(|&other| other == byte);
                at = end.map_or(bytes.len(), |end| at + 1 + end);
            }
            b'>' if !subset => return at + 1,
            _ => {}
        }
        at += 1;
    }
    bytes.len()
}

/// Refuses text whose tree would be too deep or too large: where, and why.
fn check(text: &str) -> Result<(), (usize, &'static str)> {
    let mut result = Ok(());
    let mut namespaces_at: Vec<u64> = vec![0];
    let mut namespace_cost = 0;
    let mut entities = BTreeMap::new();
    tags(text, |tag| {
        match tag {
            Tag::Doctype { start, end } => entities.extend(declared(&text[start..end])),
            Tag::Close => {
                if namespaces_at.len() > 1 {
                    namespaces_at.pop();
                }
            }
            Tag::Open { at, attributes, namespaces, empty, .. } => {
                let inherited = namespaces_at.last().copied().unwrap_or(0) + namespaces;
                namespace_cost += if namespaces > 0 { inherited } else { 0 };
                if !empty {
                    namespaces_at.push(inherited);
                }
                if namespaces_at.len() > limits::DEPTH + 1 {
                    result = Err((at, "elements are nested more than 200 deep"));
                } else if attributes > limits::ATTRIBUTES {
                    result = Err((at, "an element has more than 2000 attributes"));
                } else if namespace_cost > limits::NAMESPACES {
                    result = Err((at, "there are too many namespace declarations"));
                }
            }
        }
        result.is_ok()
    });
    result?;
    if !entities.is_empty() && expanded(text, &entities, 0, &mut 100_000) > limits::ENTITY_BYTES {
        return Err((0, "entities expand to more than 64 MB"));
    }
    Ok(())
}

/// Entities that a document type declares, with their values.
fn declared(doctype: &str) -> BTreeMap<&str, &str> {
    let mut entities = BTreeMap::new();
    for declaration in doctype.split("<!ENTITY").skip(1) {
        let declaration = declaration.trim_start();
        let Some((name, rest)) = declaration.split_once(|c: char| c.is_whitespace()) else { continue };
        let Some(quote) = rest.find(['"', '\'']) else { continue };
        let value = &rest[quote + 1..];
        let end = value.find(&rest[quote..=quote]).unwrap_or(value.len());
        entities.insert(name, &value[..end]);
    }
    entities
}

/// Bytes that the references in `text` expand to, or more than any limit where counting them takes
/// too long.
fn expanded(text: &str, entities: &BTreeMap<&str, &str>, depth: usize, work: &mut u64) -> u64 {
    let mut sizes: BTreeMap<&str, u64> = BTreeMap::new();
    let mut total: u64 = 0;
    for reference in text.split('&').skip(1) {
        let Some(end) = reference.bytes().take(100).position(|byte| byte == b';') else { continue };
        let Some((name, value)) = entities.get_key_value(&reference[..end]) else { continue };
        let size = match sizes.get(name) {
            Some(&size) => size,
            None if depth > 10 || *work == 0 => return u64::MAX,
            None => {
                *work -= 1;
                let size = expanded(value, entities, depth + 1, work).saturating_add(value.len() as u64);
                sizes.insert(name, size);
                size
            }
        };
        total = total.saturating_add(size);
        if total > limits::ENTITY_BYTES {
            break;
        }
    }
    total
}
