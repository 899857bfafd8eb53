//! Figures against closed forms, and inputs that do not fit.
#![allow(clippy::unwrap_used, reason = "helpers of tests panic as tests do")]

use std::sync::Arc;

use coshade_image_file::{BitDepth, Image, LayeredImage, Precision, write_exr, write_png};
use coshade_reference::compare::{
    CompareArgs, CompareError, CompareOptions, Comparison, DisplayTransform, Named, compare,
    difference_picture, flip_picture, run,
};
use glam::Vec3;

fn colour(width: usize, height: usize, pixel: impl Fn(usize, usize) -> Vec3) -> Image {
    let pixels: Vec<Vec3> = (0..width * height).map(|i| pixel(i % width, i / width)).collect();
    Image::from_rgb(width, height, &pixels).unwrap()
}

fn measure(a: &Image, b: &Image, options: &CompareOptions<'_>) -> Result<Comparison, CompareError> {
    compare(Named { name: "a.exr", image: a }, Named { name: "b.exr", image: b }, options)
}

fn close(value: Option<f64>, expected: f64) -> bool {
    // Inputs are f32: seven digits.
    value.is_some_and(|value| (value - expected).abs() <= 1e-6 * expected.abs().max(1.0))
}

#[test]
fn constant_difference() {
    let a = colour(20, 16, |_, _| Vec3::new(0.5, 6.0, 0.25));
    let b = colour(20, 16, |_, _| Vec3::new(0.25, 3.0, 0.5));
    let figures = measure(&a, &b, &CompareOptions::default()).unwrap().report.all;
    // Clipped at 4, green differs by 1 only.
    assert!(close(figures.rmse_linear, ((0.0625f64 + 1.0 + 0.0625) / 3.0).sqrt()));
    assert!(close(figures.rmse_linear_unclipped, ((0.0625f64 + 9.0 + 0.0625) / 3.0).sqrt()));
    assert!(close(figures.max_abs_difference, 3.0));
    assert_eq!(figures.mean_difference["R"], 0.25);
    assert_eq!(figures.mean_difference["B"], -0.25);
    let display = coshade_image_file::srgb::encode;
    let step = display(0.5) - display(0.25);
    let rmse_display = (2.0 * step * step / 3.0).sqrt();
    assert!(close(figures.rmse_display, rmse_display));
    assert!(close(figures.psnr_db, -20.0 * rmse_display.log10()));
}

#[test]
fn identical_images() {
    let a = colour(16, 16, |x, y| Vec3::new(x as f32, y as f32, 0.5) / 16.0);
    let report = measure(&a, &a, &CompareOptions::default()).unwrap().report;
    assert!(report.identical);
    assert_eq!((report.all.rmse_linear, report.all.psnr_db), (Some(0.0), None));
    assert_eq!((report.all.ssim, report.all.flip_mean), (Some(1.0), Some(0.0)));
    let json = serde_json::to_value(&report).unwrap();
    assert!(json["psnr_db"].is_null() && json["sets"].is_null());
    assert!(report.to_string().contains("identical"));
}

#[test]
fn tiny_images_have_no_ssim_and_do_not_crash() {
    for (width, height) in [(1, 1), (1, 30), (10, 11), (3, 2)] {
        let a = colour(width, height, |_, _| Vec3::splat(0.2));
        let b = colour(width, height, |_, _| Vec3::splat(0.4));
        let comparison = measure(&a, &b, &CompareOptions::default()).unwrap();
        assert_eq!(comparison.report.all.ssim, None);
        assert!(comparison.report.all.flip_mean.unwrap() > 0.0);
        assert!(comparison.report.notes.iter().any(|note| note.contains("no SSIM")));
        difference_picture(&comparison, None).unwrap();
        flip_picture(&comparison).unwrap();
    }
}

#[test]
fn sets_follow_coverage() {
    let step = |x: usize| [0.1, 0.2, 0.4][x / 8];
    let a = colour(24, 12, |x, _| Vec3::splat(0.3 + step(x)));
    let b = colour(24, 12, |_, _| Vec3::splat(0.3));
    let shares = (0..24 * 12).map(|i| [0.0, 1.0, 0.5][i % 24 / 8]).collect();
    let coverage = Image::from_plane(24, 12, "Y", shares).unwrap();
    let options = CompareOptions {
        coverage: Some(Named { name: "truth.exr#coverage", image: &coverage }),
        ..CompareOptions::default()
    };
    let sets = measure(&a, &b, &options).unwrap().report.sets.unwrap();
    for (figures, expected) in [(&sets.real, 0.1), (&sets.virtual_, 0.2), (&sets.edge, 0.4)] {
        assert_eq!(figures.pixels, 8 * 12);
        assert!((figures.rmse_linear.unwrap() - expected).abs() < 1e-6);
    }
    let json = serde_json::to_value(&sets).unwrap();
    assert!(json["virtual"]["rmse_linear"].is_number());
}

#[test]
fn an_empty_set_has_no_figures() {
    let a = colour(4, 4, |_, _| Vec3::ONE);
    let coverage = Image::from_plane(4, 4, "Y", vec![0.0; 16]).unwrap();
    let options =
        CompareOptions { coverage: Some(Named { name: "c", image: &coverage }), ..CompareOptions::default() };
    let sets = measure(&a, &a, &options).unwrap().report.sets.unwrap();
    assert_eq!((sets.edge.pixels, sets.edge.rmse_linear), (0, None));
}

#[test]
fn coverage_must_be_a_share_and_of_the_size() {
    let a = colour(4, 4, |_, _| Vec3::ONE);
    let with = |coverage: &Image| {
        let coverage = Some(Named { name: "truth.exr#coverage", image: coverage });
        measure(&a, &a, &CompareOptions { coverage, ..CompareOptions::default() }).unwrap_err().to_string()
    };
    let mut shares = vec![0.0; 16];
    shares[6] = 1.5;
    let message = with(&Image::from_plane(4, 4, "Y", shares).unwrap());
    assert!(message.contains("truth.exr#coverage") && message.contains("1.5 at pixel (2, 1)"), "{message}");
    let message = with(&Image::from_plane(2, 4, "Y", vec![f32::NAN; 8]).unwrap());
    assert!(message.contains("2x4") && message.contains("4x4"), "{message}");
}

#[test]
fn non_finite_pixels_are_left_out_and_counted() {
    let b = colour(24, 24, |_, _| Vec3::splat(0.5));
    let odd = |x: usize, y: usize| match (x, y) {
        (3, 3) => Vec3::new(f32::NAN, 0.5, 0.5),
        (9, 20) => Vec3::new(0.5, f32::INFINITY, 0.5),
        _ => Vec3::splat(0.5),
    };
    let a = colour(24, 24, odd);
    let report = measure(&a, &b, &CompareOptions::default()).unwrap().report;
    assert_eq!((report.all.pixels, report.all.pixels_excluded), (574, 2));
    assert_eq!((report.a.nan_samples, report.a.infinite_samples), (1, 1));
    assert_eq!((report.all.rmse_linear, report.all.flip_mean), (Some(0.0), Some(0.0)));
    assert!(report.notes.iter().any(|note| note.starts_with("2 pixels")));
    let nothing = colour(24, 24, |_, _| Vec3::NAN);
    let report = measure(&nothing, &b, &CompareOptions::default()).unwrap().report;
    assert_eq!((report.all.pixels, report.all.rmse_linear, report.all.ssim), (0, None, None));
}

#[test]
fn exposure_and_response_change_only_what_is_displayed() {
    let a = colour(12, 12, |_, _| Vec3::splat(0.1));
    let b = colour(12, 12, |_, _| Vec3::splat(0.2));
    let with = |exposure_ev, response| {
        let display = DisplayTransform { exposure_ev, response };
        measure(&a, &b, &CompareOptions { display, ..CompareOptions::default() }).unwrap().report.all
    };
    let linear = with(1.0, Some(Arc::new(|_: usize, radiance: f32| radiance)));
    assert!(close(linear.rmse_linear, 0.1));
    assert!(close(linear.rmse_display, 0.2));
    let display = DisplayTransform { exposure_ev: 0.0, response: Some(Arc::new(|_, _| f32::NAN)) };
    let error = measure(&a, &b, &CompareOptions { display, ..CompareOptions::default() }).unwrap_err();
    assert!(matches!(error, CompareError::Response { channel: 0, .. }), "{error}");
}

#[test]
fn data_layers_are_compared_unclipped_without_display_figures() {
    let depth = |value: f32| Image::from_plane(12, 12, "Z", vec![value; 144]).unwrap();
    let comparison = measure(&depth(10.0), &depth(12.0), &CompareOptions::default()).unwrap();
    let report = &comparison.report;
    assert_eq!((report.clip_white, report.all.rmse_linear), (None, Some(2.0)));
    assert_eq!((report.all.psnr_db, report.all.ssim, report.all.flip_mean), (None, None, None));
    assert!(matches!(flip_picture(&comparison), Err(CompareError::NotColour { .. })));
}

#[test]
fn images_that_do_not_fit_are_both_named() {
    let a = colour(4, 4, |_, _| Vec3::ONE);
    let message = |b: &Image| measure(&a, b, &CompareOptions::default()).unwrap_err().to_string();
    for (b, words) in [
        (colour(5, 4, |_, _| Vec3::ONE), ["4x4", "5x4"]),
        (Image::from_plane(4, 4, "Y", vec![1.0; 16]).unwrap(), ["R G B", " Y"]),
    ] {
        let message = message(&b);
        assert!(message.contains("a.exr") && message.contains("b.exr"), "{message}");
        assert!(words.iter().all(|word| message.contains(word)), "{message}");
    }
}

#[test]
fn options_out_of_range_are_named() {
    let a = colour(4, 4, |_, _| Vec3::ONE);
    for clip_white in [0.0, -1.0, f32::NAN, f32::INFINITY] {
        let options = CompareOptions { clip_white, ..CompareOptions::default() };
        assert!(measure(&a, &a, &options).unwrap_err().to_string().contains("clip"));
    }
    let display = DisplayTransform { exposure_ev: f32::NAN, response: None };
    let options = CompareOptions { display, ..CompareOptions::default() };
    assert!(measure(&a, &a, &options).unwrap_err().to_string().contains("exposure"));
    let comparison = measure(&a, &a, &CompareOptions::default()).unwrap();
    assert!(difference_picture(&comparison, Some(0.0)).is_err());
}

#[test]
fn the_largest_finite_values_do_not_overflow() {
    let a = Image::from_plane(2, 1, "Z", vec![f32::MAX, 0.0]).unwrap();
    let b = Image::from_plane(2, 1, "Z", vec![f32::MIN, 0.0]).unwrap();
    let comparison = measure(&a, &b, &CompareOptions::default()).unwrap();
    assert!(comparison.report.all.rmse_linear.unwrap().is_finite());
    assert!(difference_picture(&comparison, None).unwrap().limit.is_finite());
}

#[test]
fn files_with_layers_and_pictures() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let text = |name: &str| path(name).to_string_lossy().into_owned();
    let mut file = LayeredImage::default();
    file.push("real", colour(40, 30, |x, _| Vec3::splat(x as f32 / 40.0))).unwrap();
    file.push("mixed", colour(40, 30, |x, _| Vec3::splat(x as f32 / 50.0))).unwrap();
    write_exr(path("truth.exr"), &file, Precision::Float).unwrap();
    write_png(path("shot.png"), file.layer("mixed").unwrap(), BitDepth::Sixteen).unwrap();

    let mut args = CompareArgs::new(text("shot.png"), text("truth.exr#mixed"));
    args.diff = Some(path("diff.png"));
    args.flip = Some(path("flip.png"));
    // 16-bit codes: half a code step, at most 2.3 / 65535 / 2 in linear radiance.
    assert!(run(&args).unwrap().all.max_abs_difference.unwrap() < 2e-5);
    for picture in ["diff.png", "flip.png"] {
        let decoded = image::open(path(picture)).unwrap();
        assert!(decoded.width() >= 40 && decoded.height() > 30);
    }
    let mut args = CompareArgs::new(text("truth.exr"), text("truth.exr#real"));
    assert!(run(&args).unwrap_err().to_string().contains("mixed [R G B]"));
    args.layer = Some("mixed".into());
    assert!(run(&args).unwrap().all.rmse_linear.unwrap() > 0.01);
}
