//! Style sheets: rules, at-rules and declarations.

use std::collections::BTreeMap;

use roxmltree::Node;

use crate::limits;
use crate::media::{self, Media};
use crate::selector::{Budget, Selector};

/// A property and its value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Declaration<'a> {
    pub(crate) name: &'a str,
    pub(crate) value: &'a str,
    pub(crate) important: bool,
}

/// Splits at `separator` outside quotes and brackets.
pub(crate) fn split(text: &str, separator: u8) -> impl Iterator<Item = &str> {
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
struct Rule {
    selector: Selector,
    block: usize,
}

/// All style sheets of a document.
#[derive(Debug)]
pub(crate) struct Sheet {
    rules: Vec<Rule>,
    blocks: Vec<Vec<(String, String, bool)>>,
    /// Rules by the id, class or type that their last compound asks for (`#id`, `.class`, `type`,
    /// or empty).
    by_key: BTreeMap<String, Vec<usize>>,
    /// What is not supported, for a finding.
    pub(crate) skipped: Vec<String>,
    budget: Budget,
}

impl Sheet {
    /// Whether matching was cut short.
    pub(crate) fn is_exhausted(&self) -> bool {
        self.budget.is_spent()
    }

    pub(crate) fn new() -> Self {
        Self {
            rules: Vec::new(),
            blocks: Vec::new(),
            by_key: BTreeMap::new(),
            skipped: Vec::new(),
            budget: Budget::new(limits::SELECTOR_STEPS),
        }
    }

    /// Adds the rules of one `style` element for a list of media.
    pub(crate) fn add(&mut self, text: &str, media: &str) {
        match media::of(media) {
            Media::Holds => self.rules(&without_comments(text), 0),
            Media::Other => {}
            Media::Unknown => self.skip(&format!("@media {media}")),
        }
    }

    /// Notes a rule that is not supported.
    fn skip(&mut self, rule: &str) {
        self.skipped.push(rule.trim().chars().take(60).collect());
    }

    /// Adds the rules of a text without comments.
    fn rules(&mut self, text: &str, depth: usize) {
        let mut rest = text.trim_start();
        while !rest.is_empty() {
            if rest.starts_with('@') {
                rest = self.at_rule(rest, depth);
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

    /// Reads an at-rule; what follows it.
    fn at_rule<'t>(&mut self, text: &'t str, depth: usize) -> &'t str {
        let end = text.find([';', '{']).unwrap_or(text.len());
        let head = text[..end].trim();
        let has_block = text[end..].starts_with('{');
        let after = if has_block { after_block(&text[end..]) } else { text.get(end + 1..).unwrap_or("") };
        let name = head.split(|c: char| !(c.is_alphanumeric() || c == '@' || c == '-')).next().unwrap_or("");
        match name.to_ascii_lowercase().trim_start_matches("@-webkit-").trim_start_matches('@') {
            "media" if has_block && depth < limits::AT_RULES => {
                let block = &text[end + 1..text.len() - after.len()];
                match media::of(&head[name.len()..]) {
                    Media::Holds => self.rules(block.strip_suffix('}').unwrap_or(block), depth + 1),
                    Media::Other => {}
                    Media::Unknown => self.skip(head),
                }
            }
            // No ink depends on these: fonts are reported where they are used, prefixes of selectors
            // are ignored, animations are not run.
            "charset" | "namespace" | "font-face" | "keyframes" | "page" => {}
            _ => self.skip(head),
        }
        after
    }

    fn rule(&mut self, selectors: &str, block: &str) {
        let index = self.blocks.len();
        let owned = |d: Declaration<'_>| (d.name.to_owned(), d.value.to_owned(), d.important);
        self.blocks.push(declarations(block).map(owned).collect());
        for selector in split(selectors, b',') {
            let Some(selector) = Selector::parse(selector) else {
                self.skip(selector);
                continue;
            };
            self.by_key.entry(selector.key()).or_default().push(self.rules.len());
            self.rules.push(Rule { selector, block: index });
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
        found.retain(|&rule| self.rules[rule].selector.matches(node, &self.budget));
        found.sort_unstable_by_key(|&rule| (self.rules[rule].selector.specificity, rule));
        found.dedup();
        let blocks = found.into_iter().map(|rule| &self.blocks[self.rules[rule].block]);
        let size = blocks.clone().map(|block| block.len() as u64).sum();
        self.budget.take(size);
        blocks
            .flatten()
            .map(|(name, value, important)| Declaration { name, value, important: *important })
            .collect()
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

#[cfg(test)]
mod tests {
    use super::*;

    fn values(css: &str, xml: &str, id: &str) -> Vec<String> {
        let mut sheet = Sheet::new();
        sheet.add(css, "");
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
    fn media_rules_of_a_screen_hold() {
        let css = "@media screen{path{k:1}@media print{path{k:2}}}@media print{path{k:3} g{k:4}} \
                   @media (min-width:9px){path{k:5}} @media (prefers-color-scheme:light) {path{k:6}} path{k:7}";
        assert_eq!(values(css, "<svg><path id='a'/></svg>", "a"), ["1", "6", "7"]);
        let mut sheet = Sheet::new();
        sheet.add(css, "screen");
        sheet.add(css, "print");
        assert_eq!(sheet.skipped, ["@media (min-width:9px)"]);
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
