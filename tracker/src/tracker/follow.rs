//! Where tags should be in the next image.

use std::time::Duration;

use coshade_capture::Timestamp;
use coshade_lens::model::CameraModel;
use nalgebra::{Isometry3, Vector2};

use super::{TrackedTag, Tracking};
use crate::body::Body;
use crate::detection::{TagId, TagObservation};
use crate::luma::Luma;

/// Tags seen flatter than this are not looked for: the cosine of 80° between the print's normal and the line of sight.
const MIN_FACING: f64 = 0.17;
/// Tags smaller than this are not looked for.
const MIN_SIDE_PX: f64 = 10.0;

/// A tag and where it should be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Expectation {
    pub(super) tag: TagId,
    pub(super) corners_px: [Vector2<f64>; 4],
}

/// A tag that was seen, and how it moved.
#[derive(Clone, Copy, Debug)]
pub(super) struct Trail {
    tag: TagId,
    seen: Timestamp,
    corners_px: [Vector2<f64>; 4],
    /// Of each corner, in px a nanosecond.
    velocity: [Vector2<f64>; 4],
}

impl Expectation {
    /// Whether both are of the same tag in the same place.
    pub(super) fn may_be(&self, other: &Self) -> bool {
        self.tag == other.tag && is_same_place(&self.corners_px, &other.corners_px)
    }
}

impl Trail {
    pub(super) fn new(tag: TagId, seen: Timestamp, corners_px: [Vector2<f64>; 4]) -> Self {
        Self { tag, seen, corners_px, velocity: [Vector2::zeros(); 4] }
    }

    /// The same tag, seen again.
    pub(super) fn advance(&mut self, seen: Timestamp, corners_px: [Vector2<f64>; 4]) {
        let elapsed_ns = seen.signed_ns_since(self.seen) as f64;
        let mut velocity = [Vector2::zeros(); 4];
        if elapsed_ns > 0.0 {
            for (velocity, (new, old)) in velocity.iter_mut().zip(corners_px.iter().zip(&self.corners_px)) {
                *velocity = (new - old) / elapsed_ns;
            }
        }
        *self = Self { tag: self.tag, seen, corners_px, velocity };
    }

    /// Whether it was seen within a time before `now`.
    pub(super) fn was_in(&self, now: Timestamp, time: Duration) -> bool {
        (0..=time.as_nanos() as i64).contains(&now.signed_ns_since(self.seen))
    }

    /// Whether it should be in view if it went on as it did, or stayed where it was: if not, it has left.
    pub(super) fn should_be_in(&self, image: &Luma, now: Timestamp) -> bool {
        let last = Vector2::new(f64::from(image.width_px()), f64::from(image.height_px()));
        let inside = |px: &Vector2<f64>| px.x > 0.0 && px.y > 0.0 && px.x < last.x && px.y < last.y;
        self.corners_px.iter().all(inside) && self.expect(now).corners_px.iter().all(inside)
    }

    /// Whether something seen at `corners_px` may be this tag.
    pub(super) fn may_be(&self, tag: TagId, corners_px: &[Vector2<f64>; 4]) -> bool {
        self.tag == tag && is_same_place(&self.corners_px, corners_px)
    }

    pub(super) fn tag(&self) -> TagId {
        self.tag
    }

    /// Where it should be if it went on as it did.
    pub(super) fn expect(&self, now: Timestamp) -> Expectation {
        let elapsed_ns = now.signed_ns_since(self.seen) as f64;
        let mut corners_px = self.corners_px;
        for (corner, velocity) in corners_px.iter_mut().zip(&self.velocity) {
            *corner += velocity * elapsed_ns;
        }
        Expectation { tag: self.tag, corners_px }
    }
}

/// How far tags that were found strayed from where they were expected: mostly because the camera turned otherwise than
/// foreseen, which moves neighbours alike.
pub(super) struct Strays(Vec<(Vector2<f64>, Vector2<f64>)>);

impl Strays {
    pub(super) fn new(expected: &[Expectation], tracking: &Tracking) -> Self {
        let stray = |found: &TrackedTag| {
            let TagObservation { tag, corners_px, .. } = &found.observation;
            let expected = expected.iter().find(|expected| expected.tag == *tag)?;
            Some((middle(corners_px), middle(corners_px) - middle(&expected.corners_px)))
        };
        Self(tracking.tags.iter().filter_map(stray).collect())
    }

    /// Where a tag should be after all, by the nearest one that was found.
    pub(super) fn correct(&self, expected: &Expectation) -> Option<Expectation> {
        let here = middle(&expected.corners_px);
        let distance = |stray: &&(Vector2<f64>, Vector2<f64>)| (stray.0 - here).norm();
        let (_, stray) = self.0.iter().min_by(|a, b| distance(a).total_cmp(&distance(b)))?;
        Some(Expectation { corners_px: expected.corners_px.map(|corner| corner + stray), ..*expected })
    }
}

fn middle(corners: &[Vector2<f64>; 4]) -> Vector2<f64> {
    corners.iter().sum::<Vector2<f64>>() / 4.0
}

/// Whether the middles of two outlines are nearer to each other than their sides are long.
pub(super) fn is_same_place(a: &[Vector2<f64>; 4], b: &[Vector2<f64>; 4]) -> bool {
    (middle(a) - middle(b)).norm() < side_px(a).max(side_px(b))
}

/// Root of an outline's area.
pub(super) fn side_px([a, b, c, d]: &[Vector2<f64>; 4]) -> f64 {
    (0.5 * (c - a).perp(&(d - b)).abs()).sqrt()
}

/// The tags of a body that should be in view, were it at a pose.
pub(super) fn expected_tags(
    lens: &CameraModel,
    image: &Luma,
    body: &Body,
    camera_from_body: &Isometry3<f64>,
) -> Vec<Expectation> {
    let size_px = [f64::from(image.width_px()), f64::from(image.height_px())];
    let in_image = |px: &Vector2<f64>| (0.0..size_px[0]).contains(&px.x) && (0.0..size_px[1]).contains(&px.y);
    let expectation = |tag: &crate::body::BodyTag| {
        let camera_from_tag = camera_from_body * tag.body_from_tag;
        let (normal, place) =
            (camera_from_tag.rotation * nalgebra::Vector3::z(), camera_from_tag.translation.vector);
        if -normal.dot(&place) < MIN_FACING * place.norm() {
            return None;
        }
        let mut corners_px = [Vector2::zeros(); 4];
        for (px, corner) in corners_px.iter_mut().zip(tag.corners_m()) {
            *px = lens.project(&(camera_from_body * corner).coords)?;
        }
        let visible = corners_px.iter().all(in_image) && side_px(&corners_px) >= MIN_SIDE_PX;
        visible.then_some(Expectation { tag: tag.tag, corners_px })
    };
    body.tags.iter().filter_map(expectation).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::family::Family;

    const TAG: TagId = TagId { family: Family::Tag36h11, id: 5 };

    fn square(x: f64, y: f64) -> [Vector2<f64>; 4] {
        [[0.0, 20.0], [20.0, 20.0], [20.0, 0.0], [0.0, 0.0]].map(|[dx, dy]| Vector2::new(x + dx, y + dy))
    }

    #[test]
    fn a_steady_tag_is_expected_where_it_will_be() {
        let at = |ms: u64| Timestamp::from_ns(1_000_000_000 + ms * 1_000_000);
        let mut trail = Trail::new(TAG, at(0), square(10.0, 10.0));
        trail.advance(at(30), square(13.0, 9.0));
        let expected = trail.expect(at(90)).corners_px;
        for (found, wanted) in expected.iter().zip(square(19.0, 7.0)) {
            assert!((found - wanted).norm() < 1e-9);
        }
        assert!(trail.may_be(TAG, &square(20.0, 15.0)) && !trail.may_be(TAG, &square(60.0, 10.0)));
        let half = Duration::from_millis(500);
        assert!(trail.was_in(at(500), half) && !trail.was_in(at(600), half));
        // A stamp that goes back is no reason for a guess.
        trail.advance(at(10), square(0.0, 0.0));
        assert_eq!(trail.expect(at(50)).corners_px, square(0.0, 0.0));
    }

    #[test]
    fn only_what_faces_the_camera_within_the_image_is_expected() {
        let lens =
            CameraModel::from_params(coshade_lens::model::ModelKind::Pinhole, &[300.0, 300.0, 159.5, 119.5])
                .unwrap();
        let pixels = vec![0; 320 * 240];
        let image = Luma::new(&pixels, 320, 240, 320).unwrap();
        let body = Body::single(TAG, 0.1);
        let turned = |angle: f64, x: f64| {
            let facing = nalgebra::UnitQuaternion::from_euler_angles(std::f64::consts::PI, angle, 0.0);
            Isometry3::from_parts(nalgebra::Translation3::new(x, 0.0, 1.0), facing)
        };
        assert_eq!(expected_tags(&lens, &image, &body, &turned(0.3, 0.0)).len(), 1);
        assert!(expected_tags(&lens, &image, &body, &turned(3.1, 0.0)).is_empty(), "from behind");
        assert!(expected_tags(&lens, &image, &body, &turned(1.5, 0.0)).is_empty(), "edge-on");
        assert!(expected_tags(&lens, &image, &body, &turned(0.0, 0.52)).is_empty(), "at the border");
    }
}
