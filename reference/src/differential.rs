//! Two worlds in one pass: which of them a path exists in, and what it brings to each.
//!
//! T. Grosch et al. and P. Kán and H. Kaufmann (*Differential Irradiance Caching*, 2013) trace every path once and decide
//! for each world whether it counts there. Every path carries two bits:
//!
//! - `in_real`: its light is real, all its vertices lie on real surfaces, nothing real blocks any segment. Virtual things
//!   are not there.
//! - `in_mixed`: nothing blocks any segment, be it real or virtual.
//!
//! What a path brings to both worlds alike is kept apart from what it brings to one of them, so the difference of the
//! worlds is made of the latter alone: exactly zero where nothing virtual has a say, and without cancellation elsewhere.

use coshade_scene::World;
use glam::Vec3;

use crate::accel::Sees;

/// The worlds that a path, or a part of one, exists in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Worlds {
    /// In the real world, as the camera sees it.
    pub in_real: bool,
    /// In the mixed world, with the virtual things in it.
    pub in_mixed: bool,
}

impl Worlds {
    /// Alike in both.
    pub const BOTH: Self = Self { in_real: true, in_mixed: true };
    /// Only without the virtual things.
    pub const REAL: Self = Self { in_real: true, in_mixed: false };
    /// Only with the virtual things.
    pub const MIXED: Self = Self { in_real: false, in_mixed: true };
    /// Dead.
    pub const NONE: Self = Self { in_real: false, in_mixed: false };

    /// Where the light of a lamp, or the reflection of a surface, exists: virtual ones only in the mixed world.
    pub fn of(world: World) -> Self {
        if world.is_real() { Self::BOTH } else { Self::MIXED }
    }

    /// Worlds that have both.
    pub fn and(self, other: Self) -> Self {
        Self { in_real: self.in_real && other.in_real, in_mixed: self.in_mixed && other.in_mixed }
    }

    /// True if the path exists nowhere.
    pub fn is_empty(self) -> bool {
        self == Self::NONE
    }

    /// What rays of this path can hit. A path in both worlds sees everything: where it meets something virtual, its two
    /// halves part.
    pub fn sees(self) -> Sees {
        if self.in_mixed { Sees::Everything } else { Sees::RealOnly }
    }
}

/// Radiance of one camera sample in both worlds.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Split {
    /// In both worlds alike.
    pub shared: Vec3,
    /// In the real world only.
    pub real_only: Vec3,
    /// In the mixed world only.
    pub mixed_only: Vec3,
}

impl Split {
    /// Adds what a path brings to the worlds it exists in.
    pub fn add(&mut self, worlds: Worlds, radiance: Vec3) {
        match (worlds.in_real, worlds.in_mixed) {
            (true, true) => self.shared += radiance,
            (true, false) => self.real_only += radiance,
            (false, true) => self.mixed_only += radiance,
            (false, false) => {}
        }
    }

    /// Of the real world, L_r.
    pub fn real(&self) -> Vec3 {
        self.shared + self.real_only
    }

    /// Of the mixed world, L_rv.
    pub fn mixed(&self) -> Vec3 {
        self.shared + self.mixed_only
    }

    /// Mixed − real.
    pub fn difference(&self) -> Vec3 {
        self.mixed_only - self.real_only
    }

    /// False if anything is infinite or not a number.
    pub fn is_finite(&self) -> bool {
        self.shared.is_finite() && self.real_only.is_finite() && self.mixed_only.is_finite()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// METHODS of the papers: `in_real' = in_real · real`, `in_mixed' = in_mixed`; the sums are those of the two bits.
    #[test]
    fn bits_decide_what_counts_where() {
        let lit = Worlds::BOTH.and(Worlds::of(World::Virtual));
        assert_eq!(lit, Worlds::MIXED);
        assert!(Worlds::REAL.and(lit).is_empty());
        let mut split = Split::default();
        split.add(Worlds::BOTH, Vec3::X);
        split.add(Worlds::REAL, Vec3::Y);
        split.add(Worlds::MIXED, Vec3::Z);
        split.add(Worlds::NONE, Vec3::ONE);
        assert_eq!(split.real(), Vec3::new(1.0, 1.0, 0.0));
        assert_eq!(split.mixed(), Vec3::new(1.0, 0.0, 1.0));
        assert_eq!(split.difference(), Vec3::new(0.0, -1.0, 1.0));
    }

    #[test]
    fn only_paths_of_the_real_world_see_through_virtual_things() {
        assert_eq!(Worlds::BOTH.sees(), Sees::Everything);
        assert_eq!(Worlds::MIXED.sees(), Sees::Everything);
        assert_eq!(Worlds::REAL.sees(), Sees::RealOnly);
    }
}
