//! Discovery of chat model servers on this machine, by their usual ports, and a test of the connection to one. Both
//! run only at the user's request; nothing of the scene is sent.

use std::sync::atomic::AtomicBool;
use std::time::Duration;

use serde_json::{Value, json};

use super::http::{Broken, Head, exchange};
use super::settings::{LlmSettings, RequestTimeouts};
use super::wire::ReplyCollector;

/// Common servers and their ports.
pub(crate) const PORTS: [(&str, u16); 4] =
    [("Ollama", 11434), ("llama.cpp", 8080), ("LM Studio", 1234), ("vLLM", 8000)];
/// Largest list of models that is read, in bytes.
const MAX_LIST_BYTES: usize = 1 << 20;

/// Server that answers.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LocalServer {
    pub kind: &'static str,
    pub base_url: String,
    pub models: Vec<String>,
}

/// Finds the servers that answer on these ports of this machine.
pub fn find(ports: &[(&'static str, u16)], cancel: &AtomicBool) -> Vec<LocalServer> {
    let timeouts =
        RequestTimeouts { stall: Duration::from_secs(1), answer: Duration::from_secs(2), ..RequestTimeouts::default() };
    let ask = |(kind, port): (&'static str, u16)| {
        let base_url = format!("http://127.0.0.1:{port}/v1");
        let settings = LlmSettings { base_url: base_url.clone(), ..LlmSettings::default() };
        let models = models(&settings, &timeouts, cancel).ok()?;
        Some(LocalServer { kind, base_url, models })
    };
    std::thread::scope(|scope| {
        let asked: Vec<_> = ports.iter().map(|port| scope.spawn(move || ask(*port))).collect();
        asked.into_iter().filter_map(|thread| thread.join().ok().flatten()).collect()
    })
}

/// Reads the names of a server's models.
fn models(settings: &LlmSettings, timeouts: &RequestTimeouts, cancel: &AtomicBool) -> Result<Vec<String>, Broken> {
    let url = format!("{}/models", settings.base_url.trim().trim_end_matches('/'));
    let key = settings.key().ok().flatten();
    let mut bytes = Vec::new();
    exchange(&url, key.as_ref(), None, timeouts, MAX_LIST_BYTES, cancel, &mut |_, piece| {
        bytes.extend_from_slice(piece);
        false
    })?;
    let list: Value = serde_json::from_slice(&bytes).unwrap_or_default();
    let list = list["data"].as_array().ok_or_else(|| Broken::Connection("it has no list of models".into()))?;
    let name = |model: &Value| model["id"].as_str().map(|id| id.chars().take(200).collect());
    Ok(list.iter().filter_map(name).collect())
}

/// Tests that the model of the settings answers and accepts tools. Returns a text for display.
///
/// # Errors
/// Describes the problem and its remedy.
pub fn test(settings: &LlmSettings, timeouts: &RequestTimeouts, cancel: &AtomicBool) -> Result<String, String> {
    let key = settings.key().map_err(|e| e.to_string())?;
    let clean = |text: &str| key.as_ref().map_or_else(|| text.to_owned(), |k| k.redact(text));
    let url = settings.endpoint(key.is_some()).map_err(|e| e.to_string())?;
    match models(settings, timeouts, cancel) {
        Ok(list) if !list.contains(&settings.model) => {
            let known = if list.is_empty() { "none".into() } else { list.join(", ") };
            return Err(clean(&format!("the server has no model '{}'; it has: {known}", settings.model)));
        }
        // Not every server lists its models.
        Ok(_) | Err(Broken::Status { code: 404 | 405, .. }) => {}
        Err(broken) => return Err(clean(&problem(settings, &broken))),
    }
    let body = json!({
        "model": settings.model,
        "messages": [{ "role": "user", "content": "Answer with the word OK." }],
        "tools": crate::agent::schema::tools().into_iter().filter(|t| t["function"]["name"] == "undo").collect::<Vec<_>>(),
        "stream": false
    });
    let mut collector = ReplyCollector::default();
    let mut take = |_: &Head, piece: &[u8]| collector.take(false, piece);
    exchange(&url, key.as_ref(), Some(body.to_string()), timeouts, MAX_LIST_BYTES, cancel, &mut take)
        .map_err(|broken| clean(&problem(settings, &broken)))?;
    collector.finish(false).map_err(|e| format!("the model was asked, but {e}"))?;
    Ok(format!("{} answers at {}.", settings.model, settings.base_url))
}

fn problem(settings: &LlmSettings, broken: &Broken) -> String {
    let at = &settings.base_url;
    match broken {
        Broken::Connection(why) => format!("nothing answers at {at} ({why}): start the server, or change the address"),
        Broken::Stall => format!("{at} accepted the question and said nothing; a large model may still be loading"),
        Broken::TooLong => format!("{at} sends more than an answer: it is no chat server"),
        Broken::Cancelled => "stopped".into(),
        Broken::Status { code: 401 | 403, .. } => {
            format!("{at} wants a key: name the environment variable that holds it")
        }
        Broken::Status { code: 404, .. } => format!("{at} is no chat server's address: it mostly ends in /v1"),
        Broken::Status { code, body, .. } => {
            let said: String = crate::scene::text::line(body).chars().take(200).collect();
            format!("{at} answered {code}: {said}")
        }
    }
}
