//! A chat model's server on this machine that replies as a test wants, well or badly.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use serde_json::{Value, json};

/// Response of the server to one request.
#[derive(Clone, Debug)]
pub enum Say {
    /// These calls: a tool's name and its arguments, as written.
    Calls(Vec<(String, String)>),
    /// A text.
    Text(String),
    /// A text with this many tokens in its account.
    Tokens(String, u64),
    /// A status, a Retry-After if it is not empty, and a body.
    Status(u16, String, String),
    /// Nothing, after the head.
    Stall,
    /// Nothing at all.
    Silence,
    /// Calls whose stream ends before its end is told.
    Break(Vec<(String, String)>),
    /// So many bytes.
    Huge(usize),
    /// A body that is not what was asked for.
    Raw(String),
    /// A text with the key that came in the header, in pieces of three letters.
    EchoKey,
    /// Status 401 with the key in its body.
    RefuseWithKey,
    /// 400 if a stream was asked for, else the text.
    NoStream(String),
    /// Streams the text, whole, though nothing of the kind was asked for.
    Elsewhere(String),
}

/// A request that came.
#[derive(Clone, Debug)]
pub struct Seen {
    /// The request's line and its headers, as they came.
    pub head: Vec<String>,
    pub authorization: Option<String>,
    pub body: String,
}

impl Seen {
    pub fn json(&self) -> Value {
        serde_json::from_str(&self.body).expect("a JSON request")
    }
}

pub struct Server {
    pub url: String,
    pub seen: Arc<Mutex<Vec<Seen>>>,
}

impl Server {
    /// Says `script` one after another, the last again and again.
    pub fn new(script: Vec<Say>) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
        let url = format!("http://{}/v1", listener.local_addr().expect("bound"));
        let seen: Arc<Mutex<Vec<Seen>>> = Arc::default();
        let log = Arc::clone(&seen);
        std::thread::spawn(move || {
            for (n, stream) in listener.incoming().enumerate() {
                let Ok(mut stream) = stream else { return };
                let say = script[n.min(script.len() - 1)].clone();
                let log = Arc::clone(&log);
                std::thread::spawn(move || {
                    // Whoever asked may have gone.
                    let _ = answer(&mut stream, &say, n, &log);
                });
            }
        });
        Self { url, seen }
    }

    pub fn requests(&self) -> usize {
        self.seen.lock().expect("log").len()
    }

    /// Returns whether every call that went back to the model has its one result, in order.
    pub fn is_well_formed(&self) -> bool {
        self.seen.lock().expect("log").iter().all(|seen| {
            let body = seen.json();
            let messages = body["messages"].as_array().expect("messages").clone();
            let mut open: Vec<String> = Vec::new();
            let mut sound = messages.first().is_some_and(|m| m["role"] == "system");
            for message in messages {
                if message["role"] == "tool" {
                    let id = message["tool_call_id"].as_str().expect("an id").to_owned();
                    let at = open.iter().position(|o| *o == id);
                    sound &= at.is_some();
                    at.map(|at| open.remove(at));
                    continue;
                }
                sound &= open.is_empty();
                let calls = message["tool_calls"].as_array().cloned().unwrap_or_default();
                open.extend(calls.iter().map(|c| c["id"].as_str().expect("an id").to_owned()));
            }
            sound && open.is_empty()
        })
    }
}

fn answer(stream: &mut TcpStream, say: &Say, n: usize, log: &Mutex<Vec<Seen>>) -> std::io::Result<()> {
    let mut reader = BufReader::new(stream.try_clone()?);
    let (mut head, mut authorization, mut length) = (Vec::new(), None, 0);
    loop {
        let mut line = String::new();
        if reader.read_line(&mut line)? == 0 {
            return Ok(());
        }
        let line = line.trim_end();
        if line.is_empty() {
            break;
        }
        head.push(line.to_owned());
        if let Some((name, value)) = line.split_once(": ") {
            match name.to_ascii_lowercase().as_str() {
                "authorization" => authorization = Some(value.to_owned()),
                "content-length" => length = value.parse().unwrap_or(0),
                _ => {}
            }
        }
    }
    let mut body = vec![0; length];
    reader.read_exact(&mut body)?;
    let body = String::from_utf8_lossy(&body).into_owned();
    let wants_stream = serde_json::from_str::<Value>(&body).is_ok_and(|b| b["stream"] == true);
    let key = authorization.as_deref().and_then(|a| a.strip_prefix("Bearer ")).unwrap_or("none").to_owned();
    log.lock().expect("log").push(Seen { head, authorization, body });
    let head = |status: u16, kind: &str, more: &str| {
        format!("HTTP/1.1 {status} X\r\nContent-Type: {kind}\r\n{more}Connection: close\r\n\r\n")
    };
    let events = head(200, "text/event-stream", "");
    match say {
        Say::Calls(calls) => tell(stream, wants_stream, "", calls, n, 7, true),
        Say::Text(text) => tell(stream, wants_stream, text, &[], n, 7, true),
        Say::Tokens(text, tokens) => {
            let calls = [("turn".to_owned(), format!(r#"{{"direction":"left","degrees":{}}}"#, n + 1))];
            let calls = if text.is_empty() { &calls[..] } else { &[] };
            tell(stream, wants_stream, text, calls, n, *tokens, true)
        }
        Say::Status(code, retry, body) => {
            let retry = if retry.is_empty() { String::new() } else { format!("Retry-After: {retry}\r\n") };
            stream.write_all(format!("{}{body}", head(*code, "text/plain", &retry)).as_bytes())
        }
        Say::Stall => {
            stream.write_all(events.as_bytes())?;
            std::thread::sleep(Duration::from_secs(20));
            Ok(())
        }
        Say::Silence => {
            std::thread::sleep(Duration::from_secs(20));
            Ok(())
        }
        Say::Break(calls) if wants_stream => tell(stream, true, "", calls, n, 7, false),
        Say::Break(_) => tell(stream, false, "It broke off.", &[], n, 7, true),
        Say::Huge(bytes) => {
            stream.write_all(events.as_bytes())?;
            let piece = format!("data: {}\n\n", json!({ "choices": [{ "delta": { "content": "x".repeat(4000) } }] }));
            for _ in 0..bytes / 4000 {
                stream.write_all(piece.as_bytes())?;
            }
            Ok(())
        }
        Say::Raw(text) => stream.write_all(format!("{}{text}", head(200, "application/json", "")).as_bytes()),
        Say::EchoKey => tell(stream, wants_stream, &format!("Your key is {key}, is it not?"), &[], n, 7, true),
        Say::RefuseWithKey => {
            let text = format!("{}{{\"error\":\"bad key {key}\"}}", head(401, "application/json", ""));
            stream.write_all(text.as_bytes())
        }
        Say::NoStream(_) if wants_stream => {
            stream.write_all(format!("{}no streaming here", head(400, "text/plain", "")).as_bytes())
        }
        Say::NoStream(text) => tell(stream, false, text, &[], n, 7, true),
        Say::Elsewhere(url) => {
            stream.write_all(head(307, "text/plain", &format!("Location: {url}\r\nContent-Length: 0\r\n")).as_bytes())
        }
    }
}

/// An answer as a stream of small pieces, or whole.
fn tell(
    stream: &mut TcpStream,
    as_stream: bool,
    text: &str,
    calls: &[(String, String)],
    n: usize,
    tokens: u64,
    ends: bool,
) -> std::io::Result<()> {
    let kind = if as_stream { "text/event-stream" } else { "application/json" };
    stream.write_all(format!("HTTP/1.1 200 OK\r\nContent-Type: {kind}\r\nConnection: close\r\n\r\n").as_bytes())?;
    let id = |i: usize| format!("call-{n}-{i}");
    if !as_stream {
        let calls: Vec<Value> = calls
            .iter()
            .enumerate()
            .map(|(i, (name, arguments))| {
                json!({ "id": id(i), "type": "function", "function": { "name": name, "arguments": arguments } })
            })
            .collect();
        let body = json!({
            "choices": [{ "message": { "role": "assistant", "content": text, "tool_calls": calls }, "finish_reason": "stop" }],
            "usage": { "total_tokens": tokens }
        });
        return stream.write_all(body.to_string().as_bytes());
    }
    let mut send = |event: Value| stream.write_all(format!("data: {event}\n\n").as_bytes());
    let letters: Vec<char> = text.chars().collect();
    for piece in letters.chunks(3) {
        let piece: String = piece.iter().collect();
        send(json!({ "choices": [{ "delta": { "content": piece } }] }))?;
    }
    for (i, (name, arguments)) in calls.iter().enumerate() {
        send(json!({ "choices": [{ "delta": { "tool_calls": [
            { "index": i, "id": id(i), "type": "function", "function": { "name": name, "arguments": "" } }] } }] }))?;
        let letters: Vec<char> = arguments.chars().collect();
        for piece in letters.chunks(5) {
            let piece: String = piece.iter().collect();
            send(json!({ "choices": [{ "delta": { "tool_calls": [
                { "index": i, "function": { "arguments": piece } }] } }] }))?;
        }
    }
    if ends {
        send(json!({ "choices": [{ "delta": {}, "finish_reason": "stop" }], "usage": { "total_tokens": tokens } }))?;
        stream.write_all(b"data: [DONE]\n\n")?;
    }
    Ok(())
}
