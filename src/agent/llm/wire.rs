//! Answers of a chat model, whole or in chunks, as text and tool calls.

use serde_json::{Value, json};

use super::sse::Events;

/// Maximum number of calls in an answer; more make it invalid.
const MOST_CALLS: usize = 64;

/// Call as the model wrote it.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct RawCall {
    pub(crate) id: String,
    pub name: String,
    /// Arguments, in JSON if the model followed the protocol.
    pub arguments: String,
}

/// Answer of a chat model.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ModelReply {
    pub(crate) text: String,
    pub calls: Vec<RawCall>,
    /// Number of tokens, as counted by the server.
    pub(crate) tokens: Option<u64>,
    /// True if the answer is complete.
    pub(crate) is_whole: bool,
}

/// Returns the arguments as JSON text. By the protocol they are a string; some servers send the object itself.
fn arguments(given: &Value) -> String {
    match given {
        Value::String(text) => text.clone(),
        Value::Null => String::new(),
        other => other.to_string(),
    }
}

/// Collects an answer from chunks.
#[derive(Default)]
pub struct ReplyCollector {
    events: Events,
    whole: Vec<u8>,
    answer: ModelReply,
    problem: Option<String>,
}

impl ReplyCollector {
    /// Takes a chunk of a stream or of a whole answer; returns true if no more of the stream is needed.
    pub fn take(&mut self, is_stream: bool, bytes: &[u8]) -> bool {
        if !is_stream {
            self.whole.extend_from_slice(bytes);
            return false;
        }
        for data in self.events.feed(bytes) {
            if self.event(&data) {
                return true;
            }
        }
        self.problem.is_some()
    }

    /// Text so far.
    pub(crate) fn text(&self) -> &str {
        &self.answer.text
    }

    /// Takes the data of one event; returns true if it was the last.
    fn event(&mut self, data: &str) -> bool {
        if data.trim() == "[DONE]" {
            self.answer.is_whole = true;
            return true;
        }
        match serde_json::from_str::<Value>(data) {
            Ok(body) if body.is_object() => self.merge(&body),
            _ => self.problem = Some("a piece of the answer is no JSON".into()),
        }
        false
    }

    /// Adds the contents of a body: a whole answer (`message`) or a chunk (`delta`).
    fn merge(&mut self, body: &Value) {
        if !body["error"].is_null() {
            self.problem = Some("the server reports an error in its answer".into());
        }
        self.answer.tokens = body["usage"]["total_tokens"].as_u64().or(self.answer.tokens);
        let choice = &body["choices"][0];
        self.answer.is_whole |= !choice["finish_reason"].is_null();
        let message = if choice["message"].is_object() { &choice["message"] } else { &choice["delta"] };
        self.answer.text.push_str(message["content"].as_str().unwrap_or_default());
        for (place, call) in message["tool_calls"].as_array().into_iter().flatten().enumerate() {
            let at = call["index"].as_u64().map_or(place, |i| usize::try_from(i).unwrap_or(usize::MAX));
            if at >= MOST_CALLS {
                self.problem = Some("the answer has too many calls".into());
                return;
            }
            if self.answer.calls.len() <= at {
                self.answer.calls.resize(at + 1, RawCall::default());
            }
            let Some(slot) = self.answer.calls.get_mut(at) else { return };
            if let Some(id) = call["id"].as_str().filter(|id| !id.is_empty()) {
                slot.id = id.to_owned();
            }
            slot.arguments.push_str(&arguments(&call["function"]["arguments"]));
            slot.name.push_str(call["function"]["name"].as_str().unwrap_or_default());
        }
    }

    /// Returns the answer.
    ///
    /// # Errors
    /// If the answer is invalid or incomplete, in words for the user.
    pub fn finish(mut self, is_stream: bool) -> Result<ModelReply, String> {
        if is_stream {
            if let Some(rest) = self.events.end() {
                self.event(&rest);
            }
        } else {
            let body: Value =
                serde_json::from_slice(&self.whole).map_err(|_| "the answer is no JSON of a chat model")?;
            if !body["choices"][0].is_object() {
                self.problem = Some("the answer has no choices".into());
            }
            self.merge(&body);
            // Outside a stream some servers send no finish reason: a whole body is complete.
            self.answer.is_whole = true;
        }
        if let Some(problem) = self.problem {
            return Err(problem);
        }
        if !self.answer.is_whole {
            return Err("the answer broke off".into());
        }
        // Gaps in the indices are not calls.
        self.answer.calls.retain(|c| !c.name.is_empty() || !c.arguments.is_empty() || !c.id.is_empty());
        Ok(self.answer)
    }
}

/// Message with the model's own answer, which is sent back to it.
pub(crate) fn assistant(answer: &ModelReply) -> Value {
    let mut message = json!({ "role": "assistant", "content": answer.text });
    if !answer.calls.is_empty() {
        let calls = answer.calls.iter().map(
            |c| json!({ "id": c.id, "type": "function", "function": { "name": c.name, "arguments": c.arguments } }),
        );
        message["tool_calls"] = calls.collect();
    }
    message
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stream(events: &[&str]) -> Result<ModelReply, String> {
        let mut collector = ReplyCollector::default();
        for event in events {
            collector.take(true, format!("data: {event}\n\n").as_bytes());
        }
        collector.finish(true)
    }

    #[test]
    fn calls_come_together_from_pieces() {
        let answer = stream(&[
            r#"{"choices":[{"delta":{"role":"assistant","content":"On "}}]}"#,
            r#"{"choices":[{"delta":{"content":"it."}}]}"#,
            r#"{"choices":[{"delta":{"tool_calls":[{"index":0,"id":"a","function":{"name":"go_to","arguments":"{\"tar"}}]}}]}"#,
            r#"{"choices":[{"delta":{"tool_calls":[{"index":0,"function":{"arguments":"get\":1}"}}]}}]}"#,
            r#"{"choices":[{"delta":{},"finish_reason":"tool_calls"}],"usage":{"total_tokens":7}}"#,
            "[DONE]",
        ]);
        let call = RawCall { id: "a".into(), name: "go_to".into(), arguments: r#"{"target":1}"#.into() };
        let wanted = ModelReply { text: "On it.".into(), calls: vec![call], tokens: Some(7), is_whole: true };
        assert_eq!(answer, Ok(wanted));
    }

    #[test]
    fn what_breaks_off_is_no_answer() {
        assert!(stream(&[r#"{"choices":[{"delta":{"content":"On "}}]}"#]).is_err());
        assert!(stream(&["{\"choices\":", "[DONE]"]).is_err());
        assert!(stream(&[r#"{"error":{"message":"x"}}"#, "[DONE]"]).is_err());
        assert!(stream(&[r#"{"choices":[{"delta":{"tool_calls":[{"index":999999999}]}}]}"#, "[DONE]"]).is_err());
        let whole = |text: &str| {
            let mut collector = ReplyCollector::default();
            collector.take(false, text.as_bytes());
            collector.finish(false)
        };
        assert!(whole("{").is_err() && whole("{}").is_err() && whole("[]").is_err());
        let object = r#"{"choices":[{"message":{"content":null,"tool_calls":[{"id":"b","function":{"name":"undo","arguments":{}}}]}}]}"#;
        let answer = whole(object).expect("an answer");
        assert_eq!((answer.text.as_str(), answer.calls[0].arguments.as_str()), ("", "{}"));
    }
}
