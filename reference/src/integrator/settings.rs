//! What is traced, and how far.

use crate::surface::ReflectionModel;

/// Which paths are counted; see the table in [`crate::integrator`]. The picture is the sum of all four.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Classes {
    /// Lights seen by the eye, directly or by mirrors and glass.
    pub seen: bool,
    /// Light that reaches a surface of finite lobe straight from the light.
    pub lit: bool,
    /// Environment light that reaches it by mirrors and glass.
    pub environment_caustics: bool,
    /// Lamps' light that reaches it by mirrors and glass.
    pub lamp_caustics: bool,
}

impl Classes {
    /// The whole picture.
    pub const ALL: Self = Self { seen: true, lit: true, environment_caustics: true, lamp_caustics: true };
    /// Nothing, to switch single classes on.
    pub const NONE: Self =
        Self { seen: false, lit: false, environment_caustics: false, lamp_caustics: false };
}

/// Who counts which class; see the table in [`crate::integrator`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Method {
    /// Lamps' caustics by photons, the rest by eye paths.
    #[default]
    PathsAndPhotons,
    /// Everything by eye paths: unbiased, but light of small lamps through glass hardly converges.
    Paths,
    /// All light on surfaces of finite lobes by photons, gathered at the first such surface the eye sees.
    Photons,
}

/// How paths are traced.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Most scattering events between light and eye: 0 shows the lights alone, 1 direct light. Higher: nothing is missed in
    /// glass and white rooms. Lower: darker there, a little faster (roulette ends most paths early).
    pub max_depth: u32,
    /// Which paths are counted.
    pub classes: Classes,
    /// Who counts them.
    pub method: Method,
    /// Reflection model of opaque surfaces.
    pub reflection: ReflectionModel,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            max_depth: 64,
            classes: Classes::ALL,
            method: Method::default(),
            reflection: ReflectionModel::default(),
        }
    }
}
