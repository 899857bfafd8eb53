use std::sync::Arc;

use coshade_lens::model::{BrownConrady5, Intrinsics, Pinhole};
use coshade_scene::light::Rectangle;
use coshade_scene::{Light, LightKind, Material, Shape, World};
use glam::{DMat4, DVec3, Quat, Vec2, Vec3};

use super::*;
use crate::emitter::Interpolation;

const SQUARE: Intrinsics = Intrinsics { fx: 100.0, fy: 100.0, cx: 49.75, cy: 30.0 };

fn camera(intrinsics: Intrinsics) -> Camera {
    let pose = Camera::look_at(Vec3::new(0.0, -2.0, 1.0), Vec3::ZERO, Vec3::Z);
    Camera::new(Pinhole::new(intrinsics).unwrap().into(), [100, 80], pose).unwrap()
}

fn thing(material: Material) -> Scene {
    let mesh = Shape::Box { size_m: Vec3::ONE }.mesh().unwrap();
    let thing = Thing {
        name: "a \"box\" <1>".to_owned(),
        world: World::Virtual,
        materials: vec![Arc::new(material)],
        mesh: Arc::new(mesh),
        pose: Pose::World(Similarity {
            rotation: Quat::from_rotation_z(0.5),
            translation_m: Vec3::new(1.0, 2.0, 3.0),
            scale: 2.0,
        }),
        hide_marker: false,
    };
    Scene { things: vec![thing], lights: Vec::new() }
}

fn text(material: Material) -> Result<(String, usize), ExportError> {
    let made = MitsubaScene::new(&thing(material), None, &camera(SQUARE), true)?;
    Ok((made.root.to_string(), made.approximations.len()))
}

#[test]
fn materials_with_a_counterpart_are_exact() {
    let metal = |f0, roughness| Material::metal(Vec3::splat(f0), roughness);
    let lambert = Material { ior: 1.0, ..Material::diffuse(Vec3::splat(0.5)) };
    for (material, plugin) in [
        (lambert.clone(), "\"diffuse\""),
        (metal(1.0, 0.3), "\"roughconductor\""),
        (metal(0.5, 0.3), "\"principled\""),
        (metal(1.0, 0.0), "\"conductor\""),
        (Material::glass(1.5), "\"dielectric\""),
        (Material { metallic: 0.5, roughness: 0.3, ..lambert }, "\"blendbsdf\""),
    ] {
        let (xml, approximations) = text(material).unwrap();
        assert!(xml.contains(plugin) && approximations == 0, "{plugin}: {xml}");
        assert!(xml.contains("id=\"a &quot;box&quot; &lt;1&gt; 0\""), "{xml}");
    }
}

#[test]
fn others_are_named() {
    for material in [
        Material::default(),
        Material::metal(Vec3::ONE, 0.5),
        Material::metal(Vec3::splat(0.5), 0.0),
        Material { thickness_m: 0.0, ..Material::glass(1.5) },
        Material { roughness: 0.5, ..Material::glass(1.5) },
    ] {
        assert_eq!(text(material).unwrap().1, 1);
    }
    for material in [
        Material { transmission: 0.5, ..Material::glass(1.5) },
        Material { ior: 0.0, ..Material::default() },
        Material { thickness_m: 0.0, roughness: 0.5, ..Material::glass(1.5) },
        Material { emissive: Vec3::ONE, double_sided: true, ..Material::default() },
        Material { attenuation_color: Vec3::X, attenuation_distance_m: 1.0, ..Material::glass(1.5) },
    ] {
        let error = text(material).unwrap_err().to_string();
        assert!(error.starts_with("thing 'a \"box\" <1>': "), "{error}");
    }
}

#[test]
fn absorption_needs_the_volumetric_integrator() {
    let ink = Material {
        attenuation_color: Vec3::splat((-3.0_f32).exp()),
        attenuation_distance_m: 2.0,
        ..Material::glass(1.3)
    };
    let xml = text(ink).unwrap().0;
    assert!(xml.contains("\"volpath\"") && xml.contains("name=\"sigma_t\" value=\"1.5 1.5 1.5\""), "{xml}");
    assert!(text(Material::glass(1.3)).unwrap().0.contains("\"path\""));
}

#[test]
fn meshes_are_written_in_world_coordinates() {
    let folder = tempfile::tempdir().unwrap();
    let scene = thing(Material::glass(1.5));
    let made = MitsubaScene::new(&scene, None, &camera(SQUARE), true).unwrap();
    made.write(&folder.path().join("new/scene.xml")).unwrap();
    let path = folder.path().join("new/meshes/000.ply");
    let read = coshade_scene::import(path).unwrap().mesh;
    let source = &scene.things[0];
    let pose = source.pose.frame_from_thing();
    assert_eq!(read.triangle_count(), source.mesh.triangle_count());
    for (ours, theirs) in source.mesh.triangle_positions().zip(read.triangle_positions()) {
        for (ours, theirs) in ours.into_iter().zip(theirs) {
            assert_eq!(pose.transform_point(ours), theirs);
        }
    }
    let turned: Vec<_> = source.mesh.normals.iter().map(|normal| pose.transform_direction(*normal)).collect();
    assert!(read.normals.iter().all(|normal| turned.iter().any(|ours| (*ours - *normal).length() < 1e-6)));
}

#[test]
fn the_real_world_is_without_virtual_things_and_lights() {
    let mut scene = thing(Material::glass(1.5));
    scene.lights.push(Light {
        name: "lamp".to_owned(),
        world: World::Virtual,
        pose: Pose::World(Similarity::IDENTITY),
        kind: LightKind::Rectangle(Rectangle { size_m: Vec2::ONE, radiance: Vec3::ONE }),
    });
    let xml = |mixed| MitsubaScene::new(&scene, None, &camera(SQUARE), mixed).unwrap().root.to_string();
    assert!(xml(true).contains("<shape") && xml(true).contains("<emitter"));
    assert!(!xml(false).contains("<shape") && !xml(false).contains("<emitter"));
}

#[test]
fn lenses_that_mitsuba_lacks_are_refused() {
    let refusal = |camera: &Camera| sensor::sensor(camera).unwrap_err();
    let uneven = refusal(&camera(Intrinsics { fy: 101.0, ..SQUARE }));
    assert!(uneven.contains("fx = 100 and fy = 101"), "{uneven}");
    let bent = BrownConrady5::new(SQUARE, [0.1, 0.0, 0.0, 0.0, 0.0]).unwrap();
    let bent = Camera::new(bent.into(), [100, 80], Similarity::IDENTITY).unwrap();
    assert!(refusal(&bent).contains("pinhole"));
}

/// (49.75 + ½)/100 is a quarter pixel right of the middle.
#[test]
fn the_principal_point_is_an_offset_of_the_film() {
    let xml = sensor::sensor(&camera(SQUARE)).unwrap().to_string();
    let number = |name: &str| -> f64 {
        let rest = xml.split(&format!("\"{name}\" value=\"")).nth(1).unwrap();
        rest.split('"').next().unwrap().parse().unwrap()
    };
    let expected = [
        ("principal_point_offset_x", -0.0025),
        ("principal_point_offset_y", 0.11875),
        ("fov", 2.0 * 0.5_f64.atan().to_degrees()),
    ];
    for (name, expected) in expected {
        assert!((number(name) - expected).abs() < 1e-12, "{name} = {}, expected {expected}", number(name));
    }
}

/// Mitsuba looks up `u = atan2(x, −z)/2π`, `v = acos(y)/π`, with texel k at (k + ½)/width and row j at j/(rows − 1).
#[test]
fn the_environment_is_the_same_in_every_direction() {
    let size = [8, 4];
    let texels: Vec<Vec3> =
        (0..32_i16).map(|i| Vec3::new(f32::from(i * 7 % 13), f32::from(i), 1.0)).collect();
    let ours = Environment::new(Layout::LatLong, size, texels, Interpolation::Bilinear, 0.7).unwrap();
    let image = light::environment_image(&ours).unwrap();
    let xml = light::environment(&ours, ENVIRONMENT).to_string();
    let numbers = xml.split("matrix value=\"").nth(1).and_then(|rest| rest.split('"').next()).unwrap();
    let numbers: Vec<f64> = numbers.split(' ').map(|number| number.parse().unwrap()).collect();
    let world_from_map = DMat4::from_cols_slice(&numbers).transpose();
    let [red, green, _] = image.rgb().unwrap();
    for direction in
        [DVec3::X, DVec3::new(0.3, -0.8, 0.2), DVec3::new(-0.5, 0.4, -0.9), DVec3::new(0.1, 0.1, 0.99)]
    {
        let world = direction.normalize();
        let map = world_from_map.inverse().transform_vector3(world);
        let u = map.x.atan2(-map.z) / std::f64::consts::TAU;
        let (x, y) = ((u.rem_euclid(1.0)) * 8.0 - 0.5, map.y.acos() / std::f64::consts::PI * 8.0);
        let at = |plane: &[f32], dx: f64, dy: f64| {
            let (x, y) = ((x.floor() + dx).rem_euclid(8.0) as usize, (y.floor() + dy) as usize);
            f64::from(plane[y * 8 + x])
        };
        let (fx, fy) = (x - x.floor(), y - y.floor());
        for (plane, expected) in [red, green].into_iter().zip(ours.radiance(world.as_vec3()).to_array()) {
            let upper = at(plane, 0.0, 0.0) * (1.0 - fx) + at(plane, 1.0, 0.0) * fx;
            let lower = at(plane, 0.0, 1.0) * (1.0 - fx) + at(plane, 1.0, 1.0) * fx;
            let theirs = upper * (1.0 - fy) + lower * fy;
            assert!((theirs - f64::from(expected)).abs() < 1e-4, "{direction}: {theirs}, ours {expected}");
        }
    }
}
