//! Collection of sentences: frames around phrases, and a choice of sentences that is balanced over the kinds.

use std::collections::{BTreeMap, HashMap, HashSet, VecDeque};

use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg32;

use super::scope::TruePhrase;
use super::{Referring, ReferringKind, ReferringTruth};

/// Sentences around a phrase for one thing.
const ONE: &[&str] = &[
    "{}",
    "show me {}",
    "find {}",
    "please select {}",
    "could you highlight {}?",
    "I am looking for {}",
    "Where is {}?",
    "can you point out {}, please?",
    "{}, please",
    "pick {}",
    "Would you mind marking {}?",
    "let me see {}",
    "Locate {} for me.",
    "I would like to see {}",
];
/// Sentences around a phrase for several things.
const MANY: &[&str] = &[
    "{}",
    "show me {}",
    "find {}",
    "please highlight {}",
    "could you select {}?",
    "I am looking for {}",
    "can you point out {}, please?",
    "mark {}",
    "Would you kindly mark {}?",
    "let me see {}",
    "I want {}",
];
/// Frame of a sentence that is complete.
const WHOLE: &[&str] = &["{}"];
/// Sentences to choose from, for each that is wanted.
const PLENTY: usize = 40;

/// Sentences with their truth.
pub(super) struct SentenceSet {
    rng: Pcg32,
    cores: Vec<SentenceCore>,
    skipped: usize,
}

struct SentenceCore {
    kind: ReferringKind,
    text: String,
    frames: &'static [&'static str],
    truth: ReferringTruth,
}

impl SentenceSet {
    pub(super) fn new(seed: u64) -> Self {
        Self { rng: Pcg32::seed_from_u64(seed), cores: Vec::new(), skipped: 0 }
    }

    /// Picks one of the wordings, of which there must be some.
    pub(super) fn pick<T: Copy>(&mut self, wordings: &[T]) -> T {
        wordings[self.rng.random_range(0..wordings.len())]
    }

    /// Picks up to `most` of the items, in random order.
    pub(super) fn some<T: Clone>(&mut self, items: &[T], most: usize) -> Vec<T> {
        let mut all = items.to_vec();
        all.shuffle(&mut self.rng);
        all.truncate(most);
        all
    }

    /// Adds a phrase for one thing; `fits` are those it may mean, `None` if that is unclear.
    pub(super) fn one(&mut self, kind: ReferringKind, phrase: impl Into<String>, fits: Option<Vec<usize>>) {
        self.add(kind, phrase.into(), ONE, fits.map(any_of));
    }

    /// Adds a phrase for all things that fit.
    pub(super) fn many(&mut self, kind: ReferringKind, phrase: impl Into<String>, fits: Option<Vec<usize>>) {
        self.add(kind, phrase.into(), MANY, fits.map(all_of));
    }

    /// Adds a complete sentence about one thing.
    pub(super) fn ask_one(&mut self, kind: ReferringKind, text: impl Into<String>, fits: Option<Vec<usize>>) {
        self.add(kind, text.into(), WHOLE, fits.map(any_of));
    }

    /// Adds a complete sentence about all things that fit.
    pub(super) fn ask_many(&mut self, kind: ReferringKind, text: impl Into<String>, fits: Option<Vec<usize>>) {
        self.add(kind, text.into(), WHOLE, fits.map(all_of));
    }

    /// Adds "the mug left of the kettle", and "all mugs left of the kettle" where there may be several.
    pub(super) fn related(&mut self, kind: ReferringKind, head: &TruePhrase, tail: &str, fits: Option<Vec<usize>>) {
        let found = fits.as_ref().map_or(0, Vec::len);
        if let Some(one) = &head.one {
            let link = self.pick(&["", "", "that is ", "which is "]);
            let article = if found > 1 { self.pick(&["the", "any", "one"]) } else { "the" };
            self.one(kind, format!("{article} {one} {link}{tail}"), fits.clone());
        }
        let Some(many) = &head.many else { return };
        if head.generic {
            let every = self.pick(&["everything {}", "everything that is {}", "all things that are {}"]);
            let every = if found == 1 { every } else { self.pick(&[every, "the objects {}", "all objects {}"]) };
            self.many(kind, every.replace("{}", tail), fits);
        } else if (found != 1 && head.fits.len() > 1) || head.one.is_none() {
            let all = self.pick(&["all {} ", "the {} ", "the {} that are ", "all of the {} which are "]);
            self.many(kind, all.replace("{}", many) + tail, fits);
        }
    }

    /// Chooses sentences, a quarter or more of which name nothing, and returns how many were skipped as unclear.
    pub(super) fn choose(mut self, count: usize) -> (Vec<Referring>, usize) {
        self.cores.shuffle(&mut self.rng);
        let mut truths: HashMap<String, Option<ReferringTruth>> = HashMap::new();
        let mut all = Vec::new();
        let passes = self.cores.iter().map(|c| c.frames.len()).max().unwrap_or(0);
        for pass in 0..passes {
            if all.len() >= PLENTY * count {
                break;
            }
            for (i, core) in self.cores.iter().enumerate().filter(|(_, c)| pass < c.frames.len()) {
                let text = core.frames[(i + pass) % core.frames.len()].replace("{}", &core.text);
                let known = truths.entry(text.to_lowercase()).or_insert_with(|| Some(core.truth.clone()));
                if known.as_ref() != Some(&core.truth) {
                    *known = None;
                }
                all.push(Referring { text, kind: core.kind, truth: core.truth.clone() });
            }
        }
        let mut seen = HashSet::new();
        let [mut fitting, mut nothing]: [BTreeMap<ReferringKind, VecDeque<Referring>>; 2] = Default::default();
        for sentence in all {
            let text = sentence.text.to_lowercase();
            // What has two truths is ambiguous.
            if truths.get(&text).is_some_and(Option::is_some) && seen.insert(text) {
                let is_nothing = sentence.truth == ReferringTruth::Nothing;
                let queues = if is_nothing { &mut nothing } else { &mut fitting };
                queues.entry(sentence.kind).or_default().push_back(sentence);
            }
        }
        let mut chosen = draw(&mut nothing, count.div_ceil(4));
        chosen.extend(draw(&mut fitting, count.saturating_sub(count.div_ceil(4))));
        // Where few things can be named, more sentences name nothing.
        let left = count.saturating_sub(chosen.len()).min(count / 5);
        chosen.extend(draw(&mut nothing, left));
        chosen.shuffle(&mut self.rng);
        (chosen, self.skipped)
    }

    fn add(
        &mut self,
        kind: ReferringKind,
        text: String,
        frames: &'static [&'static str],
        truth: Option<ReferringTruth>,
    ) {
        match truth {
            Some(truth) => self.cores.push(SentenceCore { kind, text, frames, truth }),
            None => self.skipped += 1,
        }
    }
}

/// Takes up to `most` sentences, one of each kind in turn.
fn draw(queues: &mut BTreeMap<ReferringKind, VecDeque<Referring>>, most: usize) -> Vec<Referring> {
    let mut drawn = Vec::new();
    while drawn.len() < most && queues.values().any(|q| !q.is_empty()) {
        let left = most - drawn.len();
        drawn.extend(queues.values_mut().filter_map(VecDeque::pop_front).take(left));
    }
    drawn
}

fn any_of(fits: Vec<usize>) -> ReferringTruth {
    if fits.len() > 1 { ReferringTruth::OneOf(ids(fits)) } else { all_of(fits) }
}

fn all_of(fits: Vec<usize>) -> ReferringTruth {
    if fits.is_empty() { ReferringTruth::Nothing } else { ReferringTruth::All(ids(fits)) }
}

/// Ids of things, which count from 1.
fn ids(mut fits: Vec<usize>) -> Vec<u16> {
    fits.sort_unstable();
    fits.dedup();
    fits.into_iter().map(|i| (i + 1) as u16).collect()
}
