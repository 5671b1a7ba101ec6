//! Courtesy around a question, and colors that speak against an answer by embedding.

use super::colors;
use super::parse::ParsedQuery;
use crate::scene::{Identities, IdentityId};

/// Courtesy and the like in front of a question.
const COURTESY: [&str; 15] =
    ["please", "show", "find", "locate", "where", "is", "are", "me", "my", "our", "your", "his", "her", "their", "its"];
/// Words that only bind a piece to its whole.
const BINDING: [&str; 3] = ["in", "inside", "at"];

/// Returns the telling words among these: those that are neither courtesy nor binding words.
pub(crate) fn telling(words: &[String]) -> Vec<String> {
    let says_nothing = |word: &str| COURTESY.contains(&word) || BINDING.contains(&word);
    words.iter().filter(|word| !says_nothing(word)).cloned().collect()
}

/// Returns a question without courtesy in front and behind: "where is my mug, please" asks for "mug".
pub(crate) fn without_courtesy(query: &str) -> &str {
    let is_courtesy = |word: &str| COURTESY.contains(&word.trim_matches(',').to_lowercase().as_str());
    let mut rest = query.trim();
    while let Some((_, others)) = rest.split_once(char::is_whitespace).filter(|(first, _)| is_courtesy(first)) {
        rest = others.trim_start();
    }
    let rest = rest.trim_end_matches(|c: char| c.is_whitespace() || "?!.,".contains(c));
    let polite = rest.rsplit_once(char::is_whitespace).filter(|(_, last)| last.eq_ignore_ascii_case("please"));
    polite.map_or(rest, |(asked, _)| asked.trim_end_matches([',', ' ']))
}

/// Returns whether a phrase names a color that `id` does not have, judged by names or Gaussians.
pub(crate) fn is_of_another_color(identities: &Identities, id: IdentityId, phrase: &ParsedQuery) -> bool {
    let named = |text: &String, owner: IdentityId| {
        colors::named(text).into_iter().any(|color| color_of(identities, owner, color) == Some(false))
    };
    let of_whole = |whole: &String| {
        identities.ancestors(id).skip(1).all(|i| named(whole, i)) && identities.ancestors(id).count() > 1
    };
    named(&phrase.target, id) || phrase.whole.as_ref().is_some_and(of_whole)
}

/// Returns whether an identity has a color: by an own name with a color, else by its Gaussians. `None` if unknown.
pub(crate) fn color_of(identities: &Identities, id: IdentityId, color: usize) -> Option<bool> {
    let names = identities.get(id).map(|i| i.names.as_slice()).unwrap_or_default();
    let named: Vec<usize> = names.iter().flat_map(|name| colors::named(name)).collect();
    if named.is_empty() { identities.colors.has(id, color) } else { Some(named.contains(&color)) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::sh::SH_C0;
    use crate::scene::{GaussianCloud, Level, NO_IDENTITY, SemanticMap};

    /// A white mug with a red handle, and a kettle that is called blue and is red.
    fn scene() -> Identities {
        let mut all = Identities::default();
        let mug = all.add(Level::Object, NO_IDENTITY, vec!["mug".into()]);
        let handle = all.add(Level::Part, mug, vec!["handle".into()]);
        let kettle = all.add(Level::Object, NO_IDENTITY, vec!["blue kettle".into()]);
        let of = vec![mug, mug, mug, handle, kettle];
        let (white, red) = ([0.9; 3], [0.8, 0.1, 0.1]);
        let cloud = GaussianCloud {
            positions: vec![[0.0; 3]; 5],
            log_scales: vec![[-3.0; 3]; 5],
            quaternions: vec![[1.0, 0.0, 0.0, 0.0]; 5],
            opacity_logits: vec![4.0; 5],
            sh: [white, white, white, red, red].map(|rgb| rgb.map(|c: f64| ((c - 0.5) / SH_C0) as f32)).to_vec(),
            ..GaussianCloud::default()
        };
        let mut map = SemanticMap::from_identities(all, of, vec![1.0; 5], vec![]);
        map.look_at(&cloud);
        map.identities
    }

    #[test]
    fn courtesy_says_nothing_and_another_color_is_another_thing() {
        for (query, asked) in [
            ("where is my mug, please?", "mug"),
            ("Please show me the lamp", "the lamp"),
            ("my camera", "camera"),
            ("please", "please"),
            ("red mug", "red mug"),
            ("", ""),
        ] {
            assert_eq!(without_courtesy(query), asked, "{query}");
        }
        let all = scene();
        let another = |id, text: &str| is_of_another_color(&all, id, &ParsedQuery::parse(text).expect("words"));
        // Names come before what is seen.
        assert!(another(1, "blue cup") && another(3, "red pot") && another(2, "lid of the blue cup"));
        assert!(
            !another(1, "white cup")
                && !another(1, "cup")
                && !another(3, "blue pot")
                && !another(2, "lid of the white cup")
        );
        // Without observed colors nothing is known, and nothing speaks against it.
        let mut unseen = Identities::default();
        unseen.add(Level::Object, NO_IDENTITY, vec!["mug".into()]);
        assert!(!is_of_another_color(&unseen, 1, &ParsedQuery::parse("white mug").expect("words")));
    }
}
