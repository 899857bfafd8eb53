//! Whole-system tests and benchmarks; here is what several of them share.

pub mod tracking;
pub mod truth_case;

pub use truth_case::{PixelSet, TruthCase, TruthCaseError};
