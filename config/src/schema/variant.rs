//! Decides which variant of a union a value means: by its type, by a tag, by the one key that names the variant, or by
//! the best fit.

use serde_json::Value;

use super::kind::{Kind, accepts};
use super::{Keywords, Schema, allowed_strings, properties, required};
use crate::tree::{Node, Value as Toml};

/// What came of it.
pub(crate) enum Pick<'s> {
    /// Decided.
    Variant {
        schema: &'s Value,
        /// The others, each with a word that names it (`in = "marker"`), where there is one.
        others: Vec<(String, &'s Value)>,
    },
    /// No variant has a value of this type.
    WrongKind,
    /// The string is none of those allowed.
    UnknownString { allowed: Vec<&'s str> },
    /// The key that selects the variant is missing or has an unknown value; the keys of all variants are admitted.
    Tag { tag: &'s str, allowed: Vec<&'s str>, variants: Vec<&'s Value> },
    /// None or several of the keys that name a variant each.
    Keys { keys: Vec<&'s str>, present: Vec<&'s str>, variants: Vec<&'s Value> },
}

/// `variants` are at least two, without null.
pub(crate) fn pick<'s>(schema: &'s Schema, variants: &[&'s Value], node: &Node) -> Pick<'s> {
    let kind = Kind::of(node);
    let fitting: Vec<&'s Value> =
        variants.iter().copied().filter(|variant| accepts(schema, variant, kind)).collect();
    match (fitting.as_slice(), &node.value) {
        ([], _) => Pick::WrongKind,
        (_, Toml::String(text)) => pick_string(schema, &fitting, text),
        ([only], _) => decided(only),
        (_, Toml::Table(_)) => pick_table(schema, &fitting, node),
        _ => best_fit(schema, &fitting, node),
    }
}

fn decided(schema: &Value) -> Pick<'_> {
    Pick::Variant { schema, others: Vec::new() }
}

fn pick_string<'s>(schema: &'s Schema, variants: &[&'s Value], text: &str) -> Pick<'s> {
    let mut allowed = Vec::new();
    let mut free = None;
    for &variant in variants {
        match schema.flat(variant).into_iter().find_map(allowed_strings) {
            Some(names) if names.contains(&text) => return decided(variant),
            Some(names) => allowed.extend(names),
            None => free = free.or(Some(variant)),
        }
    }
    free.map_or(Pick::UnknownString { allowed }, decided)
}

fn pick_table<'s>(schema: &'s Schema, variants: &[&'s Value], node: &Node) -> Pick<'s> {
    if let Some((tag, values)) = common_tag(schema, variants) {
        return by_tag(tag, &values, variants, node);
    }
    let tables: Vec<Vec<&Keywords>> = variants.iter().map(|variant| schema.flat(variant)).collect();
    match distinguishing_keys(&tables) {
        Some(keys) => by_key(&keys, variants, node),
        None => best_fit(schema, variants, node),
    }
}

/// The key that every variant fixes to a string of its own, with these strings.
pub(crate) fn common_tag<'s>(schema: &'s Schema, variants: &[&'s Value]) -> Option<(&'s str, Vec<&'s str>)> {
    let constants = |variant: &'s Value| -> Vec<(&'s str, &'s str)> {
        let keywords = schema.flat(variant).into_iter();
        let all = keywords.flat_map(properties);
        all.filter_map(|(key, value)| Some((key, value.get("const")?.as_str()?))).collect()
    };
    let per_variant: Vec<Vec<(&str, &str)>> = variants.iter().map(|variant| constants(variant)).collect();
    let (first, _) = per_variant.split_first()?;
    first.iter().find_map(|&(tag, _)| {
        let value = |constants: &Vec<(&'s str, &'s str)>| {
            constants.iter().find(|&&(key, _)| key == tag).map(|&(_, value)| value)
        };
        let values: Option<Vec<&str>> = per_variant.iter().map(value).collect();
        values.map(|values| (tag, values))
    })
}

fn by_tag<'s>(tag: &'s str, values: &[&'s str], variants: &[&'s Value], node: &Node) -> Pick<'s> {
    let written = node.get(tag).and_then(|entry| match &entry.node.value {
        Toml::String(text) => Some(text.as_str()),
        _ => None,
    });
    let chosen = values.iter().position(|&value| Some(value) == written);
    let Some((at, &schema)) = chosen.and_then(|at| Some((at, variants.get(at)?))) else {
        return Pick::Tag { tag, allowed: values.to_vec(), variants: variants.to_vec() };
    };
    let named = values.iter().zip(variants).enumerate().filter(|&(number, _)| number != at);
    let others = named.map(|(_, (value, &variant))| (format!("{tag} = \"{value}\""), variant)).collect();
    Pick::Variant { schema, others }
}

/// One required key of each variant that no other variant knows.
pub(crate) fn distinguishing_keys<'s>(variants: &[Vec<&'s Keywords>]) -> Option<Vec<&'s str>> {
    let knows = |variant: &[&Keywords], key: &str| {
        variant.iter().any(|keywords| properties(keywords).any(|(known, _)| known == key))
    };
    let own_key = |(number, variant): (usize, &Vec<&'s Keywords>)| {
        let others = || variants.iter().enumerate().filter(move |&(other, _)| other != number);
        let needed = variant.iter().flat_map(|keywords| required(keywords));
        let mut own = needed.filter(|key| !others().any(|(_, other)| knows(other, key)));
        own.next()
    };
    variants.iter().enumerate().map(own_key).collect()
}

fn by_key<'s>(keys: &[&'s str], variants: &[&'s Value], node: &Node) -> Pick<'s> {
    let named = keys.iter().zip(variants).filter(|(key, _)| node.get(key).is_some());
    let present: Vec<(&'s str, &'s Value)> = named.map(|(&key, &variant)| (key, variant)).collect();
    match present.as_slice() {
        [(_, only)] => decided(only),
        several => Pick::Keys {
            keys: keys.to_vec(),
            present: several.iter().map(|&(key, _)| key).collect(),
            variants: variants.to_vec(),
        },
    }
}

/// The variant with the fewest misfits, judged by the value and one level below it; the first of equals.
fn best_fit<'s>(schema: &'s Schema, variants: &[&'s Value], node: &Node) -> Pick<'s> {
    let best = variants.iter().min_by_key(|variant| misfits(schema, variant, node));
    best.map_or(Pick::WrongKind, |variant| decided(variant))
}

fn misfits(schema: &Schema, variant: &Value, node: &Node) -> usize {
    let all = schema.flat(variant);
    match &node.value {
        Toml::Array(elements) => all.iter().map(|keywords| array_misfits(schema, keywords, elements)).sum(),
        Toml::Table(_) => table_misfits(schema, &all, node),
        _ => 0,
    }
}

fn array_misfits(schema: &Schema, keywords: &Keywords, elements: &[Node]) -> usize {
    let count = elements.len() as u64;
    let bound = |keyword| keywords.get(keyword).and_then(Value::as_u64);
    let too_few = bound("minItems").is_some_and(|min| count < min);
    let too_many = bound("maxItems").is_some_and(|max| count > max);
    let wrong = keywords.get("items").map_or(0, |items| {
        elements.iter().take(16).filter(|element| !accepts(schema, items, Kind::of(element))).count()
    });
    usize::from(too_few) + usize::from(too_many) + wrong
}

fn table_misfits(schema: &Schema, all: &[&Keywords], node: &Node) -> usize {
    let schema_of = |key: &str| {
        all.iter()
            .flat_map(|keywords| properties(keywords))
            .find(|&(known, _)| known == key)
            .map(|(_, value)| value)
    };
    let missing =
        all.iter().flat_map(|keywords| required(keywords)).filter(|key| node.get(key).is_none()).count();
    let wrong = |key: &str, value: &Node| match schema_of(key) {
        None => true,
        Some(of) => !accepts(schema, of, Kind::of(value)),
    };
    missing + node.entries().iter().filter(|entry| wrong(&entry.key, &entry.node)).count()
}
