//! All that is traced.

use coshade_scene::{Aabb, Pose, Scene, Similarity};
use thiserror::Error;

use crate::accel::{Accel, Geometry, GeometryError};
use crate::bsdf::ggx::SMOOTH_ALPHA;
use crate::emitter::{Environment, LightError, Lights};

/// Why a scene cannot be traced.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum TraceError {
    /// Of a thing.
    #[error(transparent)]
    Geometry(#[from] GeometryError),
    /// Of a light.
    #[error(transparent)]
    Light(#[from] LightError),
}

/// A scene ready to be traced.
#[derive(Clone, Debug)]
pub struct TraceScene {
    accel: Accel,
    lights: Lights,
    /// Without the environment: where photons of caustics start.
    lamps: Lights,
    has_virtual: bool,
    has_smooth: bool,
    radius_m: f32,
}

impl TraceScene {
    /// Places things and lights. `world_from_frame` is asked for the frame of everything that is not fixed in the world,
    /// see [`Pose::resolve`].
    ///
    /// # Errors
    /// [`TraceError`] names the thing or light that cannot be placed or used.
    pub fn build(
        scene: &Scene,
        environment: Option<Environment>,
        world_from_frame: impl Fn(&Pose) -> Option<Similarity>,
    ) -> Result<Self, TraceError> {
        let accel = Accel::build(scene, &world_from_frame)?;
        let geometry = accel.geometry();
        let lamps = Lights::build(scene, geometry, None, &world_from_frame)?;
        let lights = match environment {
            Some(environment) => Lights::build(scene, geometry, Some(environment), &world_from_frame)?,
            None => lamps.clone(),
        };
        let has_virtual = geometry.things().iter().any(|thing| !thing.world.is_real());
        let (has_smooth, radius_m) = (has_smooth(geometry), radius_m(geometry));
        Ok(Self { lights, lamps, has_virtual, has_smooth, radius_m, accel })
    }

    /// Triangles.
    pub fn accel(&self) -> &Accel {
        &self.accel
    }

    /// All lights.
    pub fn lights(&self) -> &Lights {
        &self.lights
    }

    /// All lights but the environment.
    pub fn lamps(&self) -> &Lights {
        &self.lamps
    }

    /// True if any thing is virtual.
    pub fn has_virtual(&self) -> bool {
        self.has_virtual
    }

    /// True if lamps may throw caustics: there is one, and something smooth that mirrors or transmits.
    pub fn may_have_lamp_caustics(&self) -> bool {
        self.has_smooth && !self.lamps.is_empty()
    }

    /// Half the diagonal of the box around all things; 0 without any.
    pub fn radius_m(&self) -> f32 {
        self.radius_m
    }
}

/// True if any material may have a delta lobe somewhere. Bodies inside one another may bury an interface, which is then
/// passed straight through, whatever its roughness.
fn has_smooth(geometry: &Geometry) -> bool {
    geometry.things().iter().flat_map(|thing| &thing.materials).any(|material| {
        material.transmission > 0.0
            || material.metallic_roughness_texture.is_some()
            || material.alpha() < SMOOTH_ALPHA
    })
}

fn radius_m(geometry: &Geometry) -> f32 {
    let corners = (0..geometry.triangle_count()).flat_map(|triangle| geometry.corners(triangle));
    Aabb::around(corners).map_or(0.0, |aabb| aabb.size().length() / 2.0)
}
