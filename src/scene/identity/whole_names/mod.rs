//! Texts that name an identity, and the one that is shown: the only place that decides this.

use std::collections::HashMap;

use super::super::text;
use super::{Identities, IdentityId, LevelFilter};

/// Between the names of a piece and of its wholes.
pub(crate) const BETWEEN: &str = " \u{b7} ";
/// Most levels in a full name.
const DEEPEST: usize = 8;
/// Longest text, in bytes, that can be a name.
const LONGEST: usize = DEEPEST * text::LONGEST_NAME * 4;
/// Marks around a name that are no part of it.
const MARKS: &str = "?!.,;:\u{2026}\"'()[]{}«»“”„、。！？";

/// A text as it is compared: letter case, white space, articles in front and marks around do not count.
pub(crate) fn key(text: &str) -> String {
    let text = text::line(text).to_uppercase().to_lowercase();
    let text = text.replace(['\u{2018}', '\u{2019}', '`'], "'").replace('\u{b7}', BETWEEN);
    let text = text.split_whitespace().collect::<Vec<_>>().join(" ");
    without_articles(&text).split(BETWEEN).map(bare).collect::<Vec<_>>().join(BETWEEN)
}

fn without_articles(mut name: &str) -> &str {
    while let Some(rest) = ["the ", "a ", "an "].iter().find_map(|article| name.strip_prefix(article)) {
        name = rest;
    }
    name
}

/// A name without articles in front and marks around.
fn bare(name: &str) -> &str {
    let mut key = name;
    loop {
        key = without_articles(key);
        match key.trim_matches(|c| c == ' ' || MARKS.contains(c)) {
            // A name of nothing but marks keeps them.
            "" => return key,
            bare if bare == key => return key,
            bare => key = bare,
        }
    }
}

/// The names of a list of identities.
#[derive(Debug)]
pub(super) struct WholeNames {
    /// By number less one.
    pub(super) labels: Vec<String>,
    pub(super) full: Vec<String>,
    /// Numbers of the identities that a compared text names.
    called: HashMap<String, Vec<IdentityId>>,
    /// The same for full names as earlier versions wrote them: "lid of the kettle".
    formerly: HashMap<String, Vec<IdentityId>>,
}

impl WholeNames {
    pub(super) fn new(all: &Identities) -> Self {
        let (mut called, mut formerly) = (HashMap::new(), HashMap::new());
        let line = |id: IdentityId| all.ancestors(id).take(DEEPEST).map(|i| all.name(i)).collect::<Vec<_>>();
        for (id, identity) in all.iter() {
            let names = identity.names.iter().filter(|name| !key(name).is_empty());
            names.for_each(|name| {
                add(&mut called, key(name), id);
                add(&mut called, key(&numbered(name, id)), id);
            });
            let line = line(id);
            add(&mut called, key(&line.join(BETWEEN)), id);
            add(&mut formerly, key(&line.join(" of the ")), id);
        }
        let mut names = Self { labels: Vec::new(), full: Vec::new(), called, formerly };
        for (id, _) in all.iter() {
            let wholes = all.ancestors(id).take(DEEPEST).skip(1).map(|i| names.labels[i as usize - 1].as_str());
            let wholes: Vec<&str> = wholes.collect();
            let full = |label: &str| [&[label][..], &wholes].concat().join(BETWEEN);
            let mut label = all.name(id);
            // One more number sets apart even a name that equals another one's name and number.
            for _ in 0..3 {
                let others = names.called.get(&key(&full(&label))).into_iter().flatten();
                if others.copied().all(|other| all.ancestors(other).any(|i| i == id)) {
                    break;
                }
                label = numbered(&label, id);
            }
            let full = full(&label);
            add(&mut names.called, key(&full), id);
            names.labels.push(label);
            names.full.push(full);
        }
        names
    }

    /// Numbers of the identities of these levels that a text names.
    pub(super) fn called(&self, text: &str, all: &Identities, level: LevelFilter) -> Vec<IdentityId> {
        if text.len() > LONGEST {
            return Vec::new();
        }
        let (key, is_wished) = (key(text), |id: &&IdentityId| all.get(**id).is_some_and(|i| level.accepts(i.level)));
        let in_each = [&self.called, &self.formerly].into_iter();
        let found = in_each.map(|names| names.get(&key).into_iter().flatten().filter(is_wished).copied().collect());
        found.into_iter().find(|ids: &Vec<_>| !ids.is_empty()).unwrap_or_default()
    }
}

fn numbered(name: &str, id: IdentityId) -> String {
    format!("{name} #{id}")
}

fn add(names: &mut HashMap<String, Vec<IdentityId>>, key: String, id: IdentityId) {
    let ids = names.entry(key).or_default();
    if let Err(at) = ids.binary_search(&id) {
        ids.insert(at, id);
    }
}

#[cfg(test)]
mod tests;
