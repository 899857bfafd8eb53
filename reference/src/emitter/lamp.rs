//! Described lamps: discs with a cone, and rectangles. Both shine from their front only; from behind they are not there,
//! neither as light nor as obstacle.

use std::f32::consts::{FRAC_1_PI, TAU};

use coshade_scene::light::{Rectangle, Spot};
use coshade_scene::{LightKind, Similarity, World};
use glam::{Vec2, Vec3};

use crate::accel::Ray;
use crate::bsdf::lambert::sample_cosine_hemisphere;
use crate::bsdf::{Frame, luminance};

/// A lamp as it stands in the world.
#[derive(Clone, Debug, PartialEq)]
pub struct Lamp {
    /// Real or virtual.
    pub world: World,
    shape: Shape,
    center: Vec3,
    /// z is where it shines to.
    frame: Frame,
    area_m2: f32,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Shape {
    Disc(Spot),
    Rectangle(Rectangle),
}

/// A point of a lamp, seen from somewhere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LampPoint {
    /// World coordinates.
    pub position: Vec3,
    /// Radiance towards the one who sees it.
    pub radiance: Vec3,
    /// Of a point drawn uniformly from the area, per steradian there.
    pub pdf_sr: f32,
}

impl Lamp {
    /// Places a lamp. A scale multiplies lengths only.
    pub fn new(kind: LightKind, world: World, world_from_light: Similarity) -> Self {
        let scale = world_from_light.scale;
        let turned = |axis: Vec3| world_from_light.transform_direction(axis);
        let (shape, area_m2) = match kind {
            LightKind::Spot(spot) => {
                let radius_m = spot.radius_m * scale;
                (Shape::Disc(Spot { radius_m, ..spot }), std::f32::consts::PI * radius_m * radius_m)
            }
            LightKind::Rectangle(rectangle) => {
                let size_m = rectangle.size_m * scale;
                (Shape::Rectangle(Rectangle { size_m, ..rectangle }), size_m.x * size_m.y)
            }
        };
        Self {
            world,
            shape,
            center: world_from_light.translation_m,
            frame: Frame { tangent: turned(Vec3::X), bitangent: turned(Vec3::Y), normal: turned(Vec3::Z) },
            area_m2,
        }
    }

    /// Flux.
    pub fn power(&self) -> Vec3 {
        match &self.shape {
            Shape::Disc(spot) => spot.power(),
            Shape::Rectangle(rectangle) => rectangle.power(),
        }
    }

    /// Middle.
    pub fn center(&self) -> Vec3 {
        self.center
    }

    /// Radius of a ball around it, metres.
    pub fn radius_m(&self) -> f32 {
        match &self.shape {
            Shape::Disc(spot) => spot.radius_m,
            Shape::Rectangle(rectangle) => rectangle.size_m.length() / 2.0,
        }
    }

    /// Where it shines to.
    pub fn normal(&self) -> Vec3 {
        self.frame.normal
    }

    /// Density of points drawn from it, per m².
    pub fn pdf_per_m2(&self) -> f32 {
        1.0 / self.area_m2
    }

    /// A point drawn uniformly from the area, as seen from `from`; `None` from behind and outside of the cone.
    pub fn sample(&self, from: Vec3, u2: Vec2) -> Option<LampPoint> {
        self.seen_from(from, self.point(u2))
    }

    /// Luminance of the light that arrives at a place if nothing is in between, from all of the lamp as if from its middle; per
    /// area across the light. Bounded near the lamp.
    pub fn sent(&self, from: Vec3) -> f32 {
        let Some(middle) = self.seen_from(from, self.center) else { return 0.0 };
        let distance2 = (from - self.center).length_squared();
        let near = distance2 / distance2.max(self.radius_m() * self.radius_m());
        // 1/pdf is the solid angle of the lamp.
        luminance(middle.radiance) / middle.pdf_sr * near
    }

    /// Where a ray meets the front, and that point; `None` beside it, from behind, and out of (t_min, t_max).
    pub fn hit(&self, ray: &Ray) -> Option<(f32, LampPoint)> {
        let towards = ray.direction.dot(self.frame.normal);
        if towards >= 0.0 {
            return None;
        }
        let t = (self.center - ray.origin).dot(self.frame.normal) / towards;
        if !(t > ray.t_min && t < ray.t_max) {
            return None;
        }
        let position = ray.at(t);
        let local = self.frame.to_local(position - self.center);
        let inside = match &self.shape {
            Shape::Disc(spot) => local.truncate().length() <= spot.radius_m,
            Shape::Rectangle(rectangle) => local.truncate().abs().cmple(rectangle.size_m / 2.0).all(),
        };
        if !inside {
            return None;
        }
        Some((t, self.seen_from(ray.origin, position)?))
    }

    /// A photon: position uniform over the area; direction by the intensity of the spot or by the cosine. Also its
    /// density per steradian; with [`Lamp::pdf_per_m2`] every photon carries `power / count`.
    pub fn sample_emission(&self, u_position: Vec2, u_direction: Vec2) -> (Vec3, Vec3, f32) {
        let local = match &self.shape {
            Shape::Disc(spot) => sample_cone(spot, u_direction),
            Shape::Rectangle(_) => sample_cosine_hemisphere(u_direction),
        };
        let direction = self.frame.to_world(local);
        (self.point(u_position), direction, self.direction_pdf(local.z))
    }

    /// Density per steradian of emitted directions at an angle from the axis.
    pub fn direction_pdf(&self, cos_angle: f32) -> f32 {
        match &self.shape {
            Shape::Disc(spot) => spot.falloff(cos_angle) / cone_sr(spot),
            Shape::Rectangle(_) => cos_angle.max(0.0) * FRAC_1_PI,
        }
    }

    fn point(&self, u2: Vec2) -> Vec3 {
        let local = match &self.shape {
            Shape::Disc(spot) => disc(u2) * spot.radius_m,
            Shape::Rectangle(rectangle) => (u2 - 0.5) * rectangle.size_m,
        };
        // A lamp may lie on a surface, which must not shade it: see `accel::offset`.
        let offset_m = 32.0 * f32::EPSILON * (self.center.abs().max_element() + self.radius_m());
        self.center
            + self.frame.tangent * local.x
            + self.frame.bitangent * local.y
            + self.frame.normal * offset_m
    }

    fn seen_from(&self, from: Vec3, position: Vec3) -> Option<LampPoint> {
        let to_viewer = from - position;
        let distance2 = to_viewer.length_squared();
        let cos_angle = to_viewer.dot(self.frame.normal) / distance2.sqrt();
        let radiance = match &self.shape {
            Shape::Disc(spot) => spot.radiance(cos_angle),
            Shape::Rectangle(rectangle) => rectangle.radiance,
        };
        // Also false for NaN, a viewer on the lamp.
        (cos_angle > 0.0 && radiance.max_element() > 0.0).then(|| LampPoint {
            position,
            radiance,
            pdf_sr: distance2 / (cos_angle * self.area_m2),
        })
    }
}

/// Uniform on the unit disc, keeping neighbours together (P. Shirley and K. Chiu, *A Low Distortion Map Between Disk and
/// Square*, 1997).
pub fn disc(u2: Vec2) -> Vec2 {
    let square = u2 * 2.0 - 1.0;
    if square == Vec2::ZERO {
        return Vec2::ZERO;
    }
    let eighth = TAU / 8.0;
    let (radius, angle) = if square.x.abs() > square.y.abs() {
        (square.x, eighth * (square.y / square.x))
    } else {
        (square.y, 2.0 * eighth - eighth * (square.x / square.y))
    };
    Vec2::from_angle(angle) * radius
}

/// Integral of the falloff over directions: `2π (1 − cos_inner + (cos_inner − cos_outer)/3)`.
fn cone_sr(spot: &Spot) -> f32 {
    let (cos_inner, cos_outer) = (spot.inner_rad.cos(), spot.outer_rad.cos());
    TAU * (1.0 - cos_inner + (cos_inner - cos_outer) / 3.0)
}

/// A direction around +z by the falloff: uniform in the cosine inside; where it rises as the square, by the cube root.
fn sample_cone(spot: &Spot, u2: Vec2) -> Vec3 {
    let (cos_inner, cos_outer) = (spot.inner_rad.cos(), spot.outer_rad.cos());
    let (inner, rim) = (1.0 - cos_inner, (cos_inner - cos_outer) / 3.0);
    let place = u2.x * (inner + rim);
    // Measured from the axis, where 1 − cos keeps its digits.
    let one_minus_cos = if place < inner {
        place
    } else {
        let share = ((place - inner) / rim).min(1.0);
        1.0 - cos_outer - (cos_inner - cos_outer) * (1.0 - share).cbrt()
    };
    let sin = (one_minus_cos * (2.0 - one_minus_cos)).max(0.0).sqrt();
    let (sin_phi, cos_phi) = (TAU * u2.y).sin_cos();
    Vec3::new(sin * cos_phi, sin * sin_phi, 1.0 - one_minus_cos)
}
