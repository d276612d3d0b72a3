//! Media queries: which rules hold for a drawing as a browser shows it on a screen.

/// Whether rules for a list of media queries hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Media {
    Holds,
    Other,
    /// It depends on something that a drawing does not have, such as the width of a window.
    Unknown,
}

/// What a list of media queries asks for: the type `screen`, a light colour scheme, no animation.
pub(crate) fn of(list: &str) -> Media {
    if list.trim().is_empty() {
        return Media::Holds;
    }
    let mut result = Media::Other;
    for query in list.split(',') {
        match of_query(query) {
            Media::Holds => return Media::Holds,
            Media::Unknown => result = Media::Unknown,
            Media::Other => {}
        }
    }
    result
}

fn of_query(query: &str) -> Media {
    let query = query.trim().to_ascii_lowercase();
    let (negated, query) = match query.strip_prefix("not ") {
        Some(rest) => (true, rest.trim()),
        None => (false, query.strip_prefix("only ").unwrap_or(&query).trim()),
    };
    let mut result = Media::Holds;
    for part in query.split(" and ") {
        let part = match part.trim() {
            "all" | "screen" => Media::Holds,
            "print" | "speech" | "tty" | "tv" | "projection" | "handheld" | "braille" | "embossed"
            | "aural" => Media::Other,
            other => match other.strip_prefix('(').and_then(|inside| inside.strip_suffix(')')) {
                Some(feature) => of_feature(feature),
                None => Media::Unknown,
            },
        };
        result = match (result, part) {
            (Media::Other, _) | (_, Media::Other) => Media::Other,
            (Media::Unknown, _) | (_, Media::Unknown) => Media::Unknown,
            _ => Media::Holds,
        };
    }
    match (negated, result) {
        (true, Media::Holds) => Media::Other,
        (true, Media::Other) => Media::Holds,
        (_, result) => result,
    }
}

fn of_feature(feature: &str) -> Media {
    let (name, value) = feature.split_once(':').unwrap_or((feature, ""));
    let holds = match (name.trim(), value.trim()) {
        ("prefers-color-scheme", "light" | "no-preference")
        | ("prefers-reduced-motion", "" | "reduce")
        | ("color", "")
        | ("scripting" | "forced-colors" | "inverted-colors", "none") => true,
        ("prefers-color-scheme", "dark")
        | ("prefers-reduced-motion", "no-preference")
        | ("monochrome", "")
        | ("forced-colors", "active")
        | ("scripting", "enabled") => false,
        _ => return Media::Unknown,
    };
    if holds { Media::Holds } else { Media::Other }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn media_queries_of_a_screen() {
        for (list, expected) in [
            ("", Media::Holds),
            ("all", Media::Holds),
            ("screen", Media::Holds),
            ("only screen", Media::Holds),
            ("print", Media::Other),
            ("print, Screen", Media::Holds),
            ("not print", Media::Holds),
            ("not screen", Media::Other),
            ("(prefers-color-scheme: dark)", Media::Other),
            ("screen and (prefers-color-scheme:light)", Media::Holds),
            ("print and (min-width: 5px)", Media::Other),
            ("(min-width: 600px)", Media::Unknown),
            ("screen and (min-width: 600px), print", Media::Unknown),
            ("not all and (monochrome)", Media::Holds),
        ] {
            assert_eq!(of(list), expected, "{list}");
        }
    }
}
