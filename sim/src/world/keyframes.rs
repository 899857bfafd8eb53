//! The rig's keyframes.

use coshade_scene::session::placement::Placement;
use glam::{DMat3, DQuat, DVec3};

use super::spec::{KeyframeSpec, WorldSpec};
use crate::path::{Keyframe, Path, PathError};
use crate::pose::Rigid;

/// A keyframe, or the key that is wrong and why.
pub(super) fn keyframe(spec: &KeyframeSpec) -> Result<Keyframe, (&'static str, String)> {
    let position_m = DVec3::from_array(spec.position_m);
    let rotation = match (spec.look_at_m, spec.quaternion_xyzw) {
        (Some(_), Some(_)) => Err(("quaternion_xyzw", "`quaternion_xyzw` beside `look_at_m`".into())),
        (Some(target_m), None) => looking(DVec3::from_array(target_m) - position_m)
            .ok_or(("look_at_m", "the place of the rig itself".into())),
        (None, Some(quaternion_xyzw)) => {
            let placement = Placement { quaternion_xyzw: Some(quaternion_xyzw), ..Placement::default() };
            placement.rotation().map_err(|error| ("quaternion_xyzw", error.to_string()))
        }
        (None, None) => Ok(looking(DVec3::Y).unwrap_or(DQuat::IDENTITY)),
    }?;
    Ok(Keyframe { time_s: spec.time_s, pose: Rigid { rotation, position_m } })
}

/// The rotation of a camera (x right, y down, z forward) that looks along a direction, upright. Straight up or down, the
/// image's upper side is to world +y.
fn looking(direction: DVec3) -> Option<DQuat> {
    let forward = direction.try_normalize()?;
    let right = forward.cross(DVec3::Z).try_normalize().unwrap_or(DVec3::X * forward.z.signum() * -1.0);
    let down = forward.cross(right);
    Some(DQuat::from_mat3(&DMat3::from_cols(right, down, forward)).normalize())
}

/// The path of a world whose keyframes were checked.
pub(super) fn path(spec: &WorldSpec) -> Result<Path, PathError> {
    let still = Keyframe { time_s: 0.0, pose: Rigid::IDENTITY };
    let keyframes: Vec<Keyframe> = spec.keyframes.iter().filter_map(|spec| keyframe(spec).ok()).collect();
    Path::new(if keyframes.is_empty() { std::slice::from_ref(&still) } else { &keyframes })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_camera_that_looks_along_y_has_x_to_its_right_and_z_up() {
        for (direction, right, down) in [
            (DVec3::Y, DVec3::X, DVec3::NEG_Z),
            (DVec3::NEG_Z, DVec3::X, DVec3::NEG_Y),
            (DVec3::Z, DVec3::NEG_X, DVec3::NEG_Y),
        ] {
            let rotation = looking(direction).unwrap();
            assert!((rotation * DVec3::Z - direction).length() < 1e-12);
            assert!((rotation * DVec3::X - right).length() < 1e-12, "{direction}");
            assert!((rotation * DVec3::Y - down).length() < 1e-12, "{direction}");
        }
        assert_eq!(looking(DVec3::ZERO), None);
    }
}
