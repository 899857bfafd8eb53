//! The differential path tracer against closed forms, quadratures, and itself by other ways.
//!
//! Pictures are judged by their film's own variance: a mean must be within 3 standard errors of the expected value (plus
//! a stated bound on what the scene itself is off, such as a sphere of triangles), and the standard error must be small
//! enough for that to mean something. Seeds are fixed.
#![allow(clippy::unwrap_used, reason = "helpers of tests")]

mod agreement;
mod differential;
mod furnace;
mod glass;
mod job;
mod lights;
mod studio;
