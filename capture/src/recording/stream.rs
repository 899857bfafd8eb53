//! The image streams of a recording: which channels they are made of, and what is known of them.

use std::collections::BTreeMap;

use super::container::{Channel, Container, Encoding};
use super::foreign::ForeignStream;
use super::frame_info::SCHEMA_NAME;
use super::image_message::{self, ImageKind};

/// Key of a channel's metadata that names the stream it belongs to.
pub(crate) const STREAM_KEY: &str = "coshade.stream";

/// Key of a channel's metadata with the stream's nominal rate.
pub(crate) const RATE_KEY: &str = "coshade.frames_per_second";

/// An image stream of a recording.
#[derive(Clone, Debug, PartialEq)]
pub struct RecordedStream {
    /// The name it was recorded by; its topic without the leading slash if another program recorded it.
    pub name: String,
    /// The topic of its images.
    pub topic: String,
    /// The type of its messages.
    pub schema: String,
    /// Whether every property of its frames is recorded, not only the image.
    pub complete: bool,
    /// The nominal rate, if it was recorded.
    pub frames_per_second: Option<f64>,
    /// The calibration file that was recorded with it (TOML), byte for byte.
    pub calibration_toml: Option<String>,
}

/// What a channel is to the streams.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Role {
    Image { stream: usize, kind: ImageKind, encoding: Encoding, foreign: ForeignStream },
    Info { stream: usize },
}

/// The streams of a file and the role of each of its channels.
pub(super) fn find(container: &dyn Container) -> (Vec<RecordedStream>, BTreeMap<u32, Role>) {
    let mut streams: Vec<RecordedStream> = Vec::new();
    let mut roles = BTreeMap::new();
    for (id, channel, kind) in image_channels(container) {
        let own_name = channel.metadata.get(STREAM_KEY);
        let name = own_name.map_or_else(|| channel.topic.trim_start_matches('/').to_owned(), Clone::clone);
        let known = own_name
            .and_then(|name| streams.iter().position(|stream| stream.complete && stream.name == *name));
        let stream = known.unwrap_or_else(|| {
            streams.push(describe(container, channel, name));
            streams.len() - 1
        });
        let encoding = channel.encoding.clone();
        let foreign = ForeignStream { depth_unit_m: None };
        roles.insert(id, Role::Image { stream, kind, encoding, foreign });
    }
    for (&id, channel) in container.channels().iter().filter(|(_, channel)| channel.schema == SCHEMA_NAME) {
        let name = channel.metadata.get(STREAM_KEY);
        let stream = streams.iter().position(|stream| stream.complete && Some(&stream.name) == name);
        if let Some(stream) = stream {
            roles.insert(id, Role::Info { stream });
        }
    }
    (streams, roles)
}

/// In the order in which their streams were added. A recorder makes the channel of a stream's images with its first
/// image, so which of two comes first is chance; the channel of its [`FrameInfo`](super::FrameInfo) is made at once.
fn image_channels(container: &dyn Container) -> Vec<(u32, &Channel, ImageKind)> {
    let channels = container.channels();
    let added: BTreeMap<&String, u32> = channels
        .iter()
        .filter(|(_, channel)| channel.schema == SCHEMA_NAME)
        .filter_map(|(&id, channel)| Some((channel.metadata.get(STREAM_KEY)?, id)))
        .collect();
    let order = |id: u32, channel: &Channel| {
        channel.metadata.get(STREAM_KEY).and_then(|name| added.get(name)).map_or(id, |&added| added)
    };
    let mut found: Vec<_> = channels
        .iter()
        .filter_map(|(&id, channel)| Some((id, channel, image_message::kind(channel)?)))
        .collect();
    found.sort_by_key(|&(id, channel, _)| (order(id, channel), id));
    found
}

fn describe(container: &dyn Container, channel: &Channel, name: String) -> RecordedStream {
    let own = channel.metadata.contains_key(STREAM_KEY);
    let attachment = attachment_name(&name);
    let calibration = container.attachments().iter().rev().find(|file| own && file.name == attachment);
    RecordedStream {
        name,
        topic: channel.topic.clone(),
        schema: channel.schema.clone(),
        complete: own,
        frames_per_second: channel.metadata.get(RATE_KEY).and_then(|rate| rate.parse().ok()),
        calibration_toml: calibration.and_then(|file| String::from_utf8(file.data.clone()).ok()),
    }
}

/// The name of the attachment with a stream's calibration file.
pub(crate) fn attachment_name(stream: &str) -> String {
    format!("{stream}/calibration.toml")
}
