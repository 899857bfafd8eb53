//! Ground truth: what an image should have been, and how far another one is from it.
//!
//! | module | what it does |
//! | --- | --- |
//! | [`accel`] | rays against triangles, in the mixed and in the real world; watertight |
//! | [`surface`] | normals and material parameters at a hit |
//! | [`bsdf`] | Lambert, GGX, glTF, Phong, glass; absorption |
//! | [`emitter`] | sampling lights, environment and glowing surfaces |
//! | [`random`] | Owen-scrambled Sobol points |
//! | [`camera`] | rays of a lens at a place |
//! | [`differential`] | the real and the mixed world, and what a path brings to each |
//! | [`integrator`] | the differential path tracer |
//! | [`photon`] | caustics by progressive photon mapping |
//! | [`film`] | the picture with its layers |
//! | [`job`] | rendering a picture: threads, passes, shards, limits |
//! | [`mitsuba`] | a scene for the Mitsuba 3 renderer |
//! | [`compare`] | RMSE, PSNR, SSIM and FLIP of two images, whole and per set of pixels; difference pictures |

pub mod accel;
pub mod bsdf;
pub mod camera;
pub mod compare;
pub mod differential;
pub mod emitter;
pub mod film;
pub mod integrator;
pub mod job;
pub mod mitsuba;
pub mod photon;
pub mod random;
pub mod surface;
