//! Worlds to be simulated.

use std::fmt::Write as _;
use std::path::Path;

use coshade_sim::world::World;

use super::Found;

pub fn look(path: &Path) -> anyhow::Result<Found> {
    let world = World::read(path)?;
    let spec = world.spec();
    let mut text = format!("  {} s, seed {}\n", spec.duration_s, spec.seed);
    let _ = writeln!(
        text,
        "  {} things, {} lights, {} tags, {} boards, {} keyframes",
        spec.things.len(),
        spec.lights.len(),
        spec.tags.len(),
        spec.boards.len(),
        spec.keyframes.len()
    );
    for (name, sensor) in &spec.sensors {
        let [width, height] = world.calibration(name)?.size_px;
        let _ = writeln!(text, "  sensor {name}: {width}x{height} px, {} frames/s", sensor.frames_per_second);
    }
    Ok(Found { content: serde_json::to_value(spec)?, text, problems: Vec::new() })
}
