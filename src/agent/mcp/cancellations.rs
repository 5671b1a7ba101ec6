//! Requests that the client takes back. The thread that reads hears of them while another one works.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

use serde_json::Value;

use super::message::{Incoming, read};

/// Notification that takes a request back.
pub(super) const CANCELED: &str = "notifications/cancelled";
/// Maximum number of waiting requests that are taken back at a time; more are carried out.
const MOST: usize = 1024;

/// Requests that were taken back before they were answered.
#[derive(Debug, Default)]
pub struct Cancellations {
    /// Set while the running request is to end.
    flag: AtomicBool,
    ids: Mutex<RequestIds>,
}

#[derive(Debug, Default)]
struct RequestIds {
    running: Option<Value>,
    taken_back: Vec<Value>,
}

impl Cancellations {
    /// Looks at a line as soon as it is read, before [`super::McpServer::handle`] gets to it.
    pub fn hear(&self, line: &[u8]) {
        // Most lines take nothing back, and are not parsed twice.
        if !line.windows(9).any(|part| part == b"cancelled") {
            return;
        }
        let Ok(Incoming::Notification { method, params }) = read(line) else { return };
        let id = &params["requestId"];
        if method != CANCELED || id.is_null() {
            return;
        }
        let mut ids = self.lock();
        if ids.running.as_ref() == Some(id) {
            self.flag.store(true, Ordering::Relaxed);
        } else if ids.taken_back.len() < MOST {
            ids.taken_back.push(id.clone());
        }
    }

    /// Flag that ends the running request.
    pub(super) fn flag(&self) -> &AtomicBool {
        &self.flag
    }

    /// Begins a request; false if it was taken back.
    pub(super) fn begin(&self, id: &Value) -> bool {
        let mut ids = self.lock();
        let is_wanted = !ids.taken_back.contains(id);
        ids.running = Some(id.clone()).filter(|_| is_wanted);
        self.flag.store(false, Ordering::Relaxed);
        is_wanted
    }

    /// Ends the running request; true if it was taken back meanwhile.
    pub(super) fn end(&self) -> bool {
        self.lock().running = None;
        self.flag.swap(false, Ordering::Relaxed)
    }

    /// Forgets a request, since all those before its notification are done.
    pub(super) fn forget(&self, id: &Value) {
        self.lock().taken_back.retain(|other| other != id);
    }

    fn lock(&self) -> MutexGuard<'_, RequestIds> {
        self.ids.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    fn heard(all: &Cancellations, id: &Value) {
        let line = json!({ "jsonrpc": "2.0", "method": CANCELED, "params": { "requestId": id } });
        all.hear(line.to_string().as_bytes());
    }

    #[test]
    fn a_request_is_taken_back_while_it_waits_or_runs_and_no_other_is() {
        let all = Cancellations::default();
        heard(&all, &json!(2));
        assert!(all.begin(&json!(1)) && !all.flag().load(Ordering::Relaxed));
        heard(&all, &json!("1"));
        assert!(!all.end(), "a text is no number");
        assert!(!all.begin(&json!(2)));
        assert!(!all.end());
        all.forget(&json!(2));
        assert!(all.begin(&json!(2)), "it is another one");
        heard(&all, &json!(2));
        assert!(all.flag().load(Ordering::Relaxed) && all.end() && !all.flag().load(Ordering::Relaxed));
        // The control: other notifications, requests and nonsense take nothing back.
        for line in ["{\"cancelled\"", r#"{"jsonrpc":"2.0","id":3,"method":"notifications/cancelled"}"#] {
            all.hear(line.as_bytes());
        }
        heard(&all, &Value::Null);
        assert!(all.begin(&Value::Null) && all.begin(&json!(3)));
    }
}
