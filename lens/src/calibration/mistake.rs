//! What is wrong with a value of a calibration.

use std::fmt;

/// A value that is not allowed: where it is, what it is, what it may be.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Mistake {
    /// The way to the value from the top of the calibration: keys, and indices of lists counted from 0.
    pub key: Vec<String>,
    /// What is wrong.
    pub message: String,
    /// What is allowed.
    pub allowed: &'static str,
}

impl Mistake {
    pub(crate) fn new(key: &[&str], message: String, allowed: &'static str) -> Self {
        Self { key: key.iter().map(|step| (*step).to_owned()).collect(), message, allowed }
    }

    /// The same seen from one level up.
    pub(crate) fn below(mut self, key: &str) -> Self {
        self.key.insert(0, key.to_owned());
        self
    }
}

impl fmt::Display for Mistake {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {} (allowed: {})", self.key.join("."), self.message, self.allowed)
    }
}
