//! The JSON schema that `schemars` derives from a type, as the checker and the reference page read it.
//!
//! Understood: `$ref`, `allOf`, `anyOf`, `oneOf`, `type`, `const`, `enum`, `properties`, `required`,
//! `additionalProperties`, `patternProperties` (of maps with number keys), `items`, `prefixItems`, `minItems`,
//! `maxItems`, `minLength`, `minimum`, `maximum`, `exclusiveMinimum`, `exclusiveMaximum`, and `format` where it names
//! the width of a number.

pub(crate) mod check;
pub(crate) mod describe;
pub(crate) mod kind;
mod number;
pub(crate) mod variant;

use schemars::JsonSchema;
use serde_json::{Map, Value};

use crate::tree::Node;
use variant::{Pick, pick};

/// One schema: an object of keywords.
pub(crate) type Keywords = Map<String, Value>;

/// References that lead to references end here.
const MAX_REFERENCES: usize = 32;

/// The schema of a type with its definitions.
pub(crate) struct Schema {
    root: Value,
}

/// The schemas that apply to one value together, with unions decided.
#[derive(Default)]
pub(crate) struct Facets<'s> {
    pub all: Vec<&'s Keywords>,
    /// Variants that exclude each other but are all there: their keys are known, none is required.
    pub loose: Vec<&'s Keywords>,
    /// Some part of the schema allows anything.
    pub anything: bool,
    /// Unions that could not be decided, and why.
    pub undecided: Vec<Pick<'s>>,
    /// Variants that were not taken, with the tag that selects them: to explain keys that belong to another variant.
    pub passed_over: Vec<(String, &'s Value)>,
}

impl Schema {
    pub(crate) fn of<T: JsonSchema>() -> Self {
        Self { root: schemars::schema_for!(T).to_value() }
    }

    pub(crate) fn root(&self) -> &Value {
        &self.root
    }

    /// The schema that a `$ref` names.
    pub(crate) fn target(&self, reference: &str) -> Option<&Value> {
        match reference.strip_prefix('#') {
            Some("") => Some(&self.root),
            Some(pointer) => self.root.pointer(pointer),
            None => None,
        }
    }

    /// The keywords of a schema and of all that it refers to or is combined of, without unions.
    pub(crate) fn flat<'s>(&'s self, schema: &'s Value) -> Vec<&'s Keywords> {
        let mut all = Vec::new();
        self.flatten(schema, MAX_REFERENCES, &mut all);
        all
    }

    fn flatten<'s>(&'s self, schema: &'s Value, references: usize, all: &mut Vec<&'s Keywords>) {
        let (Some(keywords), Some(references)) = (schema.as_object(), references.checked_sub(1)) else {
            return;
        };
        all.push(keywords);
        if let Some(target) = keywords.get("$ref").and_then(Value::as_str).and_then(|to| self.target(to)) {
            self.flatten(target, references, all);
        }
        for part in array(keywords, "allOf") {
            self.flatten(part, references, all);
        }
        // An optional value is a union with null, which TOML does not have.
        for union in unions(keywords) {
            if let [only] = union.as_slice() {
                self.flatten(only, references, all);
            }
        }
    }

    /// What applies to `node`, with every union decided by the node's content where that is possible.
    pub(crate) fn facets<'s>(&'s self, schema: &'s Value, node: &Node) -> Facets<'s> {
        let mut facets = Facets::default();
        self.gather(schema, node, MAX_REFERENCES, &mut facets);
        facets
    }

    fn gather<'s>(&'s self, schema: &'s Value, node: &Node, references: usize, facets: &mut Facets<'s>) {
        let Some(references) = references.checked_sub(1) else {
            return;
        };
        facets.anything |= schema == &Value::Bool(true);
        for keywords in self.flat(schema) {
            facets.anything |= keywords.is_empty();
            facets.all.push(keywords);
            for union in unions(keywords).into_iter().filter(|union| union.len() > 1) {
                match pick(self, &union, node) {
                    Pick::Variant { schema, others } => {
                        facets.passed_over.extend(others);
                        self.gather(schema, node, references, facets);
                    }
                    undecided => {
                        if let Pick::Keys { variants, .. } = &undecided {
                            facets.loose.extend(variants.iter().flat_map(|variant| self.flat(variant)));
                        }
                        facets.undecided.push(undecided);
                    }
                }
            }
        }
    }
}

/// Elements of an array keyword; none if it is absent.
pub(crate) fn array<'s>(keywords: &'s Keywords, keyword: &str) -> &'s [Value] {
    keywords.get(keyword).and_then(Value::as_array).map_or(&[], Vec::as_slice)
}

/// `anyOf` and `oneOf`, each without null.
pub(crate) fn unions(keywords: &Keywords) -> Vec<Vec<&Value>> {
    ["anyOf", "oneOf"]
        .iter()
        .map(|keyword| array(keywords, keyword).iter().filter(|variant| !is_null(variant)).collect())
        .filter(|union: &Vec<_>| !union.is_empty())
        .collect()
}

fn is_null(schema: &Value) -> bool {
    schema.get("type").and_then(Value::as_str) == Some("null")
}

/// Named keys of a table schema.
pub(crate) fn properties(keywords: &Keywords) -> impl Iterator<Item = (&str, &Value)> {
    let properties = keywords.get("properties").and_then(Value::as_object);
    properties.into_iter().flatten().map(|(key, schema)| (key.as_str(), schema))
}

/// Names of the keys that must be there.
pub(crate) fn required(keywords: &Keywords) -> impl Iterator<Item = &str> {
    array(keywords, "required").iter().filter_map(Value::as_str)
}

/// The strings that `const` and `enum` allow; `None` without such a keyword.
pub(crate) fn allowed_strings(keywords: &Keywords) -> Option<Vec<&str>> {
    if let Some(only) = keywords.get("const") {
        return Some(only.as_str().into_iter().collect());
    }
    let values = keywords.get("enum")?.as_array()?;
    Some(values.iter().filter_map(Value::as_str).collect())
}

/// The schema of the values of a map.
pub(crate) fn map_values<'s>(keywords: &'s Keywords, key: &str) -> Option<&'s Value> {
    let patterns = keywords.get("patternProperties").and_then(Value::as_object);
    let digits = !key.is_empty() && key.trim_start_matches('-').bytes().all(|byte| byte.is_ascii_digit());
    if let Some(of) = patterns.and_then(|patterns| patterns.values().next()) {
        return digits.then_some(of);
    }
    keywords.get("additionalProperties").filter(|&of| of != &Value::Bool(false))
}
