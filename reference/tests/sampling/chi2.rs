//! Pearson's χ² test of drawn directions against the density they claim.
//!
//! The sphere is cut into cells of equal solid angle (z × φ around an axis of the caller's choice, which should be the
//! peak of narrow lobes, with cells that shrink towards it). The expected count of a cell is the integral of the density
//! over it, by a Gauss–Legendre rule refined until it stands; cells that expect fewer than 5 are put together.
//!
//! All tests of the suite share a chance of 1e-3 to fail although everything is right: by Šidák's rule each test may
//! fail with 1 − (1 − 10⁻³)^(1/TESTS). Random numbers are fixed, so a test that passes goes on passing.

use glam::{Vec2, Vec3};

/// At least the number of χ² tests in the suite.
const TESTS: f64 = 400.0;

/// What is drawn and by which density.
pub struct Sampling<'a> {
    /// For the message.
    pub name: String,
    /// A unit direction, or `None` for draws that count as lost.
    pub sample: &'a dyn Fn(Vec2, f32) -> Option<Vec3>,
    /// Per steradian.
    pub pdf: &'a dyn Fn(Vec3) -> f64,
    /// Axis of the cells.
    pub axis: Vec3,
    /// Cells are equal in (1 − cosθ)^(1/power): 1 for equal solid angles, more for cells that crowd around the axis.
    pub crowding: f64,
}

const RINGS: usize = 24;
const SECTORS: usize = 32;
const SAMPLES: u32 = 40_000;

impl Sampling<'_> {
    /// Fails if the draws contradict the density. Returns the integral of the density.
    pub fn check(&self) -> f64 {
        let mut observed = vec![0_u32; RINGS * SECTORS];
        let mut kept = 0_u32;
        for index in 0..SAMPLES {
            // Plain random numbers: χ² assumes that draws are independent, stratified ones are too good.
            let number = |dimension| unit_float(hash_words(&[index, dimension, 0xc41]));
            if let Some(direction) = (self.sample)(Vec2::new(number(0), number(1)), number(2)) {
                assert!(
                    (direction.length() - 1.0).abs() < 1e-5,
                    "{}: |wi| = {}",
                    self.name,
                    direction.length()
                );
                observed[self.cell_of(direction)] += 1;
                kept += 1;
            }
        }
        let expected: Vec<f64> = (0..RINGS * SECTORS).map(|cell| self.integral(cell)).collect();
        let total: f64 = expected.iter().sum();
        assert!(total < 1.0 + 3e-3, "{}: the density integrates to {total}", self.name);
        self.check_kept(kept, total);
        let (statistic, degrees) = chi2(&observed, &expected);
        let p = chi2_survival(statistic, degrees);
        let significance = 1.0 - (1.0 - 1e-3_f64).powf(1.0 / TESTS);
        assert!(
            p > significance,
            "{}: χ² = {statistic} with {degrees} degrees of freedom, p = {p:e}",
            self.name
        );
        total
    }

    /// The number of draws that were not lost is binomial: 5.5 standard deviations, plus the error of the quadrature.
    fn check_kept(&self, kept: u32, total: f64) {
        let n = f64::from(SAMPLES);
        let share = f64::from(kept) / n;
        let deviation = (total.clamp(0.0, 1.0) * (1.0 - total.clamp(0.0, 1.0)) / n).sqrt();
        let allowed = 5.5 * deviation + 3e-3;
        assert!(
            (share - total).abs() < allowed,
            "{}: {share} kept, density integrates to {total}",
            self.name
        );
    }

    fn cell_of(&self, direction: Vec3) -> usize {
        let (x, y) = self.axis.any_orthonormal_pair();
        let (dx, dy) = (f64::from(direction.dot(x)), f64::from(direction.dot(y)));
        // (1 − cosθ)/2 from the sine where that has more digits.
        let half = f64::from((direction - self.axis).length_squared()) / 4.0;
        let ring = (half.clamp(0.0, 1.0).powf(1.0 / self.crowding) * RINGS as f64) as usize;
        let phi = dy.atan2(dx).rem_euclid(std::f64::consts::TAU);
        let sector = (phi / std::f64::consts::TAU * SECTORS as f64) as usize;
        ring.min(RINGS - 1) * SECTORS + sector.min(SECTORS - 1)
    }

    fn integral(&self, cell: usize) -> f64 {
        let (ring, sector) = (cell / SECTORS, cell % SECTORS);
        let half = |ring: usize| (ring as f64 / RINGS as f64).powf(self.crowding);
        let sector_rad = std::f64::consts::TAU / SECTORS as f64;
        let area = [half(ring), half(ring + 1), sector as f64 * sector_rad, (sector + 1) as f64 * sector_rad];
        self.adaptive(area, 0)
    }

    /// The 4×4 rule against its four quarters: where they differ, each quarter again.
    fn adaptive(&self, area: [f64; 4], depth: u32) -> f64 {
        let [h0, h1, p0, p1] = area;
        let (h, p) = ((h0 + h1) / 2.0, (p0 + p1) / 2.0);
        let quarters = [[h0, h, p0, p], [h, h1, p0, p], [h0, h, p, p1], [h, h1, p, p1]];
        let fine: f64 = quarters.iter().map(|&quarter| self.gauss(quarter)).sum();
        let coarse = self.gauss(area);
        if depth >= 7 || (depth > 0 && (fine - coarse).abs() < 2e-7) {
            return fine;
        }
        quarters.iter().map(|&quarter| self.adaptive(quarter, depth + 1)).sum()
    }

    fn gauss(&self, [h0, h1, p0, p1]: [f64; 4]) -> f64 {
        const NODES: [(f64, f64); 4] = [
            (-0.861_136_311_594_052_6, 0.347_854_845_137_453_9),
            (-0.339_981_043_584_856_3, 0.652_145_154_862_546_1),
            (0.339_981_043_584_856_3, 0.652_145_154_862_546_1),
            (0.861_136_311_594_052_6, 0.347_854_845_137_453_9),
        ];
        let (x, y) = self.axis.any_orthonormal_pair();
        let (x, y, z) = (x.as_dvec3(), y.as_dvec3(), self.axis.as_dvec3());
        let mut sum = 0.0;
        for (node_h, weight_h) in NODES {
            for (node_p, weight_p) in NODES {
                let half = (h0 + h1) / 2.0 + node_h * (h1 - h0) / 2.0;
                let phi = (p0 + p1) / 2.0 + node_p * (p1 - p0) / 2.0;
                let sin = 2.0 * (half * (1.0 - half)).max(0.0).sqrt();
                let direction = (x * phi.cos() + y * phi.sin()) * sin + z * (1.0 - 2.0 * half);
                sum += weight_h * weight_p * (self.pdf)(direction.as_vec3());
            }
        }
        // dω = 2 dhalf dφ
        sum * (h1 - h0) / 2.0 * (p1 - p0) / 2.0 * 2.0
    }
}

/// The statistic and its degrees of freedom.
pub fn chi2(observed: &[u32], expected_share: &[f64]) -> (f64, usize) {
    let mut cells: Vec<(f64, f64)> = observed
        .iter()
        .zip(expected_share)
        .map(|(&observed, share)| (share * f64::from(SAMPLES), f64::from(observed)))
        .collect();
    cells.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (mut statistic, mut used) = (0.0, 0);
    let (mut pooled_expected, mut pooled_observed) = (0.0, 0.0);
    for (expected, observed) in cells {
        pooled_expected += expected;
        pooled_observed += observed;
        if pooled_expected >= 5.0 {
            statistic += (pooled_observed - pooled_expected).powi(2) / pooled_expected;
            used += 1;
            (pooled_expected, pooled_observed) = (0.0, 0.0);
        }
    }
    // What is left expects next to nothing; observing much there is a failure all the same.
    if pooled_observed > pooled_expected + 6.0 * (pooled_expected + 1.0).sqrt() {
        statistic = f64::INFINITY;
    }
    (statistic, used.max(2) - 1)
}

/// Chance of a χ² at least this large (Wilson and Hilferty 1931 above 300 degrees, else the incomplete gamma function).
pub fn chi2_survival(statistic: f64, degrees: usize) -> f64 {
    if statistic.is_infinite() {
        return 0.0;
    }
    upper_gamma(degrees as f64 / 2.0, statistic / 2.0)
}

/// Regularised upper incomplete gamma function Q(a, x): series below a + 1, continued fraction above (Press et al.).
fn upper_gamma(a: f64, x: f64) -> f64 {
    let log_scale = a * x.ln() - x - log_gamma(a);
    if x <= 0.0 {
        return 1.0;
    }
    if x < a + 1.0 {
        let (mut term, mut sum, mut n) = (1.0 / a, 1.0 / a, a);
        for _ in 0..10_000 {
            n += 1.0;
            term *= x / n;
            sum += term;
            if term < sum * 1e-14 {
                break;
            }
        }
        return 1.0 - sum * log_scale.exp();
    }
    let mut b = x + 1.0 - a;
    let mut c = 1e300;
    let mut d = 1.0 / b;
    let mut h = d;
    for i in 1..10_000 {
        let an = -f64::from(i) * (f64::from(i) - a);
        b += 2.0;
        d = 1.0 / (an * d + b);
        c = b + an / c;
        let factor = d * c;
        h *= factor;
        if (factor - 1.0).abs() < 1e-14 {
            break;
        }
    }
    h * log_scale.exp()
}

/// Stirling's series after shifting the argument above 10.
fn log_gamma(mut x: f64) -> f64 {
    let mut shift = 0.0;
    while x < 10.0 {
        shift -= x.ln();
        x += 1.0;
    }
    let inverse = 1.0 / x;
    let series = inverse / 12.0 - inverse.powi(3) / 360.0 + inverse.powi(5) / 1260.0;
    shift + (x - 0.5) * x.ln() - x + 0.5 * std::f64::consts::TAU.ln() + series
}

use coshade_reference::random::{hash_words, unit_float};

/// Table values: χ² of the stated degrees exceeds these with the stated chance.
#[test]
fn chi2_survival_matches_tables() {
    for (statistic, degrees, p) in [(3.841_459, 1, 0.05), (18.307_04, 10, 0.05), (149.449, 100, 0.001)] {
        assert!((chi2_survival(statistic, degrees) / p - 1.0).abs() < 1e-3);
    }
}

/// The test itself must notice a wrong density: the cosine against the uniform hemisphere, and a lobe 7 % too wide.
#[test]
fn a_wrong_density_is_noticed() {
    use coshade_reference::bsdf::lambert::sample_cosine_hemisphere;
    let wrong = std::panic::catch_unwind(|| {
        Sampling {
            name: "uniform".into(),
            sample: &|u2, _| Some(sample_cosine_hemisphere(u2)),
            pdf: &|wi| if wi.z > 0.0 { 1.0 / std::f64::consts::TAU } else { 0.0 },
            axis: Vec3::Z,
            crowding: 1.0,
        }
        .check()
    });
    assert!(wrong.is_err());
    use coshade_reference::bsdf::{Bsdf, Gltf, Transport};
    let wo = Vec3::new(0.6, 0.0, 0.8);
    let lobe = |alpha| Bsdf::Gltf(Gltf::metal(Vec3::ONE, alpha));
    let wider = std::panic::catch_unwind(|| {
        Sampling {
            name: "wider".into(),
            sample: &|u2, u1| Some(lobe(0.215).sample(wo, u2, u1, Transport::Radiance)?.wi),
            pdf: &|wi| f64::from(lobe(0.2).pdf(wo, wi)),
            axis: Vec3::new(-0.6, 0.0, 0.8),
            crowding: 2.0,
        }
        .check()
    });
    assert!(wider.is_err());
}
