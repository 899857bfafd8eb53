//! Detection: photographs, pictures whose truth is known, settings, nonsense.

#[path = "../common/mod.rs"]
mod common;

mod garbage;
mod photographs;
mod settings;
mod synthetic;
