//! Servers on this machine: found and tested, without any data of a scene.

use super::*;

#[test]
fn servers_on_this_machine_are_found_and_tested_and_nothing_of_a_scene_is_sent() {
    use fmlgs::agent::llm::discover::{find, test};
    let list = || Say::Raw(json!({ "data": [{ "id": "qwen3" }, { "id": "small" }] }).to_string());
    let never = AtomicBool::new(false);
    let server = Server::new(vec![list()]);
    let port = server.url.trim_end_matches("/v1").rsplit(':').next().and_then(|p| p.parse().ok()).expect("a port");
    let found = find(&[("Test", port), ("Nobody", 9)], &never);
    assert_eq!(found.len(), 1, "{found:?}");
    assert_eq!((found[0].kind, found[0].base_url.as_str()), ("Test", server.url.as_str()));
    assert_eq!(found[0].models, ["qwen3", "small"]);
    assert!(server.seen.lock().expect("log")[0].body.is_empty());
    let tried = |script: Vec<Say>, model: &str| {
        let server = Server::new(script);
        let settings = LlmSettings { base_url: server.url.clone(), model: model.into(), ..LlmSettings::default() };
        (test(&settings, &timeouts(), &never), server)
    };
    let (well, server) = tried(vec![list(), text("OK")], "qwen3");
    assert!(well.is_ok_and(|t| t.contains("qwen3 answers")));
    assert!(!server.seen.lock().expect("log")[1].body.contains("SCENE"));
    for (script, model, says) in [
        (vec![list()], "other", "no model 'other'; it has: qwen3, small"),
        (vec![Say::Status(401, String::new(), String::new())], "qwen3", "wants a key"),
        (vec![list(), Say::Status(400, String::new(), "no tools here".into())], "qwen3", "no tools here"),
        (vec![list(), Say::Raw("<html>".into())], "qwen3", "no JSON"),
        (vec![Say::Silence], "qwen3", "said nothing"),
    ] {
        let problem = tried(script, model).0.expect_err(says);
        assert!(problem.contains(says), "{says}: {problem}");
    }
    let nobody = LlmSettings { base_url: "http://127.0.0.1:9/v1".into(), model: "m".into(), ..LlmSettings::default() };
    assert!(test(&nobody, &timeouts(), &never).expect_err("nobody there").contains("start the server"));
}
