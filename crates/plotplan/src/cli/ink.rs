//! What the colour of ink shows.

use std::ffi::OsString;

use clap::ValueEnum;
use compiler::view::ColorBy;

/// What the colour of ink shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum InkColor {
    /// The pen
    Pen,
    /// The speed of the pen
    Speed,
    /// What limits the speed: the pen, a motor's speed, acceleration or jerk
    Limit,
    /// The distance from the drawing
    Deviation,
    /// The order in which it is drawn
    Order,
}

impl From<InkColor> for ColorBy {
    fn from(color: InkColor) -> Self {
        match color {
            InkColor::Pen => Self::Pen,
            InkColor::Speed => Self::Speed,
            InkColor::Limit => Self::Limit,
            InkColor::Deviation => Self::Deviation,
            InkColor::Order => Self::Order,
        }
    }
}

/// `preview --color NAME` is `--color-by NAME` where the name is no choice of the global `--color`, which is
/// for messages.
pub(crate) fn with_ink_color(arguments: impl Iterator<Item = OsString>) -> Vec<OsString> {
    let mut arguments: Vec<OsString> = arguments.collect();
    if !arguments.iter().any(|word| word == "preview") {
        return arguments;
    }
    let is_ink = |name: &str| InkColor::from_str(name, false).is_ok();
    for index in 1..arguments.len() {
        let next = arguments.get(index + 1).and_then(|word| word.to_str());
        if arguments[index] == "--color" && next.is_some_and(is_ink) {
            arguments[index] = "--color-by".into();
        } else if let Some(name) = arguments[index].to_str().and_then(|word| word.strip_prefix("--color="))
            && is_ink(name)
        {
            arguments[index] = format!("--color-by={name}").into();
        }
    }
    arguments
}

#[cfg(test)]
mod tests {
    use super::*;

    fn translated(words: &str) -> String {
        let words = with_ink_color(words.split(' ').map(OsString::from));
        words.iter().map(|word| word.to_string_lossy()).collect::<Vec<_>>().join(" ")
    }

    #[test]
    fn color_of_ink_and_color_of_messages_are_told_apart() {
        assert_eq!(
            translated("plotplan preview a -o b.svg --color speed"),
            "plotplan preview a -o b.svg --color-by speed"
        );
        assert_eq!(translated("plotplan preview a --color=limit"), "plotplan preview a --color-by=limit");
        for same in [
            "plotplan preview a --color never",
            "plotplan preview a --color=auto",
            "plotplan check a --color speed",
        ] {
            assert_eq!(translated(same), same);
        }
    }
}
