//! Settings of a chat model: its address, time limits and limits of a request.

use std::time::Duration;

use serde::{Deserialize, Serialize};
use ureq::http::Uri;

use super::secret::Secret;
use crate::io::http::is_loopback;

/// Settings of a chat model behind an OpenAI-compatible address. They never hold the key itself, only the name of its
/// environment variable.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LlmSettings {
    /// Address up to and with the version, such as `http://127.0.0.1:11434/v1`.
    pub base_url: String,
    pub model: String,
    /// Name of the environment variable that holds the key; empty if none is needed.
    pub key_variable: String,
    /// True if answers are streamed.
    pub stream: bool,
}

impl Default for LlmSettings {
    fn default() -> Self {
        Self { base_url: String::new(), model: String::new(), key_variable: String::new(), stream: true }
    }
}

/// Time limits and number of attempts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RequestTimeouts {
    /// Longest silence of the server.
    pub stall: Duration,
    pub answer: Duration,
    /// Longest time for all answers to one request together.
    pub request: Duration,
    pub attempts: u32,
    /// Wait before the second attempt; doubled before each further one, with random jitter.
    pub pause: Duration,
    /// Longest wait, also if the server asks for one.
    pub longest_pause: Duration,
}

impl Default for RequestTimeouts {
    fn default() -> Self {
        Self {
            stall: Duration::from_secs(45),
            answer: Duration::from_secs(120),
            request: Duration::from_secs(300),
            attempts: 4,
            pause: Duration::from_secs(1),
            longest_pause: Duration::from_secs(30),
        }
    }
}

/// Limits of one request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RequestLimits {
    pub(crate) answers: u32,
    /// Maximum number of calls per answer; further ones are ignored.
    pub calls: usize,
    /// Maximum number of invalid calls: unknown tools, wrong arguments, too many repeats.
    pub(crate) wrong: u32,
    /// Maximum number of tokens, as counted by the server, else estimated as a quarter of the bytes.
    pub(crate) tokens: u64,
    pub(crate) bytes: usize,
}

impl Default for RequestLimits {
    fn default() -> Self {
        Self { answers: 12, calls: 8, wrong: 3, tokens: 100_000, bytes: 1 << 20 }
    }
}

/// Reason for which a chat model cannot be used.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum LlmError {
    /// The address is missing or not supported.
    #[error("'{0}' is no address of a chat model; it should look like https://host/v1")]
    Address(String),
    /// The name of the model is missing.
    #[error("no model is named: set the name that the server gives it")]
    NoModel,
    /// The variable is not set, or its value is not a valid key.
    #[error("the environment variable '{0}' holds no key; set it, or leave its name empty if the server needs none")]
    NoKey(String),
    /// The key would be sent without encryption.
    #[error("the key would be sent to {0} without encryption; use https, or a server on this machine")]
    Unencrypted(String),
}

impl LlmSettings {
    /// Reads the key from the environment variable; `None` if no variable is named.
    ///
    /// # Errors
    /// If the variable is not set or its value is not a valid key.
    pub(crate) fn key(&self) -> Result<Option<Secret>, LlmError> {
        if self.key_variable.is_empty() {
            return Ok(None);
        }
        let held = std::env::var(&self.key_variable).ok().and_then(|key| Secret::new(&key));
        held.map(Some).ok_or_else(|| LlmError::NoKey(self.key_variable.clone()))
    }

    /// Returns the address of requests.
    ///
    /// # Errors
    /// If the base address is invalid, no model is named, or a key would be sent without encryption.
    pub(crate) fn endpoint(&self, has_key: bool) -> Result<String, LlmError> {
        let base = self.base_url.trim().trim_end_matches('/');
        let wrong = || LlmError::Address(base.chars().take(200).collect());
        let uri: Uri = base.parse().map_err(|_| wrong())?;
        let host = uri.host().filter(|h| !h.is_empty()).ok_or_else(wrong)?;
        // A name and password in an address would end up in logs.
        if uri.authority().is_none_or(|a| a.as_str().contains('@')) || base.contains(['?', '#']) {
            return Err(LlmError::Address(format!("{host} (with a name, password, question mark or number sign)")));
        }
        let is_local = is_loopback(host);
        match uri.scheme_str() {
            Some("https") => {}
            Some("http") if is_local || !has_key => {}
            Some("http") => return Err(LlmError::Unencrypted(host.to_owned())),
            _ => return Err(wrong()),
        }
        if self.model.trim().is_empty() {
            return Err(LlmError::NoModel);
        }
        Ok(format!("{base}/chat/completions"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses_are_checked_before_anything_is_sent() {
        let at = |url: &str, has_key| {
            let settings = LlmSettings { base_url: url.into(), model: "m".into(), ..LlmSettings::default() };
            settings.endpoint(has_key)
        };
        assert_eq!(at("https://host/v1/", true).as_deref(), Ok("https://host/v1/chat/completions"));
        assert_eq!(at("http://127.0.0.1:80/v1", true).as_deref(), Ok("http://127.0.0.1:80/v1/chat/completions"));
        assert!(at("http://host/v1", false).is_ok());
        assert_eq!(at("http://LOCALHOST:1/v1", true).as_deref(), Ok("http://LOCALHOST:1/v1/chat/completions"));
        // The key is never sent without encryption, even to a host name that looks like a loopback address.
        for host in ["host", "127.evil.example", "127.0.0.1.evil.example", "localhost.evil.example", "2130706433"] {
            assert_eq!(at(&format!("http://{host}/v1"), true), Err(LlmError::Unencrypted(host.into())));
            assert!(at(&format!("http://{host}/v1"), false).is_ok(), "the control: without a key it may");
        }
        for bad in [
            "",
            "host",
            "ftp://host",
            "https://",
            "file:///etc/passwd",
            "https://me:secret@host/v1",
            "https://h/v1?key=1",
            "https://h/v1#x",
            "http://127.0.0.1@evil.example/v1",
            "http://127.0.0.1#@evil.example/v1",
        ] {
            let error = at(bad, false).expect_err(bad);
            assert!(matches!(error, LlmError::Address(_)) && !error.to_string().contains("secret"), "{bad}: {error}");
        }
        let none = LlmSettings { base_url: "https://h".into(), ..LlmSettings::default() };
        assert_eq!(none.endpoint(false), Err(LlmError::NoModel));
        let unset = LlmSettings { key_variable: "FMLGS_NO_SUCH_VARIABLE".into(), ..LlmSettings::default() };
        assert!(matches!(unset.key(), Err(LlmError::NoKey(_))));
        assert!(LlmSettings::default().key().is_ok_and(|k| k.is_none()));
    }
}
