use super::*;
use crate::differential::{Split, Worlds};
use crate::integrator::FirstHit;

fn split(shared: f32, real_only: f32, mixed_only: f32) -> Split {
    let mut split = Split::default();
    split.add(Worlds::BOTH, Vec3::splat(shared));
    split.add(Worlds::REAL, Vec3::splat(real_only));
    split.add(Worlds::MIXED, Vec3::splat(mixed_only));
    split
}

fn film(samples: u32, shard: Option<ShardMark>) -> Film {
    let pixel = |index: u32| {
        let mut sums = PixelSums::default();
        for sample in 0..samples {
            let first = FirstHit {
                range_m: 1.0 + index as f32,
                normal: Vec3::new(0.6, 0.0, 0.8),
                albedo: Vec3::new(0.1, 0.2, 0.3),
                is_virtual: sample % 2 == 0,
            };
            let hit = index != 3;
            assert!(sums.add(&split(sample as f32 / 3.0, 0.1, 0.7), hit.then_some(&first), 0.5));
        }
        sums.finish()
    };
    let pixels = (0..6).map(pixel).collect();
    Film { size_px: [3, 2], depth_is_range: false, pixels, shard, rejected_samples: 0 }
}

/// Samples 0, 1, …, n−1: mean (n−1)/2, variance of the mean (n+1)/12.
#[test]
fn means_and_variances_are_those_of_the_textbook() {
    let mut sums = PixelSums::default();
    for sample in 0..9 {
        assert!(sums.add(&split(100.0, 0.0, sample as f32), None, 1.0));
    }
    let pixel = sums.finish();
    assert_eq!(pixel.real, Vec3::splat(100.0));
    assert_eq!(pixel.mixed, Vec3::splat(104.0));
    assert_eq!(pixel.difference, Vec3::splat(4.0));
    assert_eq!(pixel.variance_real, Vec3::ZERO);
    assert!((pixel.variance - 10.0 / 12.0).abs().max_element() < 1e-6);
    assert!((pixel.variance_mixed - 10.0 / 12.0).abs().max_element() < 1e-6);
    assert_eq!(pixel.depth_m, 0.0);
}

#[test]
fn one_sample_says_nothing_about_its_error() {
    let mut sums = PixelSums::default();
    assert_eq!(sums.finish(), FilmPixel::default());
    assert!(sums.add(&split(1.0, 0.0, 0.0), None, 1.0));
    assert_eq!(sums.finish().variance, Vec3::INFINITY);
}

#[test]
fn samples_that_are_no_radiance_are_left_out() {
    let mut sums = PixelSums::default();
    assert!(!sums.add(&split(f32::NAN, 0.0, 0.0), None, 1.0));
    assert!(!sums.add(&split(0.0, f32::INFINITY, 0.0), None, 1.0));
    assert_eq!(sums.finish().samples, 0);
}

#[test]
fn a_film_survives_its_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("film.exr");
    for shard in [None, Some(ShardMark { index: 2, count: 7, key: ShardMark::key_of(0xfedc_ba98_7654_3210) })]
    {
        for depth_is_range in [false, true] {
            let film = Film { depth_is_range, ..film(5, shard) };
            film.write(&path, Precision::Float).unwrap();
            assert_eq!(Film::read(&path).unwrap(), film);
        }
    }
    let pixel = *film(5, None).pixel(1, 0).unwrap();
    assert_eq!((pixel.depth_m, pixel.coverage), (1.0, 0.6));
    assert_eq!(film(5, None).pixel(0, 1).unwrap().depth_m, 0.0);
    assert!(film(5, None).pixel(3, 0).is_none());
}

#[test]
fn a_picture_of_something_else_is_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("other.exr");
    let image = coshade_image_file::Image::from_rgb(1, 1, &[Vec3::ONE]).unwrap();
    write_exr(&path, &coshade_image_file::LayeredImage::single(image), Precision::Float).unwrap();
    let message = Film::read(&path).unwrap_err().to_string();
    assert!(message.contains("other.exr") && message.contains("samples"), "{message}");
}

#[test]
fn shards_that_do_not_belong_together_are_refused() {
    let part = |index, key| film(5, Some(ShardMark { index, count: 2, key }));
    assert!(merge(&[part(1, 9), part(0, 9)]).is_ok());
    assert_eq!(merge(&[]), Err(MergeError::Nothing));
    assert_eq!(merge(&[part(0, 9), film(5, None)]), Err(MergeError::NotAShard(2)));
    assert_eq!(merge(&[part(0, 9), part(1, 8)]), Err(MergeError::OtherJob(2)));
    assert_eq!(merge(&[part(1, 9), part(1, 9)]), Err(MergeError::Twice { index: 2, count: 2 }));
    let absurd = film(5, Some(ShardMark { index: 0, count: u32::MAX, key: 9 }));
    assert_eq!(merge(&[absurd]), Err(MergeError::NotAShard(1)));
    assert_eq!(merge(&[part(1, 9)]), Err(MergeError::Missing { missing: vec![1], count: 2 }));
}

#[test]
fn the_relative_error_is_that_of_the_difference() {
    let figures = FilmFigures {
        samples_min: 4,
        difference_rms: 5.0,
        difference_error_rms: 3.0,
        mixed_rms: 100.0,
        mixed_error_rms: 1.0,
    };
    assert_eq!(figures.relative_error(), 0.75);
    let same = FilmFigures { difference_rms: 0.0, difference_error_rms: 0.0, ..figures };
    assert!((same.relative_error() - 0.01).abs() < 1e-4);
    let black = FilmFigures { mixed_rms: 0.0, mixed_error_rms: 0.0, ..same };
    assert_eq!(black.relative_error(), 0.0);
    assert_eq!(film(9, None).figures().samples_min, 9);
}
