//! A flat map of the directions around a tag, in which straight edges are straight whatever the lens.

use coshade_lens::model::CameraModel;
use nalgebra::{Matrix2, Matrix3, Matrix3x2, Vector2, Vector3};

use crate::detection::UNIT_CORNERS;

/// Gnomonic projection about the direction of the tag's middle: the plane that touches the unit sphere there. Without a
/// lens, the image itself. Scaled so that the tag reaches to about ±1.
#[derive(Clone, Debug)]
pub(super) struct Chart<'a> {
    kind: Kind<'a>,
    scale: f64,
}

#[derive(Clone, Debug)]
enum Kind<'a> {
    Image { center_px: Vector2<f64> },
    Lens { lens: &'a CameraModel, camera_from_chart: Matrix3<f64> },
}

/// A place of the chart in the image.
pub(super) struct InImage {
    pub(super) px: Vector2<f64>,
    /// ∂px/∂place.
    pub(super) by_place: Matrix2<f64>,
}

impl<'a> Chart<'a> {
    /// `None` if a corner is not in the lens' field of view, or all lie in one place.
    pub(super) fn around(lens: Option<&'a CameraModel>, corners_px: &[Vector2<f64>; 4]) -> Option<Self> {
        let center_px = corners_px.iter().sum::<Vector2<f64>>() / 4.0;
        let kind = match lens {
            None => Kind::Image { center_px },
            Some(lens) => {
                let rays: Option<Vec<_>> = corners_px.iter().map(|px| lens.unproject(px)).collect();
                let axis = rays?.iter().sum::<Vector3<f64>>().try_normalize(1e-6)?;
                Kind::Lens { lens, camera_from_chart: frame_of(axis) }
            }
        };
        let mut chart = Self { kind, scale: 1.0 };
        let mut reach = 0.0_f64;
        for px in corners_px {
            reach = reach.max(chart.place(px)?.norm());
        }
        chart.scale = (reach.is_finite() && reach > 1e-9).then(|| 1.0 / reach)?;
        Some(chart)
    }

    /// Where a pixel is on the chart.
    pub(super) fn place(&self, px: &Vector2<f64>) -> Option<Vector2<f64>> {
        match &self.kind {
            Kind::Image { center_px } => Some((px - center_px) * self.scale),
            Kind::Lens { lens, camera_from_chart } => {
                let ray = camera_from_chart.tr_mul(&lens.unproject(px)?);
                (ray.z > 0.05).then(|| ray.xy() * (self.scale / ray.z))
            }
        }
    }

    /// ∂place/∂px at a pixel.
    pub(super) fn by_px(&self, px: &Vector2<f64>) -> Option<Matrix2<f64>> {
        self.in_image(&self.place(px)?)?.by_place.try_inverse()
    }

    /// Where a place of the chart is in the image.
    pub(super) fn in_image(&self, place: &Vector2<f64>) -> Option<InImage> {
        match &self.kind {
            Kind::Image { center_px } => Some(InImage {
                px: place / self.scale + center_px,
                by_place: Matrix2::identity() / self.scale,
            }),
            Kind::Lens { lens, camera_from_chart } => {
                let ray = camera_from_chart * (place / self.scale).push(1.0);
                let projected = lens.project_jacobian(&ray)?;
                let plane: Matrix3x2<f64> = camera_from_chart.fixed_columns::<2>(0) / self.scale;
                Some(InImage { px: projected.px, by_place: projected.d_px_d_point * plane })
            }
        }
    }
}

/// A right-handed frame whose z is `axis`.
fn frame_of(axis: Vector3<f64>) -> Matrix3<f64> {
    let side = if axis.x.abs() < 0.9 { Vector3::x() } else { Vector3::y() };
    let x = (side - axis * axis.dot(&side)).normalize();
    Matrix3::from_columns(&[x, axis.cross(&x), axis])
}

/// The homography `b_from_a` through four pairs of points, `None` where there is none; its lower right entry is 1.
pub(super) fn homography(a: &[Vector2<f64>; 4], b: &[Vector2<f64>; 4]) -> Option<Matrix3<f64>> {
    let mut rows = nalgebra::SMatrix::<f64, 8, 8>::zeros();
    let mut right = nalgebra::SVector::<f64, 8>::zeros();
    for (pair, (from, to)) in a.iter().zip(b).enumerate() {
        let (x, y) = (from.x, from.y);
        rows.row_mut(2 * pair).copy_from_slice(&[x, y, 1.0, 0.0, 0.0, 0.0, -to.x * x, -to.x * y]);
        rows.row_mut(2 * pair + 1).copy_from_slice(&[0.0, 0.0, 0.0, x, y, 1.0, -to.y * x, -to.y * y]);
        right[2 * pair] = to.x;
        right[2 * pair + 1] = to.y;
    }
    let h = rows.lu().solve(&right)?;
    let [h0, h1, h2, h3, h4, h5, h6, h7] = h.into();
    let homography = Matrix3::new(h0, h1, h2, h3, h4, h5, h6, h7, 1.0);
    homography.iter().all(|entry| entry.is_finite()).then_some(homography)
}

/// Whether four corners, in the order of [`UNIT_CORNERS`], are those of a tag seen from its front: convex, and turning
/// the way that the camera sees them.
pub(super) fn is_front(corners: &[Vector2<f64>; 4]) -> bool {
    let turn = |i: usize| {
        let at = |i: usize| corners.get(i % UNIT_CORNERS.len()).copied().unwrap_or_default();
        (at(i + 1) - at(i)).perp(&(at(i + 2) - at(i + 1)))
    };
    // In the image y points down: counter-clockwise on the tag is a left turn on the print, a negative product here.
    (0..4).all(|i| turn(i) < -1e-9)
}
