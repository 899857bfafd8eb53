//! Brings the difference between two values into a document and leaves the rest as it is written.

use toml_edit::{Array, ArrayOfTables, Decor, DocumentMut, InlineTable, Item, Table, TableLike, Value};

use super::align::align;
use super::{fresh, same};

/// What kind of table a key is put into.
#[derive(Clone, Copy, PartialEq)]
enum Place {
    /// The document itself: tables get headers.
    Root,
    /// Below a header: tables are inline.
    Header,
    /// Between braces.
    Inline,
}

/// `old` is the value of the document as it is, `new` the value that it shall have.
pub(crate) fn merge(document: &mut DocumentMut, old: &InlineTable, new: &InlineTable) {
    let before = document.clone();
    merge_table(document.as_table_mut(), old, new, Place::Root);
    keep_detached_comments(before.as_table(), document);
}

fn merge_table(table: &mut dyn TableLike, old: &InlineTable, new: &InlineTable, place: Place) {
    // Between braces, the space before the closing one belongs to the last value, whichever that is.
    let space = if place == Place::Inline {
        last_value(table).map(|last| take_suffix(last.decor_mut()))
    } else {
        None
    };
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
    if let (Some(space), Some(last)) = (space, last_value(table)) {
        last.decor_mut().set_suffix(space);
    }
}

fn last_value(table: &mut dyn TableLike) -> Option<&mut Value> {
    table.iter_mut().last().and_then(|(_, item)| item.as_value_mut())
}

/// `[[thing]]` without any thing cannot be written.
fn is_empty_section(item: Option<&Item>) -> bool {
    matches!(item, Some(Item::ArrayOfTables(tables)) if tables.is_empty())
}

fn merge_item(item: &mut Item, old: Option<&Value>, new: &Value, place: Place) {
    match (&mut *item, old, new) {
        (Item::Table(table), Some(Value::InlineTable(old)), Value::InlineTable(new)) => {
            merge_table(table, old, new, Place::Header);
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
                Place::Header | Place::Inline => Item::Value(fresh::inline(new)),
            }
        }
    }
}

fn merge_value(value: &mut Value, old: Option<&Value>, new: &Value) {
    match (&mut *value, old, new) {
        (Value::InlineTable(table), Some(Value::InlineTable(old)), Value::InlineTable(new)) => {
            merge_table(table, old, new, Place::Inline);
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
        Place::Header | Place::Inline => Item::Value(fresh::inline(&new)),
    };
    table.insert(key, item);
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

/// New elements look like their neighbours; a comment behind an element, which the parser counts to the next one, stays
/// with it.
fn rebuild_array(array: &mut Array, old: &Array, new: &Array, origins: &[Option<usize>]) {
    let last_space = array.iter_mut().last().map(|last| take_suffix(last.decor_mut())).unwrap_or_default();
    let written: Vec<Value> = array.iter().cloned().collect();
    let trailing = array.trailing().as_str().unwrap_or_default().to_owned();
    let mut comments: Vec<&str> = written.iter().skip(1).map(|next| split_comment(prefix(next)).0).collect();
    comments.push(split_comment(&trailing).0);
    let comment_of =
        |origin: &Option<usize>| origin.and_then(|from| comments.get(from)).copied().unwrap_or_default();

    let mut rebuilt = Vec::with_capacity(new.len());
    let mut comment_before = "";
    for (value, origin) in new.iter().zip(origins) {
        let known = origin.and_then(|from| Some((written.get(from)?, old.get(from)?)));
        let mut element = known.map_or_else(|| fresh::inline(value), |(element, _)| element.clone());
        if let Some((_, before)) = known
            && !same(before, value)
        {
            merge_value(&mut element, Some(before), value);
        }
        let model = known.map(|(element, _)| element).filter(|_| *origin != Some(0) || rebuilt.is_empty());
        let own = model.map_or_else(
            || indent(&written, rebuilt.len()),
            |model| split_comment(prefix(model)).1.to_owned(),
        );
        element.decor_mut().set_prefix(format!("{comment_before}{own}"));
        take_suffix(element.decor_mut());
        comment_before = comment_of(origin);
        rebuilt.push(element);
    }
    if let Some(last) = rebuilt.last_mut()
        && !last_space.is_empty()
    {
        last.decor_mut().set_suffix(last_space);
    }
    array.clear();
    rebuilt.into_iter().for_each(|element| array.push_formatted(element));
    array.set_trailing(format!("{comment_before}{}", split_comment(&trailing).1));
}

/// White space before the element at `at`, as the written ones have it.
fn indent(written: &[Value], at: usize) -> String {
    let space = |element: &Value| match prefix(element).rsplit_once('\n') {
        Some((_, spaces)) => format!("\n{spaces}"),
        None => prefix(element).to_owned(),
    };
    let first = written.first().map(space).unwrap_or_default();
    match written.get(1).map(space) {
        _ if at == 0 || first.contains('\n') => first,
        Some(second) => second,
        None => " ".to_owned(),
    }
}

fn prefix(element: &Value) -> &str {
    element.decor().prefix().and_then(|prefix| prefix.as_str()).unwrap_or_default()
}

/// A comment behind the element before, and the rest.
fn split_comment(prefix: &str) -> (&str, &str) {
    let end = prefix.find('\n').unwrap_or(prefix.len());
    let (line, rest) = prefix.split_at(end);
    if line.contains('#') { (line, rest) } else { ("", prefix) }
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
                merge_table(&mut table, before, value, Place::Header);
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

/// A comment above a header that an empty line sets apart from it does not belong to the header. If the header went
/// away, such a comment moves to the next one, or to the end.
fn keep_detached_comments(before: &Table, document: &mut DocumentMut) {
    let kept = headers(document.as_table());
    let mut orphans = headers(before);
    orphans.retain(|(position, _)| !kept.iter().any(|(known, _)| known == position));
    for (position, comment) in orphans.into_iter().rev().filter(|(_, comment)| comment.contains('#')) {
        let next = kept.iter().map(|&(known, _)| known).filter(|&known| known > position).min();
        let done = next.is_some_and(|next| prepend(document.as_table_mut(), next, &comment));
        if !done {
            let end = document.trailing().as_str().unwrap_or_default();
            let end = format!("{comment}{end}");
            document.set_trailing(end);
        }
    }
}

/// Positions of all headers and the detached comments above them.
fn headers(table: &Table) -> Vec<(isize, String)> {
    let mut all = Vec::new();
    for (_, item) in table {
        let below: Vec<&Table> = match item {
            Item::Table(below) => vec![below],
            Item::ArrayOfTables(below) => below.iter().collect(),
            _ => Vec::new(),
        };
        for below in below {
            let prefix = below.decor().prefix().and_then(|prefix| prefix.as_str()).unwrap_or_default();
            let detached = prefix.rfind("\n\n").map_or("", |at| prefix.get(..=at).unwrap_or_default());
            all.extend(below.position().map(|position| (position, detached.to_owned())));
            all.extend(headers(below));
        }
    }
    all
}

fn prepend(table: &mut Table, position: isize, comment: &str) -> bool {
    table.iter_mut().any(|(_, item)| match item {
        Item::Table(below) => prepend_here(below, position, comment),
        Item::ArrayOfTables(below) => below.iter_mut().any(|below| prepend_here(below, position, comment)),
        _ => false,
    })
}

fn prepend_here(table: &mut Table, position: isize, comment: &str) -> bool {
    if table.position() != Some(position) {
        return prepend(table, position, comment);
    }
    let prefix = table.decor().prefix().and_then(|prefix| prefix.as_str()).unwrap_or_default();
    let prefix = format!("{comment}{prefix}");
    table.decor_mut().set_prefix(prefix);
    true
}
