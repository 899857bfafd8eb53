//! Brings the difference between two values into a document and leaves the rest as it is written.

use toml_edit::{Array, ArrayOfTables, Decor, DocumentMut, InlineTable, Item, Table, TableLike, Value};

use super::align::align;
use super::{fresh, same};

/// What kind of table a key is put into.
#[derive(Clone, Copy, PartialEq)]
enum Place {
    /// The document itself: tables get headers.
    Root,
    /// Below a header, or inline: tables are inline.
    Below,
}

/// `old` is the value of the document as it is, `new` the value that it shall have.
pub(crate) fn merge(document: &mut DocumentMut, old: &InlineTable, new: &InlineTable) {
    merge_table(document.as_table_mut(), old, new, Place::Root);
}

fn merge_table(table: &mut dyn TableLike, old: &InlineTable, new: &InlineTable, place: Place) {
    for (key, _) in old {
        if !new.contains_key(key) {
            table.remove(key);
        }
    }
    for (key, value) in new {
        let before = old.get(key);
        if before.is_some_and(|before| same(before, value)) {
            continue;
        }
        match table.get_mut(key) {
            Some(item) => merge_item(item, before, value, place),
            None => insert(table, key, before, value, place),
        }
        if is_empty_section(table.get(key)) {
            table.remove(key);
        }
    }
    put_in_order(table, new);
}

/// `[[thing]]` without any thing cannot be written.
fn is_empty_section(item: Option<&Item>) -> bool {
    matches!(item, Some(Item::ArrayOfTables(tables)) if tables.is_empty())
}

fn merge_item(item: &mut Item, old: Option<&Value>, new: &Value, place: Place) {
    match (&mut *item, old, new) {
        (Item::Table(table), Some(Value::InlineTable(old)), Value::InlineTable(new)) => {
            merge_table(table, old, new, Place::Below);
        }
        (Item::ArrayOfTables(tables), Some(Value::Array(old)), Value::Array(new))
            if mergeable(tables, old, new) =>
        {
            merge_tables(tables, old, new);
        }
        (Item::Value(value), old, new) => merge_value(value, old, new),
        (item, _, new) => {
            *item = match place {
                Place::Root => fresh::section(new),
                Place::Below => Item::Value(fresh::inline(new)),
            }
        }
    }
}

fn merge_value(value: &mut Value, old: Option<&Value>, new: &Value) {
    match (&mut *value, old, new) {
        (Value::InlineTable(table), Some(Value::InlineTable(old)), Value::InlineTable(new)) => {
            merge_table(table, old, new, Place::Below);
        }
        (Value::Array(array), Some(Value::Array(old)), Value::Array(new)) if array.len() == old.len() => {
            merge_array(array, old, new);
        }
        (written, _, new) => {
            let decor = written.decor().clone();
            *written = like_written(written, new);
            *written.decor_mut() = decor;
        }
    }
}

/// A whole number stays without a decimal point where it was written so.
fn like_written(written: &Value, new: &Value) -> Value {
    match (written, new) {
        (Value::Integer(_), Value::Float(number)) if is_whole(*number.value()) => {
            (*number.value() as i64).into()
        }
        _ => fresh::inline(new),
    }
}

fn is_whole(number: f64) -> bool {
    number.fract() == 0.0 && number.abs() < 1e15 && !(number == 0.0 && number.is_sign_negative())
}

/// A key that the document has not: its default was in force. Of a table only what differs from it is written.
fn insert(table: &mut dyn TableLike, key: &str, old: Option<&Value>, new: &Value, place: Place) {
    let new = match (old, new) {
        (Some(Value::InlineTable(old)), Value::InlineTable(new)) => Value::InlineTable(difference(old, new)),
        _ => new.clone(),
    };
    let item = match place {
        Place::Root => fresh::section(&new),
        Place::Below => Item::Value(fresh::inline(&new)),
    };
    // In an inline table the space before the brace belongs to the last value.
    let last = table.iter_mut().last().and_then(|(_, item)| item.as_value_mut());
    let space = if place == Place::Below { last.map(|last| take_suffix(last.decor_mut())) } else { None };
    table.insert(key, item);
    if let (Some(space), Some(value)) = (space, table.get_mut(key).and_then(Item::as_value_mut)) {
        value.decor_mut().set_suffix(space);
    }
}

/// Takes the space behind a value away, unless it contains a comment.
fn take_suffix(decor: &mut Decor) -> String {
    let suffix = decor.suffix().and_then(|suffix| suffix.as_str()).unwrap_or_default().to_owned();
    if suffix.trim().is_empty() {
        decor.set_suffix("");
        suffix
    } else {
        String::new()
    }
}

fn difference(old: &InlineTable, new: &InlineTable) -> InlineTable {
    let mut changed = InlineTable::new();
    for (key, value) in new {
        match (old.get(key), value) {
            (Some(before), value) if same(before, value) => {}
            (Some(Value::InlineTable(before)), Value::InlineTable(value)) => {
                changed.insert(key, Value::InlineTable(difference(before, value)));
            }
            _ => {
                changed.insert(key, value.clone());
            }
        }
    }
    changed
}

/// Moves each new key behind the one that precedes it in the type. Keys without such a predecessor stay at the end.
fn put_in_order(table: &mut dyn TableLike, new: &InlineTable) {
    let mut order: Vec<String> = table.iter().map(|(key, _)| key.to_owned()).collect();
    let wanted: Vec<&str> = new.iter().map(|(key, _)| key).filter(|key| table.contains_key(key)).collect();
    let written = order.clone();
    for (number, &key) in wanted.iter().enumerate() {
        let is_new = table.key(key).is_some_and(|key| key.as_repr().is_none());
        let predecessor = number.checked_sub(1).and_then(|before| wanted.get(before));
        let (true, Some(predecessor)) = (is_new, predecessor) else {
            continue;
        };
        order.retain(|known| known != key);
        let at = order.iter().position(|known| known == predecessor).map_or(order.len(), |at| at + 1);
        order.insert(at, key.to_owned());
    }
    if order == written {
        return;
    }
    let mut entries: Vec<_> = Vec::with_capacity(order.len());
    for key in &order {
        let formatted = table.key(key).cloned();
        entries.extend(formatted.zip(table.remove(key)));
    }
    for (key, item) in entries {
        table.entry_format(&key).or_insert(item);
    }
}

fn merge_array(array: &mut Array, old: &Array, new: &Array) {
    let origins = origins(old, new);
    let unmoved =
        origins.len() == old.len() && origins.iter().enumerate().all(|(at, from)| *from == Some(at));
    if unmoved {
        for ((value, old), new) in array.iter_mut().zip(old).zip(new) {
            if !same(old, new) {
                merge_value(value, Some(old), new);
            }
        }
        return;
    }
    rebuild_array(array, old, new, &origins);
}

fn origins(old: &Array, new: &Array) -> Vec<Option<usize>> {
    align(&old.iter().collect::<Vec<_>>(), &new.iter().collect::<Vec<_>>())
}

fn rebuild_array(array: &mut Array, old: &Array, new: &Array, origins: &[Option<usize>]) {
    let written: Vec<Value> = array.iter().cloned().collect();
    let last_space = array.iter_mut().last().map(|last| take_suffix(last.decor_mut())).unwrap_or_default();
    let first_indent = written.first().map(indent).unwrap_or_default();
    let next_indent = written.get(1).map_or_else(
        || if first_indent.contains('\n') { first_indent.clone() } else { " ".to_owned() },
        indent,
    );
    let last = new.len().saturating_sub(1);
    let mut rebuilt = Vec::with_capacity(new.len());
    for (at, (value, origin)) in new.iter().zip(origins).enumerate() {
        let indent = if at == 0 { &first_indent } else { &next_indent };
        let known = origin.and_then(|from| Some((written.get(from)?.clone(), old.get(from)?)));
        let mut element = match known {
            Some((mut element, before)) => {
                if !same(before, value) {
                    merge_value(&mut element, Some(before), value);
                }
                element
            }
            None => fresh::inline(value),
        };
        let prefix = element.decor().prefix().and_then(|prefix| prefix.as_str()).unwrap_or_default();
        if prefix.trim().is_empty() {
            element.decor_mut().set_prefix(indent.clone());
        }
        take_suffix(element.decor_mut());
        if at == last && !last_space.is_empty() {
            element.decor_mut().set_suffix(last_space.clone());
        }
        rebuilt.push(element);
    }
    array.clear();
    rebuilt.into_iter().for_each(|element| array.push_formatted(element));
}

/// The white space before an element, without comments.
fn indent(element: &Value) -> String {
    let prefix = element.decor().prefix().and_then(|prefix| prefix.as_str()).unwrap_or_default();
    match prefix.rsplit_once('\n') {
        Some((_, spaces)) => format!("\n{spaces}"),
        None => prefix.to_owned(),
    }
}

fn mergeable(tables: &ArrayOfTables, old: &Array, new: &Array) -> bool {
    tables.len() == old.len() && new.iter().all(Value::is_inline_table)
}

fn merge_tables(tables: &mut ArrayOfTables, old: &Array, new: &Array) {
    let origins = origins(old, new);
    let written: Vec<Table> = tables.iter().cloned().collect();
    let first_position = written.iter().filter_map(Table::position).min();
    let kept: Vec<usize> = origins.iter().copied().flatten().collect();
    let moved = kept.windows(2).any(|pair| pair.first() > pair.last());
    tables.clear();
    for (value, origin) in new.iter().zip(&origins) {
        let Some(value) = value.as_inline_table() else {
            continue;
        };
        let known =
            origin.and_then(|from| Some((written.get(from)?.clone(), old.get(from)?.as_inline_table()?)));
        let mut table = match known {
            Some((mut table, before)) => {
                merge_table(&mut table, before, value, Place::Below);
                table
            }
            None => fresh::table_with_header(value),
        };
        if moved {
            forget_positions(&mut table);
        }
        tables.push(table);
    }
    // Tables are printed by their positions; one without follows the one before it.
    if let Some(first) = tables.get_mut(0)
        && first.position().is_none()
    {
        first.set_position(first_position);
    }
}

fn forget_positions(table: &mut Table) {
    table.set_position(None);
    for (_, item) in table.iter_mut() {
        match item {
            Item::Table(below) => forget_positions(below),
            Item::ArrayOfTables(below) => below.iter_mut().for_each(forget_positions),
            _ => {}
        }
    }
}
