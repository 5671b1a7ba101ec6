//! Questions and answers as text.

use glam::DVec3;
use serde::{Deserialize, Serialize};

use crate::language::portable::PortableScene;
use crate::language::relations::HOLDS;
use crate::language::slips::mended_text;
use crate::language::viewpoint::Viewpoint;
use crate::language::{QueryPlace, QueryScene, SpokenOf, ask, hear};
use crate::scene::{Identities, IdentityId, LevelFilter};

/// Question from a place.
#[derive(Debug, Deserialize)]
struct Question {
    text: String,
    /// Camera position, relative to the page's origin.
    eye: DVec3,
    /// View direction.
    forward: DVec3,
    /// Things that "it" and "them" stand for.
    last: Vec<IdentityId>,
}

/// Answer to a question.
#[derive(Debug, Serialize)]
struct Answer {
    /// Things that fit.
    found: Vec<IdentityId>,
    /// True if one thing is meant and several fit.
    ambiguous: bool,
    /// True if something holds only in part.
    guess: bool,
    /// Answer in words, where words are asked for.
    said: Option<String>,
    /// Reason that nothing was found.
    why: Option<String>,
    /// Words that are the reason.
    misunderstood: Vec<String>,
    /// Things near what was asked for, if nothing was found.
    near: Vec<IdentityId>,
    /// Remarks, such as "A kind of fruit: apple."
    notes: Vec<String>,
    /// Effect of each part of the sentence in words, with the number of things left.
    steps: Vec<(String, usize)>,
}

/// Scene of a page, ready to be asked.
pub(crate) struct AskedScene {
    identities: Identities,
    /// Identities without Gaussians.
    gone: Vec<IdentityId>,
    up: DVec3,
    meters: Option<f64>,
}

impl AskedScene {
    /// Reads the scene that a page carries; `None` if it is damaged.
    pub(crate) fn read(json: &[u8]) -> Option<Self> {
        let PortableScene { mut identities, colors, shapes, up, meters } = serde_json::from_slice(json).ok()?;
        identities.colors = colors;
        identities.shapes = shapes.into_iter().map(|s| s.map(Into::into)).collect();
        let gone = identities.iter().map(|(id, _)| id).filter(|id| identities.shapes.get(*id).is_none()).collect();
        Some(Self { identities, gone, up, meters })
    }

    /// Answers a question by names, kinds, colors, places and order; `None` if there is nothing in it.
    pub(crate) fn answer(&self, question: &[u8]) -> Option<String> {
        let Question { text, eye, forward, last } = serde_json::from_slice(question).ok()?;
        let view = Some(Viewpoint { eye, forward, up: self.up });
        let talk = SpokenOf { group: last.clone(), last };
        let place = QueryPlace { view, meters: self.meters, talk, gone: self.gone.clone() };
        let scene =
            QueryScene { identities: &self.identities, level: LevelFilter::Auto, place: &place, by_names: true };
        let (mended, sentences) = hear(&self.identities, text.trim());
        let understood = ask(&scene, &mended.text, &sentences, None)?;
        let settled = understood.found.settled();
        let ambiguous = understood.is_ambiguous();
        let (why, misunderstood, near) = understood.unmet.map(|u| (Some(u.text), u.words, u.near)).unwrap_or_default();
        let answer = Answer {
            found: settled.iter().map(|m| m.id).collect(),
            ambiguous,
            guess: settled.iter().any(|m| m.sure < HOLDS[0]),
            said: understood.said,
            why,
            misunderstood,
            near,
            notes: mended_text(&mended.slips).into_iter().chain(understood.notes).collect(),
            steps: understood.steps.into_iter().map(|s| (s.text, s.left)).collect(),
        };
        serde_json::to_string(&answer).ok()
    }
}
