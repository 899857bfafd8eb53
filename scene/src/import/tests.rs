//! Smoke.
#[test]
fn real() {
    for f in ["buddha_20k.obj","dragon_vrip_res3.ply","stanford-bunny.obj","suzanne.obj","teapot.obj"] {
        let i = super::import(format!("/work/shared/data/meshes/{f}")).unwrap();
        println!("{f} {:?} area {} vol {} {:?} {:?}", i.statistics, i.mesh.area_m2(), i.mesh.volume_m3(), i.mesh.aabb(), i.warnings);
        let t = crate::topology::Topology::of(&i.mesh);
        println!("  v {} e {} f {} open {} nm {} flip {} comps {}", t.vertices, t.edges, t.faces, t.open_edges.len(), t.non_manifold_edges.len(), t.flipped_edges.len(), t.components.len());
    }
}
