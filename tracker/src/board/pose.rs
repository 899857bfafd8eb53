//! Where a tag of a board is.

use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};

use super::BoardTag;
use super::mistake::BoardMistake;

/// A quaternion off unit length by more is a mistake, not rounding.
const UNIT_TOLERANCE: f64 = 1e-3;

impl BoardTag {
    /// An upright tag of the board's family in the board's plane.
    pub fn flat(id: u32, size_m: f64, [x, y]: [f64; 2]) -> Self {
        Self { id, family: None, size_m, position_m: vec![x, y], rotation_deg: None, quaternion_xyzw: None }
    }

    /// A tag of the board's family anywhere.
    pub fn placed(id: u32, size_m: f64, board_from_tag: &Isometry3<f64>) -> Self {
        Self {
            id,
            family: None,
            size_m,
            position_m: board_from_tag.translation.vector.iter().copied().collect(),
            rotation_deg: None,
            quaternion_xyzw: Some(board_from_tag.rotation.coords.into()),
        }
    }

    /// Maps the tag's frame to the board's.
    ///
    /// # Errors
    /// [`BoardMistake`] names the key that makes no pose.
    pub fn board_from_tag(&self) -> Result<Isometry3<f64>, BoardMistake> {
        Ok(Isometry3::from_parts(self.position()?, self.rotation()?))
    }

    fn position(&self) -> Result<Translation3<f64>, BoardMistake> {
        let (x, y, z) = match *self.position_m {
            [x, y] => (x, y, 0.0),
            [x, y, z] => (x, y, z),
            _ => {
                let message = format!("{} numbers", self.position_m.len());
                return Err(BoardMistake::new("position_m", message, "allowed: 2 or 3"));
            }
        };
        finite("position_m", &[x, y, z])?;
        Ok(Translation3::new(x, y, z))
    }

    fn rotation(&self) -> Result<UnitQuaternion<f64>, BoardMistake> {
        match (self.rotation_deg, self.quaternion_xyzw) {
            (Some(_), Some(_)) => Err(BoardMistake::new(
                "quaternion_xyzw",
                "beside `rotation_deg`, of which only one is allowed",
                "",
            )),
            (Some(angles_deg), None) => {
                finite("rotation_deg", &angles_deg)?;
                let [x, y, z] = angles_deg.map(f64::to_radians);
                Ok(UnitQuaternion::from_euler_angles(x, y, z))
            }
            (None, Some(xyzw)) => unit_quaternion(xyzw),
            (None, None) => Ok(UnitQuaternion::identity()),
        }
    }
}

fn unit_quaternion([x, y, z, w]: [f64; 4]) -> Result<UnitQuaternion<f64>, BoardMistake> {
    let quaternion = Quaternion::new(w, x, y, z);
    let length = quaternion.norm();
    // NaN fails the comparison.
    if (length - 1.0).abs() <= UNIT_TOLERANCE {
        return Ok(UnitQuaternion::from_quaternion(quaternion));
    }
    let message = format!("a quaternion of length {length}; unit length is needed");
    Err(BoardMistake::new("quaternion_xyzw", message, ""))
}

fn finite(key: &str, values: &[f64]) -> Result<(), BoardMistake> {
    match values.iter().find(|value| !value.is_finite()) {
        Some(value) => Err(BoardMistake::new(key, format!("{value} is no place"), "finite numbers")),
        None => Ok(()),
    }
}
