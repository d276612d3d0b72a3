//! What a machine drew, in its own units.

use kinematics::Play;

/// Lines of ink in the order in which they were drawn.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Ink {
    lines: Vec<(u16, Vec<[f64; 2]>)>,
    down: bool,
    /// The play between the motors and the pen.
    play: Option<Play>,
}

impl Ink {
    /// Of a machine with this play: places are where its motors are, and its ink is where they lead the pen.
    pub fn through(play: Option<Play>) -> Self {
        Self { play, ..Self::default() }
    }

    fn load(&mut self, motors: [f64; 2]) -> [f64; 2] {
        self.play.as_mut().map_or(motors, |play| {
            play.follow(motors);
            play.loads()
        })
    }

    /// The pen is in this state (0 is up) at this place.
    pub fn pen(&mut self, pen: u16, at: [f64; 2]) {
        let at = self.load(at);
        let current = self.lines.last().map_or(0, |line| line.0);
        if pen == 0 {
            self.down = false;
        } else if !self.down || current != pen {
            self.lines.push((pen, vec![at]));
            self.down = true;
        }
    }

    /// The pen goes straight to this place.
    pub fn go(&mut self, to: [f64; 2]) {
        let to = self.load(to);
        if self.down
            && let Some((_, places)) = self.lines.last_mut()
            && places.last() != Some(&to)
        {
            places.push(to);
        }
    }

    /// The ink of rows of ticks, as their motors would draw it.
    pub fn of_rows(rows: &[plan::Row]) -> Self {
        let mut ink = Self::default();
        for pair in rows.windows(2) {
            let [from, to] = [pair[0], pair[1]].map(|row| row.ticks.map(|ticks| ticks as f64));
            ink.pen(pair[0].pen, from);
            ink.go(to);
        }
        ink
    }

    /// Pen and places of each line. A line that begins where the one before ended with the same pen is one with it: the
    /// pen was lifted in place.
    pub fn lines(&self) -> Vec<(u16, Vec<[f64; 2]>)> {
        let mut lines: Vec<(u16, Vec<[f64; 2]>)> = Vec::new();
        for (pen, places) in &self.lines {
            match lines.last_mut() {
                Some((before, line)) if before == pen && line.last() == places.first() => {
                    line.extend_from_slice(&places[1..]);
                }
                _ => lines.push((*pen, places.clone())),
            }
        }
        lines
    }

    /// Takes up what another machine, or the same at another time, drew after this.
    pub fn append(&mut self, other: &Self) {
        self.lines.extend(other.lines.iter().cloned());
        self.down = other.down;
    }
}
