//! How things look that the file did not have before.

use toml_edit::{Array, ArrayOfTables, InlineTable, Item, Table, Value};

/// Arrays of more characters are broken into lines.
const LINE_CHARS: usize = 100;

/// As an entry of the document itself: tables become `[sections]`, arrays of tables `[[sections]]`.
pub(crate) fn section(value: &Value) -> Item {
    match value {
        Value::InlineTable(table) => Item::Table(table_with_header(table)),
        Value::Array(array) if is_array_of_tables(array) => {
            let mut tables = ArrayOfTables::new();
            for table in array.iter().filter_map(Value::as_inline_table) {
                tables.push(table_with_header(table));
            }
            Item::ArrayOfTables(tables)
        }
        value => Item::Value(inline(value)),
    }
}

/// A table under a header, after an empty line; what it contains stays inline.
pub(crate) fn table_with_header(content: &InlineTable) -> Table {
    let mut table = Table::new();
    for (key, value) in content {
        table.insert(key, Item::Value(inline(value)));
    }
    table.decor_mut().set_prefix("\n");
    table
}

/// On one line, or, of an array that is too long for it, on several.
pub(crate) fn inline(value: &Value) -> Value {
    let mut value = value.clone();
    value.decor_mut().clear();
    match &mut value {
        Value::Array(array) => {
            let elements: Vec<Value> = array.iter().map(inline).collect();
            array.clear();
            elements.into_iter().for_each(|element| array.push(element));
            break_lines(array);
        }
        Value::InlineTable(table) => {
            let mut formatted = InlineTable::new();
            for (key, value) in table.iter() {
                formatted.insert(key, inline(value));
            }
            *table = formatted;
        }
        _ => {}
    }
    value
}

fn is_array_of_tables(array: &Array) -> bool {
    !array.is_empty() && array.iter().all(Value::is_inline_table)
}

/// Fills lines of at most [`LINE_CHARS`] characters, indented by four.
fn break_lines(array: &mut Array) {
    let widths: Vec<usize> =
        array.iter().map(|element| element.to_string().trim().chars().count() + 2).collect();
    if widths.iter().sum::<usize>() <= LINE_CHARS {
        return;
    }
    let mut used = LINE_CHARS;
    for (element, width) in array.iter_mut().zip(widths) {
        used += width;
        let prefix = if used > LINE_CHARS {
            used = 4 + width;
            "\n    "
        } else {
            " "
        };
        element.decor_mut().set_prefix(prefix);
    }
    array.set_trailing_comma(true);
    array.set_trailing("\n");
}
