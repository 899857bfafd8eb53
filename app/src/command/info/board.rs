//! Boards of tags.

use std::path::Path;

use coshade_tracker::board::BoardProvenance;
use coshade_tracker::{Board, BodyTag};
use serde_json::json;

use super::Found;

pub fn look(path: &Path) -> anyhow::Result<Found> {
    let board = Board::read(path)?;
    let tags = board.placed_tags()?;
    let is_flat = board.is_flat()?;
    let [low, high] = board.extent_m()?;
    let extent_m: [f64; 3] = (high - low).into();
    let families: Vec<&str> = board.families().into_iter().map(|family| family.name()).collect();
    let shape = if is_flat { "flat" } else { "in space" };
    let size = extent_m.map(|side| format!("{:.1}", side * 1000.0)).join(" × ");
    let mut text = format!(
        "  {} tags of {}, {shape}, {size} mm from corner to corner\n",
        tags.len(),
        families.join(", ")
    );
    for tag in &tags {
        text += &line(tag);
    }
    text += &board.provenance.as_ref().map(provenance).unwrap_or_default();
    let mut content = serde_json::to_value(&board)?;
    if let Some(content) = content.as_object_mut() {
        content.insert("is_flat".to_owned(), json!(is_flat));
        content.insert("families".to_owned(), json!(families));
        content.insert(
            "extent_m".to_owned(),
            json!({ "low": low.coords.as_slice(), "high": high.coords.as_slice() }),
        );
    }
    Ok(Found { content, text, problems: Vec::new() })
}

fn line(tag: &BodyTag) -> String {
    let [x, y, z]: [f64; 3] = tag.body_from_tag.translation.vector.into();
    let turned = match tag.body_from_tag.rotation.axis_angle() {
        Some((axis, angle_rad)) => format!(
            ", turned {:.3}° about ({:.4}, {:.4}, {:.4})",
            angle_rad.to_degrees(),
            axis.x,
            axis.y,
            axis.z
        ),
        None => String::new(),
    };
    format!("  tag {}: {} m wide, at ({x}, {y}, {z}) m{turned}\n", tag.tag, tag.size_m)
}

fn provenance(provenance: &BoardProvenance) -> String {
    let BoardProvenance { tool, when, images, rms_px, notes } = provenance;
    let said = [
        tool.as_ref().map(|tool| format!("by {tool}")),
        when.as_ref().map(|when| format!("on {when}")),
        (!images.is_empty()).then(|| format!("from {}", images.join(", "))),
        rms_px.map(|rms| format!("{rms} px RMS")),
        notes.clone(),
    ];
    let said: Vec<String> = said.into_iter().flatten().collect();
    if said.is_empty() { String::new() } else { format!("  made {}\n", said.join("; ")) }
}
