//! The raster of a real camera's image.

use nalgebra::{Rotation3, Vector2, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::calibration::Mistake;
use crate::model::CameraModel;
use crate::pixel::{CameraPx, RasterPx};
use crate::raster::{RasterError, check_rotation, check_size, quad_solid_angle_sr};

/// Which part of the image the lens fills. Give a circle in pixels, a largest angle, or both; what lies outside of
/// either counts as not seen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ImageCircle {
    /// Centre of the circle in pixels, x right and y down; the centre of the first pixel is at [0, 0]. Needs
    /// `radius_px`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub center_px: Option<[f64; 2]>,
    /// Radius of the circle in pixels, greater than 0. Needs `center_px`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub radius_px: Option<f64>,
    /// Largest angle from the optical axis that is used, in degrees, more than 0 up to 180: half the field of view.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub max_angle_deg: Option<f64>,
}

const CIRCLE: &str = "center_px and radius_px together, or neither";

impl ImageCircle {
    /// The first mistake, or `None`.
    pub fn mistake(&self) -> Option<Mistake> {
        let out_of_range =
            |key, value, allowed| Some(Mistake::new(&[key], format!("`{value}` is out of range"), allowed));
        match (self.center_px, self.radius_px) {
            (None, Some(_)) => return Some(Mistake::new(&["center_px"], "missing".to_owned(), CIRCLE)),
            (Some(_), None) => return Some(Mistake::new(&["radius_px"], "missing".to_owned(), CIRCLE)),
            _ => {}
        }
        if let Some(center) = self.center_px.filter(|center| !center.iter().all(|c| c.abs() < 1e6)) {
            return out_of_range("center_px", format!("{center:?}"), "two numbers between −1e6 and 1e6");
        }
        if let Some(radius) = self.radius_px.filter(|radius| !(*radius > 0.0 && *radius < 1e6)) {
            return out_of_range("radius_px", radius.to_string(), "more than 0 and less than 1e6");
        }
        let angle = self.max_angle_deg.filter(|angle| !(*angle > 0.0 && *angle <= 180.0))?;
        out_of_range("max_angle_deg", angle.to_string(), "more than 0 and at most 180")
    }

    /// Whether a position in camera coordinates, seen `angle_rad` off the axis, is inside.
    pub fn contains(&self, position: CameraPx, angle_rad: f64) -> bool {
        let in_circle = match (self.center_px, self.radius_px) {
            (Some(center), Some(radius)) => (position.0 - Vector2::from(center)).norm() <= radius,
            _ => true,
        };
        in_circle && self.max_angle_deg.is_none_or(|max| angle_rad <= max.to_radians())
    }
}

/// The image of a camera with a lens.
#[derive(Clone, Debug)]
pub struct CameraRaster {
    model: CameraModel,
    size_px: [u32; 2],
    circle: ImageCircle,
    camera_from_frame: Rotation3<f64>,
}

/// Beyond this angle between neighbouring corners a pixel's edges are not straight enough for one quadrilateral.
const STRAIGHT_RAD: f64 = 0.02;
const MAX_STEPS: u32 = 32;
/// Positions beyond this say nothing about where the image lies, and would cost precision.
const MAX_POSITION_PX: f64 = 1e9;

impl CameraRaster {
    /// The raster of a camera whose axes (x right, y down, z forward) are turned by `camera_from_frame`.
    ///
    /// # Errors
    /// A size of 0 or beyond [`crate::raster::MAX_SIDE_PX`], a mistake in the image circle, a matrix that is no
    /// rotation.
    pub fn new(
        model: CameraModel,
        size_px: [u32; 2],
        circle: ImageCircle,
        camera_from_frame: Rotation3<f64>,
    ) -> Result<Self, RasterError> {
        check_size(size_px)?;
        check_rotation(&camera_from_frame)?;
        if let Some(mistake) = circle.mistake() {
            return Err(RasterError::Circle(mistake));
        }
        Ok(Self { model, size_px, circle, camera_from_frame })
    }

    /// Width and height in pixels.
    pub fn size_px(&self) -> [u32; 2] {
        self.size_px
    }

    /// The unit direction, in the shared frame, of a raster position; `None` outside the lens' valid cone or the
    /// image circle.
    pub fn direction(&self, position: RasterPx) -> Option<Vector3<f64>> {
        let camera_px = position.to_camera();
        let ray = self.model.unproject(&camera_px.0)?;
        let seen = ray.iter().all(|c| c.is_finite()) && self.circle.contains(camera_px, off_axis_rad(&ray));
        seen.then(|| self.camera_from_frame.inverse_transform_vector(&ray))
    }

    /// The raster position of a direction, maybe outside the image; `None` outside the lens' valid cone or the image
    /// circle.
    pub fn position(&self, direction: &Vector3<f64>) -> Option<RasterPx> {
        let ray = self.camera_from_frame * direction;
        let camera_px = CameraPx(self.model.project(&ray)?);
        let bounded = camera_px.0.iter().all(|c| c.abs() < MAX_POSITION_PX);
        (bounded && self.circle.contains(camera_px, off_axis_rad(&ray))).then(|| camera_px.to_raster())
    }

    /// The solid angles of the pixels of some rows in steradian; 0 where one of the corners has no direction.
    pub(crate) fn rows_solid_angles_sr(&self, rows: std::ops::Range<u32>) -> Vec<f64> {
        let corner = |x: u32, y: u32| self.direction(RasterPx::new(f64::from(x), f64::from(y)));
        let corners = |y: u32| (0..=self.size_px[0]).map(|x| corner(x, y)).collect::<Vec<_>>();
        let mut solid_angles = Vec::with_capacity(self.size_px[0] as usize * rows.len());
        let mut top = corners(rows.start);
        for y in rows {
            let bottom = corners(y + 1);
            let pairs = (0_u32..).zip(top.windows(2).zip(bottom.windows(2)));
            solid_angles.extend(pairs.map(|(x, (top, bottom))| match (top, bottom) {
                ([Some(a), Some(b)], [Some(d), Some(c)]) => self.pixel_solid_angle_sr(x, y, [a, b, c, d]),
                _ => 0.0,
            }));
            top = bottom;
        }
        solid_angles
    }

    fn pixel_solid_angle_sr(&self, x: u32, y: u32, [a, b, c, d]: [&Vector3<f64>; 4]) -> f64 {
        let longest = (a - c).norm().max((b - d).norm());
        if longest < STRAIGHT_RAD {
            quad_solid_angle_sr([a, b, c, d])
        } else {
            self.divided_solid_angle_sr(x, y, (longest / STRAIGHT_RAD).ceil())
        }
    }

    /// The solid angle of one wide pixel, as the sum over `steps`² parts.
    fn divided_solid_angle_sr(&self, x: u32, y: u32, steps: f64) -> f64 {
        let steps = (steps as u32).clamp(2, MAX_STEPS);
        let at = |i: u32, j: u32| {
            let fraction = |k: u32| f64::from(k) / f64::from(steps);
            self.direction(RasterPx::new(f64::from(x) + fraction(i), f64::from(y) + fraction(j)))
        };
        let part = |i: u32, j: u32| {
            let corners = (at(i, j)?, at(i + 1, j)?, at(i + 1, j + 1)?, at(i, j + 1)?);
            Some(quad_solid_angle_sr([&corners.0, &corners.1, &corners.2, &corners.3]))
        };
        (0..steps).flat_map(|j| (0..steps).map(move |i| (i, j))).filter_map(|(i, j)| part(i, j)).sum()
    }
}

fn off_axis_rad(ray: &Vector3<f64>) -> f64 {
    ray.x.hypot(ray.y).atan2(ray.z)
}
