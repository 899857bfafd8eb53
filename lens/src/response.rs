//! The camera's response: from the code values of a file or device to linear light and back.
//!
//! Codes are 0 to 1 (8-bit code ÷ 255); linear light is in units of *code white*: the light that just gives code 1 at
//! the calibration's exposure. Neither direction clips: codes and light outside of 0 to 1 go on smoothly, so that
//! noise around black keeps its mean.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::calibration::Mistake;

/// A colour channel of an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Channel {
    /// The first.
    Red,
    /// The second.
    Green,
    /// The third.
    Blue,
}

impl Channel {
    /// All, in the order of an image.
    pub const ALL: [Self; 3] = [Self::Red, Self::Green, Self::Blue];
}

/// How code values follow from light. Without a photometric calibration: `srgb`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum Response {
    /// IEC 61966-2-1, what webcams that deliver JPEG or RGB claim to be.
    #[default]
    Srgb,
    /// ITU-R BT.709's camera curve, with the exact constants of BT.2020 (α = 1.09929…), so that it has no step.
    Rec709,
    /// A power law: linear light = code^gamma.
    Gamma {
        /// The exponent, 0.2 to 5; 1 is linear, 2.2 is usual.
        #[schemars(range(min = 0.2, max = 5.0))]
        gamma: f64,
    },
    /// Codes are proportional to light: raw images.
    Linear,
    /// Measured curves, one for each channel.
    Table(ResponseTable),
}

/// A measured inverse response: the linear light that each code stands for. Straight between the points.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ResponseTable {
    /// The codes of the points, rising from 0 to 1. Left out: evenly spaced, so 256 points are the 256 codes of an
    /// 8-bit image.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub codes: Option<Vec<f64>>,
    /// Linear light of the red channel at each code, 2 to 4096 numbers, rising, the first from 0 to less than 1, the
    /// last 1 (to 0.001).
    pub red: Vec<f64>,
    /// As `red`, for the green channel.
    pub green: Vec<f64>,
    /// As `red`, for the blue channel.
    pub blue: Vec<f64>,
}

/// Most points of a table.
const MAX_POINTS: usize = 4096;
/// Steps of a table that are flatter than this cannot be inverted.
const MIN_STEP: f64 = 1e-9;
/// Fitted curves end near code white, not on it.
const MAX_WHITE_ERROR: f64 = 1e-3;
/// Bounds slopes where a curve is flat or vertical (a gamma curve at black).
const MIN_SLOPE: f64 = 1e-6;

const SRGB_CODE: f64 = 0.04045;
/// BT.2020-2, table 4: the α and β for which the two pieces of the curve meet with one slope.
const REC709_ALPHA: f64 = 1.099_296_826_809_44;
const REC709_BETA: f64 = 0.018_053_968_510_807;

impl Response {
    /// What a calibration file calls it.
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Srgb => "srgb",
            Self::Rec709 => "rec709",
            Self::Gamma { .. } => "gamma",
            Self::Linear => "linear",
            Self::Table(_) => "table",
        }
    }

    /// The linear light, in units of code white, that a code (0 to 1) stands for.
    pub fn inverse(&self, channel: Channel, code: f64) -> f64 {
        match self {
            Self::Srgb => {
                odd(
                    code,
                    |code| {
                        if code <= SRGB_CODE { code / 12.92 } else { ((code + 0.055) / 1.055).powf(2.4) }
                    },
                )
            }
            Self::Rec709 => odd(code, |code| {
                if code <= 4.5 * REC709_BETA {
                    code / 4.5
                } else {
                    ((code + REC709_ALPHA - 1.0) / REC709_ALPHA).powf(1.0 / 0.45)
                }
            }),
            Self::Gamma { gamma } => odd(code, |code| code.powf(*gamma)),
            Self::Linear => code,
            Self::Table(table) => {
                let segment = table.segment_of_code(channel, code);
                segment.light + (code - segment.code) * segment.light_per_code
            }
        }
    }

    /// The code (0 to 1 where nothing clips) that linear light, in units of code white, gives: the inverse of
    /// [`Response::inverse`].
    pub fn forward(&self, channel: Channel, light: f64) -> f64 {
        match self {
            Self::Srgb => odd(light, |light| {
                if light <= SRGB_CODE / 12.92 { light * 12.92 } else { 1.055 * light.powf(1.0 / 2.4) - 0.055 }
            }),
            Self::Rec709 => odd(light, |light| {
                if light <= REC709_BETA {
                    light * 4.5
                } else {
                    REC709_ALPHA * light.powf(0.45) - (REC709_ALPHA - 1.0)
                }
            }),
            Self::Gamma { gamma } => odd(light, |light| light.powf(1.0 / gamma)),
            Self::Linear => light,
            Self::Table(table) => {
                let segment = table.segment_of_light(channel, light);
                segment.code + (light - segment.light) / segment.light_per_code
            }
        }
    }

    /// The derivative of [`Response::inverse`]: linear light per code. Between 1e-6 and 1e6.
    pub fn inverse_slope(&self, channel: Channel, code: f64) -> f64 {
        let size = code.abs();
        let slope = match self {
            Self::Srgb if size <= SRGB_CODE => 1.0 / 12.92,
            Self::Srgb => 2.4 / 1.055 * ((size + 0.055) / 1.055).powf(1.4),
            Self::Rec709 if size <= 4.5 * REC709_BETA => 1.0 / 4.5,
            Self::Rec709 => {
                ((size + REC709_ALPHA - 1.0) / REC709_ALPHA).powf(1.0 / 0.45 - 1.0) / (0.45 * REC709_ALPHA)
            }
            Self::Gamma { gamma } => gamma * size.powf(gamma - 1.0),
            Self::Linear => 1.0,
            Self::Table(table) => table.segment_of_code(channel, code).light_per_code,
        };
        slope.clamp(MIN_SLOPE, 1.0 / MIN_SLOPE)
    }

    /// The derivative of [`Response::forward`]: code per linear light. Between 1e-6 and 1e6.
    pub fn forward_slope(&self, channel: Channel, light: f64) -> f64 {
        1.0 / self.inverse_slope(channel, self.forward(channel, light))
    }

    /// [`Response::inverse`] of an RGB pixel in single precision.
    pub fn inverse_rgb(&self, codes: [f32; 3]) -> [f32; 3] {
        let [r, g, b] = codes.map(f64::from);
        let rgb = [(Channel::Red, r), (Channel::Green, g), (Channel::Blue, b)];
        rgb.map(|(channel, code)| self.inverse(channel, code) as f32)
    }

    /// [`Response::forward`] of an RGB pixel in single precision.
    pub fn forward_rgb(&self, light: [f32; 3]) -> [f32; 3] {
        let [r, g, b] = light.map(f64::from);
        let rgb = [(Channel::Red, r), (Channel::Green, g), (Channel::Blue, b)];
        rgb.map(|(channel, light)| self.forward(channel, light) as f32)
    }

    /// The first mistake, its key counted from the response, or `None`.
    pub fn mistake(&self) -> Option<Mistake> {
        match self {
            Self::Gamma { gamma } if !(0.2..=5.0).contains(gamma) => {
                Some(Mistake::new(&["gamma"], format!("`{gamma}` is out of range"), "0.2 to 5"))
            }
            Self::Table(table) => table.mistake(),
            _ => None,
        }
    }
}

/// The curve mirrored about black, for codes and light below 0.
fn odd(x: f64, curve: impl Fn(f64) -> f64) -> f64 {
    curve(x.abs()).copysign(x)
}

/// One straight piece of a table.
struct Segment {
    code: f64,
    light: f64,
    light_per_code: f64,
}

impl ResponseTable {
    /// The linear light of a channel at each code.
    pub fn light(&self, channel: Channel) -> &[f64] {
        match channel {
            Channel::Red => &self.red,
            Channel::Green => &self.green,
            Channel::Blue => &self.blue,
        }
    }

    fn code(&self, point: usize) -> f64 {
        let last = self.red.len().saturating_sub(1).max(1);
        let even = point as f64 / last as f64;
        self.codes.as_ref().map_or(even, |codes| codes.get(point).copied().unwrap_or(even))
    }

    /// The piece that starts at the last point for which `before` holds; the outermost pieces go on for ever.
    fn segment(&self, channel: Channel, points_before: usize) -> Segment {
        let light = self.light(channel);
        let start = points_before.saturating_sub(1).min(light.len().saturating_sub(2));
        let at = |point: usize| light.get(point).copied().unwrap_or(self.code(point));
        let (code, next_code) = (self.code(start), self.code(start + 1));
        let rise = (at(start + 1) - at(start)) / (next_code - code);
        Segment { code, light: at(start), light_per_code: rise }
    }

    fn segment_of_code(&self, channel: Channel, code: f64) -> Segment {
        let points = self.light(channel).len();
        let before = match &self.codes {
            Some(codes) => codes.partition_point(|c| *c <= code),
            None => (code.clamp(0.0, 1.0) * points.saturating_sub(1) as f64) as usize + 1,
        };
        self.segment(channel, before)
    }

    fn segment_of_light(&self, channel: Channel, light: f64) -> Segment {
        self.segment(channel, self.light(channel).partition_point(|l| *l <= light))
    }

    fn mistake(&self) -> Option<Mistake> {
        const CODES: &str = "codes rise from 0 to 1";
        const LIGHT: &str = "light rises with the code, from a first value in 0 to 1 to 1";
        let points = self.red.len();
        let wrong = |key, message, allowed| Some(Mistake::new(&[key], message, allowed));
        for (key, list) in [("red", &self.red), ("green", &self.green), ("blue", &self.blue)] {
            if !(2..=MAX_POINTS).contains(&list.len()) {
                return wrong(key, format!("{} points", list.len()), "2 to 4096 points");
            }
            if list.len() != points {
                let message = format!("{} points, but red has {points}", list.len());
                return wrong(key, message, "every channel has the same number of points");
            }
            if let Some((at, message)) = not_rising(list, 0.0..1.0) {
                return Some(Mistake::new(&[key, &at.to_string()], message, LIGHT));
            }
        }
        let codes = self.codes.as_ref()?;
        if codes.len() != points {
            let message = format!("{} codes, but red has {points} points", codes.len());
            return wrong("codes", message, "one code for each point");
        }
        let (at, message) = not_rising(codes, 0.0..MIN_STEP)?;
        Some(Mistake::new(&["codes", &at.to_string()], message, CODES))
    }
}

/// The first number that does not fit a list that rises from within `first` to 1, and what is wrong with it.
fn not_rising(list: &[f64], first: std::ops::Range<f64>) -> Option<(usize, String)> {
    let (start, end) = (list.first()?, list.last()?);
    if !first.contains(start) {
        return Some((0, format!("the first value is {start}")));
    }
    let fall = list.windows(2).position(|pair| pair[1] - pair[0] < MIN_STEP || !pair[1].is_finite());
    if let Some(at) = fall {
        return Some((at + 1, format!("{} does not rise above the value before it", list[at + 1])));
    }
    ((end - 1.0).abs() > MAX_WHITE_ERROR).then(|| (list.len() - 1, format!("the last value is {end}")))
}
