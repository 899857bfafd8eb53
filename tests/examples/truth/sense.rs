//! What sensors make of the clean pictures: 8 bit, response, vignetting, noise; depth with a structured-light sensor's errors.

use std::path::Path;
use std::sync::Arc;

use anyhow::{Context as _, ensure};
use coshade_sim::sensor::Exposure;
use coshade_sim::tracer::{DepthSample, Tracer, View};
use coshade_sim::world::World;
use image::{ImageBuffer, Luma, Rgb};

/// Adds the `sensor` variant to the folder of a case.
pub fn sense(folder: &Path) -> anyhow::Result<()> {
    let world = World::read(folder.join("world.toml"))?;
    for name in ["camera", "fisheye"] {
        let picture = Picture::read(&folder.join(name).with_extension("exr"))?;
        let sensor = world.sensor(name, Arc::new(picture))?;
        let frame = sensor.frame(0, &Exposure::default())?;
        let image =
            ImageBuffer::<Rgb<u8>, _>::from_raw(frame.width_px, frame.height_px, frame.pixels.to_vec());
        image.context("frames must be rgb24")?.save(folder.join(name).with_extension("png"))?;
    }
    let sensor = world.sensor("depth", Arc::new(world.tracer()?))?;
    let frame = sensor.frame(0, &Exposure::default())?;
    let counts =
        frame.pixels.as_chunks::<2>().0.iter().map(|bytes| u16::from_le_bytes(*bytes)).collect::<Vec<_>>();
    let image = ImageBuffer::<Luma<u16>, _>::from_raw(frame.width_px, frame.height_px, counts);
    image.context("frames must be z16")?.save(folder.join("depth_sensor.png"))?;
    write_session(folder)
}

/// `session.toml` with the pictures of sensors instead of the clean ones.
fn write_session(folder: &Path) -> anyhow::Result<()> {
    let clean = folder.join("session.toml");
    let mut text = std::fs::read_to_string(&clean).with_context(|| clean.display().to_string())?;
    let names = [
        ("images:camera.exr", "images:camera.png"),
        ("images:fisheye.exr", "images:fisheye.png"),
        ("images:depth.png?depth_unit_m=0.0001", "images:depth_sensor.png?depth_unit_m=0.001"),
        ("../camera_linear.toml", "../camera.toml"),
        ("../fisheye_linear.toml", "../fisheye.toml"),
    ];
    for (clean_name, sensed) in names {
        ensure!(text.contains(clean_name), "{}: expected {clean_name:?} in it", clean.display());
        text = text.replace(clean_name, sensed);
    }
    let head = "# Made from session.toml: the same with the noise, response and 8 bits of real sensors.\n";
    Ok(std::fs::write(folder.join("sensor.toml"), format!("{head}{text}"))?)
}

/// A picture that is there already, as the eye of a sensor.
struct Picture {
    width: usize,
    radiance: Vec<[f32; 3]>,
}

impl Picture {
    fn read(path: &Path) -> anyhow::Result<Self> {
        let file = coshade_image_file::read(path)?;
        let image = &file.layers.first().context("no layer")?.image;
        let [r, g, b] = image.rgb().with_context(|| format!("{}: no colours", path.display()))?;
        let radiance = r.iter().zip(g).zip(b).map(|((r, g), b)| [*r, *g, *b]).collect();
        Ok(Self { width: image.width(), radiance })
    }
}

impl Tracer for Picture {
    fn radiance(&self, view: &View<'_>) -> Vec<[f32; 3]> {
        let rows = self.radiance.chunks(self.width).skip(view.rows.start as usize);
        rows.take(view.rows.len()).flatten().copied().collect()
    }

    fn depth(&self, view: &View<'_>) -> Vec<DepthSample> {
        vec![DepthSample::NOTHING; view.rows.len() * self.width]
    }

    fn key(&self) -> String {
        "picture".to_owned()
    }
}
