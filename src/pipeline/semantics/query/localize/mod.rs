//! Multilevel localization: from scores of phrases to the identities meant, with "not found" and
//! "ambiguous" among the answers.

use super::parse::ParsedQuery;
use super::recipe::Strategy;
use crate::scene::{Identities, IdentityId, Level, LevelFilter};

/// Most candidates in an answer.
const TOP: usize = 8;

/// Scores identities for phrases, by number less one; higher is better.
pub trait Scorer {
    /// Returns the scores of all identities for a phrase. `against` is the phrase of the whole, which then counts as
    /// one more canonical phrase that a piece must exceed (the paper's second step).
    fn scores(&mut self, phrase: &str, against: Option<&str>) -> Vec<f32>;

    /// Score under which an identity is no answer.
    fn threshold(&self) -> f32;

    /// Difference of scores under which two identities cannot be told apart.
    fn resolution(&self) -> f32;

    /// Returns whether the best identity is to be rejected although its score suffices.
    fn rejects(&mut self, _phrase: &ParsedQuery, _hit: &Hit) -> bool {
        false
    }
}

/// Candidate of an answer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Identity of the candidate.
    pub identity: IdentityId,
    /// Its score.
    pub score: f32,
    /// Margin of its score over the runner-up.
    pub(crate) margin: f32,
}

/// Outcome of a query.
#[derive(Clone, Debug, PartialEq)]
pub enum Answer {
    /// The first is the answer; runners-up follow.
    Found(Vec<Hit>),
    /// The first two or more are equally good answers.
    Ambiguous(Vec<Hit>),
    /// Nothing fits; the best candidates follow.
    NotFound(Vec<Hit>),
}

impl Answer {
    /// All candidates, best first.
    pub fn hits(&self) -> &[Hit] {
        match self {
            Self::Found(hits) | Self::Ambiguous(hits) | Self::NotFound(hits) => hits,
        }
    }

    /// The same with at most `most` candidates.
    fn cut(mut self, most: usize) -> Self {
        match &mut self {
            Self::Found(hits) | Self::Ambiguous(hits) | Self::NotFound(hits) => hits.truncate(most),
        }
        self
    }

    /// Outcome in a word or two: "found", "ambiguous" or "not found".
    pub(crate) fn verdict(&self) -> &'static str {
        match self {
            Self::Found(_) => "found",
            Self::Ambiguous(_) => "ambiguous",
            Self::NotFound(_) => "not found",
        }
    }
}

/// Finds the identities that `phrase` means.
pub fn localize(
    identities: &Identities,
    phrase: &ParsedQuery,
    level: LevelFilter,
    strategy: Strategy,
    scorer: &mut dyn Scorer,
) -> Answer {
    let answer = meant(identities, phrase, level, strategy, scorer);
    let answer = match answer {
        Answer::Found(hits) | Answer::Ambiguous(hits) if scorer.rejects(phrase, &hits[0]) => Answer::NotFound(hits),
        other => other,
    };
    answer.cut(TOP)
}

/// Answers by scores alone.
fn meant(
    identities: &Identities,
    phrase: &ParsedQuery,
    level: LevelFilter,
    strategy: Strategy,
    scorer: &mut dyn Scorer,
) -> Answer {
    let (text, whole) = (phrase.text.as_str(), phrase.whole.as_deref());
    match (strategy, whole, level) {
        (Strategy::WholeFirst, Some(whole), LevelFilter::Auto | LevelFilter::Part) => {
            piece_of(identities, &phrase.target, whole, scorer)
        }
        (Strategy::WholeFirst, ..) => once(identities, &phrase.target, level, scorer),
        (Strategy::OneStep, ..) | (_, _, LevelFilter::Object) => once(identities, text, level, scorer),
        (Strategy::TwoSteps, ..) => two_steps(identities, phrase, level, scorer),
        (Strategy::Joint, Some(whole), _) => jointly(identities, text, whole, scorer),
        (Strategy::Joint, None, LevelFilter::Part) => once(identities, text, level, scorer),
        (Strategy::Joint, None, LevelFilter::Auto) => {
            let ranked = ranked(identities, &scorer.scores(text, None), level);
            match winning_object(identities, &ranked).and_then(|object| implied(phrase, object, scorer)) {
                Some(whole) => part_or_object(identities, text, whole, ranked, scorer),
                None => judge(identities, ranked, scorer),
            }
        }
    }
}

/// Ranks all identities of a level once.
fn once(identities: &Identities, text: &str, level: LevelFilter, scorer: &mut dyn Scorer) -> Answer {
    let scores = scorer.scores(text, None);
    judge(identities, ranked(identities, &scores, level), scorer)
}

fn ranked(identities: &Identities, scores: &[f32], level: LevelFilter) -> Vec<Hit> {
    rank(identities.iter().filter(|(_, i)| level.accepts(i.level)).map(|(id, _)| id), scores)
}

fn winning_object(identities: &Identities, ranked: &[Hit]) -> Option<IdentityId> {
    let first = ranked.first()?.identity;
    identities.get(first).filter(|i| i.level == Level::Object).map(|_| first)
}

/// Follows the paper's steps: the whole query first; if an object wins, its parts compete, with the object's phrase
/// among the canonical ones.
fn two_steps(identities: &Identities, phrase: &ParsedQuery, level: LevelFilter, scorer: &mut dyn Scorer) -> Answer {
    let text = phrase.text.as_str();
    let step1 = scorer.scores(text, None);
    let hits = ranked(identities, &step1, LevelFilter::Auto);
    let Some(object) = winning_object(identities, &hits) else {
        return judge(identities, ranked(identities, &step1, level), scorer);
    };
    let whole = phrase.whole.as_deref().or_else(|| implied(phrase, object, scorer));
    match (whole, &phrase.whole, level) {
        // Without grammar, a query is about a piece only if the object's phrase alone describes the object as well.
        (None, _, LevelFilter::Auto | LevelFilter::Object) => return judge(identities, hits, scorer),
        (Some(whole), None, LevelFilter::Auto) => return part_or_object(identities, text, whole, hits, scorer),
        _ => {}
    }
    let pieces: Vec<IdentityId> =
        identities.iter().map(|(id, _)| id).filter(|id| identities.is_piece(*id, object)).collect();
    if hits[0].score < scorer.threshold() {
        return Answer::NotFound(hits);
    }
    if pieces.is_empty() {
        // If nothing is rejected, the identity most like the query is the answer.
        let never = scorer.threshold() <= 0.0;
        return if never { once(identities, text, level, scorer) } else { Answer::NotFound(hits) };
    }
    let against = scorer.scores(text, whole);
    // The object's phrase can push every part down; then the order of step 1 stands.
    let usable = pieces.iter().any(|id| against[*id as usize - 1] >= scorer.threshold());
    judge(identities, rank(pieces.into_iter(), if usable { &against } else { &step1 }), scorer)
}

/// Returns the phrase of the whole in a query without grammar: all but its last word ("bear nose"), if that describes
/// the object at least as well as the entire query.
fn implied<'a>(phrase: &'a ParsedQuery, object: IdentityId, scorer: &mut dyn Scorer) -> Option<&'a str> {
    let whole = phrase.implied_whole()?;
    let by = |text: &str, scorer: &mut dyn Scorer| scorer.scores(text, None)[object as usize - 1];
    let (by_whole, by_all) = (by(whole, scorer), by(&phrase.text, scorer));
    (by_whole >= by_all && by_whole > 0.0).then_some(whole)
}

/// Returns the part of the winning object that is more like the query than like the object's phrase, if there is one,
/// else the object.
fn part_or_object(identities: &Identities, text: &str, whole: &str, hits: Vec<Hit>, scorer: &mut dyn Scorer) -> Answer {
    let object = hits[0];
    let against = scorer.scores(text, Some(whole));
    let pieces = identities.iter().map(|(id, _)| id).filter(|id| identities.is_piece(*id, object.identity));
    let parts = rank(pieces, &against);
    let more = |part: &Hit| part.score > against[object.identity as usize - 1].max(0.5);
    match parts.first().is_some_and(more) && object.score >= scorer.threshold() {
        true => judge(identities, parts, scorer),
        false => judge(identities, hits, scorer),
    }
}

/// Ranks parts by both phrases at once: by the mean of both scores on the logistic scale, on which they are
/// differences of similarity.
fn jointly(identities: &Identities, text: &str, whole: &str, scorer: &mut dyn Scorer) -> Answer {
    let (by_text, by_whole) = (scorer.scores(text, None), scorer.scores(whole, None));
    let logit = |s: f32| {
        let s = s.clamp(1e-6, 1.0 - 1e-6);
        (s / (1.0 - s)).ln()
    };
    let both: Vec<f32> = identities
        .iter()
        .map(|(id, _)| {
            // The enclosing identity that fits the whole best; parts may have parts.
            let around = identities.ancestors(id).skip(1).map(|i| by_whole[i as usize - 1]).fold(0.0, f32::max);
            1.0 / (1.0 + (-0.5 * (logit(by_text[id as usize - 1]) + logit(around))).exp())
        })
        .collect();
    let pieces = identities.iter().filter(|(id, _)| identities.ancestors(*id).nth(1).is_some()).map(|(id, _)| id);
    judge(identities, rank(pieces, &both), scorer)
}

/// Finds the whole in step 1; in step 2 only its pieces compete.
fn piece_of(identities: &Identities, piece: &str, whole: &str, scorer: &mut dyn Scorer) -> Answer {
    let step1 = scorer.scores(whole, None);
    // Wholes may be parts themselves: "the pupil of the eye".
    let with_pieces = identities.iter().map(|(id, _)| id).filter(|id| identities.children(*id).next().is_some());
    let wholes = rank(with_pieces, &step1);
    let Some(best) = wholes.first().filter(|w| w.score >= scorer.threshold()) else {
        return Answer::NotFound(wholes);
    };
    // Wholes that cannot be told apart all take part.
    let close: Vec<IdentityId> =
        wholes.iter().filter(|w| w.score > best.score - scorer.resolution()).map(|w| w.identity).collect();
    let mine = |id: IdentityId| close.iter().any(|whole| identities.is_piece(id, *whole));
    let pieces: Vec<IdentityId> = identities.iter().map(|(id, _)| id).filter(|id| mine(*id)).collect();
    let plain = scorer.scores(piece, None);
    let against = scorer.scores(piece, Some(whole));
    // The whole's phrase can push every piece down; then the first order stands.
    let usable = pieces.iter().any(|id| against[*id as usize - 1] >= scorer.threshold());
    let hits = rank(pieces.into_iter(), if usable { &against } else { &plain });
    judge(identities, hits, scorer)
}

/// Ranks candidates by falling score; equal ones by number. NaN scores are left out.
fn rank(candidates: impl Iterator<Item = IdentityId>, scores: &[f32]) -> Vec<Hit> {
    let hit = |id: IdentityId| Hit { identity: id, score: scores[id as usize - 1], margin: 0.0 };
    let mut hits: Vec<Hit> = candidates.map(hit).filter(|h| !h.score.is_nan()).collect();
    hits.sort_by(|a, b| b.score.total_cmp(&a.score).then(a.identity.cmp(&b.identity)));
    with_margins(hits)
}

fn with_margins(mut hits: Vec<Hit>) -> Vec<Hit> {
    for i in 0..hits.len() {
        hits[i].margin = hits[i].score - hits.get(i + 1).map_or(0.0, |next| next.score);
    }
    hits
}

/// Decides whether the first hit is the answer, nothing is, or others are equally good.
fn judge(identities: &Identities, hits: Vec<Hit>, scorer: &dyn Scorer) -> Answer {
    let Some(first) = hits.first().filter(|h| h.score > 0.0 && h.score >= scorer.threshold()) else {
        return Answer::NotFound(hits);
    };
    // A piece and its whole with the same name are not two things.
    let rival = hits.iter().take(TOP).skip(1).find(|h| !identities.are_related(h.identity, first.identity));
    match rival {
        Some(rival) if first.score - rival.score < scorer.resolution() => Answer::Ambiguous(hits),
        _ => Answer::Found(hits),
    }
}

#[cfg(test)]
mod tests;
