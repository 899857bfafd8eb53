//! The tag families that the AprilTag 3 library brings along.

use std::fmt;
use std::ptr::NonNull;
use std::str::FromStr;

use apriltag_sys as c;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A set of tags that are told apart from each other. The name says how many bits a tag has, and by how many bits two
/// tags differ at least (Olson, *AprilTag: A robust and flexible visual fiducial system*, ICRA 2011; Krogius, Haggenmiller,
/// Olson, *Flexible Layouts for Fiducial Tags*, IROS 2019).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
pub enum Family {
    /// 30 tags.
    #[serde(rename = "tag16h5")]
    Tag16h5,
    /// 35 tags.
    #[serde(rename = "tag25h9")]
    Tag25h9,
    /// 587 tags; the usual choice.
    #[serde(rename = "tag36h11")]
    Tag36h11,
    /// 38 round tags.
    #[serde(rename = "tagCircle21h7")]
    Circle21h7,
    /// 65535 round tags.
    #[serde(rename = "tagCircle49h12")]
    Circle49h12,
    /// 42211 tags with an empty middle.
    #[serde(rename = "tagCustom48h12")]
    Custom48h12,
    /// 2115 tags, bits also outside of the border.
    #[serde(rename = "tagStandard41h12")]
    Standard41h12,
    /// 48714 tags, bits also outside of the border.
    #[serde(rename = "tagStandard52h13")]
    Standard52h13,
}

/// A family that does not exist.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("unknown tag family `{name}`{}", match nearest { Some(near) => format!("; did you mean `{near}`?"), None => format!("; known: {}", Family::ALL.map(Family::name).join(", ")) })]
pub struct UnknownFamily {
    /// What was asked for.
    pub name: String,
    /// A family of a similar name.
    pub nearest: Option<&'static str>,
}

impl Family {
    /// All of them, by name.
    pub const ALL: [Self; 8] = [
        Self::Tag16h5,
        Self::Tag25h9,
        Self::Tag36h11,
        Self::Circle21h7,
        Self::Circle49h12,
        Self::Custom48h12,
        Self::Standard41h12,
        Self::Standard52h13,
    ];

    /// The library's name, such as `tag36h11`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Tag16h5 => "tag16h5",
            Self::Tag25h9 => "tag25h9",
            Self::Tag36h11 => "tag36h11",
            Self::Circle21h7 => "tagCircle21h7",
            Self::Circle49h12 => "tagCircle49h12",
            Self::Custom48h12 => "tagCustom48h12",
            Self::Standard41h12 => "tagStandard41h12",
            Self::Standard52h13 => "tagStandard52h13",
        }
    }

    /// How many tags it has, numbered from 0.
    pub const fn tag_count(self) -> u32 {
        match self {
            Self::Tag16h5 => 30,
            Self::Tag25h9 => 35,
            Self::Tag36h11 => 587,
            Self::Circle21h7 => 38,
            Self::Circle49h12 => 65535,
            Self::Custom48h12 => 42211,
            Self::Standard41h12 => 2115,
            Self::Standard52h13 => 48714,
        }
    }
}

impl fmt::Display for Family {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Family {
    type Err = UnknownFamily;

    fn from_str(name: &str) -> Result<Self, UnknownFamily> {
        let unknown = || UnknownFamily {
            name: name.to_owned(),
            nearest: coshade_config::nearest(name, Self::ALL.map(Self::name)),
        };
        Self::ALL.into_iter().find(|family| family.name() == name).ok_or_else(unknown)
    }
}

/// The library's description of a family; freed on drop.
pub(crate) struct Table {
    family: Family,
    pointer: NonNull<c::apriltag_family_t>,
}

impl Table {
    /// `None` if the library has no memory.
    pub(crate) fn new(family: Family) -> Option<Self> {
        // SAFETY: these functions take nothing and allocate a table, which only this value knows of.
        let pointer = unsafe {
            match family {
                Family::Tag16h5 => c::tag16h5_create(),
                Family::Tag25h9 => c::tag25h9_create(),
                Family::Tag36h11 => c::tag36h11_create(),
                Family::Circle21h7 => c::tagCircle21h7_create(),
                Family::Circle49h12 => c::tagCircle49h12_create(),
                Family::Custom48h12 => c::tagCustom48h12_create(),
                Family::Standard41h12 => c::tagStandard41h12_create(),
                Family::Standard52h13 => c::tagStandard52h13_create(),
            }
        };
        NonNull::new(pointer).map(|pointer| Self { family, pointer })
    }

    pub(crate) fn pointer(&self) -> *mut c::apriltag_family_t {
        self.pointer.as_ptr()
    }

    pub(crate) fn get(&self) -> &c::apriltag_family_t {
        // SAFETY: the table lives until drop, and nothing changes it.
        unsafe { self.pointer.as_ref() }
    }
}

impl Drop for Table {
    fn drop(&mut self) {
        // SAFETY: made by the `create` function of the same name, and freed once.
        unsafe {
            let pointer = self.pointer.as_ptr();
            match self.family {
                Family::Tag16h5 => c::tag16h5_destroy(pointer),
                Family::Tag25h9 => c::tag25h9_destroy(pointer),
                Family::Tag36h11 => c::tag36h11_destroy(pointer),
                Family::Circle21h7 => c::tagCircle21h7_destroy(pointer),
                Family::Circle49h12 => c::tagCircle49h12_destroy(pointer),
                Family::Custom48h12 => c::tagCustom48h12_destroy(pointer),
                Family::Standard41h12 => c::tagStandard41h12_destroy(pointer),
                Family::Standard52h13 => c::tagStandard52h13_destroy(pointer),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_and_names_are_the_librarys() {
        for family in Family::ALL {
            let table = Table::new(family).unwrap();
            assert_eq!(table.get().ncodes, family.tag_count(), "{family}");
            // SAFETY: the library's names end with a zero byte and live as long as the table.
            let name = unsafe { std::ffi::CStr::from_ptr(table.get().name) };
            assert_eq!(name.to_str().unwrap(), family.name());
            assert_eq!(family.name().parse(), Ok(family));
        }
        let error = "tag36h12".parse::<Family>().unwrap_err();
        assert_eq!(error.to_string(), "unknown tag family `tag36h12`; did you mean `tag36h11`?");
    }

    #[test]
    fn there_is_one_apriltag_library() {
        // Bindings of one version with the code of another build and link without a word.
        let lock = include_str!("../../Cargo.lock");
        assert_eq!(lock.matches("name = \"apriltag").count(), 1);
    }
}
