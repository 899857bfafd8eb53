//! Every sampler against its density.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "tests")]

mod bsdfs;
mod chi2;
mod lights;
