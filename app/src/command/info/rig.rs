//! Rig files: where sensors sit to each other.

use std::fmt::Write as _;
use std::path::Path;

use coshade_scene::rig::Rig;

use super::Found;

pub fn look(path: &Path) -> anyhow::Result<Found> {
    let rig = Rig::read(path)?;
    let mut text = String::new();
    for (name, sensor) in &rig.sensors {
        let [x, y, z] = sensor.position_m;
        let (axis, angle_rad) = sensor.rotation()?.to_axis_angle();
        let _ = writeln!(
            text,
            "  {name}: at ({x}, {y}, {z}) m, turned {:.3}° about ({:.4}, {:.4}, {:.4}), clock {} ns, readout {} s",
            angle_rad.to_degrees(),
            axis.x,
            axis.y,
            axis.z,
            sensor.time_offset_ns,
            sensor.readout_s
        );
    }
    Ok(Found { content: serde_json::to_value(&rig)?, text, problems: Vec::new() })
}
