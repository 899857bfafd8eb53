//! BSDF samplers, the consistency of their weights, and what they must conserve.

use coshade_reference::bsdf::mix::Glass;
use coshade_reference::bsdf::{
    Bsdf, Dielectric, Gltf, Lambert, Mix, Phong, RoughDielectric, Sample, Transport,
};
use coshade_reference::random::{Sampler, hash_words, unit_float};
use glam::{Vec2, Vec3};

use crate::chi2::Sampling;

const BASE: Vec3 = Vec3::new(0.8, 0.5, 0.2);
/// cosθ of the known direction: near the normal, oblique, grazing.
const COSINES: [f32; 4] = [1.0, 0.8, 0.35, 0.06];

fn from_cos(cos: f32) -> Vec3 {
    let sin = (1.0 - cos * cos).max(0.0).sqrt();
    Vec3::new(sin * 0.6, sin * 0.8, cos)
}

fn gltf(metallic: f32, f0: f32, alpha: f32) -> Bsdf {
    Bsdf::Gltf(Gltf { base: BASE, metallic, f0, alpha })
}

fn rough_glass(eta: f32, alpha: f32, thin: bool) -> RoughDielectric {
    RoughDielectric { eta, tint: Vec3::ONE, alpha, thin }
}

/// Opaque ones; the second number is how far cells crowd around the mirrored direction.
fn opaque() -> Vec<(String, Bsdf, f64)> {
    let mut all = vec![("lambert".to_owned(), Bsdf::Lambert(Lambert { albedo: BASE }), 1.0)];
    for (alpha, crowding) in [(1.0, 2.0), (0.5, 2.0), (0.2, 2.0), (0.05, 4.0), (0.01, 6.0), (1e-3, 9.0)] {
        all.push((format!("metal α={alpha}"), gltf(1.0, 0.0, alpha), crowding));
        all.push((format!("coat α={alpha}"), gltf(0.0, 0.04, alpha), crowding));
        all.push((format!("half metal α={alpha}"), gltf(0.5, 0.08, alpha), crowding));
        let phong = Phong { diffuse: BASE * 0.5, specular: Vec3::new(0.3, 0.4, 0.5), alpha };
        all.push((format!("phong α={alpha}"), Bsdf::Phong(phong), crowding));
    }
    all
}

fn frosted() -> Vec<(String, Bsdf)> {
    let mut all = Vec::new();
    for alpha in [0.6, 0.25, 0.1] {
        for (eta, thin) in [(1.5, false), (0.75, false), (1.5, true)] {
            let glass = rough_glass(eta, alpha, thin);
            all.push((format!("frosted α={alpha} η={eta} thin={thin}"), Bsdf::RoughDielectric(glass)));
        }
    }
    let opaque = Gltf { base: BASE, metallic: 0.3, f0: 0.04, alpha: 0.3 };
    let glass = Glass::Rough(rough_glass(1.4, 0.3, false));
    all.push(("mix".to_owned(), Bsdf::Mix(Mix { share: 0.6, opaque, glass })));
    all
}

fn check(name: &str, bsdf: &Bsdf, wo: Vec3, crowding: f64) -> f64 {
    let not_delta = |sample: &Sample| !sample.is_delta;
    Sampling {
        name: format!("{name}, wo = {wo}"),
        sample: &|u2, u1| {
            bsdf.sample(wo, u2, u1, Transport::Radiance).filter(not_delta).map(|sample| sample.wi)
        },
        pdf: &|wi| f64::from(bsdf.pdf(wo, wi)),
        axis: Vec3::new(-wo.x, -wo.y, wo.z),
        crowding,
    }
    .check()
}

#[test]
fn opaque_samplers_follow_their_densities() {
    for (name, bsdf, crowding) in opaque() {
        for cos in COSINES {
            let total = check(&name, &bsdf, from_cos(cos), crowding);
            // Lost draws lie below the surface: none for the cosine, few for narrow lobes away from grazing.
            let all_kept = matches!(bsdf, Bsdf::Lambert(_)) || (crowding >= 6.0 && cos > 0.3);
            assert!(!all_kept || (total - 1.0).abs() < 3e-3, "{name} at {cos}: {total}");
        }
    }
}

#[test]
fn frosted_glass_samplers_follow_their_densities() {
    for (name, bsdf) in frosted() {
        for cos in [0.95, 0.4, -0.3, -0.9] {
            check(&name, &bsdf, from_cos(cos), 1.0);
        }
    }
}

/// weight = f cos / pdf, in both directions of transport, and nothing is NaN or negative.
#[test]
fn weights_are_value_over_density() {
    let all = opaque().into_iter().map(|(name, bsdf, _)| (name, bsdf)).chain(frosted());
    for (name, bsdf) in all {
        for (number, cos) in [1.0, 0.7, 0.2, 0.01, 1e-4, -0.5].into_iter().enumerate() {
            let wo = from_cos(cos);
            for transport in [Transport::Radiance, Transport::Importance] {
                for index in 0..500 {
                    let u = |dimension| unit_float(hash_words(&[index, dimension, number as u32]));
                    let Some(sample) = bsdf.sample(wo, Vec2::new(u(0), u(1)), u(2), transport) else {
                        continue;
                    };
                    let value = bsdf.eval(wo, sample.wi, transport);
                    assert_eq!(sample.pdf, bsdf.pdf(wo, sample.wi), "{name}");
                    assert!(
                        sample.pdf > 0.0 && sample.weight.is_finite() && sample.weight.min_element() >= 0.0
                    );
                    assert!(
                        (sample.weight * sample.pdf).abs_diff_eq(value, 1e-5 * value.max_element()),
                        "{name}"
                    );
                }
            }
        }
    }
}

/// `f(wo, wi) = f(wi, wo)`; refraction has `f(wo, wi)/η_i² = f(wi, wo)/η_o²` (Veach 1997, eq. 5.14), which is also
/// what makes importance the adjoint of radiance: `f*(wo, wi) = f(wi, wo)`.
#[test]
fn reciprocity() {
    let all = opaque().into_iter().map(|(name, bsdf, _)| (name, bsdf)).chain(frosted());
    for (name, bsdf) in all {
        for index in 0..2000 {
            let u = |dimension| unit_float(hash_words(&[index, dimension, 3]));
            let direction = |first| {
                let z: f32 = 2.0 * u(first) - 1.0;
                let (sin, cos) = (std::f32::consts::TAU * u(first + 1)).sin_cos();
                let across = (1.0 - z * z).sqrt();
                Vec3::new(across * cos, across * sin, z)
            };
            let (wo, wi) = (direction(0), direction(2));
            if near_critical(wo, wi) {
                continue;
            }
            let f = bsdf.eval(wo, wi, Transport::Radiance) / wi.z.abs();
            let adjoint = bsdf.eval(wi, wo, Transport::Importance) / wo.z.abs();
            let scale = f.max_element().max(adjoint.max_element());
            assert!((f - adjoint).abs().max_element() <= 2e-3 * scale, "{name}: {f} {adjoint} for {wo} {wi}");
            if wo.z * wi.z > 0.0 {
                let back = bsdf.eval(wi, wo, Transport::Radiance) / wo.z.abs();
                assert!((f - back).abs().max_element() <= 2e-3 * scale, "{name}: {f} {back}");
            }
        }
    }
}

/// Refraction at a grazing microfacet: cosθ_t is a root of a difference, of which f32 leaves few digits.
fn near_critical(wo: Vec3, wi: Vec3) -> bool {
    [1.5_f32, 0.75, 1.4].iter().any(|&eta| {
        let eta = if wo.z > 0.0 { eta } else { 1.0 / eta };
        let h = (wo + eta * wi).normalize_or(Vec3::Z);
        wo.z * wi.z < 0.0 && wo.dot(h).abs().min(wi.dot(h).abs()) < 0.03
    })
}

/// Mean weight over many samples with its standard error.
fn albedo(bsdf: &Bsdf, wo: Vec3, transport: Transport, count: u32) -> (Vec3, f32) {
    let (mut sum, mut squares) = (glam::DVec3::ZERO, 0.0);
    for index in 0..count {
        let u = |dimension| unit_float(hash_words(&[index, dimension, 11]));
        let weight = bsdf.sample(wo, Vec2::new(u(0), u(1)), u(2), transport).map_or(Vec3::ZERO, |s| s.weight);
        sum += weight.as_dvec3();
        squares += f64::from(weight.x).powi(2);
    }
    let n = f64::from(count);
    let mean = sum / n;
    let error = ((squares / n - mean.x * mean.x).max(0.0) / n).sqrt();
    (mean.as_vec3(), error as f32)
}

/// Directional albedo by quadrature over the sphere, independent of the sampler: z and φ by midpoints, z crowded
/// around the mirrored direction by the substitution that the caller's lobe needs.
fn albedo_by_quadrature(bsdf: &Bsdf, wo: Vec3, transport: Transport, alpha: f32) -> f64 {
    // Polar angle about the mirrored direction: half = sin²(θ/2) = s^p, p larger for narrower lobes.
    let power = if alpha < 0.3 { 3.0 } else { 1.5 };
    let (rings, sectors) = (1200, 600);
    let axis = Vec3::new(-wo.x, -wo.y, wo.z);
    let (x, y) = axis.any_orthonormal_pair();
    let mut sum = 0.0;
    for ring in 0..rings {
        let s = (f64::from(ring) + 0.5) / f64::from(rings);
        let half = s.powf(power);
        let d_half = power * s.powf(power - 1.0) / f64::from(rings);
        let sin = 2.0 * (half * (1.0 - half)).sqrt();
        for sector in 0..sectors {
            let phi = std::f64::consts::TAU * (f64::from(sector) + 0.5) / f64::from(sectors);
            let across = x.as_dvec3() * phi.cos() + y.as_dvec3() * phi.sin();
            let wi = (across * sin + axis.as_dvec3() * (1.0 - 2.0 * half)).as_vec3();
            sum += f64::from(bsdf.eval(wo, wi, transport).x) * d_half;
        }
    }
    sum * 2.0 * std::f64::consts::TAU / f64::from(sectors)
}

/// Furnace: under light of 1 from everywhere the mean weight is the albedo: within 3 standard errors of the quadrature,
/// whose own error is below 1e-3. The random numbers are fixed.
#[test]
fn furnace_of_rough_surfaces_matches_quadrature() {
    let mut cases = vec![];
    for alpha in [1.0, 0.4, 0.1] {
        cases.push((gltf(1.0, 0.0, alpha), alpha));
        cases.push((gltf(0.0, 0.04, alpha), alpha));
        let phong = Phong { diffuse: BASE * 0.5, specular: Vec3::splat(0.4), alpha };
        cases.push((Bsdf::Phong(phong), alpha));
        cases.push((Bsdf::RoughDielectric(rough_glass(1.5, alpha, false)), alpha));
    }
    for (bsdf, alpha) in cases {
        for cos in [0.95, 0.4] {
            let wo = from_cos(cos);
            let (mean, error) = albedo(&bsdf, wo, Transport::Importance, 40_000);
            let exact = albedo_by_quadrature(&bsdf, wo, Transport::Importance, alpha) as f32;
            assert!(
                (mean.x - exact).abs() < 3.0 * error + 1e-3,
                "{bsdf:?} at {cos}: {mean} ± {error}, {exact}"
            );
            assert!(mean.max_element() < 1.0 + 3.0 * error, "{bsdf:?}: energy {mean}");
        }
    }
}

/// White surfaces that lose nothing: exact.
#[test]
fn white_furnaces_are_exact() {
    let white = Bsdf::Lambert(Lambert { albedo: Vec3::ONE });
    let glass = |eta, thin| Bsdf::Dielectric(Dielectric { eta, tint: Vec3::ONE, thin });
    let mirror = gltf_white_mirror();
    let all =
        [white, glass(1.5, false), glass(1.0 / 1.5, false), glass(1.0, false), glass(1.5, true), mirror];
    for bsdf in all {
        for cos in [1.0, 0.6, 0.1, -0.5] {
            if cos < 0.0 && !matches!(bsdf, Bsdf::Dielectric(_)) {
                continue;
            }
            for index in 0..2000 {
                let mut sampler = Sampler::new([0, 0], index, 5);
                let (u2, u1) = (sampler.next_2d(), sampler.next_1d());
                let sample = bsdf.sample(from_cos(cos), u2, u1, Transport::Importance).unwrap();
                assert_eq!(sample.weight, Vec3::ONE, "{bsdf:?}");
            }
        }
    }
}

fn gltf_white_mirror() -> Bsdf {
    Bsdf::Gltf(Gltf::metal(Vec3::ONE, 0.0))
}

/// In equilibrium radiance inside a body is η² that outside; then a camera path sees 1 in every direction:
/// F · 1 + (1 − F)/η² · η² = 1, for each weight by itself.
#[test]
fn radiance_is_squeezed_by_the_square_of_the_index() {
    let glass = Bsdf::Dielectric(Dielectric { eta: 1.5, tint: Vec3::ONE, thin: false });
    for (cos, inside) in [(0.7, false), (-0.9, true)] {
        let wo = from_cos(cos);
        for index in 0..500 {
            let sample =
                glass.sample(wo, Vec2::ZERO, unit_float(hash_words(&[index])), Transport::Radiance).unwrap();
            let equilibrium = |inside: bool| if inside { 2.25_f32 } else { 1.0 };
            let seen = sample.weight.x * equilibrium(sample.wi.z < 0.0);
            assert!((seen - equilibrium(inside)).abs() < 1e-5);
        }
    }
}

/// The share of reflected rays is Fresnel's, and Snell's law holds; total reflection beyond the critical angle.
#[test]
fn smooth_glass_splits_by_fresnel_and_bends_by_snell() {
    let glass = Dielectric { eta: 1.5, tint: Vec3::ONE, thin: false };
    for cos in [0.9, 0.3, -0.9, -0.3] {
        let wo = from_cos(cos);
        let eta = if cos > 0.0 { 1.5 } else { 1.0 / 1.5 };
        for index in 0..1000_u32 {
            let u1 = (index as f32 + 0.5) / 1000.0;
            let sample = glass.sample(wo, u1, Transport::Importance).unwrap();
            let across = |w: Vec3| w.truncate();
            if sample.wi.z * wo.z > 0.0 {
                assert_eq!(across(sample.wi), -across(wo));
            } else {
                assert!(across(sample.wi).abs_diff_eq(-across(wo) / eta, 1e-6));
            }
        }
    }
    let beyond = from_cos(-0.5); // sinθ = 0.866 > 1/1.5
    assert!(
        (0..100).all(|i| glass.sample(beyond, i as f32 / 100.0, Transport::Radiance).unwrap().wi.z < 0.0)
    );
}

/// An index of 1 changes nothing: straight on, weight 1, at any angle (METHODS: index 1.0 must change nothing).
#[test]
fn index_one_is_not_there() {
    let air = Dielectric { eta: 1.0, tint: Vec3::ONE, thin: false };
    for cos in [1.0, 0.5, 1e-3, 1e-6, -1e-4, -0.7] {
        let wo = from_cos(cos);
        for u1 in [0.0, 0.3, 0.999_999] {
            let sample = air.sample(wo, u1, Transport::Radiance).unwrap();
            assert!((sample.wi + wo).abs().max_element() < 1e-7 && sample.weight == Vec3::ONE, "{cos}");
        }
    }
}

/// The coat vanishes with an index of 1 (F90 = saturate(50 F0)): what is left is Lambert.
#[test]
fn coat_of_index_one_is_pure_lambert() {
    let coated = gltf(0.0, 0.0, 0.3);
    let lambert = Bsdf::Lambert(Lambert { albedo: BASE });
    for cos in COSINES {
        let (wo, wi) = (from_cos(cos), from_cos(0.5));
        assert_eq!(coated.eval(wo, wi, Transport::Radiance), lambert.eval(wo, wi, Transport::Radiance));
        assert_eq!(coated.pdf(wo, wi), lambert.pdf(wo, wi));
    }
}
