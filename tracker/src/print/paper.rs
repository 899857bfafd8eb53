//! Sizes of paper.

use std::fmt;
use std::str::FromStr;

/// Sizes by name, width × height in millimetres (ISO 216, ANSI/ASME Y14.1).
const NAMED: [(&str, [f64; 2]); 9] = [
    ("a0", [841.0, 1189.0]),
    ("a1", [594.0, 841.0]),
    ("a2", [420.0, 594.0]),
    ("a3", [297.0, 420.0]),
    ("a4", [210.0, 297.0]),
    ("a5", [148.0, 210.0]),
    ("letter", [215.9, 279.4]),
    ("legal", [215.9, 355.6]),
    ("tabloid", [279.4, 431.8]),
];
/// The shortest and longest side, millimetres.
pub(super) const SIDES_MM: std::ops::RangeInclusive<f64> = 20.0..=5000.0;

/// What is printed on.
#[derive(Clone, Debug, PartialEq)]
pub enum Paper {
    /// A sheet: what it is called, its width and height in millimetres.
    Sheet {
        /// Such as `a4`.
        name: String,
        /// As it is turned.
        size_mm: [f64; 2],
    },
    /// As large as what is printed.
    Fit,
}

/// Text that names no paper.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error(
    "no paper is called `{name}`: a0 to a5, letter, legal, tabloid, fit (as large as the board), or WIDTHxHEIGHT in \
     millimetres, 20 to 5000 each"
)]
pub struct PaperError {
    /// What was asked for.
    pub name: String,
}

impl Paper {
    /// With its longer side level.
    pub fn landscape(self) -> Self {
        match self {
            Self::Sheet { name, size_mm: [width, height] } => {
                Self::Sheet { name, size_mm: [width.max(height), width.min(height)] }
            }
            Self::Fit => Self::Fit,
        }
    }

    /// The named papers of the same system (ISO, or American where this is), from the smallest, upright.
    pub(super) fn alternatives(&self) -> Vec<Self> {
        let is_iso = |name: &str| name.starts_with('a');
        let american = NAMED.iter().any(|(name, _)| *name == self.to_string() && !is_iso(name));
        let mut named: Vec<Self> = NAMED
            .iter()
            .filter(|(name, _)| is_iso(name) != american)
            .map(|(name, size_mm)| Self::Sheet { name: (*name).to_owned(), size_mm: *size_mm })
            .collect();
        named.sort_by(|a, b| a.area_mm2().total_cmp(&b.area_mm2()));
        named
    }

    fn area_mm2(&self) -> f64 {
        match self {
            Self::Sheet { size_mm: [width, height], .. } => width * height,
            Self::Fit => 0.0,
        }
    }
}

impl fmt::Display for Paper {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Sheet { name, .. } => f.write_str(name),
            Self::Fit => f.write_str("fit"),
        }
    }
}

impl FromStr for Paper {
    type Err = PaperError;

    fn from_str(name: &str) -> Result<Self, PaperError> {
        let lower = name.to_ascii_lowercase();
        if lower == "fit" {
            return Ok(Self::Fit);
        }
        let unknown = || PaperError { name: name.to_owned() };
        if let Some((_, size_mm)) = NAMED.iter().find(|(known, _)| *known == lower) {
            return Ok(Self::Sheet { name: lower, size_mm: *size_mm });
        }
        let (width, height) = lower.split_once(['x', '×']).ok_or_else(unknown)?;
        let side = |text: &str| {
            let side: f64 = text.trim().parse().ok()?;
            SIDES_MM.contains(&side).then_some(side)
        };
        let size_mm = [side(width).ok_or_else(unknown)?, side(height).ok_or_else(unknown)?];
        Ok(Self::Sheet { name: format!("{} × {} mm", size_mm[0], size_mm[1]), size_mm })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn papers_have_their_sizes() {
        let size = |name: &str| match name.parse::<Paper>().unwrap().landscape() {
            Paper::Sheet { size_mm, .. } => size_mm,
            Paper::Fit => [0.0; 2],
        };
        assert_eq!(size("A4"), [297.0, 210.0]);
        assert_eq!(size("120x80.5"), [120.0, 80.5]);
        assert_eq!(size("80x120"), [120.0, 80.0]);
        assert_eq!("fit".parse::<Paper>().unwrap(), Paper::Fit);
        for name in ["a6", "", "x", "100x", "nanx100", "10x10", "infx50", "100x100x100"] {
            let error = name.parse::<Paper>().unwrap_err().to_string();
            assert!(error.contains(&format!("`{name}`")), "{error}");
        }
    }
}
