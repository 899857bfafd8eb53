//! Rasters: grids of pixels over directions.
//!
//! A [`Raster`] maps raster positions ([`RasterPx`]: pixel i covers [i, i+1)) to unit directions and back. All
//! rasters that take part in one remap table share one *frame*; each holds the rotation from that frame to its own
//! axes, so that a virtual view or a map can be turned against the camera.

mod camera;
mod pinhole;
mod sphere;

use nalgebra::{Rotation3, Vector2, Vector3};
use rayon::prelude::*;

use crate::calibration::Mistake;
use crate::octahedral;
use crate::pixel::RasterPx;
pub use camera::{CameraRaster, ImageCircle};
pub use pinhole::PinholeRaster;
pub use sphere::{LatLongRaster, OctahedralRaster};

/// The largest width or height of a raster, in pixels.
pub const MAX_SIDE_PX: u32 = 16384;

/// Rows that one task works off; neighbouring rows share their corners.
const BAND_ROWS: u32 = 16;

/// Why a raster cannot be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RasterError {
    /// A side is zero or too long.
    #[error(
        "a raster of {width} × {height} pixels cannot be made: each side must be 1 to {MAX_SIDE_PX} pixels"
    )]
    Size {
        /// Width in pixels.
        width: u32,
        /// Height in pixels.
        height: u32,
    },
    /// The image circle is not allowed.
    #[error("image circle: {0}")]
    Circle(Mistake),
    /// A parameter is out of its range or not a number.
    #[error("{name} = {value} is not allowed: {allowed}")]
    Parameter {
        /// The parameter's name.
        name: &'static str,
        /// What was given.
        value: String,
        /// What is allowed.
        allowed: &'static str,
    },
}

pub(crate) fn check_size([width, height]: [u32; 2]) -> Result<(), RasterError> {
    let fits = |side| (1..=MAX_SIDE_PX).contains(&side);
    if fits(width) && fits(height) { Ok(()) } else { Err(RasterError::Size { width, height }) }
}

pub(crate) fn check_rotation(rotation: &Rotation3<f64>) -> Result<(), RasterError> {
    let matrix = rotation.matrix();
    // NaN makes the comparison false, so it is refused too.
    if (matrix.transpose() * matrix - nalgebra::Matrix3::identity()).norm() < 1e-6 {
        return Ok(());
    }
    Err(RasterError::Parameter {
        name: "rotation",
        value: format!("{:?}", matrix.as_slice()),
        allowed: "an orthonormal 3×3 matrix",
    })
}

/// A grid of pixels over directions.
#[derive(Clone, Debug)]
pub enum Raster {
    /// The image of a real camera, with its distortion.
    Camera(CameraRaster),
    /// An undistorted perspective view.
    Pinhole(PinholeRaster),
    /// An equal-area octahedral map of the whole sphere.
    Octahedral(OctahedralRaster),
    /// A latitude-longitude (equirectangular) map of the whole sphere.
    LatLong(LatLongRaster),
}

impl From<CameraRaster> for Raster {
    fn from(raster: CameraRaster) -> Self {
        Self::Camera(raster)
    }
}

impl From<PinholeRaster> for Raster {
    fn from(raster: PinholeRaster) -> Self {
        Self::Pinhole(raster)
    }
}

impl From<OctahedralRaster> for Raster {
    fn from(raster: OctahedralRaster) -> Self {
        Self::Octahedral(raster)
    }
}

impl From<LatLongRaster> for Raster {
    fn from(raster: LatLongRaster) -> Self {
        Self::LatLong(raster)
    }
}

impl Raster {
    /// Width and height in pixels.
    pub fn size_px(&self) -> [u32; 2] {
        match self {
            Self::Camera(raster) => raster.size_px(),
            Self::Pinhole(raster) => raster.size_px(),
            Self::Octahedral(raster) => [raster.side_px(); 2],
            Self::LatLong(raster) => raster.size_px(),
        }
    }

    /// The unit direction, in the shared frame, that a raster position looks along; `None` where the raster sees
    /// nothing (outside the lens' valid cone or its image circle).
    pub fn direction(&self, position: RasterPx) -> Option<Vector3<f64>> {
        match self {
            Self::Camera(raster) => raster.direction(position),
            Self::Pinhole(raster) => raster.direction(position),
            Self::Octahedral(raster) => raster.direction(position),
            Self::LatLong(raster) => raster.direction(position),
        }
    }

    /// The raster position of a direction (any length) of the shared frame; `None` where the raster cannot see it.
    /// Positions of cameras and pinholes may lie outside of the image.
    pub fn position(&self, direction: &Vector3<f64>) -> Option<RasterPx> {
        match self {
            Self::Camera(raster) => raster.position(direction),
            Self::Pinhole(raster) => raster.position(direction),
            Self::Octahedral(raster) => raster.position(direction),
            Self::LatLong(raster) => raster.position(direction),
        }
    }

    /// The solid angle of every pixel in steradian, row by row; 0 for pixels that are not wholly valid (a corner
    /// has no direction).
    pub fn solid_angles_sr(&self) -> Vec<f64> {
        let [width, height] = self.size_px();
        let rows = (0..height).into_par_iter();
        match self {
            Self::Camera(raster) => {
                let bands = (0..height.div_ceil(BAND_ROWS)).into_par_iter().map(|band| band * BAND_ROWS);
                let end = |start: u32| (start + BAND_ROWS).min(height);
                bands.flat_map_iter(|start| raster.rows_solid_angles_sr(start..end(start))).collect()
            }
            Self::Pinhole(raster) => {
                rows.flat_map_iter(|y| (0..width).map(move |x| raster.pixel_solid_angle_sr(x, y))).collect()
            }
            Self::Octahedral(raster) => {
                let texel_sr = octahedral::texel_solid_angle_sr(raster.side_px());
                vec![texel_sr; width as usize * height as usize]
            }
            Self::LatLong(raster) => rows
                .flat_map_iter(|y| std::iter::repeat_n(raster.row_solid_angle_sr(y), width as usize))
                .collect(),
        }
    }

    /// The position that stands for the same direction as `position` and lies nearest to `reference`, maybe
    /// outside the image: maps of the whole sphere go on beyond their seam.
    pub(crate) fn continued(&self, position: Vector2<f64>, reference: Vector2<f64>) -> Vector2<f64> {
        match self {
            Self::Camera(_) | Self::Pinhole(_) => position,
            Self::Octahedral(raster) => raster.continued(position, reference),
            Self::LatLong(raster) => raster.continued(position, reference),
        }
    }

    /// Whether positions go on beyond the image's border (a map of the whole sphere).
    pub(crate) fn is_whole_sphere(&self) -> bool {
        matches!(self, Self::Octahedral(_) | Self::LatLong(_))
    }

    /// The index (row by row) of the pixel at (x, y), which may lie outside: the neighbour over the seam in maps of
    /// the whole sphere, the nearest pixel of the border in images.
    pub(crate) fn pixel_index(&self, x: i64, y: i64) -> u32 {
        let [width, height] = self.size_px();
        let (x, y) = match self {
            Self::Camera(_) | Self::Pinhole(_) => {
                (x.clamp(0, i64::from(width) - 1) as u32, y.clamp(0, i64::from(height) - 1) as u32)
            }
            Self::Octahedral(_) => octahedral::fold_texel(x, y, width),
            Self::LatLong(raster) => raster.wrapped(x, y),
        };
        y * width + x
    }
}

/// The signed solid angle of a spherical triangle with unit corners, in steradian
/// (A. van Oosterom, J. Strackee, *The Solid Angle of a Plane Triangle*, IEEE Trans. Biomed. Eng. 30(2), 1983, eq. 8).
pub fn triangle_solid_angle_sr(a: &Vector3<f64>, b: &Vector3<f64>, c: &Vector3<f64>) -> f64 {
    2.0 * a.dot(&b.cross(c)).atan2(1.0 + a.dot(b) + b.dot(c) + c.dot(a))
}

/// The solid angle of the spherical quadrilateral with the given unit corners in turn, in steradian.
pub fn quad_solid_angle_sr([a, b, c, d]: [&Vector3<f64>; 4]) -> f64 {
    (triangle_solid_angle_sr(a, b, c) + triangle_solid_angle_sr(a, c, d)).abs()
}
