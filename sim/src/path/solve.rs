//! Control points of curves that pass through given points.

use glam::{DQuat, DVec3};

use super::basis::Basis;
use super::{curve_position, curve_rotation, exponential, logarithm};

/// Rounds of correction; each leaves a third of the error for even times.
const MAX_ROUNDS: usize = 2000;
const POSITION_TOLERANCE_M: f64 = 1e-12;
const ROTATION_TOLERANCE_RAD: f64 = 1e-12;

/// Corrects control points by what the curve misses its keyframes by until it misses none. The first and last control
/// point mirror their neighbours at the ends of the curve.
fn solved<T: Copy>(
    times_s: &[f64],
    targets: &[T],
    mirrored: impl Fn(T, T) -> T,
    missed: impl Fn(&Basis, &[T], T) -> (DVec3, f64),
    corrected: impl Fn(T, DVec3) -> T,
    tolerance: f64,
) -> Option<Vec<T>> {
    let mut inner = targets.to_vec();
    let mut last_worst = f64::INFINITY;
    for round in 0..MAX_ROUNDS {
        let controls = with_ends(&inner, &mirrored)?;
        let mut worst: f64 = 0.0;
        for ((control, &time_s), &target) in inner.iter_mut().zip(times_s).zip(targets) {
            let (error, size) = missed(&Basis::at(times_s, time_s), &controls, target);
            worst = worst.max(size);
            *control = corrected(*control, error);
        }
        if worst <= tolerance {
            return Some(controls);
        }
        // Corrections that grow will not find the curve.
        if worst.is_nan() || (round % 50 == 49 && worst > 2.0 * last_worst) {
            return None;
        }
        if round % 50 == 49 {
            last_worst = worst;
        }
    }
    None
}

fn with_ends<T: Copy>(inner: &[T], mirrored: impl Fn(T, T) -> T) -> Option<Vec<T>> {
    let (&first, &last) = (inner.first()?, inner.last()?);
    let second = inner.get(1).copied().unwrap_or(first);
    let before_last = inner.len().checked_sub(2).and_then(|index| inner.get(index)).copied().unwrap_or(last);
    let mut controls = Vec::with_capacity(inner.len() + 3);
    controls.push(mirrored(first, second));
    controls.extend_from_slice(inner);
    controls.push(mirrored(last, before_last));
    if inner.len() == 1 {
        // A lone keyframe still has a segment of four.
        controls.push(last);
    }
    Some(controls)
}

pub(super) fn positions(times_s: &[f64], places_m: &[DVec3]) -> Option<Vec<DVec3>> {
    let missed = |basis: &Basis, controls: &[DVec3], target: DVec3| {
        let error = target - curve_position(basis, controls).0;
        (error, error.length())
    };
    let largest_m = places_m.iter().map(|place| place.length()).fold(1.0, f64::max);
    let mirrored = |end: DVec3, next: DVec3| 2.0 * end - next;
    solved(
        times_s,
        places_m,
        mirrored,
        missed,
        |control, error| control + error,
        POSITION_TOLERANCE_M * largest_m,
    )
}

pub(super) fn rotations(times_s: &[f64], turns: &[DQuat]) -> Option<Vec<DQuat>> {
    let missed = |basis: &Basis, controls: &[DQuat], target: DQuat| {
        let error = logarithm(curve_rotation(basis, controls).0.conjugate() * target);
        (error, error.length())
    };
    let mirrored = |end: DQuat, next: DQuat| end * (next.conjugate() * end);
    let corrected = |control: DQuat, error| (control * exponential(error)).normalize();
    solved(times_s, turns, mirrored, missed, corrected, ROTATION_TOLERANCE_RAD)
}
