//! Everything that shines, as one set: lamps, glowing surfaces, the environment.
//!
//! | module | what it is |
//! | --- | --- |
//! | [`lamp`] | discs with a cone, rectangles |
//! | [`glow`] | triangles of an emissive material |
//! | [`environment`] | radiance from far away |
//! | [`environment_file`] | reading it |
//! | [`distribution`] | drawing by weight |
//! | `choice` | drawing a light |
//!
//! A light is chosen half by the luminance of its flux, half alike; among lamps mostly by what each sends to the place that is
//! lit. All densities given out contain the probability of that choice.
//!
//! Lamps are seen by rays, from their front, but they are no triangles: ask [`Lights::lamps_along`] besides
//! [`crate::accel::Accel::closest`], up to what that hits. They hide nothing.

mod choice;
pub mod distribution;
pub mod environment;
pub mod environment_file;
pub mod glow;
pub mod lamp;

use std::collections::HashMap;
use std::f32::consts::PI;

use coshade_scene::{Aabb, Pose, Scene, Similarity, Sphere, World};
use glam::{Vec2, Vec3};
use thiserror::Error;

use crate::accel::{Geometry, Ray};
use crate::bsdf::lambert::sample_cosine_hemisphere;
use crate::bsdf::luminance;
use choice::LightChoice;
pub use environment::{Environment, EnvironmentError, Interpolation, Layout};
pub use environment_file::{EnvironmentFile, EnvironmentFileError};
use glow::Glow;
use lamp::Lamp;

/// Why a light cannot be used.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum LightError {
    /// The tracker does not know where it is.
    #[error("light '{light}': its pose is not known, the frame it is attached to has not been seen")]
    UnknownPose {
        /// Name of the light.
        light: String,
    },
    /// Numbers that make no sense.
    #[error("light '{light}': {what}")]
    Invalid {
        /// Name of the light.
        light: String,
        /// Which, and what would be right.
        what: &'static str,
    },
}

/// A way to a light from a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightSample {
    /// Unit direction to the light.
    pub wi: Vec3,
    /// The point on the light; `None` for the environment.
    pub target: Option<Vec3>,
    /// Arriving radiance, if nothing is in between.
    pub radiance: Vec3,
    /// Per steradian, with the choice of the light.
    pub pdf: f32,
    /// Real or virtual.
    pub world: World,
    /// Number of the light.
    pub light: u32,
}

/// Start of a photon.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Emission {
    /// Where from.
    pub origin: Vec3,
    /// Where to, unit length.
    pub direction: Vec3,
    /// Flux it carries: `L |cosθ| / (pdf_position · pdf_direction)`; the mean over many photons is the flux of all lights.
    pub flux: Vec3,
    /// Of the origin, per m², with the choice of the light.
    pub pdf_position: f32,
    /// Of the direction, per steradian.
    pub pdf_direction: f32,
    /// Real or virtual.
    pub world: World,
    /// Number of the light.
    pub light: u32,
}

/// A lamp met by a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LampHit {
    /// In units of the ray's direction.
    pub t: f32,
    /// Radiance towards the ray's origin.
    pub radiance: Vec3,
    /// Per steradian, of [`Lights::sample`] yielding the same point: for weighting both.
    pub pdf: f32,
    /// Real or virtual.
    pub world: World,
    /// Number of the light.
    pub light: u32,
}

#[derive(Clone, Debug)]
enum Light {
    Lamp(Lamp),
    Glow(Glow),
    Environment,
}

/// Of the 24 bits of a random number, 16 are left by a choice of this probability.
const LEAST_REUSED: f64 = 1.0 / 256.0;

/// All lights of a scene.
#[derive(Clone, Debug)]
pub struct Lights {
    lights: Vec<Light>,
    /// `None` if nothing shines.
    choice: Option<LightChoice>,
    light_of_triangle: HashMap<u32, u32>,
    environment: Option<(u32, Environment)>,
    bounds: Sphere,
}

impl LightSample {
    /// The ray that must be free for the light to arrive; `origin` is where it leaves the surface.
    pub fn shadow_ray(&self, origin: Vec3, seed: u32) -> Ray {
        match self.target {
            Some(target) => Ray::between(origin, target, seed),
            None => Ray::new(origin, self.wi, seed),
        }
    }
}

impl Lights {
    /// Collects the lamps of a scene, its glowing triangles, and an environment.
    ///
    /// # Errors
    /// [`LightError`] names the light whose pose is unknown or whose numbers make no sense.
    pub fn build(
        scene: &Scene,
        geometry: &Geometry,
        environment: Option<Environment>,
        world_from_frame: impl Fn(&Pose) -> Option<Similarity>,
    ) -> Result<Self, LightError> {
        let mut lights = Vec::new();
        for light in &scene.lights {
            lights.push(Light::Lamp(place(light, &world_from_frame)?));
        }
        let mut light_of_triangle = HashMap::new();
        for glow in (0..geometry.triangle_count()).filter_map(|triangle| Glow::of(geometry, triangle)) {
            light_of_triangle.insert(glow.triangle, lights.len() as u32);
            lights.push(Light::Glow(glow));
        }
        let bounds = bounds(geometry, &lights);
        let environment = environment.map(|environment| {
            lights.push(Light::Environment);
            (lights.len() as u32 - 1, environment)
        });
        let mut all = Self { lights, choice: None, light_of_triangle, environment, bounds };
        let lamps = all.lights.iter().filter(|light| matches!(light, Light::Lamp(_))).count();
        all.choice = LightChoice::new(all.choice_weights(), lamps);
        Ok(all)
    }

    /// Half by flux, half alike for each lamp, all glowing surfaces together, and the environment: flux alone would
    /// leave a small lamp near its surface to one sample in a hundred wherever the environment is bright.
    fn choice_weights(&self) -> Vec<f64> {
        let powers: Vec<f64> = self.lights.iter().map(|light| f64::from(self.power(light))).collect();
        let total: f64 = powers.iter().sum();
        let glows = |light: &Light| matches!(light, Light::Glow(_));
        let of_glow: f64 =
            self.lights.iter().zip(&powers).filter(|(light, _)| glows(light)).map(|(_, p)| p).sum();
        let groups = powers.iter().zip(&self.lights).filter(|(p, light)| **p > 0.0 && !glows(light)).count()
            + usize::from(of_glow > 0.0);
        let alike = |light: &Light, power: f64| if glows(light) { power / of_glow } else { 1.0 };
        let weight = |(light, &power): (&Light, &f64)| {
            if power > 0.0 { power / total + alike(light, power) / groups as f64 } else { 0.0 }
        };
        self.lights.iter().zip(&powers).map(weight).collect()
    }

    /// How many lights there are; every glowing triangle is one.
    pub fn len(&self) -> usize {
        self.lights.len()
    }

    /// True if nothing shines.
    pub fn is_empty(&self) -> bool {
        self.choice.is_none()
    }

    /// Chooses a light and a point on it, as seen from `from`. `None` if that one sends nothing there.
    ///
    /// What the choice leaves of `u_light` takes the place of `u2.x` as long as it has digits enough: if `u_light` and `u2.y`
    /// are one stratified pair, the points on each light are stratified, however many others there are.
    pub fn sample(&self, geometry: &Geometry, from: Vec3, u_light: f32, u2: Vec2) -> Option<LightSample> {
        let choice = self.choice.as_ref()?.sample(u_light, |lamp| self.sent(lamp, from));
        let u2 = if choice.probability >= LEAST_REUSED { Vec2::new(choice.rest, u2.y) } else { u2 };
        let probability = choice.probability as f32;
        let light = choice.index as u32;
        let to_point = |target: Vec3, radiance, pdf_sr: f32, world| {
            Some(LightSample {
                wi: (target - from).try_normalize()?,
                target: Some(target),
                radiance,
                pdf: probability * pdf_sr,
                world,
                light,
            })
        };
        match self.lights.get(choice.index)? {
            Light::Lamp(lamp) => {
                let point = lamp.sample(from, u2)?;
                to_point(point.position, point.radiance, point.pdf_sr, lamp.world)
            }
            Light::Glow(glow) => {
                let (point, pdf_sr) = glow.sample(geometry, from, u2)?;
                to_point(point.position, point.radiance, pdf_sr, glow.world)
            }
            Light::Environment => {
                let (_, environment) = self.environment.as_ref()?;
                let wi = environment.sample(u2)?;
                let (radiance, pdf_sr) = (environment.radiance(wi), environment.pdf_sr(wi));
                (pdf_sr > 0.0 && radiance.max_element() > 0.0).then(|| LightSample {
                    wi,
                    target: None,
                    radiance,
                    pdf: probability * pdf_sr,
                    world: environment.world(),
                    light,
                })
            }
        }
    }

    /// The nearest lamp whose front a ray meets within (t_min, t_max).
    pub fn hit_lamp(&self, ray: &Ray) -> Option<LampHit> {
        self.lamps_along(*ray).min_by(|a, b| a.t.total_cmp(&b.t))
    }

    /// All lamps whose fronts a ray meets within (t_min, t_max), in the order of the scene: they do not hide each other.
    pub fn lamps_along(&self, ray: Ray) -> impl Iterator<Item = LampHit> {
        // Lamps come first.
        let lamps = self.lights.iter().enumerate().map_while(|(number, light)| match light {
            Light::Lamp(lamp) => Some((number as u32, lamp)),
            _ => None,
        });
        lamps.filter_map(move |(number, lamp)| {
            let (t, point) = lamp.hit(&ray)?;
            Some(LampHit {
                t,
                radiance: point.radiance,
                pdf: point.pdf_sr * self.probability(number, ray.origin),
                world: lamp.world,
                light: number,
            })
        })
    }

    /// Per steradian at `from`, of [`Lights::sample`] yielding the point at `position` of a glowing triangle; 0 if it does
    /// not glow towards there.
    pub fn pdf_of_triangle(&self, triangle: u32, from: Vec3, position: Vec3) -> f32 {
        let Some(&number) = self.light_of_triangle.get(&triangle) else {
            return 0.0;
        };
        match self.lights.get(number as usize) {
            Some(Light::Glow(glow)) => glow.pdf_sr(from, position) * self.probability(number, from),
            _ => 0.0,
        }
    }

    /// Per steradian, of [`Lights::sample`] yielding a direction of the environment.
    pub fn pdf_of_environment(&self, direction: Vec3) -> f32 {
        let Some((number, environment)) = &self.environment else {
            return 0.0;
        };
        environment.pdf_sr(direction) * self.probability(*number, Vec3::ZERO)
    }

    /// Radiance of the environment; 0 without one.
    pub fn environment_radiance(&self, direction: Vec3) -> Vec3 {
        self.environment.as_ref().map_or(Vec3::ZERO, |(_, environment)| environment.radiance(direction))
    }

    /// Starts a photon from a light chosen by its power. The environment's start on a disc as large as the scene, outside
    /// of it.
    pub fn sample_emission(
        &self,
        geometry: &Geometry,
        u_light: f32,
        u_position: Vec2,
        u_direction: Vec2,
    ) -> Option<Emission> {
        let choice = self.choice.as_ref()?.sample_everywhere(u_light);
        let probability = choice.probability as f32;
        let light = choice.index as u32;
        match self.lights.get(choice.index)? {
            Light::Lamp(lamp) => {
                let (origin, direction, pdf_direction) = lamp.sample_emission(u_position, u_direction);
                Some(Emission {
                    origin,
                    direction,
                    flux: lamp.power() / probability,
                    pdf_position: lamp.pdf_per_m2() * probability,
                    pdf_direction,
                    world: lamp.world,
                    light,
                })
            }
            Light::Glow(glow) => {
                let both = glow.is_double_sided();
                let side = if both && choice.rest < 0.5 { -1.0 } else { 1.0 };
                let side_probability = if both { 0.5 } else { 1.0 };
                let point = glow.point(geometry, u_position, side);
                let local = sample_cosine_hemisphere(u_direction);
                let pdf_position = glow.pdf_per_m2() * probability * side_probability;
                (point.radiance.max_element() > 0.0).then(|| Emission {
                    origin: point.position,
                    direction: glow.frame(side).to_world(local),
                    flux: point.radiance * PI / pdf_position,
                    pdf_position,
                    pdf_direction: local.z / PI,
                    world: glow.world,
                    light,
                })
            }
            Light::Environment => self.environment_photon(probability, light, u_position, u_direction),
        }
    }

    fn environment_photon(
        &self,
        probability: f32,
        light: u32,
        u_position: Vec2,
        u_direction: Vec2,
    ) -> Option<Emission> {
        let (_, environment) = self.environment.as_ref()?;
        let from = environment.sample(u_direction)?;
        let (radiance, pdf_direction) = (environment.radiance(from), environment.pdf_sr(from));
        let (across, up) = from.any_orthonormal_pair();
        let Sphere { center, radius } = self.bounds;
        let place = lamp::disc(u_position) * radius;
        let pdf_position = probability / (PI * radius * radius);
        (pdf_direction > 0.0 && radiance.max_element() > 0.0).then(|| Emission {
            origin: center + from * radius + across * place.x + up * place.y,
            direction: -from,
            flux: radiance / (pdf_position * pdf_direction),
            pdf_position,
            pdf_direction,
            world: environment.world(),
            light,
        })
    }

    fn probability(&self, light: u32, from: Vec3) -> f32 {
        let of = |choice: &LightChoice| choice.probability(light as usize, |lamp| self.sent(lamp, from));
        self.choice.as_ref().map_or(0.0, of) as f32
    }

    /// Estimate of what a lamp sends to a place.
    fn sent(&self, lamp: usize, from: Vec3) -> f32 {
        match self.lights.get(lamp) {
            Some(Light::Lamp(lamp)) => lamp.sent(from),
            _ => 0.0,
        }
    }

    fn power(&self, light: &Light) -> f32 {
        match light {
            Light::Lamp(lamp) => luminance(lamp.power()),
            Light::Glow(glow) => glow.power(),
            Light::Environment => self.environment.as_ref().map_or(0.0, |(_, environment)| {
                environment.luminance_sr() as f32 * PI * self.bounds.radius * self.bounds.radius
            }),
        }
    }
}

fn place(
    light: &coshade_scene::Light,
    world_from_frame: impl Fn(&Pose) -> Option<Similarity>,
) -> Result<Lamp, LightError> {
    let name = || light.name.clone();
    let invalid = |what| Err(LightError::Invalid { light: name(), what });
    let Some(world_from_light) = light.pose.resolve(world_from_frame) else {
        return Err(LightError::UnknownPose { light: name() });
    };
    if !world_from_light.is_valid() {
        return invalid(
            "its pose is not finite, or its scale not positive, or its rotation not a unit quaternion",
        );
    }
    let is_colour = |colour: Vec3| colour.is_finite() && colour.min_element() >= 0.0;
    match light.kind {
        coshade_scene::LightKind::Spot(spot) => {
            if !is_colour(spot.radiant_intensity) {
                return invalid("radiant_intensity must be finite and not negative");
            }
            if !(spot.radius_m.is_finite() && spot.radius_m > 0.0) {
                return invalid("radius_m must be positive");
            }
            let cone = 0.0 <= spot.inner_rad && spot.inner_rad <= spot.outer_rad;
            if !(cone && spot.outer_rad <= std::f32::consts::FRAC_PI_2 && spot.outer_rad > 0.0) {
                return invalid("the cone must have 0 <= inner <= outer <= 90 degrees, and outer above 0");
            }
        }
        coshade_scene::LightKind::Rectangle(rectangle) => {
            if !is_colour(rectangle.radiance) {
                return invalid("radiance must be finite and not negative");
            }
            if !(rectangle.size_m.is_finite() && rectangle.size_m.min_element() > 0.0) {
                return invalid("size_m must be positive");
            }
        }
    }
    Ok(Lamp::new(light.kind, light.world, world_from_light))
}

/// A ball around everything; of radius 1 m around the origin where there is nothing.
fn bounds(geometry: &Geometry, lights: &[Light]) -> Sphere {
    let corners = (0..geometry.triangle_count()).flat_map(|triangle| geometry.corners(triangle));
    let lamps = lights.iter().filter_map(|light| match light {
        Light::Lamp(lamp) => Some(lamp),
        _ => None,
    });
    let lamp_corners = lamps.flat_map(|lamp| {
        let reach = Vec3::splat(lamp.radius_m());
        [lamp.center() - reach, lamp.center() + reach]
    });
    let Some(aabb) = Aabb::around(corners.chain(lamp_corners)) else {
        return Sphere { center: Vec3::ZERO, radius: 1.0 };
    };
    Sphere {
        center: aabb.center(),
        // A little larger: nothing may touch the disc that photons start from.
        radius: (aabb.size().length() / 2.0 * 1.001).max(1e-6),
    }
}

#[cfg(test)]
mod tests;
