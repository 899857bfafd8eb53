//! AprilTag families and how many tags each has.

/// Names and numbers of tags (`ncodes`) of the families that the AprilTag 3 library brings along.
pub const FAMILIES: [(&str, u32); 8] = [
    ("tag16h5", 30),
    ("tag25h9", 35),
    ("tag36h11", 587),
    ("tagCircle21h7", 38),
    ("tagCircle49h12", 65535),
    ("tagCustom48h12", 42211),
    ("tagStandard41h12", 2115),
    ("tagStandard52h13", 48714),
];

/// How many tags a family has, numbered from 0; `None` for an unknown family.
pub fn tags_of(family: &str) -> Option<u32> {
    FAMILIES.iter().find(|(name, _)| *name == family).map(|&(_, count)| count)
}
