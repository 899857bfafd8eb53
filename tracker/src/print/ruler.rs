//! Rulers that show whether a print is true to scale.

use super::drawing::{Contour, Path};
use super::grid::millimeters;
use super::text::{Anchor, Letters};

/// Length of a ruler where there is room.
pub(super) const RULER_MM: f64 = 100.0;
/// Rulers are made of whole ones of these.
pub(super) const STEP_MM: f64 = 10.0;
/// How far numbers reach beyond a ruler's ends.
pub(super) const BEYOND_MM: f64 = 1.5;
/// Width that a level ruler needs beside its length: its unit, and the arrow of the caption.
pub(super) const WIDTH_BESIDE_MM: f64 = 2.0 * BEYOND_MM + 18.0;
/// Width of an upright ruler and the space to the board.
pub(super) const UPRIGHT_MM: f64 = 11.0;
/// Height of a level ruler.
pub(super) const LEVEL_MM: f64 = 8.0;

/// Thickness of its lines.
const LINE_MM: f64 = 0.2;
const EM_MM: f64 = 2.4;

/// The length of a ruler in a place: whole steps, two at least.
pub(super) fn length_mm(room_mm: f64) -> Option<f64> {
    let steps = (room_mm / STEP_MM).floor().min(RULER_MM / STEP_MM);
    (steps >= 2.0).then_some(steps * STEP_MM)
}

/// A level ruler. Its upper edge begins at a place; millimetres are between the middles of ticks.
pub(super) fn level(letters: &Letters, [x, y]: [f64; 2], length_mm: f64) -> Vec<Path> {
    let ticks = ticks(length_mm, |along, across| [x + along, y + across]);
    let baseline = y + tick_mm(0) + 0.9 * EM_MM;
    let numbers =
        steps(length_mm).map(|at| letters.line(&millimeters(at), [x + at, baseline], EM_MM, Anchor::Middle));
    let unit = letters.line("mm", [x + length_mm + 2.0 * BEYOND_MM, baseline], EM_MM, Anchor::Start);
    std::iter::once(ticks).chain(numbers).chain([unit]).collect()
}

/// An upright ruler, whose left edge begins at a place.
pub(super) fn upright(letters: &Letters, [x, y]: [f64; 2], length_mm: f64) -> Vec<Path> {
    let ticks = ticks(length_mm, |along, across| [x + across, y + along]);
    let numbers = steps(length_mm).map(|at| {
        let place = [x + tick_mm(0) + 0.6, y + at + 0.35 * EM_MM];
        letters.line(&millimeters(at), place, EM_MM, Anchor::Start)
    });
    std::iter::once(ticks).chain(numbers).collect()
}

fn steps(length_mm: f64) -> impl Iterator<Item = f64> {
    (0..=(length_mm / STEP_MM).round() as u32).map(|step| f64::from(step) * STEP_MM)
}

/// The line along the edge, and a tick a millimetre.
fn ticks(length_mm: f64, place: impl Fn(f64, f64) -> [f64; 2]) -> Path {
    let half = LINE_MM / 2.0;
    let edge = Contour::rectangle(place(-half, 0.0), place(length_mm + half, LINE_MM));
    let ticks = (0..=length_mm.round() as u32).map(|mm| {
        let at = f64::from(mm);
        Contour::rectangle(place(at - half, LINE_MM), place(at + half, tick_mm(mm)))
    });
    Path { name: format!("ruler of {length_mm} mm"), contours: std::iter::once(edge).chain(ticks).collect() }
}

fn tick_mm(mm: u32) -> f64 {
    match mm {
        _ if mm.is_multiple_of(10) => 4.0,
        _ if mm.is_multiple_of(5) => 3.0,
        _ => 2.0,
    }
}
