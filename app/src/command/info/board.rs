//! Boards of tags.

use std::path::Path;

use coshade_tracker::Board;

use super::Found;

pub fn look(path: &Path) -> anyhow::Result<Found> {
    let board = Board::read(path)?;
    let mut text = format!("  {} tags of {}\n", board.tags.len(), board.family);
    for tag in &board.tags {
        let [x, y] = tag.position_m;
        text += &format!("  tag {}: {} m wide, at ({x}, {y}) m\n", tag.id, tag.size_m);
    }
    Ok(Found { content: serde_json::to_value(&board)?, text, problems: Vec::new() })
}
