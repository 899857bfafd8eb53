//! Ranges of numbers.

use serde_json::Value;

use super::Keywords;

/// What a number may be.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Range {
    pub min: Option<f64>,
    pub max: Option<f64>,
    /// The ends themselves are excluded.
    pub above: Option<f64>,
    pub below: Option<f64>,
}

/// As the keywords say; the width of the type counts where it is the stricter.
pub(crate) fn range(keywords: &Keywords) -> Range {
    let number = |keyword| keywords.get(keyword).and_then(Value::as_f64);
    let (type_min, type_max) = type_range(keywords);
    let stricter = |a: Option<f64>, b: Option<f64>, pick: fn(f64, f64) -> f64| match (a, b) {
        (Some(a), Some(b)) => Some(pick(a, b)),
        (a, b) => a.or(b),
    };
    let (above, below) = (number("exclusiveMinimum"), number("exclusiveMaximum"));
    let min = stricter(number("minimum"), type_min, f64::max);
    let max = stricter(number("maximum"), type_max, f64::min);
    Range {
        // `minimum = 0` beside `exclusiveMinimum = 0` says nothing more.
        min: min.filter(|&min| above.is_none_or(|above| above < min)),
        max: max.filter(|&max| below.is_none_or(|below| below > max)),
        above,
        below,
    }
}

/// Ends of the Rust type that a `format` names, as far as TOML numbers (64 bit) can exceed them.
fn type_range(keywords: &Keywords) -> (Option<f64>, Option<f64>) {
    let format = keywords.get("format").and_then(Value::as_str).unwrap_or_default();
    match format {
        "uint8" => (Some(0.0), Some(f64::from(u8::MAX))),
        "uint16" => (Some(0.0), Some(f64::from(u16::MAX))),
        "uint32" => (Some(0.0), Some(f64::from(u32::MAX))),
        "uint64" | "uint" | "uint128" => (Some(0.0), None),
        "int8" => (Some(f64::from(i8::MIN)), Some(f64::from(i8::MAX))),
        "int16" => (Some(f64::from(i16::MIN)), Some(f64::from(i16::MAX))),
        "int32" => (Some(f64::from(i32::MIN)), Some(f64::from(i32::MAX))),
        "float" => (Some(f64::from(f32::MIN)), Some(f64::from(f32::MAX))),
        _ => (None, None),
    }
}

impl Range {
    pub(crate) fn contains(&self, number: f64) -> bool {
        self.min.is_none_or(|min| number >= min)
            && self.max.is_none_or(|max| number <= max)
            && self.above.is_none_or(|above| number > above)
            && self.below.is_none_or(|below| number < below)
    }

    /// ` from 0 to 255`, ` greater than 0`; empty where every number of the type is allowed.
    pub(crate) fn words(&self) -> String {
        // The ends of the 32-bit float range tell a reader nothing.
        let told = |end: Option<f64>| end.filter(|end| end.abs() < f64::from(f32::MAX));
        match (told(self.min), told(self.max), self.above, self.below) {
            (Some(min), Some(max), ..) if min == max => format!(", {min} only"),
            (Some(min), Some(max), ..) => format!(" from {min} to {max}"),
            (Some(min), None, _, Some(below)) => format!(" from {min} to less than {below}"),
            (Some(min), ..) => format!(", at least {min}"),
            (None, Some(max), Some(above), _) => format!(" greater than {above}, at most {max}"),
            (None, Some(max), ..) => format!(", at most {max}"),
            (None, None, Some(above), Some(below)) => format!(" greater than {above}, less than {below}"),
            (None, None, Some(above), None) => format!(" greater than {above}"),
            (None, None, None, Some(below)) => format!(" less than {below}"),
            (None, None, None, None) => String::new(),
        }
    }
}
