//! Content of a page, read like in a browser.

use std::io::Read;

use flate2::read::GzDecoder;

use super::*;

/// Text of the element with this id.
pub(crate) fn element<'a>(html: &'a str, id: &str) -> &'a str {
    let (_, after) = html.split_once(&format!("id=\"{id}\">")).expect(id);
    after.split_once("</script>").expect("its end").0
}

/// Bytes encoded in an element.
pub(crate) fn carried(html: &str, id: &str) -> Vec<u8> {
    let packed = base64::decode(element(html, id)).expect("base64");
    let mut bytes = Vec::new();
    GzDecoder::new(&packed[..]).read_to_end(&mut bytes).expect("gzip");
    bytes
}

fn page(title: &str, name: &str) -> Page {
    let identity = PageIdentity {
        id: 1,
        parent: 0,
        name: name.into(),
        full: name.into(),
        count: 1,
        color: [1, 2, 3],
        center: [0.0; 3],
        radius: 1.0,
        from: None,
    };
    let view = PageView { center: [0.0; 3], rotation: [0.0, 0.0, 0.0, 1.0], fov: 0.8, aspect: 1.5 };
    Page {
        title: title.into(),
        facts: "1 Gaussian".into(),
        date: "2026-01-01".into(),
        scene: PageScene {
            identities: vec![identity],
            origin: [0.0; 3],
            view,
            up: [0.0, -1.0, 0.0],
            focus: [0.0; 3],
            distance: 1.0,
            background: [0.0; 3],
            antialias: false,
            paths: Vec::new(),
        },
        gaussians: vec![1, 2, 3],
        identities: vec![1, 0, 0],
        asked: Some(PageQuestions { scene: b"{}".to_vec(), words: "lamp mug".into() }),
    }
}

#[test]
fn a_page_carries_what_it_was_given() {
    let html = page("The workshop", "mug").html().expect("made");
    assert!(html.starts_with("<!DOCTYPE html>") && html.contains("<title>The workshop</title>"));
    assert!(!html.contains("{{"), "every field is filled");
    assert_eq!((carried(&html, "gaussians"), carried(&html, "identities")), (vec![1, 2, 3], vec![1, 0, 0]));
    assert_eq!((carried(&html, "asked"), carried(&html, "dictionary")), (b"{}".to_vec(), b"lamp mug".to_vec()));
    assert!(carried(&html, "language").starts_with(b"\0asm"));
    let unasked = Page { asked: None, ..page("The workshop", "mug") }.html().expect("made");
    assert!(unasked.len() + 900_000 < html.len(), "a scene without objects carries no language");
    assert_eq!(carried(&html, "renderer"), RENDERER);
    let scene: serde_json::Value = serde_json::from_str(element(&html, "scene")).expect("JSON");
    assert_eq!((&scene["identities"][0]["name"], &scene["view"]["fov"]), (&"mug".into(), &0.8.into()));
    assert!(html.contains("Permission is hereby granted, free of charge"), "the renderer's license comes with it");
}

#[test]
fn foreign_text_stays_text() {
    let hostile = "</script><img src=x onerror=alert(1)>{{renderer}}<!--";
    let html = page(hostile, hostile).html().expect("made");
    let plain = page("a", "b").html().expect("made");
    let tags =
        |html: &str| (html.matches("<script").count(), html.matches("<img").count(), html.matches("<!--").count());
    assert_eq!(tags(&html), tags(&plain), "no tag more");
    let scene: serde_json::Value = serde_json::from_str(element(&html, "scene")).expect("JSON");
    assert_eq!(scene["identities"][0]["name"], hostile, "and nothing is lost");
    assert!(html.contains("&lt;/script&gt;&lt;img src=x onerror=alert(1)&gt;{{renderer}}"), "fields are filled once");
}

#[test]
fn the_browser_is_told_to_run_this_script_and_to_ask_for_nothing() {
    let html = page("a", "b").html().expect("made");
    let (_, policy) = html.split_once("Content-Security-Policy\" content=\"").expect("a policy");
    let policy = policy.split_once('"').expect("its end").0;
    let scripts = policy.replace("'wasm-unsafe-eval'", "");
    assert!(policy.starts_with("default-src 'none';") && !scripts.contains("unsafe") && !policy.contains("http"));
    let unasked = Page { asked: None, ..page("a", "b") }.html().expect("made");
    assert!(!unasked.contains("unsafe-eval"), "WebAssembly is for questions");
    assert!(!policy.contains("connect-src"), "as little as by default: nothing");
    for (open, close, directive) in [("<script>", "</script>", "script-src"), ("<style>", "</style>", "style-src")] {
        let text = html.split_once(open).expect(open).1.split_once(close).expect(close).0;
        let sum = base64::encode(Sha256::digest(text.as_bytes()));
        assert!(policy.contains(&format!("{directive} 'sha256-{sum}'")), "{directive}");
    }
    // Nothing in the page makes a browser load anything.
    for asks in ["<link rel=\"stylesheet", "<iframe", "@import", "url(", "src=\""] {
        assert_eq!(html.matches(asks).count(), 0, "{asks}");
    }
}

#[test]
fn a_page_is_written_whole() {
    let folder = tempfile::tempdir().expect("folder");
    let path = folder.path().join("page.html");
    let page = page("a", "b");
    page.write(&path).expect("written");
    assert_eq!(std::fs::read_to_string(&path).expect("read"), page.html().expect("made"));
    assert!(page.write(&folder.path().join("missing/page.html")).is_err());
}
