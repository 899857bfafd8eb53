//! Where the rays of a picture start and go.

use coshade_lens::calibration::Calibration;
use coshade_lens::model::{CameraModel, ModelKind};
use coshade_lens::pixel::CameraPx;
use coshade_lens::raster::{ImageCircle, MAX_SIDE_PX};
use coshade_scene::Similarity;
use glam::{Quat, Vec2, Vec3};
use nalgebra::Vector2;
use thiserror::Error;

/// Why there is no such camera.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum CameraError {
    /// No picture, or one that is too large.
    #[error("camera: size {0}x{1} px, expected 1 to {MAX_SIDE_PX} each")]
    Size(u32, u32),
    /// Not rigid.
    #[error(
        "camera: its pose is not finite, or its rotation not a unit quaternion, or its scale {0} (a camera has scale 1)"
    )]
    Pose(f32),
}

/// A lens at a place. Its pixels are squares (box filter): a pixel's value is the mean radiance over its area.
#[derive(Clone, Debug, PartialEq)]
pub struct Camera {
    model: CameraModel,
    size_px: [u32; 2],
    circle: ImageCircle,
    world_from_camera: Similarity,
}

/// A camera ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraRay {
    /// The camera's centre in world coordinates.
    pub origin: Vec3,
    /// In world coordinates, unit length.
    pub direction: Vec3,
    /// What a metre along the ray counts in the picture's depth: the cosine with the axis, or 1 where depth is range.
    pub depth_per_m: f32,
}

impl Camera {
    /// A camera of the given image size; camera frame x right, y down, z forward.
    ///
    /// # Errors
    /// [`CameraError`] for an empty or huge image and for a pose that is not rigid.
    pub fn new(
        model: CameraModel,
        size_px: [u32; 2],
        world_from_camera: Similarity,
    ) -> Result<Self, CameraError> {
        let [width, height] = size_px;
        if width == 0 || height == 0 || width > MAX_SIDE_PX || height > MAX_SIDE_PX {
            return Err(CameraError::Size(width, height));
        }
        if !world_from_camera.is_valid() || (world_from_camera.scale - 1.0).abs() > 1e-4 {
            return Err(CameraError::Pose(world_from_camera.scale));
        }
        Ok(Self { model, size_px, circle: ImageCircle::default(), world_from_camera })
    }

    /// Lens, image size and image circle of a calibration, at a place.
    ///
    /// # Errors
    /// As [`Camera::new`].
    pub fn of_calibration(
        calibration: &Calibration,
        world_from_camera: Similarity,
    ) -> Result<Self, CameraError> {
        let camera = Self::new(calibration.model, calibration.size_px, world_from_camera)?;
        Ok(Self { circle: calibration.image_circle.unwrap_or_default(), ..camera })
    }

    /// `world_from_camera` of a camera at `eye` that looks at `target`, with `up` upwards in its image. Any other upright
    /// direction is taken where `up` is along the view.
    pub fn look_at(eye: Vec3, target: Vec3, up: Vec3) -> Similarity {
        let forward = (target - eye).normalize_or(Vec3::X);
        let right = forward.cross(up).try_normalize().unwrap_or_else(|| forward.any_orthonormal_vector());
        let down = forward.cross(right);
        let rotation = Quat::from_mat3(&glam::Mat3::from_cols(right, down, forward)).normalize();
        Similarity { rotation, translation_m: eye, scale: 1.0 }
    }

    /// Width and height, pixels.
    pub fn size_px(&self) -> [u32; 2] {
        self.size_px
    }

    /// The lens.
    pub fn model(&self) -> &CameraModel {
        &self.model
    }

    /// Where it stands.
    pub fn world_from_camera(&self) -> &Similarity {
        &self.world_from_camera
    }

    /// True if depth is range: the distance from the camera's centre. It is z along the axis for lenses that cannot see
    /// sideways anyway.
    pub fn depth_is_range(&self) -> bool {
        match self.model.kind() {
            ModelKind::Pinhole | ModelKind::BrownConrady5 | ModelKind::Rational8 => false,
            ModelKind::KannalaBrandt4 | ModelKind::DoubleSphere | ModelKind::Eucm => true,
        }
    }

    /// The ray through a place of a pixel's square, `place` in [0, 1)² from its upper left corner; `None` where the lens
    /// sees nothing and outside the image circle.
    pub fn ray(&self, pixel: [u32; 2], place: Vec2) -> Option<CameraRay> {
        // Pixel centres are at whole numbers.
        let at = |axis: usize| f64::from(pixel[axis]) + f64::from(place[axis]) - 0.5;
        let position = Vector2::new(at(0), at(1));
        let ray = self.model.unproject(&position)?;
        if !self.circle.contains(CameraPx(position), ray.x.hypot(ray.y).atan2(ray.z)) {
            return None;
        }
        let local = Vec3::new(ray.x as f32, ray.y as f32, ray.z as f32);
        Some(CameraRay {
            origin: self.world_from_camera.translation_m,
            direction: self.world_from_camera.transform_direction(local).try_normalize()?,
            depth_per_m: if self.depth_is_range() { 1.0 } else { local.z },
        })
    }
}

#[cfg(test)]
mod tests {
    use coshade_lens::model::{Intrinsics, KannalaBrandt4, Pinhole};

    use super::*;

    fn pinhole() -> CameraModel {
        Pinhole::new(Intrinsics { fx: 10.0, fy: 20.0, cx: 4.5, cy: 2.0 }).unwrap().into()
    }

    #[test]
    fn pixel_centres_are_at_whole_numbers() {
        let camera = Camera::new(pinhole(), [10, 5], Similarity::IDENTITY).unwrap();
        let ray = camera.ray([7, 1], Vec2::splat(0.5)).unwrap();
        let expected = Vec3::new((7.0 - 4.5) / 10.0, (1.0 - 2.0) / 20.0, 1.0).normalize_or(Vec3::Z);
        assert!((ray.direction - expected).length() < 1e-6);
        // A metre along the ray is cosθ metres of depth.
        assert!((ray.depth_per_m - expected.z).abs() < 1e-6);
    }

    #[test]
    fn the_target_is_in_the_middle_and_up_is_up() {
        let pose = Camera::look_at(Vec3::new(1.0, 2.0, 3.0), Vec3::new(0.0, 5.0, 0.0), Vec3::Z);
        let local = |point: Vec3| pose.inverse().transform_point(point);
        let target = local(Vec3::new(0.0, 5.0, 0.0));
        assert!(target.truncate().length() < 1e-5 && target.z > 0.0);
        assert!(local(Vec3::new(0.0, 5.0, 1.0)).y < 0.0, "y points down");
        assert!((pose.rotation.length() - 1.0).abs() < 1e-6);
    }

    #[test]
    fn a_lens_has_no_ray_where_it_sees_nothing() {
        let intrinsics = Intrinsics { fx: 10.0, fy: 10.0, cx: 50.0, cy: 50.0 };
        let fisheye = KannalaBrandt4::new(intrinsics, [0.0; 4]).unwrap();
        let camera = Camera::new(fisheye.into(), [101, 101], Similarity::IDENTITY).unwrap();
        assert!(camera.depth_is_range());
        // r = f θ: 50 px are 5 rad, beyond the whole sphere.
        assert!(camera.ray([0, 50], Vec2::splat(0.5)).is_none());
        assert!(camera.ray([65, 50], Vec2::splat(0.5)).is_some_and(|ray| ray.depth_per_m == 1.0));
    }

    #[test]
    fn nothing_is_seen_outside_the_image_circle() {
        let mut calibration = Calibration::default_for([101, 101], 186f64.to_radians()).unwrap();
        let sees = |calibration: &Calibration, x: u32| {
            let camera = Camera::of_calibration(calibration, Similarity::IDENTITY).unwrap();
            camera.ray([x, 50], Vec2::splat(0.5)).is_some()
        };
        assert!(sees(&calibration, 0) && sees(&calibration, 50));
        calibration.image_circle = Some(ImageCircle { max_angle_deg: Some(80.0), ..ImageCircle::default() });
        assert!(!sees(&calibration, 0) && sees(&calibration, 50) && !sees(&calibration, 100));
    }

    #[test]
    fn mistakes_are_refused() {
        assert_eq!(Camera::new(pinhole(), [0, 5], Similarity::IDENTITY), Err(CameraError::Size(0, 5)));
        let huge = MAX_SIDE_PX + 1;
        assert!(Camera::new(pinhole(), [huge, 5], Similarity::IDENTITY).is_err());
        assert!(Camera::new(pinhole(), [1, 1], Similarity::from_scale(2.0)).is_err());
        assert!(Camera::new(pinhole(), [1, 1], Similarity::from_translation(Vec3::splat(f32::NAN))).is_err());
    }
}
