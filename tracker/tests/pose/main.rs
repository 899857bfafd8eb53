//! Poses from corners: of single tags, of bodies, of moving ones, through wide lenses, and from nonsense.

#![allow(clippy::unwrap_used, reason = "helpers of tests panic as tests do")]

mod ambiguity;
mod bodies;
mod garbage;
mod planar;
mod rolling;
mod support;
