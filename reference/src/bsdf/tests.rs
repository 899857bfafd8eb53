use super::fresnel::*;
use super::*;
use coshade_scene::material::phong_exponent;

/// Reflectances of unpolarised light on glass of 1.5 in air, from the closed forms evaluated to 6 digits (Born and
/// Wolf, §1.5.2), and the limits: ((n−1)/(n+1))² at the normal, R_∥ = 0 at Brewster's angle, 1 at 90°.
#[test]
fn fresnel_matches_exact_values() {
    for (angle_deg, expected) in
        [(0.0_f32, 0.04_f64), (30.0, 0.041_525), (45.0, 0.050_240), (60.0, 0.089_186), (75.0, 0.253_061)]
    {
        let exact = reflectance_f64(f64::from(angle_deg), 1.5);
        assert!((exact - expected).abs() < 2e-5, "table at {angle_deg}: {exact}");
        let ours = fresnel_dielectric(angle_deg.to_radians().cos(), 1.5).reflectance;
        assert!((f64::from(ours) - exact).abs() < 1e-6, "{angle_deg}: {ours} {exact}");
    }
    // Brewster: tanθ = 1.5, where only the perpendicular part is left, ((n² − 1)/(n² + 1))²/2.
    let brewster = fresnel_dielectric(1.5_f32.atan().cos(), 1.5).reflectance;
    assert!((brewster - (1.25_f32 / 3.25).powi(2) / 2.0).abs() < 1e-6);
    assert_eq!(fresnel_dielectric(0.0, 1.5).reflectance, 1.0);
    // From inside: the critical angle of 1.5 is 41.81°.
    assert_eq!(fresnel_dielectric(42.0_f32.to_radians().cos(), 1.0 / 1.5).cos_transmitted, None);
    let below = fresnel_dielectric(30.0_f32.to_radians().cos(), 1.0 / 1.5);
    assert!((f64::from(below.reflectance) - reflectance_f64(30.0, 1.0 / 1.5)).abs() < 1e-6);
    assert_eq!(fresnel_dielectric(0.5, 0.0).reflectance, 1.0, "glTF's index 0 reflects everything");
}

/// By tangents and sines of the two angles, another form than the one under test.
fn reflectance_f64(angle_deg: f64, eta: f64) -> f64 {
    let i = angle_deg.to_radians();
    if i == 0.0 {
        return ((eta - 1.0) / (eta + 1.0)).powi(2);
    }
    let t = (i.sin() / eta).asin();
    let (sin, tan) = ((i - t).sin() / (i + t).sin(), (i - t).tan() / (i + t).tan());
    (sin * sin + tan * tan) / 2.0
}

/// Both sides of an interface reflect the same share along one light path.
#[test]
fn fresnel_is_the_same_from_both_sides() {
    for cos in [1.0, 0.7, 0.3, 0.05] {
        let outside = fresnel_dielectric(cos, 1.7);
        let inside = fresnel_dielectric(outside.cos_transmitted.unwrap(), 1.0 / 1.7);
        assert!((outside.reflectance - inside.reflectance).abs() < 1e-5);
        assert!((inside.cos_transmitted.unwrap() - cos).abs() < 1e-5);
    }
}

#[test]
fn absorption_follows_beer_and_lambert() {
    let material = coshade_scene::Material {
        attenuation_color: Vec3::new(0.5, 0.1, 1.0),
        attenuation_distance_m: 0.02,
        ..coshade_scene::Material::glass(1.5)
    };
    let absorption = material.absorption_per_m();
    for distance_m in [0.0, 0.01, 0.02, 0.3] {
        let exact = [0.5_f64, 0.1, 1.0].map(|colour| colour.powf(f64::from(distance_m) / 0.02));
        let ours = transmittance(absorption, distance_m);
        for channel in 0..3 {
            assert!((f64::from(ours[channel]) - exact[channel]).abs() < 1e-6);
        }
    }
    assert_eq!(transmittance(Vec3::INFINITY, 0.0), Vec3::ONE);
    assert_eq!(transmittance(Vec3::INFINITY, 1e-9), Vec3::ZERO);
    assert_eq!(transmittance(Vec3::ZERO, f32::INFINITY), Vec3::ONE);
}

const GLASS: BodyId = BodyId { thing: 0, material: 0 };
const WATER: BodyId = BodyId { thing: 1, material: 0 };

fn medium(ior: f32) -> Medium {
    Medium { ior, absorption_per_m: Vec3::ZERO }
}

#[test]
fn bodies_may_overlap_and_be_left_in_any_order() {
    let mut interior = Interior::outside();
    interior.cross(GLASS, medium(1.5), true);
    interior.cross(WATER, medium(1.33), true);
    assert_eq!((interior.medium().ior, interior.around(WATER).ior, interior.depth()), (1.33, 1.5, 2));
    // The water reaches into the glass: leaving the glass within it is no interface.
    assert!(interior.buries_exit_of(GLASS) && !interior.buries_exit_of(WATER));
    interior.cross(GLASS, medium(1.5), false);
    assert_eq!((interior.medium().ior, interior.around(WATER).ior), (1.33, 1.0));
    interior.cross(WATER, medium(1.33), false);
    assert_eq!(interior, Interior::outside());
    // A camera that starts inside of a body leaves it without having entered.
    interior.cross(GLASS, medium(1.5), false);
    assert_eq!((interior.medium(), interior.buries_exit_of(GLASS)), (Medium::AIR, false));
}

/// Light tracing and path tracing agree with bent shading normals (Veach 1997, §5.3.2): what a camera path scatters
/// from eye to light, a photon from the light brings to the eye.
#[test]
fn photons_are_corrected_for_shading_normals() {
    let shading = Vec3::new(0.3, -0.2, 0.9).normalize_or(Vec3::Z);
    let scattering = Scattering {
        bsdf: Bsdf::Gltf(Gltf { base: Vec3::splat(0.7), metallic: 0.4, f0: 0.04, alpha: 0.4 }),
        frame: Frame::around(shading),
        geometric_normal: Vec3::Z,
    };
    let (eye, light) =
        (Vec3::new(0.5, 0.1, 0.8).normalize_or(Vec3::Z), Vec3::new(-0.4, 0.3, 0.6).normalize_or(Vec3::Z));
    // A camera path scatters from eye to light by f |light·n_s|. A photon from the light arrives with its flux per
    // *geometric* area, and is seen by f* per geometric cosine: both must be the same radiance.
    let camera = scattering.eval(eye, light, Transport::Radiance);
    let photon = scattering.eval(light, eye, Transport::Importance) / eye.z * light.z;
    assert!((camera - photon).abs().max_element() < 1e-6, "{camera} {photon}");
    let flat = Scattering { frame: Frame::around(Vec3::Z), ..scattering };
    let (r, i) = (flat.eval(eye, light, Transport::Radiance), flat.eval(eye, light, Transport::Importance));
    assert_eq!(r, i, "no correction where the normals agree");
}

#[test]
fn nothing_leaks_through_bent_normals() {
    let scattering = Scattering {
        bsdf: Bsdf::Lambert(Lambert { albedo: Vec3::ONE }),
        frame: Frame::around(Vec3::new(0.8, 0.0, 0.6)),
        geometric_normal: Vec3::Z,
    };
    // Above the shading normal's horizon, but below the surface.
    let below = Vec3::new(0.95, 0.0, -0.312_25);
    assert_eq!(scattering.eval(Vec3::Z, below, Transport::Radiance), Vec3::ZERO);
    assert_eq!(scattering.pdf(Vec3::Z, below), 0.0);
}

/// ∫ D(h) cosθ_h dω = 1: microfacets cover the surface exactly.
#[test]
fn ggx_facets_cover_the_surface() {
    for alpha in [0.01_f32, 0.1, 0.5, 1.0] {
        let ggx = ggx::Ggx { alpha };
        let steps = 100_000;
        let integral: f64 = (0..steps)
            .map(|step| {
                // tanθ = α √(u/(1−u)) is where D cosθ is uniform in u; integrate in a different variable, t = θ^¼.
                let t = (f64::from(step) + 0.5) / f64::from(steps) * std::f64::consts::FRAC_PI_2.powf(0.25);
                let theta = t.powi(4);
                let d_theta = 4.0 * t.powi(3) * std::f64::consts::FRAC_PI_2.powf(0.25) / f64::from(steps);
                let h = Vec3::new(theta.sin() as f32, 0.0, theta.cos() as f32);
                f64::from(ggx.d(h)) * theta.cos() * theta.sin() * std::f64::consts::TAU * d_theta
            })
            .sum();
        assert!((integral - 1.0).abs() < 1e-4, "α = {alpha}: {integral}");
    }
}

#[test]
fn phong_takes_its_exponent_from_ggx() {
    assert_eq!(phong_exponent(0.5), 6.0);
    // At the mirrored direction the lobe is (n + 2)/2π · k_s.
    let phong = Phong { diffuse: Vec3::ZERO, specular: Vec3::splat(0.5), alpha: 0.5 };
    let peak = phong.eval(Vec3::Z, Vec3::Z).x;
    assert!((peak - 0.5 * 8.0 / std::f32::consts::TAU).abs() < 1e-6);
}

#[test]
fn choices_leave_uniform_numbers() {
    assert_eq!(choose(0.1, 0.4), (true, 0.25));
    assert!(!choose(0.7, 0.4).0 && (choose(0.7, 0.4).1 - 0.5).abs() < 1e-6);
    let last = 1.0 - f32::EPSILON / 2.0;
    assert!(choose(last, 1.0).1 < 1.0 && choose(last, 0.0).1 < 1.0 && choose(0.0, 0.0) == (false, 0.0));
}
