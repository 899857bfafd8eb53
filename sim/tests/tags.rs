//! Prints of simulated worlds, as the AprilTag library's detector finds them.

#![expect(clippy::unwrap_used, reason = "clippy knows only functions marked as tests as tests")]

use std::path::Path;
use std::sync::Arc;

use apriltag_sys as c;
use coshade_capture::{Converter, PixelFormat};
use coshade_lens::calibration::{Calibration, Response};
use coshade_lens::pixel::CameraPx;
use coshade_sim::World;
use coshade_sim::sensor::Exposure;
use coshade_tracker::Family;
use nalgebra::{Vector2, Vector3};

struct Detection {
    id: i32,
    hamming: i32,
    corners: [CameraPx; 4],
}

/// What the library finds in a grey image, at full resolution.
fn detect(family: Family, grey: &mut [u8], [width, height]: [u32; 2]) -> Vec<Detection> {
    type Maker = (
        unsafe extern "C" fn() -> *mut c::apriltag_family_t,
        unsafe extern "C" fn(*mut c::apriltag_family_t),
    );
    let (create, destroy): Maker = match family {
        Family::Tag16h5 => (c::tag16h5_create, c::tag16h5_destroy),
        Family::Tag25h9 => (c::tag25h9_create, c::tag25h9_destroy),
        Family::Tag36h11 => (c::tag36h11_create, c::tag36h11_destroy),
        Family::Circle21h7 => (c::tagCircle21h7_create, c::tagCircle21h7_destroy),
        Family::Circle49h12 => (c::tagCircle49h12_create, c::tagCircle49h12_destroy),
        Family::Custom48h12 => (c::tagCustom48h12_create, c::tagCustom48h12_destroy),
        Family::Standard41h12 => (c::tagStandard41h12_create, c::tagStandard41h12_destroy),
        Family::Standard52h13 => (c::tagStandard52h13_create, c::tagStandard52h13_destroy),
    };
    // SAFETY: the library's objects are made, used and freed here in the order that its example has; the image borrows the
    // bytes, which are as many as width times height.
    unsafe {
        let table = create();
        let detector = c::apriltag_detector_create();
        c::apriltag_detector_add_family_bits(detector, table, 1);
        (*detector).quad_decimate = 1.0;
        (*detector).nthreads = 1;
        let mut image = c::image_u8 {
            width: width as i32,
            height: height as i32,
            stride: width as i32,
            buf: grey.as_mut_ptr(),
        };
        let found = c::apriltag_detector_detect(detector, &raw mut image);
        let each = std::slice::from_raw_parts(
            (*found).data.cast::<*mut c::apriltag_detection>(),
            (*found).size as usize,
        );
        let detections = each.iter().map(|&detection| Detection {
            id: (*detection).id,
            hamming: (*detection).hamming,
            corners: (*detection).p.map(|[x, y]| CameraPx::from_apriltag(x, y)),
        });
        let detections = detections.collect();
        c::apriltag_detections_destroy(found);
        c::apriltag_detector_destroy(detector);
        destroy(table);
        detections
    }
}

/// A tag 1 m in front of a camera that looks straight down at it, a fraction of a pixel off the middle.
///
/// The camera's response is linear: a detector takes the middle between black and white codes for an edge, and a response
/// that brightens the half covered pixels moves that outwards (0.2 px with sRGB).
fn world(folder: &Path, family: Family, id: u32, [x_m, y_m, turn_deg]: [f64; 3]) -> World {
    let mut calibration = Calibration::default_for([160, 160], 30_f64.to_radians()).unwrap();
    calibration.response = Response::Linear;
    calibration.write(folder.join("camera.toml")).unwrap();
    let text = format!(
        "version = 1\nduration_s = 0.02\n[trace]\nsamples = 16\nmax_depth = 1\n\
         [[thing]]\nname = 'paper'\nworld = 'real'\nshape = {{ plane = [2, 2] }}\nmaterial = {{ base_color = [0.85, 0.85, 0.85] }}\n\
         pose = {{ in = 'world', position_m = [0, 0, -0.0002] }}\n\
         [[tag]]\nfamily = '{family}'\nid = {id}\nsize_m = 0.2\npose = {{ position_m = [{x_m}, {y_m}, 0], rotation_deg = [0, 0, {turn_deg}] }}\n\
         [[light]]\nkind = 'area'\nworld = 'real'\nsize_m = [4, 4]\nradiance = [0.9, 0.9, 0.9]\n\
         pose = {{ in = 'world', position_m = [0, 0, 1.5], rotation_deg = [180, 0, 0] }}\n\
         [[keyframe]]\ntime_s = 0\nposition_m = [0, 0, 1]\nlook_at_m = [0, 0, 0]\n\
         [sensor.camera]\ncalibration = 'camera.toml'\nformat = 'grey'\n"
    );
    World::parse(&text, folder.join("tag.toml")).unwrap()
}

/// What the detector's corners miss the truth by, in pixels; the tag is found once, without a wrong bit.
fn corner_errors_px(folder: &Path, family: Family, id: u32, place: [f64; 3]) -> [Vector2<f64>; 4] {
    let world = world(folder, family, id, place);
    let sensor = world.sensor("camera", Arc::new(world.tracer().unwrap())).unwrap();
    let frame = sensor.frame(0, &Exposure::default()).unwrap();
    assert_eq!(frame.format, PixelFormat::Grey);
    let mut grey = vec![0; 160 * 160];
    Converter::new().grey(&frame, &mut grey).unwrap();
    let found = detect(family, &mut grey, [160, 160]);
    let [detection] = found.as_slice() else { unreachable!("{family}: {} detections", found.len()) };
    assert_eq!((detection.id, detection.hamming), (id as i32, 0), "{family}");
    let camera_from_world = sensor.world_from_sensor(0.0).inverse();
    let corners_m = world.tags().unwrap()[0].corners_m();
    std::array::from_fn(|corner: usize| {
        let local = camera_from_world.transform_point(corners_m[corner]);
        let truth = sensor.calibration().model.project(&Vector3::new(local.x, local.y, local.z)).unwrap();
        detection.corners[corner].0 - truth
    })
}

#[test]
fn printed_tags_of_all_families_are_found_where_they_are() {
    let folder = tempfile::tempdir().unwrap();
    for family in Family::ALL {
        // The last number of each family: the bit order would show.
        let errors = corner_errors_px(folder.path(), family, family.tag_count() - 1, [0.0013, -0.0021, 7.0]);
        // The detector's own error in one image is up to 0.1 px here; half a pixel of a wrong convention would be 0.7.
        assert!(errors.iter().all(|error| error.norm() < 0.15), "{family}: {errors:?}");
    }
}

#[test]
fn corners_are_true_on_average_over_the_places_of_a_tag() {
    let folder = tempfile::tempdir().unwrap();
    // The detector takes gradients at the nearest pixel: its error depends on how edges cross the pixels, and averages out.
    let places = [
        [0.0, 0.0, 0.0],
        [0.0013, -0.0021, 3.0],
        [0.0024, 0.0009, -5.0],
        [-0.0007, 0.0017, 11.0],
        [0.0031, -0.0004, -8.0],
        [-0.0019, -0.0012, 17.0],
    ];
    let mut mean = [Vector2::zeros(); 4];
    for place in places {
        let errors = corner_errors_px(folder.path(), Family::Tag36h11, 7, place);
        mean.iter_mut().zip(errors).for_each(|(mean, error)| *mean += error / places.len() as f64);
    }
    assert!(mean.iter().all(|error| error.norm() < 0.05), "{mean:?}");
}
