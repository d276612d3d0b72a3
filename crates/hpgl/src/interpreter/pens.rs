//! Pen settings: `VS FS AS PW PC WU`.

use std::collections::{BTreeMap, BTreeSet};

use super::{Interpreter, PenSelection};
use crate::codes;
use crate::document::PenSettings;
use drawing::Pen;

/// Settings for all pens, and for single ones.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Pens {
    all: PenSettings,
    single: BTreeMap<Pen, PenSettings>,
    /// Pen widths are in percent of the diagonal between P1 and P2 instead of mm.
    relative_widths: bool,
    /// What the pens that drew had, on this page.
    used: BTreeMap<Pen, PenSettings>,
    /// Nothing has changed since the last ink.
    noted: bool,
    /// The file gives pen 0 a colour: it is a pen like the others.
    pub(super) zero_draws: bool,
    palette: Palette,
    /// Pens that were white when they drew.
    white_drawn: BTreeSet<Pen>,
}

/// The colours of pens that `PC` states.
#[derive(Clone, Debug, PartialEq)]
struct Palette {
    /// Red, green and blue of black and of white (`CR`).
    black: [f64; 3],
    white: [f64; 3],
    /// Pens that `PC` makes white.
    white_pens: BTreeSet<Pen>,
    /// The colours of the others.
    colors: BTreeMap<Pen, [u8; 3]>,
}

impl Default for Palette {
    fn default() -> Self {
        Self { black: [0.0; 3], white: [255.0; 3], white_pens: BTreeSet::new(), colors: BTreeMap::new() }
    }
}

impl Palette {
    /// A colour in steps of 1/255 between black and white.
    fn color(&self, rgb: [f64; 3]) -> [u8; 3] {
        std::array::from_fn(|at| {
            let range = self.white[at] - self.black[at];
            let part = if range == 0.0 { 0.0 } else { (rgb[at] - self.black[at]) / range };
            (255.0 * part).round().clamp(0.0, 255.0) as u8
        })
    }

    fn forget(&mut self, pen: Pen) {
        self.white_pens.remove(&pen);
        self.colors.remove(&pen);
    }
}

impl Pens {
    /// Settings may have changed: the next ink looks them up again.
    pub(super) fn touch(&mut self) {
        self.noted = false;
    }

    /// The settings of the pens that drew since this was last asked.
    pub(super) fn take_used(&mut self) -> BTreeMap<Pen, PenSettings> {
        self.noted = false;
        std::mem::take(&mut self.used)
    }

    /// Whether nothing has changed since the last ink.
    #[inline]
    pub(super) fn are_noted(&self) -> bool {
        self.noted
    }

    /// Records the settings of a pen that draws; its colours before and now if they differ.
    fn note(&mut self, pen: Pen) -> Option<[[u8; 3]; 2]> {
        let now = self.single.get(&pen).copied().unwrap_or(self.all);
        let now = PenSettings { color: self.palette.colors.get(&pen).copied(), ..now };
        let before = self.used.get(&pen).and_then(|before| before.color);
        let colors = before.zip(now.color).filter(|(before, now)| before != now);
        self.used
            .entry(pen)
            .and_modify(|before| {
                // A plan has one speed per pen: the lowest that the file sets.
                let least = |a: Option<f64>, b: Option<f64>| a.into_iter().chain(b).reduce(f64::min);
                *before = PenSettings {
                    speed_mm_s: least(before.speed_mm_s, now.speed_mm_s),
                    force: least(before.force, now.force),
                    acceleration: least(before.acceleration, now.acceleration),
                    width_mm: now.width_mm.or(before.width_mm),
                    color: now.color.or(before.color),
                };
            })
            .or_insert(now);
        self.noted = true;
        colors.map(|(before, now)| [before, now])
    }

    /// Changes a setting of one pen, or of all.
    fn set(&mut self, pen: Option<f64>, change: impl Fn(&mut PenSettings)) {
        self.noted = false;
        match pen {
            Some(pen) if (1.0..=f64::from(u16::MAX)).contains(&pen) => {
                change(self.single.entry(Pen(pen as u16)).or_insert(self.all));
            }
            Some(_) => {}
            None => {
                change(&mut self.all);
                self.single.values_mut().for_each(change);
            }
        }
    }
}

impl Interpreter {
    /// Records the settings of the pen that draws now.
    pub(super) fn note_pen(&mut self) {
        if !self.pens.noted
            && let PenSelection::Holds(pen) = self.pen_selection
        {
            if let Some(colors) = self.pens.note(Pen(pen)) {
                let [before, now] = colors.map(|[r, g, b]| format!("#{r:02x}{g:02x}{b:02x}"));
                self.report(codes::PEN_RECOLORED, || {
                    format!("pen {pen} was {before} and is {now} now: a pen has one colour, the last one")
                });
            }
            self.report_white_pen(Pen(pen));
        }
    }

    /// `VS`: speed in cm/s.
    pub(super) fn pen_speed(&mut self, p: &[f64]) {
        let speed = p.first().filter(|&&cm_s| cm_s > 0.0).map(|cm_s| cm_s * 10.0);
        self.pens.set(p.get(1).copied(), |settings| settings.speed_mm_s = speed);
    }

    /// `FS`: force, in the plotter's own steps.
    pub(super) fn pen_force(&mut self, p: &[f64]) {
        let force = p.first().copied();
        self.pens.set(p.get(1).copied(), |settings| settings.force = force);
    }

    /// `AS`: acceleration, in the plotter's own steps.
    pub(super) fn pen_acceleration(&mut self, p: &[f64]) {
        let acceleration = p.first().copied();
        self.pens.set(p.get(1).copied(), |settings| settings.acceleration = acceleration);
    }

    /// `PW`: width, in mm or in the unit of `WU`.
    pub(super) fn pen_width(&mut self, p: &[f64]) {
        let (p1, p2) = self.frame.points();
        let unit = if self.pens.relative_widths {
            (p2 - p1).hypot2().sqrt() * self.frame.unit_mm() / 100.0
        } else {
            1.0
        };
        let width = p.first().filter(|&&width| width > 0.0).map(|width| width * unit);
        self.pens.set(p.get(1).copied(), |settings| settings.width_mm = width);
        self.apply_line_type();
    }

    /// `CR`: the values of red, green and blue that are black and white.
    pub(super) fn colour_range(&mut self, p: &[f64]) {
        let palette = &mut self.pens.palette;
        (palette.black, palette.white) = match *p {
            [r0, r1, g0, g1, b0, b1, ..] => ([r0, g0, b0], [r1, g1, b1]),
            _ => (Palette::default().black, Palette::default().white),
        };
    }

    /// `PC`: a colour of the palette. White is the colour of the paper, as that of pen 0 is by default.
    pub(super) fn pen_colour(&mut self, p: &[f64]) {
        let palette = &mut self.pens.palette;
        let white = palette.white;
        let is_white = |colour: &[f64]| colour.iter().zip(white).all(|(value, white)| *value >= white);
        match *p {
            [] => {
                palette.white_pens.clear();
                palette.colors.clear();
            }
            [pen, ..] if !(0.0..=f64::from(u16::MAX)).contains(&pen) => {}
            [0.0, red, green, blue, ..] => {
                if !is_white(&[red, green, blue]) {
                    palette.colors.insert(Pen(0), palette.color([red, green, blue]));
                    self.pens.zero_draws = true;
                    if self.pen_selection == PenSelection::Empty {
                        self.hold(0);
                    }
                }
            }
            [pen, red, green, blue, ..] if is_white(&[red, green, blue]) => {
                palette.forget(Pen(pen as u16));
                palette.white_pens.insert(Pen(pen as u16));
            }
            [pen, red, green, blue, ..] => {
                palette.forget(Pen(pen as u16));
                palette.colors.insert(Pen(pen as u16), palette.color([red, green, blue]));
            }
            [pen, ..] => palette.forget(Pen(pen as u16)),
        }
        self.pens.touch();
    }

    /// The default palette again.
    pub(super) fn reset_palette(&mut self) {
        self.pens.palette = Palette::default();
    }

    /// Reports that a pen draws which is white.
    fn report_white_pen(&mut self, pen: Pen) {
        if self.pens.palette.white_pens.contains(&pen) && self.pens.white_drawn.insert(pen) {
            self.report(codes::WHITE_PEN, String::new);
        }
    }

    /// Names all white pens in the diagnostic about them.
    pub(super) fn name_white_pens(&mut self) {
        let pens: Vec<String> = self.pens.white_drawn.iter().map(|pen| pen.0.to_string()).collect();
        self.findings.recode(codes::WHITE_PEN, codes::WHITE_PEN, || match &pens[..] {
            [pen] => format!("pen {pen} is white (PC), but its ink is drawn"),
            _ => format!("pens {} are white (PC), but their ink is drawn", pens.join(", ")),
        });
    }

    /// The pens that were white when they drew.
    pub(super) fn white_pens(&self) -> Vec<Pen> {
        self.pens.white_drawn.iter().copied().collect()
    }

    /// Gives what pen 0 drew to the first pen that draws nothing else.
    pub(super) fn number_pen_zero(&mut self) {
        let used: BTreeSet<Pen> = self.pages.iter().flat_map(|page| page.drawing.pens()).collect();
        if !used.contains(&Pen(0)) {
            return;
        }
        let number = (1..=u16::MAX).find(|&number| !used.contains(&Pen(number))).unwrap_or(1);
        for page in &mut self.pages {
            page.drawing.strokes.change_pens(|pen| Some(if pen == Pen(0) { Pen(number) } else { pen }));
            let settings = page.pens.remove(&Pen(0));
            page.pens.extend(settings.map(|settings| (Pen(number), settings)));
        }
        let message = move || format!("the file gives pen 0 a colour: it is drawn as pen {number}");
        if self.findings.has(codes::PEN_PUT_AWAY) {
            self.findings.recode(codes::PEN_PUT_AWAY, codes::PEN_ZERO_DRAWS, message);
        } else {
            self.report(codes::PEN_ZERO_DRAWS, message);
        }
    }

    /// `WU`: what widths are measured in; widths set before are forgotten.
    pub(super) fn width_unit(&mut self, p: &[f64]) {
        self.pens.relative_widths = p.first() == Some(&1.0);
        self.pens.set(None, |settings| settings.width_mm = None);
        self.apply_line_type();
    }
}
