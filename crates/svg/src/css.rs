//! Style sheets: rules, selectors and declarations.
//!
//! simplecss splits selectors into tokens; matching is done here with a bound on its work.

use std::cell::Cell;
use std::collections::BTreeMap;

use roxmltree::Node;
use simplecss::{AttributeOperator, SelectorToken, SelectorTokenizer};

use crate::limits;

/// A property and its value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Declaration<'a> {
    pub(crate) name: &'a str,
    pub(crate) value: &'a str,
    pub(crate) important: bool,
}

/// Splits at `separator` outside quotes and brackets.
fn split(text: &str, separator: u8) -> impl Iterator<Item = &str> {
    let mut rest = Some(text);
    std::iter::from_fn(move || {
        let text = rest?;
        let (mut quote, mut depth) = (None, 0_usize);
        for (at, byte) in text.bytes().enumerate() {
            match (quote, byte) {
                (Some(open), _) if byte == open => quote = None,
                (None, b'"' | b'\'') => quote = Some(byte),
                (None, b'(') => depth += 1,
                (None, b')') => depth = depth.saturating_sub(1),
                (None, _) if byte == separator && depth == 0 => {
                    rest = Some(&text[at + 1..]);
                    return Some(&text[..at]);
                }
                _ => {}
            }
        }
        rest = None;
        Some(text)
    })
}

/// The declarations of a `style` attribute or a block.
pub(crate) fn declarations(text: &str) -> impl Iterator<Item = Declaration<'_>> {
    split(text, b';').filter_map(|declaration| {
        let (name, value) = declaration.split_once(':')?;
        let mut name = name.trim();
        // A comment before the name.
        if let Some((_, after)) = name.rsplit_once("*/") {
            name = after.trim();
        }
        let value = value.trim();
        let important =
            value.rsplit_once('!').filter(|(_, word)| word.trim().eq_ignore_ascii_case("important"));
        let (value, important) = important.map_or((value, false), |(value, _)| (value.trim(), true));
        (!name.is_empty() && !value.is_empty()).then_some(Declaration { name, value, important })
    })
}

/// The text without its comments.
fn without_comments(text: &str) -> String {
    let mut clean = String::with_capacity(text.len());
    let mut rest = text;
    while let Some((before, comment)) = rest.split_once("/*") {
        clean.push_str(before);
        clean.push(' ');
        rest = comment.split_once("*/").map_or("", |(_, after)| after);
    }
    clean.push_str(rest);
    clean
}

#[derive(Debug)]
enum Simple {
    Any,
    Type(String),
    Id(String),
    Class(String),
    Exists(String),
    Equals(String, String),
    HasWord(String, String),
    DashPrefix(String, String),
    FirstChild,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Combinator {
    None,
    Descendant,
    Child,
    Adjacent,
}

/// A compound selector, and how it relates to the one before it.
#[derive(Debug)]
struct Compound {
    combinator: Combinator,
    parts: Vec<Simple>,
}

#[derive(Debug)]
struct Rule {
    compounds: Vec<Compound>,
    specificity: [usize; 3],
    block: usize,
}

/// All style sheets of a document.
#[derive(Debug, Default)]
pub(crate) struct Sheet {
    rules: Vec<Rule>,
    blocks: Vec<Vec<(String, String, bool)>>,
    /// Rules by the id, class or type that their last compound asks for (`#id`, `.class`, `type`,
    /// or empty).
    by_key: BTreeMap<String, Vec<usize>>,
    /// What is not supported, for a finding.
    pub(crate) skipped: Vec<String>,
    steps_left: Cell<u64>,
}

impl Sheet {
    /// Whether matching was cut short.
    pub(crate) fn is_exhausted(&self) -> bool {
        self.steps_left.get() == 0
    }

    pub(crate) fn new() -> Self {
        Self { steps_left: Cell::new(limits::SELECTOR_STEPS), ..Self::default() }
    }

    /// Adds the rules of one `style` element.
    pub(crate) fn add(&mut self, text: &str) {
        let text = without_comments(text);
        let mut rest = text.trim_start();
        while !rest.is_empty() {
            if rest.starts_with('@') {
                let end = rest.find([';', '{']).unwrap_or(rest.len());
                self.skipped.push(rest[..end].trim().chars().take(60).collect());
                rest = if rest[end..].starts_with('{') {
                    after_block(&rest[end..])
                } else {
                    rest.get(end + 1..).unwrap_or("")
                };
            } else if let Some(skipped) = rest.strip_prefix("<!--").or_else(|| rest.strip_prefix("-->")) {
                rest = skipped;
            } else if let Some((selectors, block)) = rest.split_once('{') {
                let (block, after) = block.split_once('}').unwrap_or((block, ""));
                self.rule(selectors, block);
                rest = after;
            } else {
                break;
            }
            rest = rest.trim_start();
        }
    }

    fn rule(&mut self, selectors: &str, block: &str) {
        let index = self.blocks.len();
        let owned = |d: Declaration<'_>| (d.name.to_owned(), d.value.to_owned(), d.important);
        self.blocks.push(declarations(block).map(owned).collect());
        for selector in split(selectors, b',') {
            let Some(rule) = parse(selector.trim(), index) else {
                self.skipped.push(selector.trim().chars().take(60).collect());
                continue;
            };
            self.by_key.entry(key(&rule)).or_default().push(self.rules.len());
            self.rules.push(rule);
        }
    }

    /// The declarations of all rules that match, the weakest first.
    pub(crate) fn matching(&self, node: Node<'_, '_>) -> Vec<Declaration<'_>> {
        if self.rules.is_empty() || self.is_exhausted() {
            return Vec::new();
        }
        let mut found: Vec<usize> = Vec::new();
        let mut look = |key: &str| found.extend(self.by_key.get(key).into_iter().flatten());
        look("");
        look(node.tag_name().name());
        if let Some(id) = node.attribute("id") {
            look(&format!("#{id}"));
        }
        for class in node.attribute("class").unwrap_or("").split_ascii_whitespace() {
            look(&format!(".{class}"));
        }
        found.retain(|&rule| self.matches(&self.rules[rule].compounds, node));
        found.sort_unstable_by_key(|&rule| (self.rules[rule].specificity, rule));
        found.dedup();
        let blocks = found.into_iter().map(|rule| &self.blocks[self.rules[rule].block]);
        let size = blocks.clone().map(|block| block.len() as u64).sum();
        self.steps_left.set(self.steps_left.get().saturating_sub(size));
        blocks
            .flatten()
            .map(|(name, value, important)| Declaration { name, value, important: *important })
            .collect()
    }

    fn matches(&self, compounds: &[Compound], node: Node<'_, '_>) -> bool {
        let steps = self.steps_left.get();
        if steps == 0 {
            return false;
        }
        self.steps_left.set(steps - 1);
        let Some((last, before)) = compounds.split_last() else { return true };
        if !last.parts.iter().all(|part| is(part, node)) {
            return false;
        }
        match last.combinator {
            Combinator::None => true,
            Combinator::Descendant => {
                node.ancestors().skip(1).filter(Node::is_element).any(|above| self.matches(before, above))
            }
            Combinator::Child => node.parent_element().is_some_and(|above| self.matches(before, above)),
            Combinator::Adjacent => {
                node.prev_sibling_element().is_some_and(|sibling| self.matches(before, sibling))
            }
        }
    }
}

fn is(part: &Simple, node: Node<'_, '_>) -> bool {
    let attribute = |name: &str| node.attributes().find(|a| a.name() == name).map(|a| a.value());
    match part {
        Simple::Any => true,
        Simple::Type(name) => node.tag_name().name() == name,
        Simple::Id(id) => node.attribute("id") == Some(id),
        Simple::Class(class) => {
            node.attribute("class").is_some_and(|all| all.split_ascii_whitespace().any(|one| one == class))
        }
        Simple::Exists(name) => attribute(name).is_some(),
        Simple::Equals(name, value) => attribute(name) == Some(value),
        Simple::HasWord(name, word) => {
            attribute(name).is_some_and(|all| all.split_ascii_whitespace().any(|one| one == word))
        }
        Simple::DashPrefix(name, value) => attribute(name).is_some_and(|all| {
            all.strip_prefix(value.as_str()).is_some_and(|rest| rest.is_empty() || rest.starts_with('-'))
        }),
        Simple::FirstChild => node.prev_sibling_element().is_none(),
    }
}

fn after_block(text: &str) -> &str {
    let mut depth = 0;
    for (at, byte) in text.bytes().enumerate() {
        match byte {
            b'{' => depth += 1,
            b'}' if depth <= 1 => return &text[at + 1..],
            b'}' => depth -= 1,
            _ => {}
        }
    }
    ""
}

fn key(rule: &Rule) -> String {
    let parts = rule.compounds.last().map_or(&[][..], |last| &last.parts);
    let mut key = String::new();
    for part in parts {
        match part {
            Simple::Id(id) => return format!("#{id}"),
            Simple::Class(class) => key = format!(".{class}"),
            Simple::Type(name) if key.is_empty() => key.clone_from(name),
            _ => {}
        }
    }
    key
}

fn parse(selector: &str, block: usize) -> Option<Rule> {
    if selector.len() > limits::SELECTOR_BYTES {
        return None;
    }
    let mut compounds = vec![Compound { combinator: Combinator::None, parts: Vec::new() }];
    let mut specificity = [0; 3];
    for token in SelectorTokenizer::from(selector) {
        let (weight, part) = match token.ok()? {
            SelectorToken::UniversalSelector => (None, Simple::Any),
            SelectorToken::TypeSelector(name) => (Some(2), Simple::Type(name.into())),
            SelectorToken::ClassSelector(class) => (Some(1), Simple::Class(class.into())),
            SelectorToken::IdSelector(id) => (Some(0), Simple::Id(id.into())),
            SelectorToken::AttributeSelector(name, operator) => {
                let name = name.to_owned();
                let part = match operator {
                    AttributeOperator::Exists => Simple::Exists(name),
                    AttributeOperator::Matches(value) => Simple::Equals(name, value.into()),
                    AttributeOperator::Contains(value) => Simple::HasWord(name, value.into()),
                    AttributeOperator::StartsWith(value) => Simple::DashPrefix(name, value.into()),
                };
                (Some(1), part)
            }
            SelectorToken::PseudoClass("first-child") => (Some(1), Simple::FirstChild),
            SelectorToken::PseudoClass(_) | SelectorToken::LangPseudoClass(_) => return None,
            combinator => {
                let combinator = match combinator {
                    SelectorToken::DescendantCombinator => Combinator::Descendant,
                    SelectorToken::ChildCombinator => Combinator::Child,
                    _ => Combinator::Adjacent,
                };
                compounds.push(Compound { combinator, parts: Vec::new() });
                continue;
            }
        };
        if let Some(weight) = weight {
            specificity[weight] += 1;
        }
        compounds.last_mut()?.parts.push(part);
    }
    compounds.iter().all(|compound| !compound.parts.is_empty()).then_some(Rule {
        compounds,
        specificity,
        block,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn values(css: &str, xml: &str, id: &str) -> Vec<String> {
        let mut sheet = Sheet::new();
        sheet.add(css);
        let document = roxmltree::Document::parse(xml).unwrap();
        let node = document.descendants().find(|node| node.attribute("id") == Some(id)).unwrap();
        sheet.matching(node).into_iter().map(|d| d.value.to_owned()).collect()
    }

    #[test]
    fn rules_are_ordered_by_specificity() {
        let css = "#a{k:1} .b{k:2} g .b{k:3} path{k:4} *{k:5} g > .b {k:6} [d]{k:7} g+path{k:8}";
        let xml = "<svg><g><path id='a' class='x b' d='M0 0'/></g></svg>";
        assert_eq!(values(css, xml, "a"), ["5", "4", "2", "7", "3", "6", "1"]);
    }

    #[test]
    fn at_rules_and_comments_are_skipped() {
        let css =
            "@import url(x;y); /* {} */ @media print { path { k:1 } } path:hover{k:2} path,/*,*/g{k:3;}";
        assert_eq!(values(css, "<svg><path id='a'/></svg>", "a"), ["3"]);
    }

    #[test]
    fn declarations_keep_quoted_separators() {
        let all: Vec<_> = declarations("a:'x;y';b:url(data:p;q) !important; ;c:;/*z*/d:1").collect();
        let pairs: Vec<_> = all.iter().map(|d| (d.name, d.value, d.important)).collect();
        assert_eq!(pairs, [("a", "'x;y'", false), ("b", "url(data:p;q)", true), ("d", "1", false)]);
    }
}
