//! Hostile clients: refused, nothing written, memory flat; clients with the token are answered meanwhile.

use std::io::Write;
use std::net::TcpStream;
use std::time::{Duration, Instant};

use rand::{Rng, RngExt, SeedableRng};

use super::served::{Served, read_answer};
use super::{scene, text};
use crate::cli_support::files_in;
use crate::cli_support::folder;

#[test]
fn whoever_is_no_client_with_the_token_is_refused() {
    let folder = folder();
    let scene = scene(folder.path());
    let before = files_in(&scene);
    let server = Served::scene(text(&scene), &[]);
    let good = server.head("GET /scene");
    let refused = |request: String, status: u16| {
        let (got, body) = server.answer(format!("{request}\r\n").as_bytes());
        assert_eq!(got, status, "{request}: {}", String::from_utf8_lossy(&body));
        String::from_utf8(body).unwrap()
    };
    let with = |from: &str, to: &str| {
        assert!(good.contains(from));
        good.replace(from, to)
    };
    assert_eq!(server.answer(format!("{good}\r\n").as_bytes()).0, 200, "the right token is answered");
    let token = &server.token;
    for (wrong, status) in [
        (with(&format!("Authorization: Bearer {token}\r\n"), ""), 401),
        (with(token, &"0".repeat(64)), 401),
        (with(token, &token[..63]), 401),
        (with(token, &format!("{token}0")), 401),
        (with("Bearer ", "Basic "), 401),
        (format!("{good}Authorization: Bearer {token}\r\n"), 401),
        (good.replace("/scene", &format!("/scene?token={token}")).replace(&format!("Bearer {token}"), ""), 401),
        (format!("{good}Origin: http://127.0.0.1:7070\r\n"), 403),
        (format!("{good}Origin: null\r\n"), 403),
        (with(&server.at, "rebound.example"), 421),
        (with(&server.at, "127.0.0.1.rebound.example:80"), 421),
        (with(&server.at, "192.168.0.9"), 421),
        (with(&format!("Host: {}\r\n", server.at), ""), 421),
        (format!("{good}Host: {}\r\n", server.at), 421),
    ] {
        refused(wrong, status);
    }
    let versions = refused(with("fmlgs-protocol: 1.0", "fmlgs-protocol: 2.3 (fmlgs 9.9.9)"), 426);
    assert!(versions.contains("1.0 (fmlgs") && versions.contains("2.3 (fmlgs 9.9.9)"), "{versions}");
    assert!(files_in(&scene) == before);
}

#[test]
fn paths_methods_and_sizes_lead_nowhere() {
    let folder = folder();
    let scene = scene(folder.path());
    let before = files_in(&scene);
    let server = Served::scene(text(&scene), &["--allow-edit"]);
    for path in [
        "/",
        "/scene/",
        "/scene.json",
        "/../scene.json",
        "/scene/../../etc/passwd",
        "/%2e%2e/%2e%2e/etc/passwd",
        "//etc/passwd",
        "/..\\..\\scene.json",
        "/snapshot/point_cloud.ply",
        "/ask",
    ] {
        assert_eq!(server.get(path).0, 404, "{path}");
    }
    for target in ["http://127.0.0.1/scene", "file:///etc/passwd", "*", "scene", ""] {
        assert_eq!(server.get(target).0, 400, "{target}");
    }
    for method in ["POST", "PUT", "DELETE", "OPTIONS", "TRACE", "CONNECT"] {
        assert_eq!(server.answer(format!("{}\r\n", server.head(&format!("{method} /scene"))).as_bytes()).0, 404);
    }
    let ask = server.head("POST /ask");
    for (lines, status) in [
        ("Content-Length: 1000000000000\r\n\r\n", 413),
        ("Content-Length: 99999999999999999999999999\r\n\r\n", 413),
        ("Content-Length: -1\r\n\r\n", 400),
        ("Content-Length: 2\r\nContent-Length: 3\r\n\r\n{}", 400),
        ("Transfer-Encoding: chunked\r\n\r\n0\r\n\r\n", 400),
        ("Content-Length: 2\r\n\r\n{}", 400),
        ("Content-Length: 7\r\n\r\n\"Write\"", 400),
        ("Content-Length: 28\r\n\r\n{\"Open\":{\"path\":\"/etc/hosts\"}", 400),
    ] {
        assert_eq!(server.answer(format!("{ask}{lines}").as_bytes()).0, status, "{lines}");
    }
    let nested = "[".repeat(100_000);
    assert_eq!(server.ask(&nested).0, 400);
    assert_eq!(server.answer(format!("GET /{} HTTP/1.1\r\n", "x".repeat(1 << 20)).as_bytes()).0, 431);
    assert_eq!(server.answer(format!("{}{}\r\n", server.head("GET /scene"), "A: b\r\n".repeat(99)).as_bytes()).0, 431);
    assert_eq!(server.get("/news?since=99999999999999999999&have=-1").0, 200, "a number that is none counts as 0");
    assert!(files_in(&scene) == before);
}

#[test]
fn ten_thousand_random_messages_change_nothing() {
    let folder = folder();
    let scene = scene(folder.path());
    let before = files_in(&scene);
    let server = Served::scene(text(&scene), &["--allow-edit"]);
    let mut random = rand_pcg::Pcg64Mcg::seed_from_u64(7);
    let good = format!("{}Content-Length: 16\r\n\r\n{{\"Pause\": false }}", server.head("POST /ask")).into_bytes();
    let message = |random: &mut rand_pcg::Pcg64Mcg| {
        let mut bytes = if random.random_bool(0.5) { good.clone() } else { vec![0; random.random_range(1..4000)] };
        match random.random_range(0..4) {
            // Noise; a few bytes changed; cut off; with the token, and noise after it.
            0 => random.fill_bytes(&mut bytes),
            1 => (0..8).for_each(|_| {
                let at = random.random_range(0..bytes.len());
                bytes[at] = random.random();
            }),
            2 => bytes.truncate(random.random_range(1..=bytes.len())),
            _ => {
                let mut noise = vec![0; random.random_range(1..400)];
                random.fill_bytes(&mut noise);
                bytes.extend(noise);
            }
        }
        bytes
    };
    let send = |bytes: &[u8]| {
        let mut stream = TcpStream::connect(&server.at).unwrap();
        let _ = stream.write_all(bytes);
    };
    (0..500).for_each(|_| send(&message(&mut random)));
    #[cfg(target_os = "linux")]
    let memory = server.memory_mib();
    (0..10_000).for_each(|_| send(&message(&mut random)));
    let until = Instant::now() + Duration::from_secs(60);
    while server.get("/scene").0 != 200 {
        assert!(Instant::now() < until, "nobody is answered any more");
        std::thread::sleep(Duration::from_millis(50));
    }
    #[cfg(target_os = "linux")]
    {
        let after = server.memory_mib();
        println!("10,000 random messages: {memory} MiB before, {after} MiB after");
        assert!(after < memory + 24, "{memory} MiB became {after} MiB");
    }
    assert!(files_in(&scene) == before);
}

#[test]
fn who_drips_or_stands_still_holds_up_nobody() {
    let folder = folder();
    // Numbers that do not pack: more than the system keeps of what nobody reads (32 MiB and 4).
    let splat = folder.path().join("large.ply");
    let mut random = rand_pcg::Pcg64Mcg::seed_from_u64(3);
    let mut three = || (0..1_500_000).map(|_| [random.random(), random.random(), random.random()]).collect();
    let mut cloud = fmlgs::scene::GaussianCloud::isotropic(three(), -3.0, 1.0);
    (cloud.log_scales, cloud.sh) = (three(), three());
    fmlgs::io::splat_ply::write(&splat, &cloud).unwrap();
    let server = Served::scene(text(&splat), &[]);
    let connect = || TcpStream::connect(&server.at).unwrap();
    let mut stalled: Vec<TcpStream> = (0..4).map(|_| connect()).collect();
    for stream in &mut stalled {
        stream.write_all(format!("{}\r\n", server.head("GET /snapshot?since=0")).as_bytes()).unwrap();
    }
    for stream in &stalled {
        assert!(stream.peek(&mut [0]).unwrap() > 0, "the answer begins");
    }
    let mut dripping: Vec<TcpStream> = (0..8).map(|_| connect()).collect();
    let request = server.head("GET /scene");
    let start = Instant::now();
    for byte in request.bytes().cycle() {
        // Until the server has ended all of these.
        dripping.retain_mut(|stream| stream.write_all(&[byte]).is_ok());
        assert_eq!(server.get("/scene").0, 200, "others are answered");
        if dripping.is_empty() {
            break;
        }
        assert!(start.elapsed() < Duration::from_secs(120), "{} still drip", dripping.len());
        std::thread::sleep(Duration::from_millis(100));
    }
    let (status, sent) = server.get("/snapshot?since=0");
    assert_eq!(status, 200, "Gaussians are sent to others");
    assert!(sent.len() > 40 << 20, "{} bytes, of which the system may keep all", sent.len());
    // Who stood still for too long gets no whole answer any more.
    std::thread::sleep(Duration::from_secs(12));
    for stream in &mut stalled {
        stream.set_read_timeout(Some(Duration::from_secs(5))).unwrap();
        assert_eq!(read_answer(stream).0, 0);
    }
}

#[test]
fn who_has_not_shown_the_token_keeps_nobody_out() {
    let folder = folder();
    let server = Served::scene(text(&scene(folder.path())), &[]);
    let connect = || TcpStream::connect(&server.at).unwrap();
    // One that has shown it, and keeps its connection.
    let request = format!("{}\r\n", server.head("GET /scene"));
    let mut known = connect();
    known.write_all(request.as_bytes()).unwrap();
    assert_eq!(read_answer(&mut known).0, 200);
    let mut dripping: Vec<TcpStream> = Vec::new();
    for byte in request.bytes().take(20) {
        // All of them begin a request, and those that were ended come again.
        dripping.retain_mut(|stream| stream.write_all(&[byte]).is_ok());
        dripping.resize_with(200, connect);
        assert_eq!(server.get("/scene").0, 200, "a new client is answered");
    }
    known.write_all(request.as_bytes()).unwrap();
    assert_eq!(read_answer(&mut known).0, 200, "who is known stays");
}

#[test]
fn too_many_connections_are_turned_away_and_come_in_later() {
    let folder = folder();
    let server = Served::scene(text(&scene(folder.path())), &[]);
    let known: Vec<TcpStream> = (0..32)
        .map(|_| {
            let mut stream = TcpStream::connect(&server.at).unwrap();
            stream.write_all(format!("{}\r\n", server.head("GET /scene")).as_bytes()).unwrap();
            assert_eq!(read_answer(&mut stream).0, 200);
            stream
        })
        .collect();
    let until = Instant::now() + Duration::from_secs(60);
    while server.get("/scene").0 != 503 {
        assert!(Instant::now() < until, "more than 32 connections were let in");
    }
    drop(known);
    while server.get("/scene").0 != 200 {
        assert!(Instant::now() < until, "nobody comes in again");
        std::thread::sleep(Duration::from_millis(50));
    }
}
