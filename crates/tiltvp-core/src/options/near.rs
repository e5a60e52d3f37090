//! Which names are near to one that is not known.

/// The most names that are named.
const MOST: usize = 3;

/// The names that are near to another, the nearest first: those that at most a third of the longer one's letters set apart,
/// or that begin with it or it with them.
pub fn near<'a>(name: &str, names: impl IntoIterator<Item = &'a str>) -> Vec<&'a str> {
    let mut found: Vec<(usize, &str)> = names
        .into_iter()
        .filter_map(|known| {
            let (distance, longer) = (edit_distance(name, known), name.len().max(known.len()));
            let begins = known.starts_with(name) || name.starts_with(known);
            (3 * distance <= longer || (begins && 2 * distance <= longer)).then_some((distance, known))
        })
        .collect();
    found.sort_unstable();
    found.into_iter().take(MOST).map(|(_, known)| known).collect()
}

/// How many letters have to be changed, added or removed: Levenshtein's distance.
pub(crate) fn edit_distance(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, letter) in a.chars().enumerate() {
        let mut corner = row[0];
        row[0] = i + 1;
        for (j, other) in b.iter().enumerate() {
            let changed = corner + usize::from(letter != *other);
            corner = row[j + 1];
            row[j + 1] = changed.min(row[j] + 1).min(corner + 1);
        }
    }
    row[b.len()]
}

#[cfg(test)]
mod tests {
    use super::{edit_distance, near};

    #[test]
    fn edit_distances() {
        assert_eq!(edit_distance("kitten", "sitting"), 3);
        assert_eq!(edit_distance("", "abc"), 3);
    }

    #[test]
    fn slips_are_near_and_other_words_are_not() {
        let names = ["gradient_min", "threshold_px", "seed", "mask", "lines_max"];
        assert_eq!(near("gradient_minimum", names), ["gradient_min"]);
        assert_eq!(near("treshold_px", names), ["threshold_px"]);
        assert_eq!(near("lines_mx", names), ["lines_max"]);
        assert!(near("sectors", names).is_empty());
        assert!(near("", names).is_empty());
    }
}
