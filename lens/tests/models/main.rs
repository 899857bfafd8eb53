//! The camera models against closed forms, finite differences, OpenCV and hostile input.

mod cone;
mod file;
mod jacobians;
mod lenses;
mod peers;
mod round_trip;
mod wild;
