//! The wgpu renderer. So far: what graphics adapters this machine has.

pub mod adapter;
