//! Selectors of style sheets: compounds of simple selectors, matched with a bound on the work.
//!
//! Selectors Level 4 but for namespaces (a prefix is ignored), `:lang()` and combinators inside
//! `:not()` and `:is()`. States that a file at rest does not have (`:hover`) match nothing, and
//! neither do pseudo-elements.

use std::cell::Cell;

use roxmltree::Node;

use crate::limits;

/// How a compound relates to the one before it.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Combinator {
    None,
    Descendant,
    Child,
    Adjacent,
    Sibling,
}

/// How the value of an attribute is compared.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Comparison {
    Exists,
    Equals,
    HasWord,
    DashPrefix,
    Prefix,
    Suffix,
    Contains,
}

#[derive(Clone, Debug)]
enum Simple {
    Any,
    Type(String),
    Id(String),
    Class(String),
    Attribute {
        name: String,
        comparison: Comparison,
        value: String,
        ignores_case: bool,
    },
    Root,
    Empty,
    /// The place among siblings is `step * n + offset`, n = 0, 1, ...
    Nth {
        step: i64,
        offset: i64,
        from_end: bool,
        of_type: bool,
    },
    /// Whether one of the compounds matches.
    Is(Vec<Vec<Simple>>, bool),
    Never,
}

/// Simple selectors for one element, and how it relates to the one before it.
#[derive(Debug)]
struct Compound {
    combinator: Combinator,
    parts: Vec<Simple>,
}

/// A selector with its specificity.
#[derive(Debug)]
pub(crate) struct Selector {
    compounds: Vec<Compound>,
    /// Ids; classes, attributes and pseudo-classes; types.
    pub(crate) specificity: [usize; 3],
}

/// Steps of matching that are left.
#[derive(Debug)]
pub(crate) struct Budget(Cell<u64>);

impl Budget {
    pub(crate) fn new(steps: u64) -> Self {
        Self(Cell::new(steps))
    }

    pub(crate) fn is_spent(&self) -> bool {
        self.0.get() == 0
    }

    /// Takes steps; false where none are left.
    pub(crate) fn take(&self, steps: u64) -> bool {
        self.0.set(self.0.get().saturating_sub(steps));
        !self.is_spent()
    }
}

impl Selector {
    /// Reads one selector; `None` if it is malformed or not supported.
    pub(crate) fn parse(text: &str) -> Option<Self> {
        if text.len() > limits::SELECTOR_BYTES {
            return None;
        }
        let mut parser = Parser { rest: text.trim() };
        let mut specificity = [0; 3];
        let mut compounds =
            vec![Compound { combinator: Combinator::None, parts: parser.compound(&mut specificity)? }];
        while let Some(combinator) = parser.combinator() {
            compounds.push(Compound { combinator, parts: parser.compound(&mut specificity)? });
        }
        parser.rest.is_empty().then_some(Self { compounds, specificity })
    }

    /// What the last compound asks for: `#id`, `.class`, a type, or nothing in particular.
    pub(crate) fn key(&self) -> String {
        let parts = self.compounds.last().map_or(&[][..], |last| &last.parts);
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

    /// Whether it matches an element; false where no steps are left.
    pub(crate) fn matches(&self, node: Node<'_, '_>, budget: &Budget) -> bool {
        matches(&self.compounds, node, budget)
    }
}

fn matches(compounds: &[Compound], node: Node<'_, '_>, budget: &Budget) -> bool {
    if !budget.take(1) {
        return false;
    }
    let Some((last, before)) = compounds.split_last() else { return true };
    if !last.parts.iter().all(|part| is(part, node, budget)) {
        return false;
    }
    let mut previous = std::iter::successors(node.prev_sibling_element(), Node::prev_sibling_element);
    match last.combinator {
        Combinator::None => true,
        Combinator::Descendant => {
            node.ancestors().skip(1).filter(Node::is_element).any(|above| matches(before, above, budget))
        }
        Combinator::Child => node.parent_element().is_some_and(|above| matches(before, above, budget)),
        Combinator::Adjacent => previous.next().is_some_and(|sibling| matches(before, sibling, budget)),
        Combinator::Sibling => {
            previous.take_while(|_| !budget.is_spent()).any(|sibling| matches(before, sibling, budget))
        }
    }
}

fn is(part: &Simple, node: Node<'_, '_>, budget: &Budget) -> bool {
    match part {
        Simple::Any => true,
        Simple::Never => false,
        Simple::Type(name) => node.tag_name().name() == name,
        Simple::Id(id) => node.attribute("id") == Some(id),
        Simple::Class(class) => {
            node.attribute("class").is_some_and(|all| all.split_ascii_whitespace().any(|one| one == class))
        }
        Simple::Attribute { name, comparison, value, ignores_case } => {
            let found = node.attributes().find(|attribute| attribute.name() == name);
            found.is_some_and(|found| {
                if *ignores_case {
                    compare(&found.value().to_ascii_lowercase(), *comparison, &value.to_ascii_lowercase())
                } else {
                    compare(found.value(), *comparison, value)
                }
            })
        }
        Simple::Root => node.parent_element().is_none(),
        Simple::Empty => !node.children().any(|child| child.is_element() || child.is_text()),
        Simple::Nth { step, offset, from_end, of_type } => {
            let place = place(node, *from_end, *of_type, budget);
            match (place - offset, *step) {
                (beyond, 0) => beyond == 0,
                (beyond, step) => beyond % step == 0 && beyond / step >= 0,
            }
        }
        Simple::Is(compounds, wanted) => {
            let any = compounds.iter().any(|parts| parts.iter().all(|part| is(part, node, budget)));
            any == *wanted
        }
    }
}

fn compare(found: &str, comparison: Comparison, value: &str) -> bool {
    match comparison {
        Comparison::Exists => true,
        Comparison::Equals => found == value,
        Comparison::HasWord => found.split_ascii_whitespace().any(|word| word == value),
        Comparison::DashPrefix => {
            found.strip_prefix(value).is_some_and(|rest| rest.is_empty() || rest.starts_with('-'))
        }
        Comparison::Prefix => !value.is_empty() && found.starts_with(value),
        Comparison::Suffix => !value.is_empty() && found.ends_with(value),
        Comparison::Contains => !value.is_empty() && found.contains(value),
    }
}

/// The place of an element among its siblings, from 1.
fn place(node: Node<'_, '_>, from_end: bool, of_type: bool, budget: &Budget) -> i64 {
    let next = |node: &Node<'_, '_>| {
        let id = if from_end { node.next_sibling_element() } else { node.prev_sibling_element() };
        id.map(|node| node.id())
    };
    let document = node.document();
    let mut place = 1;
    let mut at = next(&node).and_then(|id| document.get_node(id));
    while let Some(sibling) = at.filter(|_| budget.take(1)) {
        place += i64::from(!of_type || sibling.tag_name().name() == node.tag_name().name());
        at = next(&sibling).and_then(|id| document.get_node(id));
    }
    place
}

/// Reads a selector from its start.
struct Parser<'t> {
    rest: &'t str,
}

impl Parser<'_> {
    fn eat(&mut self, token: &str) -> bool {
        let after = self.rest.strip_prefix(token);
        self.rest = after.unwrap_or(self.rest);
        after.is_some()
    }

    fn skip_blanks(&mut self) {
        self.rest = self.rest.trim_start();
    }

    /// The combinator before the next compound; `None` at the end.
    fn combinator(&mut self) -> Option<Combinator> {
        let before = self.rest;
        self.skip_blanks();
        let found = [(">", Combinator::Child), ("+", Combinator::Adjacent), ("~", Combinator::Sibling)];
        for (token, combinator) in found {
            if self.eat(token) {
                self.skip_blanks();
                return Some(combinator);
            }
        }
        (self.rest.len() < before.len() && !self.rest.is_empty()).then_some(Combinator::Descendant)
    }

    /// A name with the escapes of CSS.
    fn name(&mut self) -> Option<String> {
        let mut name = String::new();
        let mut characters = self.rest.chars();
        loop {
            let rest = characters.as_str();
            match characters.next() {
                Some(c) if c.is_alphanumeric() || c == '-' || c == '_' || !c.is_ascii() => name.push(c),
                Some('\\') => {
                    let digits =
                        characters.as_str().bytes().take(6).take_while(u8::is_ascii_hexdigit).count();
                    if digits == 0 {
                        name.push(characters.next()?);
                        continue;
                    }
                    let (code, after) = characters.as_str().split_at(digits);
                    let code = u32::from_str_radix(code, 16).ok().and_then(char::from_u32);
                    name.push(code.unwrap_or(char::REPLACEMENT_CHARACTER));
                    characters = after.strip_prefix([' ', '\t', '\n', '\r']).unwrap_or(after).chars();
                }
                _ => {
                    self.rest = rest;
                    return (!name.is_empty()).then_some(name);
                }
            }
        }
    }

    fn compound(&mut self, specificity: &mut [usize; 3]) -> Option<Vec<Simple>> {
        let mut parts = Vec::new();
        if self.eat("*") {
            parts.push(Simple::Any);
        } else if !self.rest.starts_with(['#', '.', '[', ':', '|']) {
            parts.push(Simple::Type(self.name()?));
        }
        // A namespace prefix.
        if self.rest.starts_with('|') && !self.rest.starts_with("|=") {
            self.eat("|");
            parts.clear();
            parts.push(if self.eat("*") { Simple::Any } else { Simple::Type(self.name()?) });
        }
        specificity[2] += usize::from(matches!(parts[..], [Simple::Type(_)]));
        loop {
            if self.eat("#") {
                parts.push(Simple::Id(self.name()?));
                specificity[0] += 1;
            } else if self.eat(".") {
                parts.push(Simple::Class(self.name()?));
                specificity[1] += 1;
            } else if self.eat("[") {
                parts.push(self.attribute()?);
                specificity[1] += 1;
            } else if self.eat("::") {
                self.name()?;
                parts.push(Simple::Never);
            } else if self.eat(":") {
                self.pseudo_class(&mut parts, specificity)?;
            } else {
                return (!parts.is_empty()).then_some(parts);
            }
        }
    }

    /// An attribute selector after its bracket.
    fn attribute(&mut self) -> Option<Simple> {
        self.skip_blanks();
        let mut name = self.name()?;
        if self.rest.starts_with('|') && !self.rest.starts_with("|=") {
            self.eat("|");
            name = self.name()?;
        }
        self.skip_blanks();
        let operators = [
            ("=", Comparison::Equals),
            ("~=", Comparison::HasWord),
            ("|=", Comparison::DashPrefix),
            ("^=", Comparison::Prefix),
            ("$=", Comparison::Suffix),
            ("*=", Comparison::Contains),
        ];
        let found = operators.into_iter().find(|(token, _)| self.eat(token));
        let Some((_, comparison)) = found else {
            let none = String::new();
            let exists =
                Simple::Attribute { name, comparison: Comparison::Exists, value: none, ignores_case: false };
            return self.eat("]").then_some(exists);
        };
        self.skip_blanks();
        let value = if let Some(quote) = self.rest.chars().next().filter(|c| matches!(c, '"' | '\'')) {
            let (value, after) = self.rest[1..].split_once(quote)?;
            self.rest = after;
            value.to_owned()
        } else {
            self.name()?
        };
        self.skip_blanks();
        let ignores_case = self.eat("i") || self.eat("I");
        let _ = self.eat("s") || self.eat("S");
        self.skip_blanks();
        self.eat("]").then_some(Simple::Attribute { name, comparison, value, ignores_case })
    }

    /// A pseudo-class after its colon.
    fn pseudo_class(&mut self, parts: &mut Vec<Simple>, specificity: &mut [usize; 3]) -> Option<()> {
        let name = self.name()?.to_ascii_lowercase();
        let argument = if self.rest.starts_with('(') {
            let end = closing(self.rest)?;
            let argument = self.rest[1..end].trim();
            self.rest = &self.rest[end + 1..];
            argument
        } else {
            ""
        };
        let nth = |step, offset, from_end, of_type| Simple::Nth { step, offset, from_end, of_type };
        let single = |name: &str| match name {
            "first-child" => Some(nth(0, 1, false, false)),
            "last-child" => Some(nth(0, 1, true, false)),
            "first-of-type" => Some(nth(0, 1, false, true)),
            "last-of-type" => Some(nth(0, 1, true, true)),
            _ => None,
        };
        match &name[..] {
            "root" => parts.push(Simple::Root),
            "empty" => parts.push(Simple::Empty),
            "first-child" | "last-child" | "first-of-type" | "last-of-type" => parts.extend(single(&name)),
            "only-child" => parts.extend([nth(0, 1, false, false), nth(0, 1, true, false)]),
            "only-of-type" => parts.extend([nth(0, 1, false, true), nth(0, 1, true, true)]),
            "nth-child" | "nth-last-child" | "nth-of-type" | "nth-last-of-type" => {
                let (step, offset) = progression(argument)?;
                parts.push(nth(step, offset, name.contains("last"), name.ends_with("type")));
            }
            "not" | "is" | "where" | "matches" => {
                let mut compounds = Vec::new();
                let mut heaviest = [0; 3];
                for one in argument.split(',') {
                    let mut inner = Parser { rest: one.trim() };
                    let mut weight = [0; 3];
                    // Lists inside lists would be split at the wrong commas.
                    if one.contains('(') {
                        return None;
                    }
                    compounds.push(inner.compound(&mut weight)?);
                    if !inner.rest.is_empty() {
                        return None;
                    }
                    heaviest = heaviest.max(weight);
                }
                parts.push(Simple::Is(compounds, name != "not"));
                for (sum, weight) in specificity.iter_mut().zip(heaviest) {
                    *sum += if name == "where" { 0 } else { weight };
                }
                return Some(());
            }
            "before" | "after" | "first-line" | "first-letter" | "hover" | "active" | "focus"
            | "focus-within" | "focus-visible" | "visited" | "target" | "target-within" | "checked"
            | "disabled" | "enabled" | "fullscreen" => parts.push(Simple::Never),
            _ => return None,
        }
        specificity[1] += 1;
        Some(())
    }
}

/// The place of the bracket that closes the first one.
fn closing(text: &str) -> Option<usize> {
    let mut depth = 0_usize;
    for (at, byte) in text.bytes().enumerate() {
        match byte {
            b'(' => depth += 1,
            b')' if depth == 1 => return Some(at),
            b')' => depth = depth.checked_sub(1)?,
            _ => {}
        }
    }
    None
}

/// Step and offset of `2n+1`, `odd`, `-n + 3`, `4`.
fn progression(text: &str) -> Option<(i64, i64)> {
    let text: String = text.to_ascii_lowercase().split_ascii_whitespace().collect();
    match &text[..] {
        "odd" => return Some((2, 1)),
        "even" => return Some((2, 0)),
        _ => {}
    }
    // Bounded, so that no sum overflows.
    let number = |text: &str| text.parse::<i32>().ok().map(i64::from);
    let Some((step, offset)) = text.split_once('n') else { return Some((0, number(&text)?)) };
    let step = match step {
        "" | "+" => 1,
        "-" => -1,
        step => number(step)?,
    };
    Some((step, if offset.is_empty() { 0 } else { number(offset)? }))
}

#[cfg(test)]
mod tests {
    use super::*;

    const XML: &str = "<svg><g id='g' class='a b'><path id='p1' d='M'/><rect id='r1'/><path id='p2' \
                       data-x='Layer-one' class='b'/><path id='1p'/></g></svg>";

    fn ids(selector: &str) -> Vec<&'static str> {
        let document = roxmltree::Document::parse(XML).unwrap();
        let selector = Selector::parse(selector).unwrap();
        let budget = Budget::new(10_000);
        let names = ["g", "p1", "r1", "p2", "1p"];
        names
            .into_iter()
            .filter(|name| {
                let node = document.descendants().find(|node| node.attribute("id") == Some(name)).unwrap();
                selector.matches(node, &budget)
            })
            .collect()
    }

    #[test]
    fn selectors_find_their_elements() {
        for (selector, expected) in [
            ("*", &["g", "p1", "r1", "p2", "1p"][..]),
            ("path", &["p1", "p2", "1p"]),
            ("svg|path", &["p1", "p2", "1p"]),
            ("#\\31 p", &["1p"]),
            (".a.b", &["g"]),
            ("g > .b", &["p2"]),
            ("svg path[d]", &["p1"]),
            ("rect ~ path", &["p2", "1p"]),
            ("rect + path", &["p2"]),
            ("[id^=p]", &["p1", "p2"]),
            ("[id$='1']", &["p1", "r1"]),
            ("[data-x*=yer]", &["p2"]),
            ("[data-x |= 'layer' i]", &["p2"]),
            ("[class~=b]", &["g", "p2"]),
            ("path:not(.b)", &["p1", "1p"]),
            (":is(rect, #p1)", &["p1", "r1"]),
            ("path:nth-child(2n+1)", &["p1", "p2"]),
            ("path:nth-of-type(2)", &["p2"]),
            ("path:nth-last-child(-n+2)", &["p2", "1p"]),
            ("path:last-child", &["1p"]),
            ("rect:only-of-type", &["r1"]),
            (":root > g", &["g"]),
            ("path:empty", &["p1", "p2", "1p"]),
            ("path:hover", &[]),
            ("path::before", &[]),
        ] {
            assert_eq!(ids(selector), expected, "{selector}");
        }
    }

    #[test]
    fn malformed_selectors_are_refused() {
        for selector in
            ["", ">", "a >", "a,b", "[x", "[x='", ":nope", ":not(a b)", ":nth-child(x)", "#", "a\\"]
        {
            assert!(Selector::parse(selector).is_none(), "{selector}");
        }
    }

    #[test]
    fn specificity_counts_ids_classes_and_types() {
        for (selector, expected) in [
            ("*", [0, 0, 0]),
            ("g path.a[d]:first-child", [0, 3, 2]),
            ("#a:not(.b, #c)", [2, 0, 0]),
            (":where(#a) g", [0, 0, 1]),
        ] {
            assert_eq!(Selector::parse(selector).unwrap().specificity, expected, "{selector}");
        }
    }
}
