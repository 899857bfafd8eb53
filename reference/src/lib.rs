//! Ground truth: what an image should have been, and how far another one is from it.
//!
//! | module | what it does |
//! | --- | --- |
//! | [`image_file`] | linear float images, single or layered, from and to EXR, Radiance HDR, PNG and JPEG |
//! | [`compare`] | RMSE, PSNR, SSIM and FLIP of two images, whole and per set of pixels; difference pictures |

pub mod compare;
pub mod image_file;
