//! Cubic B-spline basis functions over uneven knots.

/// The cumulative basis functions of a segment at a time: sums of the later ones of its four basis functions.
pub(super) struct Basis {
    /// Number of the segment, which is that of its first control point.
    pub(super) segment: usize,
    /// Shares of the second, third and fourth difference.
    pub(super) cumulative: [f64; 3],
    /// Their derivatives by time.
    pub(super) rate_per_s: [f64; 3],
}

/// Time between keyframes where there is only one.
const LONE_STEP_S: f64 = 1.0;

/// Knot `index` of the times, which go on in even steps beyond both ends.
fn knot(times_s: &[f64], index: i64) -> f64 {
    let last = times_s.len() as i64 - 1;
    let at = |index: i64| times_s.get(index as usize).copied().unwrap_or_default();
    if last < 1 {
        return at(0) + LONE_STEP_S * index as f64;
    }
    match index {
        _ if index < 0 => at(0) + index as f64 * (at(1) - at(0)),
        _ if index > last => at(last) + (index - last) as f64 * (at(last) - at(last - 1)),
        _ => at(index),
    }
}

impl Basis {
    /// At a time within the keyframes'.
    pub(super) fn at(times_s: &[f64], time_s: f64) -> Self {
        let after = times_s.partition_point(|knot_s| *knot_s <= time_s);
        let segment = after.saturating_sub(1).min(times_s.len().saturating_sub(2));
        let knots: [f64; 6] = std::array::from_fn(|k| knot(times_s, segment as i64 + k as i64 - 2));
        let (values, slopes) = cubic(&knots, time_s);
        let sums = |of: [f64; 4]| [of[1] + of[2] + of[3], of[2] + of[3], of[3]];
        Self { segment, cumulative: sums(values), rate_per_s: sums(slopes) }
    }
}

/// The four basis functions that are not zero between the third and the fourth of six knots, and their derivatives
/// (de Boor, *A Practical Guide to Splines*, 1978, chapter X).
fn cubic(knots: &[f64; 6], time_s: f64) -> ([f64; 4], [f64; 4]) {
    let mut values = [0.0; 4];
    let mut quadratic = [0.0; 3];
    values[0] = 1.0;
    for degree in 1..=3 {
        if degree == 3 {
            quadratic = [values[0], values[1], values[2]];
        }
        let mut saved = 0.0;
        for r in 0..degree {
            let (right, left) = (knots[3 + r], knots[3 + r - degree]);
            let share = values[r] / (right - left);
            values[r] = saved + (right - time_s) * share;
            saved = (time_s - left) * share;
        }
        values[degree] = saved;
    }
    let [a, b, c] = [0, 1, 2].map(|r: usize| 3.0 * quadratic[r] / (knots[r + 3] - knots[r]));
    (values, [-a, a - b, b - c, c])
}
