//! What Foxglove's image schemas cannot say of a frame: our own message beside each image.

use std::time::Duration;

use foxglove::Schema;
use foxglove::prost_types::OneofDescriptorProto;
use foxglove::prost_types::field_descriptor_proto::{Label, Type};
use foxglove::prost_types::{DescriptorProto, FieldDescriptorProto, FileDescriptorProto, FileDescriptorSet};
use prost::Message;

use crate::clock::Timestamp;
use crate::frame::Frame;
use crate::pixel_format::{ColorEncoding, PixelFormat, YuvMatrix, YuvRange};
use crate::pool::PixelBuffer;

/// The name of the schema in the file.
pub(crate) const SCHEMA_NAME: &str = "coshade.FrameInfo";

/// Everything of a [`Frame`] but its pixels.
///
/// Written just before the image, with the same log time and sequence; the numbers of the fields are fixed.
#[derive(Clone, PartialEq, Message)]
pub(crate) struct FrameInfo {
    #[prost(string, tag = "1")]
    pub(crate) format: String,
    #[prost(uint32, tag = "2")]
    pub(crate) width_px: u32,
    #[prost(uint32, tag = "3")]
    pub(crate) height_px: u32,
    #[prost(uint32, tag = "4")]
    pub(crate) stride_bytes: u32,
    #[prost(fixed64, tag = "5")]
    pub(crate) captured_ns: u64,
    #[prost(fixed64, tag = "6")]
    pub(crate) arrived_ns: u64,
    #[prost(uint64, tag = "7")]
    pub(crate) sequence: u64,
    #[prost(uint64, optional, tag = "8")]
    pub(crate) exposure_ns: Option<u64>,
    #[prost(float, optional, tag = "9")]
    pub(crate) gain: Option<f32>,
    #[prost(string, tag = "10")]
    pub(crate) yuv_matrix: String,
    #[prost(string, tag = "11")]
    pub(crate) yuv_range: String,
    #[prost(double, optional, tag = "12")]
    pub(crate) depth_unit_m: Option<f64>,
    /// Frames of this stream that the recorder had to drop before this one.
    #[prost(uint64, tag = "13")]
    pub(crate) dropped_before: u64,
}

const FORMATS: [(PixelFormat, &str); 9] = [
    (PixelFormat::Yuyv, "yuyv"),
    (PixelFormat::Uyvy, "uyvy"),
    (PixelFormat::Nv12, "nv12"),
    (PixelFormat::Grey, "grey"),
    (PixelFormat::Y16, "y16"),
    (PixelFormat::Z16, "z16"),
    (PixelFormat::Rgb24, "rgb24"),
    (PixelFormat::RgbF32, "rgbf32"),
    (PixelFormat::Mjpg, "mjpg"),
];
const MATRICES: [(YuvMatrix, &str); 2] = [(YuvMatrix::Bt601, "bt601"), (YuvMatrix::Bt709, "bt709")];
const RANGES: [(YuvRange, &str); 2] = [(YuvRange::Full, "full"), (YuvRange::Limited, "limited")];

fn name_of<T: PartialEq>(table: &[(T, &'static str)], value: &T) -> &'static str {
    table.iter().find(|(entry, _)| entry == value).map_or("", |(_, name)| name)
}

fn named<T: Copy>(table: &[(T, &'static str)], wanted: &str, what: &str) -> Result<T, String> {
    let found = table.iter().find(|(_, name)| *name == wanted).map(|(value, _)| *value);
    found.ok_or_else(|| {
        let known: Vec<_> = table.iter().map(|(_, name)| *name).collect();
        format!("its {what} is {wanted:?}, known are {}", known.join(", "))
    })
}

/// The name of a format in files, as used in `coshade.FrameInfo`.
pub(crate) fn format_name(format: PixelFormat) -> &'static str {
    name_of(&FORMATS, &format)
}

impl FrameInfo {
    pub(crate) fn of(frame: &Frame, dropped_before: u64) -> Self {
        Self {
            format: format_name(frame.format).into(),
            width_px: frame.width_px,
            height_px: frame.height_px,
            stride_bytes: frame.stride_bytes,
            captured_ns: frame.captured.as_ns(),
            arrived_ns: frame.arrived.as_ns(),
            sequence: frame.sequence,
            exposure_ns: frame.exposure.map(|time| u64::try_from(time.as_nanos()).unwrap_or(u64::MAX)),
            gain: frame.gain,
            yuv_matrix: name_of(&MATRICES, &frame.color.matrix).into(),
            yuv_range: name_of(&RANGES, &frame.color.range).into(),
            depth_unit_m: frame.depth_unit_m,
            dropped_before,
        }
    }

    /// The frame that has these properties and `pixels`.
    ///
    /// # Errors
    /// What contradicts itself or is not known.
    pub(crate) fn frame(&self, pixels: PixelBuffer) -> Result<Frame, String> {
        let color = ColorEncoding {
            matrix: named(&MATRICES, &self.yuv_matrix, "matrix")?,
            range: named(&RANGES, &self.yuv_range, "range")?,
        };
        let frame = Frame {
            format: named(&FORMATS, &self.format, "format")?,
            color,
            width_px: self.width_px,
            height_px: self.height_px,
            stride_bytes: self.stride_bytes,
            pixels,
            captured: Timestamp::from_ns(self.captured_ns),
            arrived: Timestamp::from_ns(self.arrived_ns),
            sequence: self.sequence,
            exposure: self.exposure_ns.map(Duration::from_nanos),
            gain: self.gain,
            depth_unit_m: self.depth_unit_m,
        };
        frame.check().map_err(|error| error.to_string())?;
        Ok(frame)
    }

    /// The message's schema, as other programs read it.
    pub(crate) fn schema() -> Schema {
        let fields = [
            ("format", 1, Type::String, false),
            ("width_px", 2, Type::Uint32, false),
            ("height_px", 3, Type::Uint32, false),
            ("stride_bytes", 4, Type::Uint32, false),
            ("captured_ns", 5, Type::Fixed64, false),
            ("arrived_ns", 6, Type::Fixed64, false),
            ("sequence", 7, Type::Uint64, false),
            ("exposure_ns", 8, Type::Uint64, true),
            ("gain", 9, Type::Float, true),
            ("yuv_matrix", 10, Type::String, false),
            ("yuv_range", 11, Type::String, false),
            ("depth_unit_m", 12, Type::Double, true),
            ("dropped_before", 13, Type::Uint64, false),
        ];
        let mut message = DescriptorProto { name: Some("FrameInfo".into()), ..Default::default() };
        for (name, number, kind, optional) in fields {
            // An optional field of proto3 is the one member of a oneof whose name begins with an underscore.
            let oneof_index = optional.then_some(message.oneof_decl.len() as i32);
            if optional {
                message
                    .oneof_decl
                    .push(OneofDescriptorProto { name: Some(format!("_{name}")), options: None });
            }
            message.field.push(FieldDescriptorProto {
                name: Some(name.into()),
                number: Some(number),
                label: Some(Label::Optional.into()),
                r#type: Some(kind.into()),
                oneof_index,
                proto3_optional: optional.then_some(true),
                ..Default::default()
            });
        }
        let file = FileDescriptorProto {
            name: Some("coshade/FrameInfo.proto".into()),
            package: Some("coshade".into()),
            message_type: vec![message],
            syntax: Some("proto3".into()),
            ..Default::default()
        };
        Schema::new(SCHEMA_NAME, "protobuf", FileDescriptorSet { file: vec![file] }.encode_to_vec())
    }
}
