//! Options of reading a drawing.

use clap::{Args, ValueEnum};
use compiler::import;
use compiler::layout::{Copies, Crop};

use super::values::{crop, dpi, grid, hatch, length, name, page, pen_pair};

/// How a drawing's file is read.
#[derive(Debug, Args)]
pub(crate) struct Reading {
    /// Which page of the file to take, from 1; with `convert`, `all` writes one file for each page [default: the first,
    /// with a warning if there are more]
    #[arg(long, value_name = "N|all", value_parser = page)]
    pub(crate) page: Option<PageChoice>,
    /// Plotter that the file was made for (see `plotplan explain plotters`) [default: from the file]. With `convert --format
    /// hpgl`: the plotter to write for, or a TOML file with its limits
    #[arg(long, value_name = "NAME")]
    pub(crate) plotter: Option<String>,
    /// Plotter and paper that the file was made for, where --plotter is another one
    #[arg(long, value_name = "NAME[,PAPER]")]
    pub(crate) made_for: Option<String>,
    /// The sheet on the machine: A4, A3,landscape, letter or 200x300mm. With --plotter: the paper of that plotter
    #[arg(long, value_name = "PAPER", value_parser = name())]
    pub(crate) paper: Option<String>,
    /// HP-GL: draw the ink of pens that the file makes white (PC), or leave it out
    #[arg(long, value_name = "HOW", value_enum, default_value_t = WhitePens::Draw)]
    pub(crate) white_pens: WhitePens,
    /// SVG: how pens are numbered
    #[arg(long, value_enum, default_value_t = Pens::Layers)]
    pub(crate) pens: Pens,
    /// SVG: hatch filled areas with lines this far apart, at this angle (0deg if not given)
    #[arg(long, value_name = "SPACING[,ANGLE]", value_parser = hatch)]
    pub(crate) hatch: Option<import::Hatch>,
    /// SVG: draw the outlines of shapes that have a fill but no stroke
    #[arg(long)]
    pub(crate) outline_fills: bool,
    /// SVG: how text is drawn
    #[arg(long, value_enum, default_value_t = TextForm::Strokes)]
    pub(crate) text: TextForm,
    /// With --text outlines: a font file to use instead of the system's fonts
    #[arg(long, value_name = "FILE")]
    pub(crate) font: Vec<String>,
    /// SVG: pixels per inch; 96, or 72 for old files of Illustrator, if not given
    #[arg(long, value_name = "NUMBER", value_parser = dpi)]
    pub(crate) dpi: Option<f64>,
    #[command(flatten)]
    pub(crate) layout: Layout,
    /// Treat warnings as errors
    #[arg(long)]
    pub(crate) strict: bool,
}

/// A page of a drawing's file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum PageChoice {
    /// The page of this number, from 1.
    Number(usize),
    /// All pages, each on its own.
    All,
}

/// What is drawn of a drawing.
#[derive(Debug, Args)]
pub(crate) struct Layout {
    /// Draw only these pens, by their numbers in the file
    #[arg(long, value_name = "PEN,PEN,...", value_delimiter = ',', value_parser = clap::value_parser!(u16).range(1..))]
    pub(crate) only_pens: Option<Vec<u16>>,
    /// Renumber pens: the file's pen OLD becomes pen NEW
    #[arg(long, value_name = "OLD=NEW,...", value_delimiter = ',', value_parser = pen_pair)]
    pub(crate) pen_map: Vec<(u16, u16)>,
    /// Repeat the drawing in a grid of columns and rows, such as 3x2
    #[arg(long, value_name = "COLUMNSxROWS", value_parser = grid)]
    pub(crate) copies: Option<(u16, u16)>,
    /// Distance between the copies
    #[arg(long, value_name = "LENGTH", default_value = "0mm", value_parser = length, allow_negative_numbers = true)]
    pub(crate) gap: f64,
    /// Cut the placed drawing at the edges of the sheet, or of a window X,Y,W,H from the sheet's lower-left corner
    #[arg(long, value_name = "sheet|X,Y,W,H", value_parser = crop, allow_hyphen_values = true)]
    pub(crate) crop: Option<Crop>,
}

impl Layout {
    /// The same for the compiler.
    pub(crate) fn to_layout(&self) -> compiler::layout::Layout {
        compiler::layout::Layout {
            only_pens: self.only_pens.clone(),
            pen_map: self.pen_map.clone(),
            copies: self.copies.map(|(columns, rows)| Copies { columns, rows, gap_mm: self.gap }),
            crop: self.crop,
        }
    }
}

impl Reading {
    /// The page to take; the first unless another one was asked for.
    pub(crate) fn page(&self) -> PageChoice {
        self.page.unwrap_or(PageChoice::Number(1))
    }

    /// The options of the drawing's importer.
    pub(crate) fn options(&self, fonts: Option<import::Fonts>) -> import::Options {
        let made_for = self.made_for.as_ref().map(|text| match text.split_once(',') {
            Some((plotter, paper)) => (plotter.to_owned(), Some(paper.to_owned())),
            None => (text.clone(), None),
        });
        let by_plotter = || self.plotter.as_ref().map(|plotter| (plotter.clone(), self.paper.clone()));
        let (plotter, paper) = made_for.or_else(by_plotter).unzip();
        import::Options {
            fonts,
            plotter,
            paper: paper.flatten(),
            skip_white_pens: self.white_pens == WhitePens::Skip,
            svg: import::SvgOptions {
                pens: match self.pens {
                    Pens::Layers => import::PenRule::Layers,
                    Pens::Colors => import::PenRule::Colors,
                    Pens::One => import::PenRule::One,
                },
                hatch: self.hatch,
                outline_fills: self.outline_fills,
                dpi: self.dpi,
            },
        }
    }
}

/// What is done with the ink of white pens.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum WhitePens {
    /// It is drawn, with a warning
    Draw,
    /// It is left out
    Skip,
}

/// How the text of an SVG file is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum TextForm {
    /// In the built-in stroke font: the same everywhere
    Strokes,
    /// As outlines of the system's fonts, or of --font
    Outlines,
}

/// How the pens of an SVG file are numbered.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Pens {
    /// By the number that a layer's name begins with, other layers in their order; by colour without layers
    Layers,
    /// By colour, in order of appearance
    #[value(alias = "colours")]
    Colors,
    /// Pen 1 for everything
    One,
}
