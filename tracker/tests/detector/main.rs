//! Detection: photographs, pictures whose truth is known, settings, nonsense.

#![allow(clippy::unwrap_used, clippy::expect_used, reason = "helpers of tests may panic")]

#[path = "../common/mod.rs"]
mod common;

mod garbage;
mod photographs;
mod settings;
mod synthetic;
