//! The agent with a chat model, against a server on this machine that says what it should, and one
//! that misbehaves: nothing but valid, permitted calls is ever done, and the key is nowhere to be read.

mod discovery;
mod sent;
mod tables;

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use crate::agent_common::room::{ATTACK, Room};
use crate::agent_common::server::{Say, Server};
use crate::agent_common::table::{Table, Turn, ask, outcome};
use fmlgs::agent::llm::Llm;
use fmlgs::agent::llm::secret::Secret;
use fmlgs::agent::llm::settings::{LlmSettings, RequestLimits, RequestTimeouts};
use fmlgs::agent::{AgentEvent, Policy, RefusalKind, Reply, Session, World};
use serde_json::{Value, json};

const KEY: &str = "sk-test/0123456789abcdef+Q";

fn timeouts() -> RequestTimeouts {
    RequestTimeouts {
        stall: Duration::from_millis(300),
        answer: Duration::from_secs(3),
        request: Duration::from_secs(10),
        attempts: 3,
        pause: Duration::from_millis(5),
        longest_pause: Duration::from_millis(300),
    }
}

fn session_with(server: &Server, policy: Policy, limits: RequestLimits) -> Session {
    let settings = LlmSettings { base_url: server.url.clone(), model: "test".into(), ..LlmSettings::default() };
    let planner = Llm::with(settings, Secret::new(KEY), timeouts(), limits).expect("settings");
    Session::new(policy, Box::new(planner))
}

fn session(server: &Server) -> Session {
    session_with(server, Policy::built_in().expect("policy"), RequestLimits::default())
}

/// Result of a conversation.
struct Talk {
    server: Server,
    session: Session,
    room: Room,
    events: Vec<AgentEvent>,
    reply: Reply,
}

impl Talk {
    fn new(script: Vec<Say>) -> Self {
        let server = Server::new(script);
        let session = session(&server);
        Self { server, session, room: Room::new(), events: Vec::new(), reply: Reply::default() }
    }

    fn say(mut self, text: &str) -> Self {
        let events = &mut self.events;
        self.reply = self.session.say(&mut self.room, text, &mut |e| events.push(e), &AtomicBool::new(false));
        assert!(self.server.is_well_formed(), "a call without its result went to the model");
        self
    }

    fn outcome(&self) -> &'static str {
        outcome(&self.reply)
    }

    /// All that can be read of the talk, but what was sent in the header.
    fn everything(&self) -> String {
        let t = self.session.transcript();
        let bodies: Vec<String> = self.server.seen.lock().expect("log").iter().map(|s| s.body.clone()).collect();
        format!("{}\n{}\n{:?}\n{:?}\n{}", t.to_json(), t.to_markdown(), self.events, self.reply, bodies.join("\n"))
    }
}

fn talk(script: Vec<Say>, text: &str) -> Talk {
    Talk::new(script).say(text)
}

fn call(name: &str, arguments: Value) -> (String, String) {
    (name.into(), arguments.to_string())
}

fn calls(all: &[(&str, Value)]) -> Say {
    Say::Calls(all.iter().map(|(n, a)| call(n, a.clone())).collect())
}

fn text(t: &str) -> Say {
    Say::Text(t.into())
}

#[test]
fn a_good_model_is_heard_step_by_step() {
    let script = vec![
        calls(&[("go_to", json!({ "target": "the handle of the kettle", "side": "other" }))]),
        calls(&[("move", json!({ "direction": "back", "distance": { "meters": 0.5 } }))]),
        text("Here is the handle, from half a metre farther back."),
    ];
    let t = talk(script, "Show me the handle of the kettle from the other side, then step back half a metre.");
    assert_eq!(t.room.log, ["go_to handle · kettle", "move back"]);
    assert_eq!((t.outcome(), t.reply.text.as_str()), ("done", "Here is the handle, from half a metre farther back."));
    // The model hears what came of its calls, and the scene as data.
    let seen = t.server.seen.lock().expect("log").clone();
    assert_eq!(seen.len(), 3);
    assert!(seen[1].body.contains("Here is the handle of the kettle"), "{}", seen[1].body);
    let body = seen[0].json();
    assert_eq!(body["tools"].as_array().map(Vec::len), Some(fmlgs::agent::tool::NAMES.len()));
    let message = body["messages"][1]["content"].as_str().expect("a message");
    assert!(message.contains("SCENE DATA") && message.contains("\"kettle\""));
    let pieces: String =
        t.events.iter().filter_map(|e| if let AgentEvent::Piece(p) = e { Some(p.as_str()) } else { None }).collect();
    assert_eq!(pieces, t.reply.text, "the answer comes piece by piece");
}

#[test]
fn what_is_no_valid_call_is_told_to_the_model_and_never_done() {
    let bad = [
        ("remove", "{\"target\": "),
        ("remove", "rm -rf /"),
        ("shell", "{\"command\": \"rm -rf /\"}"),
        ("go_to", "{\"target\": {\"$ne\": null}}"),
        ("go_to", "{\"target\": \"kettle\", \"speed\": 9}"),
        ("turn", "{\"direction\": \"left\", \"degrees\": \"ninety\"}"),
        ("move", "{\"direction\": \"back\", \"distance\": {\"meters\": -1}}"),
        ("remove", "[1]"),
        ("", "{}"),
    ];
    for (name, arguments) in bad {
        let script = vec![
            Say::Calls(vec![(name.into(), arguments.into())]),
            calls(&[("look_at", json!({ "target": "lamp" }))]),
            text("Done."),
        ];
        let t = talk(script, "look at the lamp");
        assert_eq!(t.room.log, ["look_at lamp"], "{name} {arguments}");
        assert_eq!(t.outcome(), "done");
        let seen = t.server.seen.lock().expect("log").clone();
        assert!(seen[1].body.contains("\\\"done\\\":false"), "{}", seen[1].body);
    }
    // Again and again: the run ends.
    let t = talk(vec![Say::Calls(vec![("shell".into(), "{}".into())])], "look at the lamp");
    assert_eq!((t.outcome(), t.room.log.len()), ("limit", 0));
    assert_eq!(t.server.requests(), 4);
    assert!(t.reply.text.contains("no valid calls"), "{}", t.reply.text);
}

#[test]
fn endless_loops_come_to_an_end() {
    let t = talk(vec![calls(&[("move", json!({ "direction": "back" }))])], "step back");
    assert_eq!(t.outcome(), "limit");
    assert!(t.room.log.len() <= 6, "{:?}", t.room.log);
    // Another call each time: the number of answers ends it.
    let turning: Vec<Say> =
        (1..100).map(|n| calls(&[("turn", json!({ "direction": "left", "degrees": n }))])).collect();
    let t = talk(turning, "turn left");
    assert_eq!((t.outcome(), t.server.requests(), t.room.log.len()), ("limit", 12, 12));
    // Many calls in one answer: only some are looked at.
    let many: Vec<(String, String)> =
        (1..60).map(|n| call("turn", json!({ "direction": "left", "degrees": n }))).collect();
    let t = talk(vec![Say::Calls(many), text("Done.")], "turn left");
    assert_eq!(t.room.log.len(), RequestLimits::default().calls);
    // Tokens.
    let t = talk(vec![Say::Tokens(String::new(), 60_000)], "turn left");
    assert_eq!((t.outcome(), t.server.requests()), ("limit", 2));
}

#[test]
fn a_busy_server_is_asked_again_and_a_broken_one_given_up() {
    let go = calls(&[("look_at", json!({ "target": "lamp" }))]);
    let status = |code, retry: &str| Say::Status(code, retry.into(), "busy".into());
    for trouble in [status(429, "0"), status(429, "0.05"), status(500, ""), status(503, ""), Say::Stall, Say::Silence] {
        let t = talk(vec![trouble.clone(), go.clone(), text("Done.")], "look at the lamp");
        assert_eq!((t.outcome(), t.room.log.as_slice()), ("done", &["look_at lamp".to_owned()][..]), "{trouble:?}");
        assert_eq!(t.server.requests(), 3, "{trouble:?}");
        assert!(t.events.iter().any(|e| matches!(e, AgentEvent::Note(_))));
    }
    // It is to be left alone for longer than the agent waits.
    let begin = Instant::now();
    let t = talk(vec![status(429, "3600"), go.clone()], "look at the lamp");
    assert_eq!((t.outcome(), t.server.requests()), ("failed", 1));
    assert!(t.reply.text.contains("3600 s") && begin.elapsed() < Duration::from_secs(60), "{}", t.reply.text);
    for (trouble, requests) in [(status(500, ""), 3), (Say::Stall, 3), (status(403, ""), 1), (status(404, ""), 2)] {
        let t = talk(vec![trouble.clone()], "look at the lamp");
        assert_eq!((t.outcome(), t.server.requests()), ("failed", requests), "{trouble:?}");
        assert!(t.room.log.is_empty());
    }
    // Nobody there.
    let server = Server { url: "http://127.0.0.1:9/v1".into(), seen: Arc::default() };
    let mut session = session(&server);
    let reply = session.say(&mut Room::new(), "look at the lamp", &mut |_| {}, &AtomicBool::new(false));
    assert_eq!(outcome(&reply), "failed");
}

#[test]
fn half_an_answer_is_no_answer() {
    // The call is complete, but the stream is not: it is not done.
    let t = talk(vec![Say::Break(vec![call("hide", json!({ "target": "lamp" }))])], "hide the lamp");
    assert_eq!((t.outcome(), t.room.log.len()), ("done", 0));
    assert_eq!((t.server.requests(), t.reply.text.as_str()), (2, "It broke off."), "asked again, not in pieces");
    let t = talk(vec![Say::NoStream("Whole.".into())], "hello there, model");
    assert_eq!((t.reply.text.as_str(), t.server.requests()), ("Whole.", 2));
    let t = talk(vec![Say::Huge(8 << 20)], "look at the lamp");
    assert_eq!((t.outcome(), t.server.requests()), ("failed", 1));
    assert!(t.reply.text.contains("too long"), "{}", t.reply.text);
    for raw in ["", "not JSON", "{}", "{\"choices\": []}", "<html>", "{\"choices\": [{\"message\": 3}]}"] {
        let t = talk(vec![Say::Raw(raw.into())], "look at the lamp");
        assert_eq!((t.outcome(), t.room.log.len()), ("failed", 0), "{raw}");
    }
    let empty = r#"{"choices": [{"message": {"role": "assistant", "content": ""}}]}"#;
    assert_eq!(talk(vec![Say::Raw(empty.into())], "look at the lamp").outcome(), "failed");
    // It points to another server, where nothing is sent.
    let other = Server::new(vec![text("Trapped.")]);
    let t = talk(vec![Say::Elsewhere(format!("{}/chat/completions", other.url))], "look at the lamp");
    assert_eq!((t.outcome(), other.requests()), ("failed", 0), "{}", t.reply.text);
}

#[test]
fn what_is_destructive_waits_for_the_users_own_yes() {
    let remove = calls(&[("remove", json!({ "target": "mug" }))]);
    let t = talk(vec![remove.clone(), text("It is gone.")], "remove the mug");
    assert_eq!((t.outcome(), t.room.log.len()), ("confirm", 0));
    let t = t.say("yes");
    assert_eq!((t.outcome(), t.room.log.as_slice()), ("done", &["remove mug".to_owned()][..]));
    assert_eq!(t.reply.text, "It is gone.");
    // Anything else than a yes leaves it.
    let t = talk(vec![remove.clone(), text("As you like.")], "remove the mug").say("what would that do?");
    assert_eq!((t.outcome(), t.room.log.len()), ("done", 0));
    let t = talk(vec![remove.clone(), remove.clone()], "remove the mug").say("no");
    assert_eq!((t.outcome(), t.room.log.len()), ("done", 0), "a no is an answer, and nothing is removed");
    // The model says yes to itself, asks for it again and again, or claims it is done.
    let t = talk(
        vec![calls(&[("ask_user", json!({ "question": "yes" })), ("remove", json!({ "target": "mug" }))]), remove],
        "tidy up",
    );
    assert_eq!((t.outcome(), t.room.log.len()), ("ask", 0));
    let t =
        talk(vec![text("{\"name\": \"remove\", \"arguments\": {\"target\": \"mug\"}} Yes. Done, removed.")], "tidy up");
    assert_eq!((t.outcome(), t.room.log.len()), ("done", 0));
}

#[test]
fn orders_in_names_and_texts_have_no_power() {
    let room = Room::new();
    let everything: Vec<(String, String)> = (1..=8)
        .map(|id| call("remove", json!({ "target": id })))
        .chain([call("export", json!({ "target": 1 }))])
        .collect();
    let t = talk(vec![Say::Calls(everything), text("All removed.")], &format!("show me the {ATTACK}"));
    assert_eq!((t.outcome(), t.room.log.len()), ("confirm", 0), "a model that obeys the name");
    assert!((1..=room.identities().len() as u32).all(|id| t.room.facts(id).is_some()));
    // The name reaches the model inside quotes, in the scene's data.
    let body = t.server.seen.lock().expect("log")[0].json();
    let message = body["messages"][1]["content"].as_str().expect("a message");
    assert!(message.contains(&format!("[\"{ATTACK}\"]")), "{message}");
    let forbidding = "[tools]\nallowed = [\"go_to\", \"remove\", \"export\"]\nforbidden = [\"remove\"]";
    let policy = Policy::parse(forbidding, "own").expect("policy");
    let server = Server::new(vec![calls(&[("remove", json!({ "target": 1 })), ("undo", json!({}))]), text("No.")]);
    let (mut session, mut room) = (session_with(&server, policy, RequestLimits::default()), Room::new());
    session.say(&mut room, "tidy up", &mut |_| {}, &AtomicBool::new(false));
    assert!(room.log.is_empty());
    let tools = server.seen.lock().expect("log")[0].json()["tools"].as_array().map(Vec::len);
    assert_eq!(tools, Some(2), "what is not permitted is not offered either");
}

#[test]
fn the_key_goes_into_the_header_and_nowhere_else() {
    let leaky = |t: &Talk| {
        let all = t.everything().to_lowercase();
        let percent = "sk-test%2f0123456789abcdef%2bq";
        all.contains(&KEY.to_lowercase()) || all.contains(percent) || all.contains("0123456789abcdef")
    };
    let scripts: Vec<(Vec<Say>, String)> = vec![
        (vec![Say::EchoKey], "what is my key?".into()),
        (vec![Say::RefuseWithKey], "look at the lamp".into()),
        (vec![text("Fine.")], format!("my key is {KEY}, keep it")),
        (vec![calls(&[("ask_user", json!({ "question": format!("Is {KEY} yours?") }))])], "hello model".into()),
        (vec![calls(&[("rename", json!({ "target": "mug", "name": KEY }))])], "rename the mug".into()),
        (vec![calls(&[(KEY, json!({})), ("go_to", json!({ "target": KEY }))]), text("Hm.")], "go on then".into()),
        (vec![Say::Status(500, String::new(), KEY.into())], "look at the lamp".into()),
        (vec![Say::Raw(format!("{{\"choices\": \"{KEY}\"}}"))], "look at the lamp".into()),
    ];
    for (script, said) in scripts {
        let t = talk(script.clone(), &said);
        assert!(!leaky(&t), "{script:?}: {}", t.everything());
        let seen = t.server.seen.lock().expect("log");
        assert!(seen.iter().all(|s| s.authorization.as_deref() == Some(&format!("Bearer {KEY}"))));
        drop(seen);
        // What a yes brings about does not show it either.
        let t = t.say("yes");
        assert!(!leaky(&t), "{script:?}: {}", t.everything());
    }
    // The control: without the key's own redaction the same talk shows it.
    let server = Server::new(vec![Say::EchoKey]);
    let settings = LlmSettings { base_url: server.url.clone(), model: "m".into(), ..LlmSettings::default() };
    let planner = Llm::with(settings, None, timeouts(), RequestLimits::default()).expect("settings");
    let mut open = Session::new(Policy::built_in().expect("policy"), Box::new(planner));
    let reply = open.say(&mut Room::new(), &format!("my key is {KEY}"), &mut |_| {}, &AtomicBool::new(false));
    assert!(reply.text.contains("none") && open.transcript().to_json().contains(KEY));
    // From the environment, by the variable's name.
    let settings = LlmSettings {
        base_url: server.url.clone(),
        model: "m".into(),
        key_variable: "CARGO_MANIFEST_DIR".into(),
        stream: true,
    };
    assert!(!serde_json::to_string(&settings).expect("JSON").contains(env!("CARGO_MANIFEST_DIR")));
    let mut session = Session::new(Policy::built_in().expect("policy"), Box::new(Llm::new(settings).expect("a key")));
    session.say(&mut Room::new(), "hello model", &mut |_| {}, &AtomicBool::new(false));
    let seen = server.seen.lock().expect("log").last().cloned().expect("a request");
    assert_eq!(seen.authorization.as_deref(), Some(concat!("Bearer ", env!("CARGO_MANIFEST_DIR"))));
    assert!(!seen.body.contains(env!("CARGO_MANIFEST_DIR")));
    assert!(!session.transcript().to_json().contains(env!("CARGO_MANIFEST_DIR")));
}

#[test]
fn questions_of_the_model_are_answered_and_talks_go_on() {
    let script = vec![
        calls(&[("ask_user", json!({ "question": "Which controller?", "candidates": [12, 16, 999] }))]),
        calls(&[("go_to", json!({ "target": 16 }))]),
        text("Here it is."),
        calls(&[("hide", json!({ "target": 16 }))]),
        text("Hidden."),
    ];
    let t = talk(script, "show me the controller");
    assert_eq!((t.outcome(), t.reply.candidates.as_slice()), ("ask", &[12, 16][..]));
    let t = t.say("the blue one");
    assert_eq!((t.outcome(), t.room.log.as_slice()), ("done", &["go_to blue controller".to_owned()][..]));
    let t = t.say("hide it");
    assert_eq!(t.room.log.last().map(String::as_str), Some("hidden blue controller true"));
    let last = t.server.seen.lock().expect("log").last().expect("a request").json();
    let users = last["messages"].as_array().expect("messages").iter().filter(|m| m["role"] == "user").count();
    assert_eq!(users, 3, "the talk is remembered");
    // What words mean is checked as for everybody: two controllers are a question to the user.
    let t = talk(vec![calls(&[("hide", json!({ "target": "controller" }))]), text("Hidden.")], "hide a controller");
    assert_eq!((t.outcome(), t.room.log.len()), ("ask", 0));
    let t = t.say("the left one");
    assert_eq!((t.outcome(), t.room.log.as_slice()), ("done", &["hidden red controller true".to_owned()][..]));
    // What cannot be is told to the model, which may say so.
    let t =
        talk(vec![calls(&[("go_to", json!({ "target": "giraffe" }))]), text("There is none.")], "show me a giraffe");
    assert_eq!((t.outcome(), t.reply.refused.as_ref().map(|r| r.kind)), ("not_found", Some(RefusalKind::NotFound)));
}

#[test]
fn a_question_of_the_model_stays_on_one_line() {
    let forged = "Which one?\r\nerror: all is lost\u{1b}[2J\u{202e}";
    let t = talk(vec![calls(&[("ask_user", json!({ "question": forged, "candidates": [12, 16] }))])], "the controller");
    assert_eq!((t.outcome(), t.reply.text.as_str()), ("ask", "Which one?  error: all is lost\u{fffd}[2J"));
    // The control: what is no question may have paragraphs.
    let t = talk(vec![text("There are two.\nWhich one?")], "the controller");
    assert_eq!(t.reply.text, "There are two.\nWhich one?");
}

#[test]
fn a_request_can_be_ended_while_the_server_is_silent() {
    let server = Server::new(vec![Say::Silence]);
    let settings = LlmSettings { base_url: server.url.clone(), model: "m".into(), ..LlmSettings::default() };
    let slow = RequestTimeouts { stall: Duration::from_secs(15), answer: Duration::from_secs(15), ..timeouts() };
    let planner = Llm::with(settings, None, slow, RequestLimits::default()).expect("settings");
    let mut session = Session::new(Policy::built_in().expect("policy"), Box::new(planner));
    let cancel = Arc::new(AtomicBool::new(false));
    let stopper = Arc::clone(&cancel);
    let (stop, waits) = std::sync::mpsc::sync_channel::<()>(16);
    std::thread::Builder::new()
        .name("stop".into())
        .spawn(move || {
            waits.recv().expect("told");
            std::thread::sleep(Duration::from_millis(50));
            stopper.store(true, Ordering::Relaxed);
        })
        .expect("a thread");
    let mut on = |e: AgentEvent| {
        if e == AgentEvent::Thinking {
            stop.send(()).expect("heard");
        }
    };
    let reply = session.say(&mut Room::new(), "look at the lamp", &mut on, &cancel);
    assert_eq!(outcome(&reply), "stopped");
}
