//! The binary container (glTF 2.0, section 4).

use super::Fault;

/// The two chunks.
pub(super) struct Container<'a> {
    pub json: &'a [u8],
    pub binary: Option<&'a [u8]>,
}

const MAGIC: &[u8] = b"glTF";
const JSON: &[u8] = b"JSON";
const BINARY: &[u8] = b"BIN\0";

/// Splits `.glb`; anything without its magic number is taken for JSON, whatever the file's name says.
pub(super) fn split(bytes: &[u8]) -> Result<Container<'_>, Fault> {
    if !bytes.starts_with(MAGIC) {
        let json = bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes);
        return Ok(Container { json, binary: None });
    }
    let header = |problem: String| Fault::new("GLB header", problem);
    let (Some(version), Some(length)) = (word(bytes, 4), word(bytes, 8)) else {
        return Err(header(format!("the file ends after {} of 12 bytes", bytes.len())));
    };
    if version != 2 {
        return Err(header(format!("version {version}, expected 2")));
    }
    let Some(mut rest) = bytes.get(12..length as usize) else {
        return Err(header(format!("it announces {length} bytes, the file has {}", bytes.len())));
    };
    let (kind, json) = chunk(&mut rest, 0)?;
    if kind != JSON {
        return Err(Fault::new("GLB chunk 0", "not the JSON chunk"));
    }
    // Further chunks of unknown kinds are to be ignored.
    let binary =
        if rest.is_empty() { None } else { Some(chunk(&mut rest, 1)?).filter(|(kind, _)| *kind == BINARY) };
    Ok(Container { json, binary: binary.map(|(_, data)| data) })
}

fn chunk<'a>(rest: &mut &'a [u8], number: usize) -> Result<(&'a [u8], &'a [u8]), Fault> {
    let place = format!("GLB chunk {number}");
    let Some((header, body)) = rest.split_at_checked(8) else {
        return Err(Fault::new(place, format!("{} bytes left, too few for a chunk header", rest.len())));
    };
    let length = word(header, 0).unwrap_or(0) as usize;
    let Some((data, behind)) = body.split_at_checked(length) else {
        return Err(Fault::new(place, format!("it announces {length} bytes, {} are left", body.len())));
    };
    *rest = behind;
    Ok((&header[4..], data))
}

fn word(bytes: &[u8], at: usize) -> Option<u32> {
    bytes.get(at..at + 4)?.try_into().ok().map(u32::from_le_bytes)
}
