//! What one camera does to light: where a point lands on the sensor, and what code value its radiance becomes.
//!
//! Data and evaluation only; the solvers that find the numbers live in `coshade-calib`.

pub mod calibration;
pub mod model;
pub mod noise;
pub mod octahedral;
pub mod pixel;
pub mod raster;
pub mod remap;
pub mod response;
pub mod vignetting;
