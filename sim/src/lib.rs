//! Simulated sensors.
pub mod path;
pub mod pose;
pub mod random;
pub mod sensor;
pub mod tracer;
