//! What was asked of a depth sensor, measured back from its images.

use coshade_sim::sensor::{DepthSensor, DepthSpec};
use coshade_sim::tracer::DepthSample;

const SIZE: [u32; 2] = [64, 48];
const PIXELS: usize = 64 * 48;

fn spec() -> DepthSpec {
    DepthSpec { step_m_at_1m: 0.0, lateral_sigma_px: 0.0, unit_m: 0.0001, ..DepthSpec::default() }
}

fn wall(z_m: f32, angle_rad: f32) -> Vec<DepthSample> {
    vec![DepthSample { z_m, cos_incidence: angle_rad.cos() }; PIXELS]
}

fn measured_m(spec: DepthSpec, truth: &[DepthSample], frames: u64) -> Vec<f64> {
    let sensor = DepthSensor::new(spec, SIZE, 1, 2);
    let counts = (0..frames).flat_map(|frame| sensor.counts(truth, frame));
    counts.filter(|count| *count > 0).map(|count| f64::from(count) * spec.unit_m).collect()
}

fn mean_and_sigma(values: &[f64]) -> (f64, f64) {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    (mean, (values.iter().map(|z| (z - mean).powi(2)).sum::<f64>() / count).sqrt())
}

#[test]
fn the_axial_error_grows_with_the_square_of_the_distance() {
    for z_m in [0.8_f32, 1.5, 2.5, 4.0] {
        let values = measured_m(spec(), &wall(z_m, 0.0), 8);
        assert_eq!(values.len(), PIXELS * 8);
        let (mean, sigma) = mean_and_sigma(&values);
        let expected = 0.001_425 * f64::from(z_m).powi(2);
        // Counts of 0.1 mm add 1/12 of their square.
        let expected = (expected * expected + 1e-8 / 12.0).sqrt();
        let error = (0.5 / values.len() as f64).sqrt();
        assert!(
            5.0 * error < 0.05 && (sigma / expected - 1.0).abs() < 5.0 * error,
            "{z_m}: {sigma} {expected}"
        );
        assert!(
            (mean - f64::from(z_m)).abs() < 5.0 * expected / (values.len() as f64).sqrt(),
            "{z_m}: {mean}"
        );
    }
}

#[test]
fn slanted_surfaces_are_noisier_and_grazing_ones_are_not_seen() {
    let angle_rad = 1.3_f32;
    let (_, sigma) = mean_and_sigma(&measured_m(spec(), &wall(2.0, angle_rad), 8));
    let rest = std::f64::consts::FRAC_PI_2 - 1.3;
    let expected = 0.001_425 * 4.0 + 0.0001 / 2.0_f64.sqrt() * (1.3 / rest).powi(2);
    assert!(
        (sigma / expected - 1.0).abs() < 5.0 * (0.5 / (PIXELS * 8) as f64).sqrt() + 1e-3,
        "{sigma} {expected}"
    );
    assert!(measured_m(spec(), &wall(2.0, 1.45), 1).is_empty(), "1.45 rad is 83°");
}

#[test]
fn depth_comes_in_steps_of_disparity() {
    let spec = DepthSpec { sigma_m_at_1m: 0.002, step_m_at_1m: 0.003, ..spec() };
    for z_m in [1.0_f32, 3.0] {
        let mut values = measured_m(spec, &wall(z_m, 0.0), 4);
        let (_, sigma) = mean_and_sigma(&values);
        // Uniform error within a step (noise is two thirds of a step wide: Sheppard's correction holds to 1e-4).
        let (noise, step) = (0.002 * f64::from(z_m * z_m), 0.003 * f64::from(z_m * z_m));
        let expected = (noise * noise + step * step / 12.0).sqrt();
        assert!((sigma / expected - 1.0).abs() < 0.02, "{z_m}: {sigma} {expected}");
        values.sort_by(f64::total_cmp);
        values.dedup();
        for pair in values.windows(2) {
            let (middle, apart) = ((pair[0] + pair[1]) / 2.0, 1.0 / pair[0] - 1.0 / pair[1]);
            // A count is 0.1 mm, so a difference is known to 0.1 mm; outer steps may be missing.
            let steps = apart / 0.003;
            assert!(
                (steps - steps.round()).abs() < 1e-4 / (0.003 * middle * middle) + 1e-6 && steps > 0.5,
                "{steps}"
            );
        }
    }
}

#[test]
fn edges_have_holes_on_their_farther_side() {
    let truth: Vec<DepthSample> = (0..PIXELS)
        .map(|pixel| DepthSample { z_m: if pixel % 64 < 20 { 1.0 } else { 2.0 }, cos_incidence: 1.0 })
        .collect();
    let sensor = DepthSensor::new(DepthSpec { edge_hole_px: 2, ..spec() }, SIZE, 1, 2);
    for (pixel, count) in sensor.counts(&truth, 0).into_iter().enumerate() {
        assert_eq!(count == 0, (20..22).contains(&(pixel % 64)), "{pixel}");
    }
}

#[test]
fn edges_tremble_sideways() {
    let truth: Vec<DepthSample> = (0..PIXELS)
        .map(|pixel| DepthSample { z_m: if pixel % 64 < 32 { 1.0 } else { 2.0 }, cos_incidence: 1.0 })
        .collect();
    let sigma_px = 2.0;
    let spec = DepthSpec { lateral_sigma_px: sigma_px, edge_hole_px: 0, sigma_m_at_1m: 0.0, ..spec() };
    let sensor = DepthSensor::new(spec, SIZE, 1, 2);
    let frames = 60;
    let near = (0..frames).flat_map(|frame| sensor.counts(&truth, frame).into_iter().enumerate());
    let strayed = near.filter(|(pixel, count)| pixel % 64 >= 32 && *count < 15_000).count() as f64;
    // Pixels of the farther side that see the nearer one: in a row Σₖ P(X ≥ k) = E[max(X, 0)] = σ/√2π, at most that variance.
    let rows = (48 * frames) as f64;
    let expected = rows * sigma_px / std::f64::consts::TAU.sqrt();
    assert!((strayed - expected).abs() < 5.0 * expected.sqrt(), "{strayed} {expected}");
}

#[test]
fn nothing_is_measured_out_of_range_or_where_nothing_is() {
    for z_m in [0.3, 6.0, f32::INFINITY, f32::NAN, 0.0, -1.0] {
        assert!(measured_m(spec(), &wall(z_m, 0.0), 1).is_empty(), "{z_m}");
    }
}
