//! A real fish-eye through its real calibration (made with OpenCV's `fisheye` module): straight things are straight.

#![expect(clippy::unwrap_used, reason = "clippy knows only functions marked as tests as tests")]

use std::path::Path;

use coshade_lens::model::{CameraModel, ModelKind};
use coshade_lens::pixel::CameraPx;
use coshade_lens::raster::{CameraRaster, ImageCircle, OctahedralRaster, PinholeRaster, Raster};
use coshade_lens::remap::RemapTable;
use nalgebra::{Matrix3xX, Rotation3, Vector2, Vector3};

const FOLDER: &str = "fisheye-scene/surround-view";

/// The numbers of one OpenCV matrix of a YAML file.
fn matrix(yaml: &str, name: &str) -> Vec<f64> {
    let after = yaml.split(&format!("{name}:")).nth(1).unwrap();
    let data = after.split('[').nth(1).unwrap().split(']').next().unwrap();
    data.split(',').map(|n| n.trim().parse().unwrap()).collect()
}

fn model(folder: &Path, name: &str) -> CameraModel {
    let yaml = std::fs::read_to_string(folder.join(name).with_extension("yaml")).unwrap();
    let (k, d) = (matrix(&yaml, "camera_matrix"), matrix(&yaml, "dist_coeffs"));
    let params = [k[0], k[4], k[2], k[5], d[0], d[1], d[2], d[3]];
    CameraModel::from_params(ModelKind::KannalaBrandt4, &params).unwrap()
}

/// Linear light from the 8 bits of a photograph, near enough for looking.
fn linear(image: &image::RgbImage) -> Vec<f32> {
    image.as_raw().iter().map(|code| (f32::from(*code) / 255.0).powf(2.2)).collect()
}

fn save(pixels: &[f32], [width, height]: [u32; 2], path: &Path) {
    let codes = pixels.iter().map(|l| (l.powf(1.0 / 2.2) * 255.0).round() as u8).collect();
    image::RgbImage::from_raw(width, height, codes).unwrap().save(path).unwrap();
}

/// Remaps both photographs to a pinhole view of the ground and to an octahedral map, and leaves the images in a folder
/// of their own if `$COSHADE_KEEP` names one.
#[test]
fn views_of_a_real_fisheye() {
    let Some(folder) = coshade_testdata::find("views_of_a_real_fisheye", FOLDER) else { return };
    let kept = std::env::var_os("COSHADE_KEEP");
    let temporary = tempfile::tempdir().unwrap();
    let out = kept.as_ref().map_or(temporary.path(), Path::new);
    for name in ["front", "left"] {
        let photograph = image::open(folder.join(name).with_extension("png")).unwrap().to_rgb8();
        let size = [photograph.width(), photograph.height()];
        let model = model(&folder, name);
        println!("{name}: lens valid to {:.1}°", model.max_angle_rad().to_degrees());
        let circle = ImageCircle { max_angle_deg: Some(88.0), ..ImageCircle::default() };
        let camera: Raster = CameraRaster::new(model, size, circle, Rotation3::identity()).unwrap().into();
        let image = linear(&photograph);
        // Turned down by 25°.
        let down = Rotation3::from_axis_angle(&Vector3::x_axis(), 25_f64.to_radians());
        let pinhole = PinholeRaster::with_fov([640, 480], 110_f64.to_radians(), down).unwrap();
        for (kind, destination) in [
            ("pinhole", Raster::from(pinhole)),
            ("octahedral", OctahedralRaster::new(512, Rotation3::identity()).unwrap().into()),
        ] {
            let table = RemapTable::build(&camera, &destination).unwrap();
            let mut pixels = vec![0.0; 3 * table.covered().len()];
            table.apply::<3>(&image, &mut pixels).unwrap();
            save(&pixels, destination.size_px(), &out.join(format!("{name}-{kind}.png")));
            // A mean of what the photograph holds, nothing brighter or made up.
            assert!(pixels.iter().all(|l| (0.0..=1.0).contains(l)));
            let seen = table.covered().iter().filter(|c| **c == 1.0).count();
            assert!(seen > table.covered().len() / 4, "{name} {kind}: {seen}");
        }
    }
}

/// Corners of the chess cloth on the ground in `front.png`, read off by hand: bent by 40 px in the photograph, in
/// one plane through the camera (hence on a straight line in any pinhole view) after the lens.
#[test]
fn a_straight_edge_of_the_scene_is_straight() {
    let Some(folder) = coshade_testdata::find("a_straight_edge_of_the_scene_is_straight", FOLDER) else {
        return;
    };
    let model = model(&folder, "front");
    let corners = CORNERS.map(|(x, y)| CameraPx::new(x, y).0);
    let (first, last) = (corners[0], corners[corners.len() - 1]);
    let chord = (last - first).normalize();
    let bend = corners.iter().map(|p| (p - first).perp(&chord).abs()).fold(0.0, f64::max);
    let rays = Matrix3xX::from_columns(&corners.map(|p: Vector2<f64>| model.unproject(&p).unwrap()));
    let normal = (rays.clone() * rays.transpose()).symmetric_eigen();
    let plane: Vector3<f64> = normal.eigenvectors.column(normal.eigenvalues.imin()).into();
    let off_rad = (rays.transpose() * plane).amax();
    println!("bent by {bend:.1} px in the image, {:.2}° off the plane", off_rad.to_degrees());
    assert!(bend > 30.0, "{bend}");
    // One pixel of reading error and the wrinkles of the cloth, at 5 px per degree; the bend alone would be 8°.
    assert!(off_rad < 0.5_f64.to_radians(), "{}", off_rad.to_degrees());
}

const CORNERS: [(f64, f64); 7] = [
    (273.5, 464.3),
    (332.1, 476.0),
    (417.7, 483.7),
    (526.1, 482.0),
    (633.0, 465.8),
    (714.6, 438.7),
    (769.2, 418.5),
];
