//! "Did you mean".

/// The candidate closest to what was written, if any is close enough to be meant.
pub fn nearest<'c>(written: &str, candidates: impl IntoIterator<Item = &'c str>) -> Option<&'c str> {
    // Distances cost the product of the lengths; nobody mistypes a name of a hundred letters.
    let written: String = written.chars().take(100).map(normal).collect();
    let scored = candidates.into_iter().filter_map(|candidate| {
        let plain: String = candidate.chars().map(normal).collect();
        close_enough(&written, &plain).map(|distance| (distance, candidate))
    });
    scored.min_by_key(|&(distance, _)| distance).map(|(_, candidate)| candidate)
}

fn normal(c: char) -> char {
    if c == '-' || c == ' ' { '_' } else { c.to_ascii_lowercase() }
}

/// A third of the letters wrong, or a part left out at an underscore (`position` for `position_m`).
fn close_enough(written: &str, candidate: &str) -> Option<usize> {
    let distance = strsim::damerau_levenshtein(written, candidate);
    let longer = written.chars().count().max(candidate.chars().count());
    let part = |long: &str, short: &str| long.strip_prefix(short).is_some_and(|rest| rest.starts_with('_'));
    let close = distance <= (longer / 3).max(1) && distance < longer;
    let partial = part(candidate, written) || part(written, candidate);
    (close || partial).then_some(if partial { distance.min(1) } else { distance })
}

/// `` `a`, `b` `` for messages.
pub(crate) fn quoted_list<'a>(names: impl IntoIterator<Item = &'a str>) -> String {
    let quoted: Vec<String> = names.into_iter().map(|name| format!("`{name}`")).collect();
    quoted.join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finds_slips_and_forgotten_units_but_no_strangers() {
        let keys = ["position_m", "size_m", "id", "rotation_deg"];
        assert_eq!(nearest("positon_m", keys), Some("position_m"));
        assert_eq!(nearest("size", keys), Some("size_m"));
        assert_eq!(nearest("Rotation-Deg", keys), Some("rotation_deg"));
        assert_eq!(nearest("roughness", keys), None);
        assert_eq!(nearest("xy", keys), None);
        assert_eq!(nearest("", keys), None);
    }
}
