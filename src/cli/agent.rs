//! `fmlgs agent`: plain sentences to what is shown.

use std::io::{BufRead, Read};
use std::path::{Path, PathBuf};

use serde_json::json;

use super::agent_scene::{AgentSceneArgs, AgentStage};
use super::{CliError, interrupt, output};
use crate::agent::commands::Commands;
use crate::agent::llm::settings::{LlmSettings, RequestTimeouts};
use crate::agent::llm::{Llm, SENT, discover};
use crate::agent::{AgentEvent, Planner, Session, World};
use crate::jobs::export;

const EXAMPLES: &str = "Examples:\n  \
    fmlgs agent scene/ \"show me the handle of the kettle from the other side\" \"step back half a meter\"\n  \
    fmlgs agent scene/ \"what is on the table?\" --json\n  \
    fmlgs agent scene/ \"go to the lamp\" --view lamp.png --transcript conversation.md\n  \
    fmlgs agent scene/ --planner llm --url http://127.0.0.1:11434/v1 --model qwen3 \"find something to cut with\"";

/// Chat with a scene: it shows, goes there, describes, hides, measures
///
/// Each TEXT is one request of the same conversation; without any, requests are read from standard input, one
/// per line. The planner 'commands' is built in; 'llm' asks a chat model behind an OpenAI-compatible
/// address. Names that it gives are stored in the scene, after a yes; what it removes, it leaves out of a scene of
/// its own beside this one. Exit code 1 if the last request was refused, or ends at a question, or if something could
/// not be stored.
#[derive(Debug, clap::Args)]
#[command(after_help = format!("{EXAMPLES}\n\n{SENT}"))]
pub(crate) struct AgentArgs {
    /// Trained scene with objects and parts ('fmlgs preprocess')
    #[arg(required_unless_present_any = ["find_model", "test_model"])]
    scene: Option<PathBuf>,
    /// Requests, in order
    text: Vec<String>,
    /// Planner that turns sentences into steps
    #[arg(long, value_enum, default_value_t = PlannerArg::Commands)]
    planner: PlannerArg,
    /// Address of the chat model, up to and with its version
    #[arg(long, required_if_eq("planner", "llm"))]
    url: Option<String>,
    /// Name of the chat model
    #[arg(long, required_if_eq("planner", "llm"))]
    model: Option<String>,
    /// Name of the environment variable that holds the model's key
    #[arg(long)]
    key_variable: Option<String>,
    /// Look for a chat model's server on this machine (Ollama, llama.cpp, LM Studio, vLLM), list its models, and end
    #[arg(long, conflicts_with = "scene")]
    find_model: bool,
    /// Test the connection to --model at --url, and end
    #[arg(long, conflicts_with = "scene", requires_all = ["url", "model"])]
    test_model: bool,
    /// Write the image at the end
    #[arg(long)]
    view: Option<PathBuf>,
    /// Print one JSON document
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    agent: AgentSceneArgs,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum PlannerArg {
    /// The built-in commands ('help' lists them); no network
    Commands,
    /// A chat model
    Llm,
}

impl AgentArgs {
    fn settings(&self) -> LlmSettings {
        LlmSettings {
            base_url: self.url.clone().unwrap_or_default(),
            model: self.model.clone().unwrap_or_default(),
            key_variable: self.key_variable.clone().unwrap_or_default(),
            ..LlmSettings::default()
        }
    }

    fn planner(&self) -> Result<Box<dyn Planner>, CliError> {
        let settings = self.settings();
        Ok(match self.planner {
            PlannerArg::Commands => Box::new(Commands::default()),
            PlannerArg::Llm => Box::new(Llm::new(settings).map_err(|e| CliError::failed(e.to_string()))?),
        })
    }
}

/// The chat models that are found on this machine.
fn find_model(json: bool) -> Result<(), CliError> {
    let found = discover::find(&discover::PORTS, interrupt::flag());
    if json {
        let list = found.iter().map(|s| json!({ "kind": s.kind, "url": s.base_url, "models": s.models }));
        return output::print_json(&json!({ "servers": list.collect::<Vec<_>>() }));
    }
    if found.is_empty() {
        let ports: Vec<String> = discover::PORTS.iter().map(|(kind, port)| format!("{kind} ({port})")).collect();
        let text = format!("no chat model's server answers on the usual ports of this machine: {}", ports.join(", "));
        return Err(CliError::failed(text));
    }
    let line = |s: &discover::LocalServer| format!("{} at {}: {}", s.kind, s.base_url, s.models.join(", "));
    let lines: Vec<String> = found.iter().map(line).collect();
    output::print(&format!("{}\nChoose one with --planner llm --url ADDRESS --model NAME.\n{SENT}", lines.join("\n")))
}

pub(crate) fn run(args: AgentArgs) -> Result<(), CliError> {
    if args.find_model {
        return find_model(args.json);
    }
    if args.test_model {
        let text = discover::test(&args.settings(), &RequestTimeouts::default(), interrupt::flag());
        return output::print(&text.map_err(CliError::failed)?);
    }
    let (planner, policy) = (args.planner()?, args.agent.policy()?);
    let folder = args.scene.as_deref().unwrap_or(Path::new(""));
    let mut stage = args.agent.open(folder, args.view.as_deref())?;
    if !args.json && !stage.lines.is_empty() {
        output::print(&stage.lines.join("\n"))?;
    }
    let mut session = Session::new(policy, planner);
    let mut talk = Talk { json: args.json, ..Talk::default() };
    if args.text.is_empty() {
        let mut requests = Requests { input: std::io::stdin().lock(), line: 0 };
        while let Some(text) = requests.next()? {
            if !text.trim().is_empty() {
                talk.say(&mut session, &mut stage, &text)?;
            }
        }
    }
    for text in &args.text {
        talk.say(&mut session, &mut stage, text)?;
    }
    args.agent.write(session.transcript())?;
    if let Some(path) = &args.view {
        let png = stage.world.picture(&stage.eye().limited_to(1280));
        export::bytes(path, &png.map_err(|e| CliError::failed(e.to_string()))?)?;
    }
    if args.json {
        output::print_json(&json!({
            "planner": session.planner(), "requests": talk.told, "recipe": args.agent.recipe(),
        }))?;
    }
    if let Some(failure) = stage.work().failure.take() {
        return Err(failure);
    }
    if let Some(question) = talk.open {
        let asked = if args.json { String::new() } else { format!(" ({question})") };
        return Err(CliError::failed(format!(
            "the last request waits for an answer, so it was not carried out{asked}; answer with a TEXT more"
        )));
    }
    match talk.refused {
        Some(text) if !args.json => Err(CliError::failed(format!("the last request was not carried out: {text}"))),
        Some(_) => Err(CliError::failed("the last request was not carried out".to_owned())),
        None => Ok(()),
    }
}

/// Longest request in bytes, and most requests of one talk: beyond them is no person but an endless file.
const MAX_REQUEST_BYTES: u64 = 16 << 10;
const MAX_REQUESTS: usize = 10_000;

/// Requests, one a line.
struct Requests<R> {
    input: R,
    line: usize,
}

impl<R: BufRead> Requests<R> {
    /// The next line; `None` at the end.
    fn next(&mut self) -> Result<Option<String>, CliError> {
        self.line += 1;
        let bad = |what: String| CliError::failed(format!("standard input, line {}: {what}", self.line));
        let mut bytes = Vec::new();
        let read = self.input.by_ref().take(MAX_REQUEST_BYTES + 1).read_until(b'\n', &mut bytes);
        if read.map_err(|e| bad(e.to_string()))? == 0 {
            return Ok(None);
        }
        if bytes.len() as u64 > MAX_REQUEST_BYTES {
            return Err(bad(format!("a request has at most {MAX_REQUEST_BYTES} bytes")));
        }
        if self.line > MAX_REQUESTS {
            return Err(bad(format!("a conversation has at most {MAX_REQUESTS} requests; start another")));
        }
        let text = String::from_utf8(bytes).map_err(|_| bad("it is not UTF-8 text".into()))?;
        Ok(Some(text.strip_prefix('\u{feff}').map_or_else(|| text.clone(), str::to_owned)))
    }
}

/// State of the conversation so far.
#[derive(Default)]
struct Talk {
    json: bool,
    told: Vec<serde_json::Value>,
    /// Reason for which the last request was refused, if it was.
    refused: Option<String>,
    /// Open question of the last request, if it is not answered yet.
    open: Option<String>,
}

impl Talk {
    fn say(&mut self, session: &mut Session, stage: &mut AgentStage, text: &str) -> Result<(), CliError> {
        let mut calls = Vec::new();
        let mut on = |event| {
            if let AgentEvent::Call { line, .. } = event {
                calls.push(line);
            }
        };
        let reply = session.say(&mut stage.world, text, &mut on, interrupt::flag());
        if interrupt::asked_to_stop() {
            return Err(CliError::Cancelled("the conversation ends here".into()));
        }
        let done = std::mem::take(&mut stage.work().done);
        self.refused = reply.refused.as_ref().map(|r| r.text.clone());
        self.open = reply.pending.map(|_| reply.text.clone());
        if self.json {
            let refused = reply.refused.as_ref().map(|r| json!({ "kind": format!("{:?}", r.kind), "text": r.text }));
            let all = stage.world.identities();
            let names = reply.candidates.iter().map(|id| all.full_name(*id));
            self.told.push(json!({
                "request": text,
                "calls": calls,
                "effects": done,
                "reply": reply.text,
                "candidates": names.collect::<Vec<_>>(),
                "refused": refused,
                "awaits": reply.pending.map(|p| format!("{p:?}")),
            }));
            return Ok(());
        }
        let mut lines = vec![format!("> {text}")];
        lines.extend(done.iter().map(|d| format!("  {d}")));
        lines.push(reply.text);
        output::print(&lines.join("\n"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn requests_are_lines_of_bounded_length_and_number() {
        let all = |input: &[u8]| {
            let mut requests = Requests { input, line: 0 };
            let mut lines = Vec::new();
            loop {
                match requests.next() {
                    Ok(Some(line)) => lines.push(line),
                    Ok(None) => return Ok(lines),
                    Err(CliError::Failed(e)) => return Err(e.to_string()),
                    Err(other) => panic!("{other:?}"),
                }
            }
        };
        assert_eq!(all(b"closer\n\nback"), Ok(vec!["closer\n".to_owned(), "\n".into(), "back".into()]));
        let endless = vec![0; 2 * MAX_REQUEST_BYTES as usize];
        assert!(all(&endless).expect_err("no end").contains("line 1: a request has at most"));
        let most = "y\n".repeat(MAX_REQUESTS);
        assert_eq!(all(most.as_bytes()).map(|l| l.len()), Ok(MAX_REQUESTS));
        assert!(all((most + "y\n").as_bytes()).expect_err("too many").contains("at most 10000 requests"));
        assert!(all(b"\xff\n").expect_err("bytes").contains("not UTF-8"));
    }
}
