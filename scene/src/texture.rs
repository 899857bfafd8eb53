//! Pictures on surfaces.

use std::sync::Arc;

use glam::{Mat3, Vec2};

/// RGBA pixels, 8 bits each, rows from the top, alpha not premultiplied.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Image {
    /// For messages: a file or image name.
    pub name: String,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// `width · height · 4` bytes.
    pub rgba: Vec<u8>,
}

/// What the code values of R, G and B mean. Alpha is always linear.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ColorSpace {
    /// Colours: decode with the sRGB curve (IEC 61966-2-1).
    Srgb,
    /// Data, such as roughness or normals: value/255.
    Linear,
}

/// What lies outside [0, 1).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Wrap {
    /// Tiles.
    #[default]
    Repeat,
    /// Tiles, every second one mirrored.
    MirroredRepeat,
    /// The edge texel goes on.
    ClampToEdge,
}

/// How texels are interpolated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Filter {
    /// The texel the coordinate falls into.
    Nearest,
    /// Bilinear (and trilinear between levels, where there are any).
    #[default]
    Linear,
}

/// Texture coordinates as KHR_texture_transform moves them: `uv' = T · R · S · uv`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UvTransform {
    /// Added last.
    pub offset: Vec2,
    /// Counter-clockwise in (u, v) with v down, as the extension defines it, radians.
    pub rotation_rad: f32,
    /// Applied first.
    pub scale: Vec2,
}

impl Default for UvTransform {
    fn default() -> Self {
        Self { offset: Vec2::ZERO, rotation_rad: 0.0, scale: Vec2::ONE }
    }
}

impl UvTransform {
    /// As a matrix on `(u, v, 1)`, with the signs of the extension's sample code.
    pub fn to_mat3(&self) -> Mat3 {
        let (sin, cos) = self.rotation_rad.sin_cos();
        let rotation = Mat3::from_cols_array(&[cos, -sin, 0.0, sin, cos, 0.0, 0.0, 0.0, 1.0]);
        Mat3::from_translation(self.offset) * rotation * Mat3::from_scale(self.scale)
    }

    /// Maps a coordinate.
    pub fn apply(&self, uv: Vec2) -> Vec2 {
        self.to_mat3().transform_point2(uv)
    }
}

/// A picture as a material uses it. Texel i covers [i, i+1)/n; (0, 0) is the upper left corner, v runs down.
#[derive(Clone, Debug, PartialEq)]
pub struct Texture {
    /// The pixels, shared between uses.
    pub image: Arc<Image>,
    /// Meaning of the code values.
    pub color_space: ColorSpace,
    /// Along u.
    pub wrap_u: Wrap,
    /// Along v.
    pub wrap_v: Wrap,
    /// When a texel is larger than a pixel.
    pub magnify: Filter,
    /// When a texel is smaller than a pixel.
    pub minify: Filter,
    /// Applied to the mesh's coordinates before the look-up.
    pub uv_transform: UvTransform,
}

impl Texture {
    /// Repeating, linearly filtered, not transformed.
    pub fn new(image: Arc<Image>, color_space: ColorSpace) -> Self {
        Self {
            image,
            color_space,
            wrap_u: Wrap::default(),
            wrap_v: Wrap::default(),
            magnify: Filter::default(),
            minify: Filter::default(),
            uv_transform: UvTransform::default(),
        }
    }
}

/// The sRGB curve of IEC 61966-2-1: code value in [0, 1] to linear light. Outside it goes on as the straight and the
/// power part do.
pub fn srgb_to_linear(code: f32) -> f32 {
    if code <= 0.04045 { code / 12.92 } else { ((code + 0.055) / 1.055).powf(2.4) }
}
