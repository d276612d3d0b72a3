//! What the emulated plotter answers to the output instructions, `OA` to `OW`.

use super::execute::{Interpreter, Step};

impl Interpreter {
    /// The answer of `O` and this letter.
    pub(super) fn output(&mut self, letter: u8) -> Step {
        let rounded = |values: &[f64]| {
            let texts: Vec<String> = values.iter().map(|value| format!("{:.0}", value + 0.0)).collect();
            texts.join(",")
        };
        let [x, y] = self.at;
        let down = f64::from(u8::from(self.down));
        Step::answering(match letter {
            b'C' if self.scale.is_some() => {
                let [x, y] = self.user();
                format!("{x:.4},{y:.4},{down}")
            }
            b'E' => std::mem::take(&mut self.error).to_string(),
            b'F' => "40,40".to_owned(),
            b'H' => {
                let ([width, height], _) = self.paper();
                if self.turned {
                    rounded(&[0.0, 0.0, height, width])
                } else {
                    rounded(&[0.0, 0.0, width, height])
                }
            }
            b'I' => "7475A".to_owned(),
            b'O' => "0,1,0,0,1,0,0,0".to_owned(),
            b'P' => {
                self.points_changed = false;
                rounded(&self.points)
            }
            b'S' => {
                let bits = [
                    (1, self.down),
                    (2, self.points_changed),
                    (8, std::mem::take(&mut self.initialized)),
                    (16, !self.lever),
                    (32, self.error != 0),
                ];
                bits.iter().map(|(bit, set)| if *set { *bit } else { 0 }).sum::<u32>().to_string()
            }
            b'W' => {
                let ([width, height], _) = self.paper();
                rounded(&self.window.unwrap_or([0.0, 0.0, width, height]))
            }
            _ => rounded(&[x, y, down]),
        })
    }
}
