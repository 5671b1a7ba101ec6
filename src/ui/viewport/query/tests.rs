//! Queries that are asked, kept and asked again.

use super::*;
use crate::scene::{Identities, Level, NOBODY};

fn semantics() -> SemanticMap {
    let mut identities = Identities::default();
    let lamp = identities.add(Level::Object, NOBODY, vec!["lamp".into()]);
    identities.add(Level::Part, lamp, vec!["shade".into()]);
    SemanticMap { identities, ..SemanticMap::default() }
}

#[test]
fn a_question_is_kept_and_answers_follow_the_names() {
    let (mut semantics, mut queries) = (semantics(), Queries::default());
    queries.ask("the lamp's shade", &semantics);
    queries.keep();
    queries.ask("lamp", &semantics);
    let shown = |q: &Queries| q.all().map(|a| a.shown(&q.settings)).collect::<Vec<_>>();
    assert_eq!(shown(&queries), [vec![2], vec![1]]);
    queries.ask("giraffe", &semantics);
    assert!(shown(&queries)[1].is_empty());
    semantics.identities.get_mut(2).expect("there").names = vec!["giraffe".into()];
    queries.ask_again(&semantics);
    assert_eq!(shown(&queries), [Vec::new(), vec![2]]);
    queries.ask("  ", &semantics);
    assert!(queries.live.is_none());
}

#[test]
fn history_is_kept_once_each() {
    let (semantics, mut queries) = (semantics(), Queries::default());
    for text in ["lamp", "shade", "lamp"] {
        queries.ask(text, &semantics);
        queries.keep();
    }
    assert_eq!(queries.history, ["shade", "lamp"]);
    queries.clear();
    assert_eq!((queries.history.len(), queries.kept.len()), (2, 0));
}
