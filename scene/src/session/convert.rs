//! From the numbers of a session to the types of a scene: the only place where f64 becomes f32.

use std::f32::consts::FRAC_PI_2;

use glam::{DMat3, DQuat, DVec3, Quat, Vec2, Vec3};

use super::Session;
use super::placement::{AxisAngle, Placement, PoseSpec};
use super::sensors::{FisheyeSpec, Mount};
use super::tracking::{NamedUp, Up};
use crate::pose::{Pose, Similarity};

/// A quaternion off unit length by more is a mistake, not rounding.
const UNIT_TOLERANCE: f64 = 1e-3;

/// Why a placement is none.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PlacementError {
    /// Two ways to say a rotation.
    #[error("`{second}` beside `{first}`, of which only one is allowed")]
    TwoRotations {
        /// The one to keep.
        first: &'static str,
        /// The one too many.
        second: &'static str,
    },
    /// A quaternion that is no rotation.
    #[error("a quaternion of length {length}; unit length is needed")]
    NotUnit {
        /// Its length.
        length: f64,
    },
    /// An axis of length zero.
    #[error("an axis of length {length} has no direction")]
    NoAxis {
        /// Its length.
        length: f64,
    },
    /// Aimed at the place where it is.
    #[error("its own position; there is no direction to look in")]
    NoTarget,
}

impl PlacementError {
    /// The key that is wrong.
    pub fn key(&self) -> &'static str {
        match self {
            Self::TwoRotations { second, .. } => second,
            Self::NotUnit { .. } => "quaternion_xyzw",
            Self::NoAxis { .. } => "axis_angle",
            Self::NoTarget => "look_at_m",
        }
    }
}

impl Placement {
    /// `frame_from_thing`.
    ///
    /// # Errors
    /// [`PlacementError`] names the key that is wrong.
    pub fn similarity(&self) -> Result<Similarity, PlacementError> {
        Ok(Similarity {
            rotation: self.rotation()?.as_quat(),
            translation_m: vec3(self.position_m),
            scale: self.scale.unwrap_or(1.0) as f32,
        })
    }

    /// In double precision.
    ///
    /// # Errors
    /// As [`Placement::similarity`].
    pub fn rotation(&self) -> Result<DQuat, PlacementError> {
        let given = [
            (self.rotation_deg.is_some(), "rotation_deg"),
            (self.quaternion_xyzw.is_some(), "quaternion_xyzw"),
            (self.axis_angle.is_some(), "axis_angle"),
            (self.look_at_m.is_some(), "look_at_m"),
        ];
        let mut names = given.into_iter().filter(|(given, _)| *given).map(|(_, name)| name);
        if let (Some(first), Some(second)) = (names.next(), names.next()) {
            return Err(PlacementError::TwoRotations { first, second });
        }
        match (self.rotation_deg, self.quaternion_xyzw, self.axis_angle, self.look_at_m) {
            (Some(angles_deg), ..) => Ok(euler_xyz(angles_deg)),
            (_, Some(quaternion), ..) => unit_quaternion(quaternion),
            (_, _, Some(axis_angle), _) => around(axis_angle),
            (.., Some(target_m)) => aimed(self.position_m.into(), target_m.into()),
            _ => Ok(DQuat::IDENTITY),
        }
    }
}

/// R = Rz·Ry·Rx.
fn euler_xyz(angles_deg: [f64; 3]) -> DQuat {
    let [x, y, z] = angles_deg.map(f64::to_radians);
    DQuat::from_rotation_z(z) * DQuat::from_rotation_y(y) * DQuat::from_rotation_x(x)
}

/// Normalised if it is nearly a unit quaternion.
pub(crate) fn unit_quaternion(xyzw: [f64; 4]) -> Result<DQuat, PlacementError> {
    let quaternion = DQuat::from_array(xyzw);
    let length = quaternion.length();
    if (length - 1.0).abs() <= UNIT_TOLERANCE {
        Ok(quaternion / length)
    } else {
        Err(PlacementError::NotUnit { length })
    }
}

fn around(AxisAngle { axis, angle_deg }: AxisAngle) -> Result<DQuat, PlacementError> {
    let axis = DVec3::from_array(axis);
    match axis.try_normalize() {
        Some(unit) => Ok(DQuat::from_axis_angle(unit, angle_deg.to_radians())),
        None => Err(PlacementError::NoAxis { length: axis.length() }),
    }
}

/// +z towards the target, +x level, +y down.
fn aimed(position_m: DVec3, target_m: DVec3) -> Result<DQuat, PlacementError> {
    let ahead = (target_m - position_m).try_normalize().ok_or(PlacementError::NoTarget)?;
    // Within a microradian of the vertical, level says nothing.
    let level = ahead.cross(DVec3::Z);
    let right = if level.length() < 1e-6 { DVec3::X } else { level.normalize() };
    let down = ahead.cross(right).normalize();
    Ok(DQuat::from_mat3(&DMat3::from_cols(down.cross(ahead), down, ahead)).normalize())
}

impl Session {
    /// A pose with the paths of its files resolved.
    ///
    /// # Errors
    /// As [`Placement::similarity`].
    pub fn pose(&self, spec: &PoseSpec) -> Result<Pose, PlacementError> {
        let frame_from_thing = spec.placement().similarity()?;
        Ok(match spec {
            PoseSpec::World { .. } => Pose::World(frame_from_thing),
            PoseSpec::Marker { tag, .. } => Pose::Marker {
                family: tag.family.clone(),
                id: tag.id,
                size_m: tag.size_m as f32,
                marker_from_thing: frame_from_thing,
            },
            PoseSpec::Body { body, .. } => {
                Pose::Body { body: self.resolve(body), body_from_thing: frame_from_thing }
            }
            PoseSpec::Board { board, .. } => {
                Pose::Board { board: self.resolve(board), board_from_thing: frame_from_thing }
            }
        })
    }
}

impl FisheyeSpec {
    /// Where a fish-eye is that is fixed to the world; `None` if it is fixed to the rig. Without a pose the camera frame
    /// is the world's: looking straight up, image right along world x.
    pub fn pose_in_world(&self) -> Option<PoseSpec> {
        match self.mount {
            Mount::Rig => None,
            Mount::World => Some(self.pose.clone().unwrap_or_default()),
        }
    }
}

impl Up {
    /// `world_from_anchor`; `None` where it has to be found in the depth image or map.
    ///
    /// # Errors
    /// As [`Placement::similarity`].
    pub fn world_from_anchor(&self) -> Result<Option<Similarity>, PlacementError> {
        match self {
            Self::Named(NamedUp::Z) => Ok(Some(Similarity::IDENTITY)),
            // A quarter turn about x: the print's y becomes the world's z.
            Self::Named(NamedUp::Y) => Ok(Some(Similarity::from_rotation(Quat::from_rotation_x(FRAC_PI_2)))),
            Self::Named(NamedUp::Plane) => Ok(None),
            Self::Pose(placement) => placement.similarity().map(Some),
        }
    }
}

pub(crate) fn vec3(numbers: [f64; 3]) -> Vec3 {
    DVec3::from_array(numbers).as_vec3()
}

pub(crate) fn vec2([x, y]: [f64; 2]) -> Vec2 {
    Vec2::new(x as f32, y as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn turned(placement: &Placement, v: Vec3) -> Vec3 {
        placement.similarity().unwrap().transform_direction(v)
    }

    #[test]
    fn euler_angles_turn_about_fixed_x_then_y_then_z() {
        let placement = Placement { rotation_deg: Some([90.0, 0.0, 90.0]), ..Placement::default() };
        // About x: y → z, about z: z stays. About x: z → −y, about z: −y → x.
        assert!(turned(&placement, Vec3::Y).abs_diff_eq(Vec3::Z, 1e-6));
        assert!(turned(&placement, Vec3::Z).abs_diff_eq(Vec3::X, 1e-6));
        assert!(turned(&placement, Vec3::X).abs_diff_eq(Vec3::Y, 1e-6));
    }

    #[test]
    fn a_standing_print_has_its_y_upwards_and_faces_against_the_worlds_y() {
        let world_from_anchor = Up::Named(NamedUp::Y).world_from_anchor().unwrap().unwrap();
        assert!(world_from_anchor.transform_direction(Vec3::Y).abs_diff_eq(Vec3::Z, 1e-6));
        assert!(world_from_anchor.transform_direction(Vec3::Z).abs_diff_eq(-Vec3::Y, 1e-6));
        assert!(world_from_anchor.transform_direction(Vec3::X).abs_diff_eq(Vec3::X, 1e-6));
        assert_eq!(Up::Named(NamedUp::Plane).world_from_anchor(), Ok(None));
        assert_eq!(Up::default().world_from_anchor(), Ok(Some(Similarity::IDENTITY)));
    }

    #[test]
    fn the_three_ways_to_say_a_rotation_agree() {
        let half = std::f64::consts::FRAC_1_SQRT_2;
        let ways = [
            Placement { rotation_deg: Some([0.0, 0.0, 90.0]), ..Placement::default() },
            Placement { quaternion_xyzw: Some([0.0, 0.0, half, half]), ..Placement::default() },
            Placement {
                axis_angle: Some(AxisAngle { axis: [0.0, 0.0, 7.0], angle_deg: 90.0 }),
                ..Placement::default()
            },
        ];
        for placement in ways {
            assert!(turned(&placement, Vec3::X).abs_diff_eq(Vec3::Y, 1e-6), "{placement:?}");
        }
    }

    #[test]
    fn rounded_quaternions_are_normalised_and_others_refused() {
        let with = |quaternion| Placement { quaternion_xyzw: Some(quaternion), ..Placement::default() };
        assert!(with([0.0, 0.0, 0.6004, 0.8]).similarity().unwrap().is_valid());
        assert_eq!(
            with([0.0, 0.0, 1.0, 1.0]).similarity(),
            Err(PlacementError::NotUnit { length: std::f64::consts::SQRT_2 })
        );
        assert!(matches!(with([0.0; 4]).similarity(), Err(PlacementError::NotUnit { .. })));
    }

    #[test]
    fn what_is_aimed_looks_at_its_target_upright() {
        let targets =
            [[1.0, 0.0, 0.0], [-1.0, 2.0, -3.0], [0.0, 0.0, 5.0], [0.0, 0.0, -5.0], [0.3, -4.0, 0.1]];
        for target in targets {
            let position_m = [0.0, 0.0, 0.5];
            let placement = Placement { position_m, look_at_m: Some(target), ..Placement::default() };
            let rotation = placement.rotation().unwrap();
            let ahead = (DVec3::from(target) - DVec3::from(position_m)).normalize();
            assert!((rotation * DVec3::Z - ahead).length() < 1e-12, "{target:?}");
            assert!((rotation * DVec3::X).z.abs() < 1e-12, "{target:?}: x is level");
            assert!((rotation * DVec3::Y).z <= 1e-12, "{target:?}: y points down");
            assert!((rotation.length() - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn nothing_looks_at_itself() {
        let position_m = [1.0, 2.0, 3.0];
        let placement = Placement { position_m, look_at_m: Some(position_m), ..Placement::default() };
        assert_eq!(placement.rotation(), Err(PlacementError::NoTarget));
    }
}
