//! Holds the layout that ARCHITECTURE.md describes: which module may use which, how long a file
//! may be, that every file says what it is for, and that every GPU kernel has its three files.
//!
//! Each rule is a pure function from files to complaints. The tests at the end feed each of them
//! an offender, so a rule that has gone blind fails here.

// The generator of a committed asset: its own test compares the two.
#[path = "../../../tools/demo_scene/mod.rs"]
mod demo_scene;
mod english;
mod front_ends;
mod links;
mod names;
mod rooms;
mod rules;
mod source;

use std::path::Path;

use front_ends::front_ends;
use names::type_names;
use rules::{
    Complaint, cycles, dependencies, habits, headers, kernels, module_order, printing, render_doors, size_caps,
};
use source::{SourceFile, read_tree};

fn tree() -> Vec<SourceFile> {
    let files = read_tree(Path::new(env!("CARGO_MANIFEST_DIR")));
    assert!(files.iter().any(|f| f.path == "src/lib.rs"), "the source tree was not found");
    files
}

fn check(complaints: Vec<Complaint>) {
    assert!(complaints.is_empty(), "{} complaint(s):\n{}", complaints.len(), complaints.join("\n"));
}

#[test]
fn modules_use_only_what_stands_above_them() {
    check(module_order(&tree()));
}

#[test]
fn only_oracles_name_the_renderers_behind_render() {
    check(render_doors(&tree()));
}

#[test]
fn files_stay_under_their_size_caps() {
    check(size_caps(&tree()));
}

#[test]
fn every_file_says_what_it_is_for() {
    check(headers(&tree()));
}

#[test]
fn every_kernel_has_its_launcher_and_its_cpu_counterpart() {
    check(kernels(&tree()));
}

#[test]
fn only_the_command_line_prints() {
    check(printing(&tree()));
}

#[test]
fn no_file_uses_one_that_uses_it() {
    check(cycles(&tree()));
}

#[test]
fn channels_are_bounded_addresses_are_no_keys_and_progress_is_a_tickers() {
    check(habits(&tree()));
}

#[test]
fn front_ends_leave_the_work_to_jobs() {
    check(front_ends(&tree()));
}

#[test]
fn a_types_name_stands_for_one_thing() {
    check(type_names(&tree()));
}

#[test]
fn every_dependency_has_its_reason() {
    let manifest = include_str!("../../../Cargo.toml");
    check(dependencies(manifest));
    let without_comments: Vec<&str> = manifest.lines().map(|line| line.split('#').next().unwrap_or_default()).collect();
    assert!(dependencies(&without_comments.join("\n")).len() > 50, "the dependencies were not found");
}

#[test]
fn comments_begin_with_a_noun_or_a_verb_and_sentences_are_short() {
    check(english::doc_lines(&tree()));
    let riddles = "/// What is taken.\n".repeat(30) + &"    //! Whether it is.\n".repeat(30);
    assert_eq!(complaints(english::doc_lines, "src/a.rs", &riddles), 60);
    assert_eq!(complaints(english::doc_lines, "src/a.rs", &"/// Whatever it is.\n// What for.\n".repeat(60)), 0);
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let documents = english::documents(root);
    assert!(documents.iter().any(|d| d.path == "README.md") && documents.iter().any(|d| d.path == "docs/guide.md"));
    check(english::sentences(&documents));
    let words = |n: usize| "word ".repeat(n);
    let (short, long) = (format!("{}end. ", words(39)), format!("- {}\n  {}end.\n\n", words(20), words(20)));
    assert_eq!(complaints(english::sentences, "a.md", &long.repeat(11)), 11);
    let unseen = format!("```\n{}\n```\n| {} |\n", words(60), words(60));
    assert_eq!(complaints(english::sentences, "a.md", &(short.repeat(30) + "\n" + &unseen.repeat(11))), 0);
}

#[test]
fn links_of_documents_lead_somewhere() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    check(links::links(root, &english::documents(root)));
    let n = |text| links::links(root, &[file("docs/a.md", text)]).len();
    assert_eq!(n("[a](guide.md), [b](../README.md), [c](#one-more), [d](https://x.y/z)\n\n## One more\n"), 0);
    assert_eq!(n("[a](gone.md), [b](guide.md#no-such-heading), [c](#two)\n\n## One\n"), 3);
}

#[test]
fn rooms_of_semantics_use_only_those_before_them() {
    check(rooms::rooms(&tree()));
    let n = |path: &str, text| complaints(rooms::rooms, &format!("src/pipeline/semantics/{path}"), text);
    assert_eq!(n("query/a.rs", "use crate::pipeline::semantics::lifting::codes;"), 0);
    assert_eq!(n("lifting/a.rs", "use crate::pipeline::semantics::{query::parse, evaluation};"), 2);
    assert_eq!(n("query/a/b.rs", "use super::super::super::evaluation::score;"), 1);
    assert_eq!(n("relevancy.rs", "use super::query::parse;"), 1);
}

/// One made-up file.
fn file(path: &str, text: &str) -> SourceFile {
    SourceFile { path: path.to_owned(), text: text.to_owned() }
}

/// Complaints of `rule` about one made-up file.
fn complaints(rule: fn(&[SourceFile]) -> Vec<Complaint>, path: &str, text: &str) -> usize {
    rule(&[file(path, text)]).len()
}

#[test]
fn module_order_catches_violations() {
    let n = |path, text| complaints(module_order, path, text);
    assert_eq!(n("src/io/ply.rs", "use crate::scene::Camera;"), 0);
    assert_eq!(n("src/io/ply.rs", "use crate::render::Frame;"), 1);
    assert_eq!(n("src/io/ply.rs", "fn f() { crate::ui::run(); crate::worker::go() }"), 2);
    assert_eq!(n("src/io/ply.rs", "use crate::{math::Real, scene::{Camera, cli}, pipeline};"), 1);
    assert_eq!(n("src/io/ply.rs", "use crate::{\n    math::Real,\n    ui::App,\n};"), 1);
    assert_eq!(n("src/io/ply.rs", "use super::super::render::Frame;"), 1);
    assert_eq!(n("src/io/mod.rs", "use super::render::Frame;"), 1);
    assert_eq!(n("src/io/ply/mod.rs", "use super::render::Frame;"), 0);
    assert_eq!(n("src/io/ply.rs", "use super::render::Frame;"), 0);
    assert_eq!(n("src/cli/train.rs", "use crate::ui::run;"), 1);
    assert_eq!(n("src/ui/app/mod.rs", "use crate::cli::train;"), 1);
    assert_eq!(n("src/shiny/mod.rs", "//! A module that the table lacks."), 1);
}

#[test]
fn module_order_looks_past_comments_strings_and_tests() {
    let n = |path, text| complaints(module_order, path, text);
    assert_eq!(n("src/io/ply.rs", "// see crate::render\n/* crate::ui */ const A: &str = \"crate::ui::x\";"), 0);
    assert_eq!(n("src/io/ply.rs", "#[cfg(test)]\nmod tests {\n    use crate::render::Frame;\n}\n"), 0);
    assert_eq!(n("src/io/ply.rs", "#[cfg(test)]\nmod tests {\n    fn a() {}\n}\nuse crate::ui::App;\n"), 1);
    assert_eq!(n("src/io/ply.rs", "const A: char = '\"'; use crate::ui::App; const B: char = '\"';"), 1);
    let test_file = [
        file("src/io/mod.rs", "//! x\n#[cfg(test)]\nmod checks;\n"),
        file("src/io/checks.rs", "//! x\nuse crate::render::Frame;\n"),
    ];
    assert!(module_order(&test_file).is_empty());
}

#[test]
fn render_doors_catch_who_goes_around_them() {
    let n = |path, text| complaints(render_doors, path, text);
    assert_eq!(n("src/worker/view.rs", "use crate::render::cpu::Renderer;"), 1);
    assert_eq!(n("src/worker/view.rs", "use crate::render::{Frame, gpu::{Device, cpu}};"), 1);
    assert_eq!(n("src/cli/x.rs", "use crate::{render::cpu, io}; fn f() { super::super::render::gpu::real_gpu() }"), 2);
    assert_eq!(n("src/worker/view.rs", "use crate::render::{Renderer, normals};"), 0);
    assert_eq!(n("src/worker/view.rs", "#[cfg(test)]\nmod tests {\n    use crate::render::cpu::Renderer;\n}\n"), 0);
    assert_eq!(n("src/render/mod.rs", "pub use crate::render::cpu::ssim;"), 0);
    assert_eq!(n("src/measure/stability/forward.rs", "use crate::render::cpu::Renderer;"), 0);
}

#[test]
fn front_ends_are_caught_that_do_the_work_themselves() {
    let n = |path, text| complaints(front_ends, path, text);
    assert_eq!(n("src/cli/x.rs", "use crate::pipeline::train::run;"), 1);
    assert_eq!(n("src/cli/x.rs", "use crate::{io, jobs::open, models::engine};"), 2);
    assert_eq!(n("src/ui/x.rs", "use crate::io::{SceneFolder, semantic_map::{self, FILE}};"), 2);
    assert_eq!(n("src/agent/x.rs", "fn f() { crate::render::Renderer::new().draw() }"), 1);
    assert_eq!(n("src/ui/panes/x.rs", "fn f() { super::super::super::navigate::graph::build() }"), 1);
    assert_eq!(n("src/ui/x.rs", "use crate::render::Device;"), 1);
    assert_eq!(n("src/cli/x.rs", "use crate::pipeline::train::{TrainConfig, MOST_STEPS}; use crate::jobs::open;"), 0);
    assert_eq!(n("src/ui/x.rs", "use crate::measure::table; use crate::scene::text; use crate::io::httpd;"), 1);
    assert_eq!(n("src/ui/x.rs", "use crate::render::RenderSettings; fn f() { RenderSettings::default() }"), 0);
    assert_eq!(n("src/worker/x.rs", "use crate::pipeline::train::run;"), 0);
    assert_eq!(n("src/cli/x.rs", "#[cfg(test)]\nmod tests {\n    use crate::io::open;\n}\n"), 0);
}

#[test]
fn names_that_stand_for_two_types_are_caught() {
    let n = |a: &str, b: &str| type_names(&[file("src/io/a.rs", a), file("src/ui/b.rs", b)]).len();
    assert_eq!(n("pub struct Frame {", "pub(crate) enum Frame {"), 1);
    assert_eq!(n("pub(super) trait Sink: Send {", "pub type Sink<T> = Vec<T>;"), 1);
    assert_eq!(n("pub struct Frame {", "struct Frame {"), 0, "nobody else sees that one");
    assert_eq!(n("pub struct Frame;", "pub fn frame() {}\n    type Frame = u8;"), 0);
    assert_eq!(n("pub struct Frame;", "#[cfg(test)]\nmod tests {\n    pub struct Frame;\n}\n"), 0);
    assert_eq!(n("pub use crate::scene::Camera as Eye;", "pub use crate::scene::{NOBODY as NONE, Camera};"), 1);
}

#[test]
fn size_caps_catch_long_files() {
    assert_eq!(complaints(size_caps, "src/a.rs", &"x\n".repeat(400)), 0);
    assert_eq!(complaints(size_caps, "src/a.rs", &"x\n".repeat(401)), 1);
    assert_eq!(complaints(size_caps, "shaders/a.wgsl", &"x\n".repeat(250)), 0);
    assert_eq!(complaints(size_caps, "shaders/a.wgsl", &"x\n".repeat(251)), 1);
}

#[test]
fn headers_catch_files_without_one() {
    assert_eq!(complaints(headers, "src/a.rs", "//! What it is for.\n"), 0);
    assert_eq!(complaints(headers, "src/a.rs", "use std::fmt;\n//! late\n"), 1);
    assert_eq!(complaints(headers, "src/a.rs", "//!\nuse std::fmt;\n"), 1);
    assert_eq!(complaints(headers, "tests/a.rs", ""), 1);
    assert_eq!(complaints(headers, "shaders/a.wgsl", "// What it is for.\n"), 0);
    assert_eq!(complaints(headers, "shaders/a.wgsl", "@compute fn main() {}\n"), 1);
}

#[test]
fn kernels_catch_missing_counterparts() {
    let kernel = file("shaders/blend.wgsl", "// x");
    let launcher = file("src/render/gpu/blend.rs", "//! x");
    let counterpart = file("src/render/cpu/blend.rs", "//! x");
    let all = [kernel, launcher, counterpart];
    assert!(kernels(&all).is_empty());
    assert_eq!(kernels(&all[..1]).len(), 2);
    assert_eq!(kernels(&all[..2]).len(), 1);
    assert!(kernels(&[file("shaders/shared/sh.wgsl", "// x")]).is_empty());
}

#[test]
fn printing_catches_a_library_that_talks() {
    assert_eq!(complaints(printing, "src/io/ply.rs", "fn f() { println!(\"x\"); }"), 1);
    assert_eq!(complaints(printing, "src/io/ply.rs", "fn f() { eprint!(\"x\"); }"), 1);
    assert_eq!(complaints(printing, "src/cli/info.rs", "fn f() { println!(\"x\"); }"), 0);
    assert_eq!(complaints(printing, "src/io/ply.rs", "#[cfg(test)]\nmod t {\n    fn f() { println!(); }\n}\n"), 0);
}

#[test]
fn dependencies_catch_a_crate_without_its_reason() {
    let n = |lines: &str| dependencies(&format!("[package]\nname = \"x\"\n{lines}\n[profile.dev]\nlto = 1\n")).len();
    assert_eq!(n("[dependencies]\na = \"1\" # reads the videos\n# writes the videos\nb = { version = \"2\" }"), 0);
    assert_eq!(n("[dependencies]\na = \"1\"\nb = { version = \"2\" }"), 2);
    assert_eq!(n("[dependencies]\na = \"1\" # for videos"), 1, "two words");
    assert_eq!(n("[dependencies]\n# reads the videos\na = \"1\"\nb = \"1\""), 1, "a comment is about one crate");
    assert_eq!(n("[dependencies]\na = { git = \"x # reads the videos\" }"), 1, "a string is no comment");
    assert_eq!(n("# what tests need alone\n[dev-dependencies]\na = \"1\""), 1, "nor is that of a section");
    assert_eq!(n("[target.'cfg(unix)'.dependencies]\na = \"1\""), 1);
    assert_eq!(n("[dependencies.a]\nversion = \"1\""), 1);
    assert_eq!(n("# reads the videos\n[dependencies.a]\nversion = \"1\""), 0);
}

#[test]
fn cycles_are_caught_on_whatever_detour() {
    let a = |text| file("src/io/a.rs", text);
    let b = |text| file("src/io/deep/b.rs", text);
    let parent = file("src/io/mod.rs", "//! x\npub use self::a::A;\nmod a;");
    assert!(cycles(&[a("use super::deep::b::B;"), b("use crate::math::Real;"), parent]).is_empty());
    assert_eq!(cycles(&[a("use super::deep::b::B;"), b("use crate::io::{a::A, c};")]).len(), 2);
    assert_eq!(cycles(&[a("use super::{deep::{b::B}, c};"), b("fn f() { super::super::a::g() }")]).len(), 2);
    let c = file("src/math/c.rs", "use crate::io::a::A;");
    assert_eq!(cycles(&[a("use super::deep::b::B;"), b("use crate::math::c::C;"), c]).len(), 3);
    let test = "#[cfg(test)]\nmod tests {\n    use crate::io::a::A;\n}\n";
    assert!(cycles(&[a("use super::deep::b::B;"), b(test)]).is_empty());
}

#[test]
fn habits_are_caught() {
    let n = |text| complaints(habits, "src/io/a.rs", text);
    assert_eq!(n("let (a, b) = crossbeam_channel::unbounded();"), 1);
    assert_eq!(n("let (a, b) = mpsc::channel();"), 1);
    assert_eq!(n("let (a, b) = bounded(4);"), 0);
    assert_eq!(n("let key = Arc::as_ptr(&cloud) as usize;"), 1);
    assert_eq!(n("observer.progress(Progress { stage, done });"), 1);
    assert_eq!(n("let p = Progress { stage, ..p };"), 0);
    assert_eq!(complaints(habits, "src/pipeline/observer.rs", "f(Progress { stage })"), 0);
}
