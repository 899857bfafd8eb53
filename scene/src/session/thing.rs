//! Things, as written in a session.

use std::path::PathBuf;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::placement::PoseSpec;
use crate::world::World;

/// An object, real or virtual.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ThingSpec {
    /// Unique within the session.
    #[schemars(length(min = 1))]
    pub name: String,
    /// Whether it stands in the room or is drawn.
    pub world: World,
    /// Its surface.
    #[serde(flatten)]
    pub form: Form,
    /// Where it is. Left out: not turned, at the world's origin.
    #[serde(default)]
    pub pose: PoseSpec,
    /// Replaces the mesh's own material, key by key.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub material: Option<MaterialSpec>,
    /// Paint over the tag that it is attached to.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    #[schemars(extend("default" = false))]
    pub hide_marker: bool,
    /// Which axis of an `.obj` or `.ply` file points up; glTF files say it themselves.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mesh_up: Option<MeshUp>,
    /// Metres per unit of an `.obj` or `.ply` file; glTF files are in metres.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub mesh_unit_m: Option<f64>,
}

/// Where a thing's surface comes from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Form {
    /// A `.glb`, `.gltf`, `.obj` or `.ply` file. Relative to the session file.
    Mesh(PathBuf),
    /// A shape that needs no file.
    Shape(ShapeSpec),
}

/// Up axis of a mesh file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum MeshUp {
    /// As here.
    Z,
    /// As in glTF and most modelling programs.
    Y,
}

/// A shape, centred on the origin unless it says otherwise.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ShapeSpec {
    /// Which, and how large.
    #[serde(flatten)]
    pub kind: ShapeKind,
    /// Straight pieces around a sphere or ring, or along each edge of the teapot's patches. Higher: rounder, slower.
    /// Left out: 64, teapot 16.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 1, max = 2048))]
    pub segments: Option<u32>,
}

/// Kinds of shape.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum ShapeKind {
    /// Lengths along x, y and z, metres.
    Box([f64; 3]),
    /// Radius, metres.
    Sphere(f64),
    /// Lengths along x and y, metres; faces +z.
    Plane([f64; 2]),
    /// A finger ring around the z axis.
    Ring(RingSpec),
    /// Height of the Utah teapot, metres; it stands on z = 0.
    Teapot(f64),
}

/// A finger ring.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct RingSpec {
    /// Of the hole.
    pub inner_radius_m: f64,
    /// Of the outside.
    pub outer_radius_m: f64,
    /// Along the axis.
    pub height_m: f64,
    /// Radius of the rounded edges: 0 for sharp ones, at most half the wall and half the height.
    #[serde(default)]
    #[schemars(range(min = 0.0))]
    pub bevel_m: f64,
}

/// What a surface is made of, as in glTF 2.0 (linear colours). A key that is given replaces the mesh's own value and its
/// texture; one left out keeps them.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct MaterialSpec {
    /// Albedo of a dielectric, normal-incidence reflectance of a metal.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(inner(range(min = 0.0, max = 1.0)))]
    pub base_color: Option<[f64; 3]>,
    /// 0 dielectric, 1 metal.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.0, max = 1.0))]
    pub metallic: Option<f64>,
    /// Perceptual roughness; GGX's α is its square. Higher: duller. Lower: shinier.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.0, max = 1.0))]
    pub roughness: Option<f64>,
    /// Instead of `roughness`: the exponent n of a Phong lobe, α = √(2/(n + 2)).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.0))]
    pub phong_exponent: Option<f64>,
    /// Instead of `base_color`: refractive index of a metal for red, green and blue; needs `k`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(inner(range(min = 0.0)))]
    pub eta: Option<[f64; 3]>,
    /// Extinction coefficient of a metal for red, green and blue; needs `eta`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(inner(range(min = 0.0)))]
    pub k: Option<[f64; 3]>,
    /// Share of the light entering a dielectric that passes through: 1 for glass.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.0, max = 1.0))]
    pub transmission: Option<f64>,
    /// Index of refraction of a dielectric: glass 1.5, water 1.33.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 1.0, max = 10.0))]
    pub ior: Option<f64>,
    /// Of the body behind the surface, for methods that do not trace through it. 0: a thin wall that bends no light.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.0))]
    pub thickness_m: Option<f64>,
    /// Colour of white light after `attenuation_distance_m` inside.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(inner(range(min = 0.0, max = 1.0)))]
    pub attenuation_color: Option<[f64; 3]>,
    /// See `attenuation_color`. Higher: clearer.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub attenuation_distance_m: Option<f64>,
    /// Radiance that it emits.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(inner(range(min = 0.0)))]
    pub emissive: Option<[f64; 3]>,
    /// Also visible from behind.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub double_sided: Option<bool>,
}
