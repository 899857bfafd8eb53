//! A simulated sensor: any of its frames, at any time.

use std::sync::Arc;
use std::time::Duration;

use coshade_capture::{ColorEncoding, Frame, PixelFormat, StreamInfo};
use coshade_lens::calibration::Calibration;
use coshade_reference::accel::Sees;

use crate::cache::{ContentHash, PictureCache};
use crate::faults::Faults;
use crate::path::Path;
use crate::pose::Rigid;
use crate::random::name_seed;
use crate::rolling_shutter::RollingShutter;
use crate::sensor::encode::{self, EncodeError};
use crate::sensor::{DepthSensor, Exposure, FormatSpec, ImageSensor};
use crate::timing::Timing;
use crate::tracer::{DepthSample, Tracer, View};
use crate::world::{MountSpec, SensorSpec, World};

/// How far making pictures has come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Progress {
    /// Pictures that are there.
    pub done: u64,
    /// Pictures in all.
    pub total: u64,
}

/// A sensor of a world. Knows the truth of every frame; `SimCamera` delivers them as a device would.
#[derive(Clone)]
pub struct SimSensor {
    name: String,
    spec: SensorSpec,
    image: ImageSensor,
    depth: Option<DepthSensor>,
    timing: Timing,
    faults: Faults,
    duration_s: f64,
    path: Arc<Path>,
    tracer: Arc<dyn Tracer>,
    cache: Option<PictureCache>,
}

impl SimSensor {
    pub(crate) fn new(
        name: &str,
        spec: SensorSpec,
        calibration: Calibration,
        world: &World,
        tracer: Arc<dyn Tracer>,
    ) -> Self {
        let (seed, sensor) = (world.spec().seed, name_seed(name));
        let is_depth = spec.format.pixel_format() == PixelFormat::Z16;
        let depth = is_depth
            .then(|| DepthSensor::new(spec.depth.unwrap_or_default(), calibration.size_px, seed, sensor));
        Self {
            name: name.to_owned(),
            depth,
            timing: Timing {
                frames_per_second: spec.frames_per_second,
                phase_s: spec.phase_s,
                time_offset_ns: spec.time_offset_ns,
                jitter_s: spec.jitter_s,
                delay_s: spec.delay_s,
                seed,
                sensor,
            },
            faults: Faults::new(spec.faults.clone(), seed, sensor),
            duration_s: world.spec().duration_s,
            path: Arc::clone(world.path()),
            tracer,
            cache: None,
            image: ImageSensor::new(calibration, seed, sensor),
            spec,
        }
    }

    /// Keeps what is traced in a cache.
    #[must_use]
    pub fn with_cache(self, cache: Option<PictureCache>) -> Self {
        Self { cache, ..self }
    }

    /// Its name within the world.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// As the world describes it.
    pub fn spec(&self) -> &SensorSpec {
        &self.spec
    }

    /// Its true lens and response.
    pub fn calibration(&self) -> &Calibration {
        self.image.calibration()
    }

    /// When its frames are exposed and stamped.
    pub fn timing(&self) -> &Timing {
        &self.timing
    }

    /// What goes wrong with it.
    pub fn faults(&self) -> &Faults {
        &self.faults
    }

    /// Frames that it exposes.
    pub fn frame_count(&self) -> u64 {
        self.timing.frame_count(self.duration_s)
    }

    /// What its frames are.
    pub fn stream(&self) -> StreamInfo {
        let [width_px, height_px] = self.calibration().size_px;
        let format = self.spec.format.pixel_format();
        StreamInfo {
            format,
            color: if self.depth.is_some() { ColorEncoding::default() } else { encode::color(format) },
            width_px,
            height_px,
            frames_per_second: Some(self.spec.frames_per_second),
            depth_unit_m: self.depth.as_ref().map(|depth| depth.spec().unit_m),
        }
    }

    /// Where it truly is at a time of the world.
    pub fn world_from_sensor(&self, time_s: f64) -> Rigid {
        let mounted = World::mount(&self.spec);
        match self.spec.mount {
            MountSpec::World => mounted,
            MountSpec::Rig => self.path.pose(time_s) * mounted,
        }
    }

    /// Its rows' times.
    pub fn shutter(&self) -> RollingShutter {
        RollingShutter {
            readout_s: self.calibration().readout_s,
            height_px: self.calibration().size_px[1],
            bands: self.spec.shutter_bands,
        }
    }

    fn views(&self, frame: u64, sees: Sees) -> Vec<View<'_>> {
        let time_s = self.timing.time_s(frame);
        let bands = self.shutter().bands().into_iter();
        bands
            .map(|(rows, offset_s)| View {
                calibration: self.calibration(),
                world_from_camera: self.world_from_sensor(time_s + offset_s),
                rows,
                sees,
            })
            .collect()
    }

    fn key(&self, kind: &str, views: &[View<'_>]) -> ContentHash {
        let calibration = self.calibration();
        let lens = (&calibration.model, calibration.size_px, calibration.image_circle);
        let rows: Vec<_> = views.iter().map(|view| (&view.rows, view.world_from_camera, view.sees)).collect();
        ContentHash::of(&(kind, self.tracer.key(), lens, rows))
    }

    /// Numbers from the cache, else made and kept there.
    fn cached(&self, key: &ContentHash, count: usize, make: impl FnOnce() -> Vec<f32>) -> Vec<f32> {
        let Some(cache) = &self.cache else { return make() };
        if let Some(numbers) = cache.get(key, count) {
            return numbers;
        }
        let numbers = make();
        if let Err(error) = cache.put(key, &numbers) {
            tracing::warn!("{}: picture not kept: {error}", cache.folder().display());
        }
        numbers
    }

    fn pixel_count(&self) -> usize {
        let [width, height] = self.calibration().size_px;
        width as usize * height as usize
    }

    /// What there is to see in a frame: radiance in the working space, row by row.
    pub fn radiance(&self, frame: u64, sees: Sees) -> Vec<[f32; 3]> {
        let views = self.views(frame, sees);
        let make = || views.iter().flat_map(|view| self.tracer.radiance(view)).flatten().collect();
        let numbers = self.cached(&self.key("radiance", &views), self.pixel_count() * 3, make);
        numbers.as_chunks::<3>().0.to_vec()
    }

    /// How far everything is in a frame, without the sensor's errors.
    pub fn true_depth(&self, frame: u64, sees: Sees) -> Vec<DepthSample> {
        let views = self.views(frame, sees);
        let flat = |sample: DepthSample| [sample.z_m, sample.cos_incidence];
        let make = || views.iter().flat_map(|view| self.tracer.depth(view)).flat_map(flat).collect();
        let numbers = self.cached(&self.key("depth", &views), self.pixel_count() * 2, make);
        let pairs = numbers.as_chunks::<2>().0.iter();
        pairs.map(|&[z_m, cos_incidence]| DepthSample { z_m, cos_incidence }).collect()
    }

    /// The clean image of a frame: linear light on the sensor, without noise, clipping and quantisation.
    pub fn clean(&self, frame: u64, exposure: &Exposure, sees: Sees) -> Vec<[f32; 3]> {
        self.image.light(&self.radiance(frame, sees), exposure)
    }

    /// A frame as the sensor delivers it, with its stamps, exposed as `exposure` says (which a depth sensor ignores).
    ///
    /// # Errors
    /// [`EncodeError`] for a size that the format cannot have, and for light that it cannot.
    pub fn frame(&self, frame: u64, exposure: &Exposure) -> Result<Frame, EncodeError> {
        let size_px = self.calibration().size_px;
        let made = match &self.depth {
            Some(depth) => {
                let counts = depth.counts(&self.true_depth(frame, Sees::RealOnly), frame);
                let bytes: Vec<u8> = counts.into_iter().flat_map(u16::to_le_bytes).collect();
                let mut made = Frame::packed(PixelFormat::Z16, size_px[0], size_px[1], bytes)?;
                made.depth_unit_m = Some(depth.spec().unit_m);
                made
            }
            None if self.spec.format == FormatSpec::RgbF32 => {
                let signal = self.image.signal(&self.radiance(frame, Sees::RealOnly), exposure, frame);
                encode::encode_linear(&signal, size_px)?
            }
            None => {
                let codes = self.image.codes(&self.radiance(frame, Sees::RealOnly), exposure, frame);
                encode::encode(&codes, size_px, self.spec.format.pixel_format())?
            }
        };
        let faults = self.faults.of_frame(frame, self.timing.time_s(frame));
        Ok(Frame {
            captured: self.timing.stamp(frame, faults.stamp_error_ns),
            arrived: self.timing.arrival(frame),
            sequence: frame,
            exposure: self
                .depth
                .is_none()
                .then(|| Duration::from_secs_f64(self.spec.exposure_s * exposure.time)),
            gain: self.depth.is_none().then_some((self.spec.gain * exposure.gain) as f32),
            ..made
        })
    }

    /// Traces every frame that the cache lacks, so that frames come fast afterwards; nothing without a cache. `progress` is
    /// told before each picture and at the end; it returns false to stop. Returns whether all is there.
    pub fn prepare(&self, mut progress: impl FnMut(Progress) -> bool) -> bool {
        let total = if self.cache.is_some() { self.frame_count() } else { 0 };
        for frame in 0..total {
            if !progress(Progress { done: frame, total }) {
                return false;
            }
            if !self.faults.of_frame(frame, self.timing.time_s(frame)).is_delivered() {
                continue;
            }
            match &self.depth {
                Some(_) => drop(self.true_depth(frame, Sees::RealOnly)),
                None => drop(self.radiance(frame, Sees::RealOnly)),
            }
        }
        progress(Progress { done: total, total });
        true
    }
}
