use nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion, Vector3};

use super::*;

const BOARD: &str = "version = 1\nfamily = 'tag36h11'\n[[tag]]\nid = 3\nsize_m = 0.03\nposition_m = [-0.02, 0.02]\n\
                     [[tag]]\nid = 4\nsize_m = 0.03\nposition_m = [0.02, 0.02]\n";

/// Tags on the top (+z) and on the face towards +x of a cube of 10 cm; the second of another family.
const CUBE: &str = "version = 1\nfamily = 'tag36h11'\n[[tag]]\nid = 3\nsize_m = 0.08\nposition_m = [0, 0, 0.05]\n\
                    [[tag]]\nid = 3\nfamily = 'tag25h9'\nsize_m = 0.06\nposition_m = [0.05, 0, 0]\n\
                    rotation_deg = [90, 0, 90]\n[provenance]\ntool = 'ruler'\nrms_px = 0.2\n";

#[test]
fn a_board_is_read() {
    let board = Board::parse(BOARD, "board.toml").unwrap();
    assert_eq!(board.family, Family::Tag36h11);
    assert_eq!(board.tags[1], BoardTag::flat(4, 0.03, [0.02, 0.02]));
    assert!(board.is_flat().unwrap());
    let [low, high] = board.extent_m().unwrap();
    assert!((low - Point3::new(-0.035, 0.005, 0.0)).norm() < 1e-15);
    assert!((high - Point3::new(0.035, 0.035, 0.0)).norm() < 1e-15);
}

#[test]
fn a_thing_in_space_is_read() {
    let board = Board::parse(CUBE, "cube.toml").unwrap();
    assert!(!board.is_flat().unwrap());
    assert_eq!(board.families(), [Family::Tag25h9, Family::Tag36h11]);
    assert_eq!(board.provenance.as_ref().unwrap().rms_px, Some(0.2));
    let body = Body::from_board("cube", &board).unwrap();
    assert_eq!(body.tags[1].tag, TagId { family: Family::Tag25h9, id: 3 });
    // Rz(90°)·Rx(90°): the print's right is +y, its up is +z, and it faces +x.
    let face = body.tags[1].body_from_tag;
    let axes = [Vector3::x(), Vector3::y(), Vector3::z()].map(|axis| face * axis);
    for (axis, expected) in axes.iter().zip([Vector3::y(), Vector3::z(), Vector3::x()]) {
        assert!((axis - expected).norm() < 1e-15, "{axis} {expected}");
    }
    let lower_left = body.tags[1].corners_m()[0];
    assert!((lower_left - Point3::new(0.05, -0.03, -0.03)).norm() < 1e-15, "{lower_left}");
}

#[test]
fn angles_and_quaternions_are_those_of_their_matrices() {
    let angles_deg = [12.0, -34.0, 56.0];
    let [x, y, z] = angles_deg.map(f64::to_radians);
    let about = |axis: Vector3<f64>, angle| *Rotation3::from_scaled_axis(axis * angle).matrix();
    let expected: Matrix3<f64> = about(Vector3::z(), z) * about(Vector3::y(), y) * about(Vector3::x(), x);
    let tag = BoardTag { rotation_deg: Some(angles_deg), ..BoardTag::flat(0, 0.1, [0.0, 0.0]) };
    let rotation = tag.board_from_tag().unwrap().rotation;
    assert!((rotation.to_rotation_matrix().matrix() - expected).norm() < 1e-15);
    let placed = BoardTag::placed(0, 0.1, &tag.board_from_tag().unwrap());
    assert!((placed.board_from_tag().unwrap().rotation.inverse() * rotation).angle() < 1e-15);
    // A quarter turn about z, written with three digits.
    let rounded =
        BoardTag { quaternion_xyzw: Some([0.0, 0.0, 0.707, 0.707]), ..BoardTag::flat(0, 0.1, [0.0; 2]) };
    let turned = rounded.board_from_tag().unwrap() * Vector3::x();
    assert!((turned - Vector3::y()).norm() < 1e-15, "{turned}");
}

#[test]
fn flat_means_one_plane_seen_from_one_side() {
    let tilt = UnitQuaternion::from_euler_angles(0.3, 0.2, 0.1);
    let at = |id, place: Isometry3<f64>| BoardTag::placed(id, 0.05, &place);
    let sheet = Isometry3::from_parts(Translation3::new(1.0, 2.0, 3.0), tilt);
    let board = |second: Isometry3<f64>| Board {
        version: VERSION,
        family: Family::Tag36h11,
        tags: vec![at(0, sheet), at(1, sheet * second)],
        provenance: None,
    };
    let beside = Isometry3::new(Vector3::new(0.2, 0.1, 0.0), Vector3::new(0.0, 0.0, 0.7));
    let above = Isometry3::translation(0.2, 0.1, 0.001);
    let behind = Isometry3::rotation(Vector3::new(0.0, std::f64::consts::PI, 0.0));
    assert!(board(beside).is_flat().unwrap());
    assert!(!board(above).is_flat().unwrap());
    assert!(!board(behind).is_flat().unwrap());
}

#[test]
fn mistakes_are_named() {
    for (text, from, to, message) in [
        (BOARD, "tag36h11", "tag36h10", "family"),
        (BOARD, "id = 4", "id = 587", "tag[1].id: tag36h11 has no tag 587"),
        (BOARD, "id = 4", "id = 3", "tag[1].id: tag36h11 3 is tag[0] already"),
        (BOARD, "0.03\n", "0.0\n", "tag[0].size_m"),
        (BOARD, "0.03\n", "1e-9\n", "tag[0].size_m: 0.000000001 m is no length"),
        (BOARD, "0.03\n", "nan\n", "tag[0].size_m"),
        (BOARD, "size_m", "size", "unknown key"),
        (BOARD, "[-0.02, 0.02]", "[0.02]", "tag[0].position_m"),
        (BOARD, "[-0.02, 0.02]", "[1, 2, 3, 4]", "tag[0].position_m"),
        (CUBE, "family = 'tag25h9'", "family = 'tag36h11'", "tag[1].id: tag36h11 3 is tag[0] already"),
        (CUBE, "[90, 0, 90]", "[90, 0, 90]\nquaternion_xyzw = [0, 0, 0, 1]", "beside `rotation_deg`"),
        (CUBE, "rotation_deg = [90, 0, 90]", "quaternion_xyzw = [0, 0, 0, 1.01]", "cube.toml:12:19"),
        (CUBE, "rotation_deg", "rotation_rad", "did you mean `rotation_deg`"),
        (CUBE, "rms_px = 0.2", "rms_px = -1", "provenance.rms_px"),
        (CUBE, "tool", "toll", "provenance.toll: unknown key"),
    ] {
        assert!(text.contains(from), "{from}");
        let error = Board::parse(&text.replacen(from, to, 1), "cube.toml").unwrap_err().to_string();
        assert!(error.contains(message), "{message} in: {error}");
    }
}

#[test]
fn what_is_saved_is_read_again() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("cube.toml");
    for text in [BOARD, CUBE] {
        let board = Board::parse(text, "board.toml").unwrap();
        board.save(&path).unwrap();
        assert_eq!(Board::read(&path).unwrap(), board);
    }
    let before = std::fs::read(&path).unwrap();
    let mut twice = Board::parse(BOARD, "board.toml").unwrap();
    twice.tags[1].id = 3;
    assert!(twice.save(&path).unwrap_err().to_string().contains("already"));
    let mut nowhere = Board::parse(BOARD, "board.toml").unwrap();
    nowhere.tags[1].position_m = vec![f64::NAN, 0.0];
    assert!(nowhere.save(&path).is_err());
    assert!(nowhere.mistakes()[0].to_string().contains("tag[1].position_m"));
    assert_eq!(std::fs::read(&path).unwrap(), before, "a refused board changed the file");
}

#[test]
fn damaged_boards_are_refused_or_read() {
    for text in [BOARD, CUBE] {
        for (_, bytes) in coshade_testdata::mutate::mutations(text.as_bytes(), 300) {
            if let Ok(board) = Board::parse(&String::from_utf8_lossy(&bytes), "board.toml") {
                assert!(Body::from_board("damaged", &board).is_ok());
                assert!(board.is_flat().is_ok());
            }
        }
    }
}
