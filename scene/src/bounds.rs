//! Boxes and spheres around things.

use glam::Vec3;

use crate::pose::Similarity;

/// An axis-aligned box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aabb {
    /// Smallest coordinates.
    pub min: Vec3,
    /// Largest coordinates.
    pub max: Vec3,
}

impl Aabb {
    /// Around points, leaving out those that are not finite; `None` if none is left.
    pub fn around(points: impl IntoIterator<Item = Vec3>) -> Option<Self> {
        let finite = points.into_iter().filter(|point| point.is_finite());
        finite.map(|point| Self { min: point, max: point }).reduce(Self::union)
    }

    /// Around both.
    pub fn union(self, other: Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// Middle.
    pub fn center(&self) -> Vec3 {
        self.min.midpoint(self.max)
    }

    /// Lengths of the edges.
    pub fn size(&self) -> Vec3 {
        self.max - self.min
    }

    /// The box around this box after a transform. May be looser than the box around the transformed mesh.
    pub fn transformed(&self, a_from_b: &Similarity) -> Self {
        let corner = |i: u32| {
            let pick = |bit: u32, low: f32, high: f32| if i >> bit & 1 == 0 { low } else { high };
            let (min, max) = (self.min, self.max);
            Vec3::new(pick(0, min.x, max.x), pick(1, min.y, max.y), pick(2, min.z, max.z))
        };
        let first = a_from_b.transform_point(corner(0));
        (1..8)
            .map(|i| a_from_b.transform_point(corner(i)))
            .fold(Self { min: first, max: first }, |aabb, point| aabb.union(Self { min: point, max: point }))
    }
}

/// A ball.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sphere {
    /// Middle.
    pub center: Vec3,
    /// Never negative.
    pub radius: f32,
}

impl Sphere {
    /// Around points by Ritter's method (Graphics Gems 1990), up to about 20% larger than the smallest possible.
    /// Points that are not finite are left out; `None` if none is left.
    pub fn around(points: &[Vec3]) -> Option<Self> {
        let finite = || points.iter().copied().filter(|point| point.is_finite());
        let farthest = |from: Vec3| {
            finite().max_by(|a, b| a.distance_squared(from).total_cmp(&b.distance_squared(from)))
        };
        let first = finite().next()?;
        let one = farthest(first)?;
        let other = farthest(one)?;
        let start = Self { center: one.midpoint(other), radius: one.distance(other) / 2.0 };
        Some(finite().fold(start, Self::grown_to).with_margin())
    }

    fn grown_to(self, point: Vec3) -> Self {
        let distance = point.distance(self.center);
        if distance <= self.radius {
            return self;
        }
        let radius = (self.radius + distance) / 2.0;
        Self { center: self.center + (point - self.center) * ((radius - self.radius) / distance), radius }
    }

    /// Rounding must not leave a point outside.
    fn with_margin(self) -> Self {
        let ulps = 8.0 * f32::EPSILON * (self.radius + self.center.abs().max_element());
        Self { radius: self.radius + ulps, ..self }
    }

    /// After a transform.
    pub fn transformed(&self, a_from_b: &Similarity) -> Self {
        Self { center: a_from_b.transform_point(self.center), radius: self.radius * a_from_b.scale }
    }
}
