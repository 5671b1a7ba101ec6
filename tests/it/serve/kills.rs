//! Either side is killed at random moments: the other continues, and a client that reconnects is taken up again.

use std::net::TcpListener;
use std::process::Stdio;
use std::time::Duration;

use fmlgs::io::trained;
use rand::{RngExt, SeedableRng};

use super::served::Served;
use super::{text, training};
use crate::cli_support::{Done, command, folder, tiny_dataset};

/// Kills of each side.
fn kills() -> u64 {
    std::env::var("FMLGS_KILLS").ok().and_then(|n| n.parse().ok()).unwrap_or(3)
}

#[test]
fn a_client_follows_a_server_that_is_killed_again_and_again() {
    let folder = folder();
    let (photos, out, got) = (tiny_dataset(folder.path()), folder.path().join("out"), folder.path().join("got.ply"));
    let token = folder.path().join("token");
    // A port that was free a moment ago, for all runs.
    let at = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().to_string();
    let steps = (300 + 200 * kills()).to_string();
    let mut arguments = training(text(&photos), text(&out), &steps);
    *arguments.last_mut().unwrap() = &at;
    arguments.extend(["--token-file", text(&token)]);
    let mut random = rand_pcg::Pcg64Mcg::seed_from_u64(11);
    let mut server = Served::start(&arguments);
    let url = server.url.clone();
    let watch = ["connect", &url, "--headless", "--save", text(&got), "--json"];
    let client = command(&watch).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let mut killed = 0;
    for _ in 0..kills() {
        std::thread::sleep(Duration::from_millis(random.random_range(0..400)));
        if server.child.try_wait().unwrap().is_some() {
            break;
        }
        server.signal("-KILL");
        server.child.wait().unwrap();
        killed += 1;
        server = Served::start(&arguments);
        assert_eq!(server.url, url, "the token is kept");
    }
    let done = Done::from(client.wait_with_output().unwrap()).ok();
    println!("server: {killed} killed; the client lost it {} times", done.stderr.matches("trying again").count());
    assert_eq!(done.json()["end"], "finished");
    assert!(killed > 0 && std::fs::read(&got).unwrap() == std::fs::read(out.join(trained::CLOUD_FILE)).unwrap());
}

#[test]
fn a_training_does_not_care_whose_client_is_killed() {
    let folder = folder();
    let (photos, out) = (tiny_dataset(folder.path()), folder.path().join("out"));
    let alone = folder.path().join("alone");
    let steps = (300 + 100 * kills()).to_string();
    let mut server = Served::start(&training(text(&photos), text(&out), &steps));
    let mut random = rand_pcg::Pcg64Mcg::seed_from_u64(12);
    let mut killed = 0;
    for _ in 0..kills() {
        let mut client = command(&["connect", &server.url, "--headless", "-q"]);
        let mut client = client.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
        std::thread::sleep(Duration::from_millis(random.random_range(0..400)));
        killed += u64::from(client.try_wait().unwrap().is_none());
        client.kill().unwrap();
        client.wait().unwrap();
    }
    println!("client: {killed} killed");
    assert_eq!(server.child.wait().unwrap().code(), Some(0));
    // The result is what it is without anybody who watches.
    let mut arguments = training(text(&photos), text(&alone), &steps);
    arguments.truncate(arguments.len() - 2);
    Done::from(command(&arguments).output().unwrap()).ok();
    let cloud = |folder| trained::load(folder).unwrap().cloud;
    assert!(killed > 0 && cloud(&out) == cloud(&alone));
}
