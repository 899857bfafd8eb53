//! Axes and names, drawn into the camera's image through its lens.

use ab_glyph::FontRef;
use anyhow::Context as _;
use coshade_capture::{Converter, Frame};
use coshade_lens::calibration::Calibration;
use coshade_tracker::{Body, UNIT_CORNERS};
use image::{Rgb, RgbImage};
use nalgebra::{Isometry3, Point3};

use crate::canvas::{self, Text, line};
use crate::command::track::rows::{BodyRow, FrameRow};

/// Of the axes x, y and z, as everybody has them.
const AXES: [Rgb<u8>; 3] = [Rgb([235, 40, 40]), Rgb([40, 200, 60]), Rgb([60, 110, 255])];
/// Of the tags that a pose rests on, where the pose puts them.
const FITTED: Rgb<u8> = Rgb([60, 230, 230]);
/// Of corners where they were detected, and of tags without a body.
const DETECTED: Rgb<u8> = Rgb([255, 190, 0]);
const INK: Rgb<u8> = Rgb([255, 255, 255]);
const HALO: Rgb<u8> = Rgb([0, 0, 0]);
/// A straight line in space is drawn in so many pieces, for a lens may bend it.
const PIECES: u32 = 48;

/// Draws what was found.
pub struct Painter {
    calibration: Calibration,
    bodies: Vec<Body>,
    font: FontRef<'static>,
    converter: Converter,
}

impl Painter {
    /// For frames of this camera and bodies of these.
    pub fn new(calibration: Calibration, bodies: Vec<Body>) -> anyhow::Result<Self> {
        Ok(Self { calibration, bodies, font: canvas::font()?, converter: Converter::default() })
    }

    /// The frame with the axes of each body, thin ones of another pose that it could have, the outlines of its tags where the pose puts them, all tags' corners where
    /// they were detected, and names.
    ///
    /// # Errors
    /// A frame that cannot be decoded.
    pub fn paint(&mut self, frame: &Frame, found: &FrameRow) -> anyhow::Result<RgbImage> {
        let mut rgb = vec![0; 3 * frame.pixel_count()];
        self.converter.rgb24(frame, &mut rgb)?;
        let mut picture = RgbImage::from_raw(frame.width_px, frame.height_px, rgb)
            .context("a frame shorter than its size")?;
        for row in &found.bodies {
            if let Some(body) = self.bodies.iter().find(|body| body.name == row.name) {
                self.body(&mut picture, body, row);
            }
        }
        let height_px = letters_px(&picture);
        for tag in &found.tags {
            let corners = tag.corners_px;
            let is_fitted = found.bodies.iter().any(|body| body.tags_used.contains(&tag.name()));
            for (index, corner) in corners.iter().enumerate() {
                line(&mut picture, *corner, *corner, 4.0, DETECTED);
                if !is_fitted {
                    line(&mut picture, *corner, corners[(index + 1) % 4], 2.0, DETECTED);
                }
            }
            let middle = [0, 1].map(|axis| corners.iter().map(|corner| corner[axis]).sum::<f64>() / 4.0);
            self.name(&mut picture, &tag.id.to_string(), middle, height_px);
        }
        Ok(picture)
    }

    fn body(&self, picture: &mut RgbImage, body: &Body, row: &BodyRow) {
        let camera_from_body = row.camera_from_body.isometry();
        let used = body.tags.iter().filter(|tag| row.tags_used.contains(&tag.tag.to_string()));
        for tag in used {
            let corners = tag.corners_m();
            for index in 0..UNIT_CORNERS.len() {
                let (from, to) = (corners[index], corners[(index + 1) % 4]);
                self.edge(picture, camera_from_body, [from, to], 1.5, FITTED);
            }
        }
        let length_m = body.tags.iter().map(|tag| tag.size_m).fold(0.0, f64::max);
        if let Some(other) = &row.other_camera_from_body {
            self.axes(picture, other.isometry(), length_m, 1.0);
        }
        self.axes(picture, camera_from_body, length_m, 3.0);
        if body.tags.len() > 1
            && let Some(origin) = self.project(camera_from_body, Point3::origin())
        {
            self.name(picture, &row.name, origin, letters_px(picture));
        }
    }

    fn axes(&self, picture: &mut RgbImage, camera_from_body: &Isometry3<f64>, length_m: f64, width_px: f64) {
        for (axis, ink) in AXES.into_iter().enumerate() {
            let mut end = Point3::origin();
            end[axis] = length_m;
            self.edge(picture, camera_from_body, [Point3::origin(), end], width_px, ink);
        }
    }

    /// A straight edge in space.
    fn edge(
        &self,
        picture: &mut RgbImage,
        camera_from_body: &Isometry3<f64>,
        [from, to]: [Point3<f64>; 2],
        width_px: f64,
        ink: Rgb<u8>,
    ) {
        let place = |step| from + (to - from) * (f64::from(step) / f64::from(PIECES));
        let mut last = self.project(camera_from_body, place(0));
        for step in 1..=PIECES {
            let next = self.project(camera_from_body, place(step));
            // What lies outside of the lens is left out.
            if let (Some(last), Some(next)) = (last, next) {
                line(picture, last, next, width_px, ink);
            }
            last = next;
        }
    }

    fn project(&self, camera_from_body: &Isometry3<f64>, point: Point3<f64>) -> Option<[f64; 2]> {
        self.calibration.model.project(&(camera_from_body * point).coords).map(Into::into)
    }

    /// A name beside a place, readable on any ground.
    fn name(&self, picture: &mut RgbImage, name: &str, [x, y]: [f64; 2], height_px: u32) {
        let room_px = picture.width();
        let mut write = |dx: f32, dy: f32, ink| {
            let at_px = [x as f32 + 4.0 + dx, y as f32 + 4.0 + dy];
            Text { font: &self.font, line: name, at_px, height_px, room_px, ink }.draw(picture);
        };
        for (dx, dy) in [(-1.0, 0.0), (1.0, 0.0), (0.0, -1.0), (0.0, 1.0)] {
            write(dx, dy, HALO);
        }
        write(0.0, 0.0, INK);
    }
}

/// Letters that can be read when the whole picture is looked at.
fn letters_px(picture: &RgbImage) -> u32 {
    (picture.height() / 36).clamp(12, 64)
}

#[cfg(test)]
mod tests {
    use nalgebra::{Translation3, Vector3};

    use super::*;

    #[test]
    fn axes_bend_as_the_lens_does() {
        // Equidistant: a straight line far off axis is bent in the image.
        let text = "version = 1\nsize_px = [400, 400]\n[lens]\nmodel = \"kannala_brandt4\"\nfx = 110\nfy = 110\ncx = 199.5\n\
                    cy = 199.5\nk1 = 0\nk2 = 0\nk3 = 0\nk4 = 0\n";
        let calibration = Calibration::parse(text, "fisheye.toml").unwrap();
        let painter = Painter::new(calibration, Vec::new()).unwrap();
        let mut picture = RgbImage::new(400, 400);
        let camera_from_body = Isometry3::from_parts(
            Translation3::new(1.2, -1.05, 1.0),
            nalgebra::UnitQuaternion::from_axis_angle(&Vector3::y_axis(), std::f64::consts::FRAC_PI_2),
        );
        painter.axes(&mut picture, &camera_from_body, 2.1, 3.0);
        let lit = |[x, y]: [f64; 2], axis: usize| {
            picture.get_pixel(x.round() as u32, y.round() as u32).0[axis] > 150
        };
        let place = |point: Vector3<f64>| {
            let away = point.x.hypot(point.y);
            [point.x, point.y].map(|along| 199.5 + 110.0 * away.atan2(point.z) * along / away)
        };
        for share in [0.2, 0.5, 0.8] {
            // The x axis points backwards, past the plane of the lens.
            assert!(lit(place(Vector3::new(1.2, -1.05, 1.0 - 2.1 * share)), 0), "x at {share}");
            assert!(lit(place(Vector3::new(1.2, -1.05 + 2.1 * share, 1.0)), 1), "y at {share}");
        }
        let ends = [-1.05, 1.05].map(|y| place(Vector3::new(1.2, y, 1.0)));
        let chord = [0, 1].map(|axis| (ends[0][axis] + ends[1][axis]) / 2.0);
        assert!(!lit(chord, 1), "a straight line between the ends");
    }
}
