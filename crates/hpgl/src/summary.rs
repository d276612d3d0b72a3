//! What a file consists of, and the plotter it was read for.

use drawing::{Pen, Point, Rect};

use crate::mnemonic::Mnemonic;

/// What a file consists of, and the plotter it was read for.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Summary {
    /// How many commands it has, known ones and unknown ones.
    pub commands: usize,
    /// The known commands in it, each with how often it occurs, in the order of the alphabet.
    pub used: Vec<(Mnemonic, u64)>,
    /// What stands around the commands.
    pub wrappers: Wrappers,
    /// The plotter that it was read for.
    pub profile: Profile,
    /// The pens that `PC` had made white when they drew, in the order of their numbers.
    pub white_pens: Vec<Pen>,
}

impl Summary {
    /// The generation of the language: that of the newest command in it.
    pub fn generation(&self) -> Generation {
        let second = self.used.iter().any(|(mnemonic, _)| is_second_generation(*mnemonic));
        if second || self.wrappers.pcl { Generation::HpGl2 } else { Generation::HpGl }
    }
}

/// Whether a command is of HP-GL/2 and not of HP-GL. `PS`, `PG`, `SM` and the like are of both.
pub(crate) fn is_second_generation(mnemonic: Mnemonic) -> bool {
    const SECOND: [&[u8; 2]; 26] = [
        b"AC", b"AD", b"BP", b"BR", b"BZ", b"CF", b"CO", b"CR", b"DL", b"FI", b"FN", b"LA", b"LM", b"MG",
        b"NP", b"PC", b"PE", b"PP", b"PW", b"QL", b"SB", b"SD", b"SV", b"TD", b"TR", b"WU",
    ];
    SECOND.contains(&&mnemonic.0)
}

/// A generation of the language.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Generation {
    /// HP-GL, of pen plotters since 1976.
    HpGl,
    /// HP-GL/2, of large plotters and printers since 1988.
    HpGl2,
}

/// What stands around the commands of a file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Wrappers {
    /// Device control of plotters on a serial line (`ESC .`).
    pub device_control: bool,
    /// The printer language PCL, or RTL, its raster part for plotters (`ESC %0B` and others).
    pub pcl: bool,
    /// Job control (`@PJL`).
    pub job_control: bool,
}

/// The plotter that a file was read for.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Profile {
    /// P1 and P2 as long as no `IP` sets them, plotter units.
    pub scaling_points: (Point, Point),
    /// The area that the pen reaches, plotter units.
    pub hard_clip: Rect,
    /// Size of a plotter unit, mm.
    pub unit_mm: f64,
    /// Why this one.
    pub reason: ProfileReason,
}

/// Why a file was read for a plotter.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ProfileReason {
    /// The file does not identify its plotter.
    #[default]
    Assumed,
    /// The options name it.
    Options,
    /// The file names its paper by a code (`PS4`).
    PaperCode,
    /// The file is HP-GL/2, where P1 and P2 are the corners of the page.
    HpGl2,
    /// The file gives the size of its page (`PS` with lengths).
    PageSize,
    /// The file gives the size of a picture frame in PCL.
    PictureFrame,
}
