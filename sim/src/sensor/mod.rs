//! From light and distance to what a sensor delivers.
//!
//! | module | what it does |
//! | --- | --- |
//! | [`image`] | exposure, vignetting, noise, response, quantisation |
//! | [`white_balance`] | what a colour temperature does to the channels |
//! | [`encode`] | R′G′B′ codes or linear light to a pixel format |
//! | [`depth`] | a structured-light depth sensor |

pub mod depth;
pub mod encode;
pub mod image;
pub mod white_balance;

pub use depth::{DepthSensor, DepthSpec};
pub use encode::{EncodeError, FormatSpec};
pub use image::{Exposure, ImageSensor};
