//! Downloads from a server on this machine that stalls, breaks off, lies about lengths, sends web
//! pages, and changes its mind: the file is right or there is a clear error, and nothing is lost.
#![allow(clippy::disallowed_methods)] // A server for a second needs no name.

mod server;

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use fmlgs::models::fetch::{FetchError, FileToFetch, MOST_UNPROMISED, Timeouts, fetch, sha256};

use self::server::{ENDLESS, Server, Turn, content, server};
use crate::common::NOBODY;

fn impatient() -> Timeouts {
    Timeouts { stall: Duration::from_millis(300), attempts: 3, pause: Duration::from_millis(5) }
}

struct Place {
    _folder: tempfile::TempDir,
    to: PathBuf,
}

fn place() -> Place {
    let folder = tempfile::tempdir().expect("folder");
    let to = folder.path().join("deep").join("model.onnx");
    Place { _folder: folder, to }
}

fn digest(version: u8) -> String {
    let folder = tempfile::tempdir().expect("folder");
    let path = folder.path().join("x");
    fs::write(&path, content(version)).expect("written");
    sha256(&path).expect("read")
}

fn get(server: &Server, to: &Path, bytes: Option<u64>, sha256: Option<&str>) -> Result<(), FetchError> {
    fetch(&FileToFetch { url: &server.url, to, bytes, most: MOST_UNPROMISED, sha256 }, impatient(), &mut |_, _| true)
}

fn is_right(to: &Path, version: u8) -> bool {
    let leftovers = fs::read_dir(to.parent().expect("folder")).expect("listed").count();
    fs::read(to).expect("there") == content(version) && leftovers == 1
}

#[test]
fn a_file_arrives_whole_and_is_checked() {
    let (s, p, digest) = (server(&[Turn::Serve]), place(), digest(0));
    let mut seen = Vec::new();
    let wanted =
        FileToFetch { url: &s.url, to: &p.to, bytes: Some(200_000), most: MOST_UNPROMISED, sha256: Some(&digest) };
    fetch(&wanted, impatient(), &mut |there, all| {
        seen.push((there, all));
        true
    })
    .expect("fetched");
    assert!(is_right(&p.to, 0));
    assert_eq!((seen[0], *seen.last().expect("told")), ((0, Some(200_000)), (200_000, Some(200_000))));
}

#[test]
fn what_breaks_off_or_stalls_is_gone_on_with() {
    let turns = [Turn::BreakAfter(70_000), Turn::StallAfter(50_000), Turn::Serve];
    let (s, p) = (server(&turns), place());
    get(&s, &p.to, None, Some(&digest(0))).expect("fetched at the third attempt");
    assert!(is_right(&p.to, 0));
    let log = s.log.lock().expect("log");
    assert_eq!(*log, [None, Some("bytes=70000-".to_owned()), Some("bytes=120000-".to_owned())]);
}

#[test]
fn a_server_that_stays_silent_is_given_up_and_what_came_is_kept() {
    let (s, p) = (server(&[Turn::StallAfter(10_000), Turn::StallAfter(0)]), place());
    let error = get(&s, &p.to, None, None).expect_err("silent");
    assert!(matches!(error, FetchError::Stalled { got: 10_000, .. }), "{error}");
    assert!(!p.to.exists());
    // Another day, another connection: only the rest is asked for.
    let part = p.to.with_file_name("model.onnx.part");
    assert_eq!(fs::metadata(part).expect("kept").len(), 10_000);
}

#[test]
fn lengths_that_are_lies_are_found_out() {
    // More than there is: the connection ends early, again and again.
    let (s, p) = (server(&[Turn::Claim(300_000), Turn::Status(503)]), place());
    let error = get(&s, &p.to, None, None).expect_err("short");
    assert!(matches!(error, FetchError::Refused { status: 503, .. }), "{error}");
    assert!(!p.to.exists());
    // Less than there is: the file is cut, which its checksum tells, and its known size at once.
    let (s, p) = (server(&[Turn::Claim(150_000)]), place());
    let error = get(&s, &p.to, None, Some(&digest(0))).expect_err("cut");
    assert!(matches!(error, FetchError::Checksum { .. }), "{error}");
    let error = get(&s, &p.to, Some(200_000), None).expect_err("cut");
    assert!(matches!(error, FetchError::OtherSize { offered: 150_000, expected: 200_000, .. }), "{error}");
    assert!(!p.to.exists());
}

#[test]
fn pages_and_refusals_are_no_files() {
    let (s, p) = (server(&[Turn::Page]), place());
    let error = get(&s, &p.to, None, None).expect_err("a page");
    assert!(matches!(error, FetchError::WebPage { .. }), "{error}");
    let (s, p2) = (server(&[Turn::Status(404)]), place());
    let error = get(&s, &p2.to, None, None).expect_err("not there");
    assert!(matches!(error, FetchError::Refused { status: 404, .. }) && s.log.lock().expect("log").len() == 1);
    assert!(!p.to.exists() && !p2.to.exists());
}

#[test]
fn a_server_that_sends_elsewhere_gets_no_file_of_this_machine() {
    let secret = format!("file://{}/Cargo.toml", env!("CARGO_MANIFEST_DIR"));
    for to in [&*secret.leak(), "/model.onnx", "gopher://127.0.0.1/model.onnx", "//"] {
        let (s, p) = (server(&[Turn::Redirect(to)]), place());
        let error = get(&s, &p.to, None, None).expect_err("nothing to be had");
        // An address of no server is named; one of a server is asked, but not for ever.
        match to == "/model.onnx" {
            true => {
                assert!(matches!(error, FetchError::Unreachable { .. } | FetchError::Refused { .. }), "{to}: {error}")
            }
            false => {
                assert!(matches!(&error, FetchError::Elsewhere { to: told, .. } if told == to), "{to}: {error}");
                assert_eq!(s.log.lock().expect("log").len(), 1, "{to}: nothing else is asked for");
            }
        }
        assert_eq!(fs::read_dir(p.to.parent().expect("folder")).expect("listed").count(), 0, "{to}: something is left");
        assert!(s.log.lock().expect("log").len() < 100, "{to}: it goes round in circles");
    }
}

#[test]
fn a_server_that_sends_to_another_address_is_followed() {
    let (s, p) = (server(&[Turn::Redirect("/moved/model.onnx"), Turn::Redirect("newest.onnx"), Turn::Serve]), place());
    get(&s, &p.to, None, Some(&digest(0))).expect("fetched");
    assert!(is_right(&p.to, 0) && s.log.lock().expect("log").len() == 3);
    // What broke off is gone on with behind a redirect, too.
    let turns = [Turn::BreakAfter(70_000), Turn::Redirect("/moved/model.onnx"), Turn::Serve];
    let (s, p) = (server(&turns), place());
    get(&s, &p.to, None, Some(&digest(0))).expect("fetched");
    let rest = Some("bytes=70000-".to_owned());
    assert!(is_right(&p.to, 0) && *s.log.lock().expect("log") == [None, rest.clone(), rest]);
}

#[test]
fn a_file_that_changes_on_the_way_is_fetched_anew() {
    let (s, p) = (server(&[Turn::BreakAfter(70_000), Turn::Change, Turn::Serve]), place());
    get(&s, &p.to, None, None).expect("fetched");
    assert!(is_right(&p.to, 1), "not half of each");
    // Without its tag, the two halves would have been joined; the checksum refuses that.
    let (s, p) = (server(&[Turn::Serve]), place());
    let part = p.to.with_file_name("model.onnx.part");
    fs::create_dir_all(part.parent().expect("folder")).expect("made");
    fs::write(&part, &content(1)[..70_000]).expect("written");
    let error = get(&s, &p.to, None, Some(&digest(0))).expect_err("half of each");
    assert!(matches!(error, FetchError::Checksum { .. }) && !part.exists(), "{error}");
    get(&s, &p.to, None, Some(&digest(0))).expect("fetched anew");
    assert!(is_right(&p.to, 0));
}

#[test]
fn servers_that_cannot_resume_send_all_again() {
    let turns = [Turn::BreakAfter(70_000), Turn::IgnoreRange];
    let (s, p) = (server(&turns), place());
    get(&s, &p.to, None, None).expect("fetched");
    assert!(is_right(&p.to, 0));
    let turns = [Turn::BreakAfter(70_000), Turn::WrongRange, Turn::Serve];
    let (s, p) = (server(&turns), place());
    get(&s, &p.to, None, None).expect("fetched");
    assert!(is_right(&p.to, 0));
}

#[test]
fn a_swapped_file_is_refused() {
    let (s, p) = (server(&[Turn::Serve]), place());
    let error = get(&s, &p.to, None, Some(&digest(7))).expect_err("another file");
    assert!(matches!(error, FetchError::Checksum { .. }), "{error}");
    assert!(!p.to.exists() && !p.to.with_file_name("model.onnx.part").exists());
}

#[test]
fn without_a_network_the_error_says_what_to_do() {
    let p = place();
    let url = format!("{NOBODY}/model.onnx");
    let error = fetch(
        &FileToFetch { url: &url, to: &p.to, bytes: None, most: MOST_UNPROMISED, sha256: None },
        impatient(),
        &mut |_, _| true,
    );
    let error = error.expect_err("nobody there");
    assert!(matches!(error, FetchError::Unreachable { .. }));
    assert!(error.to_string().contains("bring the file yourself"), "{error}");
}

#[test]
fn cancelling_keeps_what_arrived() {
    let (s, p) = (server(&[Turn::Serve]), place());
    let wanted = FileToFetch { url: &s.url, to: &p.to, bytes: None, most: MOST_UNPROMISED, sha256: None };
    let error = fetch(&wanted, impatient(), &mut |there, _| there < 60_000).expect_err("cancelled");
    let FetchError::Cancelled { got } = error else { panic!("{error}") };
    assert!((60_000..200_000).contains(&got));
    get(&s, &p.to, None, None).expect("fetched");
    assert_eq!(s.log.lock().expect("log")[1], Some(format!("bytes={got}-")));
    assert!(is_right(&p.to, 0));
}

#[test]
fn downloads_stop_at_the_size_that_was_promised() {
    for turn in [Turn::Endless, Turn::Unbounded] {
        let (s, p) = (server(&[turn]), place());
        let before = ENDLESS.load(Ordering::Relaxed);
        let error = get(&s, &p.to, Some(20_000), Some(&digest(0))).expect_err("too much");
        assert!(matches!(error, FetchError::OtherSize { expected: 20_000, .. }), "{turn:?}: {error}");
        // What a socket holds is sent before anybody sees that nobody takes it.
        assert!(ENDLESS.load(Ordering::Relaxed) - before < 32 << 20, "{turn:?}");
        assert_eq!(fs::read_dir(p.to.parent().expect("folder")).expect("listed").count(), 0, "nothing is left");
    }
    // Whose size nobody knows is a description.
    let (s, p) = (server(&[Turn::Endless]), place());
    let error = get(&s, &p.to, None, None).expect_err("too much");
    assert!(matches!(error, FetchError::TooLarge { most: MOST_UNPROMISED, .. }), "{error}");
    assert_eq!(fs::read_dir(p.to.parent().expect("folder")).expect("listed").count(), 0);
    let (s, p) = (server(&[Turn::Claim(1 << 30)]), place());
    let error = get(&s, &p.to, None, None).expect_err("too much");
    assert!(matches!(error, FetchError::TooLarge { .. }) && s.log.lock().expect("log").len() == 1, "{error}");
}

#[test]
fn a_range_that_begins_anew_is_no_rest() {
    let (s, p) = (server(&[Turn::BreakAfter(70_000), Turn::Restart, Turn::Serve]), place());
    let error = get(&s, &p.to, Some(200_000), Some(&digest(0))).expect_err("its start twice");
    assert!(matches!(error, FetchError::Checksum { .. }), "{error}");
    assert_eq!(fs::read_dir(p.to.parent().expect("folder")).expect("listed").count(), 0);
    get(&s, &p.to, Some(200_000), Some(&digest(0))).expect("fetched anew");
    assert!(is_right(&p.to, 0));
}

#[test]
fn what_dribbles_is_as_good_as_silent() {
    let (s, p) = (server(&[Turn::DribbleAfter(50_000)]), place());
    let error = get(&s, &p.to, Some(200_000), Some(&digest(0))).expect_err("a byte now and then");
    let FetchError::Stalled { got, .. } = error else { panic!("{error}") };
    assert!((50_000..200_000).contains(&got) && s.log.lock().expect("log").len() == 3);
}

#[test]
fn a_silent_download_ends_when_somebody_asks() {
    // Generous, yet shorter than the server's silence and the download's patience.
    const SOON: Duration = Duration::from_secs(10);
    let patient = Timeouts { stall: Duration::from_secs(60), ..impatient() };
    for (turn, kept) in [(Turn::Silent, 0), (Turn::StallAfter(10_000), 10_000), (Turn::DribbleAfter(10_000), 10_000)] {
        let (s, p) = (server(&[turn]), place());
        let wanted = FileToFetch { url: &s.url, to: &p.to, bytes: Some(200_000), most: MOST_UNPROMISED, sha256: None };
        let mut asked: Option<Instant> = None;
        let error = fetch(&wanted, patient, &mut |there, _| {
            let is_asked = !s.log.lock().expect("log").is_empty();
            if asked.is_none() && is_asked && there >= kept {
                asked = Some(Instant::now());
            }
            asked.is_none_or(|at| at.elapsed() < Duration::from_millis(50))
        });
        let error = error.expect_err("ended");
        assert!(matches!(error, FetchError::Cancelled { got } if got >= kept), "{turn:?}: {error}");
        let took = asked.expect("asked").elapsed();
        println!("{turn:?}: ended {:.0} ms after it was asked to, 50 ms of them waited here", took.as_secs_f64() * 1e3);
        assert!(took < SOON, "{turn:?}: {took:?}");
    }
    // The pause before another attempt, too.
    let (s, p) = (server(&[Turn::Status(503)]), place());
    let slow = Timeouts { pause: Duration::from_secs(60), ..impatient() };
    let begin = Instant::now();
    let wanted = FileToFetch { url: &s.url, to: &p.to, bytes: None, most: MOST_UNPROMISED, sha256: None };
    let error = fetch(&wanted, slow, &mut |_, _| s.log.lock().expect("log").is_empty()).expect_err("ended");
    assert!(matches!(error, FetchError::Cancelled { .. }) && begin.elapsed() < SOON, "{error}");
}

#[test]
fn one_file_is_fetched_by_one_program_at_a_time() {
    let (s, p) = (server(&[Turn::BreakAfter(70_000), Turn::Serve]), place());
    let part = p.to.with_file_name("model.onnx.part");
    fs::create_dir_all(part.parent().expect("folder")).expect("made");
    let other = fs::File::create(&part).expect("made");
    other.lock().expect("locked");
    let error = get(&s, &p.to, None, None).expect_err("busy");
    assert!(matches!(error, FetchError::File { .. }) && error.to_string().contains("another program"), "{error}");
    drop(other);
    get(&s, &p.to, None, None).expect("fetched");
    assert!(is_right(&p.to, 0));
}
