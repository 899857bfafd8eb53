//! What a sensor would see: the interface to whatever computes light and distance.

use std::ops::Range;

use coshade_lens::calibration::Calibration;
use coshade_lens::model::ModelKind;
use coshade_reference::accel::Sees;
use glam::DVec3;
use nalgebra::Vector2;

use crate::pose::Rigid;

pub mod caustics;
pub mod paths;
pub mod room;

pub use paths::{PathTracer, TraceSpec};
pub use room::Room;

/// Some rows of a picture: a camera at a place.
#[derive(Clone, Debug)]
pub struct View<'a> {
    /// The lens and the size of the whole picture.
    pub calibration: &'a Calibration,
    /// Where the camera is. x right, y down, z forward.
    pub world_from_camera: Rigid,
    /// The rows that are wanted.
    pub rows: Range<u32>,
    /// The camera's image shows real things only; the truth to compare a composite with shows everything.
    pub sees: Sees,
}

/// Distance at a pixel's centre.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DepthSample {
    /// Along the optical axis, metres; for lenses wider than a pinhole, the distance from its centre. Infinite where there
    /// is nothing.
    pub z_m: f32,
    /// Cosine between the surface's normal and the direction to the camera, from 0 to 1.
    pub cos_incidence: f32,
}

impl DepthSample {
    /// Nothing there.
    pub const NOTHING: Self = Self { z_m: f32::INFINITY, cos_incidence: 0.0 };
}

/// Computes what a camera sees. Deterministic: the same view gives the same picture, whichever rows are asked for
/// together.
pub trait Tracer: Send + Sync {
    /// Radiance of each pixel of the rows, in the working space (1 = code white of the see-through camera at its
    /// calibration exposure), mean over the pixel's square; 0 where the lens sees nothing.
    fn radiance(&self, view: &View<'_>) -> Vec<[f32; 3]>;

    /// Distance at each pixel's centre.
    fn depth(&self, view: &View<'_>) -> Vec<DepthSample>;

    /// All that its pictures depend on beside the view: they are kept under this key.
    fn key(&self) -> String;
}

/// A ray of a camera in world coordinates.
#[derive(Clone, Copy, Debug)]
pub struct ViewRay {
    /// The camera's centre.
    pub origin: DVec3,
    /// Unit length.
    pub direction: DVec3,
    /// What a metre along the ray counts in the picture's depth.
    pub depth_per_m: f64,
}

impl View<'_> {
    /// The ray through a position (camera coordinates: pixel centres are at whole numbers); `None` outside the lens' cone or
    /// its image circle.
    pub fn ray(&self, x_px: f64, y_px: f64) -> Option<ViewRay> {
        let position = Vector2::new(x_px, y_px);
        let local = self.calibration.model.unproject(&position)?;
        let angle_rad = local.x.hypot(local.y).atan2(local.z);
        let circle = self.calibration.image_circle.unwrap_or_default();
        if !circle.contains(coshade_lens::pixel::CameraPx(position), angle_rad) {
            return None;
        }
        let local = DVec3::new(local.x, local.y, local.z).try_normalize()?;
        let depth_per_m = if self.depth_is_range() { 1.0 } else { local.z };
        let direction = self.world_from_camera.rotation * local;
        Some(ViewRay { origin: self.world_from_camera.position_m, direction, depth_per_m })
    }

    /// Width of the picture, pixels.
    pub fn width_px(&self) -> u32 {
        self.calibration.size_px[0]
    }

    /// True for lenses that see sideways: their depth is the distance from the camera's centre.
    pub fn depth_is_range(&self) -> bool {
        match self.calibration.model.kind() {
            ModelKind::Pinhole | ModelKind::BrownConrady5 | ModelKind::Rational8 => false,
            ModelKind::KannalaBrandt4 | ModelKind::DoubleSphere | ModelKind::Eucm => true,
        }
    }

    /// `of(column, row)` for each pixel of the rows, computed in parallel.
    pub fn each_pixel<T: Send>(&self, of: impl Fn(u32, u32) -> T + Sync) -> Vec<T> {
        use rayon::prelude::*;
        let (of, width) = (&of, self.width_px());
        self.rows.clone().into_par_iter().flat_map_iter(|y| (0..width).map(move |x| of(x, y))).collect()
    }
}
