//! `docs/session.md` is made from the types. `UPDATE_DOCS=1 cargo test -p coshade-scene` rewrites it.

use std::path::Path;

use coshade_config::reference_page;
use coshade_scene::SessionSpec;

#[test]
fn the_reference_page_is_fresh() {
    let page = reference_page::<SessionSpec>("The session file", include_str!("data/session/design.toml"));
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/session.md");
    if std::env::var_os("UPDATE_DOCS").is_some_and(|value| value == "1") {
        std::fs::write(&path, &page).unwrap();
    }
    let committed = std::fs::read_to_string(&path).unwrap_or_default();
    assert!(
        committed == page,
        "docs/session.md is stale: UPDATE_DOCS=1 cargo test -p coshade-scene rewrites it"
    );
}
