//! The raster of an undistorted perspective view.

use nalgebra::{Rotation3, Vector2, Vector3};

use crate::pixel::{CameraPx, RasterPx};
use crate::raster::{RasterError, check_rotation, check_size};

/// The smallest cosine between a direction and the optical axis that has a position: 89.99994° off the axis.
const MIN_COS: f64 = 1e-6;

/// A pinhole view: virtual views, overscan images, undistorted photographs.
#[derive(Clone, Debug)]
pub struct PinholeRaster {
    size_px: [u32; 2],
    focal_px: Vector2<f64>,
    center: RasterPx,
    view_from_frame: Rotation3<f64>,
}

impl PinholeRaster {
    /// A view with focal lengths `focal_px` (fx, fy) and principal point `center`, in camera coordinates (the
    /// OpenCV convention; axes x right, y down, z forward).
    ///
    /// # Errors
    /// A size of 0 or beyond [`crate::raster::MAX_SIDE_PX`], focal lengths that are not positive, a principal point
    /// that is not finite, a matrix that is no rotation.
    pub fn new(
        size_px: [u32; 2],
        focal_px: [f64; 2],
        center: CameraPx,
        view_from_frame: Rotation3<f64>,
    ) -> Result<Self, RasterError> {
        check_size(size_px)?;
        check_rotation(&view_from_frame)?;
        if !focal_px.iter().all(|f| (1e-3..1e9).contains(f)) {
            return Err(RasterError::Parameter {
                name: "focal_px",
                value: format!("{focal_px:?}"),
                allowed: "two numbers from 0.001 to 1e9",
            });
        }
        if !center.0.iter().all(|c| c.abs() < 1e9) {
            return Err(RasterError::Parameter {
                name: "center",
                value: format!("{:?}", center.0.as_slice()),
                allowed: "two numbers between −1e9 and 1e9",
            });
        }
        Ok(Self { size_px, focal_px: focal_px.into(), center: center.to_raster(), view_from_frame })
    }

    /// A view with square pixels and its axis through the image's middle, `fov_x_rad` wide from the left edge of
    /// the first pixel to the right edge of the last.
    ///
    /// # Errors
    /// As [`PinholeRaster::new`]; a field of view outside (0, π).
    pub fn with_fov(
        size_px: [u32; 2],
        fov_x_rad: f64,
        view_from_frame: Rotation3<f64>,
    ) -> Result<Self, RasterError> {
        if !(fov_x_rad > 0.0 && fov_x_rad < std::f64::consts::PI) {
            return Err(RasterError::Parameter {
                name: "fov_x_rad",
                value: fov_x_rad.to_string(),
                allowed: "more than 0 and less than π",
            });
        }
        let half = Vector2::new(f64::from(size_px[0]) / 2.0, f64::from(size_px[1]) / 2.0);
        let focal = half.x / (fov_x_rad / 2.0).tan();
        Self::new(size_px, [focal; 2], RasterPx(half).to_camera(), view_from_frame)
    }

    /// Width and height in pixels.
    pub fn size_px(&self) -> [u32; 2] {
        self.size_px
    }

    /// The unit direction, in the shared frame, of a finite raster position.
    pub fn direction(&self, position: RasterPx) -> Option<Vector3<f64>> {
        let plane = self.plane(position.0);
        let ray = Vector3::new(plane.x, plane.y, 1.0);
        let norm = ray.norm();
        norm.is_finite().then(|| self.view_from_frame.inverse_transform_vector(&(ray / norm)))
    }

    /// The raster position of a direction; `None` behind or beside the camera.
    pub fn position(&self, direction: &Vector3<f64>) -> Option<RasterPx> {
        let d = self.view_from_frame * direction;
        (d.z > MIN_COS * d.norm())
            .then(|| RasterPx((d.xy() / d.z).component_mul(&self.focal_px) + self.center.0))
    }

    /// The exact solid angle of pixel (x, y) in steradian.
    pub fn pixel_solid_angle_sr(&self, x: u32, y: u32) -> f64 {
        let low = Vector2::new(f64::from(x), f64::from(y));
        let (a, b) = (self.plane(low), self.plane(low + Vector2::new(1.0, 1.0)));
        // Of the four corner terms atan(xy/√(1+x²+y²)) the differences cancel far off the axis; the two triangles
        // do not, and their great-circle edges are the pixel's edges.
        let ray = |x: f64, y: f64| Vector3::new(x, y, 1.0) / (1.0 + x * x + y * y).sqrt();
        crate::raster::quad_solid_angle_sr([&ray(a.x, a.y), &ray(b.x, a.y), &ray(b.x, b.y), &ray(a.x, b.y)])
    }

    fn plane(&self, position: Vector2<f64>) -> Vector2<f64> {
        (position - self.center.0).component_div(&self.focal_px)
    }
}
