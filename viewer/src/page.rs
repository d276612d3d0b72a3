//! The page: markup, style, scripts and a plan in one file.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use sha2::{Digest as _, Sha256};

use crate::Columns;
use crate::linker::{Module, link};

/// The modules of the viewer; each after those that it imports.
pub(crate) const MODULES: &[Module] = &[
    ("format", include_str!("../js/format.js")),
    ("dom", include_str!("../js/dom.js")),
    ("colors", include_str!("../js/colors.js")),
    ("columns", include_str!("../js/columns.js")),
    ("machine", include_str!("../js/machine.js")),
    ("plan", include_str!("../js/plan.js")),
    ("source", include_str!("../js/source.js")),
    ("picture", include_str!("../js/picture.js")),
    ("scrubber", include_str!("../js/scrubber.js")),
    ("strips", include_str!("../js/strips.js")),
    ("panels", include_str!("../js/panels.js")),
    ("viewer", include_str!("../js/viewer.js")),
    ("boot", include_str!("../js/boot.js")),
];

const MARKUP: &str = include_str!("../index.html");
const STYLE: &str = include_str!("../style.css");
const CHART: &str = include_str!("../vendor/uplot/uPlot.iife.min.js");
const CHART_STYLE: &str = include_str!("../vendor/uplot/uPlot.min.css");
const CHART_LICENCE: &str = include_str!("../vendor/uplot/LICENSE");

/// The viewer with a plan. `meta` is a JSON object: what the rows do not tell. Its form and the
/// columns' names are those that `js/viewer.js` reads; `compiler::view` makes both.
pub fn page(title: &str, meta: &str, columns: &Columns) -> String {
    let style = format!("{CHART_STYLE}\n{STYLE}");
    let chart = format!("/*\n{CHART_LICENCE}*/\n{CHART}");
    let script = link(MODULES);
    let policy = format!(
        "default-src 'none'; script-src {} {}; style-src {}; base-uri 'none'; form-action 'none'",
        hash(&chart),
        hash(&script),
        hash(&style)
    );
    // In JSON `<` stands in strings only; escaped, nothing in it can end the element.
    let meta = meta.replace('<', "\\u003c");
    let title = title.replace('&', "&amp;").replace('<', "&lt;");
    let columns = columns.base64();
    format!(
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta http-equiv=\"Content-Security-Policy\" content=\"{policy}\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <title>{title}</title>\n<style>{style}</style>\n</head>\n<body>\n\
         <noscript><p>This page draws the plan with JavaScript, which is switched off here.</p></noscript>\n\
         {MARKUP}\
         <script type=\"application/json\" id=\"plan-meta\">{meta}</script>\n\
         <script type=\"text/plain\" id=\"plan-columns\">{columns}</script>\n\
         <script>{chart}</script>\n<script>{script}</script>\n</body>\n</html>\n"
    )
}

/// The source of a policy that allows exactly this text.
fn hash(text: &str) -> String {
    format!("'sha256-{}'", STANDARD.encode(Sha256::digest(text.as_bytes())))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The texts of the elements of this name.
    fn elements<'a>(html: &'a str, open: &str, close: &str) -> Vec<&'a str> {
        html.split(open).skip(1).map(|rest| rest.split_once(close).unwrap().0).collect()
    }

    #[test]
    fn policy_names_the_hashes_of_all_that_runs() {
        let html = page("a", "{}", &Columns::default());
        let policy = elements(&html, "Content-Security-Policy\" content=\"", "\"")[0];
        let scripts = elements(&html, "<script>", "</script>");
        let styles = elements(&html, "<style>", "</style>");
        assert_eq!((scripts.len(), styles.len()), (2, 1));
        for text in scripts.iter().chain(&styles) {
            assert!(policy.contains(&hash(text)));
        }
        assert!(!policy.contains("unsafe"));
        // Nothing inside ends an element early, and the markup has no styles or handlers of its own.
        assert_eq!(html.matches("</script>").count(), 4);
        assert!(!MARKUP.contains(" style=") && !MARKUP.contains(" onclick="));
    }

    #[test]
    fn page_names_no_address_that_could_be_loaded() {
        let html = page("a", "{}", &Columns::default());
        for attribute in ["src=", "href=", "url(", "@import"] {
            assert!(!html.contains(attribute), "{attribute}");
        }
    }

    #[test]
    fn texts_of_a_plan_cannot_end_their_element() {
        let html =
            page("</title><b>", "{\"title\":\"</script><script>alert(1)</script>\"}", &Columns::default());
        assert!(html.contains("<title>&lt;/title>&lt;b>") || html.contains("<title>&lt;/title&gt;"));
        assert_eq!(html.matches("alert(1)").count(), 1);
        assert!(html.contains("\\u003c/script>\\u003cscript>alert(1)"));
    }
}
