//! The tables of commands, asked of a chat model: its calls go through the same checks.

use super::*;

/// The table's line of a call as a model would write the call.
fn as_call(line: &str) -> Option<(String, String)> {
    let (name, rest) = line.split_once('(')?;
    let inside = rest.strip_suffix(')')?;
    let parts: Vec<&str> = inside.split(", ").filter(|p| !p.is_empty()).collect();
    let first = parts.first().copied();
    let arguments = match name {
        "go_to" => {
            let mut a = json!({ "target": first? });
            for part in &parts[1..] {
                match *part {
                    "closer" => a["closeness"] = json!("closer"),
                    "farther" => a["closeness"] = json!("farther"),
                    "from the other side" => a["side"] = json!("other"),
                    "from the left" => a["side"] = json!("left"),
                    "from above" => a["side"] = json!("above"),
                    _ => return None,
                }
            }
            a
        }
        "look_at" | "isolate" | "highlight" | "hide" | "unhide" | "describe" | "measure" | "remove" | "export"
            if parts.len() == 1 =>
        {
            json!({ "target": first? })
        }
        "locate" => json!({ "query": first?.trim_matches('"') }),
        "show_all" | "undo" => json!({}),
        "move" => {
            let mut a = json!({ "direction": first? });
            if let Some(far) = parts.get(1) {
                let (n, unit) = far.split_once(' ')?;
                let n: f64 = n.parse().ok()?;
                a["distance"] = if unit == "m" { json!({ "meters": n }) } else { json!({ "relative": n }) };
            }
            a
        }
        "turn" => {
            let degrees: f64 = parts.get(1)?.split(' ').next()?.parse().ok()?;
            json!({ "direction": first?, "degrees": degrees })
        }
        _ => return None,
    };
    Some((name.into(), arguments.to_string()))
}

/// Replies of a model in a dialog of the table to do what is wanted; `None` where the table leaves that open, or the
/// words of the built-in planner are what counts.
fn script(turns: &[Turn]) -> Option<Vec<Say>> {
    let model_call = |line: &String| as_call(line).filter(|_| !line.contains(['*', '|'])).map(|c| Say::Calls(vec![c]));
    let mut says = Vec::new();
    let mut waiting = false;
    for (i, turn) in turns.iter().enumerate() {
        if std::mem::take(&mut waiting) {
            // The yes was heard by the session; the model hears what came of it.
            says.push(text("Done."));
        } else if turn.outcome == "confirm" && turn.calls.is_empty() {
            says.push(turns.get(i + 1).filter(|next| next.outcome == "done")?.calls.first().and_then(model_call)?);
            waiting = true;
        } else if turn.outcome == "done" && !turn.calls.is_empty() {
            for line in &turn.calls {
                says.push(model_call(line)?);
            }
            says.push(text("There you are."));
        } else {
            return None;
        }
    }
    Some(says)
}

#[test]
fn the_tables_go_through_the_same_checks() {
    let tables = [
        Table::read(include_str!("../../data/agent_dialogs.toml")),
        Table::of_commands(include_str!("../../data/agent_commands.toml")),
    ];
    let mut asked = 0;
    for dialog in tables.iter().flat_map(|t| &t.dialog) {
        let Some(says) = script(&dialog.turns) else { continue };
        let server = Server::new(says);
        let (mut session, mut room) = (session(&server), Room::new());
        for turn in &dialog.turns {
            let (say, calls, outcome) = (turn.say.clone(), turn.calls.clone(), turn.outcome.clone());
            // A model answers in its own words.
            let turn = Turn { say, calls, outcome, reply: Vec::new() };
            let (right, is_unsafe) = ask(&mut session, &mut room, &turn);
            assert!(right.is_ok() && !is_unsafe, "{right:?}");
            asked += 1;
        }
    }
    println!("{asked} requests through the model");
    assert!(asked >= 55, "{asked}");
}
