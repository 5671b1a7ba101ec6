//! A server on this machine that answers each request as a test wants.

use std::io::{BufRead, BufReader, Write};
use std::net::{TcpListener, TcpStream};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// Response of the server to one request.
#[derive(Clone, Copy, Debug)]
pub enum Turn {
    /// Serves it, or the range that was asked for.
    Serve,
    /// Breaks off after so many bytes of the body.
    BreakAfter(usize),
    /// Says nothing more after so many bytes.
    StallAfter(usize),
    /// Claims to send so many bytes.
    Claim(usize),
    /// A page for display.
    Page,
    /// This status and nothing else.
    Status(u16),
    /// Redirects the client to another address.
    Redirect(&'static str),
    /// From now on another file.
    Change,
    /// Serves all of it, without regard to the requested range.
    IgnoreRange,
    /// A range that was not asked for.
    WrongRange,
    /// Says a range, and sends it from the start of the file.
    Restart,
    /// Accepts, and says nothing at all.
    Silent,
    /// So many bytes, then one now and then.
    DribbleAfter(usize),
    /// Never ends, in chunks of unknown number.
    Endless,
    /// Never ends, without a length.
    Unbounded,
}

/// Bytes that endless servers have sent.
pub static ENDLESS: AtomicUsize = AtomicUsize::new(0);

/// The requests that came, by their Range.
pub type Log = Arc<Mutex<Vec<Option<String>>>>;

pub struct Server {
    pub url: String,
    pub log: Log,
}

pub fn content(version: u8) -> Vec<u8> {
    (0..200_000_u32).map(|i| (i % 251) as u8 ^ version).collect()
}

/// Takes `turns` one after another, the last again and again.
pub fn server(turns: &[Turn]) -> Server {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    let url = format!("http://{}/model.onnx", listener.local_addr().expect("bound"));
    let log: Log = Arc::default();
    let (turns, seen) = (turns.to_vec(), Arc::clone(&log));
    std::thread::spawn(move || {
        let mut version = 0;
        for (n, stream) in listener.incoming().enumerate() {
            let Ok(mut stream) = stream else { return };
            let turn = turns[n.min(turns.len() - 1)];
            if matches!(turn, Turn::Change) {
                version += 1;
            }
            // One that stalls must not hold up the next.
            let seen = Arc::clone(&seen);
            std::thread::spawn(move || {
                // Whoever called may have gone: then there is nobody to tell.
                let _ = answer(&mut stream, turn, version, &seen);
            });
        }
    });
    Server { url, log }
}

fn answer(stream: &mut TcpStream, turn: Turn, version: u8, log: &Log) -> std::io::Result<()> {
    let (mut range, mut if_range) = (None, None);
    for line in BufReader::new(stream.try_clone()?).lines() {
        let line = line?;
        if line.is_empty() {
            break;
        }
        if let Some((name, value)) = line.split_once(": ") {
            match name.to_ascii_lowercase().as_str() {
                "range" => range = Some(value.to_owned()),
                "if-range" => if_range = Some(value.to_owned()),
                _ => {}
            }
        }
    }
    log.lock().expect("log").push(range.clone());
    let (all, tag) = (content(version), format!("\"v{version}\""));
    let start = range.as_deref().and_then(|r| r.strip_prefix("bytes=")?.strip_suffix('-')?.parse::<usize>().ok());
    let start = start.filter(|_| if_range.as_ref().is_none_or(|t| *t == tag));
    let start = start.filter(|_| !matches!(turn, Turn::IgnoreRange));
    let body = &all[start.unwrap_or(0).min(all.len())..];
    if matches!(turn, Turn::Silent) {
        std::thread::sleep(Duration::from_secs(20));
        return Ok(());
    }
    if matches!(turn, Turn::Endless | Turn::Unbounded) {
        return pour(stream, matches!(turn, Turn::Endless));
    }
    let body = if matches!(turn, Turn::Restart) { &all[..body.len()] } else { body };
    let mut head = match (turn, start) {
        (Turn::Page, _) => "HTTP/1.1 200 OK\r\nContent-Type: text/html; charset=utf-8\r\n".to_owned(),
        (Turn::Status(status), _) => format!("HTTP/1.1 {status} No\r\n"),
        (Turn::Redirect(to), _) => format!("HTTP/1.1 302 Found\r\nLocation: {to}\r\n"),
        (Turn::WrongRange, _) => format!("HTTP/1.1 206 Partial\r\nContent-Range: bytes 7-9/{}\r\n", all.len()),
        (_, Some(start)) => {
            format!("HTTP/1.1 206 Partial\r\nContent-Range: bytes {start}-{}/{}\r\n", all.len() - 1, all.len())
        }
        _ => "HTTP/1.1 200 OK\r\nContent-Type: application/octet-stream\r\n".to_owned(),
    };
    let claimed = match turn {
        Turn::Claim(bytes) => bytes,
        Turn::Status(_) | Turn::Redirect(_) => 0,
        _ => body.len(),
    };
    head += &format!("ETag: {tag}\r\nContent-Length: {claimed}\r\nConnection: close\r\n\r\n");
    stream.write_all(head.as_bytes())?;
    match turn {
        Turn::BreakAfter(n) => stream.write_all(&body[..n.min(body.len())]),
        Turn::StallAfter(n) => {
            stream.write_all(&body[..n.min(body.len())])?;
            std::thread::sleep(Duration::from_secs(20));
            Ok(())
        }
        Turn::DribbleAfter(n) => {
            stream.write_all(&body[..n.min(body.len())])?;
            for byte in &body[n.min(body.len())..] {
                stream.write_all(&[*byte])?;
                std::thread::sleep(Duration::from_millis(10));
            }
            Ok(())
        }
        Turn::Status(_) | Turn::Redirect(_) => Ok(()),
        _ => stream.write_all(body),
    }
}

/// Sends until the client closes the connection.
fn pour(stream: &mut TcpStream, chunked: bool) -> std::io::Result<()> {
    let coding = if chunked { "Transfer-Encoding: chunked\r\n" } else { "" };
    stream.write_all(format!("HTTP/1.1 200 OK\r\n{coding}Connection: close\r\n\r\n").as_bytes())?;
    let piece = [7; 1 << 16];
    loop {
        if chunked {
            stream.write_all(b"10000\r\n")?;
        }
        stream.write_all(&piece)?;
        if chunked {
            stream.write_all(b"\r\n")?;
        }
        ENDLESS.fetch_add(piece.len(), Ordering::Relaxed);
    }
}
