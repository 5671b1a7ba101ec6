//! The real binary as a server, and requests to it as bytes.
#![allow(dead_code)]

use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use crate::cli_support::command;

/// A server that runs; it is killed at the end.
pub struct Served {
    pub child: Child,
    /// Address with the token, as printed.
    pub url: String,
    pub at: String,
    pub token: String,
}

impl Served {
    /// Runs a command that serves, and reads the address that it prints.
    pub fn start(arguments: &[&str]) -> Self {
        let mut child = command(arguments).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        let mut lines = BufReader::new(child.stderr.take().unwrap()).lines();
        let mut said = Vec::new();
        let url = loop {
            let line = lines.next().unwrap_or_else(|| panic!("it ended: {said:?}")).unwrap();
            if let Some((_, url)) = line.split_once("fmlgs connect '") {
                break url.trim_end_matches('\'').to_owned();
            }
            said.push(line);
        };
        // What it says later is read off, so that it never waits for that.
        std::thread::Builder::new().spawn(move || lines.for_each(drop)).unwrap();
        let (place, token) = url.split_once('#').unwrap();
        let at = place.trim_start_matches("http://").trim_end_matches('/').to_owned();
        Self { child, at, token: token.into(), url }
    }

    /// Serves the scene at `path` at a free port.
    pub fn scene(path: &str, more: &[&str]) -> Self {
        Self::start(&[&["serve", path, "127.0.0.1:0"], more].concat())
    }

    /// The head of a request that is in order.
    pub fn head(&self, line: &str) -> String {
        let (at, token) = (&self.at, &self.token);
        format!("{line} HTTP/1.1\r\nHost: {at}\r\nAuthorization: Bearer {token}\r\nfmlgs-protocol: 1.0\r\n")
    }

    /// Answer to these bytes: status and the rest; 0 if it just ends the connection.
    pub fn answer(&self, bytes: &[u8]) -> (u16, Vec<u8>) {
        let mut stream = TcpStream::connect(&self.at).unwrap();
        stream.set_read_timeout(Some(Duration::from_secs(60))).unwrap();
        // It may have refused before it has read everything.
        let _ = stream.write_all(bytes);
        read_answer(&mut stream)
    }

    /// Answer to a valid request.
    pub fn get(&self, path: &str) -> (u16, Vec<u8>) {
        self.answer(format!("{}Connection: close\r\n\r\n", self.head(&format!("GET {path}"))).as_bytes())
    }

    /// Answer to a request of a client for data or an edit.
    pub fn ask(&self, wish: &str) -> (u16, Vec<u8>) {
        let length = wish.len();
        self.answer(format!("{}Content-Length: {length}\r\n\r\n{wish}", self.head("POST /ask")).as_bytes())
    }

    /// News since the number `since`.
    pub fn news(&self, since: u64) -> serde_json::Value {
        let (status, body) = self.get(&format!("/news?since={since}&have=0"));
        assert_eq!(status, 200);
        serde_json::from_slice(&body).unwrap()
    }

    /// Waits until its news meet a condition.
    pub fn wait(&self, wanted: impl Fn(&serde_json::Value) -> bool) {
        let until = Instant::now() + Duration::from_secs(120);
        while !wanted(&self.news(0)) {
            assert!(Instant::now() < until, "it does not come: {}", self.news(0));
            std::thread::sleep(Duration::from_millis(50));
        }
    }

    /// Its memory in use, MiB.
    #[cfg(target_os = "linux")]
    pub fn memory_mib(&self) -> u64 {
        let status = std::fs::read_to_string(format!("/proc/{}/status", self.child.id())).unwrap();
        let line = status.lines().find(|l| l.starts_with("VmRSS")).unwrap();
        line.split_whitespace().nth(1).unwrap().parse::<u64>().unwrap() / 1024
    }

    /// Sends it a signal, `-TERM` for example.
    pub fn signal(&self, signal: &str) {
        assert!(Command::new("kill").args([signal, &self.child.id().to_string()]).status().unwrap().success());
    }
}

impl Drop for Served {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Reads one answer: status and body; 0 if there is none.
pub fn read_answer(stream: &mut TcpStream) -> (u16, Vec<u8>) {
    let mut all = Vec::new();
    let mut piece = [0; 1 << 16];
    loop {
        if let Some(end) = all.windows(4).position(|w| w == b"\r\n\r\n") {
            let head = String::from_utf8_lossy(&all[..end]).to_lowercase();
            let length = head.lines().find_map(|l| l.strip_prefix("content-length: "));
            let length: usize = length.map_or(0, |l| l.parse().unwrap());
            if all.len() >= end + 4 + length {
                let status = head.split(' ').nth(1).unwrap().parse().unwrap();
                return (status, all[end + 4..end + 4 + length].to_vec());
            }
        }
        match stream.read(&mut piece) {
            Ok(n) if n > 0 => all.extend_from_slice(&piece[..n]),
            _ => return (0, all),
        }
    }
}
