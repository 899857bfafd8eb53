//! How a session is drawn.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// How the composite is made. Defaults are those of the papers.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct RenderSpec {
    /// The method.
    pub method: Method,
    /// How the difference of the two worlds is brought into the camera image.
    pub composition: Composition,
    /// `dir`: virtual point lights that stand for bounced light. Higher: smoother, slower. Lower: blotchy, faster.
    #[schemars(range(min = 1, max = 65536))]
    pub vpls: u32,
    /// `dir`: light that bounces more than once. `false`: darker corners, faster.
    pub further_bounces: bool,
    /// `dir`: side of each virtual light's shadow map. Higher: finer indirect shadows, slower. Lower: leaks of light.
    #[schemars(range(min = 8, max = 4096))]
    pub ism_size_px: u32,
    /// `dir`: surface points drawn into each of these maps. Higher: fewer holes, slower. Lower: leaks of light.
    #[schemars(range(min = 1, max = 1048576))]
    pub points_per_vpl: u32,
    /// `dir`: pixels share the virtual lights in squares of this side. Higher: faster, blurs detail. 1: every pixel takes
    /// all lights.
    #[schemars(range(min = 1, max = 16))]
    pub split: u32,
    /// Reflection and refraction: side of an object's impostor or cube. Higher: sharper, slower.
    #[schemars(range(min = 16, max = 8192))]
    pub impostor_size_px: u32,
    /// Reflection and refraction: equal steps along a ray before the search narrows. Higher: fewer missed hits, slower.
    #[schemars(range(min = 1, max = 4096))]
    pub linear_steps: u32,
    /// Reflection and refraction: halvings that follow. Higher: more exact hits, slower.
    #[schemars(range(min = 0, max = 32))]
    pub binary_steps: u32,
    /// Reflection and refraction: how often a ray is bent or mirrored. Higher: deeper mirrors, slower.
    #[schemars(range(min = 0, max = 64))]
    pub specular_bounces: u32,
    /// Caustics: side of a light's photon map. Higher: smoother, slower. Lower: grainy.
    #[schemars(range(min = 16, max = 8192))]
    pub photon_map_px: u32,
    /// Caustics: side of the buffer that photons are drawn into. Higher: sharper, slower.
    #[schemars(range(min = 16, max = 8192))]
    pub caustic_buffer_px: u32,
    /// `dic`: paths per record of the irradiance cache. Higher: less noise, slower.
    #[schemars(range(min = 1, max = 65536))]
    pub dic_samples: u32,
}

/// Methods of rendering.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Method {
    /// Differential instant radiosity: interactive.
    #[default]
    Dir,
    /// Differential irradiance caching: ray traced, smoother, slower.
    Dic,
    /// Differential path tracing on the CPU: minutes an image.
    Reference,
}

/// L_f from camera image I, L_rv and L_r.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Composition {
    /// I · L_rv / L_r: forgives a wrong albedo of real things.
    #[default]
    Relative,
    /// I + L_rv − L_r.
    Additive,
}

impl Default for RenderSpec {
    fn default() -> Self {
        Self {
            method: Method::default(),
            composition: Composition::default(),
            vpls: 256,
            further_bounces: true,
            ism_size_px: 128,
            points_per_vpl: 1024,
            split: 4,
            impostor_size_px: 512,
            linear_steps: 64,
            binary_steps: 8,
            specular_bounces: 3,
            photon_map_px: 512,
            caustic_buffer_px: 512,
            dic_samples: 128,
        }
    }
}
