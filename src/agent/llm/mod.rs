//! Planner that asks a chat model behind an OpenAI-compatible address, used only if the user chose it. The text of
//! the model is never executed: only its valid tool calls reach the session, which checks them as for every planner.
//! The key is sent in one header only.
//!
//! [`SENT`] lists everything that is sent; docs/guide.md has the same list. Texts that may name local files
//! ([`CallOutcome::is_private`]) are not sent. The key goes to `https` and loopback addresses only.

pub mod discover;
pub(crate) mod http;
mod prompt;
pub mod secret;
pub mod settings;
pub(crate) mod sse;
pub mod wire;

pub use prompt::SENT;

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use serde_json::{Value, json};

use self::http::{Broken, exchange, wait};
use self::secret::Secret;
use self::settings::{LlmError, LlmSettings, RequestLimits, RequestTimeouts};
use self::wire::{ModelReply, RawCall, ReplyCollector, assistant};
use super::event::AgentEvent;
use super::execute::CallOutcome;
use super::planner::{Planner, PlannerContext, Step};
use super::refusal::{Refusal, RefusalKind};
use super::schema;
use super::tool::ToolCall;
use crate::scene::text;

/// Maximum number of identical calls in one request.
const MOST_ALIKE: usize = 3;
/// Longest excerpt of a server's error that is shown, in characters.
const LONGEST_ERROR: usize = 200;

/// Planner that asks a chat model.
pub struct Llm {
    settings: LlmSettings,
    url: String,
    key: Option<Secret>,
    timeouts: RequestTimeouts,
    limits: RequestLimits,
    talk: Vec<Value>,
    /// Calls of the last answer that are not made yet.
    waiting: VecDeque<RawCall>,
    /// Call that the session is executing.
    current: Option<RawCall>,
    stream: bool,
    begun: Instant,
    answers: u32,
    wrong: u32,
    tokens: u64,
    asked: Vec<(String, String)>,
    /// Problem of the model's last call if it was invalid and no valid one followed.
    objection: Option<String>,
}

impl Llm {
    /// Returns a planner with the key from the environment variable that the settings name.
    ///
    /// # Errors
    /// If the settings cannot be used.
    pub fn new(settings: LlmSettings) -> Result<Self, LlmError> {
        let key = settings.key()?;
        Self::with(settings, key, RequestTimeouts::default(), RequestLimits::default())
    }

    /// Returns a planner with this key and these limits.
    ///
    /// # Errors
    /// If the settings cannot be used.
    pub fn with(
        settings: LlmSettings,
        key: Option<Secret>,
        timeouts: RequestTimeouts,
        limits: RequestLimits,
    ) -> Result<Self, LlmError> {
        let url = settings.endpoint(key.is_some())?;
        let stream = settings.stream;
        Ok(Self {
            settings,
            url,
            key,
            timeouts,
            limits,
            talk: Vec::new(),
            waiting: VecDeque::new(),
            current: None,
            stream,
            begun: Instant::now(),
            answers: 0,
            wrong: 0,
            tokens: 0,
            asked: Vec::new(),
            objection: None,
        })
    }

    fn clean(&self, text: &str) -> String {
        self.key.as_ref().map_or_else(|| text.to_owned(), |key| key.redact(text))
    }

    fn failed(&self, text: &str) -> Refusal {
        Refusal::new(RefusalKind::Failed, self.clean(text))
    }

    /// Adds the result of a call to the messages for the model.
    fn push_result(&mut self, call: &RawCall, result: &Value) {
        self.talk.push(json!({ "role": "tool", "tool_call_id": call.id, "content": result.to_string() }));
    }

    /// Reports an invalid call to the model; an error once there were too many.
    fn object(&mut self, call: &RawCall, problem: &str, context: &mut PlannerContext<'_>) -> Result<(), Refusal> {
        self.push_result(call, &json!({ "done": false, "error": problem }));
        (context.on)(AgentEvent::Note(self.clean(&format!("The model's call was not valid: {problem}"))));
        self.objection = Some(problem.to_owned());
        self.wrong += 1;
        if self.wrong > self.limits.wrong {
            let text = "I stopped: the model kept asking for things that are no valid calls. Try other words, or the built-in planner.";
            return Err(Refusal::new(RefusalKind::Limit, text));
        }
        Ok(())
    }

    /// Returns the next valid call of the model's answer.
    fn next_call(&mut self, context: &mut PlannerContext<'_>) -> Result<Option<ToolCall>, Refusal> {
        while let Some(raw) = self.waiting.pop_front() {
            match ToolCall::parse(&raw.name, &raw.arguments) {
                Err(problem) => self.object(&raw, &problem.to_string(), context)?,
                Ok(call) => {
                    let same = (raw.name.clone(), raw.arguments.clone());
                    let before = self.asked.iter().filter(|a| **a == same).count();
                    self.asked.push(same);
                    if before >= MOST_ALIKE {
                        self.object(
                            &raw,
                            "the same call was made several times; do something else or finish",
                            context,
                        )?;
                        continue;
                    }
                    (self.current, self.objection) = (Some(raw), None);
                    return Ok(Some(call));
                }
            }
        }
        Ok(None)
    }

    fn body(&self, context: &PlannerContext<'_>) -> String {
        let usable: Vec<&str> = context.policy.usable().collect();
        let is_usable = |tool: &Value| tool["function"]["name"].as_str().is_some_and(|n| usable.contains(&n));
        let tools: Vec<Value> = schema::tools().into_iter().filter(is_usable).collect();
        let body = json!({
            "model": self.settings.model,
            "messages": prompt::messages(&self.talk),
            "tools": tools,
            "tool_choice": "auto",
            "temperature": 0,
            "stream": self.stream
        });
        // A name or an error text of the server may contain the key: it must not enter the body.
        self.clean(&body.to_string())
    }

    /// Asks for one answer of the model, with as many attempts as permitted.
    fn ask(&mut self, context: &mut PlannerContext<'_>) -> Result<ModelReply, Refusal> {
        let mut pause = self.timeouts.pause;
        for attempt in 1.. {
            let (problem, asked_wait) = match self.attempt(context) {
                Ok(answer) => return Ok(answer),
                Err(Problem::Final(text)) => return Err(self.failed(&text)),
                Err(Problem::Cancelled) => return Err(Refusal::new(RefusalKind::Stopped, "Stopped.")),
                Err(Problem::Passing { text, wait }) => (text, wait),
            };
            if attempt >= self.timeouts.attempts {
                return Err(self.failed(&format!("The chat model gave no answer: {problem}. Try again later.")));
            }
            // Random jitter keeps many clients from retrying at the same time.
            let own = pause.mul_f64(rand::random_range(0.5..1.0));
            let next = asked_wait.map_or(own, |w| w.max(own));
            if next > self.timeouts.longest_pause {
                let secs = next.as_secs();
                return Err(self.failed(&format!("The chat model is rate-limited ({problem}); try again in {secs} s.")));
            }
            if self.begun.elapsed() + next > self.timeouts.request {
                return Err(self.failed(&format!("The chat model gave no answer in time: {problem}.")));
            }
            (context.on)(AgentEvent::Note(self.clean(&format!("Asking again: {problem}."))));
            if !wait(next, context.cancel) {
                return Err(Refusal::new(RefusalKind::Stopped, "Stopped."));
            }
            pause = (pause * 2).min(self.timeouts.longest_pause);
        }
        Err(self.failed("The chat model gave no answer."))
    }

    fn attempt(&mut self, context: &mut PlannerContext<'_>) -> Result<ModelReply, Problem> {
        let body = self.body(context);
        let sent = body.len() as u64;
        let left = self.timeouts.request.saturating_sub(self.begun.elapsed());
        let timeouts = RequestTimeouts { answer: self.timeouts.answer.min(left), ..self.timeouts };
        let mut collector = ReplyCollector::default();
        let mut is_stream = false;
        let mut told = 0;
        let key = self.key.as_ref();
        // A key may be split between chunks: a tail longer than it is held back until the end.
        let held = key.map_or(0, Secret::len) * 3;
        let on = &mut *context.on;
        let mut take = |head: &http::Head, bytes: &[u8]| {
            is_stream = head.is_stream;
            let ended = collector.take(head.is_stream, bytes);
            let fresh = &collector.text()[told..];
            let clean = key.map_or_else(|| fresh.to_owned(), |k| k.redact(fresh));
            let keep =
                |t: &str| (0..=t.len().saturating_sub(held)).rev().find(|at| t.is_char_boundary(*at)).unwrap_or(0);
            let (raw, shown) = (keep(fresh), keep(&clean));
            // If a key reaches into the tail that is held back, nothing is shown yet.
            if shown > 0 && fresh[raw..] == clean[shown..] {
                on(AgentEvent::Piece(clean[..shown].to_owned()));
                told += raw;
            }
            ended
        };
        let sent_to = exchange(&self.url, key, Some(body), &timeouts, self.limits.bytes, context.cancel, &mut take);
        match sent_to {
            Ok(()) => {}
            Err(Broken::Cancelled) => return Err(Problem::Cancelled),
            Err(Broken::TooLong) => {
                return Err(Problem::Final(
                    "The chat model's answer is too long; I did not read it to the end.".into(),
                ));
            }
            Err(broken) => return Err(self.problem(&broken)),
        }
        let rest = self.clean(&collector.text()[told..]);
        let answer = match collector.finish(is_stream) {
            Ok(answer) => answer,
            Err(problem) => {
                // The next attempt asks for the whole answer: the stream may be at fault.
                self.stream = false;
                return Err(Problem::Passing { text: problem, wait: None });
            }
        };
        let answer = self.cleaned(answer);
        let said: usize = answer.text.len() + answer.calls.iter().map(|c| c.arguments.len()).sum::<usize>();
        self.tokens += answer.tokens.unwrap_or((sent + said as u64) / 4);
        let rest = if is_stream { rest } else { answer.text.clone() };
        if !rest.is_empty() {
            (context.on)(AgentEvent::Piece(rest));
        }
        Ok(answer)
    }

    /// Removes the key from an answer and gives each call without an id a new one.
    fn cleaned(&self, mut answer: ModelReply) -> ModelReply {
        answer.text = self.clean(&answer.text);
        for (i, call) in answer.calls.iter_mut().enumerate() {
            let mut fixed = [&call.id, &call.name, &call.arguments].map(|t| match &self.key {
                Some(key) => key.redact(t),
                None => t.clone(),
            });
            if fixed[0].is_empty() {
                fixed[0] = format!("call_{}_{i}", self.answers);
            }
            let [id, name, arguments] = fixed;
            *call = RawCall { id, name, arguments };
        }
        answer
    }

    fn problem(&mut self, broken: &Broken) -> Problem {
        let text = match broken {
            Broken::Connection(problem) => {
                // The next attempt asks for the whole answer: the stream may have broken off.
                self.stream = false;
                format!("the connection failed ({})", self.clean(problem))
            }
            Broken::Stall => format!("it said nothing for {:.0} s", self.timeouts.stall.as_secs_f64().ceil()),
            Broken::Status { code, body, .. } => {
                let body = self.clean(body);
                let said: String = text::line(&body).trim().chars().take(LONGEST_ERROR).collect();
                if said.is_empty() { format!("it answered {code}") } else { format!("it answered {code}: {said}") }
            }
            Broken::TooLong | Broken::Cancelled => "it was ended".to_owned(),
        };
        if broken.is_passing() {
            let wait = match broken {
                Broken::Status { retry_after, .. } => *retry_after,
                _ => None,
            };
            return Problem::Passing { text, wait };
        }
        if let Broken::Status { code: 400 | 404 | 405 | 406 | 415 | 422 | 501, .. } = broken
            && self.stream
        {
            // The server may not support streaming.
            self.stream = false;
            return Problem::Passing { text, wait: None };
        }
        let hint = match broken {
            Broken::Status { code: 401 | 403, .. } => {
                " Check the key in the environment variable that the settings name."
            }
            Broken::Status { code: 404, .. } => " Check the address and the model's name.",
            Broken::Status { code: 300..=399, .. } => " It points elsewhere, where I do not follow.",
            _ => "",
        };
        Problem::Final(format!("The chat model cannot be asked: {text}.{hint}"))
    }
}

/// Reason for an attempt without an answer.
enum Problem {
    Passing { text: String, wait: Option<Duration> },
    Final(String),
    Cancelled,
}

impl Planner for Llm {
    fn name(&self) -> &'static str {
        "llm"
    }

    fn start(&mut self, request: &str, context: &mut PlannerContext<'_>) {
        // The protocol requires a result for every call before the next message.
        for call in self.current.take().into_iter().chain(std::mem::take(&mut self.waiting)) {
            let why = if call.name == "ask_user" {
                "the user answers in the next message"
            } else {
                "not done: the user did not say yes, or said something else"
            };
            self.push_result(&call, &json!({ "done": false, "result": why }));
        }
        let message = prompt::request(context.world, context.dialog, request);
        self.talk.push(json!({ "role": "user", "content": message }));
        (self.begun, self.answers, self.wrong, self.tokens) = (Instant::now(), 0, 0, 0);
        self.asked.clear();
        self.objection = None;
        self.stream = self.settings.stream;
    }

    fn next(&mut self, last: Option<&CallOutcome>, context: &mut PlannerContext<'_>) -> Result<Step, Refusal> {
        if let (Some(call), Some(outcome)) = (self.current.take(), last) {
            let result = json!({ "done": outcome.refused.is_none(), "result": outcome.heard(), "ids": outcome.ids });
            self.push_result(&call, &result);
        }
        loop {
            if let Some(call) = self.next_call(context)? {
                return Ok(Step::Call(call));
            }
            if self.answers >= self.limits.answers {
                let text = format!("I stopped after {} answers of the model without an end.", self.answers);
                return Err(Refusal::new(RefusalKind::Limit, text));
            }
            if self.tokens > self.limits.tokens {
                return Err(Refusal::new(RefusalKind::Limit, "I stopped: the request used up its tokens."));
            }
            if self.begun.elapsed() >= self.timeouts.request {
                return Err(Refusal::new(RefusalKind::Limit, "I stopped: the request took too long."));
            }
            self.answers += 1;
            (context.on)(AgentEvent::Thinking);
            let mut answer = self.ask(context)?;
            let too_many = answer.calls.split_off(answer.calls.len().min(self.limits.calls));
            if !too_many.is_empty() {
                (context.on)(AgentEvent::Note(format!("{} calls of one answer were left out.", too_many.len())));
            }
            self.talk.push(assistant(&answer));
            if answer.calls.is_empty() {
                if answer.text.trim().is_empty() {
                    return Err(self.failed("The chat model gave an empty answer."));
                }
                let why = self.objection.take();
                let why = why.map(|why| format!("The model's last call was not valid, so it was not made: {why}."));
                let refusal = why.map(|why| Refusal::new(RefusalKind::Failed, self.clean(&why)));
                return Ok(Step::Finish { text: answer.text, refusal });
            }
            self.waiting.extend(answer.calls);
        }
    }

    fn speaks(&self) -> bool {
        true
    }

    fn is_remote(&self) -> bool {
        true
    }

    fn redact(&self, text: &str) -> String {
        self.clean(text)
    }
}
