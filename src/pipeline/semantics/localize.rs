//! Multilevel localization: from scores of phrases to the identities meant, with "not found" and
//! "ambiguous" among the answers.

use super::parse::ParsedQuery;
use crate::scene::{Identities, IdentityId, Level, LevelFilter};

/// Answers that are given at most.
const TOP: usize = 8;

/// How a piece of a whole is looked for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Strategy {
    /// The whole by its own phrase, then its pieces by theirs. For scores that treat words one by
    /// one, such as names.
    #[default]
    WholeFirst,
    /// The paper's two steps: the whole query first; only if an object wins, its parts compete, with
    /// the object's phrase among the canonical ones.
    Paper,
    /// The whole query once, whatever wins.
    OneStep,
    /// Every part by the whole query and its object by the whole's phrase at once: neither alone
    /// decides, so one slip in the first step does not lose the part.
    Joint,
}

/// Scores identities for phrases, by number less one; higher is better.
pub trait Scorer {
    /// Scores of all identities for a phrase. Where `against` is given, it is the phrase of the
    /// whole, which then counts as another thing that a piece must be more than (the paper's
    /// second step).
    fn scores(&mut self, phrase: &str, against: Option<&str>) -> Vec<f32>;

    /// How this scorer finds pieces of wholes best.
    fn strategy(&self) -> Strategy {
        Strategy::WholeFirst
    }

    /// Score under which an identity is not what was asked for.
    fn threshold(&self) -> f32;

    /// Difference of scores under which two identities cannot be told apart.
    fn resolution(&self) -> f32;
}

/// An identity that may be meant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Which.
    pub identity: IdentityId,
    /// Its score.
    pub score: f32,
    /// How much more than the runner-up.
    pub(crate) margin: f32,
}

/// What a query comes to.
#[derive(Clone, Debug, PartialEq)]
pub enum Answer {
    /// The first is meant; runners-up follow.
    Found(Vec<Hit>),
    /// The first two or more could be meant.
    Ambiguous(Vec<Hit>),
    /// Nothing fits; what fits best follows.
    NotFound(Vec<Hit>),
}

impl Answer {
    /// All candidates, best first.
    pub fn hits(&self) -> &[Hit] {
        match self {
            Self::Found(hits) | Self::Ambiguous(hits) | Self::NotFound(hits) => hits,
        }
    }

    /// In a word or two: "found", "ambiguous" or "not found".
    pub(crate) fn verdict(&self) -> &'static str {
        match self {
            Self::Found(_) => "found",
            Self::Ambiguous(_) => "ambiguous",
            Self::NotFound(_) => "not found",
        }
    }
}

/// Finds what `phrase` means among the identities.
pub fn localize(identities: &Identities, phrase: &ParsedQuery, level: LevelFilter, scorer: &mut dyn Scorer) -> Answer {
    match (&phrase.whole, level, scorer.strategy()) {
        (Some(whole), LevelFilter::Auto | LevelFilter::Part, Strategy::WholeFirst) => {
            piece_of(identities, &phrase.target, whole, scorer)
        }
        (Some(whole), LevelFilter::Auto | LevelFilter::Part, Strategy::Paper) => {
            two_steps(identities, &phrase.text, whole, scorer)
        }
        (Some(whole), LevelFilter::Auto | LevelFilter::Part, Strategy::Joint) => {
            jointly(identities, &phrase.text, whole, scorer)
        }
        (_, _, strategy) => {
            let text = if strategy == Strategy::WholeFirst { &phrase.target } else { &phrase.text };
            let scores = scorer.scores(text, None);
            let wanted = |own: Level| match level {
                LevelFilter::Auto => true,
                LevelFilter::Object => own == Level::Object,
                LevelFilter::Part => own == Level::Part,
            };
            let all = identities.iter().filter(|(_, i)| wanted(i.level)).map(|(id, _)| id);
            judge(identities, rank(all, &scores), scorer)
        }
    }
}

/// The paper's steps for a query that is about a piece.
fn two_steps(identities: &Identities, text: &str, whole: &str, scorer: &mut dyn Scorer) -> Answer {
    let step1 = scorer.scores(text, None);
    let ranked = rank(identities.iter().map(|(id, _)| id), &step1);
    let preliminary = ranked.first().map(|h| h.identity);
    let object = preliminary.filter(|id| identities.get(*id).is_some_and(|i| i.level == Level::Object));
    let Some(object) = object else { return judge(identities, ranked, scorer) };
    if ranked[0].score < scorer.threshold() {
        return Answer::NotFound(ranked);
    }
    let pieces: Vec<IdentityId> =
        identities.iter().map(|(id, _)| id).filter(|id| is_piece(identities, *id, object)).collect();
    if pieces.is_empty() {
        return Answer::NotFound(ranked);
    }
    let against = scorer.scores(text, Some(whole));
    // The object's phrase can push every part down; then the order of step 1 stands.
    let usable = pieces.iter().any(|id| against[*id as usize - 1] >= scorer.threshold());
    judge(identities, rank(pieces.into_iter(), if usable { &against } else { &step1 }), scorer)
}

/// Parts by both phrases at once: the mean of both scores on the logistic scale, on which they are
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
            // The nearest thing around it that fits the whole best; parts may have parts.
            let around = identities.ancestors(id).skip(1).map(|i| by_whole[i as usize - 1]).fold(0.0, f32::max);
            1.0 / (1.0 + (-0.5 * (logit(by_text[id as usize - 1]) + logit(around))).exp())
        })
        .collect();
    let pieces = identities.iter().filter(|(id, _)| identities.ancestors(*id).nth(1).is_some()).map(|(id, _)| id);
    judge(identities, rank(pieces, &both), scorer)
}

/// Whether `id` is a piece of `whole`, directly or not.
fn is_piece(identities: &Identities, id: IdentityId, whole: IdentityId) -> bool {
    identities.ancestors(id).skip(1).any(|i| i == whole)
}

/// Step 1 finds the whole; in step 2 only its pieces compete.
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
    let mine = |id: IdentityId| close.iter().any(|whole| is_piece(identities, id, *whole));
    let pieces: Vec<IdentityId> = identities.iter().map(|(id, _)| id).filter(|id| mine(*id)).collect();
    let plain = scorer.scores(piece, None);
    let against = scorer.scores(piece, Some(whole));
    // The whole's phrase can push every piece down; then the first order stands.
    let usable = pieces.iter().any(|id| against[*id as usize - 1] >= scorer.threshold());
    let hits = rank(pieces.into_iter(), if usable { &against } else { &plain });
    judge(identities, hits, scorer)
}

/// Candidates by falling score; equal ones by number. A score that is no number is none.
fn rank(candidates: impl Iterator<Item = IdentityId>, scores: &[f32]) -> Vec<Hit> {
    let hit = |id: IdentityId| Hit { identity: id, score: scores[id as usize - 1], margin: 0.0 };
    let mut hits: Vec<Hit> = candidates.map(hit).filter(|h| !h.score.is_nan()).collect();
    hits.sort_by(|a, b| b.score.total_cmp(&a.score).then(a.identity.cmp(&b.identity)));
    for i in 0..hits.len() {
        hits[i].margin = hits[i].score - hits.get(i + 1).map_or(0.0, |next| next.score);
    }
    hits.truncate(TOP);
    hits
}

fn judge(identities: &Identities, hits: Vec<Hit>, scorer: &dyn Scorer) -> Answer {
    let Some(first) = hits.first().filter(|h| h.score > 0.0 && h.score >= scorer.threshold()) else {
        return Answer::NotFound(hits);
    };
    // A piece and its whole with the same name are not two things.
    let related = |id: IdentityId| {
        identities.ancestors(id).any(|i| i == first.identity) || identities.ancestors(first.identity).any(|i| i == id)
    };
    let rival = hits.iter().skip(1).find(|h| !related(h.identity));
    match rival {
        Some(rival) if first.score - rival.score < scorer.resolution() => Answer::Ambiguous(hits),
        _ => Answer::Found(hits),
    }
}

#[cfg(test)]
mod tests {
    use super::super::names::ByName;
    use super::*;
    use crate::scene::NOBODY;

    fn scene() -> Identities {
        let mut all = Identities::default();
        for color in ["red", "blue"] {
            let controller = all.add(Level::Object, NOBODY, vec![format!("{color} controller")]);
            for part in ["button a", "left stick"] {
                all.add(Level::Part, controller, vec![part.into()]);
            }
        }
        all.add(Level::Object, NOBODY, vec!["lamp".into()]);
        all
    }

    fn ask(query: &str, level: LevelFilter) -> (Answer, Vec<String>) {
        let all = scene();
        let phrase = ParsedQuery::parse(query).expect("a phrase");
        let answer = localize(&all, &phrase, level, &mut ByName(&all));
        let names = answer.hits().iter().map(|h| {
            let line: Vec<String> = all.ancestors(h.identity).map(|i| all.name(i)).collect();
            line.join(" < ")
        });
        let names = names.collect();
        (answer, names)
    }

    #[test]
    fn the_whole_decides_between_pieces_of_the_same_name() {
        for color in ["red", "blue"] {
            let (answer, names) = ask(&format!("a button of the {color} controller"), LevelFilter::Auto);
            assert!(matches!(answer, Answer::Found(_)), "{answer:?}");
            assert_eq!(names[0], format!("button a < {color} controller"));
        }
        let (answer, names) = ask("button a", LevelFilter::Auto);
        assert!(matches!(answer, Answer::Ambiguous(_)), "{answer:?}");
        assert_eq!(names[..2], ["button a < red controller", "button a < blue controller"]);
    }

    #[test]
    fn a_kind_can_be_forced() {
        assert_eq!(ask("red controller", LevelFilter::Auto).1[0], "red controller");
        assert!(matches!(ask("red controller", LevelFilter::Part).0, Answer::NotFound(_)));
        assert_eq!(ask("left stick of the blue controller", LevelFilter::Object).0.hits().len(), 3);
    }

    #[test]
    fn what_is_not_there_is_not_found() {
        for absent in ["giraffe", "wing of the giraffe", "antenna of the red controller", "shade of the lamp"] {
            assert!(matches!(ask(absent, LevelFilter::Auto).0, Answer::NotFound(_)), "{absent}");
        }
        let all = Identities::default();
        let phrase = ParsedQuery::parse("lamp").expect("a phrase");
        assert_eq!(localize(&all, &phrase, LevelFilter::Auto, &mut ByName(&all)), Answer::NotFound(vec![]));
    }

    /// Scores from a table: (phrase, against) -> score per identity.
    struct Table(Strategy, Vec<(&'static str, Option<&'static str>, Vec<f32>)>);

    impl Scorer for Table {
        fn scores(&mut self, phrase: &str, against: Option<&str>) -> Vec<f32> {
            let row = self.1.iter().find(|r| (r.0, r.1) == (phrase, against));
            row.unwrap_or_else(|| panic!("{phrase:?} {against:?}")).2.clone()
        }

        fn strategy(&self) -> Strategy {
            self.0
        }

        fn threshold(&self) -> f32 {
            0.5
        }

        fn resolution(&self) -> f32 {
            0.001
        }
    }

    #[test]
    fn the_papers_second_step_looks_inside_the_winning_object() {
        let all = scene();
        let phrase = ParsedQuery::parse("a button of the red controller").expect("a phrase");
        let text = "button of the red controller";
        // Identities: 1 red (2 button, 3 stick), 4 blue (5, 6), 7 lamp.
        let step1 = vec![0.9, 0.6, 0.7, 0.8, 0.55, 0.5, 0.1];
        let step2 = vec![0.2, 0.65, 0.6, 0.2, 0.7, 0.5, 0.1];
        let table = |strategy, step1: Vec<f32>, step2: Vec<f32>| {
            Table(strategy, vec![(text, None, step1), (text, Some("red controller"), step2)])
        };
        let ask = |mut t: Table| localize(&all, &phrase, LevelFilter::Auto, &mut t);
        assert_eq!(ask(table(Strategy::OneStep, step1.clone(), step2.clone())).hits()[0].identity, 1);
        assert_eq!(ask(table(Strategy::Paper, step1.clone(), step2)).hits()[0].identity, 2);
        // Pushed below the threshold, all of them: the order of step 1 stands.
        let low = vec![0.1; 7];
        assert_eq!(ask(table(Strategy::Paper, step1.clone(), low)).hits()[0].identity, 3);
        // A part that wins at once is the answer.
        let part_wins = vec![0.5, 0.6, 0.7, 0.5, 0.95, 0.5, 0.1];
        assert_eq!(ask(table(Strategy::Paper, part_wins, step1)).hits()[0].identity, 5);
        let nothing = vec![0.4; 7];
        assert!(matches!(ask(table(Strategy::Paper, nothing.clone(), nothing)), Answer::NotFound(_)));
    }

    #[test]
    fn both_phrases_together_survive_a_slip_of_either() {
        let all = scene();
        let phrase = ParsedQuery::parse("a button of the red controller").expect("a phrase");
        let text = "button of the red controller";
        // Identities: 1 red (2 button, 3 stick), 4 blue (5, 6), 7 lamp.
        let ask = |by_text: [f32; 7], by_whole: [f32; 7]| {
            let rows = vec![(text, None, by_text.to_vec()), ("red controller", None, by_whole.to_vec())];
            localize(&all, &phrase, LevelFilter::Auto, &mut Table(Strategy::Joint, rows))
        };
        // The blue button is a little more like a button; the red controller is clearly the red one.
        let answer = ask([0.9, 0.6, 0.4, 0.8, 0.63, 0.4, 0.1], [0.9, 0.1, 0.1, 0.4, 0.1, 0.1, 0.1]);
        assert!(matches!(&answer, Answer::Found(hits) if hits[0].identity == 2), "{answer:?}");
        // The blue controller is a little redder; the red button is clearly the one.
        let answer = ask([0.5, 0.8, 0.4, 0.5, 0.4, 0.4, 0.1], [0.6, 0.1, 0.1, 0.65, 0.1, 0.1, 0.1]);
        assert!(matches!(&answer, Answer::Found(hits) if hits[0].identity == 2), "{answer:?}");
        assert!(matches!(ask([0.4; 7], [0.4; 7]), Answer::NotFound(_)));
    }

    #[test]
    fn one_usable_piece_is_enough_and_the_threshold_itself_counts() {
        let all = scene();
        let phrase = ParsedQuery::parse("a button of the red controller").expect("a phrase");
        let text = "button of the red controller";
        // Identities: 1 red (2 button, 3 stick), 4 blue (5, 6), 7 lamp.
        let paper = |step1: [f32; 7], step2: [f32; 7]| {
            let rows = vec![(text, None, step1.to_vec()), (text, Some("red controller"), step2.to_vec())];
            localize(&all, &phrase, LevelFilter::Auto, &mut Table(Strategy::Paper, rows))
        };
        // The object wins with just the threshold; of its pieces only the first reaches it.
        let answer = paper([0.5, 0.3, 0.4, 0.2, 0.1, 0.1, 0.1], [0.9, 0.5, 0.4, 0.9, 0.9, 0.9, 0.9]);
        assert_eq!((answer.verdict(), answer.hits()[0].identity, answer.hits().len()), ("found", 2, 2));
        assert!((answer.hits()[0].margin - 0.1).abs() < 1e-6 && answer.hits()[1].margin == 0.4);
        // None reaches it: the order of step 1, in which none does either.
        let answer = paper([0.5, 0.3, 0.4, 0.2, 0.1, 0.1, 0.1], [0.9, 0.49, 0.4, 0.9, 0.9, 0.9, 0.9]);
        assert_eq!((answer.verdict(), answer.hits()[0].identity), ("not found", 3));
        // An object without parts has no piece.
        assert_eq!(paper([0.1, 0.1, 0.1, 0.1, 0.1, 0.1, 0.9], [0.9; 7]).verdict(), "not found");
    }

    #[test]
    fn the_whole_by_its_phrase_then_its_pieces_by_theirs() {
        let all = scene();
        let phrase = ParsedQuery::parse("a button of the red controller").expect("a phrase");
        let first = |whole: [f32; 7], plain: [f32; 7], against: [f32; 7]| {
            let rows = vec![
                ("red controller", None, whole.to_vec()),
                ("button", None, plain.to_vec()),
                ("button", Some("red controller"), against.to_vec()),
            ];
            localize(&all, &phrase, LevelFilter::Auto, &mut Table(Strategy::WholeFirst, rows))
        };
        let pieces = |answer: &Answer| answer.hits().iter().map(|h| h.identity).collect::<Vec<_>>();
        let whole = [0.9, 0.1, 0.1, 0.8, 0.1, 0.1, 0.95];
        // The lamp fits best but has no pieces; the red one's compete, by the second step.
        let answer = first(whole, [0.1, 0.6, 0.9, 0.1, 0.9, 0.9, 0.1], [0.1, 0.7, 0.5, 0.1, 0.9, 0.9, 0.1]);
        assert_eq!((pieces(&answer), answer.verdict()), (vec![2, 3], "found"));
        // Pushed below the threshold, all of them: the first order.
        let answer = first(whole, [0.1, 0.6, 0.9, 0.1, 0.9, 0.9, 0.1], [0.1, 0.4, 0.3, 0.1, 0.9, 0.9, 0.1]);
        assert_eq!(pieces(&answer), [3, 2]);
        // Wholes that cannot be told apart both take part; those just told apart do not.
        let alike = [0.9, 0.1, 0.1, 0.8995, 0.1, 0.1, 0.1];
        let scores = [0.1, 0.6, 0.5, 0.1, 0.7, 0.5, 0.1];
        assert_eq!(pieces(&first(alike, scores, scores)), [5, 2, 3, 6]);
        let apart = [0.9, 0.1, 0.1, 0.899, 0.1, 0.1, 0.1];
        assert_eq!(pieces(&first(apart, scores, scores)), [2, 3]);
        let low = [0.4; 7];
        assert_eq!(first(low, scores, scores).verdict(), "not found");
    }

    #[test]
    fn two_that_are_nearly_alike_are_ambiguous_unless_one_is_in_the_other() {
        let all = scene();
        let phrase = ParsedQuery::parse("thing").expect("a phrase");
        let ask = |scores: [f32; 7]| {
            let mut table = Table(Strategy::OneStep, vec![("thing", None, scores.to_vec())]);
            localize(&all, &phrase, LevelFilter::Auto, &mut table)
        };
        assert_eq!(ask([0.9, 0.1, 0.1, 0.8995, 0.1, 0.1, 0.1]).verdict(), "ambiguous");
        assert_eq!(ask([0.9, 0.1, 0.1, 0.898, 0.1, 0.1, 0.1]).verdict(), "found");
        assert_eq!(ask([0.9, 0.8995, 0.1, 0.1, 0.1, 0.1, 0.1]).verdict(), "found", "a piece of it");
        assert_eq!(ask([0.8995, 0.9, 0.1, 0.1, 0.1, 0.1, 0.1]).verdict(), "found", "its whole");
        let answer = ask([f32::NAN, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6]);
        let order: Vec<_> = answer.hits().iter().map(|h| h.identity).collect();
        assert_eq!(order, [7, 6, 5, 4, 3, 2], "what is no number is none");
        assert!(answer.hits().iter().take(5).all(|h| (h.margin - 0.1).abs() < 1e-6), "{answer:?}");
    }
}
