//! Ground truth: what an image should have been, and how far another one is from it.
//!
//! | module | what it does |
//! | --- | --- |
//! | [`accel`] | rays against triangles, in the mixed and in the real world; watertight |
//! | [`surface`] | normals and material parameters at a hit |
//! | [`bsdf`] | Lambert, GGX, glTF, Phong, glass; absorption |
//! | [`emitter`] | sampling lights, environment and glowing surfaces |
//! | [`random`] | Owen-scrambled Sobol points |
//! | [`image_file`] | linear float images, single or layered, from and to EXR, Radiance HDR, PNG and JPEG |
//! | [`compare`] | RMSE, PSNR, SSIM and FLIP of two images, whole and per set of pixels; difference pictures |

pub mod accel;
pub mod bsdf;
pub mod compare;
pub mod emitter;
pub mod image_file;
pub mod random;
pub mod surface;
