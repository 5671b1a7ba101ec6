//! The agent's command language in the made-up room: the documented commands in three wordings each; requests that are
//! not understood, not there or ambiguous do nothing; 200 ordinary sentences against their verdicts.

mod looks;
pub mod stored;

use std::fmt::Write as _;
use std::sync::atomic::AtomicBool;

use crate::agent_common::room::Room;
use crate::agent_common::table::{Table, Tally, Wordings, outcome, tally};
use fmlgs::agent::commands::{Commands, commands, complete};
use fmlgs::agent::execute::CallOutcome;
use fmlgs::agent::planner::{PlannerContext, Step};
use fmlgs::agent::tool::{Target, ToolCall};
use fmlgs::agent::transcript::What;
use fmlgs::agent::{Planner, Policy, Refusal, Reply, Session, World};
use fmlgs::navigate::target::Side;
use fmlgs::scene::NO_IDENTITY;
use serde::{Deserialize, Serialize};

const WORDINGS: &str = include_str!("../../data/agent_commands.toml");
const DIALOGS: &str = include_str!("../../data/agent_dialogs.toml");
const SENTENCES: &str = include_str!("../../data/ordinary_sentences.jsonl");
const VERDICTS: &str = include_str!("../../data/ordinary_verdicts.jsonl");
const PAGE: &str = include_str!("../../../docs/commands.md");

fn session() -> Session {
    Session::new(Policy::built_in().expect("policy"), Box::new(Commands::default()))
}

fn say(session: &mut Session, room: &mut Room, text: &str) -> Reply {
    session.say(room, text, &mut |_| {}, &AtomicBool::new(false))
}

/// The calls that were done, with names in place of numbers.
fn done(session: &Session, room: &Room) -> Vec<String> {
    let result = |what: &What| match what {
        What::Result { call, done: true, .. } => Some(call.line(room.identities())),
        _ => None,
    };
    session.transcript().entries.iter().filter_map(|e| result(&e.what)).collect()
}

#[test]
fn every_documented_command_is_right_in_three_wordings() {
    let table: Wordings = toml::from_str(WORDINGS).expect("a table of wordings");
    let mut wrong = String::new();
    for row in &table.command {
        assert!(row.say.len() >= 3, "{}", row.example);
        for (i, text) in row.say.iter().enumerate() {
            let (mut session, mut room) = (session(), Room::new());
            row.after.iter().for_each(|before| {
                say(&mut session, &mut room, before);
            });
            let before = done(&session, &room).len();
            let reply = say(&mut session, &mut room, text);
            let calls = done(&session, &room).split_off(before);
            let asks: Vec<String> = reply.pending.map(|p| format!("{p:?}")).into_iter().collect();
            let all: Vec<String> = calls.into_iter().chain(asks).collect();
            let wanted = &row.calls[i.min(row.calls.len() - 1)];
            if &all != wanted {
                writeln!(wrong, "{text:?}: wanted {wanted:?}, got {all:?}: {}", reply.text).expect("a text");
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong}");
    let tried: Vec<&str> = table.command.iter().map(|c| c.example.as_str()).collect();
    let all: Vec<&str> = commands().iter().map(|c| c.example.as_str()).collect();
    assert_eq!(tried, all, "every command has its wordings, in the order of the table");
}

#[test]
fn the_page_says_what_the_table_says() {
    let mut wanted = String::new();
    for command in commands() {
        writeln!(wanted, "- **{}** {}:", command.example.replace("{}", "kettle"), command.does).expect("a text");
        command.forms.iter().for_each(|form| writeln!(wanted, "  - `{form}`").expect("a text"));
    }
    if !PAGE.contains(&wanted) {
        let path = std::env::temp_dir().join("commands.txt");
        std::fs::write(&path, &wanted).expect("written");
        panic!("docs/commands.md does not list the commands as they are: put {} there", path.display());
    }
    let listed = PAGE.lines().filter(|l| l.starts_with("  - `")).count();
    assert_eq!(listed, commands().iter().map(|c| c.forms.len()).sum::<usize>(), "and no others");
}

fn report(what: &str, tally: &Tally) {
    println!("{what}: {} of {} right, {} unsafe", tally.right, tally.all, tally.unsafe_ones);
    tally.wrong.iter().for_each(|w| println!("  {w}"));
}

#[test]
fn dialogs_go_as_wanted_and_nothing_is_done_in_doubt() {
    let tally = tally(&Table::read(DIALOGS), &session);
    report("dialogs", &tally);
    assert_eq!((tally.right, tally.unsafe_ones), (tally.all, 0));
}

/// Goes to the table, whatever is said.
struct Deaf(bool);

impl Planner for Deaf {
    fn name(&self) -> &'static str {
        "deaf"
    }

    fn start(&mut self, _request: &str, _context: &mut PlannerContext<'_>) {
        self.0 = false;
    }

    fn next(&mut self, _last: Option<&CallOutcome>, _context: &mut PlannerContext<'_>) -> Result<Step, Refusal> {
        if std::mem::replace(&mut self.0, true) {
            return Ok(Step::finish());
        }
        Ok(Step::Call(ToolCall::GoTo { target: Target::query("table"), side: Side::Same, closeness: 1.0 }))
    }
}

#[test]
fn a_planner_that_ignores_the_sentence_scores_low() {
    let deaf = || Session::new(Policy::built_in().expect("policy"), Box::new(Deaf(false)));
    let tally = tally(&Table::read(DIALOGS), &deaf);
    assert!(tally.right * 100 <= tally.all * 10, "{} of {}", tally.right, tally.all);
}

#[test]
fn without_the_policy_unsafe_things_happen() {
    let off = || Session::new(Policy::off(), Box::new(Commands::default()));
    let tally = tally(&Table::read(DIALOGS), &off);
    assert!(tally.unsafe_ones >= 5, "{}", tally.unsafe_ones);
}

#[test]
fn whatever_is_typed_there_is_an_answer_and_nothing_is_removed() {
    let mut session = session();
    let mut room = Room::new();
    let long = "remove the mug and ".repeat(2000);
    let words = [
        "remove", "the", "mug", "yes", ",", "then", "\"", "of", "left", "it", "no", "'s", "1e999", "-", "half a",
        "the", "all", "#3",
    ];
    let mut texts: Vec<String> = vec![long, "\u{0}\u{202e}remove".into(), "of of of of".into(), "the the the".into()];
    for a in words {
        for b in words {
            texts.push(format!("{a} {b}"));
            texts.push(format!("show {a} {b} left of {b} {a}"));
        }
    }
    for text in texts {
        let reply = say(&mut session, &mut room, &text);
        assert!(!reply.text.is_empty(), "{text}");
        complete(&text, room.identities(), 8);
        // Only a plain yes right after the question may remove; no text here is one.
        assert!(!room.log.iter().any(|l| l.starts_with("remove")), "{text}: {:?}", room.log.last());
    }
    assert!(room.facts(1).is_some());
}

#[test]
fn a_size_is_the_same_wherever_one_stands() {
    let (mut session, mut room) = (session(), Room::new());
    let first = say(&mut session, &mut room, "measure the width of the table").text;
    assert!(first.contains("2.2 m on its longer side, 90 cm on its shorter side and 75 cm high"), "{first}");
    for turn in ["show me the lamp from the left", "turn left 70 degrees", "show me the table from above"] {
        assert!(say(&mut session, &mut room, turn).refused.is_none(), "{turn}");
        assert_eq!(say(&mut session, &mut room, "measure the width of the table").text, first, "after '{turn}'");
    }
    // The control: what is left of a thing does depend on it.
    let mut room = Room::new();
    let left = say(&mut session, &mut room, "what is left of the laptop").text;
    say(&mut session, &mut room, "turn around");
    assert_ne!(say(&mut session, &mut room, "what is left of the laptop").text, left);
}

#[test]
fn several_things_are_marked_together_and_the_next_request_marks_anew() {
    let (mut session, mut room) = (session(), Room::new());
    say(&mut session, &mut room, "mark both bottles");
    assert_eq!(room.log.last().map(String::as_str), Some("highlight green bottle, brown bottle"));
    say(&mut session, &mut room, "mark the lamp");
    assert_eq!(room.log.last().map(String::as_str), Some("highlight lamp"));
}

/// Names of things that no room of the tests has, each with one of a part.
const HARD: [[&str; 2]; 12] = [
    ["plush toy", "pink bow on the plush toy's hood"],
    ["left of the lamp", "button a of b"],
    ["mug from above", "handle nearest to the kettle"],
    ["salt, oil and pepper", "all of them"],
    ["Levi's 501", "20cm ruler"],
    ["赤いコントローラーのボタン", "手柄"],
    ["what's this", "the (lower) part"],
    ["yes please", "please"],
    ["Set of Cups", "cup of the set"],
    ["nothing else", "third one"],
    ["doll's house", "eye · doll"],
    ["C++", "C# 2.0"],
];

#[test]
fn things_are_called_by_their_names_as_a_whole() {
    let mut room = Room::new();
    let mut ids = Vec::new();
    for [thing, part] in HARD {
        let whole = room.put(NO_IDENTITY, thing);
        ids.extend([(whole, thing), (room.put(whole, part), part)]);
    }
    let mut wrong = String::new();
    for (id, name) in ids {
        let full = room.identities().full_name(id);
        for name in [name, &full, &name.to_uppercase()] {
            for form in
                ["show me {}", "look at the {}", "highlight {}", "how big is the {}", "hide {} and turn left", "the {}"]
            {
                let (mut session, mut room) = (session(), room.clone());
                let request = form.replace("{}", name);
                let reply = say(&mut session, &mut room, &request);
                let calls = done(&session, &room);
                let is_meant = |call: &String| call.contains(&format!("({full}"));
                if !calls.first().is_some_and(is_meant) {
                    let _ = writeln!(wrong, "'{request}': {calls:?}, {}", reply.text);
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong}");
    // The control: what is nobody's name is no one's, and two of the same name are asked about and told apart.
    let reply = say(&mut session(), &mut room, "show me the pink bow on the plush toy's foot");
    assert!(reply.refused.is_some(), "{}", reply.text);
    let twins = [room.put(NO_IDENTITY, "bow on the hat"), room.put(NO_IDENTITY, "bow on the hat")];
    let mut session = session();
    assert_eq!(say(&mut session, &mut room, "show me the bow on the hat").candidates, twins);
    let second = room.identities().full_name(twins[1]);
    say(&mut session, &mut room, &second);
    assert_eq!(done(&session, &room), [format!("go_to(bow on the hat #{})", twins[1])]);
}

#[test]
fn a_completion_that_is_taken_finds_what_it_names() {
    let mut room = Room::new();
    HARD.iter().for_each(|[thing, part]| {
        let whole = room.put(NO_IDENTITY, thing);
        room.put(whole, part);
    });
    for (begun, full) in [
        ("show me the pink", "pink bow on the plush toy's hood · plush toy"),
        ("show me pink bow on the plush toy's ho", "pink bow on the plush toy's hood · plush toy"),
        ("hide the button a · bl", "button a · blue controller"),
        ("highlight the levi", "Levi's 501"),
        ("show me the 手", "手柄 · 赤いコントローラーのボタン"),
    ] {
        let offered = complete(begun, room.identities(), 12);
        let text = offered.iter().find(|o| o.to_lowercase().ends_with(&full.to_lowercase()));
        let text = text.unwrap_or_else(|| panic!("'{begun}': {offered:?}"));
        let (mut session, mut room) = (session(), room.clone());
        say(&mut session, &mut room, text);
        let calls = done(&session, &room);
        assert!(calls.len() == 1 && calls[0].contains(&format!("({full})")), "'{text}': {calls:?}");
    }
}

#[test]
fn completions_lead_to_commands() {
    let room = Room::new();
    let all = room.identities();
    let starts = |text: &str| complete(text, all, 12);
    assert!(starts("show me the ket").contains(&"show me the kettle".to_owned()), "{:?}", starts("show me the ket"));
    assert!(starts("hide the mug and sh").contains(&"hide the mug and show".to_owned()));
    assert!(starts("what is on the table le").contains(&"what is on the table left of".to_owned()));
    assert!(starts("turn left 90 ").contains(&"turn left 90 degrees".to_owned()) && !starts("").is_empty());
    assert!(starts("please hi").contains(&"please hide".to_owned()));
    assert!(
        starts("show me ")[0].starts_with("show me the "),
        "names of the scene come first: {:?}",
        starts("show me ")
    );
    assert!(starts("paint the c").is_empty(), "nothing goes on from what is no command");
    // Taking the first again and again comes to a command that is understood.
    for begin in ["sh", "hide th", "how b", "where ", "measure the wi"] {
        let mut text = begin.to_owned();
        for _ in 0..12 {
            let reply = say(&mut session(), &mut Room::new(), &text);
            if outcome(&reply) != "unclear" {
                break;
            }
            let next = starts(&text).into_iter().next().or_else(|| starts(&format!("{text} ")).into_iter().next());
            text = next.unwrap_or_else(|| panic!("'{text}' does not go on"));
        }
        let reply = say(&mut session(), &mut Room::new(), &text);
        assert_ne!(outcome(&reply), "unclear", "{begin}: {text}: {}", reply.text);
    }
}

#[derive(Deserialize)]
struct Sentence {
    say: String,
    #[allow(dead_code, reason = "read by whoever judges")]
    expect: String,
    #[allow(dead_code, reason = "read by whoever judges")]
    tools: serde_json::Value,
}

/// Calls and end of a sentence, and the verdict by hand against the expectation of its writer.
#[derive(Clone, Debug, Serialize, Deserialize, PartialEq)]
struct Verdict {
    say: String,
    calls: Vec<String>,
    ends: String,
    verdict: String,
}

#[test]
fn of_ordinary_sentences_the_verdicts_stay_true() {
    let known: Vec<Verdict> = VERDICTS.lines().map(|l| serde_json::from_str(l).expect("a verdict")).collect();
    let mut now = Vec::new();
    for line in SENTENCES.lines() {
        let sentence: Sentence = serde_json::from_str(line).expect("a sentence");
        let (mut session, mut room) = (session(), Room::new());
        let reply = say(&mut session, &mut room, &sentence.say);
        let (calls, ends) = (done(&session, &room), outcome(&reply).to_owned());
        let same = known.iter().find(|v| v.say == sentence.say && v.calls == calls && v.ends == ends);
        let verdict = match (same, ends.as_str()) {
            (Some(known), _) => known.verdict.clone(),
            (None, "unclear" | "not_found") if calls.is_empty() => "not understood".to_owned(),
            (None, _) => "to be judged".to_owned(),
        };
        now.push((Verdict { say: sentence.say, calls, ends, verdict }, reply.text));
    }
    assert_eq!(now.len(), 200);
    let all: Vec<&Verdict> = now.iter().map(|(v, _)| v).collect();
    if all != known.iter().collect::<Vec<_>>() {
        let lines = |with_reply: bool| -> String {
            let line = |(v, reply): &(Verdict, String)| {
                let text = serde_json::to_string(v).expect("JSON");
                if with_reply { format!("{text}  => {reply}\n") } else { format!("{text}\n") }
            };
            now.iter().map(line).collect()
        };
        let path = std::env::temp_dir().join("ordinary_verdicts.jsonl");
        std::fs::write(&path, lines(false)).expect("written");
        std::fs::write(path.with_extension("txt"), lines(true)).expect("written");
        panic!(
            "other calls than those judged: judge {} and put it over tests/data/ordinary_verdicts.jsonl",
            path.display()
        );
    }
    let count = |verdict: &str| all.iter().filter(|v| v.verdict == verdict).count();
    let (right, not, wrong) = (count("right"), count("not understood"), count("wrong"));
    assert_eq!(right + not + wrong, 200, "every one is judged");
    assert!(wrong <= 2, "at most 1 % wrong: {wrong}");
    let row = format!("| now | {right} | {not} | {wrong} |");
    assert!(PAGE.contains(&row), "docs/commands.md says otherwise than: {row}");
}
