//! Lamps and the environment.

use coshade_scene::light::{Rectangle, Spot};
use coshade_scene::{LightKind, Similarity};
use glam::{DMat4, DVec3, DVec4, Vec3};

use super::xml::Element;
use crate::emitter::Environment;
use coshade_image_file::{Image, ImageError};

/// What a spot loses.
pub const SPOT_APPROXIMATION: &str =
    "a spot becomes a point without an area, and its rim falls off linearly in the angle";

/// A lamp in Mitsuba's words. Rectangles are exact: their `null` surface lets all light through, as lamps hide nothing.
pub fn lamp(kind: &LightKind, world_from_light: &Similarity) -> Element {
    match kind {
        LightKind::Rectangle(rectangle) => area(rectangle, world_from_light),
        LightKind::Spot(spot) => point(spot, world_from_light),
    }
}

/// Mitsuba's rectangle spans [−1, 1]² and faces +z, too.
fn area(rectangle: &Rectangle, world_from_light: &Similarity) -> Element {
    let half = (rectangle.size_m / 2.0).as_dvec2();
    let to_world = world_from_light.to_mat4().as_dmat4() * DMat4::from_scale(DVec3::new(half.x, half.y, 1.0));
    Element::plugin("shape", "rectangle")
        .transform("to_world", to_world)
        .child(Element::plugin("bsdf", "null"))
        .child(Element::plugin("emitter", "area").rgb("radiance", rectangle.radiance))
}

fn point(spot: &Spot, world_from_light: &Similarity) -> Element {
    let rigid = Similarity { scale: 1.0, ..*world_from_light };
    Element::plugin("emitter", "spot")
        .transform("to_world", rigid.to_mat4().as_dmat4())
        .rgb("intensity", spot.radiant_intensity)
        .parameter("float", "cutoff_angle", spot.outer_rad.to_degrees())
        .parameter("float", "beam_width", spot.inner_rad.min(0.999 * spot.outer_rad).to_degrees())
}

/// An `envmap` that reads `file`: +y up; its middle column looks along +z, and −x is to the right of that.
pub fn environment(environment: &Environment, file: &str) -> Element {
    let (sin, cos) = f64::from(environment.yaw_rad()).sin_cos();
    // Images of Mitsuba's x, y and z: ours are left of the middle, up, and the middle.
    let world_from_map =
        DMat4::from_cols(DVec4::new(-sin, cos, 0.0, 0.0), DVec4::Z, DVec4::new(cos, sin, 0.0, 0.0), DVec4::W);
    Element::plugin("emitter", "envmap")
        .parameter("string", "filename", file)
        .transform("to_world", world_from_map)
}

/// The map as Mitsuba interpolates it: with rows at both poles and at equal angles between them. Ours have half a row of
/// margin; twice the rows and one more have all knots of the interpolation, so nothing is lost.
///
/// # Errors
/// As [`Image::new`].
pub fn environment_image(environment: &Environment) -> Result<Image, ImageError> {
    let [width, height] = environment.size();
    let last = height as i64 - 1;
    let texel = |x: usize, y: i64| {
        let y = y.clamp(0, last) as usize;
        environment.texels().get(y * width + x).copied().unwrap_or(Vec3::ZERO)
    };
    let mut pixels = Vec::with_capacity(width * (2 * height + 1));
    for row in 0..=2 * height as i64 {
        // Odd rows are ours, even ones lie half-way between two of them.
        let (upper, lower) = ((row - 1).div_euclid(2), row.div_euclid(2));
        pixels.extend((0..width).map(|x| (texel(x, upper) + texel(x, lower)) / 2.0));
    }
    Image::from_rgb(width, 2 * height + 1, &pixels)
}
