//! OBJ and PLY: small files by hand, independent readers on real ones.

#![allow(clippy::unwrap_used, clippy::panic, reason = "helpers of tests outside of #[test] functions")]

use std::fs::{create_dir, write};
use std::io::Cursor;
use std::path::{Path, PathBuf};

use coshade_scene::import::{ImportOptions, MissingNormals, Up, import_with};
use coshade_scene::topology::Topology;
use coshade_scene::{AlphaMode, Imported, import};
use glam::{Vec2, Vec3, Vec4};

fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data").join(name)
}

fn imported(name: &str, text: &str) -> Result<Imported, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    write(&path, text).unwrap();
    import(&path).map_err(|error| error.to_string())
}

const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

#[test]
fn obj_faces_of_all_kinds() {
    let text = format!(
        "{SQUARE}vt 0.25 0.75\nvn 0 0 2\nf 1/1/1 2/1/1 3/1/1 4/1/1\nf -4//-1 -3//-1 -2//-1\nf 1 2 \\\n 3\n"
    );
    let Imported { mesh, materials, statistics, warnings } = imported("a.obj", &text).unwrap();
    assert_eq!((statistics.triangles, statistics.parts, warnings.len()), (4, 1, 0));
    assert!((mesh.area_m2() - 2.0).abs() < 1e-12);
    assert!(mesh.normals.iter().all(|&normal| normal == Vec3::Z));
    assert_eq!(mesh.uvs[0], Vec2::new(0.25, 0.25), "v runs down here");
    assert_eq!(materials[0].metallic, 0.0);
    let concave = "v 0 0 0\nv 2 0 0\nv 2 1 0\nv 1 1 0\nv 1 2 0\nv 0 2 0\nf 4 5 6 1 2 3\n";
    assert!((imported("l.obj", concave).unwrap().mesh.area_m2() - 3.0).abs() < 1e-6);
}

#[test]
fn obj_errors_name_the_line() {
    let error = |text: &str| imported("bad.obj", text).unwrap_err();
    let with = |line: &str| error(&format!("{SQUARE}# a comment\n{line}\n"));
    for (text, what) in [
        ("f 1 2 9", "'9' is no vertex (v), there are 4"),
        ("f 1 2 0", "'0' is no vertex"),
        ("f 1 2 -5", "'-5' is no vertex"),
        ("f 1/1 2/1 3/1", "'1' is no texture coordinate (vt), there are 0"),
        ("f 1//7 2//7 3//7", "'7' is no normal"),
        ("f 1 2", "a face of 2 corners"),
        ("f / / /", "has no vertex"),
        ("f 99999999999999999999 1 2", "is no vertex"),
        ("v 1 2", "2 numbers, expected 3"),
        ("v 1 2 three", "'three' is not a number"),
    ] {
        let message = with(text);
        assert!(message.contains("bad.obj: line 6: ") && message.contains(what), "{message}");
    }
    assert!(error("# nothing\n").contains("no triangles"));
    assert!(error("mtllib ../up.mtl\nf 1 2 3").contains("line 2"));
    assert!(error(&format!("mtllib ../up.mtl\n{SQUARE}f 1 2 3")).contains("line 1: refers to '../up.mtl'"));
    let curve = imported("c.obj", &format!("{SQUARE}l 1 2\nl 2 3\nf 1 2 3\n")).unwrap();
    assert_eq!(curve.warnings, ["line 5: 'l' (2 lines) is left out"]);
}

#[test]
fn obj_materials() {
    let folder = tempfile::tempdir().unwrap();
    create_dir(folder.path().join("maps")).unwrap();
    std::fs::copy(data("two by two.png"), folder.path().join("maps/two by two.png")).unwrap();
    let library = "newmtl red paint\nKd 0.8 0.1 0.1\nNs 30\nd 0.5\nmap_Kd -s 2 3 1 -o 0.5 0 0 maps\\two by two.png\n\
                   newmtl odd\nKd 2 0 0\nNi 0.2\nmap_bump x.png\n";
    write(folder.path().join("my lib.mtl"), library).unwrap();
    let text = format!(
        "mtllib my lib.mtl\nmtllib gone.mtl\n{SQUARE}usemtl red paint\nf 1 2 3\nusemtl odd\nf 1 3 4\nusemtl none\nf 1 2 4\nusemtl odd\nf 4 3 1\n"
    );
    let path = folder.path().join("square.obj");
    write(&path, text).unwrap();
    let Imported { mesh, materials, statistics, warnings } = import(&path).unwrap();
    assert_eq!((statistics.parts, statistics.images), (3, 1));
    assert_eq!(mesh.parts[1].triangles, 1..3, "both runs of a material are one part");
    let red = &materials[0];
    assert_eq!((red.name.as_str(), red.base_color), ("red paint", Vec4::new(0.8, 0.1, 0.1, 0.5)));
    assert_eq!(red.alpha_mode, AlphaMode::Blend);
    // α of the Phong exponent 30 is √(2/32) = 1/4.
    assert!((red.alpha() - 0.25).abs() < 1e-6);
    // A point at OBJ's (u, v) = (0.1, 0.2) looks up (2·0.1 + 0.5, 3·0.2) from below, 1 − that from above.
    let texture = red.base_color_texture.as_ref().unwrap();
    assert!(
        (texture.uv_transform.apply(Vec2::new(0.1, 1.0 - 0.2)) - Vec2::new(0.7, 1.0 - 0.6)).length() < 1e-6
    );
    assert_eq!((materials[1].base_color.x, materials[1].ior), (1.0, 1.5));
    for part in ["gone.mtl", "'none'", "'map_bump' is ignored", "base_color = 2"] {
        assert!(warnings.iter().any(|warning| warning.contains(part)), "{part}: {warnings:?}");
    }
}

#[test]
fn up_axis_unit_and_shading_can_be_stated() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("roof.obj");
    // Two triangles at a right angle that share an edge.
    write(&path, "v 0 0 0\nv 0 0 1\nv 1 0 0\nv 0 1 0\nf 1 2 4\nf 1 3 2\n").unwrap();
    let plain = import(&path).unwrap().mesh;
    assert_eq!(plain.positions.len(), 4);
    let options = ImportOptions { up: Up::Y, unit_m: 0.01, missing_normals: MissingNormals::Flat };
    let turned = import_with(&path, &options).unwrap().mesh;
    assert_eq!(turned.positions.len(), 6);
    let aabb = turned.aabb().unwrap();
    assert!((aabb.max - Vec3::new(0.01, 0.0, 0.01)).length() < 1e-8 && (aabb.min.y + 0.01).abs() < 1e-8);
    for (corners, [a, b, c]) in turned.triangles().zip(turned.triangle_positions()) {
        let facing = (b - a).cross(c - a).normalize_or_zero();
        assert!(corners.iter().all(|&corner| (turned.normals[corner as usize] - facing).length() < 1e-5));
    }
    let error = import_with(&path, &ImportOptions { unit_m: 0.0, ..options }).unwrap_err().to_string();
    assert!(error.contains("unit_m = 0"), "{error}");
}

#[test]
fn broken_normals_are_replaced_and_told() {
    let Imported { mesh, warnings, .. } =
        imported("n.obj", &format!("{SQUARE}vn 0 0 0\nvn 0 0 1\nf 1//1 2//2 3//2\n")).unwrap();
    assert!(mesh.normals.iter().all(|&normal| normal == Vec3::Z));
    assert_eq!(warnings.len(), 1, "{warnings:?}");
    let ply = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nproperty float nx\n\
               property float ny\nproperty float nz\nelement face 1\nproperty list uchar int vertex_index\nend_header\n\
               0 0 0 0 0 0\n1 0 0 nan 0 0\n0 1 0 0 0 3\n3 0 1 2\n";
    let Imported { mesh, warnings, .. } = imported("n.ply", ply).unwrap();
    assert!(mesh.normals.iter().all(|&normal| normal == Vec3::Z));
    assert_eq!(warnings, ["2 normals are zero or not finite, smooth ones instead"]);
}

#[test]
fn ply_of_trimesh() {
    for name in ["cube_ascii.ply", "cube_binary.ply"] {
        let mesh = import(data(name)).unwrap().mesh;
        assert!((mesh.area_m2() - 22.0).abs() < 1e-9 && (mesh.volume_m3() - 6.0).abs() < 1e-9, "{name}");
        assert!(Topology::of(&mesh).is_closed(), "{name}");
    }
}

/// The same two faces in text and in both byte orders, with colours, texture coordinates, a foreign element and a strip.
#[test]
fn ply_formats_agree() {
    let header = |format: &str| {
        format!(
            "ply\nformat {format} 1.0\ncomment x\nelement camera 1\nproperty list uchar short view\nelement vertex 4\n\
             property double x\nproperty float y\nproperty short z\nproperty uchar red\nproperty uchar green\n\
             property uchar blue\nproperty float s\nproperty float t\nelement face 1\nproperty char flags\n\
             property list uchar uint vertex_indices\nelement tristrips 1\nproperty list int int vertex_indices\nend_header\n"
        )
    };
    let vertices = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
    let mut ascii = header("ascii") + "2 7 8\n";
    for [x, y, z] in vertices {
        ascii += &format!("{x} {y} {z} 255 0 0 {x} {y}\n");
    }
    ascii += "1 4 0 1 2 3\n8 0 1 3 2 -1 0 1 2";
    let mut meshes = vec![imported("a.ply", &ascii).unwrap().mesh];
    for (format, big) in [("binary_little_endian", false), ("binary_big_endian", true)] {
        let mut bytes = header(format).into_bytes();
        let mut put = |value: &[u8]| {
            let mut value = value.to_vec();
            if big {
                value.reverse();
            }
            bytes.extend(value);
        };
        put(&[2]);
        put(&7_i16.to_le_bytes());
        put(&8_i16.to_le_bytes());
        for [x, y, z] in vertices {
            put(&f64::to_le_bytes(x));
            put(&(y as f32).to_le_bytes());
            put(&(z as i16).to_le_bytes());
            [255, 0, 0].iter().for_each(|&part: &u8| put(&[part]));
            put(&(x as f32).to_le_bytes());
            put(&(y as f32).to_le_bytes());
        }
        put(&[1]);
        put(&[4]);
        [0, 1, 2, 3].iter().for_each(|index: &u32| put(&index.to_le_bytes()));
        [8, 0, 1, 3, 2, -1, 0, 1, 2].iter().for_each(|index: &i32| put(&index.to_le_bytes()));
        let folder = tempfile::tempdir().unwrap();
        write(folder.path().join("a.ply"), bytes).unwrap();
        meshes.push(import(folder.path().join("a.ply")).unwrap().mesh);
    }
    assert_eq!(meshes[0], meshes[1]);
    assert_eq!(meshes[0], meshes[2]);
    let mesh = &meshes[0];
    assert_eq!(mesh.indices, [0, 1, 2, 0, 2, 3, 0, 1, 3, 1, 2, 3, 0, 1, 2]);
    assert_eq!((mesh.colors[2], mesh.uvs[3]), (Vec4::new(1.0, 0.0, 0.0, 1.0), Vec2::new(0.0, 0.0)));
}

#[test]
fn ply_errors_name_the_place() {
    let with = |body: &str| {
        let header = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
                      element face 1\nproperty list uchar int vertex_indices\nend_header\n";
        imported("bad.ply", &format!("{header}{body}")).unwrap_err()
    };
    for (body, what) in [
        ("0 0 0\n1 0 0\n0 one 0\n3 0 1 2\n", "line 12, vertex 2: 'one' is not a number"),
        ("0 0 0\n1 0 0\n0 1 0\n3 0 1 7\n", "face 0: index 7, but there are only 3"),
        ("0 0 0\n1 0 0\n0 1 0\n3 0 1 -2\n", "face 0: -2 is no index"),
        ("0 0 0\n1 0 0\n0 1 0\n2 0 1\n", "face 0: 2 corners"),
        ("0 0 0\n1 0 0\n0 1 0\n200 0 1 2\n", "face 0: a list of 200"),
        ("0 0 0\n1 0 0\n0 1 0\n3 0 1", "face 0: a list of 3 numbers, at most 2 follow"),
        ("0 0 0\n", "element vertex: 3 items"),
    ] {
        let message = with(body);
        assert!(message.contains("bad.ply: ") && message.contains(what), "{message}");
    }
    let huge = "ply\nformat binary_little_endian 1.0\nelement vertex 4000000000\nproperty float x\nproperty float y\n\
                property float z\nend_header\n";
    assert!(imported("h.ply", huge).unwrap_err().contains("element vertex: 4000000000 items"));
    assert!(imported("n.ply", "obj\n").unwrap_err().contains("line 1"));
    assert!(
        imported("n.ply", "ply\nformat ascii 1.0\nelement face 99999999999999\nend_header\n")
            .unwrap_err()
            .contains("no triangles")
    );
}

#[test]
fn unknown_endings_and_missing_files() {
    assert!(imported("a.stl", "").unwrap_err().contains("unknown ending 'stl', expected .glb"));
    assert!(import("no/such.obj").unwrap_err().to_string().contains("no/such.obj"));
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("folder.obj");
    create_dir(&path).unwrap();
    assert!(import(&path).unwrap_err().to_string().contains("not a regular file"));
}

/// Counts, bounds and manifoldness as trimesh 5.2 gives them (vertices merged by position), area in the file's unit.
#[test]
fn real_meshes_are_as_trimesh_has_them() {
    struct Truth {
        file: &'static str,
        triangles: usize,
        welded: usize,
        open: usize,
        non_manifold: usize,
        area: f64,
        min: [f32; 3],
        max: [f32; 3],
    }
    let truths = [
        Truth {
            file: "buddha_20k.obj",
            triangles: 20000,
            welded: 9990,
            open: 0,
            non_manifold: 0,
            area: 5.935_532_53,
            min: [-0.410963, -0.411538, -1.0],
            max: [0.410963, 0.411538, 1.0],
        },
        Truth {
            file: "dragon_vrip_res3.ply",
            triangles: 47794,
            welded: 22982,
            open: 0,
            non_manifold: 2094,
            area: 0.072_936_236,
            min: [-0.107_673, 0.052_774_3, -0.050_051],
            max: [0.095_982_5, 0.196_644, 0.040_826_2],
        },
        Truth {
            file: "stanford-bunny.obj",
            triangles: 69451,
            welded: 34834,
            open: 223,
            non_manifold: 0,
            area: 0.057_128_786,
            min: [-0.09469, 0.032987, -0.061874],
            max: [0.061009, 0.187321, 0.0588],
        },
        Truth {
            file: "suzanne.obj",
            triangles: 968,
            welded: 505,
            open: 42,
            non_manifold: 1,
            area: 12.468_539_1,
            min: [-3.86125, 0.267311, 3.25233],
            max: [-1.126875, 2.236061, 4.955455],
        },
        Truth {
            file: "teapot.obj",
            triangles: 6320,
            welded: 3241,
            open: 160,
            non_manifold: 0,
            area: 52.660_793_4,
            min: [-3.0, 0.0, -2.0],
            max: [3.434, 3.15, 2.0],
        },
    ];
    for truth in truths {
        let Some(path) =
            coshade_testdata::find("real_meshes_are_as_trimesh_has_them", &format!("meshes/{}", truth.file))
        else {
            return;
        };
        let mesh = import(path).unwrap().mesh;
        let file = truth.file;
        assert_eq!(mesh.triangle_count(), truth.triangles, "{file}");
        let topology = Topology::of(&mesh);
        assert_eq!(topology.vertices, truth.welded, "{file}");
        assert_eq!(
            (topology.open_edges.len(), topology.non_manifold_edges.len()),
            (truth.open, truth.non_manifold),
            "{file}"
        );
        assert!((mesh.area_m2() / truth.area - 1.0).abs() < 2e-6, "{file}: {}", mesh.area_m2());
        let aabb = mesh.aabb().unwrap();
        assert!((aabb.min - Vec3::from_array(truth.min)).abs().max_element() < 1e-6, "{file}: {aabb:?}");
        assert!((aabb.max - Vec3::from_array(truth.max)).abs().max_element() < 1e-6, "{file}: {aabb:?}");
        let sphere = mesh.bounding_sphere().unwrap();
        assert!(mesh.positions.iter().all(|point| point.distance(sphere.center) <= sphere.radius), "{file}");
        assert!(sphere.radius <= 0.6 * aabb.size().length(), "{file}");
    }
}

/// Corner by corner as `tobj` reads files of triangles.
#[test]
fn obj_agrees_with_tobj() {
    for file in ["buddha_20k.obj", "stanford-bunny.obj", "teapot.obj"] {
        let Some(path) = coshade_testdata::find("obj_agrees_with_tobj", &format!("meshes/{file}")) else {
            return;
        };
        let ours: Vec<Vec3> = import(&path).unwrap().mesh.triangle_positions().flatten().collect();
        let (models, _) =
            tobj::load_obj(&path, &tobj::LoadOptions { triangulate: true, ..Default::default() }).unwrap();
        let theirs: Vec<Vec3> = models
            .iter()
            .flat_map(|model| {
                let mesh = &model.mesh;
                mesh.indices.iter().map(|&index| Vec3::from_slice(&mesh.positions[3 * index as usize..]))
            })
            .collect();
        assert_eq!(ours.len(), theirs.len(), "{file}");
        assert!(ours.iter().zip(&theirs).all(|(a, b)| (*a - *b).length() < 1e-6), "{file}");
    }
}

/// Vertex by vertex as `ply-rs-bw` reads it.
#[test]
fn ply_agrees_with_ply_rs() {
    use ply_rs_bw::{
        parser::Parser,
        ply::{DefaultElement, Property},
    };
    let Some(path) = coshade_testdata::find("ply_agrees_with_ply_rs", "meshes/dragon_vrip_res3.ply") else {
        return;
    };
    let ours = import(&path).unwrap().mesh;
    let parsed =
        Parser::<DefaultElement>::new().read_ply(&mut Cursor::new(std::fs::read(&path).unwrap())).unwrap();
    let number = |element: &DefaultElement, name: &str| match &element[name] {
        Property::Float(value) => *value,
        other => panic!("{other:?}"),
    };
    let theirs =
        parsed.payload["vertex"].iter().map(|v| Vec3::new(number(v, "x"), number(v, "y"), number(v, "z")));
    assert!(ours.positions.iter().copied().eq(theirs));
    let indices = parsed.payload["face"].iter().flat_map(|face| match &face["vertex_indices"] {
        Property::ListInt(list) => list.iter().map(|&index| index as u32).collect::<Vec<_>>(),
        other => panic!("{other:?}"),
    });
    assert!(ours.indices.iter().copied().eq(indices));
}
