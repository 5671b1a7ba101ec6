//! Localization by scores from tables.

use super::*;
use crate::scene::NO_IDENTITY;

fn scene() -> Identities {
    let mut all = Identities::default();
    for color in ["red", "blue"] {
        let controller = all.add(Level::Object, NO_IDENTITY, vec![format!("{color} controller")]);
        for part in ["button a", "left stick"] {
            all.add(Level::Part, controller, vec![part.into()]);
        }
    }
    all.add(Level::Object, NO_IDENTITY, vec!["lamp".into()]);
    all
}

/// Scores from a table: (phrase, against) -> score per identity.
struct Table(Strategy, Vec<(&'static str, Option<&'static str>, Vec<f32>)>);

impl Scorer for Table {
    fn scores(&mut self, phrase: &str, against: Option<&str>) -> Vec<f32> {
        let row = self.1.iter().find(|r| (r.0, r.1) == (phrase, against));
        row.unwrap_or_else(|| panic!("{phrase:?} {against:?}")).2.clone()
    }

    fn threshold(&self) -> f32 {
        0.5
    }

    fn resolution(&self) -> f32 {
        0.001
    }
}

fn by_table(all: &Identities, phrase: &ParsedQuery, level: LevelFilter, mut table: Table) -> Answer {
    localize(all, phrase, level, table.0, &mut table)
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
    let ask = |t: Table| by_table(&all, &phrase, LevelFilter::Auto, t);
    assert_eq!(ask(table(Strategy::OneStep, step1.clone(), step2.clone())).hits()[0].identity, 1);
    assert_eq!(ask(table(Strategy::TwoSteps, step1.clone(), step2)).hits()[0].identity, 2);
    // Pushed below the threshold, all of them: the order of step 1 stands.
    let low = vec![0.1; 7];
    assert_eq!(ask(table(Strategy::TwoSteps, step1.clone(), low)).hits()[0].identity, 3);
    // A part that wins at once is the answer.
    let part_wins = vec![0.5, 0.6, 0.7, 0.5, 0.95, 0.5, 0.1];
    assert_eq!(ask(table(Strategy::TwoSteps, part_wins, step1)).hits()[0].identity, 5);
    let nothing = vec![0.4; 7];
    assert!(matches!(ask(table(Strategy::TwoSteps, nothing.clone(), nothing)), Answer::NotFound(_)));
}

#[test]
fn both_phrases_together_survive_a_slip_of_either() {
    let all = scene();
    let phrase = ParsedQuery::parse("a button of the red controller").expect("a phrase");
    let text = "button of the red controller";
    // Identities: 1 red (2 button, 3 stick), 4 blue (5, 6), 7 lamp.
    let ask = |by_text: [f32; 7], by_whole: [f32; 7]| {
        let rows = vec![(text, None, by_text.to_vec()), ("red controller", None, by_whole.to_vec())];
        by_table(&all, &phrase, LevelFilter::Auto, Table(Strategy::Joint, rows))
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
        by_table(&all, &phrase, LevelFilter::Auto, Table(Strategy::TwoSteps, rows))
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
        by_table(&all, &phrase, LevelFilter::Auto, Table(Strategy::WholeFirst, rows))
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
        let table = Table(Strategy::OneStep, vec![("thing", None, scores.to_vec())]);
        by_table(&all, &phrase, LevelFilter::Auto, table)
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

#[test]
fn a_compound_and_a_forced_kind_reach_the_second_step_without_grammar() {
    let all = scene();
    let text = "controller button";
    let ask = |level, strategy, step1: [f32; 7], whole: [f32; 7], step2: [f32; 7]| {
        let phrase = ParsedQuery::parse(text).expect("a phrase");
        assert_eq!((phrase.whole.as_ref(), phrase.implied_whole()), (None, Some("controller")));
        let rows = vec![
            (text, None, step1.to_vec()),
            ("controller", None, whole.to_vec()),
            (text, Some("controller"), step2.to_vec()),
        ];
        let answer = by_table(&all, &phrase, level, Table(strategy, rows));
        (answer.verdict(), answer.hits()[0].identity)
    };
    // Identities: 1 red (2 button, 3 stick), 4 blue (5, 6), 7 lamp. The red controller wins.
    let step1 = [0.9, 0.6, 0.7, 0.8, 0.55, 0.5, 0.1];
    let step2 = [0.3, 0.65, 0.6, 0.2, 0.9, 0.5, 0.1];
    let (fits, worse) = ([0.95, 0.1, 0.1, 0.9, 0.1, 0.1, 0.1], [0.4, 0.1, 0.1, 0.3, 0.1, 0.1, 0.1]);
    for strategy in [Strategy::TwoSteps, Strategy::Joint] {
        // Its own phrase describes it better: its parts compete, without those of others.
        assert_eq!(ask(LevelFilter::Auto, strategy, step1, fits, step2), ("found", 2), "{strategy}");
        // No part is more like the question than like the controller, or "controller" describes it worse: it stays.
        assert_eq!(ask(LevelFilter::Auto, strategy, step1, fits, [0.4; 7]), ("found", 1), "{strategy}");
        assert_eq!(ask(LevelFilter::Auto, strategy, step1, worse, step2), ("found", 1), "{strategy}");
        assert_eq!(ask(LevelFilter::Object, strategy, step1, fits, step2), ("found", 1), "{strategy}");
    }
    assert_eq!(ask(LevelFilter::Auto, Strategy::OneStep, step1, fits, step2), ("found", 1));
    assert_eq!(ask(LevelFilter::Part, Strategy::TwoSteps, step1, fits, step2), ("found", 2));
    // A level of parts: without a phrase for the whole, its parts compete by the query alone.
    let phrase = ParsedQuery::parse("button").expect("a phrase");
    let rows = vec![("button", None, step1.to_vec())];
    let answer = by_table(&all, &phrase, LevelFilter::Part, Table(Strategy::TwoSteps, rows.clone()));
    assert_eq!(answer.hits().iter().map(|h| h.identity).collect::<Vec<_>>(), [3, 2]);
    // The control: in one step, parts of everything do.
    let answer = by_table(&all, &phrase, LevelFilter::Part, Table(Strategy::OneStep, rows));
    assert_eq!(answer.hits().iter().map(|h| h.identity).collect::<Vec<_>>(), [3, 2, 5, 6]);
}
