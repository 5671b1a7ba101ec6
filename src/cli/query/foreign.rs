//! `fmlgs query` of a result of another method: its embeddings answer, by its own rule and by the common one.

use serde_json::{Value, json};

use super::QueryArgs;
use super::out::OutFiles;
use crate::cli::{CliError, output, view};
use crate::io::results::{Method, MethodResult};
use crate::jobs::ask_result::{self, ResultAnswer};
use crate::jobs::{Scene, query, render};
use crate::math::format::{count, things};
use crate::pipeline::semantics::query::foreign::own_rules::ForeignMask;
use crate::pipeline::semantics::query::recipe::QueryConfig;
use crate::scene::{LevelFilter, Mask};

/// Refuses options that mean nothing for a result.
fn check(args: &QueryArgs, method: Method) -> Result<(), CliError> {
    let idle = [
        (args.phrases.is_some(), "--phrases"),
        (args.kind != LevelFilter::Auto, "--kind"),
        (args.top != 1, "--top"),
        (args.recipe.recipe() != QueryConfig::default(), "a recipe"),
    ];
    match idle.iter().find(|(given, _)| *given) {
        Some((_, option)) => {
            let name = method.name();
            let text = "which is asked by its own embeddings; import it for objects";
            Err(CliError::Usage(format!("{option} has no effect on a result of {name}, {text}")))
        }
        None => Ok(()),
    }
}

pub(super) fn run(args: &QueryArgs, scene: &Scene, method: Method) -> Result<(), CliError> {
    check(args, method)?;
    let out = OutFiles::of(args, scene)?;
    let text = args.text.as_deref().unwrap_or_default();
    let camera = view::choose(args.camera.as_deref(), scene)?.limited_to(args.max_side);
    render::check_room(camera.width_px, camera.height_px)?;
    let asked = ask_result::open(scene, &args.result.options())?;
    // A decoder that an option names can tell another method than the files alone.
    let method = asked.result.method;
    let vectors = match &args.vectors {
        Some(file) => ask_result::stored_vectors(file)?,
        None => ask_result::encoded(&asked.result, text)?,
    };
    let level = args.level.as_deref().map(|wanted| ask_result::level_of(&asked.result, wanted)).transpose()?;
    let answer = ask_result::ask(&asked, &camera, &vectors, level)?;
    let empty = Mask::empty(camera.width_px as usize, camera.height_px as usize);
    let own = answer.own.as_ref().map_or(&empty, |own| &own.mask);
    if let Some(path) = &args.mask {
        query::write_mask(path, &answer.common.mask)?;
    }
    if let Some(path) = &args.heat {
        query::write_heat(path, (&scene.cloud, &scene.settings), &camera, &answer.relevancy)?;
    }
    if let Some(out) = &out {
        let own = answer.own.as_ref().ok().map(|own| &own.mask);
        out.write(scene, &camera, &answer.relevancy, [own, Some(&answer.common.mask)])?;
    }
    let names: Vec<&str> = asked.result.levels.iter().map(|level| level.name.as_str()).collect();
    match args.json {
        true => output::print_json(&as_json(text, &asked.result, &names, &answer))?,
        false => output::print(&in_words(method, &names, &answer))?,
    }
    if answer.common.mask.is_empty() && own.is_empty() {
        let why = "no pixel of this view is more relevant than the canonical phrases";
        return Err(CliError::failed(format!("no match for '{text}': {why}")));
    }
    Ok(())
}

fn as_json(text: &str, result: &MethodResult, names: &[&str], answer: &ResultAnswer) -> Value {
    let mask = |m: &ForeignMask| json!({ "rule": m.rule, "level": names[m.level], "pixels": m.mask.area() });
    json!({
        "query": text,
        "method": result.method.name(),
        "encoder": result.encoder,
        "level": names[answer.level],
        "levels": names,
        "relevancy": answer.relevancy.iter().copied().fold(0.0, f32::max),
        "own_rule": answer.own.as_ref().ok().map(mask),
        "no_own_rule": answer.own.as_ref().err(),
        "common_rule": mask(&answer.common),
        "best_gaussian": answer.best_gaussian.map(|(i, relevancy)| json!({ "number": i, "relevancy": relevancy })),
        "relevant_gaussians": answer.relevant_gaussians,
        "stages_ms": answer.times,
    })
}

fn in_words(method: Method, names: &[&str], answer: &ResultAnswer) -> String {
    let pixels = |m: &Mask| format!("{} px", count(m.area() as u64));
    let line = |m: &ForeignMask| format!("{} at level '{}' ({})", pixels(&m.mask), names[m.level], m.rule);
    let most = answer.relevancy.iter().copied().fold(0.0, f32::max);
    let (view, encode, ms) = (answer.times.view, answer.times.encode, answer.times.answer);
    let mut lines = vec![format!("{}: relevancy up to {most:.3} at level '{}'", method.name(), names[answer.level])];
    lines.push(match &answer.own {
        Ok(own) => format!("mask by its own rule: {}", line(own)),
        Err(why) => why.clone(),
    });
    lines.push(format!("mask by the common rule: {}", line(&answer.common)));
    if let Some((i, relevancy)) = answer.best_gaussian {
        let more = things(answer.relevant_gaussians, "Gaussian");
        lines.push(format!("most relevant Gaussian: {i} ({relevancy:.3}); {more} over 0.5"));
    }
    lines.push(format!("view in {view:.1} ms, phrase encoded in {encode:.1} ms, answered in {ms:.1} ms"));
    lines.join("\n")
}
