//! `fmlgs mcp`: the agent's tools for a program that speaks the Model Context Protocol.

use std::io;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use crossbeam_channel::{Receiver, RecvTimeoutError, bounded};

use super::agent_scene::{AgentSceneArgs, AgentStage};
use super::{CliError, interrupt, output, view};
use crate::agent::mcp::{Cancellations, McpServer, PictureRequest, ServedScene, WorkDone, next_line};
use crate::agent::{AgentEvent, World};

/// Messages that are read ahead.
const QUEUE: usize = 16;
/// Time between two looks at signals.
const PATIENCE: Duration = Duration::from_millis(100);

/// Let another program's assistant use the agent's tools (Model Context Protocol)
///
/// The program starts this command and talks to it over standard input and output; the end of the input ends it. The
/// assistant gets the tools of 'fmlgs agent' under the same policy, one more that draws the view, and one that passes
/// on your answers: nothing is removed, renamed or replaced without a yes. It learns names, sizes, paths of exported
/// files and why something failed, and sees pictures; where it sends them, that program decides.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    fmlgs mcp scene/\n  \
    fmlgs mcp scene/ --policy policy.toml --transcript calls.md\n\n\
    In the settings of most programs:\n  \
    { \"mcpServers\": { \"scene\": { \"command\": \"fmlgs\", \"args\": [\"mcp\", \"/path/to/scene\"] } } }")]
pub(crate) struct McpArgs {
    /// Trained scene with objects and parts ('fmlgs preprocess')
    scene: PathBuf,
    #[command(flatten)]
    agent: AgentSceneArgs,
}

pub(crate) fn run(args: McpArgs, quiet: bool) -> Result<(), CliError> {
    let policy = args.agent.policy()?;
    let stage = args.agent.open(&args.scene, None)?;
    let log = move |text: &str| {
        if !quiet {
            output::note(text);
        }
    };
    stage.lines.iter().for_each(|line| log(line));
    log(&format!("Serving {} on standard input and output; the end of the input ends it", args.scene.display()));
    let on = move |event: AgentEvent| match event {
        AgentEvent::Call { line, .. } => log(&line),
        AgentEvent::Result { text, .. } => log(&format!("  {text}")),
        AgentEvent::Note(text) => log(&text),
        AgentEvent::Thinking | AgentEvent::Piece(_) => {}
    };
    let canceled = Arc::new(Cancellations::default());
    let lines = read_lines(Arc::clone(&canceled))?;
    let mut server = McpServer::new(stage, policy, canceled, Box::new(on));
    let ended = serve(&mut server, &lines);
    args.agent.write(server.transcript())?;
    ended
}

/// Reads ahead on a thread of its own, so that a request can be taken back while another one is carried out.
fn read_lines(canceled: Arc<Cancellations>) -> Result<Receiver<io::Result<Vec<u8>>>, CliError> {
    let (send, lines) = bounded(QUEUE);
    let read = move || {
        let mut input = io::stdin().lock();
        while let Some(line) = next_line(&mut input).transpose() {
            line.iter().for_each(|line| canceled.hear(line));
            let failed = line.is_err();
            if send.send(line).is_err() || failed {
                return;
            }
        }
    };
    std::thread::Builder::new().name("mcp input".into()).spawn(read)?;
    Ok(lines)
}

/// Answers line by line, until the input ends or a signal comes.
fn serve(server: &mut McpServer<AgentStage>, lines: &Receiver<io::Result<Vec<u8>>>) -> Result<(), CliError> {
    while !interrupt::asked_to_stop() {
        match lines.recv_timeout(PATIENCE) {
            Ok(line) => {
                if let Some(answer) = server.handle(&line?) {
                    output::print_message(&answer)?;
                }
            }
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => return Ok(()),
        }
    }
    Err(CliError::Cancelled("what was done is stored".into()))
}

impl ServedScene for AgentStage {
    fn world(&mut self) -> &mut dyn World {
        &mut self.world
    }

    fn picture(&mut self, request: &PictureRequest) -> Result<Vec<u8>, String> {
        let camera = match &request.photo {
            None => self.eye(),
            Some(photo) => view::of_photo(photo, &self.cameras)?.ok_or_else(|| {
                format!("No photo is called '{photo}'; there are {}, numbered from 0.", self.cameras.len())
            })?,
        };
        self.world.picture(&request.fit(&camera)).map_err(|e| e.to_string())
    }

    fn work_done(&mut self) -> WorkDone {
        let mut work = self.work();
        WorkDone { lines: std::mem::take(&mut work.done), failed: work.failure.take().is_some() }
    }
}
