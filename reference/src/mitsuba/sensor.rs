//! The camera.

use coshade_lens::model::CameraModel;
use coshade_lens::pixel::CameraPx;
use glam::{DMat4, DVec3};

use super::xml::Element;
use crate::camera::Camera;

/// Focal lengths may differ by this share: a hundredth of a pixel at the edge of a picture of 2000.
const SAME_FOCAL_LENGTH: f64 = 1e-5;

/// A `perspective` sensor with square pixels and box filter.
///
/// # Errors
/// What Mitsuba has no lens for, and what to do.
pub fn sensor(camera: &Camera) -> Result<Element, String> {
    let CameraModel::Pinhole(_) = camera.model() else {
        return Err(format!(
            "Mitsuba has no lens of model {:?}: give the camera a calibration with model = \"pinhole\"",
            camera.model().kind()
        ));
    };
    let intrinsics = camera.model().intrinsics();
    let (fx, fy) = (intrinsics.fx, intrinsics.fy);
    if (fx / fy - 1.0).abs() > SAME_FOCAL_LENGTH {
        return Err(format!(
            "Mitsuba's pixels are square, but fx = {fx} and fy = {fy}: give the camera a calibration with fx = fy"
        ));
    }
    let [width, height] = camera.size_px();
    let principal = CameraPx::new(intrinsics.cx, intrinsics.cy).to_mitsuba_film();
    let film = Element::plugin("film", "hdrfilm")
        .parameter("integer", "width", width)
        .parameter("integer", "height", height)
        .parameter("string", "pixel_format", "rgb")
        .parameter("string", "component_format", "float32")
        .child(Element::plugin("rfilter", "box"));
    // Ours: x right, y down, z forward. Mitsuba's: x left, y up, z forward.
    let world_from_mitsuba =
        camera.world_from_camera().to_mat4().as_dmat4() * DMat4::from_scale(DVec3::new(-1.0, -1.0, 1.0));
    Ok(Element::plugin("sensor", "perspective")
        .parameter("string", "fov_axis", "x")
        .parameter("float", "fov", 2.0 * (f64::from(width) / (2.0 * fx)).atan().to_degrees())
        .parameter("float", "principal_point_offset_x", 0.5 - principal.x / f64::from(width))
        .parameter("float", "principal_point_offset_y", 0.5 - principal.y / f64::from(height))
        .parameter("float", "near_clip", 1e-3)
        .parameter("float", "far_clip", 1e4)
        .transform("to_world", world_from_mitsuba)
        .child(Element::plugin("sampler", "independent").parameter("integer", "sample_count", "$spp"))
        .child(film))
}
