//! The camera models against closed forms, finite differences, OpenCV and hostile input.

#![expect(
    clippy::unwrap_used,
    clippy::panic,
    reason = "clippy knows only functions marked as tests as tests"
)]

mod cone;
mod file;
mod jacobians;
mod lenses;
mod peers;
mod round_trip;
mod wild;
