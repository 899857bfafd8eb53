//! Pixel conventions, and the only place where they are turned into each other.
//!
//! | type | pixel (0,0) | used by |
//! | --- | --- | --- |
//! | [`CameraPx`] | centre at (0, 0) | our camera models, OpenCV, Kalibr |
//! | [`RasterPx`] | covers [0, 1)², centre at (½, ½) | our rasters and textures, AprilTag, COLMAP, Mitsuba's film |
//! | [`Uv`] | `RasterPx` ÷ image size, in [0, 1]² | texture look-ups |
//! | [`Ndc`] | wgpu's clip square [−1, 1]², y up | vertex shaders |
//!
//! In all but [`Ndc`], x runs to the right and y down the rows.

use nalgebra::{Matrix3, Vector2};

/// A position in camera coordinates: the centre of pixel (0,0) lies at (0,0), the image covers
/// [−½, w−½] × [−½, h−½].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraPx(pub Vector2<f64>);

/// A position in raster coordinates: pixel i covers [i, i+1), its centre is at i+½.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RasterPx(pub Vector2<f64>);

/// A texture coordinate: 0 to 1 over the whole image, (0,0) at the outer corner of pixel (0,0).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Uv(pub Vector2<f64>);

/// A position in wgpu's normalised device coordinates: x right, y **up**, the image covers [−1,1]².
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ndc(pub Vector2<f64>);

const HALF: Vector2<f64> = Vector2::new(0.5, 0.5);

fn size_vector(size_px: [u32; 2]) -> Vector2<f64> {
    Vector2::new(f64::from(size_px[0]), f64::from(size_px[1]))
}

impl CameraPx {
    /// Camera coordinates from components in pixels.
    pub fn new(x_px: f64, y_px: f64) -> Self {
        Self(Vector2::new(x_px, y_px))
    }

    /// The same point in raster coordinates: +½.
    pub fn to_raster(self) -> RasterPx {
        RasterPx(self.0 + HALF)
    }

    /// The same point as a texture coordinate of an image of `size_px` (not zero).
    pub fn to_uv(self, size_px: [u32; 2]) -> Uv {
        self.to_raster().to_uv(size_px)
    }

    /// The same point in wgpu's clip square: `x = 2(u+½)/W − 1`, `y = 1 − 2(v+½)/H`.
    pub fn to_ndc(self, size_px: [u32; 2]) -> Ndc {
        let uv = self.to_uv(size_px).0;
        Ndc(Vector2::new(2.0 * uv.x - 1.0, 1.0 - 2.0 * uv.y))
    }

    /// From a corner or centre that AprilTag's C library reports (its pixel 0 covers [0,1)): −½.
    pub fn from_apriltag(x_px: f64, y_px: f64) -> Self {
        RasterPx::new(x_px, y_px).to_camera()
    }

    /// To the coordinates of AprilTag's C library: +½.
    pub fn to_apriltag(self) -> Vector2<f64> {
        self.to_raster().0
    }

    /// From COLMAP's image points and principal points (upper left corner of the image at (0,0)): −½.
    pub fn from_colmap(x_px: f64, y_px: f64) -> Self {
        RasterPx::new(x_px, y_px).to_camera()
    }

    /// To COLMAP's image coordinates: +½.
    pub fn to_colmap(self) -> Vector2<f64> {
        self.to_raster().0
    }

    /// From a film position of Mitsuba (film pixel i covers [i, i+1), no crop offset): −½.
    pub fn from_mitsuba_film(x_px: f64, y_px: f64) -> Self {
        RasterPx::new(x_px, y_px).to_camera()
    }

    /// To a film position of Mitsuba: +½.
    pub fn to_mitsuba_film(self) -> Vector2<f64> {
        self.to_raster().0
    }

    /// Where this point lies after its image was scaled by `scale` per axis (2 = twice as many pixels):
    /// `u' = s(u + ½) − ½`. The outer corner of the image stays in place, the pixel centres do not.
    pub fn scaled(self, scale: Vector2<f64>) -> Self {
        Self((self.0 + HALF).component_mul(&scale) - HALF)
    }
}

impl RasterPx {
    /// Raster coordinates from components in pixels.
    pub fn new(x_px: f64, y_px: f64) -> Self {
        Self(Vector2::new(x_px, y_px))
    }

    /// The centre of pixel (x, y).
    pub fn center_of(x: u32, y: u32) -> Self {
        Self::new(f64::from(x) + 0.5, f64::from(y) + 0.5)
    }

    /// The same point in camera coordinates: −½.
    pub fn to_camera(self) -> CameraPx {
        CameraPx(self.0 - HALF)
    }

    /// The same point as a texture coordinate of an image of `size_px` (not zero).
    pub fn to_uv(self, size_px: [u32; 2]) -> Uv {
        Uv(self.0.component_div(&size_vector(size_px)))
    }
}

impl Uv {
    /// A texture coordinate from its components.
    pub fn new(u: f64, v: f64) -> Self {
        Self(Vector2::new(u, v))
    }

    /// The same point in raster coordinates of an image of `size_px`.
    pub fn to_raster(self, size_px: [u32; 2]) -> RasterPx {
        RasterPx(self.0.component_mul(&size_vector(size_px)))
    }
}

impl Ndc {
    /// A clip position from its components.
    pub fn new(x: f64, y: f64) -> Self {
        Self(Vector2::new(x, y))
    }

    /// The same point in camera coordinates of an image of `size_px`.
    pub fn to_camera(self, size_px: [u32; 2]) -> CameraPx {
        Uv::new((self.0.x + 1.0) / 2.0, (1.0 - self.0.y) / 2.0).to_raster(size_px).to_camera()
    }
}

/// The camera matrix K (OpenCV convention) of an image that was scaled by `scale` per axis:
/// focal lengths and skew times s, principal point `c' = s(c + ½) − ½`.
pub fn scale_camera_matrix(k: &Matrix3<f64>, scale: Vector2<f64>) -> Matrix3<f64> {
    let center = CameraPx::new(k[(0, 2)], k[(1, 2)]).scaled(scale).0;
    Matrix3::new(
        k[(0, 0)] * scale.x,
        k[(0, 1)] * scale.x,
        center.x,
        0.0,
        k[(1, 1)] * scale.y,
        center.y,
        0.0,
        0.0,
        1.0,
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;

    const SIZE: [u32; 2] = [640, 480];

    #[test]
    fn the_first_pixel_in_every_convention() {
        let center = CameraPx::new(0.0, 0.0);
        assert_eq!(center.to_raster(), RasterPx::center_of(0, 0));
        assert_eq!(center.to_uv(SIZE), Uv::new(0.5 / 640.0, 0.5 / 480.0));
        assert_eq!(center.to_ndc(SIZE), Ndc::new(1.0 / 640.0 - 1.0, 1.0 - 1.0 / 480.0));
        assert_eq!(center.to_apriltag(), Vector2::new(0.5, 0.5));
        assert_eq!(center.to_colmap(), Vector2::new(0.5, 0.5));
        assert_eq!(center.to_mitsuba_film(), Vector2::new(0.5, 0.5));
    }

    #[test]
    fn image_corners_are_the_corners_of_the_clip_square() {
        assert_eq!(CameraPx::new(-0.5, -0.5).to_ndc(SIZE), Ndc::new(-1.0, 1.0));
        assert_eq!(CameraPx::new(639.5, 479.5).to_ndc(SIZE), Ndc::new(1.0, -1.0));
        assert_eq!(Ndc::new(1.0, -1.0).to_camera(SIZE), CameraPx::new(639.5, 479.5));
    }

    #[test]
    fn every_conversion_has_its_inverse() {
        let p = CameraPx::new(12.25, 99.75);
        assert_eq!(p.to_raster().to_camera(), p);
        assert_eq!(CameraPx::from_apriltag(12.75, 100.25), p);
        assert_eq!(CameraPx::from_colmap(12.75, 100.25), p);
        assert_eq!(CameraPx::from_mitsuba_film(12.75, 100.25), p);
        assert!((p.to_ndc(SIZE).to_camera(SIZE).0 - p.0).norm() < 1e-12);
        assert!((p.to_uv(SIZE).to_raster(SIZE).to_camera().0 - p.0).norm() < 1e-12);
    }

    /// Binning 2×2: the new pixel 0 has its centre between the old pixels 0 and 1.
    #[test]
    fn scaling_keeps_the_outer_corner() {
        let half = Vector2::new(0.5, 0.5);
        assert_eq!(CameraPx::new(0.5, 0.5).scaled(half), CameraPx::new(0.0, 0.0));
        assert_eq!(CameraPx::new(-0.5, -0.5).scaled(half), CameraPx::new(-0.5, -0.5));
        assert_eq!(CameraPx::new(639.5, 479.5).scaled(half), CameraPx::new(319.5, 239.5));
    }

    #[test]
    fn a_scaled_camera_matrix_projects_to_the_scaled_point() {
        let k = Matrix3::new(500.0, 1.5, 320.25, 0.0, 510.0, 239.0, 0.0, 0.0, 1.0);
        let scale = Vector2::new(0.5, 0.25);
        let ray = Vector3::new(0.3, -0.2, 1.0);
        let (p, q) = (k * ray, scale_camera_matrix(&k, scale) * ray);
        assert!((CameraPx::new(p.x, p.y).scaled(scale).0 - q.xy()).norm() < 1e-12);
    }
}
