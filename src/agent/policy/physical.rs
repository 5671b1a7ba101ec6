//! Requests to do something in the real world, which a viewer cannot: dangerous ones are refused with
//! the danger's reason, harmless ones plainly.

use super::{Policy, Verdict};
use crate::agent::refusal::{Refusal, RefusalKind};
use crate::agent::words::{is_mark, singular, tokens, without_courtesy};
use crate::scene::Identities;

/// What is said before an action that is only asked about.
const ASKED: [&str; 16] = [
    "is it safe to",
    "is it dangerous to",
    "is it okay to",
    "is it ok to",
    "is it a good idea to",
    "what happens if i",
    "what if i",
    "what would happen if i",
    "how do i",
    "how can i",
    "should i",
    "should we",
    "may i",
    "try to",
    "help me to",
    "help me",
];
/// Words after a verb of the policy that make it a matter of the view: "take me to the lamp".
const OF_THE_VIEW: [&str; 31] = [
    "take me",
    "bring me to",
    "bring me closer",
    "bring back",
    "bring us",
    "bring it back",
    "bring everything",
    "get me to",
    "get rid",
    "get closer",
    "get nearer",
    "get to",
    "get a",
    "get back",
    "get up",
    "get down",
    "get out",
    "get in",
    "get on",
    "get away",
    "get farther",
    "get further",
    "get near",
    "get close",
    "get the view",
    "push in",
    "pull back",
    "pull out",
    "drop down",
    "set the camera",
    "close in",
];
/// What is looked at, not done: "give me a closer look", "take a look at the mug".
const LOOKS: [&str; 14] = [
    "look",
    "view",
    "glance",
    "closeup",
    "close-up",
    "overview",
    "list",
    "tour",
    "description",
    "picture",
    "details",
    "idea",
    "size",
    "dimensions",
];

/// What a request comes to in the real world.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Judgement {
    /// Nothing physical is asked for.
    Fine,
    /// Not done.
    Refused(Refusal),
    /// Done only if the user says yes, for this reason.
    Confirm(String),
}

impl Policy {
    /// What a request comes to. Things are known by the words of the request and by the names in
    /// the scene that it uses.
    pub fn judge(&self, text: &str, identities: &Identities) -> Judgement {
        if !self.is_on {
            return Judgement::Fine;
        }
        let tokens = tokens(text);
        // A quoted text is a name, not a request; its words still tell what is spoken of.
        let clauses = tokens.split(|t| is_mark(&t.low) || ["and", "then", "or", "but"].contains(&t.low.as_str()));
        let mut confirm = None;
        for clause in clauses {
            let words: Vec<&str> = clause.iter().map(|t| t.low.as_str()).collect();
            // What goes with a clause may stand in the next: "take the vase and the laptop".
            let all: Vec<String> = tokens.iter().map(|t| t.low.clone()).collect();
            let classes = self.classes_of(&all, identities);
            let Some(action) = self.action(&words) else {
                // Dangers are found wherever they are said: "would it hurt to tip the vase over ...".
                if let Some(reason) = self.mentioned_danger(&words, &classes) {
                    let text = format!("I will not do that, and it should not be done: {reason}");
                    return Judgement::Refused(Refusal::new(RefusalKind::Hazard, text));
                }
                continue;
            };
            match self.rule_for(action, &classes) {
                Some((Verdict::Refuse, reason)) => {
                    let text = format!("I will not do that, and it should not be done: {reason}");
                    return Judgement::Refused(Refusal::new(RefusalKind::Hazard, text));
                }
                Some((Verdict::Confirm, reason)) => confirm = Some(reason.to_owned()),
                Some((Verdict::Warn, reason)) => return Judgement::Refused(cannot(&format!(" {reason}"))),
                None => return Judgement::Refused(cannot("")),
            }
        }
        confirm.map_or(Judgement::Fine, Judgement::Confirm)
    }

    /// The physical action that a clause asks for.
    fn action(&self, words: &[&str]) -> Option<&str> {
        let mut words = without_courtesy(words);
        while let Some(n) = ASKED.iter().find_map(|phrase| {
            let wanted: Vec<&str> = phrase.split(' ').collect();
            (words.len() > wanted.len() && words.starts_with(&wanted)).then_some(wanted.len())
        }) {
            words = without_courtesy(&words[n..]);
        }
        let first = words.first()?;
        let text = words.join(" ");
        let says = |phrase: &str| text == phrase || text.strip_prefix(phrase).is_some_and(|r| r.starts_with(' '));
        if OF_THE_VIEW.iter().any(|p| says(p)) {
            return None;
        }
        if ["give", "take", "get", "have", "show", "offer"].contains(first) && words.iter().any(|w| LOOKS.contains(w)) {
            return None;
        }
        // "Get the lamp out of the way", "take it out of the picture": out of the view.
        if ["out of my", "out of the", "out of sight", "out of view"].iter().any(|p| text.contains(p))
            && ["sight", "view", "picture", "way", "scene", "image"].iter().any(|p| text.ends_with(p))
        {
            return None;
        }
        match words {
            // "Cut out the mug" draws it alone; "close to the mug" and "closer" are places.
            ["cut", "out", ..]
            | ["close" | "set" | "place" | "match" | "light", "to" | "up"]
            | ["close", "up" | "to", ..] => return None,
            // "Turn on the lamp", "turn the lamp off".
            ["turn" | "switch", rest @ ..] if rest.first().is_some_and(|w| ["on", "off"].contains(w)) => {
                return Some("operate");
            }
            ["turn", .., "on" | "off"] => return Some("operate"),
            ["water" | "light" | "microwave" | "match" | "hand" | "face" | "paint" | "play" | "hit"] => return None,
            _ => {}
        }
        // A verb names what it is done to; alone it is a word like any other.
        let base = base_form(first);
        let found = self.actions.iter().find(|a| a.words.iter().any(|w| w == first || *w == base))?;
        (words.len() > 1).then_some(found.name.as_str())
    }

    /// The reason of a refusal, if a physical action inside the clause is dangerous.
    fn mentioned_danger(&self, words: &[&str], classes: &[&str]) -> Option<&str> {
        const BEFORE_A_VERB: [&str; 18] = [
            "to", "i", "we", "you", "please", "just", "can", "could", "should", "would", "will", "must", "let's",
            "also", "me", "simply", "now", "someone",
        ];
        words.windows(2).filter(|pair| BEFORE_A_VERB.contains(&pair[0])).find_map(|pair| {
            let base = base_form(pair[1]);
            let action = self.actions.iter().find(|a| a.words.iter().any(|w| w == pair[1] || *w == base))?;
            let (verdict, reason) = self.rule_for(&action.name, classes)?;
            (verdict == Verdict::Refuse).then_some(reason)
        })
    }

    /// The classes of the things that a request speaks of.
    fn classes_of(&self, words: &[String], identities: &Identities) -> Vec<&str> {
        let mut spoken: Vec<String> = words.iter().flat_map(|w| w.split_whitespace()).map(plain).collect();
        let split = |name: &str| -> Vec<String> {
            let apart = name.split(|c: char| !c.is_alphanumeric()).filter(|w| !w.is_empty());
            apart.map(plain).collect()
        };
        for (_, identity) in identities.iter() {
            for name in identity.names.iter().map(|n| split(n)) {
                // The first word or the last stands for the whole name: a vase with water is a vase.
                let ends = [name.first(), name.last()];
                if ends
                    .into_iter()
                    .flatten()
                    .any(|end| end.chars().count() > 2 && words.iter().any(|w| plain(w) == *end))
                {
                    spoken.extend(name);
                }
            }
        }
        let named = self.classes.iter().filter(|c| c.words.iter().any(|w| spoken.contains(&plain(w))));
        named.map(|c| c.name.as_str()).collect()
    }

    fn rule_for(&self, action: &str, classes: &[&str]) -> Option<(Verdict, &str)> {
        let has = |class: &Option<String>| class.as_deref().is_none_or(|c| classes.contains(&c));
        let fits = |r: &&super::Rule| r.actions.iter().any(|a| a == action) && has(&r.of) && has(&r.with);
        self.rules.iter().find(fits).map(|r| (r.verdict, r.reason.as_str()))
    }
}

fn cannot(more: &str) -> Refusal {
    let text = format!("I can only look and show; I cannot move or use anything in the real world.{more}");
    Refusal::new(RefusalKind::CannotDo, text)
}

/// A word without quotes, possession and plural.
fn plain(word: &str) -> String {
    let word = word.trim_start_matches('"').to_lowercase();
    let word = word.strip_suffix("'s").unwrap_or(&word);
    singular(word)
}

/// "Pouring" and "poured" as "pour".
fn base_form(word: &str) -> String {
    let stem = word.strip_suffix("ing").or_else(|| word.strip_suffix("ed")).filter(|s| s.len() >= 3);
    stem.unwrap_or(word).to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Level, NOBODY};

    fn judged(text: &str) -> Judgement {
        let mut all = Identities::default();
        for name in ["vase with water", "laptop", "kitchen knife", "mug", "candle", "curtain"] {
            all.add(Level::Object, NOBODY, vec![name.into()]);
        }
        Policy::built_in().expect("policy").judge(text, &all)
    }

    fn kind(text: &str) -> Option<RefusalKind> {
        match judged(text) {
            Judgement::Refused(refusal) => Some(refusal.kind),
            _ => None,
        }
    }

    #[test]
    fn dangers_are_refused_with_their_reason() {
        for text in [
            "pour the water on the laptop",
            "Please pour the vase over the laptop.",
            "could you give the knife to the child",
            "show me the mug and then throw the knife",
            "light the candle under the curtain",
            "is it safe to spill coffee on the keyboard?",
        ] {
            assert_eq!(kind(text), Some(RefusalKind::Hazard), "{text}");
        }
        let Judgement::Refused(refusal) = judged("pour the water on the laptop") else { panic!("refused") };
        assert!(refusal.text.contains("short circuit"), "{}", refusal.text);
    }

    #[test]
    fn harmless_deeds_are_refused_plainly_and_looking_is_free() {
        for text in ["pick up the mug", "open the laptop", "turn on the lamp", "give me the mug", "press the button"] {
            assert_eq!(kind(text), Some(RefusalKind::CannotDo), "{text}");
        }
        for text in [
            "show me the knife",
            "take me to the lamp",
            "give me a closer look at the mug",
            "take a look at the laptop",
            "cut out the mug",
            "where is the water?",
            "get closer to the candle",
            "turn left",
            "light",
            "bring back the mug",
        ] {
            assert_eq!(judged(text), Judgement::Fine, "{text}");
        }
        assert_eq!(Policy::off().judge("pour water on the laptop", &Identities::default()), Judgement::Fine);
    }
}
