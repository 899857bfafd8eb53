//! Radial and tangential distortion of a pinhole image: the common core of [`BrownConrady5`](super::BrownConrady5)
//! (denominator 1) and [`Rational8`](super::Rational8).
//!
//! With x = (x, y)/z, s = |x|², g(s) = N(s)/M(s) and q = (p2, p1), the distorted point is
//!
//! ```text
//! D(x) = g(s) x + s q + 2 (q·x) x
//! ```
//!
//! which is OpenCV's `x g + 2 p1 x y + p2 (s + 2x²)`, `y g + p1 (s + 2y²) + 2 p2 x y`.
//!
//! # The valid cone
//!
//! D is a gradient field: its Jacobian is symmetric. In the basis (along x, across) with r = |x|, h(r) = r g(r²) and
//! q = (q_r, q_t) it reads `[[h' + 6 r q_r, 2 r q_t], [2 r q_t, g + 2 r q_r]]`. If it is positive definite all over a
//! disc (which is convex), D is strictly monotone there, so no two points of the disc share an image. Minimising
//! the determinant over the direction of q shows that
//!
//! ```text
//! h'(r) > 6 r |q|   and   g(r²) > 10/3 r |q|
//! ```
//!
//! suffice. The first is also necessary: in the direction opposite to q the image turns back where it fails. (The
//! second can only bind first within a factor 10/9 of the first, since g is the mean of h' over [0, r].) Written as
//! N M > 10/3 r |q| M², the second also ends the disc at the first pole. So **the cone is the largest disc r < r_max
//! in which both hold** with the margin of `MIN_SLOPE`; it ends at the radial function's first turning point or pole,
//! or before it where tangential terms tilt the image over. Points further off the axis are not projected although
//! the formula gives numbers: those pixels belong to other rays.

use nalgebra::{Matrix2, Vector2};

use super::polynomial::{self as poly, MIN_SLOPE, Polynomial};
use super::projection::ParamJacobian;
use super::root::increasing_root;

/// Beyond tan(angle) = 10⁸ a point is treated as lying at 90°, where a pinhole image ends.
const MAX_TAN: f64 = 1e8;

/// Coefficients of D and the radius of the disc in which it is one-to-one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RadialTangential {
    /// Coefficients of s, s², s³ in the numerator N (k1, k2, k3).
    numerator: [f64; 3],
    /// Coefficients of s, s², s³ in the denominator M (k4, k5, k6).
    denominator: [f64; 3],
    /// (p2, p1)
    q: Vector2<f64>,
    /// tan of the largest valid angle.
    max_radius: f64,
    /// No point of the disc has an image further from the centre.
    max_image_radius: f64,
}

/// g(s) and the values that its derivatives need.
struct Radial {
    g: f64,
    dg_ds: f64,
    inv_denominator: f64,
}

impl RadialTangential {
    /// From k1 k2 k3, k4 k5 k6 and p1 p2, all finite.
    pub fn new(numerator: [f64; 3], denominator: [f64; 3], p: [f64; 2]) -> Self {
        let q = Vector2::new(p[1], p[0]);
        let max_radius = max_radius(&with_one(numerator), &with_one(denominator), q.norm());
        let mut this = Self { numerator, denominator, q, max_radius, max_image_radius: 0.0 };
        // |s q + 2 (q·x) x| ≤ 3 s |q|
        this.max_image_radius = this.image_radius(max_radius).0 + 3.0 * max_radius * max_radius * q.norm();
        this
    }

    /// The angle at the edge of the disc, in radians.
    pub fn max_angle_rad(&self) -> f64 {
        self.max_radius.atan()
    }

    /// k1, k2, p1, p2, k3, k4, k5, k6: OpenCV's order.
    pub fn coefficients(&self) -> [f64; 8] {
        let ([k1, k2, k3], [k4, k5, k6]) = (self.numerator, self.denominator);
        [k1, k2, self.q.y, self.q.x, k3, k4, k5, k6]
    }

    /// D(x), `None` outside the disc.
    pub fn distort(&self, x: &Vector2<f64>) -> Option<Vector2<f64>> {
        self.is_inside(x).then(|| self.image(x))
    }

    /// D(x), ∂D/∂x and ∂D/∂(k1, k2, p1, p2, k3, k4, k5, k6), `None` outside the disc.
    pub fn distort_jacobian(
        &self,
        x: &Vector2<f64>,
    ) -> Option<(Vector2<f64>, Matrix2<f64>, ParamJacobian<2>)> {
        self.is_inside(x).then(|| {
            let (image, d_x) = self.image_and_slope(x);
            (image, d_x, self.d_coefficients(x))
        })
    }

    /// The only x of the disc with D(x) = `image`, as far as found; `None` if there is none.
    pub fn undistort(&self, image: &Vector2<f64>) -> Option<Vector2<f64>> {
        let image_radius = image.norm();
        if image_radius.is_nan() || image_radius > self.max_image_radius {
            return None;
        }
        let radius = increasing_root(|r| self.image_radius(r), image_radius, self.max_radius, image_radius)?;
        if radius == 0.0 || image_radius == 0.0 {
            return Some(*image);
        }
        let start = image * (radius / image_radius);
        if self.q == Vector2::zeros() { Some(start) } else { self.refine(image, start) }
    }

    fn is_inside(&self, x: &Vector2<f64>) -> bool {
        x.norm_squared() < self.max_radius * self.max_radius
    }

    fn radial(&self, s: f64) -> Radial {
        let ([k1, k2, k3], [k4, k5, k6]) = (self.numerator, self.denominator);
        let n = 1.0 + s * (k1 + s * (k2 + s * k3));
        let m = 1.0 + s * (k4 + s * (k5 + s * k6));
        let dn = k1 + s * (2.0 * k2 + 3.0 * s * k3);
        let dm = k4 + s * (2.0 * k5 + 3.0 * s * k6);
        let inv_denominator = 1.0 / m;
        let g = n * inv_denominator;
        Radial { g, dg_ds: (dn - g * dm) * inv_denominator, inv_denominator }
    }

    /// h(r) = r g(r²) and its slope.
    fn image_radius(&self, r: f64) -> (f64, f64) {
        let radial = self.radial(r * r);
        (r * radial.g, radial.g + 2.0 * r * r * radial.dg_ds)
    }

    fn image(&self, x: &Vector2<f64>) -> Vector2<f64> {
        let s = x.norm_squared();
        x * (self.radial(s).g + 2.0 * self.q.dot(x)) + self.q * s
    }

    fn image_and_slope(&self, x: &Vector2<f64>) -> (Vector2<f64>, Matrix2<f64>) {
        let s = x.norm_squared();
        let radial = self.radial(s);
        let scale = radial.g + 2.0 * self.q.dot(x);
        let mixed = self.q * x.transpose();
        let slope = Matrix2::identity() * scale
            + x * x.transpose() * (2.0 * radial.dg_ds)
            + (mixed + mixed.transpose()) * 2.0;
        (x * scale + self.q * s, slope)
    }

    fn d_coefficients(&self, x: &Vector2<f64>) -> ParamJacobian<2> {
        let s = x.norm_squared();
        let radial = self.radial(s);
        let by_numerator = x * (s * radial.inv_denominator);
        let by_denominator = by_numerator * -radial.g;
        let by_p1 = Vector2::new(2.0 * x.x * x.y, s + 2.0 * x.y * x.y);
        let by_p2 = Vector2::new(s + 2.0 * x.x * x.x, 2.0 * x.x * x.y);
        let mut out = ParamJacobian::zeros();
        let columns = [
            by_numerator,
            by_numerator * s,
            by_p1,
            by_p2,
            by_numerator * (s * s),
            by_denominator,
            by_denominator * s,
            by_denominator * (s * s),
        ];
        for (i, column) in columns.iter().enumerate() {
            out.set_column(i, column);
        }
        out
    }

    /// Newton's method with step halving on |D(x) − image|, inside the disc. D's Jacobian is positive definite
    /// there, so every step can reduce the residual, and there is only one x to find.
    fn refine(&self, image: &Vector2<f64>, start: Vector2<f64>) -> Option<Vector2<f64>> {
        const MAX_STEPS: usize = 50;
        let mut x = start;
        let (mut value, mut slope) = self.image_and_slope(&x);
        for _ in 0..MAX_STEPS {
            let residual = value - image;
            let step = slope.try_inverse()? * residual;
            if step.norm() <= 2.0 * f64::EPSILON * x.norm() {
                return Some(x);
            }
            let Some(next) = self.shorter_residual(&x, &step, image, residual.norm()) else {
                return Some(x);
            };
            x = next;
            (value, slope) = self.image_and_slope(&x);
        }
        Some(x)
    }

    /// The first of x − step, x − step/2, … (pulled back into the disc) that comes closer to the image.
    fn shorter_residual(
        &self,
        x: &Vector2<f64>,
        step: &Vector2<f64>,
        image: &Vector2<f64>,
        residual: f64,
    ) -> Option<Vector2<f64>> {
        const MAX_HALVINGS: i32 = 12;
        (0..MAX_HALVINGS).find_map(|halvings| {
            let mut next = x - step * 0.5f64.powi(halvings);
            let radius = next.norm();
            if radius > self.max_radius {
                next *= self.max_radius / radius;
            }
            ((self.image(&next) - image).norm() < residual).then_some(next)
        })
    }
}

/// 1 + c0 s + c1 s² + c2 s³.
fn with_one(c: [f64; 3]) -> [f64; 4] {
    [1.0, c[0], c[1], c[2]]
}

/// The radius up to which the two conditions of the module's documentation hold, each times M² (and thus a polynomial
/// in r), and each with the margin `MIN_SLOPE` of the sum of the magnitudes of its terms.
fn max_radius(n: &[f64], m: &[f64], q: f64) -> f64 {
    let (size_n, size_m) = (poly::magnitude(n), poly::magnitude(m));
    // h' M² = (N + 2 s N') M − 2 s N M'
    let nm = poly::product(n, m);
    let dn_m = poly::product(&poly::twice_s_derivative(n), m);
    let n_dm = poly::product(n, &poly::twice_s_derivative(m));
    let slope = poly::sum(&poly::sum(&nm, 1.0, &dn_m), -1.0, &n_dm);
    // The same of the magnitudes: 2 s d/ds (N M) + N M.
    let size_nm = poly::product(&size_n, &size_m);
    let size_slope = poly::sum(&size_nm, 1.0, &poly::twice_s_derivative(&size_nm));

    let conditions = [
        (less_tangential(&slope, m, 6.0 * q), less_tangential(&size_slope, &size_m, -6.0 * q)),
        (less_tangential(&nm, m, 10.0 / 3.0 * q), less_tangential(&size_nm, &size_m, -10.0 / 3.0 * q)),
    ];
    conditions.iter().fold(MAX_TAN, |limit, (condition, size)| {
        poly::positive_up_to(&poly::sum(condition, -MIN_SLOPE, size), limit)
    })
}

/// `radial(r²) − tangential · r · M(r²)²` as a polynomial in r.
fn less_tangential(radial: &[f64], m: &[f64], tangential: f64) -> Polynomial {
    let squared = poly::of_square(&poly::product(m, m));
    poly::sum(&poly::of_square(radial), -tangential, &poly::product(&[0.0, 1.0], &squared))
}
