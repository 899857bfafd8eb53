//! Things, and the scene of things and lights.

use std::sync::Arc;

use crate::light::Light;
use crate::material::Material;
use crate::mesh::Mesh;
use crate::pose::Pose;
use crate::world::World;

/// An object, real or virtual.
#[derive(Clone, Debug)]
pub struct Thing {
    /// Unique within a scene.
    pub name: String,
    /// Real or virtual.
    pub world: World,
    /// Its surface, in its own frame, metres before the pose's scale.
    pub mesh: Arc<Mesh>,
    /// One for each material slot of the mesh: part `p` is made of `materials[p.material]`.
    pub materials: Vec<Arc<Material>>,
    /// Where it is.
    pub pose: Pose,
    /// Paint over the tag it is attached to.
    pub hide_marker: bool,
}

/// All that is described about the room: what stands in it and what shines in it.
#[derive(Clone, Debug, Default)]
pub struct Scene {
    /// Real and virtual objects.
    pub things: Vec<Thing>,
    /// Real and virtual lights, without the environment.
    pub lights: Vec<Light>,
}

impl Thing {
    /// The material of a part; `None` if the thing has fewer materials than its mesh has slots.
    pub fn material_of(&self, part: usize) -> Option<&Arc<Material>> {
        self.materials.get(self.mesh.parts.get(part)?.material)
    }
}
