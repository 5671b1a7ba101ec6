//! The chat: what is asked in plain sentences goes to the agent on a thread of its own, what it does
//! comes back as deeds.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use crossbeam_channel::{Receiver, Sender, bounded};
use egui::{Button, ComboBox, Key, RichText, ScrollArea, TextEdit, Ui};

use super::panes::object_thumbnails::ObjectThumbnails;
use super::theme;
use crate::agent::llm::settings::LlmSettings;
use crate::agent::llm::{Llm, SENT};
use crate::agent::rules::Rules;
use crate::agent::scene::{Deed, Parts, SceneWorld};
use crate::agent::{AgentEvent, Planner, Policy, Refusal, Session};
use crate::navigate::Pose;
use crate::scene::trace::{self, Sort};
use crate::scene::{IdentityId, SemanticMap, text};
use crate::ui::actions::Action;
use crate::worker::Repaint;

/// News that may wait for the window; the agent waits for it beyond that.
const NEWS: usize = 1024;
/// Lines that are kept.
const MAX_LINES: usize = 400;
/// Side of a candidate's thumbnail, points.
const THUMBNAIL_PX: f32 = 34.0;

/// Which planner is used; kept from one run to the next.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default)]
pub struct ChatSettings {
    /// Whether a chat model plans, instead of the built-in grammar.
    pub use_model: bool,
    /// Where it is.
    pub model: LlmSettings,
}

/// What the agent is to work on, as the window has it now.
pub struct Snapshot {
    /// The scene.
    pub parts: Parts,
    /// Generation of its Gaussians.
    pub cloud: u64,
    /// Counts the scenes shown so far.
    pub scene: u64,
    /// Where the eye is.
    pub eye: Pose,
    /// Width by height of the frame.
    pub aspect: f64,
    /// What is left out of the frame.
    pub hidden: Vec<IdentityId>,
}

/// A line of the conversation.
enum Line {
    Said(String),
    Did(String, Option<bool>),
    Answer { text: String, candidates: Vec<(IdentityId, String)>, refused: Option<Refusal> },
}

struct Request {
    text: String,
    snapshot: Snapshot,
    settings: ChatSettings,
    cancel: Arc<AtomicBool>,
}

/// What comes back from the agent's thread.
enum News {
    Event(AgentEvent),
    Deed(Deed),
    Reply { text: String, candidates: Vec<(IdentityId, String)>, refused: Option<Refusal>, transcript: [String; 2] },
}

/// The conversation with the agent.
#[derive(Default)]
pub struct Chat {
    typed: String,
    lines: Vec<Line>,
    thread: Option<(Sender<Request>, Receiver<News>)>,
    /// Set to end what is under way; there while something is.
    cancel: Option<Arc<AtomicBool>>,
    /// The talk so far, as JSON and as Markdown.
    transcript: Option<[String; 2]>,
    /// A sentence to be sent with the next snapshot.
    waiting: Option<String>,
    /// Set while the box is to take the keyboard.
    focus: bool,
}

impl Chat {
    /// Deeds that came in since.
    pub fn news(&mut self) -> Vec<Deed> {
        let mut deeds = Vec::new();
        let Some((_, news)) = &self.thread else { return deeds };
        for news in news.try_iter() {
            match news {
                News::Deed(deed) => deeds.push(deed),
                News::Event(AgentEvent::Call { line, .. }) => self.lines.push(did(&line, None)),
                News::Event(AgentEvent::Result { text, done }) => self.lines.push(did(&text, Some(done))),
                News::Event(AgentEvent::Note(text)) => self.lines.push(did(&text, None)),
                News::Event(AgentEvent::Thinking | AgentEvent::Piece(_)) => {}
                News::Reply { text, candidates, refused, transcript } => {
                    let text = text::lines(&text).into_owned();
                    self.lines.push(Line::Answer { text, candidates, refused });
                    self.transcript = Some(transcript);
                    self.cancel = None;
                }
            }
        }
        let surplus = self.lines.len().saturating_sub(MAX_LINES);
        self.lines.drain(..surplus);
        deeds
    }

    /// The talk as text: JSON if the file is called so, else Markdown.
    pub fn transcript(&self, json: bool) -> Option<&str> {
        self.transcript.as_ref().map(|t| t[usize::from(!json)].as_str())
    }

    /// What is to be sent, once a snapshot of the scene is there.
    pub fn wants(&mut self) -> Option<String> {
        self.waiting.take()
    }

    /// Sends a sentence to the agent.
    pub fn send(&mut self, text: String, snapshot: Snapshot, settings: ChatSettings, repaint: &Repaint) {
        let cancel = Arc::new(AtomicBool::new(false));
        let request = Request { text: text.clone(), snapshot, settings, cancel: Arc::clone(&cancel) };
        if self.thread.is_none() {
            self.thread = start(Arc::clone(repaint)).ok();
        }
        self.lines.push(Line::Said(text));
        let sent = self.thread.as_ref().is_some_and(|(sender, _)| sender.try_send(request).is_ok());
        if sent {
            self.cancel = Some(cancel);
        } else {
            self.answer("The agent could not be started; please try again.");
        }
    }

    /// An answer of the window's own.
    pub fn answer(&mut self, text: &str) {
        let text = text::lines(text).into_owned();
        self.lines.push(Line::Answer { text, candidates: Vec::new(), refused: None });
    }

    /// Makes the box take the keyboard.
    pub fn start_typing(&mut self) {
        self.focus = true;
    }

    /// Draws the pane.
    pub fn show(
        &mut self,
        ui: &mut Ui,
        settings: &mut ChatSettings,
        object_thumbnails: &ObjectThumbnails,
        ready: bool,
        actions: &mut Vec<Action>,
    ) {
        let mut say = None;
        if self.lines.is_empty() {
            ui.label(
                RichText::new(
                    "Ask in plain sentences. It finds things, flies there, describes them, and asks back when unsure.",
                )
                .color(theme::WEAK),
            );
            ui.horizontal_wrapped(|ui| {
                for example in ["What is in view?", "What can you do?"] {
                    if ui.add_enabled(ready, Button::new(example).small()).clicked() {
                        say = Some(example.to_owned());
                    }
                }
            });
        } else {
            ScrollArea::vertical().id_salt("talk").max_height(280.0).stick_to_bottom(true).show(ui, |ui| {
                for line in &self.lines {
                    say = show_line(ui, line, object_thumbnails).or(say.take());
                }
                if self.cancel.is_some() {
                    ui.horizontal(|ui| {
                        ui.spinner();
                        ui.weak("working\u{2026}");
                    });
                }
            });
        }
        ui.horizontal(|ui| {
            let width = (ui.available_width() - 62.0).max(80.0);
            let hint = if ready { "show me \u{2026}" } else { "Find objects first" };
            let edit = TextEdit::singleline(&mut self.typed).hint_text(hint).desired_width(width).char_limit(1000);
            let response = ui.add_enabled(ready && self.cancel.is_none(), edit);
            if std::mem::take(&mut self.focus) {
                response.request_focus();
            }
            let enter = response.lost_focus() && ui.input(|i| i.key_pressed(Key::Enter));
            match &self.cancel {
                Some(cancel) => {
                    if ui.button("Stop").clicked() {
                        cancel.store(true, Ordering::Relaxed);
                    }
                }
                None => {
                    let send = ui.add_enabled(ready && !self.typed.trim().is_empty(), Button::new("Send"));
                    if (enter || send.clicked()) && !self.typed.trim().is_empty() {
                        say = Some(std::mem::take(&mut self.typed));
                        self.focus = true;
                    }
                }
            }
        });
        ui.horizontal(|ui| {
            choose_planner(ui, settings);
            if ui.add_enabled(self.transcript.is_some(), Button::new("Save conversation\u{2026}").small()).clicked() {
                actions.push(Action::SaveChat);
            }
            if ui
                .add_enabled(self.cancel.is_none() && !self.lines.is_empty(), Button::new("New conversation").small())
                .clicked()
            {
                *self = Self::default();
            }
        });
        if self.cancel.is_none() && say.is_some() {
            self.waiting = say;
        }
    }
}

/// A step of the agent, in words that may be a model's.
fn did(line: &str, done: Option<bool>) -> Line {
    Line::Did(text::line(line).into_owned(), done)
}

/// One line; a candidate that was clicked.
fn show_line(ui: &mut Ui, line: &Line, object_thumbnails: &ObjectThumbnails) -> Option<String> {
    let mut clicked = None;
    match line {
        Line::Said(text) => {
            ui.add_space(4.0);
            ui.label(RichText::new(text).strong());
        }
        Line::Did(text, done) => {
            let color = if *done == Some(false) { theme::WARNING } else { theme::WEAK };
            ui.label(RichText::new(format!("    {text}")).small().color(color));
        }
        Line::Answer { text, candidates, refused } => {
            match refused {
                Some(_) => ui.horizontal_wrapped(|ui| {
                    theme::mark(ui, super::state::Tone::Warning, 16.0);
                    ui.label(text);
                }),
                None => ui.horizontal_wrapped(|ui| {
                    ui.label(text);
                }),
            };
            ui.horizontal_wrapped(|ui| {
                for (id, name) in candidates.iter().take(8) {
                    object_thumbnails.show(ui, *id, THUMBNAIL_PX);
                    if ui.add(Button::new(name).small()).clicked() {
                        clicked = Some(name.clone());
                    }
                }
            });
        }
    }
    clicked
}

fn choose_planner(ui: &mut Ui, settings: &mut ChatSettings) {
    let text = if settings.use_model { "Chat model" } else { "Built-in" };
    ComboBox::from_id_salt("planner").selected_text(text).width(90.0).show_ui(ui, |ui| {
        ui.selectable_value(&mut settings.use_model, false, "Built-in").on_hover_text("Built-in commands; no network.");
        ui.selectable_value(&mut settings.use_model, true, "Chat model").on_hover_text(SENT);
    });
    if settings.use_model {
        ui.menu_button("Server\u{2026}", |ui| {
            ui.set_min_width(300.0);
            let model = &mut settings.model;
            for (label, value, hint) in [
                ("Address", &mut model.base_url, "http://127.0.0.1:11434/v1"),
                ("Model", &mut model.model, "its name on the server"),
                ("API key variable", &mut model.key_variable, "name of an environment variable; empty for none"),
            ] {
                ui.label(RichText::new(label).small().color(theme::WEAK));
                ui.add(TextEdit::singleline(value).hint_text(hint).desired_width(f32::INFINITY));
            }
            ui.label(RichText::new(SENT).small().color(theme::WEAK));
        });
    }
}

/// Starts the agent's thread.
fn start(repaint: Repaint) -> std::io::Result<(Sender<Request>, Receiver<News>)> {
    let (sender, requests) = bounded::<Request>(4);
    let (news_sender, news) = bounded(NEWS);
    let work = move || {
        let mut agent = Agent { session: None, world: None, news: news_sender, repaint };
        for request in requests {
            agent.carry_out(request);
        }
    };
    std::thread::Builder::new().name("agent".into()).spawn(work)?;
    Ok((sender, news))
}

/// What the thread holds.
struct Agent {
    /// With the settings that it was started with.
    session: Option<(ChatSettings, Session)>,
    /// With the number of its scene and the generation of its Gaussians.
    world: Option<((u64, u64), SceneWorld)>,
    news: Sender<News>,
    repaint: Repaint,
}

impl Agent {
    fn carry_out(&mut self, request: Request) {
        let Request { text, snapshot, settings, cancel } = request;
        if let Err(problem) = self.get_ready(snapshot, settings) {
            self.reply(problem, Vec::new(), None, [String::new(), String::new()]);
            return;
        }
        let (Some((_, session)), Some((_, world))) = (&mut self.session, &mut self.world) else { return };
        let (news, repaint) = (self.news.clone(), Arc::clone(&self.repaint));
        let mut on = |event: AgentEvent| {
            // The window may be gone by now.
            let _ = news.send(News::Event(event));
            repaint();
        };
        let reply = session.say(world, &text, &mut on, &cancel);
        let transcript = [session.transcript().to_json(), session.transcript().to_markdown()];
        let names = reply.candidates.iter().map(|id| (*id, crate::agent::World::identities(world).full_name(*id)));
        let names = names.collect();
        self.reply(reply.text, names, reply.refused, transcript);
    }

    fn reply(
        &self,
        text: String,
        candidates: Vec<(IdentityId, String)>,
        refused: Option<Refusal>,
        transcript: [String; 2],
    ) {
        let _ = self.news.send(News::Reply { text, candidates, refused, transcript });
        (self.repaint)();
    }

    /// Brings session and world up to date.
    fn get_ready(&mut self, snapshot: Snapshot, settings: ChatSettings) -> Result<(), String> {
        let Snapshot { parts, cloud, scene, eye, aspect, hidden } = snapshot;
        let key = (scene, cloud);
        if self.world.as_ref().is_none_or(|(known, _)| *known != key) {
            let (news, repaint) = (self.news.clone(), Arc::clone(&self.repaint));
            let tell = Box::new(move |deed: Deed| {
                let _ = news.send(News::Deed(deed));
                repaint();
            });
            let world = SceneWorld::new(parts, eye, aspect, tell).map_err(|e| e.to_string())?;
            self.world = Some((key, world));
            // What was spoken of belongs to another scene.
            self.session = None;
        } else if let Some((_, world)) = &mut self.world {
            let map: Arc<SemanticMap> = parts.map;
            world.keep_up(eye, aspect, &hidden, &map);
        }
        if self.session.as_ref().is_none_or(|(known, _)| *known != settings) {
            let policy = Policy::from_environment().map_err(|e| e.to_string())?;
            let planner: Box<dyn Planner> = if settings.use_model {
                Box::new(Llm::new(settings.model.clone()).map_err(|e| e.to_string())?)
            } else {
                Box::new(Rules::default())
            };
            trace::record(Sort::Agent, "agent with its policy", "a message was sent to it", 0);
            self.session = Some((settings, Session::new(policy, planner)));
        }
        Ok(())
    }
}
