//! Meshes from files: glTF 2.0, Wavefront OBJ, Stanford PLY.
//!
//! A file becomes one mesh, however many nodes, objects or groups it has: node transforms are baked in, and its parts
//! keep their materials. Files are not trusted: counts are checked against what is really there before memory is asked
//! for, and a file may only refer to files in its own folder or below.

mod assemble;
mod error;
mod files;
mod gltf;
mod mtl;
mod obj;
mod picture;
mod ply;
mod text;

use std::path::Path;
use std::sync::Arc;

use crate::material::Material;
use crate::mesh::Mesh;

use error::Fault;
pub use error::ImportError;

/// Most vertices a file may have once it is unpacked, instances included.
pub const MAX_VERTICES: usize = 1 << 24;
/// Most triangles a file may have once it is unpacked, instances included.
pub const MAX_TRIANGLES: usize = 1 << 25;

/// Which axis of a file points up.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Up {
    /// The file's z, as here: nothing is turned.
    #[default]
    Z,
    /// The file's y: turned by 90° around x, `(x, y, z) → (x, −z, y)`.
    Y,
}

/// How a mesh without normals is shaded.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum MissingNormals {
    /// Smoothly: the mean of the triangles around a corner, weighted by area.
    #[default]
    Smooth,
    /// Each triangle flat.
    Flat,
}

/// What OBJ and PLY files leave open. glTF does not: it is +Y up (turned here), in metres, flat without normals.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImportOptions {
    /// Up axis of an OBJ or PLY file. Neither format defines one; kept as it is unless stated.
    pub up: Up,
    /// Metres per unit of an OBJ or PLY file. Neither format defines a unit; 1 unless stated.
    pub unit_m: f32,
    /// For OBJ and PLY files without normals.
    pub missing_normals: MissingNormals,
}

impl Default for ImportOptions {
    fn default() -> Self {
        Self { up: Up::Z, unit_m: 1.0, missing_normals: MissingNormals::Smooth }
    }
}

/// What was in a file.
#[derive(Clone, Debug)]
pub struct Imported {
    /// Everything in one mesh, +Z up, metres.
    pub mesh: Arc<Mesh>,
    /// One for each of the mesh's material slots.
    pub materials: Vec<Arc<Material>>,
    /// What was left out or guessed, each with its place in the file.
    pub warnings: Vec<String>,
    /// Counts, for a log or a list of objects.
    pub statistics: Statistics,
}

/// Counts of an import.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Statistics {
    /// Vertices of the mesh, after attributes were brought to one index.
    pub vertices: usize,
    /// Triangles of the mesh.
    pub triangles: usize,
    /// Pieces of the file that became parts: glTF primitives per node, OBJ material runs.
    pub parts: usize,
    /// Materials in use.
    pub materials: usize,
    /// Pictures decoded.
    pub images: usize,
}

/// Reads a mesh by the ending of its name: `.glb`, `.gltf`, `.obj` or `.ply`, in any case.
///
/// # Errors
/// [`ImportError`] names the file and the place in it: an accessor, a mesh, a line.
pub fn import(path: impl AsRef<Path>) -> Result<Imported, ImportError> {
    import_with(path, &ImportOptions::default())
}

/// As [`import`], with what the file does not say itself.
///
/// # Errors
/// As [`import`]; also if `unit_m` is not positive and finite.
pub fn import_with(path: impl AsRef<Path>, options: &ImportOptions) -> Result<Imported, ImportError> {
    let path = path.as_ref();
    if !(options.unit_m.is_finite() && options.unit_m > 0.0) {
        let problem = format!("unit_m = {}, expected a positive length in metres", options.unit_m);
        return Err(Fault::new("import options", problem).in_file(path));
    }
    let ending =
        path.extension().map(|ending| ending.to_string_lossy().to_ascii_lowercase()).unwrap_or_default();
    let read: fn(&Path, &[u8], &ImportOptions) -> Result<Imported, Fault> = match ending.as_str() {
        "glb" | "gltf" => gltf::read,
        "obj" => obj::read,
        "ply" => ply::read,
        _ => return Err(ImportError::Ending { file: path.to_owned(), ending }),
    };
    let bytes =
        files::read_limited(path).map_err(|source| ImportError::Io { file: path.to_owned(), source })?;
    let folder = path.parent().unwrap_or(Path::new(""));
    let mut imported = read(folder, &bytes, options).map_err(|fault| fault.in_file(path))?;
    if let Some(mesh) = Arc::get_mut(&mut imported.mesh) {
        mesh.name = path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
    }
    Ok(imported)
}
