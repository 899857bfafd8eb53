//! All sensors of a world over their whole time, written into a recording, with the truth beside it.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use coshade_capture::recording::{
    RecordedTransform, RecordingError, RecordingOptions, RecordingWriter, StreamCounts, StreamId,
};
use serde::Serialize;

use crate::cache::PictureCache;
use crate::device::{Progress, SimSensor};
use crate::faults::{FaultSpec, FrameFaults};
use crate::sensor::{EncodeError, Exposure};
use crate::tracer::Tracer;
use crate::world::{World, WorldError};

/// Why a world was not recorded.
#[derive(Debug, thiserror::Error)]
pub enum SimulateError {
    /// The world.
    #[error(transparent)]
    World(#[from] WorldError),
    /// The recording.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// A frame.
    #[error("sensor {sensor}, frame {frame}: {source}")]
    Frame {
        /// Name of the sensor.
        sensor: String,
        /// Number of the frame.
        frame: u64,
        /// Why.
        source: EncodeError,
    },
    /// The file with the truth cannot be written.
    #[error("{}: cannot write: {reason}", path.display())]
    Truth {
        /// The file.
        path: PathBuf,
        /// Why.
        reason: String,
    },
    /// The caller wanted no more. What was written is readable.
    #[error("stopped")]
    Stopped,
}

/// What was written.
#[derive(Clone, Debug, Serialize)]
pub struct Simulated {
    /// Frames of each sensor.
    pub streams: Vec<StreamCounts>,
    /// The file with the truth: `NAME.truth.json` beside `NAME.mcap`.
    pub truth: PathBuf,
}

/// The truth about a recording: what no sensor tells.
#[derive(Debug, Serialize)]
struct Truth<'a> {
    version: u32,
    seed: u64,
    sensors: Vec<SensorTruth<'a>>,
}

#[derive(Debug, Serialize)]
struct SensorTruth<'a> {
    name: &'a str,
    time_offset_ns: i64,
    readout_s: f64,
    faults: &'a [FaultSpec],
    frames: Vec<FrameTruth>,
}

#[derive(Debug, Serialize)]
struct FrameTruth {
    sequence: u64,
    delivered: bool,
    /// On the session's clock.
    true_ns: u64,
    stamp_ns: u64,
    exposure_s: f64,
    position_m: [f64; 3],
    quaternion_xyzw: [f64; 4],
    #[serde(flatten)]
    faults: FrameFaults,
}

/// A world to be recorded, and how.
pub struct Recording<'a> {
    /// What is recorded.
    pub world: &'a World,
    /// Computes what the sensors see, for example [`World::tracer`].
    pub tracer: Arc<dyn Tracer>,
    /// Keeps pictures for the next time.
    pub cache: Option<PictureCache>,
}

impl Recording<'_> {
    /// Writes all sensors into an MCAP file: frames as they would arrive (without those lost), calibrations as they truly
    /// are, and the true pose of each sensor at the true time of each frame, from `world` to the sensor's name. The world's
    /// text is kept as the session. The truth about every frame goes into a JSON file beside it. Controls stay as they
    /// are at the start.
    ///
    /// `progress` is told before each frame; it returns false to stop.
    ///
    /// # Errors
    /// [`SimulateError`]; a recording that was begun stays, and is readable.
    pub fn write(
        &self,
        path: &Path,
        options: RecordingOptions,
        mut progress: impl FnMut(Progress) -> bool,
    ) -> Result<Simulated, SimulateError> {
        let names = self.world.spec().sensors.keys();
        let sensors: Vec<SimSensor> = names
            .map(|name| Ok(self.world.sensor(name, Arc::clone(&self.tracer))?.with_cache(self.cache.clone())))
            .collect::<Result<_, WorldError>>()?;
        let options = RecordingOptions { session: Some(self.world.text().to_owned()), ..options };
        let mut writer = RecordingWriter::create(path, options)?;
        let mut streams = Vec::new();
        for sensor in &sensors {
            let rate = Some(sensor.spec().frames_per_second);
            streams.push(writer.add_stream(sensor.name(), Some(sensor.calibration()), rate)?);
        }
        let order = order(&sensors);
        let total = order.len() as u64;
        for (done, (sensor, frame)) in (0..).zip(order) {
            if !progress(Progress { done, total }) {
                writer.finish(&[])?;
                return Err(SimulateError::Stopped);
            }
            if let (Some(sensor), Some(stream)) = (sensors.get(sensor), streams.get(sensor)) {
                write_frame(&mut writer, sensor, *stream, frame)?;
            }
        }
        progress(Progress { done: total, total });
        let streams = writer.finish(&[])?;
        let truth = self.write_truth(path, &sensors)?;
        Ok(Simulated { streams, truth })
    }

    fn write_truth(&self, path: &Path, sensors: &[SimSensor]) -> Result<PathBuf, SimulateError> {
        let truth = Truth {
            version: 1,
            seed: self.world.spec().seed,
            sensors: sensors.iter().map(sensor_truth).collect(),
        };
        let path = path.with_extension("truth.json");
        let failed = |reason: String| SimulateError::Truth { path: path.clone(), reason };
        let text = serde_json::to_string_pretty(&truth).map_err(|error| failed(error.to_string()))?;
        std::fs::write(&path, text).map_err(|error| failed(error.to_string()))?;
        Ok(path)
    }
}

/// Index of the sensor and number of the frame, by arrival.
fn order(sensors: &[SimSensor]) -> Vec<(usize, u64)> {
    let frames = |(index, sensor): (usize, &SimSensor)| {
        (0..sensor.frame_count()).map(move |frame| (index, frame)).collect()
    };
    let mut order: Vec<(usize, u64)> = sensors.iter().enumerate().flat_map::<Vec<_>, _>(frames).collect();
    order.sort_by_key(|&(index, frame)| sensors.get(index).map(|sensor| sensor.timing().arrival(frame)));
    order
}

/// What the sensor's exposure is as long as nobody sets a control.
fn untouched(sensor: &SimSensor, time_s: f64) -> Exposure {
    Exposure { time: sensor.faults().pump(time_s).unwrap_or(1.0), ..Exposure::default() }
}

fn write_frame(
    writer: &mut RecordingWriter,
    sensor: &SimSensor,
    stream: StreamId,
    frame: u64,
) -> Result<(), SimulateError> {
    let time_s = sensor.timing().time_s(frame);
    if !sensor.faults().of_frame(frame, time_s).is_delivered() {
        return Ok(());
    }
    let made = sensor.frame(frame, &untouched(sensor, time_s));
    let made =
        made.map_err(|source| SimulateError::Frame { sensor: sensor.name().to_owned(), frame, source })?;
    writer.write(stream, &made, 0)?;
    let pose = sensor.world_from_sensor(time_s);
    writer.write_transform(&RecordedTransform {
        stamp: sensor.timing().true_stamp(frame),
        parent: "world".into(),
        child: sensor.name().to_owned(),
        translation_m: pose.position_m.to_array(),
        rotation_xyzw: pose.rotation.to_array(),
    })?;
    Ok(())
}

fn sensor_truth(sensor: &SimSensor) -> SensorTruth<'_> {
    let frame_truth = |frame| {
        let time_s = sensor.timing().time_s(frame);
        let faults = sensor.faults().of_frame(frame, time_s);
        let pose = sensor.world_from_sensor(time_s);
        FrameTruth {
            sequence: frame,
            delivered: faults.is_delivered(),
            true_ns: sensor.timing().true_stamp(frame).as_ns(),
            stamp_ns: sensor.timing().stamp(frame, faults.stamp_error_ns).as_ns(),
            exposure_s: sensor.spec().exposure_s * untouched(sensor, time_s).time,
            position_m: pose.position_m.to_array(),
            quaternion_xyzw: pose.rotation.to_array(),
            faults,
        }
    };
    SensorTruth {
        name: sensor.name(),
        time_offset_ns: sensor.timing().time_offset_ns,
        readout_s: sensor.calibration().readout_s,
        faults: sensor.faults().specs(),
        frames: (0..sensor.frame_count()).map(frame_truth).collect(),
    }
}
