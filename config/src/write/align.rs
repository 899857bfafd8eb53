//! Which element of an array became which.

use toml_edit::Value;

use super::same;

/// For every new element, the index of the old one that it continues.
///
/// Equal beginnings and ends belong together. Between them elements with the same `name` do, then equal ones, and what
/// is left is paired in order if nothing was added or removed.
pub(crate) fn align(old: &[&Value], new: &[&Value]) -> Vec<Option<usize>> {
    let pairs = || old.iter().zip(new);
    let head = pairs().take_while(|(a, b)| same(a, b)).count();
    let tail_pairs = old.iter().rev().zip(new.iter().rev()).take(old.len().min(new.len()) - head);
    let tail = tail_pairs.take_while(|(a, b)| same(a, b)).count();

    let mut matched = vec![None; new.len()];
    let mut taken = vec![false; old.len()];
    let mut pair = |matched: &mut Vec<Option<usize>>, to: usize, from: usize| {
        if let (Some(slot), Some(taken)) = (matched.get_mut(to), taken.get_mut(from))
            && slot.is_none()
            && !*taken
        {
            *slot = Some(from);
            *taken = true;
        }
    };
    for at in 0..head {
        pair(&mut matched, at, at);
    }
    for from_end in 1..=tail {
        pair(&mut matched, new.len() - from_end, old.len() - from_end);
    }
    let middle_old = head..old.len() - tail;
    let middle_new = head..new.len() - tail;
    if middle_old.len() == middle_new.len() && !named(old) {
        for (to, from) in middle_new.zip(middle_old) {
            pair(&mut matched, to, from);
        }
        return matched;
    }
    // The search is quadratic: beyond what people write by hand, order has to do.
    if middle_old.len().saturating_mul(middle_new.len()) <= 1_000_000 {
        for same_one in [same_name as fn(&Value, &Value) -> bool, same] {
            for to in middle_new.clone() {
                let mut candidates = middle_old.clone().filter(|&from| match (old.get(from), new.get(to)) {
                    (Some(a), Some(b)) => same_one(a, b),
                    _ => false,
                });
                if let Some(from) = candidates.next_back() {
                    pair(&mut matched, to, from);
                }
            }
        }
    }
    if old.len() == new.len() {
        let free_old: Vec<usize> = middle_old.filter(|from| !matched.contains(&Some(*from))).collect();
        let free_new: Vec<usize> = middle_new.filter(|&to| matched.get(to) == Some(&None)).collect();
        for (to, from) in free_new.into_iter().zip(free_old) {
            if let Some(slot) = matched.get_mut(to) {
                *slot = Some(from);
            }
        }
    }
    matched
}

fn named(elements: &[&Value]) -> bool {
    elements.iter().any(|element| name(element).is_some())
}

fn same_name(a: &Value, b: &Value) -> bool {
    name(a).is_some() && name(a) == name(b)
}

fn name(element: &Value) -> Option<&str> {
    element.as_inline_table()?.get("name")?.as_str()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn aligned(old: &str, new: &str) -> Vec<Option<usize>> {
        let parse = |text: &str| text.parse::<Value>().unwrap();
        let (old, new) = (parse(old), parse(new));
        let elements = |value: &Value| value.as_array().unwrap().iter().cloned().collect::<Vec<_>>();
        let (old, new) = (elements(&old), elements(&new));
        align(&old.iter().collect::<Vec<_>>(), &new.iter().collect::<Vec<_>>())
    }

    #[test]
    fn elements_are_recognised_by_place_name_and_content() {
        assert_eq!(aligned("[1, 2, 3]", "[1, 5, 3]"), [Some(0), Some(1), Some(2)]);
        assert_eq!(aligned("[1, 2, 3]", "[1, 3]"), [Some(0), Some(2)]);
        assert_eq!(aligned("[1, 3]", "[1, 2, 3]"), [Some(0), None, Some(1)]);
        assert_eq!(aligned("[]", "[1]"), [None]);
        assert_eq!(aligned("[1, 1]", "[1]"), [Some(0)]);
        let (a, b) = ("{ name = \"a\", x = 1 }", "{ name = \"b\", x = 1 }");
        let changed = "{ name = \"a\", x = 2 }";
        assert_eq!(aligned(&format!("[{a}, {b}]"), &format!("[{b}, {changed}]")), [Some(1), Some(0)]);
        assert_eq!(aligned(&format!("[{a}, {b}]"), &format!("[{changed}]")), [Some(0)]);
    }
}
