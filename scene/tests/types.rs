//! Transforms, lights and materials against closed forms.

use std::f32::consts::{FRAC_PI_2, PI};

use coshade_scene::bounds::{Aabb, Sphere};
use coshade_scene::light::{LightKind, Rectangle, Spot};
use coshade_scene::material::{alpha_from_phong, fresnel_f0, phong_exponent};
use coshade_scene::shape::{cuboid, plane};
use coshade_scene::texture::srgb_to_linear;
use coshade_scene::{Material, Pose, Similarity, tangents};
use glam::{Quat, Vec2, Vec3, Vec4};

fn some_similarity() -> Similarity {
    let rotation = Quat::from_euler(glam::EulerRot::XYZ, 0.3, -1.1, 2.0);
    Similarity { rotation, translation_m: Vec3::new(1.0, -2.0, 0.5), scale: 0.25 }
}

#[test]
fn similarities_compose_and_invert() {
    let a_from_b = some_similarity();
    let b_from_c = Similarity { scale: 3.0, ..some_similarity().inverse() };
    let point = Vec3::new(0.2, 0.7, -0.4);
    let twice = a_from_b.transform_point(b_from_c.transform_point(point));
    assert!(((a_from_b * b_from_c).transform_point(point) - twice).length() < 1e-5);
    assert!((a_from_b.to_mat4().transform_point3(point) - a_from_b.transform_point(point)).length() < 1e-6);
    assert!((a_from_b.inverse().transform_point(a_from_b.transform_point(point)) - point).length() < 1e-5);
    assert!(((a_from_b * a_from_b.inverse()).translation_m).length() < 1e-6);
    assert!(a_from_b.is_valid());
    for broken in [
        Similarity { scale: 0.0, ..a_from_b },
        Similarity { scale: f32::NAN, ..a_from_b },
        Similarity { rotation: Quat::from_xyzw(1.0, 1.0, 0.0, 0.0), ..a_from_b },
    ] {
        assert!(!broken.is_valid());
    }
}

#[test]
fn poses_resolve_through_their_frame() {
    let own = Similarity::from_translation(Vec3::Z);
    assert_eq!(Pose::World(own).resolve(|_| None), Some(own));
    let marker = Pose::Marker { family: "tag36h11".to_owned(), id: 7, size_m: 0.05, marker_from_thing: own };
    assert_eq!(marker.resolve(|_| None), None);
    let world_from_thing =
        marker.resolve(|pose| matches!(pose, Pose::Marker { id: 7, .. }).then(some_similarity)).unwrap();
    let expected = some_similarity().transform_point(Vec3::Z);
    assert!((world_from_thing.transform_point(Vec3::ZERO) - expected).length() < 1e-6);
}

#[test]
fn bounds_follow_a_transform() {
    let mesh = cuboid(Vec3::new(1.0, 2.0, 3.0)).unwrap();
    let a_from_b = some_similarity();
    let exact = Aabb::around(mesh.positions.iter().map(|point| a_from_b.transform_point(*point))).unwrap();
    let found = mesh.aabb().unwrap().transformed(&a_from_b);
    assert!((found.min - exact.min).length() < 1e-6 && (found.max - exact.max).length() < 1e-6);
    let sphere = mesh.bounding_sphere().unwrap();
    // The smallest is half the diagonal; Ritter's finds it for a box.
    assert!((sphere.radius - 14.0_f32.sqrt() / 2.0).abs() < 1e-4, "{sphere:?}");
    assert!((sphere.transformed(&a_from_b).radius - sphere.radius * 0.25).abs() < 1e-6);
    assert_eq!(Aabb::around([Vec3::NAN]), None);
    assert_eq!(Sphere::around(&[]), None);
}

/// Power against the integral of the intensity, and radiance × projected area against the intensity.
#[test]
fn spot_power_is_the_integral_of_its_intensity() {
    let spot = Spot {
        radiant_intensity: Vec3::new(8.0, 4.0, 2.0),
        inner_rad: 0.35,
        outer_rad: 0.6,
        radius_m: 0.005,
    };
    let steps = 200_000;
    let mut power = 0.0_f64;
    for i in 0..steps {
        let angle = (f64::from(i) + 0.5) / f64::from(steps) * f64::from(FRAC_PI_2);
        let ring = std::f64::consts::TAU * angle.sin() * f64::from(FRAC_PI_2) / f64::from(steps);
        power += f64::from(spot.intensity(angle.cos() as f32).x) * ring;
    }
    assert!((f64::from(spot.power().x) / power - 1.0).abs() < 1e-4, "{} {power}", spot.power().x);
    let cos = 0.9_f32;
    let seen = spot.radiance(cos) * (PI * spot.radius_m * spot.radius_m * cos);
    assert!((seen - spot.intensity(cos)).length() < 1e-5);
    assert_eq!(spot.radiance(-0.5), Vec3::ZERO);
    assert_eq!(
        (spot.falloff(1.0), spot.falloff(0.35_f32.cos()), spot.falloff(0.6_f32.cos())),
        (1.0, 1.0, 0.0)
    );
    let hard = Spot { inner_rad: 0.6, ..spot };
    assert!(hard.falloff(0.61_f32.cos()) == 0.0 && hard.falloff(0.59_f32.cos()) == 1.0);
}

/// A Lambertian emitter: `∫ L cosθ dω` over the half space is π L.
#[test]
fn rectangle_power() {
    let light = LightKind::Rectangle(Rectangle { size_m: Vec2::new(0.5, 0.2), radiance: Vec3::ONE });
    let LightKind::Rectangle(rectangle) = light else { panic!() };
    assert!((rectangle.power().x - PI * 0.1).abs() < 1e-6);
}

#[test]
fn reflectances_and_lobes() {
    assert!((Material::glass(1.5).dielectric_f0() - 0.04).abs() < 1e-6);
    assert_eq!(Material { ior: 0.0, ..Material::default() }.dielectric_f0(), 1.0);
    // Gold in red light (η = 0.166, k = 3.15): (0.834² + 3.15²)/(1.166² + 3.15²) = 0.94115.
    assert!((fresnel_f0(0.166, 3.15) - 0.94115).abs() < 1e-4);
    // 2/α² − 2 by hand: α = 0.5 gives 6; and back.
    assert_eq!(phong_exponent(0.5), 6.0);
    assert!((alpha_from_phong(phong_exponent(0.3)) - 0.3).abs() < 1e-6);
    assert_eq!(phong_exponent(1.0), 0.0);
    assert!(phong_exponent(0.0).is_infinite());
    // IEC 61966-2-1: 0.5 decodes to 0.21404.
    assert!((srgb_to_linear(0.5) - 0.214_041).abs() < 1e-6 && srgb_to_linear(1.0) == 1.0);
    let error = Material { roughness: 1.5, name: "x".to_owned(), ..Material::default() }.check().unwrap_err();
    assert_eq!(error.to_string(), "material 'x': roughness = 1.5, expected 0 to 1");
    assert!(Material { ior: f32::NAN, ..Material::default() }.check().is_err());
    assert_eq!(Material::default().check(), Ok(()));
}

/// On a plane u runs along x and the picture's top is at +y; a mirrored half turns w, and shared corners are doubled.
#[test]
fn tangents_follow_u() {
    let mut mesh = plane(Vec2::new(2.0, 3.0)).unwrap();
    tangents::complete(&mut mesh).unwrap();
    assert!(mesh.tangents.iter().all(|tangent| (*tangent - Vec4::new(1.0, 0.0, 0.0, 1.0)).length() < 1e-6));
    let mut mirrored = plane(Vec2::new(2.0, 3.0)).unwrap();
    mirrored.uvs.iter_mut().for_each(|uv| uv.x = 1.0 - uv.x);
    tangents::complete(&mut mirrored).unwrap();
    assert!(
        mirrored.tangents.iter().all(|tangent| (*tangent - Vec4::new(-1.0, 0.0, 0.0, -1.0)).length() < 1e-6)
    );
    let mut half = plane(Vec2::new(2.0, 3.0)).unwrap();
    // Triangle 0 is (0, 1, 3): moving corner 2 across the diagonal mirrors triangle 1 only.
    let [_, b, c] = half.triangle(1).unwrap();
    let (before, corners) = (half.positions.len(), [b, c]);
    let alone = corners.into_iter().find(|corner| !half.triangle(0).unwrap().contains(corner)).unwrap();
    half.uvs[alone as usize] = Vec2::ONE - half.uvs[alone as usize];
    tangents::complete(&mut half).unwrap();
    assert_eq!(half.positions.len(), before + 2);
    half.check().unwrap();
    let signs: Vec<f32> = half.indices.iter().map(|&corner| half.tangents[corner as usize].w).collect();
    assert_eq!(signs, [1.0, 1.0, 1.0, -1.0, -1.0, -1.0]);
}
