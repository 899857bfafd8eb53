//! The numbers behind the header, as text or as bytes.

use std::fmt::Arguments;

use super::Fault;
use super::header::{Element, Format, Header, Kind, Scalar};
use crate::import::text::shortened;

/// Reads one number after the other.
pub(super) struct Values<'a> {
    format: Format,
    rest: &'a [u8],
    line: usize,
}

impl<'a> Values<'a> {
    pub fn new(header: &Header, body: &'a [u8]) -> Self {
        Self { format: header.format, rest: body, line: header.lines }
    }

    /// Whether the bytes left can hold all items of an element, each list empty.
    pub fn expect(&self, element: &Element) -> Result<(), Fault> {
        let smallest = |kind: Kind| match (self.format, kind) {
            // A digit and a space.
            (Format::Ascii, _) => 2,
            (_, Kind::Scalar(scalar)) => scalar.size(),
            (_, Kind::List { count, .. }) => count.size(),
        };
        let size: usize = element.properties.iter().map(|property| smallest(property.kind)).sum();
        let needed = element.count.saturating_mul(size as u64);
        // The last digit of a text need not be followed by anything.
        if needed > self.rest.len() as u64 + 1 {
            let problem = format!(
                "{} items of at least {size} bytes, but only {} bytes follow",
                element.count,
                self.rest.len()
            );
            return Err(Fault::new(format!("element {}", element.name), problem));
        }
        Ok(())
    }

    /// A number of the given type; `place` is for messages.
    pub fn number(&mut self, kind: Scalar, place: Arguments<'_>) -> Result<f64, Fault> {
        match self.format {
            Format::Ascii => self.word(place),
            Format::LittleEndian => self.binary(kind, place, true),
            Format::BigEndian => self.binary(kind, place, false),
        }
    }

    /// A list of whole numbers; empty for a property that is none.
    pub fn list(&mut self, kind: Kind, place: Arguments<'_>) -> Result<Vec<i64>, Fault> {
        let Kind::List { count, item } = kind else { return Ok(Vec::new()) };
        let announced = self.number(count, place)?;
        let size = if self.format == Format::Ascii { 2 } else { item.size() };
        let most = (self.rest.len() + 1) / size;
        if !(0.0..=most as f64).contains(&announced) {
            return Err(self.fault(place, format!("a list of {announced} numbers, at most {most} follow")));
        }
        (0..announced as usize).map(|_| self.number(item, place).map(|number| number as i64)).collect()
    }

    fn fault(&self, place: Arguments<'_>, problem: String) -> Fault {
        match self.format {
            Format::Ascii => Fault::new(format!("line {}, {place}", self.line), problem),
            _ => Fault::new(place.to_string(), problem),
        }
    }

    fn word(&mut self, place: Arguments<'_>) -> Result<f64, Fault> {
        let start = self.rest.iter().position(|byte| !byte.is_ascii_whitespace()).unwrap_or(self.rest.len());
        let (space, rest) = self.rest.split_at(start);
        self.line += space.iter().filter(|&&byte| byte == b'\n').count();
        let end = rest.iter().position(u8::is_ascii_whitespace).unwrap_or(rest.len());
        let (word, rest) = rest.split_at(end);
        self.rest = rest;
        if word.is_empty() {
            return Err(self.fault(place, "the file ends here".to_owned()));
        }
        let text = String::from_utf8_lossy(word);
        text.parse().map_err(|_| self.fault(place, format!("'{}' is not a number", shortened(&text))))
    }

    fn binary(&mut self, kind: Scalar, place: Arguments<'_>, little: bool) -> Result<f64, Fault> {
        let Some((bytes, rest)) = self.rest.split_at_checked(kind.size()) else {
            return Err(self.fault(place, "the file ends here".to_owned()));
        };
        self.rest = rest;
        let mut word = [0; 8];
        for (i, &byte) in bytes.iter().enumerate() {
            word[if little { i } else { bytes.len() - 1 - i }] = byte;
        }
        let bits = u64::from_le_bytes(word);
        Ok(match kind {
            Scalar::I8 => f64::from(bits as i8),
            Scalar::U8 => f64::from(bits as u8),
            Scalar::I16 => f64::from(bits as i16),
            Scalar::U16 => f64::from(bits as u16),
            Scalar::I32 => f64::from(bits as i32),
            Scalar::U32 => f64::from(bits as u32),
            Scalar::F32 => f64::from(f32::from_bits(bits as u32)),
            Scalar::F64 => f64::from_bits(bits),
        })
    }
}
