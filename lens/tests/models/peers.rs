//! Values of OpenCV and of independent implementations of the published formulas, as `tests/peers/opencv_lens.py`
//! wrote them.

use coshade_lens::model::{CameraModel, ModelKind};
use nalgebra::{Vector2, Vector3};
use serde_json::Value;

use crate::lenses::angle;

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect()
}

#[test]
fn agree_with_ours() {
    let table: Value = serde_json::from_str(include_str!("../data/opencv_points.json")).unwrap();
    let lenses = table["lenses"].as_array().unwrap();
    let mut kinds_seen: Vec<ModelKind> = Vec::new();
    for lens in lenses {
        let name = format!("{} {}", lens["model"], lens["name"]);
        let kind: ModelKind = lens["model"].as_str().unwrap().parse().unwrap();
        let model = CameraModel::from_params(kind, &numbers(&lens["params"])).unwrap();
        kinds_seen.push(kind);
        let worst_px = compare_projected(&model, &lens["projected"], &name);
        let worst_rad = compare_unprojected(&model, &lens["unprojected"], &name);
        println!("{name}: {worst_px:.1e} px, {worst_rad:.1e} rad");
    }
    assert!(ModelKind::ALL.iter().all(|kind| kinds_seen.contains(kind)));
}

fn compare_projected(model: &CameraModel, rows: &Value, name: &str) -> f64 {
    let rows = rows.as_array().unwrap();
    assert!(!rows.is_empty());
    rows.iter().fold(0.0, |worst, row| {
        let point = Vector3::from_vec(numbers(&row["point"]));
        let theirs = Vector2::from_vec(numbers(&row["px"]));
        let ours = model.project(&point).unwrap_or_else(|| panic!("{name}: {point} not projected"));
        let error = (ours - theirs).norm();
        assert!(error <= 1e-9, "{name}: {point} is off by {error} px");
        error.max(worst)
    })
}

/// The table holds pixels on which the peer's own round trip closes to 10⁻¹⁰ px, so its ray may be off by that times
/// the radians per pixel there.
fn compare_unprojected(model: &CameraModel, rows: &Value, name: &str) -> f64 {
    let rows = rows.as_array().unwrap();
    assert!(!rows.is_empty());
    rows.iter().fold(0.0, |worst, row| {
        let px = Vector2::from_vec(numbers(&row["px"]));
        let theirs = Vector3::from_vec(numbers(&row["ray"]));
        let ours = model.unproject_jacobian(&px).unwrap_or_else(|| panic!("{name}: {px} not unprojected"));
        let error = angle(&ours.ray, &theirs);
        let allowed = 1e-10 * ours.d_ray_d_px.norm() + 1e-14;
        assert!(allowed < 1e-9 && error <= allowed, "{name}: {px} is off by {error} rad");
        error.max(worst)
    })
}
