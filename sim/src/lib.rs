//! Simulated sensors: a described world, seen by described cameras, with all their errors and the truth beside them.
//!
//! | module | what is there |
//! | --- | --- |
//! | [`world`] | the world file: scene, sensors, faults, the way of the rig |
//! | [`path`], [`pose`] | smooth ways through keyframes |
//! | [`tracer`] | what a sensor would see: the path tracer, and a room of closed forms |
//! | [`sensor`] | light to code values, distance to depth counts |
//! | [`timing`], [`rolling_shutter`] | when rows are exposed and what stamps say |
//! | [`faults`] | what goes wrong, and when |
//! | [`device`] | any frame of a sensor, and the truth about it |
//! | [`camera`] | the sensor as a [`coshade_capture::Camera`] |
//! | [`source`] | `sim:world.toml#camera` |
//! | [`recording`] | all sensors into one recording |
//! | [`cache`] | traced pictures, kept by a hash of what they depend on |
//! | [`random`] | noise that depends on seed, frame and pixel alone |

pub mod cache;
pub mod camera;
mod controls;
pub mod device;
pub mod faults;
pub mod path;
pub mod pose;
pub mod random;
pub mod recording;
pub mod rolling_shutter;
pub mod sensor;
pub mod source;
pub mod timing;
pub mod tracer;
pub mod world;

pub use camera::{Pace, SimCamera};
pub use device::{Progress, SimSensor};
pub use recording::{Recording, SimulateError, Simulated};
pub use world::{World, WorldError, WorldSpec};
