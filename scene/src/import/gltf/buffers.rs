//! Buffers and views into them.

use std::borrow::Cow;
use std::path::Path;

use ::gltf::Document;
use ::gltf::buffer::{Data, Source};
use ::gltf::json::buffer::View;

use super::super::files;
use super::Fault;

/// All buffers of a document.
pub(super) struct Buffers<'a> {
    data: Vec<Cow<'a, [u8]>>,
    views: &'a [View],
}

impl<'a> Buffers<'a> {
    /// Reads them from the container, from data URIs and from files beside the document.
    pub fn read(document: &'a Document, binary: Option<&'a [u8]>, folder: &Path) -> Result<Self, Fault> {
        let root = document.as_json();
        let mut data = Vec::with_capacity(root.buffers.len());
        for (number, buffer) in root.buffers.iter().enumerate() {
            let place = format!("buffers[{number}]");
            let bytes: Cow<'a, [u8]> = match &buffer.uri {
                Some(uri) => read_uri(uri, folder, &place)?.into(),
                None => match binary {
                    Some(binary) if number == 0 => binary.into(),
                    _ => return Err(Fault::new(place, "neither a URI nor a binary chunk")),
                },
            };
            let expected = usize::try_from(buffer.byte_length.0).unwrap_or(usize::MAX);
            if bytes.len() < expected {
                return Err(Fault::new(
                    place,
                    format!("byteLength is {expected}, but there are {} bytes", bytes.len()),
                ));
            }
            data.push(bytes);
        }
        Ok(Self { data, views: &root.buffer_views })
    }

    /// The bytes of a view and its stride, if it has one.
    pub fn view(&self, number: usize) -> Result<(&[u8], Option<usize>), Fault> {
        let fault = |problem| Fault::new(format!("bufferViews[{number}]"), problem);
        let view =
            self.views.get(number).ok_or_else(|| fault(format!("there are only {}", self.views.len())))?;
        let buffer = self.data.get(view.buffer.value()).ok_or_else(|| fault("no such buffer".to_owned()))?;
        let start = usize::try_from(view.byte_offset.unwrap_or_default().0).unwrap_or(usize::MAX);
        let length = usize::try_from(view.byte_length.0).unwrap_or(usize::MAX);
        let bytes = start.checked_add(length).and_then(|end| buffer.get(start..end));
        let bytes = bytes.ok_or_else(|| {
            fault(format!("{length} bytes from {start} on, but the buffer has {}", buffer.len()))
        })?;
        // The crate's validation refuses other strides than 4–252.
        Ok((bytes, view.byte_stride.map(|stride| stride.0).filter(|&stride| stride > 0)))
    }
}

/// The bytes behind a data URI or a relative reference.
pub(super) fn read_uri(uri: &str, folder: &Path, place: &str) -> Result<Vec<u8>, Fault> {
    if !uri.starts_with("data:") {
        return files::read_beside(folder, &files::percent_decoded(uri, place)?, place);
    }
    if !uri.contains(";base64,") {
        return Err(Fault::new(place, "the data URI is not in base64"));
    }
    let decoded = Data::from_source(Source::Uri(uri), None);
    decoded.map(|data| data.0).map_err(|error| Fault::new(place, format!("data URI: {error}")))
}
