//! Server: listens, authenticates clients, and answers from the [`Hub`]. Each connection has a thread of low priority.
//! Paths and other names of files are never taken from a client.
//!
//! A client must know the token, use a host name of the server, and not be a page in a browser. Requests are limited
//! in size and time. Only edits write anything, and only with `--allow-edit`.

use std::net::{IpAddr, Ipv4Addr, SocketAddr, TcpListener, TcpStream};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};
use std::{fmt, io, thread};

use thread_priority::{ThreadPriority, set_current_thread_priority};

use super::edits::Editor;
use super::http::{Connection, RequestHead, Response};
use super::hub::Hub;
use super::observer::ServedObserver;
use super::photos::ServedPhotos;
use super::seats::{Seat, Seats};
use super::token::AccessToken;
use super::wire::{
    CLIENT_HEADER, ClientRequest, GENERATION_HEADER, RUN_HEADER, STEP_HEADER, SceneSummary, VERSION_HEADER, WireEvent,
    is_understood, version,
};
use crate::io::http::is_loopback;
use crate::io::snapshot;
use crate::io::trained::SceneInfo;
use crate::jobs::JobError;
use crate::pipeline::observer::Observer;
use crate::scene::GaussianCloud;

/// Maximum rate of requests per second, of all clients together, and largest burst.
const RATE: f64 = 100.0;
const BURST: f64 = 200.0;
/// Largest body of a command, in bytes; larger if edits are permitted, as they list Gaussians by number.
const ASK_BYTES: usize = 16 << 10;
const EDIT_BYTES: usize = 8 << 20;
/// Delay of the answer to a wrong token.
const WRONG_TOKEN: Duration = Duration::from_millis(200);
/// Longest wait at the end of a training for clients to which nothing is being sent.
const FAREWELL: Duration = Duration::from_secs(60);

/// Options of a server.
#[derive(Clone, Debug)]
pub(crate) struct ServeOptions {
    /// Address to listen at.
    pub(crate) bind: SocketAddr,
    /// True if other machines may connect.
    pub(crate) anywhere: bool,
    /// Host names that clients may use, besides those of the loopback.
    pub(crate) hosts: Vec<String>,
    pub(crate) allow_edit: bool,
    pub(crate) token: AccessToken,
}

/// Error of starting a server.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "each text says what its variant is")]
pub enum ServeError {
    #[error(
        "{0} can be reached from other computers. Listen at 127.0.0.1 and come through SSH, which is safe; or give \
         --bind-anywhere if everybody on the way may read what is sent"
    )]
    Anywhere(SocketAddr),
    #[error("cannot listen at {0}: {1}; choose another port, for example --serve 7071 or 'fmlgs serve SCENE 7071'")]
    Listen(SocketAddr, io::Error),
    #[error("no server could be started: {0}")]
    Start(#[from] io::Error),
    #[error(transparent)]
    Scene(#[from] JobError),
}

struct Shared {
    hub: Arc<Hub>,
    options: ServeOptions,
    editor: Option<Editor>,
    photos: ServedPhotos,
    seats: Arc<Seats>,
    bucket: Mutex<(f64, Instant)>,
    stop: AtomicBool,
}

/// Content that is served from the first answer on.
pub(super) enum Shown {
    /// A snapshot at rest.
    AtRest(Vec<u8>),
    /// A training that is about to begin: its title, and its initial Gaussians if known.
    Training(String, Option<Arc<GaussianCloud>>),
}

/// Running server. It ends when this is dropped.
pub(crate) struct Server {
    shared: Arc<Shared>,
    address: SocketAddr,
    accepting: Option<JoinHandle<()>>,
}

impl fmt::Debug for Server {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Server at {}", self.address)
    }
}

impl Server {
    /// Serves the scene of `info`. With `editable`, the folder of a trained scene and its saved state, clients can edit
    /// its objects if the options permit it.
    ///
    /// # Errors
    /// If the address is in use, or can be reached from other machines without the user's consent.
    pub(super) fn start(
        mut info: SceneInfo,
        editable: Option<(&Path, Option<String>)>,
        photos: ServedPhotos,
        shown: Shown,
        options: ServeOptions,
    ) -> Result<Self, ServeError> {
        if !options.bind.ip().to_canonical().is_loopback() && !options.anywhere {
            return Err(ServeError::Anywhere(options.bind));
        }
        // Local paths are not sent to clients.
        info.dataset = None;
        let editor = editable.filter(|_| options.allow_edit).map(|(folder, state)| Editor::new(folder.into(), state));
        let summary = SceneSummary { info, allow_edit: editor.is_some(), photos: !photos.is_empty() };
        let hub = Hub::new(summary)?;
        match shown {
            Shown::AtRest(snapshot) => hub.publish_packed(snapshot),
            Shown::Training(title, points) => {
                hub.report(WireEvent::Started(title));
                points.into_iter().for_each(|points| hub.publish(points, 0));
            }
        }
        let listener = TcpListener::bind(options.bind).map_err(|e| ServeError::Listen(options.bind, e))?;
        let address = listener.local_addr()?;
        let shared = Arc::new(Shared {
            hub: Arc::new(hub),
            options,
            editor,
            photos,
            seats: Arc::default(),
            bucket: Mutex::new((BURST, Instant::now())),
            stop: AtomicBool::new(false),
        });
        let of_thread = Arc::clone(&shared);
        let accept = move || accept(&listener, &of_thread);
        let accepting = Some(thread::Builder::new().name("server".into()).spawn(accept)?);
        Ok(Self { shared, address, accepting })
    }

    /// Address that the server listens at.
    pub(crate) fn address(&self) -> SocketAddr {
        self.address
    }

    /// Address with the token, for a client on this machine.
    pub(crate) fn url(&self) -> String {
        let ip = match self.address.ip() {
            ip if ip.is_unspecified() => IpAddr::V4(Ipv4Addr::LOCALHOST),
            ip => ip,
        };
        format!("http://{}/#{}", SocketAddr::new(ip, self.address.port()), self.shared.options.token.text())
    }

    /// Returns an observer of the training that forwards everything to `inner` and to the clients.
    pub(crate) fn observe<'a>(&self, inner: &'a mut dyn Observer) -> ServedObserver<'a> {
        ServedObserver { inner, hub: Arc::clone(&self.shared.hub), paused: AtomicBool::new(false) }
    }

    /// Reports the end of a training; the Gaussians saved in `folder` are sent bit for bit. Returns an error if they
    /// cannot be read.
    pub(crate) fn finished(&self, folder: &Path, all_done: bool) -> Result<(), crate::io::IoError> {
        let sent = snapshot::of_folder(folder).map(|bytes| self.shared.hub.publish_packed(bytes));
        self.shared.hub.report(match (&sent, all_done) {
            (Ok(()), true) => WireEvent::Finished(folder.display().to_string()),
            (Err(e), true) => WireEvent::Failed(format!("it is saved there, but cannot be sent: {e}")),
            (_, false) => WireEvent::Cancelled,
        });
        sent
    }

    /// Reports that a training has failed.
    pub(crate) fn failed(&self, why: String) {
        self.shared.hub.report(WireEvent::Failed(why));
    }

    /// Number of clients that are present, and number of them that have not received everything.
    pub(crate) fn watchers(&self) -> (usize, usize) {
        self.shared.hub.watchers()
    }

    /// Waits until all clients have received everything, nothing was sent to them for a minute, or `stop` returns true.
    pub(crate) fn see_off(&self, stop: impl Fn() -> bool) {
        let mut last = Instant::now();
        while self.watchers().1 > 0 && last.elapsed() < FAREWELL && !stop() {
            if self.shared.hub.sending.load(Ordering::Acquire) > 0 {
                last = Instant::now();
            }
            thread::sleep(Duration::from_millis(50));
        }
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        self.shared.stop.store(true, Ordering::Release);
        // A connection wakes the accepting thread, so that it sees `stop`.
        let ip = if self.address.ip().is_unspecified() { Ipv4Addr::LOCALHOST.into() } else { self.address.ip() };
        let woken = TcpStream::connect_timeout(&(ip, self.address.port()).into(), Duration::from_secs(1));
        if let Some(accepting) = self.accepting.take().filter(|_| woken.is_ok()) {
            let _ = accepting.join();
        }
    }
}

fn accept(listener: &TcpListener, shared: &Arc<Shared>) {
    for stream in listener.incoming() {
        if shared.stop.load(Ordering::Acquire) {
            return;
        }
        let Ok(stream) = stream else {
            // Too many files are open: a temporary error.
            thread::sleep(Duration::from_millis(50));
            continue;
        };
        let Some(seat) = shared.seats.take(&stream) else {
            let busy = Response::refusal(503, "too many connections").with("Retry-After", 1);
            // The answer fits into the system's send buffer, so this does not block.
            let _ = Connection::new(stream).answer(&busy);
            continue;
        };
        let of_thread = Arc::clone(shared);
        let work = move || {
            // Not every system lets a program lower its own priority; then the threads have equal priority.
            let _ = set_current_thread_priority(ThreadPriority::Min);
            talk(Connection::new(stream), &of_thread, &seat);
        };
        // Without a thread the connection is closed.
        let _ = thread::Builder::new().name("watcher".into()).spawn(work);
    }
}

/// Answers the requests of a connection, one after the other.
fn talk(mut connection: Connection, shared: &Shared, seat: &Seat) {
    while !shared.stop.load(Ordering::Acquire) {
        let mut of = None;
        let response = match connection.head() {
            Ok(None) => return,
            Ok(Some(head)) => answer(&mut connection, &head, (shared, seat), &mut of).unwrap_or_else(|refused| refused),
            Err(refused) => refused,
        };
        let response = response.with(VERSION_HEADER, version()).with(RUN_HEADER, &shared.hub.run);
        let sending = &shared.hub.sending;
        let large = response.is_large();
        sending.fetch_add(usize::from(large), Ordering::AcqRel);
        let sent = connection.answer(&response);
        sending.fetch_sub(usize::from(large), Ordering::AcqRel);
        if let Some(client) = of {
            shared.hub.answering(&client, false);
        }
        if sent.is_err() {
            return;
        }
        if response.last {
            return connection.end();
        }
    }
}

/// Returns the answer to a request; `of` becomes the name of the client, if the request has one.
fn answer(
    connection: &mut Connection,
    head: &RequestHead,
    (shared, seat): (&Shared, &Seat),
    of: &mut Option<String>,
) -> Result<Response, Response> {
    let (hub, options) = (&shared.hub, &shared.options);
    admit(head, options)?;
    connection.is_known = true;
    seat.keep();
    if let Some(client) = head.header(CLIENT_HEADER) {
        hub.answering(client, true);
        *of = Some(client.to_owned());
    }
    if !take_turn(&shared.bucket) {
        return Err(Response::refusal(429, "too many requests").with("Retry-After", 1));
    }
    let body = connection.body(head, if shared.editor.is_some() { EDIT_BYTES } else { ASK_BYTES })?;
    let since = head.number("since").unwrap_or(0);
    match (head.method.as_str(), head.path.as_str()) {
        ("GET", "/scene") => json(&hub.summary),
        ("GET", "/news") => json(&hub.news(head.header(CLIENT_HEADER), since, head.number("have").unwrap_or(0))),
        ("GET", "/snapshot") => Ok(match hub.snapshot(since) {
            Some(packed) => Response::new(200, "application/octet-stream", packed.bytes)
                .with(GENERATION_HEADER, packed.generation)
                .with(STEP_HEADER, packed.step),
            None => Response::new(204, "application/octet-stream", Arc::default()),
        }),
        ("GET", "/photo") => {
            let number = |name| head.number(name).unwrap_or(u64::MAX);
            let png = shared.photos.png(number("index"), number("side"));
            let missing = || Response::refusal(404, "this photo cannot be read on the server");
            png.map(|png| Response::new(200, "image/png", Arc::new(png))).ok_or_else(missing)
        }
        ("POST", "/ask") => {
            let ask = serde_json::from_slice(&body);
            obey(ask.map_err(|e| Response::refusal(400, format!("this cannot be asked for: {e}")))?, shared)
        }
        _ => Err(Response::refusal(404, "there is nothing here")),
    }
}

/// Refuses a request that is not from a client with the token, before anything else is read.
fn admit(head: &RequestHead, options: &ServeOptions) -> Result<(), Response> {
    // Guards against DNS rebinding: a page in a browser sends its own host name and an origin.
    let host = head.header("host").unwrap_or_default();
    let name = host.rsplit_once(':').filter(|(_, port)| port.bytes().all(|b| b.is_ascii_digit())).map_or(host, |h| h.0);
    let bare = name.trim_start_matches('[').trim_end_matches(']');
    let known = is_loopback(name)
        || options.hosts.iter().any(|known| known.eq_ignore_ascii_case(name))
        || (options.anywhere && bare.parse::<IpAddr>().is_ok());
    if !known {
        return Err(Response::refusal(421, "this server is not called so (--host NAME adds a name)"));
    }
    if head.has("origin") {
        return Err(Response::refusal(403, "pages have no business here"));
    }
    let token = head.header("authorization").and_then(|value| value.strip_prefix("Bearer "));
    if !token.is_some_and(|token| options.token.is(token)) {
        thread::sleep(WRONG_TOKEN);
        return Err(Response::refusal(401, "the token is missing or wrong: copy the whole address"));
    }
    let theirs = head.header(VERSION_HEADER).unwrap_or("none");
    if !is_understood(theirs) {
        let text = format!("the server speaks {}, the client {theirs}: install the same fmlgs on both", version());
        return Err(Response::refusal(426, text));
    }
    Ok(())
}

/// Takes a token from the bucket of the rate limit; returns whether the request may be answered now.
fn take_turn(bucket: &Mutex<(f64, Instant)>) -> bool {
    let mut bucket = bucket.lock().unwrap_or_else(PoisonError::into_inner);
    let since = bucket.1.elapsed().as_secs_f64();
    *bucket = ((bucket.0 + since * RATE).min(BURST), Instant::now());
    let may = bucket.0 >= 1.0;
    bucket.0 -= f64::from(u8::from(may));
    may
}

/// Executes a command of a client.
fn obey(ask: ClientRequest, shared: &Shared) -> Result<Response, Response> {
    match (ask, &shared.editor) {
        (ClientRequest::Pause(pause), _) => shared.hub.control.set_paused(pause),
        (ClientRequest::Cancel, _) => shared.hub.control.cancel(),
        (ClientRequest::Edit(edit), Some(editor)) => match editor
            .apply(edit, |snapshot| shared.hub.publish_packed(snapshot))
        {
            Ok(()) => {}
            Err(e) => return Ok(Response::new(422, "text/plain; charset=utf-8", Arc::new(e.to_string().into_bytes()))),
        },
        (ClientRequest::Edit(_), None) => {
            return Err(Response::refusal(403, "changes are not allowed here (fmlgs serve --allow-edit, at rest)"));
        }
    }
    Ok(Response::new(204, "application/json", Arc::default()))
}

fn json(value: &impl serde::Serialize) -> Result<Response, Response> {
    let bytes = serde_json::to_vec(value).map_err(|e| Response::refusal(500, e.to_string()))?;
    Ok(Response::new(200, "application/json", Arc::new(bytes)))
}
