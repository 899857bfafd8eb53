//! Area-true remapping: what must be kept is kept, whatever the pair of rasters.

#![expect(clippy::unwrap_used, reason = "clippy knows only functions marked as tests as tests")]

use coshade_lens::model::{CameraModel, ModelKind};
use coshade_lens::pixel::RasterPx;
use coshade_lens::raster::{
    CameraRaster, ImageCircle, LatLongRaster, OctahedralRaster, PinholeRaster, Raster,
};
use coshade_lens::remap::RemapTable;
use nalgebra::{Rotation3, Vector3};
use proptest::prelude::*;
use std::f64::consts::PI;

/// A fish-eye of 186° (Kannala-Brandt, close to equidistant) that fills a square image of `side` pixels.
fn fisheye(side: u32) -> Raster {
    let center = f64::from(side) / 2.0 - 0.5;
    let theta = 93_f64.to_radians();
    let (k1, k2) = (-0.02, 0.002);
    let radius = theta * (1.0 + k1 * theta.powi(2) + k2 * theta.powi(4));
    let f = f64::from(side) / 2.0 / radius;
    let params = [f, f, center, center, k1, k2, 0.0, 0.0];
    let model = CameraModel::from_params(ModelKind::KannalaBrandt4, &params).unwrap();
    let circle = ImageCircle { max_angle_deg: Some(93.0), ..ImageCircle::default() };
    CameraRaster::new(model, [side; 2], circle, Rotation3::identity()).unwrap().into()
}

/// A webcam of 70° with barrel distortion.
fn webcam(width: u32, height: u32) -> Raster {
    let (cx, cy) = (f64::from(width) / 2.0 - 0.5, f64::from(height) / 2.0 - 0.5);
    let f = f64::from(width) / 1.4;
    let params = [f, f, cx + 3.0, cy - 2.0, -0.2, 0.05, 0.001, -0.0005, 0.0];
    let model = CameraModel::from_params(ModelKind::BrownConrady5, &params).unwrap();
    CameraRaster::new(model, [width, height], ImageCircle::default(), Rotation3::identity()).unwrap().into()
}

fn octahedral(side: u32) -> Raster {
    OctahedralRaster::new(side, Rotation3::from_euler_angles(0.3, -1.1, 0.7)).unwrap().into()
}

fn pinhole(width: u32, height: u32, fov_deg: f64) -> Raster {
    PinholeRaster::with_fov([width, height], fov_deg.to_radians(), Rotation3::identity()).unwrap().into()
}

fn lat_long(width: u32) -> Raster {
    LatLongRaster::new([width, width / 2], Rotation3::from_euler_angles(-0.4, 0.9, 2.0)).unwrap().into()
}

/// What each source pixel of radiance 1 brings into the destination, Σ weight · texel's solid angle · covered.
fn transported_sr(table: &RemapTable, destination: &Raster) -> Vec<f64> {
    let [width, height] = table.source_size_px();
    let mut transported = vec![0.0; (width * height) as usize];
    for (texel, texel_sr) in destination.solid_angles_sr().iter().enumerate() {
        for (pixel, weight) in table.entries(texel) {
            transported[pixel as usize] += f64::from(weight) * texel_sr * f64::from(table.covered()[texel]);
        }
    }
    transported
}

/// As [`transported_sr`] for a look-up by bilinear interpolation at the texel's centre.
fn point_sampled_sr(source: &Raster, destination: &Raster) -> Vec<f64> {
    let [width, height] = source.size_px();
    let mut transported = vec![0.0; (width * height) as usize];
    let [columns, _] = destination.size_px();
    for (texel, texel_sr) in (0_u32..).zip(destination.solid_angles_sr()) {
        let center = RasterPx::center_of(texel % columns, texel / columns);
        let Some(p) = destination.direction(center).and_then(|d| source.position(&d)) else {
            continue;
        };
        let p = p.to_camera().0;
        let (x, y) = (p.x.floor(), p.y.floor());
        let (u, v) = (p.x - x, p.y - y);
        for (dx, dy, weight) in [
            (0.0, 0.0, (1.0 - u) * (1.0 - v)),
            (1.0, 0.0, u * (1.0 - v)),
            (0.0, 1.0, (1.0 - u) * v),
            (1.0, 1.0, u * v),
        ] {
            let (x, y) = (x + dx, y + dy);
            if x >= 0.0 && y >= 0.0 && x < f64::from(width) && y < f64::from(height) {
                transported[(y as u32 * width + x as u32) as usize] += weight * texel_sr;
            }
        }
    }
    transported
}

/// The largest relative error of the flux of a lamp of 2×2 pixels that slides through the source along a slanted
/// line in steps of 0.1 px, anti-aliased, where `inside` says that it is in both rasters.
fn worst_flux_error(source: &Raster, transported: &[f64], inside: impl Fn(Vector3<f64>) -> bool) -> f64 {
    let [width, height] = source.size_px();
    let source_sr = source.solid_angles_sr();
    let (mut worst, mut steps) = (0.0_f64, 0);
    for k in 0..(width * 10) {
        let x0 = 2.0 + 0.1 * f64::from(k);
        let y0 = f64::from(height) * 0.5 + 0.35 * (x0 - f64::from(width) * 0.55);
        if x0 + 2.0 > f64::from(width) - 2.0 || y0 < 2.0 || y0 + 2.0 > f64::from(height) - 2.0 {
            continue;
        }
        let margin = 3.0;
        let corners = [
            (-margin, -margin),
            (2.0 + margin, -margin),
            (-margin, 2.0 + margin),
            (2.0 + margin, 2.0 + margin),
        ];
        let seen = corners
            .iter()
            .all(|(dx, dy)| source.direction(RasterPx::new(x0 + dx, y0 + dy)).is_some_and(&inside));
        if !seen {
            continue;
        }
        let (mut before, mut after) = (0.0, 0.0);
        for y in y0.floor() as u32..=(y0 + 2.0).floor() as u32 {
            for x in x0.floor() as u32..=(x0 + 2.0).floor() as u32 {
                let share = |at: u32, start: f64| {
                    (f64::from(at + 1).min(start + 2.0) - f64::from(at).max(start)).clamp(0.0, 1.0)
                };
                let radiance = share(x, x0) * share(y, y0);
                let index = (y * width + x) as usize;
                before += radiance * source_sr[index];
                after += radiance * transported[index];
            }
        }
        worst = worst.max((after / before - 1.0).abs());
        steps += 1;
    }
    assert!(steps > 300, "the lamp hardly moved: {steps} steps");
    worst
}

fn in_image(raster: &Raster, margin_px: f64) -> impl Fn(Vector3<f64>) -> bool + '_ {
    move |d| {
        let [w, h] = raster.size_px().map(f64::from);
        raster.position(&d).is_some_and(|p| {
            p.0.x > margin_px && p.0.y > margin_px && p.0.x < w - margin_px && p.0.y < h - margin_px
        })
    }
}

#[test]
fn the_flux_of_a_moving_lamp_is_kept() {
    let everywhere = |_: Vector3<f64>| true;
    for (name, source, destination) in [
        ("fish-eye to octahedral 256", fisheye(512), octahedral(256)),
        ("fish-eye to octahedral 128", fisheye(512), octahedral(128)),
        ("fish-eye to octahedral 512", fisheye(256), octahedral(512)),
        ("fish-eye to octahedral 1024", fisheye(128), octahedral(1024)),
        ("lat-long to octahedral", lat_long(512), octahedral(128)),
        ("octahedral to lat-long", octahedral(128), lat_long(300)),
        (
            "octahedral to octahedral",
            octahedral(200),
            OctahedralRaster::new(77, Rotation3::identity()).unwrap().into(),
        ),
    ] {
        let table = RemapTable::build(&source, &destination).unwrap();
        let error = worst_flux_error(&source, &transported_sr(&table, &destination), everywhere);
        let by_points = worst_flux_error(&source, &point_sampled_sr(&source, &destination), everywhere);
        println!("{name}: {error:.5}, point sampling {by_points:.3}");
        assert!(error < 0.01, "{name}: {error}");
        assert!(
            !name.starts_with("fish-eye to octahedral 128") || by_points > 3.0,
            "point sampling: {by_points}"
        );
    }
    for (name, source, destination) in [
        ("webcam to pinhole", webcam(320, 240), pinhole(200, 150, 66.0)),
        ("webcam to pinhole, denser", webcam(160, 120), pinhole(500, 375, 66.0)),
        ("pinhole to webcam", pinhole(400, 300, 80.0), webcam(320, 240)),
        ("octahedral to webcam", octahedral(512), webcam(160, 120)),
        ("octahedral to fish-eye", octahedral(256), fisheye(200)),
        ("fish-eye to pinhole", fisheye(512), pinhole(100, 100, 100.0)),
    ] {
        let table = RemapTable::build(&source, &destination).unwrap();
        let inside = in_image(&destination, 2.0);
        let error = worst_flux_error(&source, &transported_sr(&table, &destination), &inside);
        let by_points = worst_flux_error(&source, &point_sampled_sr(&source, &destination), &inside);
        println!("{name}: {error:.5}, point sampling {by_points:.3}");
        assert!(error < 0.01, "{name}: {error}");
    }
}

fn all_pairs() -> Vec<(&'static str, Raster, Raster)> {
    vec![
        ("fish-eye to octahedral", fisheye(128), octahedral(64)),
        ("fish-eye to fine octahedral", fisheye(64), octahedral(200)),
        ("fish-eye to pinhole", fisheye(128), pinhole(80, 60, 100.0)),
        ("fish-eye to lat-long", fisheye(128), lat_long(100)),
        ("webcam to octahedral of few texels", webcam(64, 48), octahedral(3)),
        ("webcam to one texel", webcam(64, 48), octahedral(1)),
        ("pinhole to webcam", pinhole(64, 48, 100.0), webcam(80, 60)),
        (
            "octahedral to octahedral",
            octahedral(33),
            OctahedralRaster::new(20, Rotation3::identity()).unwrap().into(),
        ),
        ("octahedral to one texel", octahedral(5), octahedral(1)),
        ("octahedral to fish-eye", octahedral(64), fisheye(50)),
        ("octahedral to lat-long", octahedral(40), lat_long(64)),
        ("lat-long to octahedral", lat_long(64), octahedral(40)),
        (
            "lat-long to lat-long",
            lat_long(64),
            LatLongRaster::new([50, 30], Rotation3::identity()).unwrap().into(),
        ),
        (
            "lat-long to aligned octahedral",
            lat_long_upright(64),
            OctahedralRaster::new(40, Rotation3::identity()).unwrap().into(),
        ),
    ]
}

fn lat_long_upright(width: u32) -> Raster {
    LatLongRaster::new([width, width / 2], Rotation3::identity()).unwrap().into()
}

/// Weights of a texel sum to exactly 1 in any order and precision, so a constant image comes out bit-identical.
#[test]
fn constant_radiance_stays_constant() {
    for (name, source, destination) in all_pairs() {
        let table = RemapTable::build(&source, &destination).unwrap();
        let [w, h] = source.size_px();
        let [columns, rows] = destination.size_px();
        let color = [1.0_f32, 0.1, 3.337e-5];
        let image = color.repeat((w * h) as usize);
        let mut out = vec![f32::NAN; 3 * (columns * rows) as usize];
        table.apply::<3>(&image, &mut out).unwrap();
        let mut seen = 0;
        for (pixel, covered) in out.chunks(3).zip(table.covered()) {
            assert!((0.0..=1.0).contains(covered), "{name}");
            if *covered > 0.0 {
                assert_eq!(pixel, color, "{name}");
                seen += 1;
            } else {
                assert_eq!(pixel, [0.0; 3], "{name}");
            }
        }
        assert!(seen > 0, "{name}: nothing seen");
    }
}

/// The covered part of the destination is what the source sees: its solid angle, and the integral of a smooth
/// function over it.
#[test]
fn the_whole_flux_arrives() {
    let radiance = |d: &Vector3<f64>| 1.0 + 0.5 * d.x - 0.3 * d.y * d.z + 0.4 * d.z * d.z;
    for (name, source, destination) in all_pairs() {
        if name.starts_with("pinhole") || name == "fish-eye to pinhole" || name.ends_with("to fish-eye") {
            continue; // these destinations see less than the source
        }
        let table = RemapTable::build(&source, &destination).unwrap();
        let [w, _] = source.size_px();
        let source_sr = source.solid_angles_sr();
        let image: Vec<f32> = (0..source_sr.len() as u32)
            .map(|i| source.direction(RasterPx::center_of(i % w, i / w)).map_or(0.0, |d| radiance(&d) as f32))
            .collect();
        let mut out = vec![0.0; table.covered().len()];
        table.apply::<1>(&image, &mut out).unwrap();
        let before: f64 = image.iter().zip(&source_sr).map(|(l, sr)| f64::from(*l) * sr).sum();
        let after: f64 = (0..out.len())
            .map(|i| f64::from(out[i] * table.covered()[i]) * destination.solid_angles_sr()[i])
            .sum();
        println!("{name}: {before:.6} {after:.6}");
        assert!((after / before - 1.0).abs() < 2e-3, "{name}: {before} {after}");
        if source.size_px()[0] > 30 && matches!(source, Raster::Octahedral(_) | Raster::LatLong(_)) {
            // ∫1 = 4π, ∫z² = 4π/3, the odd parts vanish. Sampling at pixel centres errs with the pixel's size².
            let integral = 4.0 * PI * (1.0 + 0.4 / 3.0);
            assert!((after / integral - 1.0).abs() < 3e-3, "{name}: {after} {integral}");
        }
    }
}

/// A linear ramp in the source's pixels comes out as the ramp's value at the footprint's middle: no shift by half a
/// pixel anywhere, whatever the scale.
#[test]
fn a_linear_gradient_is_not_biased() {
    for (columns, rows) in [(25, 20), (50, 40), (100, 80), (130, 104), (200, 160), (330, 264)] {
        let source = pinhole(100, 80, 40.0);
        let destination = pinhole(columns, rows, 40.0);
        let table = RemapTable::build(&source, &destination).unwrap();
        let ramp: Vec<f32> = (0..8000).map(|i| (i % 100) as f32 + 1000.0 * (i / 100) as f32).collect();
        let mut out = vec![0.0; (columns * rows) as usize];
        table.apply::<1>(&ramp, &mut out).unwrap();
        let scale = 100.0 / f64::from(columns);
        let mut mean = 0.0;
        let mut worst = 0.0_f64;
        for y in rows / 8..rows - rows / 8 {
            for x in columns / 8..columns - columns / 8 {
                let at = |k: u32| (f64::from(k) + 0.5) * scale - 0.5;
                let error = f64::from(out[(y * columns + x) as usize]) - (at(x) + 1000.0 * at(y));
                mean += error;
                worst = worst.max(error.abs() / 1000.0);
            }
        }
        mean /= f64::from((columns - columns / 8 * 2) * (rows - rows / 8 * 2)) * 1000.0;
        println!("{columns}: mean {mean:.2e} px, worst {worst:.4} px");
        // Between magnification 1 and 2 the blend with boxes steps by up to ¼ px times their share; the mean stays.
        // The density of solid angle shifts a wide footprint's mean: footprint² · 3 tan θ / (12 f) px < 0.01 px.
        assert!(mean.abs() < 1e-3, "{columns}: {mean}");
        assert!(worst < 0.12, "{columns}: {worst}");
    }
}

/// Twofold magnification and more interpolates: no squares of the source to be seen.
#[test]
fn magnification_is_smooth() {
    let (source, destination) = (pinhole(20, 20, 40.0), pinhole(160, 160, 40.0));
    let table = RemapTable::build(&source, &destination).unwrap();
    let ramp: Vec<f32> = (0..400).map(|i| (i % 20) as f32).collect();
    let mut out = vec![0.0; 160 * 160];
    table.apply::<1>(&ramp, &mut out).unwrap();
    for x in 16..143 {
        let step = out[80 * 160 + x + 1] - out[80 * 160 + x];
        assert!((step - 0.125).abs() < 0.01, "{x}: {step}");
    }
}

/// A raster to itself is the identity: one entry a pixel, fully covered, also along the border and the rim.
#[test]
fn a_raster_to_itself_is_the_identity() {
    for raster in [pinhole(50, 40, 70.0), webcam(64, 48), fisheye(60), octahedral(24), lat_long(40)] {
        let table = RemapTable::build(&raster, &raster).unwrap();
        for (pixel, sr) in raster.solid_angles_sr().iter().enumerate() {
            let entries: Vec<_> = table.entries(pixel).collect();
            if *sr > 0.0 {
                assert_eq!(entries, [(pixel as u32, 1.0)], "{raster:?}");
                assert_eq!(table.covered()[pixel], 1.0);
            } else {
                assert!(entries.is_empty());
            }
        }
    }
}

#[test]
fn there_and_back_is_close() {
    let camera = fisheye(256);
    let map = octahedral(512);
    let there = RemapTable::build(&camera, &map).unwrap();
    let back = RemapTable::build(&map, &camera).unwrap();
    // Waves of 16 px, a tenth of a radian.
    let image: Vec<f32> = (0..256 * 256)
        .map(|i| {
            let (x, y) = ((i % 256) as f32, (i / 256) as f32);
            1.0 + 0.5 * (x * 0.39).sin() * (y * 0.39).cos()
        })
        .collect();
    let mut on_map = vec![0.0; 512 * 512];
    there.apply::<1>(&image, &mut on_map).unwrap();
    let mut again = vec![0.0; 256 * 256];
    back.apply::<1>(&on_map, &mut again).unwrap();
    let (mut sum, mut count) = (0.0, 0);
    for (i, (a, b)) in image.iter().zip(&again).enumerate() {
        let (x, y) = ((i % 256) as f32 - 127.5, (i / 256) as f32 - 127.5);
        if x.hypot(y) < 122.0 {
            sum += (a - b) * (a - b);
            count += 1;
        }
    }
    let rmse = (sum / count as f32).sqrt();
    // In each axis a tent of 1 px and boxes of ½ and 1 px: sinc(1/16)³ sinc(1/32) = 0.98 of the wave is left, in both
    // 0.96; lost are 0.04 × 0.5, a root mean square of 0.01.
    println!("round trip {rmse}");
    assert!(rmse < 0.02, "{rmse}");
}

/// A map of the sphere covers all of every other; half a sphere covers half a map.
#[test]
fn covered_fractions_are_what_the_source_sees() {
    for source in [octahedral(50), lat_long(80)] {
        for destination in [octahedral(31), lat_long(40), fisheye(64)] {
            let table = RemapTable::build(&source, &destination).unwrap();
            for (covered, sr) in table.covered().iter().zip(destination.solid_angles_sr()) {
                assert_eq!(*covered, if sr > 0.0 { 1.0 } else { 0.0 });
            }
        }
    }
    let (source, destination) = (fisheye(400), octahedral(40));
    let table = RemapTable::build(&source, &destination).unwrap();
    let seen_sr: f64 =
        table.covered().iter().map(|c| f64::from(*c)).sum::<f64>() * destination.solid_angles_sr()[0];
    let cone_sr = 2.0 * PI * (1.0 - 93_f64.to_radians().cos());
    // Pixels cut by the circle count as unseen: half a pixel of 400 around the rim.
    assert!(seen_sr < cone_sr && seen_sr > 0.985 * cone_sr, "{seen_sr} {cone_sr}");
    let partial = table.covered().iter().filter(|c| **c > 0.0 && **c < 1.0).count();
    assert!(partial > 40, "{partial}");
}

#[test]
fn pixels_outside_the_image_circle_never_contribute() {
    let source = fisheye(128);
    let table = RemapTable::build(&source, &octahedral(64)).unwrap();
    // The black frame around the circle is made glaring.
    let image: Vec<f32> =
        source.solid_angles_sr().iter().map(|sr| if *sr > 0.0 { 1.0 } else { 1e9 }).collect();
    let mut out = vec![0.0; 64 * 64];
    table.apply::<1>(&image, &mut out).unwrap();
    assert!(out.iter().all(|v| *v == 0.0 || *v == 1.0));
}

#[test]
fn solid_angles_agree_with_closed_forms() {
    let sum = |raster: &Raster| raster.solid_angles_sr().iter().sum::<f64>();
    assert!((sum(&octahedral(7)) - 4.0 * PI).abs() < 1e-12);
    assert!((sum(&lat_long(20)) - 4.0 * PI).abs() < 1e-12);
    // A square pyramid of half angle 45°: 4 asin(sin²45°) = 2π/3, one face of a cube.
    assert!((sum(&pinhole(9, 9, 90.0)) - 2.0 * PI / 3.0).abs() < 1e-12);
    for side in [64, 1024] {
        let cone = 2.0 * PI * (1.0 - 93_f64.to_radians().cos());
        let missing = 1.0 - sum(&fisheye(side)) / cone;
        assert!(missing > 0.0 && missing < 3.0 / f64::from(side), "{side}: {missing}");
    }
}

#[test]
fn absurd_sizes_and_lengths_are_errors() {
    for side in [0, 16385, u32::MAX] {
        let error = OctahedralRaster::new(side, Rotation3::identity()).unwrap_err().to_string();
        assert!(error.contains(&side.to_string()) && error.contains("16384"), "{error}");
        assert!(LatLongRaster::new([4, side], Rotation3::identity()).is_err());
        assert!(PinholeRaster::with_fov([side, 4], 1.0, Rotation3::identity()).is_err());
    }
    for fov in [0.0, -1.0, PI, f64::NAN] {
        assert!(PinholeRaster::with_fov([4, 4], fov, Rotation3::identity()).is_err());
    }
    let not_a_rotation = Rotation3::from_matrix_unchecked(nalgebra::Matrix3::from_element(f64::NAN));
    assert!(OctahedralRaster::new(4, not_a_rotation).is_err());
    let table = RemapTable::build(&pinhole(4, 4, 40.0), &octahedral(2)).unwrap();
    let error = table.apply::<3>(&[0.0; 47], &mut [0.0; 12]).unwrap_err().to_string();
    assert!(error.contains("47") && error.contains("48") && error.contains("source"), "{error}");
    assert!(table.apply::<1>(&[0.0; 16], &mut [0.0; 5]).is_err());
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 96, failure_persistence: None, ..ProptestConfig::default() })]

    /// Any lens that the models accept gives a table without NaN, with weights that sum to one.
    #[test]
    fn no_lens_breaks_a_table(
        kind in 0..6_usize,
        f in 1.0..200.0_f64,
        center in (-50.0..100.0_f64, -50.0..100.0_f64),
        k in prop::array::uniform8(-2.0..2.0_f64),
        to_map in prop::bool::ANY,
    ) {
        let kind = [
            ModelKind::Pinhole, ModelKind::BrownConrady5, ModelKind::Rational8,
            ModelKind::KannalaBrandt4, ModelKind::DoubleSphere, ModelKind::Eucm,
        ][kind];
        let mut params = vec![f, f * 1.1, center.0, center.1];
        params.extend(k);
        params.truncate(kind.param_names().len());
        let Ok(model) = CameraModel::from_params(kind, &params) else { return Ok(()) };
        let camera: Raster =
            CameraRaster::new(model, [40, 30], ImageCircle::default(), Rotation3::identity()).unwrap().into();
        let map = octahedral(16);
        let (source, destination) = if to_map { (camera, map) } else { (map, camera) };
        let table = RemapTable::build(&source, &destination).unwrap();
        for texel in 0..table.covered().len() {
            let sum: f64 = table.entries(texel).map(|(_, w)| f64::from(w)).sum();
            let covered = table.covered()[texel];
            prop_assert!((0.0..=1.0).contains(&covered));
            prop_assert_eq!(sum, if covered > 0.0 { 1.0 } else { 0.0 });
            prop_assert!(table.entries(texel).all(|(i, w)| w > 0.0 && i < 4096));
        }
    }
}
