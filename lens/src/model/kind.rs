//! The names of the models and of their parameters.

use std::fmt;
use std::str::FromStr;

use super::ModelError;

/// The largest number of parameters of any model: the columns of every parameter Jacobian.
pub const MAX_PARAMS: usize = 12;

/// Which camera model: a [`CameraModel`](super::CameraModel) without its numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ModelKind {
    /// [`Pinhole`](super::Pinhole)
    Pinhole,
    /// [`BrownConrady5`](super::BrownConrady5)
    BrownConrady5,
    /// [`Rational8`](super::Rational8)
    Rational8,
    /// [`KannalaBrandt4`](super::KannalaBrandt4)
    KannalaBrandt4,
    /// [`DoubleSphere`](super::DoubleSphere)
    DoubleSphere,
    /// [`Eucm`](super::Eucm)
    Eucm,
}

impl ModelKind {
    /// All models.
    pub const ALL: [Self; 6] = [
        Self::Pinhole,
        Self::BrownConrady5,
        Self::Rational8,
        Self::KannalaBrandt4,
        Self::DoubleSphere,
        Self::Eucm,
    ];

    /// The name in a calibration file (`model = "…"`).
    pub fn name(self) -> &'static str {
        match self {
            Self::Pinhole => "pinhole",
            Self::BrownConrady5 => "brown_conrady5",
            Self::Rational8 => "rational8",
            Self::KannalaBrandt4 => "kannala_brandt4",
            Self::DoubleSphere => "double_sphere",
            Self::Eucm => "eucm",
        }
    }

    /// The parameters' names, in the order of [`CameraModel::params`](super::CameraModel::params) and of the
    /// columns of the parameter Jacobians. The first four are always fx, fy, cx, cy (px).
    pub fn param_names(self) -> &'static [&'static str] {
        match self {
            Self::Pinhole => &["fx", "fy", "cx", "cy"],
            Self::BrownConrady5 => &["fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3"],
            Self::Rational8 => &["fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"],
            Self::KannalaBrandt4 => &["fx", "fy", "cx", "cy", "k1", "k2", "k3", "k4"],
            Self::DoubleSphere => &["fx", "fy", "cx", "cy", "xi", "alpha"],
            Self::Eucm => &["fx", "fy", "cx", "cy", "alpha", "beta"],
        }
    }
}

impl fmt::Display for ModelKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for ModelKind {
    type Err = ModelError;

    fn from_str(name: &str) -> Result<Self, ModelError> {
        Self::ALL
            .into_iter()
            .find(|kind| kind.name() == name)
            .ok_or_else(|| ModelError::UnknownName(name.to_owned()))
    }
}
