//! TOML's types, and which of them a schema accepts.

use serde_json::Value as Json;

use super::{Keywords, Schema, array, unions};
use crate::tree::{Node, Value};

/// A TOML type under the name that a message gives it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    String,
    Integer,
    Float,
    Boolean,
    Datetime,
    Array,
    Table,
}

const ALL: [Kind; 7] =
    [Kind::String, Kind::Integer, Kind::Float, Kind::Boolean, Kind::Datetime, Kind::Array, Kind::Table];

impl Kind {
    pub(crate) fn of(node: &Node) -> Self {
        match node.value {
            Value::String(_) => Self::String,
            Value::Integer(_) => Self::Integer,
            Value::Float(_) => Self::Float,
            Value::Boolean => Self::Boolean,
            Value::Datetime => Self::Datetime,
            Value::Array(_) => Self::Array,
            Value::Table(_) => Self::Table,
        }
    }

    /// With its article.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::String => "a string",
            Self::Integer => "an integer",
            Self::Float => "a number",
            Self::Boolean => "true or false",
            Self::Datetime => "a date or time",
            Self::Array => "an array",
            Self::Table => "a table",
        }
    }

    fn named_by(self, json_type: &str) -> bool {
        match json_type {
            "string" => self == Self::String,
            "integer" => self == Self::Integer,
            "number" => matches!(self, Self::Integer | Self::Float),
            "boolean" => self == Self::Boolean,
            "array" => self == Self::Array,
            "object" => self == Self::Table,
            _ => false,
        }
    }
}

/// Whether the `type` of one schema admits a kind.
pub(crate) fn admits(keywords: &Keywords, kind: Kind) -> bool {
    match keywords.get("type") {
        Some(Json::String(name)) => kind.named_by(name),
        Some(Json::Array(names)) => names.iter().filter_map(Json::as_str).any(|name| kind.named_by(name)),
        _ => true,
    }
}

/// The kinds that a schema admits, looking through references and unions.
pub(crate) fn kinds(schema: &Schema, of: &Json) -> Vec<Kind> {
    ALL.into_iter().filter(|&kind| accepts(schema, of, kind)).collect()
}

/// Whether a schema admits a kind, looking through references and unions.
pub(crate) fn accepts(schema: &Schema, of: &Json, kind: Kind) -> bool {
    if of == &Json::Bool(false) {
        return false;
    }
    schema.flat(of).into_iter().all(|keywords| {
        let constant = keywords.get("const").is_none_or(|value| value.is_string() == (kind == Kind::String));
        let listed = array(keywords, "enum");
        let in_list = listed.is_empty() || listed.iter().any(Json::is_string) == (kind == Kind::String);
        let in_unions = unions(keywords)
            .into_iter()
            .filter(|union| union.len() > 1)
            .all(|union| union.into_iter().any(|variant| accepts(schema, variant, kind)));
        admits(keywords, kind) && constant && in_list && in_unions
    })
}
