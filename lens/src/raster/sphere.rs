//! Rasters of the whole sphere: the octahedral map and the latitude-longitude map.

use std::f64::consts::{PI, TAU};

use nalgebra::{Rotation3, Vector2, Vector3};

use crate::octahedral;
use crate::pixel::{RasterPx, Uv};
use crate::raster::{RasterError, check_rotation, check_size};

/// An equal-area octahedral map ([`crate::octahedral`]); its pole is +Z of the map's frame.
#[derive(Clone, Debug)]
pub struct OctahedralRaster {
    side_px: u32,
    map_from_frame: Rotation3<f64>,
}

impl OctahedralRaster {
    /// A map of `side_px`² texels, turned by `map_from_frame`.
    ///
    /// # Errors
    /// A side of 0 or beyond [`crate::raster::MAX_SIDE_PX`], a matrix that is no rotation.
    pub fn new(side_px: u32, map_from_frame: Rotation3<f64>) -> Result<Self, RasterError> {
        check_size([side_px; 2])?;
        check_rotation(&map_from_frame)?;
        Ok(Self { side_px, map_from_frame })
    }

    /// Width and height in texels.
    pub fn side_px(&self) -> u32 {
        self.side_px
    }

    /// The unit direction, in the shared frame, of a finite raster position.
    pub fn direction(&self, position: RasterPx) -> Option<Vector3<f64>> {
        let d = octahedral::direction_from_uv(position.to_uv([self.side_px; 2]));
        Some(self.map_from_frame.inverse_transform_vector(&d))
    }

    /// The raster position of a direction; `None` for the zero vector only.
    pub fn position(&self, direction: &Vector3<f64>) -> Option<RasterPx> {
        let uv = octahedral::uv_from_direction(&(self.map_from_frame * direction))?;
        Some(uv.to_raster([self.side_px; 2]))
    }

    pub(crate) fn continued(&self, position: Vector2<f64>, reference: Vector2<f64>) -> Vector2<f64> {
        let half = f64::from(self.side_px) / 2.0;
        // Nothing else can be nearer than a point of the same neighbourhood well inside the map.
        let inside = position.amin() > 0.25 * half && position.amax() < 1.75 * half;
        if inside && (position - reference).amax() < 0.25 * half {
            return position;
        }
        let to_square = |p: Vector2<f64>| p / half - Vector2::new(1.0, 1.0);
        let image = octahedral::nearest_image(to_square(position), to_square(reference));
        (image + Vector2::new(1.0, 1.0)) * half
    }
}

/// A latitude-longitude (equirectangular) map as Blender and Radiance tools write it: +Z of the map's frame is the
/// top row, the middle column looks along +X, the longitude falls to the right (+X, then −Y at u = ¾): the world as
/// seen from inside.
#[derive(Clone, Debug)]
pub struct LatLongRaster {
    size_px: [u32; 2],
    map_from_frame: Rotation3<f64>,
}

impl LatLongRaster {
    /// A map of `size_px` (usually 2:1), turned by `map_from_frame`.
    ///
    /// # Errors
    /// A side of 0 or beyond [`crate::raster::MAX_SIDE_PX`], a matrix that is no rotation.
    pub fn new(size_px: [u32; 2], map_from_frame: Rotation3<f64>) -> Result<Self, RasterError> {
        check_size(size_px)?;
        check_rotation(&map_from_frame)?;
        Ok(Self { size_px, map_from_frame })
    }

    /// Width and height in texels.
    pub fn size_px(&self) -> [u32; 2] {
        self.size_px
    }

    /// The unit direction, in the shared frame, of a finite raster position.
    pub fn direction(&self, position: RasterPx) -> Option<Vector3<f64>> {
        let uv = position.to_uv(self.size_px).0;
        let (sin_lon, cos_lon) = ((0.5 - uv.x) * TAU).sin_cos();
        let (sin_polar, cos_polar) = (uv.y * PI).sin_cos();
        let d = Vector3::new(sin_polar * cos_lon, sin_polar * sin_lon, cos_polar);
        Some(self.map_from_frame.inverse_transform_vector(&d))
    }

    /// The raster position of a direction; `None` for the zero vector only.
    pub fn position(&self, direction: &Vector3<f64>) -> Option<RasterPx> {
        let d = self.map_from_frame * direction;
        let norm = d.norm();
        if !(norm.is_finite() && norm > 0.0) {
            return None;
        }
        let uv = Uv::new(0.5 - d.y.atan2(d.x) / TAU, d.x.hypot(d.y).atan2(d.z) / PI);
        Some(uv.to_raster(self.size_px))
    }

    /// The exact solid angle of every texel of row `y`, in steradian.
    pub fn row_solid_angle_sr(&self, y: u32) -> f64 {
        let [width, height] = self.size_px.map(f64::from);
        let polar_rad = (f64::from(y) + 0.5) / height * PI;
        // cos a − cos b without cancellation.
        TAU / width * 2.0 * polar_rad.sin() * (PI / height / 2.0).sin()
    }

    pub(crate) fn continued(&self, position: Vector2<f64>, reference: Vector2<f64>) -> Vector2<f64> {
        let width = f64::from(self.size_px[0]);
        let turns = ((reference.x - position.x) / width).round();
        Vector2::new(position.x + turns * width, position.y)
    }

    pub(crate) fn wrapped(&self, x: i64, y: i64) -> (u32, u32) {
        let [width, height] = self.size_px.map(i64::from);
        // Over a pole lies the same row on the other side.
        let (x, y) = match y {
            y if y < 0 => (x + width / 2, -1 - y),
            y if y >= height => (x + width / 2, 2 * height - 1 - y),
            y => (x, y),
        };
        (x.rem_euclid(width) as u32, y.clamp(0, height - 1) as u32)
    }
}
