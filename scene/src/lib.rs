//! Things, materials, lights, meshes and the session file: plain data, no GPU.
//!
//! | module | what is there |
//! | --- | --- |
//! | [`world`] | real or virtual |
//! | [`pose`] | where a thing is: in the world, on a marker, a body or a board |
//! | [`mesh`] | triangles, their bounds |
//! | [`material`], [`texture`] | glTF metallic-roughness with transmission |
//! | [`light`] | spots and rectangles |
//! | [`thing`] | things and the [`Scene`] of them |
//! | [`shape`] | box, sphere, plane, ring, Utah teapot |
//! | [`mod@import`] | glTF, Wavefront OBJ, Stanford PLY |
//! | [`normals`], [`tangents`], [`polygon`] | what a file leaves out: made here |
//! | [`topology`] | whether a surface is closed |
//! | [`validity`] | what is wrong with a mesh |
//! | [`session`], [`rig`] | the session file and the rig file |
//! | [`sample`] | points spread over surfaces |
//!
//! World: right-handed, +Z up, metres. Colours are linear RGB in the see-through camera's own primaries.

pub mod bounds;
pub mod import;
pub mod light;
pub mod material;
pub mod mesh;
pub mod normals;
pub mod polygon;
pub mod pose;
pub mod rig;
pub mod sample;
pub mod session;
pub mod shape;
pub mod tangents;
pub mod texture;
pub mod thing;
pub mod topology;
pub mod validity;
pub mod world;

pub use bounds::{Aabb, Sphere};
pub use import::{ImportError, Imported, import, import_with};
pub use light::{Light, LightKind};
pub use material::{AlphaMode, Material};
pub use mesh::{Mesh, MeshError, Part};
pub use pose::{Pose, Similarity};
pub use rig::{Rig, RigSensor};
pub use session::{Session, SessionSpec};
pub use shape::{Shape, ShapeError};
pub use texture::{ColorSpace, Image, Texture};
pub use thing::{Scene, Thing};
pub use world::World;
