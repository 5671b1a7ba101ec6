//! Queries that are run, pinned and run again.

use super::*;
use crate::scene::{Identities, Level, NO_IDENTITY};

fn semantics() -> SemanticMap {
    let mut identities = Identities::default();
    let lamp = identities.add(Level::Object, NO_IDENTITY, vec!["lamp".into()]);
    identities.add(Level::Part, lamp, vec!["shade".into()]);
    SemanticMap { identities, ..SemanticMap::default() }
}

#[test]
fn a_query_is_pinned_and_answers_follow_the_names() {
    let (mut semantics, mut queries) = (semantics(), Queries::default());
    queries.ask("lamp", &semantics);
    queries.ask("the lamp's shade", &semantics);
    assert_eq!(queries.all().count(), 1, "one takes the place of the other");
    queries.pin();
    assert_eq!(queries.all().count(), 1, "each is there once");
    queries.ask("lamp", &semantics);
    let shown = |q: &Queries| q.all().map(|a| a.shown(&q.side().settings)).collect::<Vec<_>>();
    assert_eq!(shown(&queries), [vec![2], vec![1]]);
    queries.ask("giraffe", &semantics);
    assert!(shown(&queries)[1].is_empty());
    semantics.identities.get_mut(2).expect("there").names = vec!["giraffe".into()];
    queries.ask_again(&semantics);
    assert_eq!(shown(&queries), [Vec::new(), vec![2]]);
    queries.ask("  ", &semantics);
    assert!(queries.side().live.is_none());
}

#[test]
fn what_is_not_found_has_no_color() {
    let (semantics, mut queries) = (semantics(), Queries::default());
    queries.ask("giraffe", &semantics);
    let not_found = queries.side().live.clone().expect("asked");
    queries.ask("lamp", &semantics);
    let found = queries.side().live.clone().expect("asked");
    assert_eq!((queries.color_of(&not_found), queries.color_of(&found)), (None, Some(Color32::from_rgb(255, 179, 0))));
    queries.pin();
    queries.pin();
    assert!(queries.side().pinned.is_empty(), "the second press takes it back");
}

#[test]
fn history_is_kept_once_each() {
    let (semantics, mut queries) = (semantics(), Queries::default());
    for text in ["lamp", "shade", "lamp"] {
        queries.ask(text, &semantics);
        queries.settle();
        queries.pin();
    }
    assert_eq!(queries.history, ["shade", "lamp"]);
    queries.clear();
    assert_eq!((queries.history.len(), queries.side().pinned.len()), (2, 0));
}

#[test]
fn two_views_have_their_own_queries_and_the_same_colors() {
    let (semantics, mut queries) = (semantics(), Queries::default());
    queries.ask("lamp", &semantics);
    queries.in_view(true, |second| {
        assert!(second.all().next().is_none(), "nothing is asked there yet");
        second.ask("the lamp's shade", &semantics);
        second.pin();
        second.tint(ColorBy::Objects);
    });
    assert!(!queries.is_second() && queries.side().settings.color_by == ColorBy::Masks);
    queries.ask_again(&semantics);
    let colors = |q: &mut Queries, second| q.in_view(second, |q| q.found_colors());
    let (first, second) = (colors(&mut queries, false), colors(&mut queries, true));
    assert_eq!((first[0].0, second[0].0), (1, 2));
    assert_ne!(first[0].1, second[0].1);
    // In the other order, each keeps its color.
    queries.ask("the  Lamp's shade", &semantics);
    queries.in_view(true, |q| q.mark(&["lamp".into()], &semantics));
    assert_eq!((colors(&mut queries, false)[0].1, colors(&mut queries, true)[0].1), (second[0].1, first[0].1));
    assert_eq!(queries.pinned_texts(), [Vec::<String>::new(), Vec::new()]);
    queries.work_in(true);
    queries.pin();
    assert_eq!(queries.pinned_texts(), [vec![], vec!["lamp".to_owned()]], "in the order of the views");
    queries.pin_only(&[vec!["lamp".into()], vec![]], &semantics);
    assert_eq!(queries.pinned_texts(), [vec!["lamp".to_owned()], vec![]]);
    queries.clear();
    assert!(queries.is_second() && queries.in_view(false, |q| q.all().next().is_none()));
    assert_eq!(queries.colors.of("lamp"), [255, 179, 0], "known in the next scene too");
}

#[test]
fn each_view_answers_by_its_own_recipe() {
    let (semantics, mut queries) = (semantics(), Queries::default());
    queries.ask("lamp", &semantics);
    queries.in_view(true, |second| second.ask("lamp", &semantics));
    let answers = |queries: &mut Queries| {
        [false, true].map(|second| {
            queries.in_view(second, |q| {
                let asked = q.all().next().expect("asked");
                (asked.answered.recipe.clone(), asked.shown(&q.side().settings))
            })
        })
    };
    let default = (QueryConfig::default(), vec![1]);
    assert_eq!(answers(&mut queries), [default.clone(), default.clone()]);
    // By embedding alone nothing is found here: the scene has no embeddings.
    queries.set_recipes(&[QueryConfig::default(), QueryConfig::paper()], &semantics);
    assert_eq!(answers(&mut queries), [default, (QueryConfig::paper(), vec![])]);
    assert_eq!(queries.recipes()[1], QueryConfig::paper());
    queries.work_in(true);
    assert_eq!((queries.recipe(), queries.recipes()[0].clone()), (&QueryConfig::paper(), QueryConfig::default()));
    let texts: Vec<QueryConfig> = queries.sides.iter().flat_map(QuerySide::texts).map(|t| t.1).collect();
    assert_eq!(texts, [QueryConfig::default(), QueryConfig::paper()], "the encoder is told");
}
