//! Whatever a file contains: an answer, soon, and every problem with a place.

use std::collections::BTreeMap;

use coshade_config::{Document, Error};
use coshade_testdata::mutate::mutations;
use proptest::prelude::*;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
struct Tree {
    #[serde(skip_serializing_if = "Option::is_none")]
    name: Option<String>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    child: Vec<Tree>,
    #[serde(skip_serializing_if = "Option::is_none")]
    leaf: Option<Leaf>,
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    map: BTreeMap<String, f64>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    numbers: Vec<i64>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "lowercase")]
enum Leaf {
    Number { value: f64 },
    Text { value: String, exact: Option<bool> },
    Either(Either),
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
struct Either {
    one: Option<f32>,
    #[serde(flatten)]
    other: Other,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
enum Other {
    A { a: u8 },
    B { b: [f64; 2], c: Option<String> },
}

const SEED: &str = "# a tree
name = 'root' # its name
numbers = [
    1, # one
    -2,
    0x10, ]
map = { a = 1.5, \"b c\" = -2e-3 }
leaf.kind = \"text\"
leaf.value = \"\"\"
two
lines\"\"\"

[[child]]
name = \"first\"
leaf = { kind = \"number\", value = 1 }
[[child.child]] # below
leaf = { kind = \"either\", one = 1.5, b = [1, 2.5], c = \"x\" }

[[child]]
[child.map]
x = 1
[child.leaf]
kind = \"either\"
a = 255
";

/// Reads it; if that fails, every problem must have a place within the text.
fn read(text: &str) -> Option<Document<Tree>> {
    match Document::parse(text, "tree.toml") {
        Ok(document) => Some(document),
        Err(error) => {
            let problems = error.problems();
            assert!(!problems.is_empty(), "{error}");
            let lines = text.split('\n').count();
            for problem in problems {
                assert!((1..=lines).contains(&problem.line) && problem.column >= 1, "{problem:?}");
                assert!(!problem.message.is_empty());
                let printable = |c: char| c == '\n' || !c.is_control();
                assert!(problem.to_string().chars().all(printable), "{problem}");
            }
            None
        }
    }
}

#[test]
fn the_seed_is_a_valid_file() {
    assert!(read(SEED).is_some());
}

#[test]
fn damaged_files_are_refused_with_places_or_read() {
    let mut valid = 0;
    for (_, bytes) in mutations(SEED.as_bytes(), 600) {
        valid += usize::from(read(&String::from_utf8_lossy(&bytes)).is_some());
    }
    assert!((1..600).contains(&valid), "{valid} of 600 still valid");
}

#[test]
fn every_readable_file_becomes_every_other() {
    let texts: Vec<String> = mutations(SEED.as_bytes(), 400)
        .filter_map(|(_, bytes)| String::from_utf8(bytes).ok())
        .filter(|text| read(text).is_some())
        .take(25)
        .collect();
    assert!(texts.len() > 5, "{} readable", texts.len());
    for from in &texts {
        for to in &texts {
            let mut document = read(from).unwrap();
            let goal = read(to).unwrap().into_value();
            document.set(&goal).unwrap_or_else(|error| panic!("{error}\nfrom\n{from}\nto\n{to}"));
            assert_eq!(document.value(), &goal);
        }
    }
}

#[test]
fn nesting_ends_in_a_message_and_not_in_a_stack_overflow() {
    let n = 100_000;
    for text in [
        format!("numbers = {}", "[".repeat(n)),
        format!("numbers = {}{}", "[".repeat(n), "]".repeat(n)),
        format!("leaf = {}", "{ a = ".repeat(n)),
        format!("a{} = 1", ".a".repeat(n)),
        format!("[a{}]", ".a".repeat(n)),
        format!("[[a{}]]", ".a".repeat(n)),
        "[child.child]\n".repeat(n),
        format!("leaf = {}1{}", "{ a.a.a.a.a.a.a.a.a = ".repeat(20), " }".repeat(20)),
        format!("x = \"\"\"{}", "\"\"\\".repeat(n)),
    ] {
        assert!(read(&text).is_none());
    }
}

#[test]
fn deep_files_within_the_limits_are_read() {
    let text = "[[child]]\n[[child.child]]\n[[child.child.child]]\n[[child.child.child.child]]\nname = 'x'\n";
    assert!(read(text).is_some());
}

#[test]
fn large_files_are_refused_before_they_cost_memory() {
    let huge = format!("numbers = [{}]", "0,".repeat(1_000_000));
    assert!(read(&huge).is_none());
    let long = " ".repeat(coshade_config::MAX_FILE_BYTES as usize + 1);
    assert!(matches!(Document::<Tree>::parse(&long, "a"), Err(Error::TooLarge { .. })));
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("long.toml");
    std::fs::write(&path, &long).unwrap();
    assert!(matches!(Document::<Tree>::read(&path), Err(Error::TooLarge { .. })));
}

#[test]
fn many_problems_are_counted_and_not_all_printed() {
    let text: String = (0..5000).map(|i| format!("unknown{i} = 1\n")).collect();
    let error = Document::<Tree>::parse(&text, "a").unwrap_err();
    assert_eq!(error.problems().len(), 100);
    assert!(error.to_string().contains("more problems"));
}

#[test]
fn what_is_not_a_text_file_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    assert!(matches!(Document::<Tree>::read(folder.path()), Err(Error::NotAFile { .. })));
    assert!(matches!(Document::<Tree>::read(folder.path().join("none")), Err(Error::Read { .. })));
    let path = folder.path().join("latin1.toml");
    std::fs::write(&path, b"name = 'a'\n# caf\xe9\n").unwrap();
    let error = Document::<Tree>::read(&path).unwrap_err();
    assert!(matches!(error, Error::NotUtf8 { line: 2, column: 6, .. }), "{error}");
    #[cfg(unix)]
    assert!(matches!(Document::<Tree>::read("/dev/zero"), Err(Error::NotAFile { .. })));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn any_bytes(bytes in proptest::collection::vec(any::<u8>(), 0..200)) {
        read(&String::from_utf8_lossy(&bytes));
    }

    /// Of the characters that mean something in TOML.
    #[test]
    fn any_toml_like_text(text in "[\\[\\]{}=.,\"'#\\\\ \na-c0-9_+\\-e:TZ]{0,120}") {
        read(&text);
    }

    #[test]
    fn any_numbers_survive_writing(numbers in proptest::collection::vec(any::<i64>(), 0..20), value in any::<f64>()) {
        prop_assume!(value.is_finite());
        let mut document = read(SEED).unwrap();
        let mut tree = document.value().clone();
        tree.numbers = numbers;
        tree.child[0].leaf = Some(Leaf::Number { value });
        document.set(&tree).unwrap();
        prop_assert_eq!(document.value(), &tree);
    }
}
