//! A scene's things as triangles in world space.

use std::sync::Arc;

use coshade_scene::{AlphaMode, Material, Mesh, MeshError, Pose, Scene, Similarity, Thing, World};
use glam::{Vec2, Vec3};
use thiserror::Error;

use crate::random::{hash_words, unit_float};
use crate::surface::texture;

/// Why a scene cannot be traced.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum GeometryError {
    /// The tracker does not know where the thing is.
    #[error("thing '{thing}': its pose is not known; it is attached to {frame}, which has not been seen")]
    UnknownPose {
        /// Name of the thing.
        thing: String,
        /// What it is attached to.
        frame: String,
    },
    /// A pose that is not a similarity.
    #[error(
        "thing '{thing}': its pose is not finite, or its scale not positive, or its rotation not a unit quaternion"
    )]
    InvalidPose {
        /// Name of the thing.
        thing: String,
    },
    /// The mesh is broken.
    #[error("thing '{thing}': {error}")]
    Mesh {
        /// Name of the thing.
        thing: String,
        /// What is broken.
        error: MeshError,
    },
    /// A corner is nowhere.
    #[error("thing '{thing}', mesh '{mesh}': vertex {vertex} is not finite in world coordinates")]
    NotFinite {
        /// Name of the thing.
        thing: String,
        /// Name of the mesh.
        mesh: String,
        /// Index of the vertex.
        vertex: usize,
    },
    /// A part without a material.
    #[error("thing '{thing}': part {part} uses material slot {slot}, but the thing has {found} materials")]
    MissingMaterial {
        /// Name of the thing.
        thing: String,
        /// Index of the part.
        part: usize,
        /// The slot it asks for.
        slot: usize,
        /// How many there are.
        found: usize,
    },
    /// Too much for 31-bit triangle numbers.
    #[error("the scene has {found} triangles, at most {} can be traced", Geometry::MAX_TRIANGLES)]
    TooManyTriangles {
        /// How many there are.
        found: usize,
    },
}

/// A thing as it stands in the world.
#[derive(Clone, Debug)]
pub struct ThingGeometry {
    /// For messages.
    pub name: String,
    /// Real or virtual.
    pub world: World,
    /// In its own frame.
    pub mesh: Arc<Mesh>,
    /// One for each slot.
    pub materials: Vec<Arc<Material>>,
    /// Where it is.
    pub world_from_thing: Similarity,
}

/// Where a triangle comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TriangleRef {
    /// Index in [`Geometry::things`].
    pub thing: u32,
    /// Number within the thing's mesh.
    pub triangle: u32,
    /// Part of the mesh.
    pub part: u32,
    /// Material slot of the part.
    pub material: u32,
}

/// All triangles that have an area, numbered through.
#[derive(Clone, Debug, Default)]
pub struct Geometry {
    things: Vec<ThingGeometry>,
    triangles: Vec<TriangleRef>,
    corners: Vec<[Vec3; 3]>,
}

impl Geometry {
    /// Numbers leave one bit for a mark.
    pub const MAX_TRIANGLES: usize = (1 << 31) - 1;

    /// Places all things of a scene; triangles without area (two corners at one place) are left out.
    ///
    /// # Errors
    /// See [`GeometryError`].
    pub fn of_scene(
        scene: &Scene,
        world_from_frame: impl Fn(&Pose) -> Option<Similarity>,
    ) -> Result<Self, GeometryError> {
        let mut geometry = Self::default();
        for thing in &scene.things {
            let world_from_thing = thing.pose.resolve(&world_from_frame).ok_or_else(|| {
                GeometryError::UnknownPose { thing: thing.name.clone(), frame: frame_name(&thing.pose) }
            })?;
            geometry.add(thing, world_from_thing)?;
        }
        Ok(geometry)
    }

    fn add(&mut self, thing: &Thing, world_from_thing: Similarity) -> Result<(), GeometryError> {
        let name = || thing.name.clone();
        if !world_from_thing.is_valid() {
            return Err(GeometryError::InvalidPose { thing: name() });
        }
        let mesh = &thing.mesh;
        mesh.check().map_err(|error| GeometryError::Mesh { thing: name(), error })?;
        let found = self.triangles.len() + mesh.triangle_count();
        if found > Self::MAX_TRIANGLES {
            return Err(GeometryError::TooManyTriangles { found });
        }
        // Once for each vertex: triangles that share one must agree on it to the last bit.
        let positions: Vec<Vec3> =
            mesh.positions.iter().map(|&position| world_from_thing.transform_point(position)).collect();
        if let Some(vertex) = positions.iter().position(|position| !position.is_finite()) {
            let mesh = mesh.name.clone();
            return Err(GeometryError::NotFinite { thing: name(), mesh, vertex });
        }
        let number = self.things.len() as u32;
        for (part, run) in mesh.parts.iter().enumerate() {
            if thing.material_of(part).is_none() {
                return Err(GeometryError::MissingMaterial {
                    thing: name(),
                    part,
                    slot: run.material,
                    found: thing.materials.len(),
                });
            }
            for triangle in run.triangles.clone() {
                let Some(indices) = mesh.triangle(triangle as usize) else {
                    continue;
                };
                let corners = indices.map(|index| positions[index as usize]);
                if has_area(&corners) {
                    self.corners.push(corners);
                    self.triangles.push(TriangleRef {
                        thing: number,
                        triangle,
                        part: part as u32,
                        material: run.material as u32,
                    });
                }
            }
        }
        self.things.push(ThingGeometry {
            name: name(),
            world: thing.world,
            mesh: Arc::clone(mesh),
            materials: thing.materials.clone(),
            world_from_thing,
        });
        Ok(())
    }

    /// In the order of the scene.
    pub fn things(&self) -> &[ThingGeometry] {
        &self.things
    }

    /// How many triangles there are.
    pub fn triangle_count(&self) -> u32 {
        self.triangles.len() as u32
    }

    /// Where a triangle comes from. Numbers come from hits; others are a programming error.
    pub fn triangle(&self, number: u32) -> TriangleRef {
        self.triangles[number as usize]
    }

    /// Corners in world coordinates.
    pub fn corners(&self, number: u32) -> [Vec3; 3] {
        self.corners[number as usize]
    }

    /// The thing a triangle belongs to.
    pub fn thing_of(&self, number: u32) -> &ThingGeometry {
        &self.things[self.triangle(number).thing as usize]
    }

    /// The material of a triangle.
    pub fn material(&self, number: u32) -> &Material {
        let TriangleRef { thing, material, .. } = self.triangle(number);
        &self.things[thing as usize].materials[material as usize]
    }

    /// True if the triangle is part of the real world.
    pub fn is_real(&self, number: u32) -> bool {
        self.thing_of(number).world.is_real()
    }

    /// An attribute of the mesh, interpolated; `None` where the mesh lacks it.
    pub fn interpolate<T>(&self, number: u32, barycentric: Vec3, attribute: &[T]) -> Option<T>
    where
        T: Copy + std::ops::Mul<f32, Output = T> + std::ops::Add<Output = T>,
    {
        let TriangleRef { triangle, .. } = self.triangle(number);
        let indices = self.thing_of(number).mesh.triangle(triangle as usize)?;
        let [a, b, c] = indices.map(|index| attribute.get(index as usize).copied());
        Some(a? * barycentric.x + b? * barycentric.y + c? * barycentric.z)
    }

    /// Texture coordinates; the origin where there are none.
    pub fn uv(&self, number: u32, barycentric: Vec3) -> Vec2 {
        let uvs = &self.thing_of(number).mesh.uvs;
        self.interpolate(number, barycentric, uvs).unwrap_or_default()
    }

    /// True where a ray must ask [`Geometry::alpha_accepts`].
    pub fn alpha_decides(&self, number: u32) -> bool {
        self.triangles.get(number as usize).is_some() && self.material(number).alpha_mode != AlphaMode::Opaque
    }

    /// Whether the surface is there for a ray: always where opaque, by the cutoff where masked, with the probability
    /// alpha where blended.
    pub fn alpha_accepts(&self, number: u32, barycentric: Vec3, seed: u32) -> bool {
        let material = self.material(number);
        match material.alpha_mode {
            AlphaMode::Opaque => true,
            AlphaMode::Mask { cutoff } => self.alpha(number, barycentric) >= cutoff,
            AlphaMode::Blend => unit_float(hash_words(&[seed, number])) < self.alpha(number, barycentric),
        }
    }

    fn alpha(&self, number: u32, barycentric: Vec3) -> f32 {
        let material = self.material(number);
        let vertex = self.interpolate(number, barycentric, &self.thing_of(number).mesh.colors);
        let textured = material.base_color_texture.as_deref();
        let texel = textured.map_or(1.0, |texture| texture::lookup(texture, self.uv(number, barycentric)).w);
        material.base_color.w * vertex.map_or(1.0, |colour| colour.w) * texel
    }
}

fn has_area([a, b, c]: &[Vec3; 3]) -> bool {
    // In f64: the area of a small triangle must not underflow.
    let (a, b, c) = (a.as_dvec3(), b.as_dvec3(), c.as_dvec3());
    (b - a).cross(c - a).length_squared() > 0.0
}

fn frame_name(pose: &Pose) -> String {
    match pose {
        Pose::World(_) => "the world".to_owned(),
        Pose::Marker { family, id, .. } => format!("marker {family} {id}"),
        Pose::Body { body, .. } => format!("body {}", body.display()),
        Pose::Board { board, .. } => format!("board {}", board.display()),
    }
}
