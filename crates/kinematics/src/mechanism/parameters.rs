//! Mechanisms from named parameters: what the `[geometry]` table of a machine file holds.

use std::sync::Arc;

use drawing::Point;

use super::Mechanism;

/// Named values with units, from which a mechanism is made. A reader of machine files implements it.
pub trait Parameters {
    /// The length of this name, mm.
    ///
    /// # Errors
    /// When it is missing or not a length.
    fn length_mm(&mut self, key: &'static str) -> Result<f64, ParameterError>;

    /// The length of this name, mm; `None` where it is not given.
    ///
    /// # Errors
    /// When it is not a length.
    fn optional_length_mm(&mut self, key: &'static str) -> Result<Option<f64>, ParameterError>;

    /// The point of this name, machine mm.
    ///
    /// # Errors
    /// When it is missing or not two lengths.
    fn point_mm(&mut self, key: &'static str) -> Result<Point, ParameterError>;

    /// Which of `choices` the parameter of this name is, as an index.
    ///
    /// # Errors
    /// When it is missing or none of them.
    fn choice(
        &mut self,
        key: &'static str,
        choices: &'static [&'static str],
    ) -> Result<usize, ParameterError>;
}

/// Why parameters do not make a mechanism.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ParameterError {
    /// A parameter is missing.
    #[error("missing field `{key}`")]
    Missing {
        /// Its name.
        key: &'static str,
    },
    /// A parameter is none of the values that it may have.
    #[error("unknown variant `{value}`, expected {}", choices.iter().map(|choice| format!("`{choice}`")).collect::<Vec<_>>().join(" or "))]
    NotAChoice {
        /// Its name.
        key: &'static str,
        /// What it is.
        value: String,
        /// What it may be.
        choices: &'static [&'static str],
    },
    /// A parameter's value cannot be read as the quantity that it must be.
    #[error("{key}: {reason}")]
    Unreadable {
        /// Its name.
        key: &'static str,
        /// What is wrong with it.
        reason: String,
    },
}

/// A kind of mechanism that can be made from parameters.
#[derive(Clone, Copy, Debug)]
pub struct Kind {
    /// Its name.
    pub name: &'static str,
    /// The names of its parameters.
    pub parameters: &'static [&'static str],
    build: Constructor,
}

type Constructor = fn(&mut dyn Parameters) -> Result<Arc<dyn Mechanism>, ParameterError>;

/// A mechanism that machine files can describe.
pub(super) trait FromParameters: Mechanism + Sized + 'static {
    const KIND: &'static str;
    const PARAMETERS: &'static [&'static str];

    fn from_parameters(parameters: &mut dyn Parameters) -> Result<Self, ParameterError>;
}

impl PartialEq for Kind {
    fn eq(&self, other: &Self) -> bool {
        self.name == other.name
    }
}

impl Kind {
    pub(super) const fn of<M: FromParameters>() -> Self {
        Self {
            name: M::KIND,
            parameters: M::PARAMETERS,
            build: |parameters| Ok(Arc::new(M::from_parameters(parameters)?)),
        }
    }

    /// The mechanism of this kind with these parameters. Its dimensions are checked when a machine
    /// is made of it.
    ///
    /// # Errors
    /// When a parameter is missing or cannot be read.
    pub fn mechanism(&self, parameters: &mut dyn Parameters) -> Result<Arc<dyn Mechanism>, ParameterError> {
        (self.build)(parameters)
    }
}
