//! The tree of nodes.

use ::gltf::{Document, Node};
use glam::{Mat4, Vec4};

use super::super::assemble::Assembly;
use super::Fault;
use super::buffers::Buffers;
use super::materials::Materials;
use super::primitive;

/// +Y up, −Z forward (glTF) to +Z up: a quarter turn around x, `(x, y, z) → (x, −z, y)`.
const WORLD_FROM_GLTF: Mat4 = Mat4::from_cols(Vec4::X, Vec4::Z, Vec4::new(0.0, -1.0, 0.0, 0.0), Vec4::W);

/// Unpacks all meshes of the default scene, of the first one if there is no default, or of all root nodes if there is
/// no scene at all.
pub(super) fn add_all(
    document: &Document,
    buffers: &Buffers<'_>,
    materials: &mut Materials<'_>,
    assembly: &mut Assembly,
) -> Result<(), Fault> {
    let root = document.as_json();
    let nodes: Vec<Node<'_>> = document.nodes().collect();
    let scene = root.scene.map_or(0, |scene| scene.value());
    let roots: Vec<usize> = match root.scenes.get(scene) {
        Some(scene) => scene.nodes.iter().map(|node| node.value()).collect(),
        None => orphans(document),
    };
    if root.scenes.len() > 1 {
        assembly.warnings.push(format!("scenes: only scenes[{scene}] of {} is shown", root.scenes.len()));
    }
    let mut seen = vec![false; nodes.len()];
    let mut open: Vec<(usize, Mat4)> = roots.into_iter().rev().map(|node| (node, WORLD_FROM_GLTF)).collect();
    while let Some((number, world_from_parent)) = open.pop() {
        let Some(node) = nodes.get(number) else {
            return Err(Fault::new("nodes", format!("node {number} does not exist")));
        };
        let place = place_of(node);
        if std::mem::replace(&mut seen[number], true) {
            return Err(Fault::new(place, "is the child of several nodes, or of itself"));
        }
        let world_from_node = world_from_parent * Mat4::from_cols_array_2d(&node.transform().matrix());
        if !world_from_node.is_finite() {
            return Err(Fault::new(place, "its transform is not finite"));
        }
        if let Some(mesh) = node.mesh() {
            if world_from_node.determinant() == 0.0 {
                assembly.warnings.push(format!("{place}: its transform flattens the mesh (determinant 0)"));
            }
            for primitive in mesh.primitives() {
                primitive::add(document, buffers, &primitive, &mesh, world_from_node, materials, assembly)?;
            }
        }
        let children: Vec<_> = node.children().map(|child| (child.index(), world_from_node)).collect();
        open.extend(children.into_iter().rev());
    }
    Ok(())
}

/// Nodes that are nobody's child.
fn orphans(document: &Document) -> Vec<usize> {
    let mut is_child = vec![false; document.as_json().nodes.len()];
    let children = document.as_json().nodes.iter().filter_map(|node| node.children.as_ref()).flatten();
    children.for_each(|child| is_child[child.value()] = true);
    (0..is_child.len()).filter(|&number| !is_child[number]).collect()
}

fn place_of(node: &Node<'_>) -> String {
    match node.name() {
        Some(name) => format!("nodes[{}] '{name}'", node.index()),
        None => format!("nodes[{}]", node.index()),
    }
}
