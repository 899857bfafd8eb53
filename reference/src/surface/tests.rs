use std::sync::Arc;

use coshade_scene::shape::{plane, sphere};
use coshade_scene::texture::{ColorSpace, Filter, Image, Texture, UvTransform, Wrap};
use coshade_scene::{Material, Mesh, Pose, Scene, Similarity, Thing};
use glam::{Quat, Vec4};

use super::*;
use crate::accel::{Accel, Sees};
use crate::bsdf::{Interior, ScatterKind, Transport};

fn accel(mesh: Mesh, material: Material, pose: Similarity) -> Accel {
    let thing = Thing {
        name: "thing".into(),
        world: World::Virtual,
        mesh: Arc::new(mesh),
        materials: vec![Arc::new(material)],
        pose: Pose::World(pose),
        hide_marker: false,
    };
    Accel::build(&Scene { things: vec![thing], lights: Vec::new() }, |_| None).unwrap()
}

fn look(accel: &Accel, origin: Vec3, direction: Vec3) -> Surface {
    let ray = Ray::new(origin, direction, 0);
    accel.surface(&ray, &accel.closest(&ray, Sees::Everything).unwrap())
}

fn image(width: u32, height: u32, rgba: &[[u8; 4]]) -> Arc<Image> {
    Arc::new(Image { name: "test".into(), width, height, rgba: rgba.as_flattened().to_vec() })
}

const BLACK: [u8; 4] = [0, 0, 0, 255];
const WHITE: [u8; 4] = [255; 4];

#[test]
fn texels_are_interpolated_after_decoding() {
    let texture = Texture::new(image(2, 1, &[BLACK, WHITE]), ColorSpace::Srgb);
    // Centres of the texels at u = ¼ and ¾; halfway between them the mean of the *linear* values.
    for (u, expected) in [(0.25, 0.0), (0.5, 0.5), (0.75, 1.0), (0.625, 0.75), (1.0, 0.5)] {
        assert!((texture::lookup(&texture, Vec2::new(u, 0.5)).x - expected).abs() < 1e-6, "u = {u}");
    }
    let grey = Texture::new(image(1, 1, &[[188, 188, 188, 128]]), ColorSpace::Srgb);
    let value = texture::lookup(&grey, Vec2::ZERO);
    assert!((value.x - 0.502_886).abs() < 1e-5 && (value.w - 128.0 / 255.0).abs() < 1e-6);
    let data = Texture { color_space: ColorSpace::Linear, ..grey };
    assert!((texture::lookup(&data, Vec2::ZERO).x - 188.0 / 255.0).abs() < 1e-6);
}

#[test]
fn textures_wrap_as_they_are_told() {
    let base =
        Texture { magnify: Filter::Nearest, ..Texture::new(image(2, 1, &[BLACK, WHITE]), ColorSpace::Srgb) };
    let at = |wrap, u| texture::lookup(&Texture { wrap_u: wrap, ..base.clone() }, Vec2::new(u, 0.5)).x;
    for (u, repeat, mirror, clamp) in [
        (0.1, 0.0, 0.0, 0.0),
        (1.1, 0.0, 1.0, 1.0),
        (1.9, 1.0, 0.0, 1.0),
        (-0.1, 1.0, 0.0, 0.0),
        (-0.9, 0.0, 1.0, 0.0),
    ] {
        assert_eq!(
            [at(Wrap::Repeat, u), at(Wrap::MirroredRepeat, u), at(Wrap::ClampToEdge, u)],
            [repeat, mirror, clamp]
        );
    }
    let moved = Texture {
        uv_transform: UvTransform { offset: Vec2::new(0.5, 0.0), ..UvTransform::default() },
        ..base
    };
    assert_eq!(texture::lookup(&moved, Vec2::new(0.1, 0.5)).x, 1.0);
    assert!(
        texture::lookup(&moved, Vec2::NAN).is_finite()
            && texture::lookup(&moved, Vec2::splat(1e30)).is_finite()
    );
}

#[test]
fn a_ball_is_seen_from_outside_and_inside() {
    let pose = Similarity {
        rotation: Quat::from_rotation_x(0.7),
        translation_m: Vec3::new(1.0, 2.0, 3.0),
        scale: 2.0,
    };
    let accel = accel(sphere(0.5, 64).unwrap(), Material::default(), pose);
    let center = pose.translation_m;
    for direction in [Vec3::X, Vec3::new(0.3, -0.5, 0.8).normalize_or(Vec3::Z), Vec3::new(-0.6, 0.0, -0.8)] {
        let outside = look(&accel, center + direction * 5.0, -direction);
        assert!(outside.front && outside.position.abs_diff_eq(center + direction, 5e-3));
        assert!(outside.frame.normal.abs_diff_eq(direction, 2e-3), "interpolated: {}", outside.frame.normal);
        assert!(outside.geometric_normal.dot(direction) > 0.99);
        let inside = look(&accel, center, direction);
        assert!(!inside.front && inside.geometric_normal.dot(direction) > 0.99, "normals stay on the front");
    }
}

/// A flat normal map changes nothing; one that leans to +u leans to the tangent, one to +v (green) up the picture.
#[test]
fn normal_maps_bend_in_the_tangent_frame() {
    let lean = |rgb: [u8; 3]| {
        let [r, g, b] = rgb;
        let texture = Texture::new(image(1, 1, &[[r, g, b, 255]]), ColorSpace::Linear);
        let map = coshade_scene::material::NormalMap { texture: Arc::new(texture), scale: 1.0 };
        let material = Material { normal_map: Some(map), ..Material::default() };
        let mut mesh = plane(Vec2::ONE).unwrap();
        let [with, without] = [false, true].map(|without| {
            if without {
                mesh.tangents.clear();
            }
            look(&accel(mesh.clone(), material.clone(), Similarity::IDENTITY), Vec3::Z, -Vec3::Z).frame.normal
        });
        assert!(with.abs_diff_eq(without, 1e-5), "tangents given and derived: {with} {without}");
        with
    };
    assert!(lean([128, 128, 255]).abs_diff_eq(Vec3::Z, 0.01));
    // The plane's picture is upright: u along +x, up along +y.
    assert!(
        lean([218, 128, 218]).abs_diff_eq(Vec3::new(0.707, 0.0, 0.707), 0.01),
        "{}",
        lean([218, 128, 218])
    );
    assert!(
        lean([128, 218, 218]).abs_diff_eq(Vec3::new(0.0, 0.707, 0.707), 0.01),
        "{}",
        lean([128, 218, 218])
    );
}

/// At grazing views on a coarse ball, the shading normal always faces the viewer and a mirror never looks inside.
#[test]
fn shading_normals_never_mirror_into_the_surface() {
    let accel = accel(sphere(1.0, 6).unwrap(), Material::metal(Vec3::ONE, 0.0), Similarity::IDENTITY);
    let mut seen = 0;
    for index in 0..4000 {
        let angle = index as f32 * 0.37;
        let offset = 0.3 + 0.7 * (index as f32 * 0.000_25);
        let origin = Vec3::new(angle.cos() * offset, angle.sin() * offset, 3.0);
        let ray = Ray::new(origin, -Vec3::Z, 0);
        let Some(hit) = accel.closest(&ray, Sees::Everything) else {
            continue;
        };
        let surface = accel.surface(&ray, &hit);
        assert!(surface.frame.normal.z > 0.0);
        let scattering = surface.scattering(ReflectionModel::Ggx, Medium::AIR);
        let sample = scattering.sample(Vec3::Z, Vec2::splat(0.5), 0.5, Transport::Radiance).unwrap();
        assert!(sample.wi.dot(surface.geometric_normal) > 0.0 && sample.kind == ScatterKind::Reflection);
        seen += 1;
    }
    assert!(seen > 1000);
}

#[test]
fn backs_absorb_unless_double_sided() {
    for double_sided in [false, true] {
        let material = Material { double_sided, emissive: Vec3::ONE, ..Material::diffuse(Vec3::splat(0.5)) };
        let accel = accel(plane(Vec2::ONE).unwrap(), material, Similarity::IDENTITY);
        for (side, lit) in [(1.0, true), (-1.0, double_sided)] {
            let surface = look(&accel, Vec3::Z * side, -Vec3::Z * side);
            assert_eq!(surface.front, side > 0.0);
            assert_eq!(surface.emitted_radiance() != Vec3::ZERO, lit);
            let scattering = surface.scattering(ReflectionModel::Ggx, Medium::AIR);
            let to = Vec3::new(0.6, 0.0, 0.8 * side);
            assert_eq!(scattering.eval(Vec3::Z * side, to, Transport::Radiance) != Vec3::ZERO, lit);
        }
    }
}

/// Material values become the models they should: glass of the index of its surroundings is not there, thin walls do
/// not bend, index 1 is Lambert.
#[test]
fn materials_become_models() {
    let bsdf = |material: Material, around: Medium| {
        let accel = accel(sphere(0.5, 16).unwrap(), material, Similarity::IDENTITY);
        look(&accel, Vec3::X * 2.0, -Vec3::X).scattering(ReflectionModel::Ggx, around).bsdf
    };
    let water = Medium { ior: 1.33, absorption_per_m: Vec3::ZERO };
    assert!(
        matches!(bsdf(Material::glass(1.33), water), Bsdf::Dielectric(glass) if glass.eta == 1.0 && !glass.thin)
    );
    let thin = Material { thickness_m: 0.0, ..Material::glass(1.5) };
    assert!(matches!(bsdf(thin, Medium::AIR), Bsdf::Dielectric(glass) if glass.thin));
    let frosted = Material { roughness: 0.5, ..Material::glass(1.5) };
    assert!(matches!(bsdf(frosted, Medium::AIR), Bsdf::RoughDielectric(glass) if glass.alpha == 0.25));
    let half = Material { transmission: 0.5, ..Material::glass(1.5) };
    assert!(
        matches!(bsdf(half, Medium::AIR), Bsdf::Mix(mix) if mix.share == 0.5 && mix.opaque.metallic == 0.0)
    );
    let index_one = Material { ior: 1.0, ..Material::default() };
    assert!(matches!(bsdf(index_one, Medium::AIR), Bsdf::Lambert(_)));
    assert!(
        matches!(bsdf(Material::default(), Medium::AIR), Bsdf::Gltf(gltf) if (gltf.f0 - 0.04).abs() < 1e-6)
    );
}

/// Straight through the middle of two nested balls: the indices met are those between neighbours, and the absorption
/// of each length belongs to the body that fills it.
#[test]
fn nested_bodies_are_entered_and_left() {
    let glass = |ior, colour| {
        Arc::new(Material { attenuation_color: colour, attenuation_distance_m: 1.0, ..Material::glass(ior) })
    };
    let ball = |name: &str, radius, material| Thing {
        name: name.into(),
        world: World::Real,
        mesh: Arc::new(sphere(radius, 64).unwrap()),
        materials: vec![material],
        pose: Pose::default(),
        hide_marker: false,
    };
    let things = vec![
        ball("outer", 1.0, glass(1.5, Vec3::new(0.5, 1.0, 1.0))),
        ball("inner", 0.4, glass(1.33, Vec3::new(1.0, 0.25, 1.0))),
    ];
    let accel = Accel::build(&Scene { things, lights: Vec::new() }, |_| None).unwrap();
    let mut interior = Interior::outside();
    let mut ray = Ray::new(Vec3::new(-3.0, 0.01, 0.02), Vec3::X, 0);
    let (mut etas, mut transmitted) = (Vec::new(), Vec3::ONE);
    while let Some(hit) = accel.closest(&ray, Sees::Everything) {
        let surface = accel.surface(&ray, &hit);
        transmitted *= crate::bsdf::transmittance(interior.medium().absorption_per_m, hit.t);
        etas.push(surface.medium().ior / interior.around(surface.body).ior);
        interior.cross(surface.body, surface.medium(), surface.front);
        ray.origin = surface.origin_towards(ray.direction);
    }
    let expected = [1.5, 1.33 / 1.5, 1.33 / 1.5, 1.5];
    assert!(etas.iter().zip(expected).all(|(eta, expected)| (eta - expected).abs() < 1e-6), "{etas:?}");
    assert_eq!(interior, Interior::outside());
    // 1.2 m of the outer glass, 0.8 m of the inner; the balls have flat facets.
    let exact = Vec3::new(0.5_f32.powf(1.2), 0.25_f32.powf(0.8), 1.0);
    assert!((transmitted / exact - 1.0).abs().max_element() < 0.01, "{transmitted} {exact}");
}

#[test]
fn vertex_colours_multiply() {
    let mut mesh = plane(Vec2::ONE).unwrap();
    mesh.colors = vec![Vec4::new(0.5, 1.0, 0.25, 1.0); mesh.positions.len()];
    let accel = accel(mesh, Material::diffuse(Vec3::splat(0.8)), Similarity::IDENTITY);
    let surface = look(&accel, Vec3::new(0.1, 0.2, 1.0), -Vec3::Z);
    assert!(surface.material.base_color.abs_diff_eq(Vec3::new(0.4, 0.8, 0.2), 1e-6));
}
