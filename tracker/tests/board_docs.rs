//! `docs/board.md` is made from the types. `UPDATE_DOCS=1 cargo test -p coshade-tracker` rewrites it.

use std::path::Path;

use coshade_config::reference_page;
use coshade_tracker::Board;

const CUBE: &str = include_str!("data/cube.toml");

#[test]
fn the_reference_page_is_fresh() {
    let page = reference_page::<Board>("The board file", CUBE);
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/board.md");
    if std::env::var_os("UPDATE_DOCS").is_some_and(|value| value == "1") {
        std::fs::write(&path, &page).unwrap();
    }
    let committed = std::fs::read_to_string(&path).unwrap_or_default();
    assert!(
        committed == page,
        "docs/board.md is stale: UPDATE_DOCS=1 cargo test -p coshade-tracker rewrites it"
    );
}

#[test]
fn the_example_is_what_its_comments_say() {
    let cube = Board::parse(CUBE, "cube.toml").unwrap();
    let tags = cube.placed_tags().unwrap();
    let outward = tags.iter().map(|tag| (tag.body_from_tag * nalgebra::Vector3::z(), tag.body_from_tag));
    for (normal, body_from_tag) in outward {
        // Each tag lies on its face, 5 cm from the middle, and looks away from it.
        let distance_m = normal.dot(&body_from_tag.translation.vector);
        assert!((distance_m - 0.05).abs() < 1e-9, "{distance_m}");
    }
    let up = tags.iter().skip(1).map(|tag| (tag.body_from_tag * nalgebra::Vector3::y()).z);
    assert!(up.into_iter().all(|z| (z - 1.0).abs() < 1e-9));
}
