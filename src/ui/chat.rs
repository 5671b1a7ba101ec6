//! The chat: sentences go to the agent on its own thread, its actions come back as effects. Completions stand below the
//! box.

use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use crossbeam_channel::{Receiver, Sender, bounded};
use egui::{Button, Id, Key, Modifiers, Response, RichText, ScrollArea, TextEdit, Ui};

use super::chat_lines::{self, ChatAnswer, ChatClick, Line};
pub(crate) use super::chat_model::ChatSettings;
use super::chat_model::ModelChooser;
use super::chat_offers::offers;
use super::ctx::Ctx;
use super::panes::PaneContents;
use super::state::AppState;
use super::text_field::cursor_to_end;
use super::theme;
use super::viewport::Viewport;
use crate::agent::commands::{Commands, complete, part_not_understood};
use crate::agent::llm::Llm;
use crate::agent::scene::{AgentScene, Effect, ScenePhotos, SceneWorld};
use crate::agent::{AgentEvent, Awaited, Planner, Policy, RefusalKind, Session, World};
use crate::navigate::Pose;
use crate::scene::resource_log::{self, ResourceKind};
use crate::scene::{Identities, IdentityId};
use crate::ui::actions::Action;
use crate::worker::Repaint;

/// Capacity of the queue to the window; the agent waits if it is full.
const NEWS: usize = 1024;
/// Lines that are kept.
const MAX_LINES: usize = 400;
/// Completions shown at once.
const CONTINUATIONS: usize = 4;
/// Least height of the box, its completions and the buttons below the conversation, points.
const BELOW_PT: f32 = 62.0;

/// Answer to what the program does, but not the chat.
const NOT_BY_CHAT: &str = "The chat does not do this, but the program does (Ctrl+P finds it, too):";

/// State of the window that the agent works on.
pub(crate) struct Snapshot {
    pub(crate) parts: AgentScene,
    /// Generation of its Gaussians.
    pub(crate) cloud: u64,
    /// Counts the scenes shown so far.
    pub(crate) scene: u64,
    /// Current camera pose.
    pub(crate) eye: Pose,
    /// Aspect ratio of the frame, width / height.
    pub(crate) aspect: f64,
    /// Identities that are hidden.
    pub(crate) hidden: Vec<IdentityId>,
    /// Description of the last change that can be undone.
    pub(crate) undoable: Option<String>,
    pub(crate) photos: ScenePhotos,
}

struct Request {
    text: String,
    snapshot: Snapshot,
    settings: ChatSettings,
    cancel: Arc<AtomicBool>,
}

/// Message from the agent's thread.
enum News {
    Event(AgentEvent),
    Effect(Effect),
    Reply { answer: ChatAnswer, transcript: [String; 2] },
}

/// The conversation with the agent.
#[derive(Default)]
pub(crate) struct Chat {
    typed: String,
    lines: Vec<Line>,
    thread: Option<(Sender<Request>, Receiver<News>)>,
    /// Number of sentences sent so far.
    pub(crate) sent: u64,
    /// Set to cancel the running request; `Some` while one runs.
    cancel: Option<Arc<AtomicBool>>,
    /// The conversation so far, as JSON and as Markdown.
    transcript: Option<[String; 2]>,
    /// Sentences that wait for the answers before them; each gets its own snapshot when it is sent.
    waiting: VecDeque<String>,
    /// Set until the box has the keyboard focus.
    focus: bool,
    /// Typed text and its completions.
    continuations: (String, Vec<String>),
    chooser: ModelChooser,
    /// Number of the scene that the last lines are about.
    scene: u64,
    /// Height below the conversation at the last redraw, points.
    below_pt: f32,
}

impl Chat {
    /// Draws a line where another scene was opened; things before it are no longer there.
    fn follow_scene(&mut self, state: &AppState) {
        if self.scene != state.scene_number {
            self.scene = state.scene_number;
            // Scenes that nothing was said of need no line.
            self.lines.pop_if(|line| matches!(line, Line::Opened(_)));
            let name = state.scene.as_ref().map(|s| s.name.clone());
            self.lines.extend(name.filter(|_| !self.lines.is_empty()).map(Line::Opened));
        }
    }

    /// Effects since the last call.
    pub(crate) fn news(&mut self) -> Vec<Effect> {
        let mut effects = Vec::new();
        let Some((_, news)) = &self.thread else { return effects };
        for news in news.try_iter() {
            match news {
                News::Effect(effect) => effects.push(effect),
                News::Event(AgentEvent::Call { line, .. }) => self.lines.push(chat_lines::did(&line, None)),
                News::Event(AgentEvent::Result { text, done }) => self.lines.push(chat_lines::did(&text, Some(done))),
                News::Event(AgentEvent::Note(text)) => self.lines.push(chat_lines::did(&text, None)),
                News::Event(AgentEvent::Thinking | AgentEvent::Piece(_)) => {}
                News::Reply { answer, transcript } => {
                    self.lines.push(Line::Answer(answer));
                    self.transcript = Some(transcript);
                    self.cancel = None;
                }
            }
        }
        let surplus = self.lines.len().saturating_sub(MAX_LINES);
        self.lines.drain(..surplus);
        effects
    }

    /// True if every sentence is answered.
    pub fn is_idle(&self) -> bool {
        self.cancel.is_none() && self.waiting.is_empty()
    }

    /// The conversation as text: JSON if `json`, else Markdown.
    pub(crate) fn transcript(&self, json: bool) -> Option<&str> {
        self.transcript.as_ref().map(|t| t[usize::from(!json)].as_str())
    }

    /// The next sentence to send, for which a snapshot is then taken.
    pub(crate) fn wants(&mut self) -> Option<String> {
        if self.cancel.is_some() { None } else { self.waiting.pop_front() }
    }

    /// Sends a sentence to the agent.
    pub(crate) fn send(&mut self, text: String, snapshot: Snapshot, settings: ChatSettings, repaint: &Repaint) {
        let cancel = Arc::new(AtomicBool::new(false));
        let request = Request { text: text.clone(), snapshot, settings, cancel: Arc::clone(&cancel) };
        if self.thread.is_none() {
            self.thread = start(Arc::clone(repaint)).ok();
        }
        self.lines.push(Line::Said(text));
        let sent = self.thread.as_ref().is_some_and(|(sender, _)| sender.try_send(request).is_ok());
        if sent {
            self.cancel = Some(cancel);
            self.sent += 1;
        } else {
            self.answer("The agent could not be started; please try again.");
        }
    }

    /// Adds an answer of the window itself.
    pub(crate) fn answer(&mut self, text: &str) {
        self.lines.push(Line::Answer(ChatAnswer::new(text)));
    }

    /// Moves the keyboard focus to the box.
    pub(crate) fn start_typing(&mut self) {
        self.focus = true;
    }

    /// Completions of the typed text, below the box.
    fn show_continuations(&mut self, ui: &mut Ui, identities: Option<&Identities>) {
        let known = identities.filter(|_| !self.typed.trim().is_empty());
        if self.continuations.0 != self.typed || known.is_none() {
            let next = known.map(|all| complete(&self.typed, all, CONTINUATIONS)).unwrap_or_default();
            self.continuations = (self.typed.clone(), next);
        }
        for (i, text) in self.continuations.1.iter().enumerate() {
            let tab = if i == 0 { "  (Tab)" } else { "" };
            ui.label(RichText::new(format!("{text}{tab}")).small().color(theme::weak()));
        }
    }

    /// Takes the first completion on Tab.
    fn take_continuation(&mut self, ui: &Ui, response: &Response) {
        let pressed = || ui.input_mut(|i| i.consume_key(Modifiers::NONE, Key::Tab));
        let Some(first) = self.continuations.1.first().filter(|_| response.has_focus() && pressed()) else { return };
        self.typed = format!("{first} ");
        cursor_to_end(ui.ctx(), response.id, &self.typed);
    }
}

impl PaneContents for Chat {
    fn ui(&mut self, ui: &mut Ui, cx: &mut Ctx<'_>, _: &mut Viewport) {
        let object_thumbnails = cx.thumbnails;
        self.follow_scene(cx.state);
        let identities = cx.state.semantics.as_ref().map(|map| &map.identities);
        let (ready, mut say) = (identities.is_some(), None);
        // The box stands at the bottom of the pane from the start: it does not move under the pointer.
        let height = (ui.available_height() - self.below_pt.max(BELOW_PT)).max(60.0);
        let talk = ScrollArea::vertical().id_salt("talk").max_height(height).min_scrolled_height(height);
        talk.auto_shrink(false).stick_to_bottom(true).show(ui, |ui| {
            if self.lines.is_empty() {
                ui.label(
                    RichText::new(
                        "Type a command to find, visit, measure or hide things. \u{201c}help\u{201d} lists all.",
                    )
                    .color(theme::weak()),
                );
                ui.horizontal_wrapped(|ui| {
                    for example in ["What is in view?", "help"] {
                        if ui.add_enabled(ready, Button::new(example).small()).clicked() {
                            say = Some(example.to_owned());
                        }
                    }
                });
            } else {
                match chat_lines::show(ui, &self.lines, object_thumbnails) {
                    Some(ChatClick::Say(text)) => say = Some(text),
                    Some(ChatClick::Do(action)) => cx.ask(action),
                    None => {}
                }
                if self.cancel.is_some() {
                    ui.horizontal(|ui| {
                        ui.spinner();
                        ui.weak("working\u{2026}");
                    });
                }
                for text in &self.waiting {
                    ui.weak(format!("next: {text}"));
                }
            }
        });
        let below = ui.cursor().top();
        ui.horizontal(|ui| {
            let width = (ui.available_width() - 62.0).max(80.0);
            let hint = if ready { "show me \u{2026}" } else { "Find objects first" };
            let takes_tab = !self.continuations.1.is_empty();
            let edit = TextEdit::singleline(&mut self.typed).hint_text(hint).desired_width(width).char_limit(1000);
            let field = Id::unique("chat box");
            if std::mem::take(&mut self.focus) {
                ui.memory_mut(|m| m.request_focus(field));
            }
            // Without a map the agent can only refuse, but the box still takes keys: here they are no shortcuts.
            let response = ui.add(edit.id(field).lock_focus(takes_tab)).accessible_name("Chat box");
            self.take_continuation(ui, &response);
            let enter = response.lost_focus() && ui.input(|i| i.key_pressed(Key::Enter));
            let some = !self.typed.trim().is_empty();
            let clicked = match &self.cancel {
                Some(cancel) => {
                    if ui.button("Stop").clicked() {
                        cancel.store(true, Ordering::Relaxed);
                        self.waiting.clear();
                    }
                    false
                }
                None => ui.add_enabled(some, Button::new("Send")).clicked(),
            };
            // The box keeps the focus for the next sentence, even before the answer.
            if enter || clicked {
                response.request_focus();
            }
            if some && (enter || clicked) {
                say = Some(std::mem::take(&mut self.typed));
            }
        });
        self.show_continuations(ui, identities.filter(|_| !cx.layout.chat.use_model));
        ui.horizontal_wrapped(|ui| {
            self.chooser.show(ui, &mut cx.layout.chat);
            let save = ui.add_enabled(self.transcript.is_some(), Button::new("Save\u{2026}").small());
            if save.on_hover_text(Action::SaveChat.text()).accessible_name(Action::SaveChat.text()).clicked() {
                cx.ask(Action::SaveChat);
            }
            let has_lines = self.cancel.is_none() && !self.lines.is_empty();
            let new = ui.add_enabled(has_lines, Button::new("New").small());
            if new.on_hover_text("New conversation").accessible_name("New conversation").clicked() {
                *self = Self { sent: self.sent, ..Self::default() };
            }
        });
        self.below_pt = ui.cursor().top() - below;
        self.waiting.extend(say);
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

/// State of the agent's thread.
struct Agent {
    /// Session with the settings that it was started with.
    session: Option<(ChatSettings, Session)>,
    /// World with the number of its scene and the generation of its Gaussians.
    world: Option<((u64, u64), SceneWorld)>,
    news: Sender<News>,
    repaint: Repaint,
}

impl Agent {
    fn carry_out(&mut self, request: Request) {
        let Request { text: said, snapshot, settings, cancel } = request;
        let is_model = settings.use_model;
        if let Err(problem) = self.get_ready(snapshot, settings) {
            self.reply(ChatAnswer::new(&problem), [String::new(), String::new()]);
            return;
        }
        let (Some((_, session)), Some((_, world))) = (&mut self.session, &mut self.world) else { return };
        let (news, repaint) = (self.news.clone(), Arc::clone(&self.repaint));
        let mut on = |event: AgentEvent| {
            // The window may be closed by now.
            let _ = news.send(News::Event(event));
            repaint();
        };
        let reply = session.say(world, &said, &mut on, &cancel);
        let transcript = [session.transcript().to_json(), session.transcript().to_markdown()];
        let names = reply.candidates.iter().map(|id| (*id, World::identities(world).full_name(*id)));
        let (text, asks) = match reply.pending {
            Some(Awaited::Confirmation) => (reply.text.replace(" (yes or no)", ""), true),
            _ => (reply.text, false),
        };
        let candidates = names.collect();
        let missing = match &reply.refused {
            Some(refusal) if !is_model => match refusal.kind {
                RefusalKind::Unclear => Some(false),
                RefusalKind::NotFound => Some(true),
                _ => None,
            },
            _ => None,
        };
        let identities = World::identities(world);
        let offers = missing.map(|missing| offers(&said, identities, missing)).unwrap_or_default();
        let answer = match offers.is_empty() {
            true => ChatAnswer { candidates, refused: reply.refused, asks, ..ChatAnswer::new(&text) },
            false => {
                let part = part_not_understood(&said, identities);
                let part = part.map(|p| format!("Not understood: \u{201c}{p}\u{201d}. Nothing was done. "));
                ChatAnswer { offers, ..ChatAnswer::new(&(part.unwrap_or_default() + NOT_BY_CHAT)) }
            }
        };
        self.reply(answer, transcript);
    }

    fn reply(&self, answer: ChatAnswer, transcript: [String; 2]) {
        let _ = self.news.send(News::Reply { answer, transcript });
        (self.repaint)();
    }

    /// Brings session and world up to date.
    fn get_ready(&mut self, snapshot: Snapshot, settings: ChatSettings) -> Result<(), String> {
        let Snapshot { parts, cloud, scene, eye, aspect, hidden, undoable, photos } = snapshot;
        let (key, map, recipe) = ((scene, cloud), Arc::clone(&parts.map), parts.recipe.clone());
        if self.world.as_ref().is_none_or(|(known, _)| *known != key) {
            let (news, repaint) = (self.news.clone(), Arc::clone(&self.repaint));
            let emit = Box::new(move |effect: Effect| {
                let _ = news.send(News::Effect(effect));
                repaint();
            });
            let world = SceneWorld::new(parts, eye, aspect, emit).map_err(|e| e.to_string())?;
            self.world = Some((key, world));
            // References in the conversation belong to another scene.
            self.session = None;
        }
        if let Some((_, world)) = &mut self.world {
            world.keep_up(eye, aspect, &hidden, &map);
            world.answer_by(&recipe).map_err(|e| e.to_string())?;
            (world.undoable, world.photos) = (undoable, photos);
        }
        if self.session.as_ref().is_none_or(|(known, _)| *known != settings) {
            let policy = Policy::from_environment().map_err(|e| e.to_string())?;
            let planner: Box<dyn Planner> = if settings.use_model {
                Box::new(Llm::new(settings.model.clone()).map_err(|e| e.to_string())?)
            } else {
                Box::new(Commands::default())
            };
            resource_log::record(ResourceKind::Agent, "agent with its policy", "a message was sent to it", 0);
            self.session = Some((settings, Session::new(policy, planner)));
        }
        Ok(())
    }
}
