//! Lights with an area. The environment is not here: it is measured, not described.

use std::f32::consts::{PI, TAU};

use glam::{Vec2, Vec3};

use crate::pose::Pose;
use crate::world::World;

/// Radius of a spot's disc unless the session says otherwise, metres.
pub const DEFAULT_SPOT_RADIUS_M: f32 = 0.005;

/// A described light. In its own frame it lies in the plane z = 0 around the origin and shines towards +z, as a lamp
/// stuck on a printed tag does; glTF's −z is turned at import.
#[derive(Clone, Debug, PartialEq)]
pub struct Light {
    /// For messages.
    pub name: String,
    /// Whether the camera image already contains its light.
    pub world: World,
    /// Where it is. A scale multiplies lengths (radius, size) and leaves intensity and radiance as they are.
    pub pose: Pose,
    /// Shape and strength.
    pub kind: LightKind,
}

/// Shape and strength of a light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LightKind {
    /// A disc with a cone.
    Spot(Spot),
    /// A rectangle.
    Rectangle(Rectangle),
}

/// A disc that shines into a cone around +z.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spot {
    /// On the axis; radiance unit × m².
    pub radiant_intensity: Vec3,
    /// Full intensity up to this angle from the axis (half the opening).
    pub inner_rad: f32,
    /// No light beyond this angle from the axis; `inner_rad` ≤ `outer_rad` ≤ π/2.
    pub outer_rad: f32,
    /// Of the disc.
    pub radius_m: f32,
}

impl Spot {
    /// Share of the axis' intensity towards an angle whose cosine is given: 1 inside, 0 outside, between them
    /// `((cos − cos_outer)/(cos_inner − cos_outer))²` (KHR_lights_punctual).
    pub fn falloff(&self, cos_angle: f32) -> f32 {
        let (cos_inner, cos_outer) = (self.inner_rad.cos(), self.outer_rad.cos());
        if cos_angle >= cos_inner {
            return 1.0;
        }
        if cos_angle <= cos_outer {
            return 0.0;
        }
        let t = (cos_angle - cos_outer) / (cos_inner - cos_outer);
        t * t
    }

    /// Intensity towards an angle from the axis.
    pub fn intensity(&self, cos_angle: f32) -> Vec3 {
        self.radiant_intensity * self.falloff(cos_angle)
    }

    /// Radiance of each point of the disc: `I(θ)/(π r² cos θ)`, so that from afar the disc is the spot. 0 behind.
    pub fn radiance(&self, cos_angle: f32) -> Vec3 {
        if cos_angle <= 0.0 {
            return Vec3::ZERO;
        }
        self.intensity(cos_angle) / (PI * self.radius_m * self.radius_m * cos_angle)
    }

    /// Flux: the integral of the intensity over directions, `2π I (1 − cos_inner + (cos_inner − cos_outer)/3)`.
    pub fn power(&self) -> Vec3 {
        let (cos_inner, cos_outer) = (self.inner_rad.cos(), self.outer_rad.cos());
        self.radiant_intensity * TAU * (1.0 - cos_inner + (cos_inner - cos_outer) / 3.0)
    }
}

/// A Lambertian rectangle that shines towards +z only.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rectangle {
    /// Along x and y, metres.
    pub size_m: Vec2,
    /// The same in all directions of the upper half space.
    pub radiance: Vec3,
}

impl Rectangle {
    /// Flux: `π · area · radiance`.
    pub fn power(&self) -> Vec3 {
        self.radiance * (PI * self.size_m.x * self.size_m.y)
    }
}
