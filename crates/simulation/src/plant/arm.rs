//! The inertia of a two-link arm with its DC motors: M(q) with Coriolis and centrifugal terms.
//!
//! With the absolute link angles `q = (theta, psi)` and `beta = psi - theta` (the usual two-link
//! dynamics, e.g. M. Spong, S. Hutchinson, M. Vidyasagar: "Robot Modeling and Control", in absolute
//! angles, in the plane of the sheet, so without gravity):
//!
//! ```text
//! | A          B cos beta | theta''     | -B sin beta psi'^2   |
//! | B cos beta C          | psi''    +  |  B sin beta theta'^2 |  =  C^T tau
//!
//! A = I1 + m1 c1^2 + (m_e + m2 + m_p) l1^2,  C = I2 + m2 c2^2 + m_p l2^2,  B = l1 (m2 c2 + m_p l2)
//! ```
//!
//! `C` on the right is the coupling matrix, `tau` the torque of the motors on their rows of `z = C q`:
//! `tau_i = k_i (w_i - friction) - J_i z_i''`, see [`DcMotor`](super::DcMotor) for `w` and friction.
//! The equations are solved in `z`, so that stiction acts on each motor; Runge-Kutta of order 4.

use nalgebra::{Matrix2, Vector2};

use super::{DcParameters, Plant, STEP_S, STICTION_BAND_TICKS_S};

/// Mass and its distribution in one link.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LinkInertia {
    /// Mass, kg.
    pub mass_kg: f64,
    /// Distance of the centre of mass from the link's own joint, m.
    pub center_m: f64,
    /// Moment of inertia about the centre of mass, kg m².
    pub inertia_kg_m2: f64,
}

/// The masses of a two-link arm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ArmInertia {
    /// Lengths of the links, m.
    pub lengths_m: [f64; 2],
    /// The links.
    pub links: [LinkInertia; 2],
    /// Mass at the elbow, kg.
    pub elbow_mass_kg: f64,
    /// Mass at the pen, kg.
    pub pen_mass_kg: f64,
}

impl ArmInertia {
    /// The constants `A`, `B`, `C` of the mass matrix, kg m².
    pub fn constants(&self) -> [f64; 3] {
        let [l1, l2] = self.lengths_m;
        let [first, second] = self.links;
        let about_joint =
            |link: &LinkInertia| link.inertia_kg_m2 + link.mass_kg * link.center_m * link.center_m;
        let carried = self.elbow_mass_kg + second.mass_kg + self.pen_mass_kg;
        [
            about_joint(&first) + carried * l1 * l1,
            l1 * (second.mass_kg * second.center_m + self.pen_mass_kg * l2),
            about_joint(&second) + self.pen_mass_kg * l2 * l2,
        ]
    }
}

/// A motor of the arm: its parameters and how its ticks belong to the arm's angles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ArmMotor {
    /// Parameters with torque and inertia.
    pub parameters: DcParameters,
    /// Ticks per rad of the motor's row of `C q`; negative for a motor that counts the other way.
    pub ticks_per_rad: f64,
    /// Ticks where the row is 0.
    pub offset_ticks: f64,
    /// The row of the coupling matrix.
    pub row: [f64; 2],
}

/// Positions (rad) and speeds (rad/s) of the motors' rows.
type State = (Vector2<f64>, Vector2<f64>);

/// Whether a motor is at rest within a step, or the direction of the friction on it.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Contact {
    Stuck,
    /// Friction acts against this sign.
    Slides(f64),
}

/// A two-link arm with two DC motors, under duties in percent.
#[derive(Clone, Debug)]
pub struct Arm {
    motors: [ArmMotor; 2],
    constants: [f64; 3],
    to_joints: Matrix2<f64>,
    /// Inertia of the motors themselves.
    own: Matrix2<f64>,
    z: Vector2<f64>,
    rate: Vector2<f64>,
}

impl Arm {
    /// An arm at rest with its motors at these ticks; `None` for a singular coupling.
    pub fn new(inertia: &ArmInertia, motors: [ArmMotor; 2], ticks: [f64; 2]) -> Option<Self> {
        let coupling = Matrix2::from_fn(|row, column| motors[row].row[column]);
        let own = motors.map(|motor| motor.parameters.inertia_kg_m2);
        let z = |index: usize| (ticks[index] - motors[index].offset_ticks) / motors[index].ticks_per_rad;
        Some(Self {
            constants: inertia.constants(),
            to_joints: coupling.try_inverse()?,
            own: Matrix2::from_diagonal(&Vector2::from(own)),
            z: Vector2::new(z(0), z(1)),
            rate: Vector2::zeros(),
            motors,
        })
    }

    /// The same at these speeds of the motors, ticks/s.
    #[must_use]
    pub fn at_speeds(mut self, speeds: [f64; 2]) -> Self {
        self.rate = Vector2::from_fn(|index, _| speeds[index] / self.motors[index].ticks_per_rad);
        self
    }

    /// Kinetic energy of links, masses and motors, J.
    pub fn kinetic_energy(&self) -> f64 {
        let (mass, _) = self.dynamics(&(self.z, self.rate));
        0.5 * self.rate.dot(&(mass * self.rate))
    }

    /// Mass matrix and velocity terms in the motors' rows: `C^-T M C^-1 + J` and `C^-T h`.
    fn dynamics(&self, (z, rate): &State) -> (Matrix2<f64>, Vector2<f64>) {
        let [a, b, c] = self.constants;
        let q = self.to_joints * z;
        let speed = self.to_joints * rate;
        let (sin, cos) = libm::sincos(q[1] - q[0]);
        let mass = Matrix2::new(a, b * cos, b * cos, c);
        let bias = Vector2::new(-b * sin * speed[1] * speed[1], b * sin * speed[0] * speed[0]);
        let transposed = self.to_joints.transpose();
        (transposed * mass * self.to_joints + self.own, transposed * bias)
    }

    /// Torque of the motors on their rows without friction, N m.
    fn drive(&self, duties: [f64; 2], rate: &Vector2<f64>) -> Vector2<f64> {
        Vector2::from_fn(|index, _| {
            let motor = &self.motors[index];
            let p = &motor.parameters;
            let left = duties[index] - rate[index] * motor.ticks_per_rad / p.speed_per_duty_ticks_s;
            let left = left.clamp(-p.current_limit_percent, p.current_limit_percent);
            let viscous =
                0.01 * p.viscous_percent * rate[index] * motor.ticks_per_rad / p.speed_per_duty_ticks_s;
            p.torque_per_duty_nm * (left - viscous) * motor.ticks_per_rad.signum()
        })
    }

    /// Accelerations with these contacts, and the torque that friction must give at stuck motors.
    fn accelerations(
        &self,
        state: &State,
        duties: [f64; 2],
        contacts: [Contact; 2],
    ) -> (Vector2<f64>, Vector2<f64>) {
        let (mass, bias) = self.dynamics(state);
        let mut torque = self.drive(duties, &state.1) - bias;
        for (index, contact) in contacts.iter().enumerate() {
            if let Contact::Slides(sign) = contact {
                let p = &self.motors[index].parameters;
                torque[index] -= p.friction_percent * p.torque_per_duty_nm * sign;
            }
        }
        let stuck = contacts.map(|contact| contact == Contact::Stuck);
        let acceleration = match stuck {
            [true, true] => Vector2::zeros(),
            [true, false] => Vector2::new(0.0, torque[1] / mass.m22),
            [false, true] => Vector2::new(torque[0] / mass.m11, 0.0),
            [false, false] => {
                let determinant = mass.determinant();
                Vector2::new(
                    (mass.m22 * torque[0] - mass.m12 * torque[1]) / determinant,
                    (mass.m11 * torque[1] - mass.m21 * torque[0]) / determinant,
                )
            }
        };
        (acceleration, mass * acceleration - torque)
    }

    /// Which motors stay at rest: all that are slow, less those whose friction would have to exceed
    /// their stiction, the one that exceeds it most first.
    fn contacts(&self, duties: [f64; 2]) -> [Contact; 2] {
        let mut contacts = [0, 1].map(|index: usize| {
            let slow =
                self.rate[index].abs() * self.motors[index].ticks_per_rad.abs() < STICTION_BAND_TICKS_S;
            if slow && self.motors[index].parameters.stiction_percent > 0.0 {
                Contact::Stuck
            } else {
                Contact::Slides(sign(self.rate[index]))
            }
        });
        for _ in 0..2 {
            let (_, needed) = self.accelerations(&(self.z, self.rate), duties, contacts);
            let excess = [0, 1].map(|index: usize| {
                let p = &self.motors[index].parameters;
                needed[index].abs() - p.stiction_percent * p.torque_per_duty_nm
            });
            let worst = usize::from(
                contacts[0] != Contact::Stuck || (contacts[1] == Contact::Stuck && excess[1] > excess[0]),
            );
            if contacts[worst] != Contact::Stuck || excess[worst] <= 0.0 {
                break;
            }
            contacts[worst] = Contact::Slides(-sign(needed[worst]));
        }
        contacts
    }

    /// Runge-Kutta of order 4 over `dt`.
    fn integrated(&self, duties: [f64; 2], contacts: [Contact; 2], dt: f64) -> State {
        let (z, v) = (self.z, self.rate);
        let at = |state: &State| self.accelerations(state, duties, contacts).0;
        let (k1, w1) = (at(&(z, v)), v);
        let w2 = v + 0.5 * dt * k1;
        let k2 = at(&(z + 0.5 * dt * w1, w2));
        let w3 = v + 0.5 * dt * k2;
        let k3 = at(&(z + 0.5 * dt * w2, w3));
        let w4 = v + dt * k3;
        let k4 = at(&(z + dt * w3, w4));
        (z + dt / 6.0 * (w1 + 2.0 * w2 + 2.0 * w3 + w4), v + dt / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4))
    }

    /// One step, divided where a motor comes to rest: friction changes its sign there.
    fn step(&mut self, duties: [f64; 2]) {
        /// Parts of a step: two motors come to rest at most twice each.
        const PARTS: u32 = 4;
        let mut left = STEP_S;
        for part in 1..=PARTS {
            let contacts = self.contacts(duties);
            for (index, contact) in contacts.iter().enumerate() {
                if *contact == Contact::Stuck {
                    self.rate[index] = 0.0;
                }
            }
            let (z, rate) = self.integrated(duties, contacts, left);
            let stops = |index: usize| {
                let brakes = self.motors[index].parameters.friction_percent > 0.0;
                let share = self.rate[index] / (self.rate[index] - rate[index]);
                (brakes && self.rate[index] * rate[index] < 0.0).then_some((share, index))
            };
            let first = [stops(0), stops(1)].into_iter().flatten().min_by(|a, b| a.0.total_cmp(&b.0));
            let Some((share, index)) = first.filter(|_| part < PARTS) else {
                (self.z, self.rate) = (z, rate);
                return;
            };
            (self.z, self.rate) = self.integrated(duties, contacts, share * left);
            self.rate[index] = 0.0;
            left *= 1.0 - share;
        }
    }
}

/// -1, 0 or 1.
fn sign(value: f64) -> f64 {
    if value == 0.0 { 0.0 } else { value.signum() }
}

impl Plant for Arm {
    fn advance(&mut self, commands: [f64; 2], steps: u32) {
        for _ in 0..steps {
            self.step(commands);
        }
    }

    fn positions(&self) -> [f64; 2] {
        [0, 1].map(|index: usize| {
            self.motors[index].ticks_per_rad * self.z[index] + self.motors[index].offset_ticks
        })
    }

    fn speeds(&self) -> [f64; 2] {
        [0, 1].map(|index: usize| self.motors[index].ticks_per_rad * self.rate[index])
    }

    fn currents_a(&self, duties: [f64; 2]) -> [f64; 2] {
        let speeds = self.speeds();
        [0, 1].map(|index: usize| {
            let p = &self.motors[index].parameters;
            let left = duties[index] - speeds[index] / p.speed_per_duty_ticks_s;
            p.current_per_duty_a * left.clamp(-p.current_limit_percent, p.current_limit_percent)
        })
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::super::{DcMotor, DcSheet, Motor as _};
    use super::*;

    fn inertia() -> ArmInertia {
        let link = |mass_kg: f64, length: f64| LinkInertia {
            mass_kg,
            center_m: 0.5 * length,
            inertia_kg_m2: mass_kg * length * length / 12.0,
        };
        ArmInertia {
            lengths_m: [0.206, 0.256],
            links: [link(0.12, 0.206), link(0.09, 0.256)],
            elbow_mass_kg: 0.05,
            pen_mass_kg: 0.06,
        }
    }

    fn motor(parameters: DcParameters, row: [f64; 2]) -> ArmMotor {
        ArmMotor { parameters, ticks_per_rad: 3200.0 / TAU, offset_ticks: 0.0, row }
    }

    fn sheet() -> DcParameters {
        let sheet = DcSheet {
            supply_v: 12.0,
            resistance_ohm: 2.4,
            torque_constant_nm_a: 0.0115,
            inertia_kg_m2: 1e-6,
            load_inertia_kg_m2: 0.0,
            gear: 50.0,
            current_limit_a: f64::INFINITY,
            ticks_per_rad: 3200.0 / TAU,
        };
        sheet.parameters()
    }

    #[test]
    fn energy_of_the_free_arm_is_constant() {
        // No torque, no friction, motors without inertia: kinetic energy is all there is.
        let free = DcParameters { torque_per_duty_nm: 0.0, ..DcParameters::first_order(1.0, 1.0) };
        for row in [[0.0, -1.0], [-1.0, 1.0]] {
            let motors = [motor(free, [1.0, 0.0]), motor(free, row)];
            let mut arm = Arm::new(&inertia(), motors, [800.0, 100.0]).unwrap().at_speeds([4000.0, -2500.0]);
            let before = arm.kinetic_energy();
            let (mut low, mut high) = (before, before);
            for _ in 0..1000 {
                arm.advance([0.0; 2], 50);
                low = low.min(arm.kinetic_energy());
                high = high.max(arm.kinetic_energy());
            }
            assert!(before > 0.01 && (high - low) / before < 1e-6, "{before} {low} {high}");
        }
    }

    #[test]
    fn stuck_arm_below_stiction_stays_although_the_other_motor_moves() {
        let p = sheet().with_friction(8.0, 6.0);
        let motors = [motor(p, [1.0, 0.0]), motor(p, [0.0, -1.0])];
        let mut arm = Arm::new(&inertia(), motors, [800.0, 0.0]).unwrap();
        arm.advance([8.0, 0.0], 5000);
        assert_eq!(arm.speeds(), [0.0, 0.0]);
        arm.advance([8.1, 0.0], 5000);
        let moved = arm.positions();
        assert!(moved[0] > 810.0, "{moved:?}");
        assert!((moved[1]).abs() < 1e-6, "{moved:?}");
    }

    #[test]
    fn arm_without_masses_is_a_pair_of_independent_motors() {
        let p = sheet().with_friction(8.0, 6.0);
        let motors = [motor(p, [1.0, 0.0]), motor(p, [0.0, 1.0])];
        let none = ArmInertia {
            lengths_m: [0.2, 0.2],
            links: [LinkInertia::default(); 2],
            elbow_mass_kg: 0.0,
            pen_mass_kg: 0.0,
        };
        let mut arm = Arm::new(&none, motors, [0.0; 2]).unwrap();
        let mut single = DcMotor::new(p, 0.0);
        for duty in [50.0, 20.0, -30.0, 7.0, 100.0] {
            arm.advance([duty, duty], 400);
            single.advance(duty, 400);
            for (a, b) in arm.positions().into_iter().zip([single.position(); 2]) {
                assert!((a - b).abs() < 0.05, "{a} {b} at {duty}");
            }
        }
    }
}
