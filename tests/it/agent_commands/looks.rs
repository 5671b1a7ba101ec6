//! An encoder in the room to which everything looks like the piano: names come first, and an answer by embedding alone
//! is never acted on without a question.

use super::{done, say, session};
use crate::agent_common::room::Room;
use crate::agent_common::table::outcome;

/// Sentence, calls and end; to the encoder that comes with the program and to one of photos.
struct Row(&'static str, &'static [&'static str], &'static str);

/// Requests that names answer, with any encoder.
const BY_NAME: [Row; 22] = [
    Row("hide everything except the two controllers", &["isolate(red controller)", "isolate(blue controller)"], "done"),
    Row("show only the mug and the lamp", &["isolate(mug)", "isolate(lamp)"], "done"),
    Row("hide the two controllers", &["hide(red controller)", "hide(blue controller)"], "done"),
    Row("highlight both of the bottles", &["highlight(green bottle)", "highlight(brown bottle)"], "done"),
    Row("hide the three controllers", &[], "conflict"),
    Row("hide everything except the three controllers", &[], "conflict"),
    Row("hide the two mugs", &[], "conflict"),
    Row("show me the two controllers", &[], "ask"),
    Row("rename the two controllers to pad", &[], "ask"),
    Row("how big are the two bottles", &["measure(green bottle)", "measure(brown bottle)"], "done"),
    Row(
        "hide 2 buttons of the red controller",
        &["hide(button a · red controller)", "hide(button b · red controller)"],
        "done",
    ),
    Row("hide 3 buttons of the red controller", &[], "conflict"),
    Row("which bottle is the largest?", &["describe(brown bottle)"], "done"),
    Row("show me the smallest bottle", &["go_to(green bottle)"], "done"),
    Row("look at the leftmost controller", &["look_at(red controller)"], "done"),
    Row("show me the mug left of the laptop", &["go_to(mug)"], "done"),
    Row("show me the bottle nearest to the laptop", &["go_to(brown bottle)"], "done"),
    Row("show me the handle of the mug", &["go_to(handle · mug)"], "done"),
    Row("show me the mug right of the laptop", &[], "conflict"),
    Row("what is on the chair", &["list(objects, on, chair)"], "done"),
    Row("how many buttons does the red controller have", &["list(parts, red controller, \"buttons\")"], "done"),
    Row("hide it", &[], "unclear"),
];

/// Requests for things of no name, with an encoder that knows made-up things alone: they are not found.
const ABSENT: [Row; 12] = [
    Row("show me the banana", &[], "not_found"),
    Row("hide the robot", &[], "not_found"),
    Row("remove the dog", &[], "not_found"),
    Row("rename the dog to rex", &[], "not_found"),
    Row("export the gadget", &[], "not_found"),
    Row("show only the gadget", &[], "not_found"),
    Row("hide everything except the gadget", &[], "not_found"),
    Row("show me the blue mug", &[], "not_found"),
    Row("which banana is the largest?", &[], "not_found"),
    Row("is there a banana?", &[], "not_found"),
    Row("hide all bananas", &[], "not_found"),
    Row("show me the kettle's sleeve", &[], "conflict"),
];

/// The same with an encoder of photos: it says so where it is only looked, it is asked where something is changed, and
/// nothing is counted by it.
const BY_LOOKS: [Row; 12] = [
    Row("show me the banana", &["go_to(piano)"], "done"),
    Row("look at the biggest banana", &["look_at(piano)"], "done"),
    Row("hide the robot", &[], "confirm"),
    Row("remove the dog", &[], "confirm"),
    Row("rename the dog to rex", &[], "confirm"),
    Row("export the gadget", &[], "confirm"),
    Row("show only the gadget", &[], "confirm"),
    Row("bring back the gadget", &[], "conflict"),
    Row("hide the two gadgets", &[], "not_found"),
    Row("hide all gadgets", &[], "not_found"),
    Row("how many gadgets are there?", &[], "not_found"),
    Row("show me the mug left of the piano", &[], "conflict"),
];

fn wrong(rows: &[Row], encoder: Option<&'static str>) -> Vec<String> {
    let mut wrong = Vec::new();
    for Row(text, calls, ends) in rows {
        let (mut session, mut room) = (session(), Room::with_encoder(encoder));
        let reply = say(&mut session, &mut room, text);
        let now = (done(&session, &room), outcome(&reply));
        if now != (calls.iter().map(|c| (*c).to_owned()).collect(), *ends) {
            wrong.push(format!("{encoder:?} '{text}': {now:?}: {}", reply.text));
        }
    }
    wrong
}

#[test]
fn what_names_say_comes_before_what_looks_so() {
    let all = [None, Some("demo"), Some("clip-vit-b16")].map(|encoder| wrong(&BY_NAME, encoder)).concat();
    assert!(all.is_empty(), "{}", all.join("\n"));
}

#[test]
fn what_only_looks_so_is_offered_or_asked_about() {
    let all = [wrong(&ABSENT, None), wrong(&ABSENT, Some("demo")), wrong(&BY_LOOKS, Some("clip-vit-b16"))].concat();
    assert!(all.is_empty(), "{}", all.join("\n"));
    // The small one's guess is an offer.
    let reply = say(&mut session(), &mut Room::with_encoder(Some("demo")), "hide the banana");
    assert!(
        reply.text.contains("no \u{201c}banana\u{201d}") && reply.text.contains("Looks most like: piano"),
        "{}",
        reply.text
    );
    // The control: without an encoder there is no such offer.
    let reply = say(&mut session(), &mut Room::with_encoder(None), "hide the banana");
    assert!(!reply.text.contains("Looks most like"), "{}", reply.text);
}

#[test]
fn a_guess_is_acted_on_after_a_yes_alone() {
    for (answer, calls) in
        [("yes", vec!["hide(piano)".to_owned()]), ("no", vec![]), ("show me the mug", vec!["go_to(mug)".into()])]
    {
        let (mut session, mut room) = (session(), Room::with_encoder(Some("clip-vit-b16")));
        let question = say(&mut session, &mut room, "hide the banana").text;
        assert!(question.contains("No name here says") && question.contains("the piano"), "{question}");
        assert!(room.log.is_empty(), "{:?}", room.log);
        let reply = say(&mut session, &mut room, answer);
        assert_eq!((done(&session, &room), reply.refused), (calls, None), "{answer}");
    }
    // Where it only looks, it says how it was found.
    let reply = say(&mut session(), &mut Room::with_encoder(Some("clip-vit-b16")), "show me the banana");
    assert!(reply.text.contains("(Found by embedding, not by name.)"), "{}", reply.text);
}

#[test]
fn a_no_is_no_fault() {
    for (request, answer) in
        [("remove the mug", "no"), ("rename the mug to cup", "no, thanks"), ("show me the controller", "never mind")]
    {
        let (mut session, mut room) = (session(), Room::new());
        assert!(say(&mut session, &mut room, request).pending.is_some(), "{request}");
        let reply = say(&mut session, &mut room, answer);
        assert!(reply.refused.is_none() && reply.text.starts_with("All right"), "{reply:?}");
        assert!(room.log.is_empty(), "{:?}", room.log);
    }
}
