//! glTF files of independent writers (`data/make.py`) against what those writers say, and hand-made broken ones.

#![allow(clippy::unwrap_used, clippy::panic, reason = "helpers of tests outside of #[test] functions")]

use std::path::{Path, PathBuf};

use coshade_scene::texture::{Filter, Wrap};
use coshade_scene::{AlphaMode, ColorSpace, Imported, import};
use glam::{Vec2, Vec3, Vec4};
use serde_json::{Value, json};

fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data").join(name)
}

/// Nodes with turned, stretched and mirrored parents: area, volume and bounds as trimesh reads them.
#[test]
fn placed_meshes_are_where_trimesh_has_them() {
    let truth: Value = serde_json::from_slice(&std::fs::read(data("placed.json")).unwrap()).unwrap();
    let Imported { mesh, statistics, warnings, .. } = import(data("placed.glb")).unwrap();
    assert_eq!(warnings, Vec::<String>::new());
    assert_eq!(statistics.triangles as u64, truth["triangles"].as_u64().unwrap());
    let close = |found: f64, key: &str| {
        let expected = truth[key].as_f64().unwrap();
        assert!((found / expected - 1.0).abs() < 1e-5, "{key}: {found}, expected {expected}");
    };
    close(mesh.area_m2(), "area_m2");
    // Positive although one node mirrors: its winding was turned.
    close(mesh.volume_m3(), "volume_m3");
    let aabb = mesh.aabb().unwrap();
    for (found, key) in [(aabb.min, "min"), (aabb.max, "max")] {
        for (axis, found) in found.to_array().into_iter().enumerate() {
            let expected = truth[key][axis].as_f64().unwrap() as f32;
            assert!((found - expected).abs() < 1e-5, "{key}[{axis}]: {found}, expected {expected}");
        }
    }
    for (corners, [a, b, c]) in mesh.triangles().zip(mesh.triangle_positions()) {
        let facing = (b - a).cross(c - a);
        assert!(corners.iter().all(|&corner| mesh.normals[corner as usize].dot(facing) > 0.0));
    }
}

#[test]
fn strips_fans_sparse_and_integers_are_unpacked() {
    let Imported { mesh, statistics, warnings, .. } = import(data("features.gltf")).unwrap();
    assert_eq!((statistics.triangles, statistics.vertices, statistics.parts), (4 + 4 + 1, 6 + 12 + 3, 3));
    assert_eq!((statistics.materials, statistics.images), (3, 2));
    assert_eq!(mesh.name, "features");
    let areas: Vec<f64> = mesh
        .parts
        .iter()
        .map(|part| {
            let triangles = part.triangles.start as usize..part.triangles.end as usize;
            let areas = mesh.triangle_positions().skip(triangles.start).take(triangles.len());
            areas.map(|[a, b, c]| coshade_scene::mesh::triangle_area_m2(a, b, c)).sum()
        })
        .collect();
    // Two unit squares, a square of side √2, a triangle spanned by (1,0,0) and (0,1,5); all twice as large.
    for (found, expected) in areas.iter().zip([8.0, 8.0, 2.0 * 26.0_f64.sqrt()]) {
        assert!((found - expected).abs() < 1e-5, "{areas:?}");
    }
    // glTF's +z is −y here; the fan has no normals and gets those of its triangles.
    assert!(mesh.normals[..18].iter().all(|normal| (*normal - Vec3::NEG_Y).length() < 1e-6));
    assert_eq!(mesh.positions[0], Vec3::new(0.0, 0.0, 2.0));
    // The first triangle of a fan is (1, 2, 0).
    assert_eq!(mesh.positions[6], Vec3::new(2.0, -2.0, 0.0));
    assert_eq!(mesh.uvs[3], Vec2::new(128.0 / 255.0, 1.0));
    assert_eq!(mesh.colors[0], Vec4::new(1.0, 0.0, 0.0, 32768.0 / 65535.0));
    assert_eq!(mesh.colors[20], Vec4::ONE);
    // The normal map of part 0 needs tangents: +u runs along x, up in the picture is up.
    assert!(
        mesh.tangents[..6].iter().all(|tangent| (*tangent - Vec4::new(1.0, 0.0, 0.0, 1.0)).length() < 1e-6)
    );
    let said = |what: &str| warnings.iter().any(|warning| warning.contains(what));
    assert!(said("occlusion") && said("KHR_lights_punctual"), "{warnings:?}");
}

#[test]
fn materials_keep_all_their_numbers() {
    let Imported { materials, mesh, .. } = import(data("features.gltf")).unwrap();
    let [rich, glass, default] =
        mesh.parts.iter().map(|part| &materials[part.material]).collect::<Vec<_>>()[..]
    else {
        panic!("three parts");
    };
    assert_eq!(rich.name, "rich");
    assert_eq!(rich.base_color, Vec4::new(0.5, 0.25, 0.125, 0.75));
    assert_eq!((rich.metallic, rich.roughness, rich.alpha()), (0.25, 0.5, 0.25));
    assert_eq!(rich.alpha_mode, AlphaMode::Mask { cutoff: 0.25 });
    assert!(rich.double_sided);
    assert_eq!(rich.emitted_radiance(), Vec3::new(4.0, 2.0, 0.0));
    let base = rich.base_color_texture.as_ref().unwrap();
    assert_eq!(
        (base.color_space, base.magnify, base.minify),
        (ColorSpace::Srgb, Filter::Nearest, Filter::Linear)
    );
    assert_eq!((base.wrap_u, base.wrap_v), (Wrap::ClampToEdge, Wrap::MirroredRepeat));
    assert_eq!((base.image.width, base.image.height, base.image.name.as_str()), (2, 2, "beside"));
    assert_eq!(&base.image.rgba[4..8], [0, 255, 0, 255]);
    // The extension's own matrices, T · R · S, on (u, v): here of (1, 0).
    let (sin, cos) = 0.5_f32.sin_cos();
    let expected = Vec2::new(0.25 + 2.0 * cos, 0.5 - 2.0 * sin);
    assert!((base.uv_transform.apply(Vec2::X) - expected).length() < 1e-6);
    let rough = rich.metallic_roughness_texture.as_ref().unwrap();
    assert_eq!((rough.color_space, rough.image.rgba.len()), (ColorSpace::Linear, 16));
    assert_eq!(rich.normal_map.as_ref().unwrap().scale, 0.5);
    assert_eq!((glass.transmission, glass.ior), (0.9, 1.33));
    // The node is twice as large, and thickness with it; the attenuation distance is in the world already.
    assert_eq!((glass.thickness_m, glass.attenuation_distance_m), (1.0, 0.1));
    assert!((glass.transmittance(0.1) - Vec3::new(0.2, 0.8, 0.4)).length() < 1e-6);
    assert!((glass.transmittance(0.2) - (-glass.absorption_per_m() * 0.2).exp()).length() < 1e-6);
    assert_eq!((default.base_color, default.metallic, default.roughness), (Vec4::ONE, 1.0, 1.0));
}

/// The message of the error that this change of `features.gltf` leads to.
fn broken(change: impl FnOnce(&mut Value)) -> String {
    let folder = tempfile::tempdir().unwrap();
    for name in ["features.bin", "two by two.png"] {
        std::fs::copy(data(name), folder.path().join(name)).unwrap();
    }
    let mut document: Value = serde_json::from_slice(&std::fs::read(data("features.gltf")).unwrap()).unwrap();
    change(&mut document);
    let path = folder.path().join("broken.gltf");
    std::fs::write(&path, document.to_string()).unwrap();
    let error = import(&path).map(|imported| imported.statistics).unwrap_err().to_string();
    assert!(error.contains("broken.gltf"), "{error}");
    error
}

fn assert_names(error: &str, parts: &[&str]) {
    assert!(parts.iter().all(|part| error.contains(part)), "{error:?} should name {parts:?}");
}

#[test]
fn references_out_of_the_folder_are_refused() {
    for uri in [
        "../../etc/passwd",
        "/etc/passwd",
        "a/../../b.bin",
        "%2e%2e/secret.bin",
        "..\\b.bin",
        "C:/b.bin",
        "http://example.com/a.bin",
        "file:///etc/passwd",
        "",
    ] {
        let error = broken(|document| document["buffers"][0]["uri"] = json!(uri));
        assert_names(&error, &["buffers[0]", "only files in the folder"]);
        let error = broken(|document| document["images"][0]["uri"] = json!(uri));
        assert_names(&error, &["images[0]", "only files in the folder"]);
    }
    let error = broken(|document| document["buffers"][0]["uri"] = json!("missing.bin"));
    assert_names(&error, &["buffers[0]", "cannot read", "missing.bin"]);
}

#[test]
fn counts_beyond_the_data_are_refused() {
    let accessor =
        |number: usize, count: u64| broken(|document| document["accessors"][number]["count"] = json!(count));
    assert_names(&accessor(0, 7), &["accessors[0]", "7 elements of 12 bytes", "bufferViews[0]"]);
    assert_names(&accessor(0, 0), &["accessors[0]", "count is 0"]);
    assert_names(&accessor(0, u64::MAX), &["accessors[0]", "count"]);
    let error = broken(|document| document["accessors"][0]["byteOffset"] = json!(u64::MAX));
    assert_names(&error, &["accessors[0]"]);
    let error = broken(|document| document["bufferViews"][2]["byteLength"] = json!(1_000_000));
    assert_names(&error, &["bufferViews[2]", "1000000 bytes"]);
    let error = broken(|document| document["buffers"][0]["byteLength"] = json!(1_000_000));
    assert_names(&error, &["buffers[0]", "1000000"]);
    // Sparse without a view: nothing but the count itself says how much memory is wanted.
    let error = broken(|document| {
        let accessor = document["accessors"]
            .as_array_mut()
            .unwrap()
            .iter_mut()
            .find(|a| !a["sparse"].is_null())
            .unwrap();
        accessor["count"] = json!(4_000_000_000_u64);
        accessor.as_object_mut().unwrap().remove("bufferView");
    });
    assert_names(&error, &["accessors[", "count is 4000000000"]);
}

#[test]
fn dangling_references_are_refused() {
    let set = |path: [&str; 2], key: &str, value: Value| {
        broken(|document| document[path[0]][path[1].parse::<usize>().unwrap()][key] = value)
    };
    assert_names(&set(["nodes", "1"], "mesh", json!(99)), &["nodes[1].mesh"]);
    assert_names(&set(["nodes", "0"], "children", json!([99])), &["nodes[0].children"]);
    assert_names(&set(["nodes", "1"], "children", json!([0])), &["nodes[0] 'root'", "child of several"]);
    assert_names(&set(["textures", "0"], "source", json!(9)), &["textures[0].source"]);
    assert_names(&set(["nodes", "1"], "scale", json!([3e38, 1, 1])), &["nodes["]);
    let primitive = |key: &str, value: Value| {
        broken(|document| document["meshes"][0]["primitives"][0]["attributes"][key] = value)
    };
    assert_names(
        &primitive("POSITION", json!(99)),
        &["meshes[0].primitives[0].attributes.POSITION", "accessor 99"],
    );
    assert_names(
        &primitive("NORMAL", json!(4)),
        &["meshes[0] 'strip', primitive 0", "NORMAL has 5", "POSITION has 6"],
    );
    let error = broken(|document| document["meshes"][1]["primitives"][0]["indices"] = json!(0));
    assert_names(&error, &["accessors[0]"]);
    let error =
        broken(|document| document["materials"][0]["pbrMetallicRoughness"]["roughnessFactor"] = json!(7));
    assert_names(&error, &["materials[0]"]);
}

#[test]
fn required_extensions_are_named() {
    let require = |name: &str| broken(|document| document["extensionsRequired"] = json!([name]));
    assert_names(
        &require("KHR_draco_mesh_compression"),
        &["extensionsRequired", "draco", "without compression"],
    );
    assert_names(&require("KHR_texture_basisu"), &["basisu", "PNG or JPEG"]);
    assert_names(&require("ACME_wobble"), &["ACME_wobble", "not supported"]);
}

/// A PNG header that claims 16000 × 16000 texels must not make room for them.
#[test]
fn picture_bombs_are_refused() {
    let mut png = std::fs::read(data("two by two.png")).unwrap();
    png[16..24].copy_from_slice(&[0, 0, 0x3E, 0x80, 0, 0, 0x3E, 0x80]);
    let folder = tempfile::tempdir().unwrap();
    std::fs::copy(data("features.bin"), folder.path().join("features.bin")).unwrap();
    std::fs::copy(data("features.gltf"), folder.path().join("bomb.gltf")).unwrap();
    std::fs::write(folder.path().join("two by two.png"), png).unwrap();
    let error = import(folder.path().join("bomb.gltf")).map(drop).unwrap_err().to_string();
    assert_names(&error, &["bomb.gltf", "images[0]", "beside"]);
}

#[test]
fn broken_containers_are_refused() {
    let whole = std::fs::read(data("placed.glb")).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("broken.glb");
    let with = |at: usize, word: u32| {
        let mut bytes = whole.clone();
        bytes[at..at + 4].copy_from_slice(&word.to_le_bytes());
        std::fs::write(&path, bytes).unwrap();
        import(&path).map(drop).unwrap_err().to_string()
    };
    assert_names(&with(4, 1), &["broken.glb", "GLB header", "version 1"]);
    // A length shorter than the header itself.
    assert_names(&with(8, 3), &["GLB header", "3 bytes"]);
    assert_names(&with(8, u32::MAX), &["GLB header"]);
    assert_names(&with(12, u32::MAX), &["GLB chunk 0"]);
    assert_names(&with(16, 0), &["GLB chunk 0", "JSON"]);
}

/// Bounds of positions are not needed and some writers leave them out.
#[test]
fn missing_bounds_do_no_harm() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["features.bin", "two by two.png"] {
        std::fs::copy(data(name), folder.path().join(name)).unwrap();
    }
    let mut document: Value = serde_json::from_slice(&std::fs::read(data("features.gltf")).unwrap()).unwrap();
    for accessor in document["accessors"].as_array_mut().unwrap() {
        accessor.as_object_mut().unwrap().remove("min");
    }
    let path = folder.path().join("bare.GLTF");
    std::fs::write(&path, document.to_string()).unwrap();
    assert_eq!(import(&path).unwrap().statistics.triangles, 9);
}
