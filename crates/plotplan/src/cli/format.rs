//! Formats of outputs, by their names and extensions.

use std::path::Path;
use std::sync::LazyLock;

use backends::Backend;
use clap::ValueEnum;
use clap::builder::PossibleValue;

/// What convert writes.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Format {
    /// A firmware's format
    Backend(&'static dyn Backend),
    /// A table of ticks against time
    Csv,
    /// A plan document with machine, settings and certificate
    Json,
    /// The drawing as understood, as clean HP-GL
    Hpgl,
    /// The drawing as understood, as SVG in mm
    Svg,
}

impl Format {
    fn name_and_help(self) -> Option<(&'static str, &'static str)> {
        Some(match self {
            Self::Backend(backend) => (backend.name(), backend.format_help()?),
            Self::Csv => ("csv", "A table of ticks against time"),
            Self::Json => ("json", "A plan document with machine, settings and certificate"),
            Self::Hpgl => ("hpgl", "The drawing as understood, as clean HP-GL"),
            Self::Svg => ("svg", "The drawing as understood, as SVG in mm"),
        })
    }
}

impl Default for Format {
    /// Tick lines.
    fn default() -> Self {
        Self::value_variants()[0]
    }
}

impl Format {
    /// Whether files of this format hold a plan for one machine.
    pub(crate) fn needs_machine(self) -> bool {
        !matches!(self, Self::Hpgl | Self::Svg)
    }

    pub(crate) fn name(self) -> &'static str {
        self.name_and_help().map_or("", |(name, _)| name)
    }

    /// The format that files with the extension of this name hold; `None` for names without one, and
    /// for extensions that leave the format open.
    pub(crate) fn of_extension(output: &str) -> Option<Self> {
        let extension = Path::new(output).extension()?.to_str()?.to_ascii_lowercase();
        match extension.as_str() {
            "ticks" => Some(Self::default()),
            "csv" => Some(Self::Csv),
            "json" => Some(Self::Json),
            "hpgl" | "plt" => Some(Self::Hpgl),
            "svg" => Some(Self::Svg),
            _ => None,
        }
    }

    /// Whether a file of that extension cannot hold this format. Some firmwares' formats are CSV or
    /// JSON, too.
    pub(super) fn contradicts(self, by_extension: Self) -> bool {
        let is_firmwares = matches!(self, Self::Backend(_)) && self.name() != "ticks";
        let is_table = matches!(by_extension, Self::Csv | Self::Json);
        self.name() != by_extension.name() && !(is_firmwares && is_table)
    }
}

impl ValueEnum for Format {
    fn value_variants<'a>() -> &'a [Self] {
        static ALL: LazyLock<Vec<Format>> = LazyLock::new(|| {
            let written = backends::ALL.iter().copied().filter(|backend| backend.format_help().is_some());
            let mut all: Vec<Format> = written.map(Format::Backend).collect();
            // After the tick lines.
            all.splice(1..1, [Format::Csv, Format::Json]);
            all.extend([Format::Hpgl, Format::Svg]);
            all
        });
        &ALL
    }

    fn to_possible_value(&self) -> Option<PossibleValue> {
        self.name_and_help().map(|(name, help)| PossibleValue::new(name).help(help))
    }
}
