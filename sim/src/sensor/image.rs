//! From radiance to code values, in the order in which a camera does it.

use coshade_lens::calibration::{Calibration, Channel};
use coshade_lens::pixel::CameraPx;
use nalgebra::{Matrix3, Vector2, Vector3};
use rayon::prelude::*;

use crate::random::{Purpose, Random};

/// How a frame is exposed, relative to the calibration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Exposure {
    /// Exposure time ÷ the calibration's.
    pub time: f64,
    /// Gain ÷ the calibration's.
    pub gain: f64,
    /// Factors of red, green and blue.
    pub white_balance: [f64; 3],
}

impl Default for Exposure {
    /// That of the calibration.
    fn default() -> Self {
        Self { time: 1.0, gain: 1.0, white_balance: [1.0; 3] }
    }
}

/// An image sensor behind its lens. What it does is what its calibration says, the other way round.
#[derive(Clone, Debug)]
pub struct ImageSensor {
    calibration: Calibration,
    camera_from_working: Matrix3<f64>,
    falloff: Vec<f32>,
    seed: u64,
    sensor: u64,
}

impl ImageSensor {
    /// A sensor of a calibration; `seed` and `sensor` start its noise (see [`Random::at`]).
    pub fn new(calibration: Calibration, seed: u64, sensor: u64) -> Self {
        let working_from_camera = calibration.radiometric.working_from_camera();
        // A calibration whose matrix has no inverse is refused when it is read.
        let camera_from_working = working_from_camera.try_inverse().unwrap_or_else(Matrix3::identity);
        let falloff = falloff(&calibration);
        Self { calibration, camera_from_working, falloff, seed, sensor }
    }

    /// Its lens and its response.
    pub fn calibration(&self) -> &Calibration {
        &self.calibration
    }

    /// The light on each pixel in units of code white: `radiance` (working space, row by row, one value for each pixel)
    /// in the camera's own colours, exposed and vignetted. Without noise, not clipped: the *clean* image.
    pub fn light(&self, radiance: &[[f32; 3]], exposure: &Exposure) -> Vec<[f32; 3]> {
        let pixels = radiance.par_iter().zip(&self.falloff);
        pixels
            .map(|(radiance, falloff)| self.pixel_light(radiance, *falloff, exposure).map(|x| x as f32))
            .collect()
    }

    fn pixel_light(&self, radiance: &[f32; 3], falloff: f32, exposure: &Exposure) -> [f64; 3] {
        let own = self.camera_from_working * Vector3::from(radiance.map(f64::from));
        let factor = exposure.time * exposure.gain * f64::from(falloff);
        let balance = exposure.white_balance;
        // A colour matrix can turn saturated colours negative; light is not.
        [own.x * balance[0], own.y * balance[1], own.z * balance[2]].map(|x| (x * factor).max(0.0))
    }

    /// [`light`](Self::light) with the calibration's noise, if it has any: what the response, clipping and quantisation
    /// begin with. The same for the same seed, frame number, radiance and exposure, whatever the number of threads.
    pub fn signal(&self, radiance: &[[f32; 3]], exposure: &Exposure, frame: u64) -> Vec<[f32; 3]> {
        self.each_pixel(radiance, exposure, frame, |signal| signal.map(|x| x as f32))
    }

    /// The code values of a frame, R′G′B′ with 8 bits, row by row: the response to [`signal`](Self::signal).
    pub fn codes(&self, radiance: &[[f32; 3]], exposure: &Exposure, frame: u64) -> Vec<u8> {
        let code = |(signal, channel): (f64, Channel)| {
            let code = self.calibration.response.forward(channel, signal.clamp(0.0, 1.0));
            // A cast of a number that is none gives 0.
            (code * 255.0).round().clamp(0.0, 255.0) as u8
        };
        let codes = self.each_pixel(radiance, exposure, frame, |[red, green, blue]| {
            [(red, Channel::Red), (green, Channel::Green), (blue, Channel::Blue)].map(code)
        });
        codes.into_flattened()
    }

    /// What `convert` makes of the signal of every pixel.
    fn each_pixel<T: Send>(
        &self,
        radiance: &[[f32; 3]],
        exposure: &Exposure,
        frame: u64,
        convert: impl Fn([f64; 3]) -> T + Sync,
    ) -> Vec<T> {
        let pixels = radiance.par_iter().zip(&self.falloff).enumerate();
        pixels
            .map(|(pixel, (radiance, falloff))| {
                let light = self.pixel_light(radiance, *falloff, exposure);
                convert(self.pixel_signal(light, exposure, frame, pixel as u64))
            })
            .collect()
    }

    fn pixel_signal(&self, light: [f64; 3], exposure: &Exposure, frame: u64, pixel: u64) -> [f64; 3] {
        let Some(noise) = &self.calibration.noise else { return light };
        let mut random = Random::at(self.seed, self.sensor, Purpose::ImageNoise, frame, pixel);
        let (shot, read) = noise.at(Some(exposure.gain));
        light.map(|light| noisy(light, shot, read, &mut random))
    }
}

/// Light with shot and read noise. `shot` is the light of one electron: their number is Poisson distributed, so its
/// variance in light is `shot · light`.
fn noisy(light: f64, shot: f64, read: f64, random: &mut Random) -> f64 {
    let arrived = if shot > 0.0 { shot * random.poisson(light / shot) } else { light };
    if read > 0.0 { arrived + read.sqrt() * random.normal() } else { arrived }
}

fn falloff(calibration: &Calibration) -> Vec<f32> {
    let [width, height] = calibration.size_px;
    let at = |x: u32, y: u32| {
        let position = Vector2::new(f64::from(x), f64::from(y));
        let ray = calibration.model.unproject(&position);
        let angle_rad = ray.map_or(std::f64::consts::PI, |ray| ray.x.hypot(ray.y).atan2(ray.z));
        calibration.vignetting.falloff(CameraPx(position), angle_rad) as f32
    };
    (0..height).into_par_iter().flat_map_iter(|y| (0..width).map(move |x| at(x, y))).collect()
}
