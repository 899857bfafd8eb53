//! Poses from corners: of single tags, of bodies, of moving ones, through wide lenses, and from nonsense.

mod ambiguity;
mod bodies;
mod garbage;
mod planar;
mod rolling;
mod support;
