//! The calibration file: all that is known about one camera.
//!
//! A `camera.toml` holds the lens, the response, vignetting and noise of a camera at one image size, and how they
//! were found. It is data with its evaluation; what finds the numbers lives elsewhere.

mod mistake;
mod provenance;
mod scale;

use std::path::Path;

use coshade_config::Document;
use nalgebra::{Matrix3, Rotation3, Vector2, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::model::{CameraModel, ModelError, ModelKind};
pub use crate::noise::{Noise, NoiseAtGain};
use crate::pixel::CameraPx;
use crate::raster::{CameraRaster, ImageCircle, MAX_SIDE_PX, RasterError};
pub use crate::response::{Channel, Response, ResponseTable};
pub use crate::vignetting::Vignetting;
pub use mistake::Mistake;
pub use provenance::Provenance;
pub use scale::ScaleWarning;

/// The version of the file's keys that this program reads and writes.
pub const VERSION: u32 = 1;

/// Above this field of view an uncalibrated lens is taken for a fish-eye.
const WIDEST_PINHOLE_RAD: f64 = 2.0;

/// Why a calibration cannot be read, written, made or used.
#[derive(Debug, thiserror::Error)]
pub enum CalibrationError {
    /// The file cannot be read or written, or says something that is not allowed.
    #[error(transparent)]
    File(#[from] coshade_config::Error),
    /// A value is not allowed.
    #[error("the calibration is not valid: {0}")]
    Invalid(Mistake),
    /// The lens' parameters are not allowed.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// The image's size is not allowed.
    #[error(transparent)]
    Raster(#[from] RasterError),
    /// The calibration is for an image of another shape.
    #[error(
        "the calibration is for {}×{} pixels and cannot be used for {}×{}: the shapes differ, so the camera crops its \
         image; calibrate at {}×{}, or choose a mode of the calibration's shape",
        from[0], from[1], to[0], to[1], to[0], to[1]
    )]
    Aspect {
        /// Size of the calibration, in pixels.
        from: [u32; 2],
        /// Size asked for, in pixels.
        to: [u32; 2],
    },
}

/// One camera at one image size. Written as TOML.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Calibration {
    /// Version of the file's keys: 1.
    #[schemars(range(min = 1, max = 1))]
    pub version: u32,
    /// Width and height, in pixels, of the images that the calibration holds for; 1 to 16384 each.
    #[schemars(inner(range(min = 1, max = 16384)))]
    pub size_px: [u32; 2],
    /// Rolling shutter: seconds from the read-out of the first row to that of the last; 0 for a global shutter. 0 to 1.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 1.0))]
    pub readout_s: f64,
    /// The lens: name of the camera model, and its parameters.
    #[serde(rename = "lens")]
    pub model: CameraModel,
    /// The part of the image that the lens fills. Left out: all of it, as far as the lens model reaches.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub image_circle: Option<ImageCircle>,
    /// How code values follow from light. Left out: sRGB is assumed.
    #[serde(default)]
    pub response: Response,
    /// Falloff of the light towards the border. Left out: none.
    #[serde(default)]
    pub vignetting: Vignetting,
    /// Sensor noise. Left out: not known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub noise: Option<Noise>,
    /// How this camera's light compares with the see-through camera's. Left out: it is the same.
    #[serde(default)]
    pub radiometric: Radiometric,
    /// How the calibration came about.
    #[serde(default)]
    pub provenance: Provenance,
}

/// Brings this camera's linear RGB to the session's working space: that of the see-through camera, with 1 = code white
/// at its calibration exposure.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Radiometric {
    /// Factor on all channels: the see-through camera's value of a grey surface divided by this camera's, both at their
    /// calibration exposures. More than 0.
    #[serde(default = "one")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub scale: f64,
    /// Three rows of three numbers: working RGB = scale · matrix · this camera's linear RGB.
    #[serde(default = "identity")]
    pub color_matrix: [[f64; 3]; 3],
}

fn one() -> f64 {
    1.0
}

fn identity() -> [[f64; 3]; 3] {
    [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
}

impl Default for Radiometric {
    fn default() -> Self {
        Self { scale: one(), color_matrix: identity() }
    }
}

impl Radiometric {
    /// The matrix from this camera's linear RGB to the working space, the scale included.
    pub fn working_from_camera(&self) -> Matrix3<f64> {
        Matrix3::from_fn(|row, column| self.scale * self.color_matrix[row][column])
    }

    fn mistake(&self) -> Option<Mistake> {
        if !(1e-9..1e9).contains(&self.scale) {
            return Some(Mistake::new(
                &["scale"],
                format!("`{}` is out of range", self.scale),
                "1e-9 to 1e9",
            ));
        }
        let matrix = Matrix3::from_fn(|row, column| self.color_matrix[row][column]);
        // NaN and infinities fail both comparisons.
        if !(matrix.amax() < 1e3 && matrix.determinant().abs() > 1e-6) {
            let message = format!("{:?} cannot be inverted", self.color_matrix);
            let allowed = "nine numbers between −1000 and 1000 with a determinant that is not 0";
            return Some(Mistake::new(&["color_matrix"], message, allowed));
        }
        None
    }
}

impl Calibration {
    /// Reads a calibration file.
    ///
    /// # Errors
    /// A file that cannot be read, is no TOML, has unknown or missing keys or values that are not allowed. The message
    /// names file, line and key, and what is allowed.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, CalibrationError> {
        let document = Document::<Self>::read(path)?;
        Self::checked(document)
    }

    /// As [`Calibration::read`] from a text; `path` is the file that messages name.
    ///
    /// # Errors
    /// As [`Calibration::read`].
    pub fn parse(text: &str, path: impl AsRef<Path>) -> Result<Self, CalibrationError> {
        Self::checked(Document::parse(text, path)?)
    }

    /// Writes a calibration file, whole or not at all. In a file that is there already only the keys that differ are
    /// touched: comments and order stay.
    ///
    /// # Errors
    /// A calibration with mistakes, a file that cannot be written, a file at `path` that is not a valid
    /// calibration (it is left alone). Nothing is written then.
    pub fn write(&self, path: impl AsRef<Path>) -> Result<(), CalibrationError> {
        let path = path.as_ref();
        self.validate()?;
        let mut document = if path.exists() { Document::read(path)? } else { Document::new(self, path)? };
        document.set(self)?;
        Ok(document.save()?)
    }

    fn checked(document: Document<Self>) -> Result<Self, CalibrationError> {
        let problem = |mistake: Mistake| {
            document.error_at(
                mistake.key.as_slice(),
                mistake.message,
                format!("allowed: {}", mistake.allowed),
            )
        };
        let problems = document.value().mistakes().into_iter().map(problem).collect();
        Document::<Self>::reject(problems)?;
        Ok(document.into_value())
    }

    /// A calibration for a camera that nobody calibrated: square pixels, the optical axis through the middle of the
    /// image, no distortion (above 115° an equidistant fish-eye), and sRGB assumed. `fov_x_rad` spans the image's width.
    ///
    /// # Errors
    /// A size of 0 or beyond 16384, a field of view outside of 0 to 2π.
    pub fn default_for(size_px: [u32; 2], fov_x_rad: f64) -> Result<Self, CalibrationError> {
        if !(fov_x_rad > 0.01 && fov_x_rad < std::f64::consts::TAU) {
            return Err(CalibrationError::Raster(RasterError::Parameter {
                name: "fov_x_rad",
                value: fov_x_rad.to_string(),
                allowed: "0.01 to 2π",
            }));
        }
        let [width, height] = size_px.map(f64::from);
        let (cx, cy) = (width / 2.0 - 0.5, height / 2.0 - 0.5);
        let model = if fov_x_rad <= WIDEST_PINHOLE_RAD {
            let f = width / 2.0 / (fov_x_rad / 2.0).tan();
            CameraModel::from_params(ModelKind::Pinhole, &[f, f, cx, cy])?
        } else {
            let f = width / fov_x_rad;
            CameraModel::from_params(ModelKind::KannalaBrandt4, &[f, f, cx, cy, 0.0, 0.0, 0.0, 0.0])?
        };
        let notes = format!(
            "Not calibrated: sRGB assumed, no vignetting, no distortion, {:.1}° wide.",
            fov_x_rad.to_degrees()
        );
        let calibration = Self {
            version: VERSION,
            size_px,
            readout_s: 0.0,
            model,
            image_circle: None,
            response: Response::Srgb,
            vignetting: Vignetting::None,
            noise: None,
            radiometric: Radiometric::default(),
            provenance: Provenance { notes: Some(notes), ..Provenance::default() },
        };
        calibration.validate()?;
        Ok(calibration)
    }

    /// Everything that is not allowed, in the order of the keys.
    pub fn mistakes(&self) -> Vec<Mistake> {
        let [width, height] = self.size_px;
        let size_fits = [width, height].iter().all(|side| (1..=MAX_SIDE_PX).contains(side));
        let size = (!size_fits).then(|| {
            Mistake::new(&["size_px"], format!("{width}×{height} pixels"), "sides of 1 to 16384 pixels")
        });
        let version = (self.version != VERSION).then(|| {
            Mistake::new(
                &["version"],
                format!("`{}` is not known", self.version),
                "1, the only version so far",
            )
        });
        let readout = (!(0.0..=1.0).contains(&self.readout_s)).then(|| {
            Mistake::new(&["readout_s"], format!("`{}` is out of range", self.readout_s), "0 to 1 second")
        });
        let below = |key: &'static str| move |mistake: Mistake| mistake.below(key);
        let vignetting = self.vignetting.mistake(|center| self.farthest_px(center));
        [
            version,
            size,
            readout,
            self.image_circle.and_then(|circle| circle.mistake()).map(below("image_circle")),
            self.response.mistake().map(below("response")),
            vignetting.map(below("vignetting")),
            self.noise.as_ref().and_then(Noise::mistake).map(below("noise")),
            self.radiometric.mistake().map(below("radiometric")),
            self.provenance.mistake(self.model.param_names()).map(below("provenance")),
        ]
        .into_iter()
        .flatten()
        .collect()
    }

    /// Checks a calibration that was made in memory.
    ///
    /// # Errors
    /// The first of [`Calibration::mistakes`].
    pub fn validate(&self) -> Result<(), CalibrationError> {
        self.mistakes().into_iter().next().map_or(Ok(()), |mistake| Err(CalibrationError::Invalid(mistake)))
    }

    /// The raster of this camera's images, its axes turned by `camera_from_frame`.
    ///
    /// # Errors
    /// A size or image circle that is not allowed, a matrix that is no rotation.
    pub fn raster(&self, camera_from_frame: Rotation3<f64>) -> Result<CameraRaster, RasterError> {
        CameraRaster::new(self.model, self.size_px, self.image_circle.unwrap_or_default(), camera_from_frame)
    }

    /// Linear RGB of the working space from the codes (0 to 1) of the pixel at `position`, at the calibration's
    /// exposure: inverse response, vignetting, colour matrix and scale. `None` where the lens sees nothing.
    pub fn working_rgb(&self, position: CameraPx, codes: [f64; 3]) -> Option<Vector3<f64>> {
        let ray = self.model.unproject(&position.0)?;
        let gain = self.vignetting.gain(position, off_axis_rad(&ray));
        let [r, g, b] = codes;
        let light = Vector3::new(
            self.response.inverse(Channel::Red, r),
            self.response.inverse(Channel::Green, g),
            self.response.inverse(Channel::Blue, b),
        );
        Some(self.radiometric.working_from_camera() * light * gain)
    }

    /// The largest distance from `center_px` to a place of the image that is seen, on a grid over the image.
    fn farthest_px(&self, center_px: [f64; 2]) -> f64 {
        const STEPS: u32 = 32;
        let circle = self.image_circle.unwrap_or_default();
        let [width, height] = self.size_px.map(|side| f64::from(side) - 1.0);
        let grid = (0..=STEPS).flat_map(|y| (0..=STEPS).map(move |x| (x, y)));
        let places = grid.map(|(x, y)| {
            CameraPx::new(f64::from(x) / f64::from(STEPS) * width, f64::from(y) / f64::from(STEPS) * height)
        });
        let seen = |place: &CameraPx| {
            let ray = self.model.unproject(&place.0);
            ray.is_some_and(|ray| circle.contains(*place, off_axis_rad(&ray)))
        };
        places.filter(seen).map(|place| (place.0 - Vector2::from(center_px)).norm()).fold(0.0, f64::max)
    }
}

fn off_axis_rad(ray: &Vector3<f64>) -> f64 {
    ray.x.hypot(ray.y).atan2(ray.z)
}
