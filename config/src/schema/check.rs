//! Checks a document against a schema and reports every problem with its place.

use std::ops::Range;

use serde_json::Value;

use super::describe::{description, expected};
use super::kind::{Kind, admits};
use super::variant::Pick;
use super::{Facets, Keywords, Schema, allowed_strings, array, map_values, number, properties, required};
use crate::key_path::KeyPath;
use crate::problem::{MAX_PROBLEMS, Problem};
use crate::source::{Source, printable};
use crate::suggest::{nearest, quoted_list};
use crate::tree::{Entry, Node, Value as Toml};

/// All problems of a document, in no order.
pub(crate) fn check(schema: &Schema, root: &Node, source: &Source) -> Vec<Problem> {
    let mut checker = Checker { schema, source, problems: Vec::new() };
    checker.value(schema.root(), root, &KeyPath::root());
    checker.problems
}

struct Checker<'a> {
    schema: &'a Schema,
    source: &'a Source,
    problems: Vec<Problem>,
}

impl<'a> Checker<'a> {
    /// Enough was found to stop looking.
    fn full(&self) -> bool {
        self.problems.len() > 4 * MAX_PROBLEMS
    }

    fn report(&mut self, span: &Range<usize>, key: &KeyPath, message: String, help: impl Into<String>) {
        self.problems.push(Problem::new(self.source, span.clone(), key, message).with_help(help));
    }

    fn value(&mut self, of: &'a Value, node: &Node, path: &KeyPath) {
        let facets = self.schema.facets(of, node);
        let kind = Kind::of(node);
        let wrong_kind = facets.all.iter().any(|keywords| !admits(keywords, kind));
        let no_variant = facets.undecided.iter().any(|pick| matches!(pick, Pick::WrongKind));
        if wrong_kind || no_variant {
            return self.wrong_kind(of, node, path);
        }
        for pick in &facets.undecided {
            self.undecided(pick, node, path);
        }
        match &node.value {
            Toml::Table(entries) => self.table(&facets, entries, node, path),
            Toml::Array(elements) => {
                for keywords in &facets.all {
                    self.array(keywords, elements, node, path);
                }
            }
            _ => self.scalar(&facets, node, path),
        }
    }

    fn wrong_kind(&mut self, of: &Value, node: &Node, path: &KeyPath) {
        let found = found(self.source, node);
        let message = format!("expected {}, found {found}", expected(self.schema, of));
        let help = match node.value {
            Toml::Float(number) if number.fract() == 0.0 && number.abs() < 1e15 => {
                format!("write it without a decimal point: {number}")
            }
            _ => String::new(),
        };
        self.report(&node.span, path, message, help);
    }

    fn undecided(&mut self, pick: &Pick<'_>, node: &Node, path: &KeyPath) {
        match pick {
            Pick::UnknownString { allowed } => self.unknown_string(allowed, node, path),
            Pick::Tag { tag, allowed, .. } => match node.get(tag) {
                None => {
                    let help = format!("it is one of {}", quoted_list(allowed.iter().copied()));
                    self.missing(tag, node, path, help);
                }
                Some(entry) => self.tag_value(allowed, entry, &path.key(*tag)),
            },
            Pick::Keys { keys, present, .. } if present.is_empty() => {
                let slip =
                    node.entries().iter().any(|entry| nearest(&entry.key, keys.iter().copied()).is_some());
                if !slip {
                    let message = format!("missing key: one of {}", quoted_list(keys.iter().copied()));
                    self.report(&node.span, path, message, "");
                }
            }
            Pick::Keys { keys, present, .. } => {
                for (key, entry) in present.iter().skip(1).filter_map(|key| Some((key, node.get(key)?))) {
                    let first = present.first().copied().unwrap_or_default();
                    let message = format!("`{key}` beside `{first}`, of which only one is allowed");
                    let help = format!("give one of {}", quoted_list(keys.iter().copied()));
                    self.report(&entry.key_span, &path.key(*key), message, help);
                }
            }
            Pick::Variant { .. } | Pick::WrongKind => {}
        }
    }

    fn tag_value(&mut self, allowed: &[&str], entry: &Entry, path: &KeyPath) {
        if let Toml::String(_) = entry.node.value {
            return self.unknown_string(allowed, &entry.node, path);
        }
        let found = found(self.source, &entry.node);
        let message = format!("expected one of {}, found {found}", quoted_list(allowed.iter().copied()));
        self.report(&entry.node.span, path, message, "");
    }

    fn unknown_string(&mut self, allowed: &[&str], node: &Node, path: &KeyPath) {
        let written = match &node.value {
            Toml::String(text) => text.as_str(),
            _ => "",
        };
        let message = format!("unknown value {}", found_text(self.source, node));
        let list = quoted_list(allowed.iter().copied());
        let help = match nearest(written, allowed.iter().copied()) {
            Some(meant) => format!("did you mean `{meant}`? Allowed: {list}"),
            None => format!("allowed: {list}"),
        };
        self.report(&node.span, path, message, help);
    }

    fn table(&mut self, facets: &Facets<'a>, entries: &[Entry], node: &Node, path: &KeyPath) {
        let known = self.known_keys(facets);
        let mut meant = Vec::new();
        for entry in entries {
            if self.full() {
                return;
            }
            let below = path.key(&entry.key);
            let schemas: Vec<&'a Value> = schemas_of(facets, &entry.key).collect();
            for of in &schemas {
                self.value(of, &entry.node, &below);
            }
            if schemas.is_empty() && !facets.anything && !known.contains(&entry.key.as_str()) {
                meant.extend(self.unknown_key(facets, &known, entry, node, path));
            }
        }
        self.missing_keys(facets, &meant, node, path);
    }

    /// Of the facets and of all variants that could still be meant.
    fn known_keys(&self, facets: &Facets<'a>) -> Vec<&'a str> {
        let mut known: Vec<&str> = facets.all.iter().flat_map(|keywords| keys_of(keywords)).collect();
        for pick in &facets.undecided {
            match pick {
                Pick::Tag { variants, .. } => {
                    let keywords = variants.iter().flat_map(|variant| self.schema.flat(variant));
                    known.extend(keywords.flat_map(keys_of));
                }
                Pick::Keys { keys, .. } => known.extend(keys),
                _ => {}
            }
        }
        let mut unique = Vec::with_capacity(known.len());
        for key in known {
            if !unique.contains(&key) {
                unique.push(key);
            }
        }
        unique
    }

    /// Reports it and returns the known key that was probably meant.
    fn unknown_key(
        &mut self,
        facets: &Facets<'a>,
        known: &[&'a str],
        entry: &Entry,
        node: &Node,
        path: &KeyPath,
    ) -> Option<&'a str> {
        let free = known.iter().copied().filter(|key| node.get(key).is_none());
        let meant = nearest(&entry.key, free);
        let given = nearest(&entry.key, known.iter().copied());
        let elsewhere = facets.passed_over.iter().find(|(_, variant)| {
            self.schema.flat(variant).into_iter().flat_map(keys_of).any(|key| key == entry.key)
        });
        let help = match (elsewhere, meant, given) {
            (Some((variant, _)), ..) => format!("it belongs to {variant}"),
            (None, Some(meant), _) => format!("did you mean `{meant}`?"),
            (None, None, Some(given)) => format!("did you mean `{given}`? That is given already"),
            (None, None, None) if known.is_empty() => "no key is allowed here".to_owned(),
            (None, None, None) => format!("known keys: {}", quoted_list(known.iter().copied())),
        };
        self.report(&entry.key_span, &path.key(&entry.key), "unknown key".to_owned(), help);
        meant.filter(|_| elsewhere.is_none())
    }

    fn missing_keys(&mut self, facets: &Facets<'a>, meant: &[&str], node: &Node, path: &KeyPath) {
        let mut told = meant.to_vec();
        for key in facets.all.iter().flat_map(|keywords| required(keywords)) {
            if node.get(key).is_some() || told.contains(&key) {
                continue;
            }
            told.push(key);
            let help = schemas_of(facets, key).next().map(|of| self.what_is(of)).unwrap_or_default();
            self.missing(key, node, path, help);
        }
    }

    fn missing(&mut self, key: &str, node: &Node, path: &KeyPath, help: String) {
        self.report(&node.span, &path.key(key), "missing key".to_owned(), help);
    }

    /// Type and first sentence of the docstring.
    fn what_is(&self, of: &Value) -> String {
        let expected = expected(self.schema, of);
        let text = description(self.schema, of).unwrap_or_default();
        let sentence = text.lines().next().unwrap_or_default().split(". ").next().unwrap_or_default();
        match sentence.trim_end_matches('.') {
            "" => format!("it is {expected}"),
            sentence => format!("it is {expected}: {sentence}"),
        }
    }

    fn array(&mut self, keywords: &'a Keywords, elements: &[Node], node: &Node, path: &KeyPath) {
        let count = elements.len() as u64;
        let bound = |keyword| keywords.get(keyword).and_then(Value::as_u64);
        let (min, max) = (bound("minItems"), bound("maxItems"));
        if min.is_some_and(|min| count < min) || max.is_some_and(|max| count > max) {
            let words = match (min, max) {
                (Some(min), Some(max)) if min == max => format!("{min}"),
                (Some(min), Some(max)) => format!("{min} to {max}"),
                (Some(min), None) => format!("at least {min}"),
                (_, max) => format!("at most {}", max.unwrap_or(0)),
            };
            self.report(&node.span, path, format!("expected {words} elements, found {count}"), "");
        }
        let prefix = array(keywords, "prefixItems");
        for (index, element) in elements.iter().enumerate() {
            if self.full() {
                return;
            }
            if let Some(of) = prefix.get(index).or_else(|| keywords.get("items")) {
                self.value(of, element, &path.index(index));
            }
        }
    }

    fn scalar(&mut self, facets: &Facets<'a>, node: &Node, path: &KeyPath) {
        for keywords in &facets.all {
            match &node.value {
                Toml::String(text) => self.string(keywords, text, node, path),
                Toml::Integer(Some(number)) => self.number(keywords, *number as f64, node, path),
                Toml::Float(number) => self.number(keywords, *number, node, path),
                _ => {}
            }
        }
        self.number_at_all(facets, node, path);
    }

    fn string(&mut self, keywords: &Keywords, text: &str, node: &Node, path: &KeyPath) {
        if let Some(allowed) = allowed_strings(keywords)
            && !allowed.contains(&text)
        {
            self.unknown_string(&allowed, node, path);
        }
        let count = text.chars().count() as u64;
        if let Some(min) = keywords.get("minLength").and_then(Value::as_u64)
            && count < min
        {
            let message =
                if text.is_empty() { "must not be empty".to_owned() } else { format!("shorter than {min}") };
            self.report(&node.span, path, message, "");
        }
    }

    fn number(&mut self, keywords: &Keywords, number: f64, node: &Node, path: &KeyPath) {
        let range = number::range(keywords);
        if number.is_finite() && !range.contains(number) {
            let words = range.words();
            let words = words.trim_start_matches([',', ' ']);
            let limit = if words.is_empty() { "within 32-bit floats (±3.4e38)" } else { words };
            let message = format!("{} is out of range", found_text(self.source, node));
            self.report(&node.span, path, message, format!("allowed: {limit}"));
        }
    }

    /// No key of this project means anything with NaN or infinity, and TOML's integers have 64 bits.
    fn number_at_all(&mut self, facets: &Facets<'a>, node: &Node, path: &KeyPath) {
        let in_64_bits = |number: i128| i64::try_from(number).is_ok() || u64::try_from(number).is_ok();
        let problem = match node.value {
            _ if facets.anything => None,
            Toml::Float(number) if !number.is_finite() => Some("a finite number"),
            Toml::Integer(number) if !number.is_some_and(in_64_bits) => Some("a 64-bit integer"),
            _ => None,
        };
        if let Some(expected) = problem {
            let message = format!("expected {expected}, found {}", found_text(self.source, node));
            self.report(&node.span, path, message, "");
        }
    }
}

fn keys_of(keywords: &Keywords) -> impl Iterator<Item = &str> {
    properties(keywords).map(|(key, _)| key)
}

/// The schemas of a key: of every facet that names it, else of the facet that admits any key.
fn schemas_of<'s>(facets: &Facets<'s>, key: &str) -> impl Iterator<Item = &'s Value> {
    let named: Vec<&Value> = facets
        .all
        .iter()
        .chain(&facets.loose)
        .flat_map(|keywords| properties(keywords))
        .filter(|&(known, _)| known == key)
        .map(|(_, of)| of)
        .collect();
    let any_key = if named.is_empty() {
        facets.all.iter().find_map(|keywords| map_values(keywords, key))
    } else {
        None
    };
    named.into_iter().chain(any_key)
}

/// "a string, `"1"`": type and text of what was written.
fn found(source: &Source, node: &Node) -> String {
    match Kind::of(node) {
        kind @ (Kind::Array | Kind::Table) => kind.name().to_owned(),
        Kind::Boolean => found_text(source, node),
        kind => format!("{} ({})", kind.name(), found_text(source, node)),
    }
}

/// What was written, shortened and harmless.
fn found_text(source: &Source, node: &Node) -> String {
    let text = source.slice(&node.span);
    let short: String = text.chars().take(40).map(printable).collect();
    let more = if short.len() < text.len() { "…" } else { "" };
    format!("`{short}{more}`")
}
