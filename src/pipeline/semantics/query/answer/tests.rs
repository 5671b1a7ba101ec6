//! Answers by names, by embedding, and by both.

use super::super::localize::Hit;
use super::*;
use crate::pipeline::semantics::query::recipe::Rejection;
use crate::scene::{Level, NO_IDENTITY, ViewFeatures};

fn scene() -> (Identities, LanguageFeatures) {
    let mut all = Identities::default();
    let lamp = all.add(Level::Object, NO_IDENTITY, vec!["lamp".into()]);
    all.add(Level::Part, lamp, vec!["shade".into()]);
    let mug = all.add(Level::Object, NO_IDENTITY, vec!["mug".into()]);
    all.get_mut(lamp).expect("there").code = [0.1, 0.5, 0.5];
    all.get_mut(mug).expect("there").code = [0.9, 0.5, 0.5];
    let f = |v: [f32; 3]| ViewFeatures { raw: vec![v.to_vec()], deviated: vec![v.to_vec()] };
    let of = vec![f([0.0, 1.0, 0.0]), f([0.0, 0.8, 0.6]), f([1.0, 0.0, 0.0])];
    (all, LanguageFeatures { encoder: "test".into(), dimension: 3, by_identity: of })
}

fn read(all: &Identities, text: &str, recipe: &QueryConfig) -> QueryReading {
    QueryReading::new(all, text, recipe).expect("a phrase")
}

fn ask(text: &str, with_meaning: bool) -> QueryAnswer {
    ask_by(text, &QueryConfig::default(), with_meaning)
}

fn ask_by(text: &str, recipe: &QueryConfig, with_meaning: bool) -> QueryAnswer {
    ask_of(scene(), text, recipe, with_meaning)
}

fn ask_of(
    (all, features): (Identities, LanguageFeatures),
    text: &str,
    recipe: &QueryConfig,
    with_meaning: bool,
) -> QueryAnswer {
    let phrase = ParsedQuery::parse(text).expect("a phrase");
    let mut phrases = TextEmbeddings::default();
    let mut encode = |p: &str| {
        Ok::<_, ()>(match p {
            "beaker" => vec![1.0, 0.0, 0.0],
            "giraffe" => vec![0.0, 0.0, -1.0],
            _ => vec![0.5, 0.5, 0.5],
        })
    };
    phrases.learn(&phrase, recipe, &mut encode).expect("encodes");
    let language = Language { features: &features, phrases: &phrases, unknown: &[] };
    answer(
        &all,
        &read(&all, text, recipe),
        (LevelFilter::Auto, &QueryPlace::default()),
        recipe,
        with_meaning.then_some(language),
    )
}

#[test]
fn names_come_first_and_meaning_where_they_fail() {
    let a = ask("the lamp's shade", true);
    assert_eq!((a.basis, a.chosen(1)), (Basis::Names, vec![2]));
    assert!(a.relevancy[2] > a.relevancy[1] && a.relevancy[3] == 0.0);
    let a = ask("a shade on the lamp", true);
    assert_eq!((a.basis, a.chosen(1)), (Basis::Names, vec![2]), "words between names are nothing unknown");
    let a = ask("beaker", true);
    assert_eq!((a.basis, a.chosen(1)), (Basis::Embedding, vec![3]));
    assert!(a.relevancy[3] > 0.9 && a.relevancy[1] < 0.5);
    assert!(ask("beaker", false).chosen(1).is_empty());
    assert!(ask("giraffe", true).chosen(3).is_empty());
    let stages = a.stages;
    assert!(stages.relevancy >= 0.0 && stages.localize >= 0.0, "{stages:?}");
    assert_eq!(stages.whole(), stages.relevancy + stages.localize, "nothing else happens here");
    let a = ask("lamp", true);
    assert_eq!(a.chosen(2), [1], "only what fits");
    let map = ViewMap::certain(3, vec![1, 2, 3]);
    let (all, _) = scene();
    assert_eq!(a.mask(&map, None, &all, 1).area(), 2, "a piece belongs to its whole");
    assert_eq!(a.heat(&map)[2], 0.0);
}

#[test]
fn an_encoder_of_photos_answers_what_names_do_not_know() {
    let (all, features) = scene();
    let ask = |text: &str, to: [f32; 3]| {
        let phrase = ParsedQuery::parse(text).expect("a phrase");
        let mut phrases = TextEmbeddings::default();
        let mut encode = |p: &str| Ok::<_, ()>(if p == text { to.to_vec() } else { vec![0.5, 0.5, 0.5] });
        let recipe = QueryConfig::default();
        phrases.learn(&phrase, &recipe, &mut encode).expect("encodes");
        let language = Language { features: &features, phrases: &phrases, unknown: &[] };
        answer(&all, &read(&all, text, &recipe), (LevelFilter::Auto, &QueryPlace::default()), &recipe, Some(language))
    };
    let a = ask("beige lamp", [1.0, 0.0, 0.0]);
    assert_eq!((a.basis, a.chosen(1)), (Basis::Embedding, vec![3]), "by name it would be the lamp");
    let a = ask("beige lamp", [0.0, 0.0, -1.0]);
    assert_eq!((a.basis, a.chosen(1)), (Basis::Names, vec![]), "a word is left over");
    assert_eq!(a.offers(3), [vec![1], vec![]]);
    let a = ask("mug", [0.0, 1.0, 0.0]);
    assert_eq!((a.basis, a.chosen(1)), (Basis::Names, vec![3]), "a known name is not asked of the encoder");
    assert_eq!((a.threshold(), ask("beaker", [1.0, 0.0, 0.0]).threshold()), (names::THRESHOLD, 0.5));
}

#[test]
fn the_small_encoder_answers_only_where_nothing_has_a_name() {
    let ask = |encoder: &str, has_names: bool, text: &str| {
        let (mut all, mut features) = scene();
        features.encoder = encoder.into();
        if !has_names {
            all = Identities::objects(3);
        }
        ask_of((all, features), text, &QueryConfig::default(), true)
    };
    let small = ask("demo", true, "beaker");
    assert_eq!((small.basis, small.chosen(8), small.offers(3)), (Basis::Names, vec![], [vec![], vec![3]]));
    assert_eq!(small.relevancy, [0.0; 4], "nothing is shown of a guess");
    let nameless = ask("demo", false, "beaker");
    assert_eq!((nameless.basis, nameless.chosen(1)), (Basis::Embedding, vec![3]));
    assert_eq!(nameless.certainty(&[]), Certainty::Guess, "it is sure of nothing");
    // Controls: an encoder of photos answers, and names that know the words come first to both.
    let photos = ask("clip-vit-b16", true, "beaker");
    assert_eq!((photos.basis, photos.chosen(1), photos.certainty(&[])), (Basis::Embedding, vec![3], Certainty::Likely));
    // A place has no looks, whatever the encoder makes of it; the look-alike is an offer.
    let placed = ask("clip-vit-b16", true, "beaker behind the lamp");
    assert!(placed.chosen(1).is_empty(), "{placed:?}");
    for encoder in ["demo", "clip-vit-b16", "/models/demo_vocab.json"] {
        assert_eq!(ask(encoder, true, "shade of the lamp").chosen(1), [2], "{encoder}");
    }
    assert!(ask("/models/demo_vocab.json", true, "beaker").chosen(1).is_empty(), "another of its make");
}

#[test]
fn words_that_an_encoder_leaves_out_and_colors_that_are_not_so_find_nothing() {
    let ask = |text: &str, unknown: &[String]| {
        let (_, features) = scene();
        let all = Identities::objects(3);
        let mut phrases = TextEmbeddings::default();
        // The encoder is asked for the query as it was read: without courtesy.
        let reading = read(&all, text, &QueryConfig::default());
        let is_asked = |p: &str| p == reading.phrase.text;
        let mut encode = |p: &str| Ok::<_, ()>(if is_asked(p) { vec![1.0, 0.0, 0.0] } else { vec![0.5, 0.5, 0.5] });
        phrases.learn(&reading.phrase, &QueryConfig::default(), &mut encode).expect("encodes");
        let language = Language { features: &features, phrases: &phrases, unknown };
        answer(&all, &reading, (LevelFilter::Auto, &QueryPlace::default()), &QueryConfig::default(), Some(language))
    };
    assert_eq!(ask("steering wheel", &[]).chosen(1), [3]);
    let left_out = ask("steering wheel", &["steering".into()]);
    assert!(left_out.chosen(1).is_empty());
    let all = Identities::objects(3);
    let reading = read(&all, "steering wheel", &QueryConfig::default());
    assert_eq!(left_out.unexplained(&reading, &["steering".into()]), ["steering"]);
    // What looks like the rest of the words is no offer: a purple thing has nothing of a purple elephant.
    let offered = |unknown: &[String]| {
        let (all, mut features) = scene();
        features.encoder = "demo".into();
        let mut phrases = TextEmbeddings::default();
        let mut encode = |p: &str| Ok::<_, ()>(if p.contains("elephant") { vec![1.0, 0.0, 0.0] } else { vec![0.5; 3] });
        let reading = read(&all, "purple elephant", &QueryConfig::default());
        phrases.learn(&reading.phrase, &QueryConfig::default(), &mut encode).expect("encodes");
        let language = Language { features: &features, phrases: &phrases, unknown };
        let place = (LevelFilter::Auto, &QueryPlace::default());
        let [_, looks] = answer(&all, &reading, place, &QueryConfig::default(), Some(language)).offers(3);
        looks
    };
    assert_eq!((offered(&["elephant".into()]), offered(&[])), (vec![], vec![3]), "the control: every word is known");
    assert_eq!(ask("my wheel", &["my".into()]).chosen(1), [3], "a word that says nothing may be left out");
}

#[test]
fn several_that_are_asked_for_are_found_together_and_no_word_is_left_over() {
    let both = ask("mug and lamp", false);
    assert_eq!((both.answer.verdict(), both.chosen(1)), ("found", vec![3, 1]));
    let (all, _) = scene();
    let strange = ask("the striped mug", false);
    let reading = read(&all, "the striped mug", &QueryConfig::default());
    assert_eq!((strange.chosen(1), strange.unexplained(&reading, &[])), (vec![], vec!["striped".to_owned()]));
    assert_eq!(strange.offers(3), [vec![3], vec![]], "the nearest reading is offered");
}

#[test]
fn an_answer_is_as_sure_as_it_rests_on_names() {
    let sure = |text: &str| {
        let answered = ask(text, true);
        let ignored = answered.ignored_words(&["beige".to_owned()]);
        (answered.certainty(&ignored), ignored)
    };
    assert_eq!(sure("the lamp's shade"), (Certainty::Certain, vec![]));
    assert_eq!(sure("lamp mug shade").0, Certainty::Guess, "not all of it is explained");
    assert_eq!(sure("beaker"), (Certainty::Guess, vec!["beige".into()]), "by looks, with a word left out");
    let mut looks = ask("beaker", true);
    assert_eq!(looks.certainty(&[]), Certainty::Likely);
    looks.answer = Answer::Found(vec![Hit { identity: 3, score: 0.9, margin: 0.01 }]);
    assert_eq!(looks.certainty(&[]), Certainty::Guess, "another fits nearly as well");
    assert_eq!(ask("giraffe", true).certainty(&[]), Certainty::Guess);
}

#[test]
fn what_was_removed_is_not_found_by_its_looks() {
    let ask = |removed: &[&str], text: &str| {
        let (mut all, features) = scene();
        all.removed = removed.iter().map(|name| (*name).into()).collect();
        ask_of((all, features), text, &QueryConfig::default(), true).chosen(1)
    };
    assert_eq!(ask(&[], "beaker"), [3], "else it looks like the mug");
    assert_eq!(ask(&["paper beaker", "lid"], "beaker"), [3], "a beaker is not a paper beaker");
    assert!(ask(&["beaker"], "beaker").is_empty());
    assert_eq!(ask(&["beaker"], "mug"), [3], "another name");
    assert_eq!(ask(&["mug"], "mug"), [3], "one of two was removed");
}

#[test]
fn those_that_fit_alike_are_all_chosen_and_top_is_a_limit() {
    let answered = |answer: fn(Vec<Hit>) -> Answer, scores: &[f32]| {
        let hit = |(i, s): (usize, &f32)| Hit { identity: i as IdentityId + 1, score: *s, margin: 0.0 };
        let hits = scores.iter().enumerate().map(hit).collect();
        QueryAnswer::new(answer(hits), Basis::Names, vec![0.0, 0.25, 0.5], &QueryConfig::default())
    };
    let hits = [0.9, 0.89, 0.6, 0.3];
    assert_eq!(answered(Answer::Ambiguous, &hits).chosen(1), [1, 2], "0.01 apart, under 0.02");
    assert_eq!(answered(Answer::Ambiguous, &hits).chosen(3), [1, 2, 3]);
    assert_eq!(answered(Answer::Found, &hits).chosen(0), [1]);
    assert_eq!(answered(Answer::Found, &hits).chosen(9), [1, 2, 3], "0.3 is under the threshold");
    assert_eq!(answered(Answer::Found, &[0.45]).chosen(1), [1], "on it is enough");
    assert!(answered(Answer::NotFound, &hits).chosen(9).is_empty());
    let view = ViewMap { width_px: 4, height_px: 1, identity: vec![0, 2, 1, 77], share: vec![], alpha: vec![] };
    assert_eq!(answered(Answer::Found, &hits).heat(&view), [0.0, 0.5, 0.25, 0.0]);
}

#[test]
fn the_recipe_says_what_is_asked_and_when_nothing_fits() {
    let by = |match_by| QueryConfig { match_by, ..QueryConfig::default() };
    let basis = |text: &str, match_by| {
        let a = ask_by(text, &by(match_by), true);
        (a.basis, a.chosen(1))
    };
    // The encoder takes a beaker for the mug; no name knows it. By embedding, "mug" is as good as anything.
    assert_eq!(basis("beaker", MatchBy::Both), (Basis::Embedding, vec![3]));
    assert_eq!(basis("beaker", MatchBy::Embedding), (Basis::Embedding, vec![3]));
    assert_eq!(basis("beaker", MatchBy::Names), (Basis::Names, vec![]));
    assert_eq!(basis("mug", MatchBy::Both), (Basis::Names, vec![3]));
    assert_eq!(basis("mug", MatchBy::Embedding), (Basis::Embedding, vec![]));
    let nothing = ask_by("mug", &by(MatchBy::Embedding), false);
    assert_eq!((nothing.basis, nothing.chosen(1)), (Basis::Embedding, vec![]), "names are not looked at");
    // Hardly more relevant than a canonical phrase: by 0.0134, under the least advantage of encoders of photos.
    let hardly = |rejection| {
        let (all, features) = scene();
        let recipe = QueryConfig { rejection, ..by(MatchBy::Embedding) };
        let phrase = ParsedQuery::parse("beaker").expect("a phrase");
        let mut phrases = TextEmbeddings::default();
        let mut encode =
            |p: &str| Ok::<_, ()>(if p == "beaker" { vec![0.5134, 0.5, 0.5] } else { vec![0.5, 0.5, 0.5] });
        phrases.learn(&phrase, &recipe, &mut encode).expect("encodes");
        let language = Language { features: &features, phrases: &phrases, unknown: &[] };
        answer(
            &all,
            &read(&all, "beaker", &recipe),
            (LevelFilter::Auto, &QueryPlace::default()),
            &recipe,
            Some(language),
        )
        .chosen(1)
    };
    assert_eq!([Rejection::Never, Rejection::Canonical].map(hardly), [vec![3], vec![3]]);
    assert!(hardly(Rejection::Strict).is_empty());
    let never = QueryConfig { rejection: Rejection::Never, ..by(MatchBy::Embedding) };
    assert!(!ask_by("giraffe", &never, true).chosen(1).is_empty(), "what fits best is the answer");
    assert!(ask_by("giraffe", &by(MatchBy::Embedding), true).chosen(1).is_empty());
}

#[test]
fn what_has_another_color_is_not_found_by_embedding() {
    let (all, features) = scene();
    let ask = |text: &str, rejection| {
        let recipe = QueryConfig { rejection, match_by: MatchBy::Embedding, ..QueryConfig::default() };
        let phrase = ParsedQuery::parse(text).expect("a phrase");
        let mut phrases = TextEmbeddings::default();
        // The mug is red: any other color fits less, and "mug" is what makes it fit at all.
        let mut encode = |p: &str| {
            let red = if p.starts_with("red") { 0.2 } else { 0.0 };
            Ok::<_, ()>(if p.ends_with("mug") { vec![0.8 + red, 0.0, 0.0] } else { vec![0.5, 0.5, 0.5] })
        };
        phrases.learn(&phrase, &recipe, &mut encode).expect("encodes");
        let language = Language { features: &features, phrases: &phrases, unknown: &[] };
        answer(&all, &read(&all, text, &recipe), (LevelFilter::Auto, &QueryPlace::default()), &recipe, Some(language))
            .chosen(1)
    };
    assert_eq!(ask("red mug", Rejection::Strict), [3]);
    assert!(ask("blue mug", Rejection::Strict).is_empty());
    assert_eq!(ask("blue mug", Rejection::Canonical), [3], "the control: it is like a mug");
    assert_eq!(ask("mug", Rejection::Strict), [3]);
}

#[test]
fn relevancy_is_shown_raw_or_on_lerfs_scale_and_cut_at_a_fifth() {
    let answered = |scale| {
        let recipe = QueryConfig { scale, masks: MatchMode::Relevancy, ..QueryConfig::default() };
        // Of the background, and of five identities, the last of which is not in view.
        let relevancy = vec![0.0, 0.4, 0.55, 0.6, 0.7, 0.9];
        QueryAnswer::new(Answer::NotFound(vec![]), Basis::Embedding, relevancy, &recipe)
    };
    let map = ViewMap::certain(5, vec![0, 1, 2, 3, 4]);
    let (all, raw, lerf) = (Identities::objects(5), answered(RelevancyScale::Raw), answered(RelevancyScale::Lerf));
    assert_eq!(raw.heat(&map), [0.0, 0.4, 0.55, 0.6, 0.7]);
    let wanted = [0.0, 0.0, 0.25, 0.5, 1.0];
    assert!(lerf.heat(&map).iter().zip(wanted).all(|(h, w)| (h - w).abs() < 1e-5), "{:?}", lerf.heat(&map));
    let mask = raw.mask(&map, None, &all, 1);
    assert_eq!((0..5).map(|i| mask.contains(i)).collect::<Vec<_>>(), [false, false, true, true, true]);
    // With the last one in view, a fifth of the scale is more.
    let map = ViewMap::certain(5, vec![1, 2, 3, 4, 5]);
    assert!(!raw.mask(&map, None, &all, 1).contains(1) && raw.mask(&map, None, &all, 1).contains(2));
    let nothing = QueryAnswer { relevancy: vec![0.5; 6], ..raw };
    assert!(nothing.mask(&map, None, &all, 1).is_empty() && nothing.shown_relevancy(&map) == [0.5; 6]);
}

#[test]
fn the_papers_temperature_changes_scores_and_not_how_sure_an_answer_is() {
    let paper = QueryConfig { temperature: 1.0, ..QueryConfig::default() };
    let (a, b) = (ask("beaker", true), ask_by("beaker", &paper, true));
    assert_eq!((a.chosen(1), a.certainty(&[])), (b.chosen(1), b.certainty(&[])));
    let score = |a: &QueryAnswer| a.answer.hits()[0].score;
    assert!(score(&a) > score(&b) + 0.2 && (b.usual(score(&b)) - score(&a)).abs() < 1e-5);
}
