//! XML elements, as Mitsuba's scene files have them.

use std::fmt::{self, Display, Formatter, Write as _};

use glam::{DMat4, Vec3};

/// An element with its attributes and children.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Element {
    tag: &'static str,
    attributes: Vec<(&'static str, String)>,
    children: Vec<Self>,
}

impl Element {
    /// An empty one.
    pub fn new(tag: &'static str) -> Self {
        Self { tag, attributes: Vec::new(), children: Vec::new() }
    }

    /// A plugin: `<tag type="kind">`.
    pub fn plugin(tag: &'static str, kind: &str) -> Self {
        Self::new(tag).attribute("type", kind)
    }

    /// With an attribute more.
    pub fn attribute(mut self, name: &'static str, value: impl Display) -> Self {
        self.attributes.push((name, value.to_string()));
        self
    }

    /// With a child more.
    pub fn child(mut self, child: Self) -> Self {
        self.children.push(child);
        self
    }

    /// With a parameter: `<tag name="name" value="value"/>`.
    pub fn parameter(self, tag: &'static str, name: &str, value: impl Display) -> Self {
        self.child(Self::new(tag).attribute("name", name).attribute("value", value))
    }

    /// With a linear colour that is not bound to [0, 1].
    pub fn rgb(self, name: &str, color: Vec3) -> Self {
        self.parameter("rgb", name, format_args!("{} {} {}", color.x, color.y, color.z))
    }

    /// With a transform for column vectors.
    pub fn transform(self, name: &str, matrix: DMat4) -> Self {
        let rows = matrix.transpose().to_cols_array().map(|value| value.to_string());
        let matrix = Self::new("matrix").attribute("value", rows.join(" "));
        self.child(Self::new("transform").attribute("name", name).child(matrix))
    }

    fn write(&self, f: &mut Formatter<'_>, depth: usize) -> fmt::Result {
        write!(f, "{:indent$}<{}", "", self.tag, indent = 4 * depth)?;
        for (name, value) in &self.attributes {
            write!(f, " {name}=\"{}\"", escaped(value))?;
        }
        if self.children.is_empty() {
            return f.write_str("/>\n");
        }
        f.write_str(">\n")?;
        self.children.iter().try_for_each(|child| child.write(f, depth + 1))?;
        writeln!(f, "{:indent$}</{}>", "", self.tag, indent = 4 * depth)
    }
}

impl Display for Element {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        self.write(f, 0)
    }
}

fn escaped(text: &str) -> String {
    let mut safe = String::with_capacity(text.len());
    for character in text.chars() {
        match character {
            '&' => safe.push_str("&amp;"),
            '<' => safe.push_str("&lt;"),
            '>' => safe.push_str("&gt;"),
            '"' => safe.push_str("&quot;"),
            // XML 1.0 knows no other control characters, not even written as numbers.
            '\t' | '\n' | '\r' => {
                let _ = write!(safe, "&#{};", u32::from(character));
            }
            control if control.is_control() => safe.push('\u{fffd}'),
            other => safe.push(other),
        }
    }
    safe
}
