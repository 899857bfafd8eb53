//! The header of a PLY file.

use super::Fault;
use crate::import::text::{Line, shortened};

/// Longest header that is searched for its end, bytes.
const MAX_HEADER_BYTES: usize = 1 << 16;

/// Type of a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Scalar {
    fn parse(line: &Line<'_>, word: &str) -> Result<Self, Fault> {
        Ok(match word {
            "char" | "int8" => Self::I8,
            "uchar" | "uint8" => Self::U8,
            "short" | "int16" => Self::I16,
            "ushort" | "uint16" => Self::U16,
            "int" | "int32" => Self::I32,
            "uint" | "uint32" => Self::U32,
            "float" | "float32" => Self::F32,
            "double" | "float64" => Self::F64,
            _ => return Err(line.fault(format!("'{}' is no type", shortened(word)))),
        })
    }

    /// Bytes of a binary one.
    pub fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    /// The value that stands for 1 in a colour.
    pub fn full_scale(self) -> f32 {
        match self {
            Self::U8 => 255.0,
            Self::U16 => 65535.0,
            _ => 1.0,
        }
    }
}

/// Type of a property.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Scalar(Scalar),
    List { count: Scalar, item: Scalar },
}

pub(super) struct Property {
    pub name: String,
    pub kind: Kind,
}

pub(super) struct Element {
    pub name: String,
    pub count: u64,
    pub properties: Vec<Property>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Format {
    Ascii,
    LittleEndian,
    BigEndian,
}

pub(super) struct Header {
    pub format: Format,
    pub elements: Vec<Element>,
    /// Number of the first line behind it.
    pub lines: usize,
}

impl Header {
    /// The header and the bytes behind it.
    pub fn read(bytes: &[u8]) -> Result<(Self, &[u8]), Fault> {
        let mut rest = bytes;
        let mut format = None;
        let mut elements: Vec<Element> = Vec::new();
        for number in 1.. {
            let Some(end) = rest.iter().take(MAX_HEADER_BYTES).position(|&byte| byte == b'\n') else {
                return Err(Fault::new(
                    format!("line {number}"),
                    "the header does not end with 'end_header'",
                ));
            };
            let (first, behind) = rest.split_at(end);
            rest = &behind[1..];
            let text = String::from_utf8_lossy(first.trim_ascii());
            let line = Line { number, text: &text };
            let words: Vec<&str> = text.split_ascii_whitespace().collect();
            match words.as_slice() {
                ["ply"] if number == 1 => {}
                _ if number == 1 => return Err(line.fault("a PLY file begins with 'ply'")),
                ["end_header"] => {
                    let format = format.ok_or_else(|| line.fault("no format line"))?;
                    return Ok((Self { format, elements, lines: number + 1 }, rest));
                }
                ["format", name, "1.0"] => format = Some(parse_format(&line, name)?),
                ["comment" | "obj_info", ..] | [] => {}
                ["element", name, count] => {
                    let count = count
                        .parse()
                        .map_err(|_| line.fault(format!("'{}' is no count", shortened(count))))?;
                    elements.push(Element { name: (*name).to_owned(), count, properties: Vec::new() });
                }
                ["property", kind @ .., name] => {
                    let property = Property { name: (*name).to_owned(), kind: parse_kind(&line, kind)? };
                    let element =
                        elements.last_mut().ok_or_else(|| line.fault("a property before any element"))?;
                    element.properties.push(property);
                }
                _ => return Err(line.fault(format!("'{}' is not understood", shortened(&text)))),
            }
        }
        Err(Fault::new("header", "it does not end"))
    }
}

fn parse_format(line: &Line<'_>, name: &str) -> Result<Format, Fault> {
    match name {
        "ascii" => Ok(Format::Ascii),
        "binary_little_endian" => Ok(Format::LittleEndian),
        "binary_big_endian" => Ok(Format::BigEndian),
        _ => Err(line.fault(format!("unknown format '{}'", shortened(name)))),
    }
}

fn parse_kind(line: &Line<'_>, words: &[&str]) -> Result<Kind, Fault> {
    match words {
        [scalar] => Ok(Kind::Scalar(Scalar::parse(line, scalar)?)),
        ["list", count, item] => {
            let (count, item) = (Scalar::parse(line, count)?, Scalar::parse(line, item)?);
            if matches!(count, Scalar::F32 | Scalar::F64) {
                return Err(line.fault("the length of a list must be an integer"));
            }
            Ok(Kind::List { count, item })
        }
        _ => Err(line.fault("expected 'property TYPE NAME' or 'property list TYPE TYPE NAME'")),
    }
}
