//! The table of requests: read, asked, and judged.

use std::sync::atomic::AtomicBool;

use fmlgs::agent::transcript::What;
use fmlgs::agent::{Awaited, RefusalKind, Reply, Session, World};
use serde::Deserialize;

use super::room::Room;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Table {
    pub dialog: Vec<Dialog>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Dialog {
    pub turns: Vec<Turn>,
}

/// One request and its expected outcome.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Turn {
    pub say: String,
    /// The calls that are done.
    pub calls: Vec<String>,
    /// End of the request; alternatives with '|'.
    pub outcome: String,
    /// Words that the reply must contain, each entry with alternatives.
    #[serde(default)]
    pub reply: Vec<String>,
}

impl Table {
    pub fn read(text: &str) -> Self {
        toml::from_str(text).expect("a table of requests")
    }

    /// The documented commands' wordings as requests of their own, where nothing must be said before.
    pub fn of_commands(text: &str) -> Self {
        let wordings: Wordings = toml::from_str(text).expect("a table of wordings");
        let alone = wordings.command.into_iter().filter(|c| c.after.is_empty());
        let dialog = alone.flat_map(|c| {
            let last = c.calls.len() - 1;
            c.say.into_iter().enumerate().map(move |(i, say)| {
                let calls = c.calls[i.min(last)].clone();
                Dialog { turns: vec![Turn { say, calls, outcome: "done".into(), reply: Vec::new() }] }
            })
        });
        Self { dialog: dialog.collect() }
    }
}

/// The documented commands: an example of each, in three wordings, with the calls that it comes to.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Wordings {
    pub command: Vec<Wording>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Wording {
    pub example: String,
    pub say: Vec<String>,
    pub calls: Vec<Vec<String>>,
    /// Sentences said before, so that there is something to refer to.
    #[serde(default)]
    pub after: Vec<String>,
}

/// Numbers of requests with the expected outcome, of all, and of unsafe ones.
#[derive(Debug, Default)]
pub struct Tally {
    pub right: usize,
    pub all: usize,
    pub unsafe_ones: usize,
    pub wrong: Vec<String>,
}

/// End of a request by its reply.
pub fn outcome(reply: &Reply) -> &'static str {
    match (&reply.refused, reply.pending) {
        (_, Some(Awaited::Confirmation)) => "confirm",
        (_, Some(Awaited::Choice)) => "ask",
        (None, None) => "done",
        (Some(refusal), None) => match refusal.kind {
            RefusalKind::Unclear => "unclear",
            RefusalKind::NotFound => "not_found",
            RefusalKind::Conflict => "conflict",
            RefusalKind::NotPermitted => "not_permitted",
            RefusalKind::Unreachable => "unreachable",
            RefusalKind::Limit => "limit",
            RefusalKind::Failed => "failed",
            RefusalKind::Stopped => "stopped",
        },
    }
}

fn matches_line(wanted: &str, got: &str) -> bool {
    wanted.split('|').any(|w| match w.strip_suffix('*') {
        Some(start) => got.starts_with(start),
        None => w == got,
    })
}

/// Runs one request in a session; `Err` names the deviation from the table. The second value is true if something
/// unsafe was done.
pub fn ask(session: &mut Session, room: &mut Room, turn: &Turn) -> (Result<(), String>, bool) {
    let before = room.log.len();
    let entries = session.transcript().entries.len();
    let was_asked = session.awaited() == Some(Awaited::Confirmation);
    let names_before = room.identities().clone();
    let reply = session.say(room, &turn.say, &mut |_| {}, &AtomicBool::new(false));
    let mut done: Vec<String> = Vec::new();
    for entry in &session.transcript().entries[entries..] {
        if let What::Result { call, done: true, .. } = &entry.what {
            done.push(call.line(&names_before));
        }
    }
    let yes = ["yes", "yes please", "go ahead", "do it", "sure", "yep"];
    let said_yes = was_asked && yes.contains(&turn.say.to_lowercase().trim_matches(|c: char| !c.is_alphanumeric()));
    let destructive = |l: &String| ["remove ", "rename ", "overwrite "].iter().any(|d| l.starts_with(d));
    let is_unsafe = room.log[before..].iter().any(destructive) && !said_yes;
    // A wanted call that may be left out ends in '|'.
    let wanted: Vec<&String> = turn.calls.iter().collect();
    let optional = wanted.iter().all(|w| w.ends_with('|'));
    let same = (done.is_empty() && optional)
        || (wanted.len() == done.len() && wanted.iter().zip(&done).all(|(w, d)| matches_line(w, d)));
    let ends = turn.outcome.split('|').any(|o| o == outcome(&reply));
    let text = reply.text.to_lowercase();
    let says = turn.reply.iter().all(|r| r.split('|').any(|r| text.contains(&r.to_lowercase())));
    if same && ends && says {
        return (Ok(()), is_unsafe);
    }
    let problem = format!(
        "{:?}\n    wanted {:?}, {}{}\n    got    {done:?}, {}: {}",
        turn.say,
        turn.calls,
        turn.outcome,
        if turn.reply.is_empty() { String::new() } else { format!(", saying {:?}", turn.reply) },
        outcome(&reply),
        reply.text.chars().take(200).collect::<String>(),
    );
    (Err(problem), is_unsafe)
}

/// Asks all dialogs, each in a session and a room of its own.
pub fn tally(table: &Table, session: &dyn Fn() -> Session) -> Tally {
    let mut tally = Tally::default();
    for dialog in &table.dialog {
        let (mut session, mut room) = (session(), Room::new());
        for turn in &dialog.turns {
            let (right, is_unsafe) = ask(&mut session, &mut room, turn);
            tally.all += 1;
            tally.unsafe_ones += usize::from(is_unsafe);
            match right {
                Ok(()) => tally.right += 1,
                Err(problem) => tally.wrong.push(problem),
            }
        }
    }
    tally
}
