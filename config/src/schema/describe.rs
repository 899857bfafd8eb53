//! Words for what a schema allows.

use serde_json::Value;

use super::kind::{Kind, kinds};
use super::{Keywords, Schema, allowed_strings, array, number, unions};
use crate::suggest::quoted_list;

/// "a number greater than 0", "an array of 3 numbers", "one of `a`, `b`".
pub(crate) fn expected(schema: &Schema, of: &Value) -> String {
    let strings = strings(schema, of);
    let mut words = Vec::new();
    if !strings.is_empty() {
        let one_of = if strings.len() > 1 { "one of " } else { "" };
        words.push(format!("{one_of}{}", quoted_list(strings.iter().copied())));
    }
    let all = all_keywords(schema, of);
    for kind in kinds(schema, of) {
        match kind {
            Kind::String if !strings.is_empty() => {}
            Kind::Integer if kinds(schema, of).contains(&Kind::Float) => {}
            Kind::Datetime => {}
            Kind::Integer | Kind::Float => words.push(format!("{}{}", kind.name(), range_words(&all))),
            Kind::Array => words.push(array_words(schema, &all)),
            kind => words.push(kind.name().to_owned()),
        }
    }
    words.join(" or ")
}

fn range_words(all: &[&Keywords]) -> String {
    let numeric = all.iter().filter(|keywords| !kindless(keywords));
    numeric
        .map(|keywords| number::range(keywords).words())
        .find(|words| !words.is_empty())
        .unwrap_or_default()
}

fn kindless(keywords: &Keywords) -> bool {
    !keywords.contains_key("type")
}

fn array_words(schema: &Schema, all: &[&Keywords]) -> String {
    let Some(keywords) = all.iter().find(|keywords| keywords.contains_key("items") || has_prefix(keywords))
    else {
        return Kind::Array.name().to_owned();
    };
    let prefix = array(keywords, "prefixItems");
    if !prefix.is_empty() {
        let parts: Vec<String> = prefix.iter().map(|item| expected(schema, item)).collect();
        return format!("an array of {}", parts.join(", "));
    }
    let items = keywords.get("items").map(|items| expected(schema, items)).unwrap_or_default();
    let bound = |keyword| keywords.get(keyword).and_then(Value::as_u64);
    match (bound("minItems"), bound("maxItems")) {
        (Some(min), Some(max)) if min == max => format!("an array of {min}, each {items}"),
        (Some(min), Some(max)) => format!("an array of {min} to {max}, each {items}"),
        (Some(min), None) => format!("an array of at least {min}, each {items}"),
        (None, Some(max)) => format!("an array of at most {max}, each {items}"),
        (None, None) => format!("an array, each {items}"),
    }
}

fn has_prefix(keywords: &Keywords) -> bool {
    !array(keywords, "prefixItems").is_empty()
}

/// All strings that are allowed by name; empty if any string is.
pub(crate) fn strings<'s>(schema: &'s Schema, of: &'s Value) -> Vec<&'s str> {
    let mut found = Vec::new();
    for keywords in all_keywords(schema, of) {
        found.extend(allowed_strings(keywords).unwrap_or_default());
    }
    found
}

/// The keywords of a schema and of all variants of its unions, without those of their keys.
fn all_keywords<'s>(schema: &'s Schema, of: &'s Value) -> Vec<&'s Keywords> {
    let mut all = Vec::new();
    let mut pending = vec![of];
    // Recursive types are met again and again.
    while let (Some(next), true) = (pending.pop(), all.len() < 200) {
        for keywords in schema.flat(next) {
            all.push(keywords);
            pending.extend(unions(keywords).into_iter().filter(|union| union.len() > 1).flatten().rev());
        }
    }
    all
}

/// The docstring that comes first.
pub(crate) fn description<'s>(schema: &'s Schema, of: &'s Value) -> Option<&'s str> {
    schema.flat(of).into_iter().find_map(|keywords| keywords.get("description").and_then(Value::as_str))
}
