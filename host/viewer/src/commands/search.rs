//! Finds what the user means by some words.

/// What other programs call things, and a word of ours.
const SYNONYMS: [(&str, &str); 17] = [
    ("bookmark", "remember"),
    ("clip", "crop"),
    ("edl", "depth"),
    ("export", "save"),
    ("extract", "split"),
    ("fit", "everything"),
    ("fly", "walk"),
    ("frame", "everything"),
    ("home", "everything"),
    ("import", "open"),
    ("isolate", "others"),
    ("lamp", "light"),
    ("ortho", "orthographic"),
    ("preferences", "settings"),
    ("ruler", "distance"),
    ("screenshot", "pictures"),
    ("segment", "select"),
];

/// How well a text fits: the words in any order, each the beginning of a word, a part, or letters in order. Higher is
/// better; `None` where a word is not found.
pub(super) fn score(query: &str, name: &str, about: &str) -> Option<u32> {
    let (name, about) = (name.to_lowercase(), about.to_lowercase());
    let mut total = 0;
    for word in query.to_lowercase().split_whitespace() {
        let other = || {
            let others = SYNONYMS.iter().filter(|(called, _)| called.starts_with(word));
            let scores = others.filter_map(|(_, ours)| score_of_word(ours, &name, &about));
            // What is called so itself comes first.
            scores.max().map(|score| score / 2)
        };
        total += score_of_word(word, &name, &about).max(other().filter(|_| word.len() > 2))?;
    }
    // The name itself, its menu left out, before names that have more words.
    let is_name = name.rsplit(": ").next() == Some(query.trim().to_lowercase().as_str());
    Some(total + if is_name { 10 } else { 0 })
}

fn score_of_word(word: &str, name: &str, about: &str) -> Option<u32> {
    let begins = name.split(|c: char| !c.is_alphanumeric()).position(|part| part.starts_with(word));
    if let Some(place) = begins {
        return Some(100 - u32::try_from(place).unwrap_or(50).min(50));
    }
    if name.contains(word) {
        return Some(40);
    }
    if about.split(|c: char| !c.is_alphanumeric()).any(|part| part.starts_with(word)) {
        return Some(20);
    }
    // A few letters are in nearly every name.
    let mut letters = name.chars();
    let in_order = word.chars().all(|letter| letters.any(|other| other == letter));
    (in_order && word.chars().count() > 2).then_some(5)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_found_in_any_order_and_by_their_beginnings() {
        let fits = |query: &str, name: &str| score(query, name, "writes it to a file").is_some();
        assert!(fits("sav sc", "Save scene as …") && fits("scene save", "Save scene as …"));
        assert!(fits("svscn", "Save scene as …") && fits("file", "Save scene as …"));
        assert!(
            fits("", "Save scene") && !fits("cloud", "Save scene") && !fits("zz", "Save scene")
        );
        let fits_name = |query: &str, name: &str| score(query, name, "").is_some();
        assert!(fits_name("bookmark", "Remember this camera") && !fits_name("bo", "Remember it"));
        assert!(fits_name("screenshot", "Save pictures …") && fits_name("frame", "See everything"));
        let best = |query: &str, names: [&'static str; 2]| {
            names.into_iter().max_by_key(|name| score(query, name, "")).unwrap()
        };
        assert_eq!(best("top", ["Stop it", "View from the top"]), "View from the top");
        assert_eq!(best("view", ["Split the view", "View from the top"]), "View from the top");
        assert_eq!(best("points", ["Look: Points", "y points up"]), "Look: Points");
    }
}
