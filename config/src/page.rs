//! The reference page of a file's keys, made from its types.

use std::collections::{HashMap, HashSet};
use std::fmt::Write;

use schemars::JsonSchema;
use serde_json::Value;

use crate::schema::describe::{description, expected};
use crate::schema::kind::{Kind, accepts};
use crate::schema::variant::{common_tag, distinguishing_keys};
use crate::schema::{Keywords, Schema, map_values, properties, required, unions};

/// A Markdown page of all keys of `T`: docstrings, types, units, ranges, defaults, which keys are required. `example` is
/// a file that the test of the page should parse, too.
pub fn reference_page<T: JsonSchema>(title: &str, example: &str) -> String {
    let schema = Schema::of::<T>();
    let mut page =
        Page { schema: &schema, text: String::new(), anchors: HashMap::new(), written: HashSet::new() };
    page.line(&format!("# {title}\n"));
    page.line("*Generated from the types: change their docstrings, not this page.*\n");
    page.table(schema.root(), "");
    page.sections_below(schema.root(), "");
    page.line(&format!("## Example\n\n```toml\n{}\n```", example.trim_end()));
    page.text
}

/// Units that the ends of key names stand for, longest first.
const UNITS: [(&str, &str); 9] = [
    ("_per_m", "1/m"),
    ("_deg", "degrees"),
    ("_rad", "radians"),
    ("_px", "pixels"),
    ("_ns", "nanoseconds"),
    ("_ms", "milliseconds"),
    ("_m", "metres"),
    ("_s", "seconds"),
    ("_k", "kelvin"),
];

struct Page<'s> {
    schema: &'s Schema,
    text: String,
    /// Sections by the schema they describe: a type that occurs twice is described once.
    anchors: HashMap<*const Keywords, String>,
    /// Sections that are written: variants of a table may share a key.
    written: HashSet<String>,
}

/// A key whose value is a table, or contains tables.
struct Nested<'s> {
    /// As in `thing[].pose` or `sensors.NAME`.
    path: String,
    schema: &'s Value,
}

impl<'s> Page<'s> {
    fn line(&mut self, line: &str) {
        self.text.push_str(line);
        self.text.push('\n');
    }

    /// Depth first, in the order of the keys.
    fn sections_below(&mut self, of: &'s Value, path: &str) {
        let keys: Vec<(String, &'s Value)> =
            self.all_properties(of).into_iter().map(|(key, of)| (join(path, key), of)).collect();
        let nested: Vec<Nested<'s>> =
            keys.into_iter().filter_map(|(path, of)| self.nested(path, of)).collect();
        for nested in nested {
            let Some(identity) = self.identity(nested.schema) else {
                continue;
            };
            let is_its_section = self.anchors.get(&identity) == Some(&anchor(&nested.path));
            if is_its_section && self.written.insert(nested.path.clone()) {
                let heading = format!("<a id=\"{}\"></a>\n## `{}`\n", anchor(&nested.path), nested.path);
                self.line(&heading);
                self.table(nested.schema, &nested.path);
                self.sections_below(nested.schema, &nested.path);
            }
        }
    }

    /// Description, keys, and the keys of variants.
    fn table(&mut self, of: &'s Value, path: &str) {
        if let Some(text) = description(self.schema, of) {
            self.line(&format!("{text}\n"));
        }
        let flat = self.schema.flat(of);
        self.rows(&flat, path, None);
        for union in flat.iter().flat_map(|keywords| unions(keywords)).filter(|union| union.len() > 1) {
            self.variants(&union, path);
        }
    }

    fn variants(&mut self, union: &[&'s Value], path: &str) {
        let tables: Vec<&'s Value> =
            union.iter().copied().filter(|variant| accepts(self.schema, variant, Kind::Table)).collect();
        let others: Vec<String> = union
            .iter()
            .filter(|variant| !accepts(self.schema, variant, Kind::Table))
            .map(|variant| expected(self.schema, variant))
            .collect();
        if tables.is_empty() {
            return;
        }
        if !others.is_empty() {
            self.line(&format!("Instead of a table it may be {}.\n", others.join(" or ")));
        }
        if let Some((tag, values)) = common_tag(self.schema, &tables) {
            for (value, variant) in values.iter().zip(&tables) {
                self.variant(&format!("With `{tag} = \"{value}\"`"), variant, path, Some(tag));
            }
            return;
        }
        let flat: Vec<Vec<&'s Keywords>> = tables.iter().map(|variant| self.schema.flat(variant)).collect();
        let one_key_each =
            flat.iter().all(|variant| variant.iter().flat_map(|part| properties(part)).count() == 1);
        if one_key_each && distinguishing_keys(&flat).is_some() {
            self.line("One of these keys:\n");
            return self.one_key_rows(&flat, path);
        }
        for (number, variant) in tables.into_iter().enumerate() {
            self.variant(if number == 0 { "Either" } else { "Or" }, variant, path, None);
        }
    }

    fn variant(&mut self, name: &str, variant: &'s Value, path: &str, tag: Option<&str>) {
        let text =
            description(self.schema, variant).map(|text| format!(": {}", one_line(text))).unwrap_or_default();
        self.line(&format!("{name}{text}\n"));
        self.rows(&self.schema.flat(variant), path, tag);
    }

    /// A table of keys; `hidden` is a tag that the text above has told already.
    fn rows(&mut self, flat: &[&'s Keywords], path: &str, hidden: Option<&str>) {
        let needed: Vec<&str> = flat.iter().flat_map(|keywords| required(keywords)).collect();
        let keys: Vec<(&'s str, &'s Value)> = flat.iter().flat_map(|keywords| properties(keywords)).collect();
        let shown: Vec<_> = keys.into_iter().filter(|&(key, _)| Some(key) != hidden).collect();
        if shown.is_empty() {
            return;
        }
        self.line("| key | value | default | meaning |\n| --- | --- | --- | --- |");
        for (key, of) in shown {
            let default = default_words(of, needed.contains(&key));
            let meaning = self.meaning(of);
            self.row(key, of, path, &default, &meaning);
        }
        self.line("");
    }

    /// Of variants that each are one key: the docstring is the variant's.
    fn one_key_rows(&mut self, variants: &[Vec<&'s Keywords>], path: &str) {
        self.line("| key | value | default | meaning |\n| --- | --- | --- | --- |");
        for variant in variants {
            let text =
                variant.iter().find_map(|keywords| keywords.get("description").and_then(Value::as_str));
            for (key, of) in variant.iter().flat_map(|keywords| properties(keywords)).collect::<Vec<_>>() {
                let meaning = text.map_or_else(|| self.meaning(of), one_line);
                self.row(key, of, path, "one of these", &meaning);
            }
        }
        self.line("");
    }

    fn row(&mut self, key: &str, of: &'s Value, path: &str, default: &str, meaning: &str) {
        let value = self.value_words(key, of, path);
        self.line(&format!("| `{key}` | {} | {} | {} |", cell(&value), cell(default), cell(meaning)));
    }

    fn value_words(&mut self, key: &str, of: &'s Value, path: &str) -> String {
        let mut words = expected(self.schema, of);
        if let Some((_, unit)) = UNITS.iter().find(|(ending, _)| key.ends_with(ending)) {
            let _ = write!(words, ", {unit}");
        }
        let nested = self.nested(join(path, key), of).and_then(|nested| self.identity(nested.schema));
        if let Some(anchor) = nested.and_then(|identity| self.anchors.get(&identity)) {
            let _ = write!(words, ", see [its keys](#{anchor})");
        }
        words
    }

    /// The docstring, what each allowed word means, and where a table is described.
    fn meaning(&mut self, of: &'s Value) -> String {
        let mut parts: Vec<String> = description(self.schema, of).map(one_line).into_iter().collect();
        for keywords in self.schema.flat(of) {
            for variant in unions(keywords).into_iter().filter(|union| union.len() > 1).flatten() {
                if let (Some(word), Some(text)) = (
                    variant.get("const").and_then(Value::as_str),
                    variant.get("description").and_then(Value::as_str),
                ) {
                    parts.push(format!("`{word}`: {}", one_line(text)));
                }
            }
        }
        parts.join(" ")
    }

    /// All keys of a table and of its variants.
    fn all_properties(&self, of: &'s Value) -> Vec<(&'s str, &'s Value)> {
        let mut found = Vec::new();
        for keywords in self.schema.flat(of) {
            found.extend(properties(keywords));
            for variant in unions(keywords).into_iter().filter(|union| union.len() > 1).flatten() {
                found.extend(self.schema.flat(variant).into_iter().flat_map(properties));
            }
        }
        found
    }

    /// Where the tables within a value are described; reserves the section at the first sight of a type.
    fn nested(&mut self, path: String, of: &'s Value) -> Option<Nested<'s>> {
        if let Some(identity) = self.identity(of) {
            self.anchors.entry(identity).or_insert_with(|| anchor(&path));
            return Some(Nested { path, schema: of });
        }
        let flat = self.schema.flat(of);
        if let Some(items) = flat.iter().find_map(|keywords| keywords.get("items")) {
            return self.nested(format!("{path}[]"), items);
        }
        let values = flat.iter().find_map(|keywords| map_values(keywords, "0"))?;
        self.nested(format!("{path}.NAME"), values)
    }

    /// What tells one table type from another; `None` for other values.
    fn identity(&self, of: &'s Value) -> Option<*const Keywords> {
        let has_tables = |keywords: &Keywords| {
            let variants = || unions(keywords).into_iter().filter(|union| union.len() > 1).flatten();
            let table =
                |variant: &Value| self.schema.flat(variant).iter().any(|part| properties(part).count() > 0);
            properties(keywords).count() > 0 || variants().any(table)
        };
        self.schema
            .flat(of)
            .into_iter()
            .find(|keywords| has_tables(keywords))
            .map(|keywords| keywords as *const _)
    }
}

fn join(path: &str, key: &str) -> String {
    if path.is_empty() { key.to_owned() } else { format!("{path}.{key}") }
}

fn anchor(path: &str) -> String {
    path.replace("[]", "").replace('.', "-").to_lowercase()
}

fn default_words(of: &Value, needed: bool) -> String {
    match of.get("default") {
        _ if needed => "required".to_owned(),
        None | Some(Value::Null) => "–".to_owned(),
        Some(Value::Object(_)) => "see there".to_owned(),
        Some(value) => format!("`{value}`"),
    }
}

fn one_line(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

fn cell(text: &str) -> String {
    one_line(text).replace('|', "\\|")
}
