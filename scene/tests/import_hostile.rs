//! Damaged files: no panic, no hang, no mesh that does not hold together, and every error names its file.

#![allow(clippy::unwrap_used, clippy::panic, reason = "helpers of tests outside of #[test] functions")]

use std::fs::{copy, read, write};
use std::path::{Path, PathBuf};

use coshade_scene::{import, validity};
use coshade_testdata::mutate::mutations;

/// Of each file.
const MUTATIONS: u64 = 400;

fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data").join(name)
}

fn survives(name: &str, seed: &[u8]) {
    let folder = tempfile::tempdir().unwrap();
    for beside in ["features.bin", "two by two.png"] {
        copy(data(beside), folder.path().join(beside)).unwrap();
    }
    write(folder.path().join("a.mtl"), MTL).unwrap();
    let path = folder.path().join(name);
    write(&path, seed).unwrap();
    import(&path).unwrap();
    let mut errors = 0;
    for (number, bytes) in mutations(seed, MUTATIONS) {
        write(&path, bytes).unwrap();
        match import(&path) {
            Err(error) => {
                let text = error.to_string();
                assert!(text.contains(name) && text.len() > name.len() + 10, "mutation {number}: {text}");
                errors += 1;
            }
            Ok(imported) => {
                imported.mesh.check().unwrap_or_else(|error| panic!("mutation {number}: {error}"));
                let materials: Vec<_> = imported.materials.iter().map(AsRef::as_ref).collect();
                validity::check_mesh(&imported.mesh, &materials, 1.0);
                imported.mesh.bounding_sphere();
            }
        }
    }
    assert!(errors > MUTATIONS / 20, "only {errors} mutations of {name} are errors: do they hit anything?");
}

const MTL: &str =
    "newmtl paint\nKd 0.8 0.1 0.1\nNs 30\nd 0.5\nmap_Kd -s 2 3 1 two by two.png\nnorm two by two.png\n";
const OBJ: &str = "mtllib a.mtl\nv 0 0 0\nv 1 0 0 1 0 0\nv 1 1 0\nv 0 1 0\nv 0.5 0.2 1\nvt 0 0\nvt 1 1\nvn 0 0 1\nvn 0 1 0\n\
                   usemtl paint\nf 1/1/1 2/2/1 3/1/2 4/2/2\nf -1//1 -2//2 -3//1\nf 1 2 5 4 3\nusemtl other\nf 1/1 2/2 5/1\n";

#[test]
fn damaged_glb() {
    survives("a.glb", &read(data("placed.glb")).unwrap());
}

#[test]
fn damaged_gltf() {
    survives("a.gltf", &read(data("features.gltf")).unwrap());
}

#[test]
fn damaged_obj() {
    survives("a.obj", OBJ.as_bytes());
}

#[test]
fn damaged_ply() {
    survives("a.ply", &read(data("cube_ascii.ply")).unwrap());
    survives("b.ply", &read(data("cube_binary.ply")).unwrap());
}

/// The buffer and the picture beside a glTF document, damaged.
#[test]
fn damaged_neighbours() {
    for neighbour in ["features.bin", "two by two.png"] {
        let folder = tempfile::tempdir().unwrap();
        for name in ["features.bin", "two by two.png", "features.gltf"] {
            copy(data(name), folder.path().join(name)).unwrap();
        }
        for (number, bytes) in mutations(&read(data(neighbour)).unwrap(), MUTATIONS) {
            write(folder.path().join(neighbour), bytes).unwrap();
            if let Ok(imported) = import(folder.path().join("features.gltf")) {
                imported.mesh.check().unwrap_or_else(|error| panic!("mutation {number}: {error}"));
            }
        }
    }
}

/// A library with damages, which is read beside an intact OBJ.
#[test]
fn damaged_mtl() {
    let folder = tempfile::tempdir().unwrap();
    copy(data("two by two.png"), folder.path().join("two by two.png")).unwrap();
    write(folder.path().join("a.obj"), OBJ).unwrap();
    for (number, bytes) in mutations(MTL.as_bytes(), MUTATIONS) {
        write(folder.path().join("a.mtl"), bytes).unwrap();
        if let Ok(imported) = import(folder.path().join("a.obj")) {
            for material in &imported.materials {
                material.check().unwrap_or_else(|error| panic!("mutation {number}: {error}"));
            }
        }
    }
}
