//! A box with tiled walls, lit by a lamp field in the ceiling and a window, without shadows.

use nalgebra::Vector3;

/// From the corner (0, 0, 0), metres.
const SIZE_M: [f64; 3] = [5.0, 4.0, 2.6];
const LAMP: [[f64; 2]; 2] = [[1.8, 1.2], [3.2, 2.0]];
const WINDOW: [[f64; 2]; 2] = [[1.4, 0.9], [3.6, 2.1]];
const LAMP_RADIANCE: [f64; 3] = [5.0, 4.6, 3.9];
const WINDOW_RADIANCE: [f64; 3] = [1.6, 2.0, 2.6];

/// Radiance that arrives at `position_m`, inside of the room, from a unit `direction`.
pub fn radiance(position_m: &Vector3<f64>, direction: &Vector3<f64>) -> Vector3<f64> {
    let (wall, distance_m) = (0..3)
        .map(|axis| {
            let to_wall =
                if direction[axis] > 0.0 { SIZE_M[axis] - position_m[axis] } else { -position_m[axis] };
            (2 * axis + usize::from(direction[axis] > 0.0), to_wall / direction[axis])
        })
        .filter(|(_, distance)| distance.is_finite())
        .min_by(|a, b| a.1.total_cmp(&b.1))
        .unwrap_or((0, 0.0));
    surface(wall, &(position_m + direction * distance_m))
}

/// `wall` is 2·axis + (1 on the far side).
fn surface(wall: usize, point: &Vector3<f64>) -> Vector3<f64> {
    let inside = |[low, high]: [[f64; 2]; 2], u: f64, v: f64| {
        (low[0]..high[0]).contains(&u) && (low[1]..high[1]).contains(&v)
    };
    if wall == 5 && inside(LAMP, point.x, point.y) {
        return LAMP_RADIANCE.into();
    }
    if wall == 3 && inside(WINDOW, point.x, point.z) {
        let bar = (point.x - 2.5).abs() < 0.03 || (point.z - 1.5).abs() < 0.03;
        return if bar { Vector3::repeat(0.08) } else { WINDOW_RADIANCE.into() };
    }
    let mut normal = Vector3::zeros();
    normal[wall / 2] = if wall.is_multiple_of(2) { 1.0 } else { -1.0 };
    albedo(wall, point).component_mul(&irradiance(point, &normal)) / std::f64::consts::PI
}

fn albedo(wall: usize, point: &Vector3<f64>) -> Vector3<f64> {
    let tile = |u: f64, v: f64, side: f64| ((u / side).floor() + (v / side).floor()).rem_euclid(2.0) == 0.0;
    let (light, dark, first) = match wall {
        0 => ([0.75, 0.72, 0.66], [0.62, 0.59, 0.54], tile(point.y, point.z, 0.4)),
        1 => ([0.20, 0.42, 0.50], [0.13, 0.30, 0.38], tile(point.y, point.z, 0.4)),
        2 => ([0.72, 0.36, 0.26], [0.60, 0.27, 0.19], tile(point.x, point.z, 0.4)),
        3 => ([0.78, 0.76, 0.70], [0.68, 0.66, 0.60], tile(point.x, point.z, 0.4)),
        4 => (
            [0.48, 0.33, 0.21],
            [0.38, 0.25, 0.15],
            tile(point.x, point.y + 0.7 * (point.x / 0.2).floor(), 0.2),
        ),
        _ => ([0.85, 0.85, 0.83], [0.80, 0.80, 0.78], tile(point.x, point.y, 0.6)),
    };
    if first { light.into() } else { dark.into() }
}

/// Both lights as cosine emitters at their centres, and what the walls scatter as a constant.
fn irradiance(point: &Vector3<f64>, normal: &Vector3<f64>) -> Vector3<f64> {
    let lamp = ([2.5, 1.6, 2.6], [0.0, 0.0, -1.0], LAMP_RADIANCE, area(LAMP));
    let window = ([2.5, 4.0, 1.5], [0.0, -1.0, 0.0], WINDOW_RADIANCE, area(WINDOW));
    let direct = [lamp, window].into_iter().map(|(center, facing, radiance, area_m2)| {
        let to_light = Vector3::from(center) - point;
        let distance2 = to_light.norm_squared() + area_m2 / 4.0;
        let cosines = normal.dot(&to_light).max(0.0) * (-Vector3::from(facing).dot(&to_light)).max(0.0);
        Vector3::from(radiance) * (area_m2 * cosines / (distance2 * distance2))
    });
    direct.sum::<Vector3<f64>>() + Vector3::new(0.55, 0.53, 0.5)
}

fn area([low, high]: [[f64; 2]; 2]) -> f64 {
    (high[0] - low[0]) * (high[1] - low[1])
}
