//! Where rays meet triangles, in the mixed world and in the real one.
//!
//! | module | what it does |
//! | --- | --- |
//! | [`ray`] | rays and hits |
//! | [`geometry`] | a scene's things as world-space triangles |
//! | [`watertight`] | the triangle test: no ray slips between two triangles that share an edge |
//! | [`bvh`] | a four-wide bounding volume hierarchy over them, collapsed from `obvhs`' binary one |
//! | [`offset`] | where rays that leave a surface start |
//!
//! Both worlds have a hierarchy of their own, so a ray that passes through virtual things pays nothing for them.

pub mod bvh;
pub mod geometry;
pub mod offset;
pub mod ray;
pub mod watertight;

use std::sync::Arc;

use coshade_scene::{Pose, Scene, Similarity};

pub use bvh::Bvh;
pub use geometry::{Geometry, GeometryError, ThingGeometry, TriangleRef};
pub use ray::{Hit, Ray, Sees};

use crate::surface::Surface;

/// The triangles of a scene, ready for rays.
#[derive(Clone, Debug)]
pub struct Accel {
    geometry: Geometry,
    everything: Arc<Bvh>,
    real: Arc<Bvh>,
}

impl Accel {
    /// Places the things and builds both hierarchies. `world_from_frame` is asked for the frame of every thing that is
    /// not fixed in the world, see [`Pose::resolve`].
    ///
    /// # Errors
    /// [`GeometryError`] names the thing whose pose is unknown, or whose mesh or materials cannot be used.
    pub fn build(
        scene: &Scene,
        world_from_frame: impl Fn(&Pose) -> Option<Similarity>,
    ) -> Result<Self, GeometryError> {
        let geometry = Geometry::of_scene(scene, world_from_frame)?;
        let everything = Arc::new(Bvh::build(&geometry, |_| true));
        let all_real = geometry.things().iter().all(|thing| thing.world.is_real());
        let real = if all_real {
            Arc::clone(&everything)
        } else {
            Arc::new(Bvh::build(&geometry, |triangle| geometry.is_real(triangle)))
        };
        Ok(Self { geometry, everything, real })
    }

    /// The triangles.
    pub fn geometry(&self) -> &Geometry {
        &self.geometry
    }

    /// The nearest surface within (t_min, t_max) of what the ray can see. Surfaces are hit from both sides; where a
    /// texture makes them transparent ([`coshade_scene::AlphaMode`]) they are not there, of blended ones the share
    /// alpha of all rays hits (decided by the ray's seed).
    pub fn closest(&self, ray: &Ray, sees: Sees) -> Option<Hit> {
        let accept = |triangle, barycentric| self.geometry.alpha_accepts(triangle, barycentric, ray.seed);
        self.bvh(sees).closest(ray, accept)
    }

    /// True if anything that the ray can see lies within (t_min, t_max). Sees exactly what [`Accel::closest`] sees.
    pub fn occluded(&self, ray: &Ray, sees: Sees) -> bool {
        let accept = |triangle, barycentric| self.geometry.alpha_accepts(triangle, barycentric, ray.seed);
        self.bvh(sees).occluded(ray, accept)
    }

    /// Everything about the place of a hit that shading needs.
    pub fn surface(&self, ray: &Ray, hit: &Hit) -> Surface {
        Surface::at(&self.geometry, ray, hit)
    }

    fn bvh(&self, sees: Sees) -> &Bvh {
        match sees {
            Sees::Everything => &self.everything,
            Sees::RealOnly => &self.real,
        }
    }
}

#[cfg(test)]
mod tests;
