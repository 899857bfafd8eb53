//! What one camera does to light: where a point lands on the sensor, and what code value its radiance becomes.
//!
//! Data and evaluation only; the solvers that find the numbers live in `coshade-calib`.

pub mod calibration;
mod calibration_mistake;
mod calibration_provenance;
mod calibration_scale;
pub mod model;
pub mod noise;
pub mod octahedral;
pub mod pixel;
pub mod raster;
mod raster_camera;
mod raster_pinhole;
mod raster_sphere;
pub mod remap;
mod remap_clip;
mod remap_outline;
pub mod response;
pub mod vignetting;
