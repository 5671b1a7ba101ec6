//! Messages of JSON-RPC 2.0 on lines of bounded length.

use std::io::{self, BufRead, Read};

use serde_json::{Value, json};

use crate::scene::text;

/// Longest message, in bytes.
pub const MAX_BYTES: usize = 1 << 20;
/// Longest text of an error, in characters: it may quote what came.
pub(super) const LONGEST_ERROR: usize = 500;

/// Codes of errors, as JSON-RPC and the protocol number them.
pub(super) mod code {
    pub(in crate::agent::mcp) const PARSE: i32 = -32700;
    pub(in crate::agent::mcp) const INVALID_REQUEST: i32 = -32600;
    pub(in crate::agent::mcp) const UNKNOWN_METHOD: i32 = -32601;
    pub(in crate::agent::mcp) const INVALID_PARAMS: i32 = -32602;
    pub(in crate::agent::mcp) const UNSUPPORTED_VERSION: i32 = -32022;
}

/// Error that answers a request.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct RpcError {
    code: i32,
    message: String,
    data: Value,
}

impl RpcError {
    pub(super) fn new(code: i32, message: &str) -> Self {
        Self { code, message: brief(message), data: Value::Null }
    }

    pub(super) fn with_data(self, data: Value) -> Self {
        Self { data, ..self }
    }

    pub(super) fn message(&self) -> &str {
        &self.message
    }
}

/// Returns an error's text on one line of bounded length.
pub(super) fn brief(text: &str) -> String {
    text::shortened(&text::line(text), LONGEST_ERROR).into_owned()
}

/// Message from the client.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Incoming {
    Request {
        id: Value,
        method: String,
        params: Value,
    },
    Notification {
        method: String,
        params: Value,
    },
    /// An answer, although nothing was asked.
    Answer,
}

/// Reads one line of at most [`MAX_BYTES`], or one byte more if it is longer; the rest of such a line is skipped.
/// `None` at the end.
///
/// # Errors
/// If the input cannot be read.
pub fn next_line<R: BufRead>(input: &mut R) -> io::Result<Option<Vec<u8>>> {
    let mut line = Vec::new();
    if input.by_ref().take(MAX_BYTES as u64 + 1).read_until(b'\n', &mut line)? == 0 {
        return Ok(None);
    }
    if line.last() == Some(&b'\n') {
        line.pop();
    } else if line.len() > MAX_BYTES {
        input.skip_until(b'\n')?;
    }
    Ok(Some(line))
}

/// Reads a message. The error comes with the id of its request, which is null if it is not known.
pub(super) fn read(line: &[u8]) -> Result<Incoming, (Value, RpcError)> {
    let invalid = |id: Value, text: &str| Err((id, RpcError::new(code::INVALID_REQUEST, text)));
    if line.len() > MAX_BYTES {
        return invalid(Value::Null, &format!("the message is longer than {MAX_BYTES} bytes, so it was not read"));
    }
    let mut fields = match serde_json::from_slice(line) {
        Ok(Value::Object(fields)) => fields,
        Ok(Value::Array(_)) => {
            return invalid(Value::Null, "batches are not taken: write each message on a line of its own");
        }
        Ok(_) => return invalid(Value::Null, "a message is a JSON object"),
        Err(e) => {
            let text = format!("the line is no JSON in UTF-8 ({e}); a message stands on one line");
            return Err((Value::Null, RpcError::new(code::PARSE, &text)));
        }
    };
    let id = match fields.remove("id") {
        Some(id) if id.is_string() || id.is_i64() || id.is_u64() => Some(id),
        None => None,
        Some(_) => return invalid(Value::Null, "'id' must be a text or an integer"),
    };
    let known_id = id.clone().unwrap_or_default();
    if fields.get("jsonrpc").and_then(Value::as_str) != Some("2.0") {
        return invalid(known_id, "'jsonrpc' must be \"2.0\"");
    }
    let method = match fields.remove("method") {
        Some(Value::String(method)) => method,
        None if fields.contains_key("result") || fields.contains_key("error") => return Ok(Incoming::Answer),
        _ => return invalid(known_id, "'method' must be a text"),
    };
    let params = fields.remove("params").unwrap_or_else(|| json!({}));
    Ok(match id {
        None => Incoming::Notification { method, params },
        Some(id) if params.is_object() => Incoming::Request { id, method, params },
        Some(id) => return Err((id, RpcError::new(code::INVALID_PARAMS, "'params' must be an object"))),
    })
}

/// Formats the answer to a request on one line.
pub(super) fn response(id: &Value, result: Result<Value, RpcError>) -> String {
    let answer = match result {
        Ok(result) => json!({ "jsonrpc": "2.0", "id": id, "result": result }),
        Err(RpcError { code, message, data: Value::Null }) => {
            json!({ "jsonrpc": "2.0", "id": id, "error": { "code": code, "message": message } })
        }
        Err(RpcError { code, message, data }) => {
            json!({ "jsonrpc": "2.0", "id": id, "error": { "code": code, "message": message, "data": data } })
        }
    };
    answer.to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_bounded_and_the_next_one_is_read() {
        let long = "x".repeat(3 * MAX_BYTES);
        let whole = "y".repeat(MAX_BYTES);
        let text = format!("a\n\n{long}\n{whole}\nlast");
        let mut input = text.as_bytes();
        let mut lengths = Vec::new();
        while let Some(line) = next_line(&mut input).expect("memory is read") {
            lengths.push(line.len());
        }
        assert_eq!(lengths, [1, 0, MAX_BYTES + 1, MAX_BYTES, 4]);
        assert!(read(&vec![b' '; MAX_BYTES + 1]).expect_err("too long").1.message.contains("longer than"));
    }

    #[test]
    fn what_is_no_message_is_told_so_with_its_id() {
        let refused = |line: &str| read(line.as_bytes()).expect_err(line);
        let code = |line: &str| refused(line).1.code;
        let deep = format!("{}{}", "[".repeat(10_000), "]".repeat(10_000));
        for broken in ["{", "nonsense", "", "{\"a\": NaN}", "{\"a\": 1e999}", "{} {}", deep.as_str()] {
            assert_eq!(code(broken), code::PARSE, "{broken}");
        }
        assert_eq!(read(b"{\"a\": \"\xff\"}").expect_err("bytes").1.code, code::PARSE);
        for invalid in ["[]", "[{}]", "3", "{}", r#"{"jsonrpc":"2.0","id":null,"method":"ping"}"#] {
            assert_eq!((refused(invalid).0, code(invalid)), (Value::Null, code::INVALID_REQUEST), "{invalid}");
        }
        for invalid in [r#"{"id":7,"method":"ping"}"#, r#"{"jsonrpc":"2.0","id":7,"method":[]}"#] {
            assert_eq!((refused(invalid).0, code(invalid)), (json!(7), code::INVALID_REQUEST), "{invalid}");
        }
        let params = refused(r#"{"jsonrpc":"2.0","id":7,"method":"ping","params":[1]}"#);
        assert_eq!((params.0, params.1.code), (json!(7), code::INVALID_PARAMS));
        // The control: a request, a notification and an answer.
        let request = read(br#"{"jsonrpc":"2.0","id":"a","method":"ping"}"#);
        assert_eq!(request, Ok(Incoming::Request { id: json!("a"), method: "ping".into(), params: json!({}) }));
        let told = read(br#"{"jsonrpc":"2.0","method":"m","params":{"b":1}}"#);
        assert_eq!(told, Ok(Incoming::Notification { method: "m".into(), params: json!({ "b": 1 }) }));
        assert_eq!(read(br#"{"jsonrpc":"2.0","id":3,"result":{}}"#), Ok(Incoming::Answer));
    }

    #[test]
    fn an_answer_is_one_line_and_an_error_is_bounded() {
        let error = RpcError::new(code::INVALID_PARAMS, &format!("a\nb\u{1b}{}", "x".repeat(9_000)));
        let line = response(&json!("i\nd"), Err(error));
        assert!(!line.contains('\n') && line.len() < 2_000, "{line}");
        let answer: Value = serde_json::from_str(&line).expect("JSON");
        assert_eq!((&answer["id"], &answer["error"]["code"]), (&json!("i\nd"), &json!(-32602)));
        assert!(!answer["error"]["message"].as_str().expect("a text").contains('\u{1b}'));
    }
}
