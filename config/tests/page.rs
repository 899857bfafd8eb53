//! The reference page of keys.

#![allow(dead_code, reason = "the types are only described")]

use std::collections::BTreeMap;

use coshade_config::reference_page;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A lamp on a desk.
#[derive(Deserialize, JsonSchema)]
struct Lamp {
    /// Of the disc.
    ///
    /// Higher: softer shadows.
    #[serde(default = "radius")]
    #[schemars(range(min = 0.0))]
    radius_m: f64,
    /// What it is.
    kind: Kind,
    /// Where it is.
    pose: Option<Pose>,
    /// More of them.
    #[serde(default)]
    bulb: Vec<Bulb>,
    by_name: Option<BTreeMap<String, Bulb>>,
    #[serde(flatten)]
    power: Power,
}

fn radius() -> f64 {
    0.005
}

#[derive(Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
enum Kind {
    /// A disc.
    Spot,
    /// A | rectangle.
    Area,
}

/// A place.
#[derive(Deserialize, JsonSchema)]
#[serde(tag = "in", rename_all = "lowercase")]
enum Pose {
    /// Fixed.
    World { position_m: [f64; 3] },
    /// On a tag.
    Marker { id: u32 },
}

/// Something that glows.
#[derive(Deserialize, JsonSchema)]
struct Bulb {
    cone_deg: f64,
}

#[derive(Deserialize, JsonSchema)]
#[serde(untagged)]
enum Power {
    Given { radiant_intensity: [f64; 3] },
    Fitted { fit: bool },
}

#[test]
fn the_page_tells_all_that_the_types_know() {
    let page = reference_page::<Lamp>("Lamps", "kind = \"spot\"\n");
    for expected in [
        "# Lamps\n",
        "A lamp on a desk.",
        "| `radius_m` | a number, at least 0, metres | `0.005` | Of the disc. Higher: softer shadows. |",
        "| `kind` | one of `spot`, `area` | required | What it is. `spot`: A disc. `area`: A \\| rectangle. |",
        "| `pose` | a table, see [its keys](#pose) | – | Where it is. |",
        "One of these keys:",
        "| `radiant_intensity` | an array of 3, each a number | one of these |",
        "| `fit` | true or false | one of these |",
        "<a id=\"pose\"></a>\n## `pose`\n\nWhere it is.\n\nWith `in = \"world\"`: Fixed.\n",
        "| `position_m` | an array of 3, each a number, metres | required |",
        "With `in = \"marker\"`: On a tag.\n\n| key",
        "| `id` | an integer from 0 to 4294967295 | required |",
        "## `bulb[]`\n\nSomething that glows.\n\n",
        "| `cone_deg` | a number, degrees | required |",
        "| `by_name` | a table, see [its keys](#bulb) |",
        "## Example\n\n```toml\nkind = \"spot\"\n```\n",
    ] {
        assert!(page.contains(expected), "{expected}\n---\n{page}");
    }
    assert_eq!(page.matches("Something that glows.").count(), 1, "described once:\n{page}");
}
