//! A TOML document with the place of every key and value.

use std::ops::Range;

use serde::de::DeserializeOwned;
use toml::de::{DeTable, DeValue, ValueDeserializer};

use crate::key_path::{KeyPath, Step};
use crate::limits::{MAX_DEPTH, check_structure};
use crate::problem::Problem;
use crate::source::Source;

/// A value and where it stands: for a `[table]` its header, for an implied table the key that implies it.
#[derive(Clone, Debug)]
pub(crate) struct Node {
    pub span: Range<usize>,
    pub value: Value,
}

/// A key of a table.
#[derive(Clone, Debug)]
pub(crate) struct Entry {
    pub key: String,
    pub key_span: Range<usize>,
    pub node: Node,
}

#[derive(Clone, Debug)]
pub(crate) enum Value {
    String(String),
    /// `None` beyond 128 bits.
    Integer(Option<i128>),
    Float(f64),
    Boolean,
    Datetime,
    Array(Vec<Node>),
    /// In the order of the file.
    Table(Vec<Entry>),
}

/// The place a path leads to.
pub(crate) struct Found {
    pub span: Range<usize>,
    /// Where its key stands; for an array element, and for the document, the same as `span`.
    pub key_span: Range<usize>,
}

impl Node {
    /// The entry of a table; `None` for other values too.
    pub(crate) fn get(&self, key: &str) -> Option<&Entry> {
        self.entries().iter().find(|entry| entry.key == key)
    }

    /// The keys of a table; none for other values.
    pub(crate) fn entries(&self) -> &[Entry] {
        match &self.value {
            Value::Table(entries) => entries,
            _ => &[],
        }
    }

    /// Whether all steps of a path are there.
    pub(crate) fn contains(&self, path: &KeyPath) -> bool {
        let mut node = self;
        path.steps().iter().all(|step| match node.step(step) {
            Some((next, _)) => {
                node = next;
                true
            }
            None => false,
        })
    }

    /// As far down `path` as the document goes.
    pub(crate) fn find(&self, path: &KeyPath) -> Found {
        let mut found = Found { span: self.span.clone(), key_span: self.span.clone() };
        let mut node = self;
        for step in path.steps() {
            let Some((next, key_span)) = node.step(step) else {
                break;
            };
            found = Found { span: next.span.clone(), key_span };
            node = next;
        }
        found
    }

    fn step(&self, step: &Step) -> Option<(&Self, Range<usize>)> {
        match (&self.value, step) {
            (Value::Array(elements), Step::Index(index)) => {
                elements.get(*index).map(|node| (node, node.span.clone()))
            }
            (Value::Table(_), Step::Key(key)) => {
                self.get(key).map(|entry| (&entry.node, entry.key_span.clone()))
            }
            // Keys that look like numbers arrive as indices.
            (Value::Table(_), Step::Index(index)) => {
                self.get(&index.to_string()).map(|entry| (&entry.node, entry.key_span.clone()))
            }
            _ => None,
        }
    }

    /// The path of the smallest value that contains a span.
    pub(crate) fn path_of(&self, span: &Range<usize>) -> KeyPath {
        let mut path = KeyPath::root();
        self.descend_to(span, &mut path);
        path
    }

    /// A header's table has the header as its span, which its keys are not inside of: so all children are asked.
    fn descend_to(&self, span: &Range<usize>, path: &mut KeyPath) -> bool {
        let contains = |outer: &Range<usize>| outer.start <= span.start && span.end <= outer.end;
        let children: Vec<(KeyPath, &Self, bool)> = match &self.value {
            Value::Array(elements) => {
                let child = |(index, node)| (path.index(index), node, false);
                elements.iter().enumerate().map(child).collect()
            }
            Value::Table(entries) => entries
                .iter()
                .map(|entry| (path.key(&entry.key), &entry.node, contains(&entry.key_span)))
                .collect(),
            _ => Vec::new(),
        };
        for (child_path, child, at_key) in children {
            let mut below = child_path.clone();
            if child.descend_to(span, &mut below) {
                *path = below;
                return true;
            }
            if at_key || contains(&child.span) {
                *path = child_path;
                return true;
            }
        }
        false
    }
}

/// A parsed document, kept in two forms: ours to check, and the parser's to deserialise from.
pub(crate) struct Parsed<'i> {
    pub root: Node,
    table: toml::Spanned<DeTable<'i>>,
}

impl Parsed<'_> {
    /// All syntax errors at once.
    pub(crate) fn new(source: &Source) -> Result<Parsed<'_>, Vec<Problem>> {
        let root_path = KeyPath::root();
        let problem = |span, message| Problem::new(source, span, &root_path, message);
        check_structure(source.text()).map_err(|exceeded| vec![problem(exceeded.span, exceeded.message)])?;
        let (table, errors) = DeTable::parse_recoverable(source.text());
        if !errors.is_empty() {
            return Err(errors.iter().map(|error| syntax_problem(source, error)).collect());
        }
        let node = Node {
            span: 0..0,
            value: table_value(table.get_ref(), MAX_DEPTH)
                .map_err(|span| vec![problem(span, format!("nested deeper than {MAX_DEPTH} levels"))])?,
        };
        Ok(Parsed { root: node, table })
    }

    /// By serde. The error has the place that serde knows, the smallest value it had a place for.
    pub(crate) fn deserialize<T: DeserializeOwned>(self, source: &Source) -> Result<(T, Node), Vec<Problem>> {
        let (span, table) = (self.table.span(), self.table.into_inner());
        let spanned = toml::Spanned::new(span, DeValue::Table(table));
        match T::deserialize(ValueDeserializer::from(spanned)) {
            Ok(value) => Ok((value, self.root)),
            Err(error) => {
                let span = error.span().unwrap_or(0..0);
                let path = self.root.path_of(&span);
                let message = error.message().lines().collect::<Vec<_>>().join("; ");
                Err(vec![Problem::new(source, span, &path, message)])
            }
        }
    }
}

fn syntax_problem(source: &Source, error: &toml::de::Error) -> Problem {
    let end = source.text().len();
    let span = error.span().unwrap_or(end..end);
    let message = error.message().lines().collect::<Vec<_>>().join("; ");
    Problem::new(source, span, &KeyPath::root(), format!("not valid TOML: {message}"))
}

/// The error is the span of a value that lies too deep.
fn table_value(table: &DeTable<'_>, levels: usize) -> Result<Value, Range<usize>> {
    let mut entries = Vec::with_capacity(table.len());
    for (key, value) in table {
        entries.push(Entry {
            key: key.get_ref().clone().into_owned(),
            key_span: key.span(),
            node: node(value, levels)?,
        });
    }
    entries.sort_by_key(|entry: &Entry| entry.key_span.start);
    Ok(Value::Table(entries))
}

fn node(value: &toml::Spanned<DeValue<'_>>, levels: usize) -> Result<Node, Range<usize>> {
    let span = value.span();
    let below = levels.checked_sub(1).ok_or_else(|| span.clone())?;
    let value = match value.get_ref() {
        DeValue::String(text) => Value::String(text.clone().into_owned()),
        DeValue::Integer(number) => {
            Value::Integer(i128::from_str_radix(number.as_str(), number.radix()).ok())
        }
        // The parser admits no other text than floats; one too large becomes infinite and is refused as such.
        DeValue::Float(number) => Value::Float(number.as_str().parse().unwrap_or(f64::NAN)),
        DeValue::Boolean(_) => Value::Boolean,
        DeValue::Datetime(_) => Value::Datetime,
        DeValue::Array(elements) => {
            Value::Array(elements.iter().map(|element| node(element, below)).collect::<Result<_, _>>()?)
        }
        DeValue::Table(table) => table_value(table, below)?,
    };
    Ok(Node { span, value })
}
