//! Absorption inside bodies, and which bodies a path is inside of.

use glam::Vec3;

/// Names a closed body: the thing and the part whose surface bounds it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct BodyId {
    /// Index in the scene's list of things.
    pub thing: u32,
    /// Slot in the thing's list of materials: several parts of one material bound one body.
    pub material: u32,
}

/// What a body is filled with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Medium {
    /// Index of refraction.
    pub ior: f32,
    /// Absorption coefficient α′ per metre, each part ≥ 0, may be infinite.
    pub absorption_per_m: Vec3,
}

impl Medium {
    /// What is outside of everything.
    pub const AIR: Self = Self { ior: 1.0, absorption_per_m: Vec3::ZERO };
}

/// Beer–Lambert: `exp(−α′ d)`; 1 over no distance, also where α′ is infinite.
pub fn transmittance(absorption_per_m: Vec3, distance_m: f32) -> Vec3 {
    absorption_per_m.map(|absorption| {
        if absorption == 0.0 || distance_m <= 0.0 { 1.0 } else { (-absorption * distance_m).exp() }
    })
}

/// The bodies around the end of a path, in the order they were entered.
///
/// The body entered last fills the place: a drop inside a bottle hides the bottle's glass, also where the two bodies
/// overlap a little, as modelled liquids do. Bodies may be left in any order. At an interface the body's own medium is
/// on one side, and on the other the one that would be there without the body ([`Interior::around`]).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Interior {
    bodies: Vec<(BodyId, Medium)>,
}

impl Interior {
    /// In the open air.
    pub fn outside() -> Self {
        Self::default()
    }

    /// What fills the place.
    pub fn medium(&self) -> Medium {
        self.bodies.last().map_or(Medium::AIR, |(_, medium)| *medium)
    }

    /// What would fill the place if `body` were not there: the other side of its surface.
    pub fn around(&self, body: BodyId) -> Medium {
        let others = self.bodies.iter().rev().find(|(id, _)| *id != body);
        others.map_or(Medium::AIR, |(_, medium)| *medium)
    }

    /// True if the path leaves `body` where another one, entered later, fills the place on both sides: its surface is
    /// buried there, and the path goes straight through (but must still [`Interior::cross`]).
    pub fn buries_exit_of(&self, body: BodyId) -> bool {
        let inside = self.bodies.iter().any(|(id, _)| *id == body);
        inside && self.bodies.last().is_some_and(|(id, _)| *id != body)
    }

    /// The path goes through the surface of `body`: into it, or out of it. Leaving a body that was never entered (a
    /// mesh with a hole, a camera inside a body) changes nothing.
    pub fn cross(&mut self, body: BodyId, medium: Medium, entering: bool) {
        if entering {
            self.bodies.push((body, medium));
        } else if let Some(at) = self.bodies.iter().rposition(|(id, _)| *id == body) {
            self.bodies.remove(at);
        }
    }

    /// How many bodies the place is inside of.
    pub fn depth(&self) -> usize {
        self.bodies.len()
    }
}
