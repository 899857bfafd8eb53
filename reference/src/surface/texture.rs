//! Texture look-ups: bilinear in linear space.

use coshade_scene::texture::{ColorSpace, Filter, Image, Texture, Wrap};
use glam::{Vec2, Vec3, Vec4};

use super::srgb_table as srgb;

/// The linear RGBA value of a texture at the mesh's coordinates (its transform is applied here).
///
/// Bilinear interpolation between texel centres, after decoding; the nearest texel where the texture asks for it. A
/// texture without pixels is white, as if it were absent.
pub fn lookup(texture: &Texture, uv: Vec2) -> Vec4 {
    let image = &*texture.image;
    let (width, height) = (image.width as usize, image.height as usize);
    let uv = texture.uv_transform.apply(uv);
    if width == 0 || height == 0 || image.rgba.len() < width * height * 4 || !uv.is_finite() {
        return Vec4::ONE;
    }
    let texel = |x: i64, y: i64| {
        let x = wrapped(x, width, texture.wrap_u);
        let y = wrapped(y, height, texture.wrap_v);
        decode(image, y * width + x, texture.color_space)
    };
    let at = |coordinate: f32, size: usize| f64::from(coordinate) * size as f64;
    let (x, y) = (at(uv.x, width), at(uv.y, height));
    if texture.magnify == Filter::Nearest {
        return texel(x.floor() as i64, y.floor() as i64);
    }
    let (x, y) = (x - 0.5, y - 0.5);
    let (left, top) = (x.floor(), y.floor());
    let (fx, fy) = ((x - left) as f32, (y - top) as f32);
    let (left, top) = (left as i64, top as i64);
    let upper = texel(left, top).lerp(texel(left + 1, top), fx);
    let lower = texel(left, top + 1).lerp(texel(left + 1, top + 1), fx);
    upper.lerp(lower, fy)
}

fn wrapped(index: i64, size: usize, wrap: Wrap) -> usize {
    let size = size as i64;
    let inside = match wrap {
        Wrap::Repeat => index.rem_euclid(size),
        Wrap::MirroredRepeat => {
            let twice = index.rem_euclid(2 * size);
            twice.min(2 * size - 1 - twice)
        }
        Wrap::ClampToEdge => index.clamp(0, size - 1),
    };
    inside as usize
}

fn decode(image: &Image, texel: usize, color_space: ColorSpace) -> Vec4 {
    let Some(&[r, g, b, a]) = image.rgba.get(texel * 4..).and_then(<[u8]>::first_chunk) else {
        return Vec4::ONE;
    };
    let alpha = f32::from(a) / 255.0;
    match color_space {
        ColorSpace::Srgb => Vec3::new(srgb::decode(r), srgb::decode(g), srgb::decode(b)).extend(alpha),
        ColorSpace::Linear => {
            Vec3::new(f32::from(r), f32::from(g), f32::from(b)).extend(255.0 * alpha) / 255.0
        }
    }
}
