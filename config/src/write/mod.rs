//! From a value back into a file.

mod align;
mod fresh;
mod merge;
mod save;

use toml_edit::{DocumentMut, InlineTable, Item, Value};

pub(crate) use merge::merge;
pub(crate) use save::save;

/// A value as TOML, all tables inline: the form in which values are compared.
pub(crate) fn plain<T: serde::Serialize>(value: &T) -> Result<InlineTable, String> {
    let document = toml_edit::ser::to_document(value).map_err(|error| error.to_string())?;
    Ok(document.into_table().into_inline_table())
}

/// A new file of a value.
pub(crate) fn fresh_text(value: &InlineTable) -> String {
    let mut document = DocumentMut::new();
    for (key, value) in value {
        document.insert(key, fresh::section(value));
    }
    if let Some((_, Item::Table(first))) = document.iter_mut().next() {
        first.decor_mut().set_prefix("");
    }
    document.to_string()
}

/// Equal in content; formatting does not count.
pub(crate) fn same(a: &Value, b: &Value) -> bool {
    match (a, b) {
        (Value::String(a), Value::String(b)) => a.value() == b.value(),
        (Value::Integer(a), Value::Integer(b)) => a.value() == b.value(),
        (Value::Float(a), Value::Float(b)) => a.value().to_bits() == b.value().to_bits(),
        (Value::Boolean(a), Value::Boolean(b)) => a.value() == b.value(),
        (Value::Datetime(a), Value::Datetime(b)) => a.value() == b.value(),
        (Value::Array(a), Value::Array(b)) => a.len() == b.len() && a.iter().zip(b).all(|(a, b)| same(a, b)),
        (Value::InlineTable(a), Value::InlineTable(b)) => same_table(a, b),
        _ => false,
    }
}

/// Equal in content; neither formatting nor the order of keys counts.
pub(crate) fn same_table(a: &InlineTable, b: &InlineTable) -> bool {
    a.len() == b.len() && a.iter().all(|(key, a)| b.get(key).is_some_and(|b| same(a, b)))
}
