//! Evaluation of the language of questions: sentences with known answers, asked by the first photo's view.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use serde::{Deserialize, Serialize};

use super::query::{QueryEngine, seen_from};
use super::{JobError, Scene};
use crate::io::{files, gltf_mesh};
use crate::math::stats::median;
use crate::pipeline::semantics::evaluation::referring::{self, Referring, ReferringTruth, controls};
use crate::pipeline::semantics::query::localize::Answer;
use crate::pipeline::semantics::query::recipe::QueryConfig;
use crate::pipeline::synth::{Levels, TrueIdentity};
use crate::scene::{Identities, IdentityId, LevelFilter, SemanticMap};

/// Sentence with its true answer.
#[derive(Clone, Debug, PartialEq)]
struct KnownQuestion {
    text: String,
    kind: String,
    truth: KnownAnswer,
}

/// True answer, by full names.
#[derive(Clone, Debug, PartialEq)]
enum KnownAnswer {
    /// All of these.
    All(BTreeSet<String>),
    /// One of several, or nothing that can be understood: an honest program says so.
    Open(BTreeSet<String>),
    Nothing,
}

/// Line of a list of sentences.
#[derive(Debug, Deserialize)]
struct ListedQuestion {
    /// The sentence.
    say: String,
    /// Full names of the answer.
    #[serde(default)]
    expect: Vec<String>,
    /// "found", "not found" or "open".
    verdict: String,
    #[serde(default)]
    kind: String,
    /// Scene that it is about, if the list has several.
    #[serde(default)]
    scene: Option<String>,
}

/// Numbers of right, open and wrong answers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub(crate) struct LanguageTally {
    pub(crate) asked: usize,
    pub(crate) right: usize,
    /// Nothing was found, or several were offered, where one answer is right.
    pub(crate) open: usize,
    pub(crate) wrong: usize,
}

/// Sentence that was not answered rightly.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct MissedQuestion {
    pub(crate) text: String,
    pub(crate) kind: String,
    /// True if the answer is wrong, false if it is open.
    pub(crate) wrong: bool,
    pub(crate) wanted: String,
    pub(crate) got: String,
}

/// Sentence with its answer.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct AnsweredQuestion {
    pub(crate) text: String,
    /// Verdict: found, ambiguous, not found.
    pub(crate) verdict: &'static str,
    /// Numbers of the identities that are meant, or may be.
    pub(crate) found: Vec<IdentityId>,
}

/// Result of an evaluation.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub(crate) struct LanguageResult {
    pub(crate) total: LanguageTally,
    pub(crate) by_kind: BTreeMap<String, LanguageTally>,
    pub(crate) missed: Vec<MissedQuestion>,
    /// All sentences, but for those of the controls.
    pub(crate) answers: Vec<AnsweredQuestion>,
    /// Answers to sentences with exchanged relations, whose truth is left as it was, and by shuffled names: both must
    /// fail. Only of generated sentences.
    pub(crate) controls: Vec<(String, LanguageTally)>,
    /// Number of generated sentences that were left out because their truth is borderline.
    pub(crate) skipped: usize,
    /// Median of the milliseconds from text to identities.
    pub(crate) median_ms: f64,
}

/// Most sentences that are generated.
pub(crate) const COUNT: usize = 600;

/// Asks sentences: of a list (`.jsonl`), or generated from the meshes of a scene (`.glb`, `.gltf`).
///
/// # Errors
/// If the file cannot be read, or the encoder fails.
pub(crate) fn run(
    scene: &Scene,
    map: &SemanticMap,
    file: &Path,
    recipe: &QueryConfig,
) -> Result<LanguageResult, JobError> {
    let is_list = file.extension().is_some_and(|e| e.eq_ignore_ascii_case("jsonl"));
    if is_list {
        return asked(scene, map, &listed(scene, file)?, recipe);
    }
    let name = file.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
    let place = seen_from(scene, None);
    let view = place.view.ok_or_else(|| JobError::Questions("the scene has no photo to look from".into()))?;
    let mesh = gltf_mesh::read(file)?;
    let levels = Levels::Nodes;
    let made = referring::referring(&mesh, levels, &name, view.eye.to_array(), view.forward.to_array(), COUNT, 0)?;
    let questions = |of: &[Referring], names: &[TrueIdentity]| of.iter().map(|r| known(r, names)).collect::<Vec<_>>();
    let mut result = asked(scene, map, &questions(&made.expressions, &made.identities), recipe)?;
    let exchanged = controls::exchanged(&made.expressions);
    let shuffled = controls::shuffled(&made.identities, 1);
    for (what, list) in [
        ("relations exchanged", questions(&exchanged, &made.identities)),
        ("names shuffled", questions(&made.expressions, &shuffled)),
    ] {
        result.controls.push((what.to_owned(), asked(scene, map, &list, recipe)?.total));
    }
    result.skipped = made.skipped_borderline;
    Ok(result)
}

/// Reads a list of sentences, those of this scene.
fn listed(scene: &Scene, file: &Path) -> Result<Vec<KnownQuestion>, JobError> {
    let folder = scene.path.components().rev().map(|c| c.as_os_str().to_string_lossy().into_owned());
    let names: Vec<String> = folder.take(2).collect();
    let mut all = Vec::new();
    for (k, line) in files::read_text(file)?.lines().enumerate().filter(|(_, l)| !l.trim().is_empty()) {
        let bad = |problem: String| JobError::Questions(format!("{}: line {}: {problem}", file.display(), k + 1));
        let row: ListedQuestion = serde_json::from_str(line).map_err(|e| bad(format!("not a question ({e})")))?;
        if row.scene.as_ref().is_some_and(|scene| !names.contains(scene)) {
            continue;
        }
        let truth = match row.verdict.as_str() {
            "found" => KnownAnswer::All(row.expect.iter().map(|n| plain(n)).collect()),
            "not found" => KnownAnswer::Nothing,
            "open" => KnownAnswer::Open(row.expect.iter().map(|n| plain(n)).collect()),
            other => return Err(bad(format!("the verdict '{other}' is none of found, not found, open"))),
        };
        all.push(KnownQuestion { text: row.say, kind: row.kind, truth });
    }
    if all.is_empty() {
        let remedy = "name the scene as its folder or the folder around it is called, or leave 'scene' out";
        return Err(JobError::Questions(format!("{}: no question about this scene: {remedy}", file.display())));
    }
    Ok(all)
}

fn known(of: &Referring, names: &[TrueIdentity]) -> KnownQuestion {
    let name = |id: &u16| {
        let find = |id: u16| names.iter().find(|i| i.id == id);
        let whole = find(*id).and_then(|i| i.parent).and_then(find);
        let parts = find(*id).into_iter().chain(whole).map(|i| i.name.clone());
        plain(&parts.collect::<Vec<_>>().join(" \u{b7} "))
    };
    let truth = match &of.truth {
        ReferringTruth::All(ids) => KnownAnswer::All(ids.iter().map(name).collect()),
        ReferringTruth::OneOf(ids) => KnownAnswer::Open(ids.iter().map(name).collect()),
        ReferringTruth::Nothing => KnownAnswer::Nothing,
    };
    KnownQuestion { text: of.text.clone(), kind: format!("{:?}", of.kind), truth }
}

/// Returns a full name without the numbers that tell equal names apart.
fn plain(name: &str) -> String {
    let bare = |part: &str| part.split(" #").next().unwrap_or_default().to_lowercase();
    name.split(" \u{b7} ").map(bare).collect::<Vec<_>>().join(" \u{b7} ")
}

fn asked(
    scene: &Scene,
    map: &SemanticMap,
    questions: &[KnownQuestion],
    recipe: &QueryConfig,
) -> Result<LanguageResult, JobError> {
    let mut engine = QueryEngine::new(map.language.as_ref(), recipe.clone())?;
    engine.place = seen_from(scene, None);
    let mut result = LanguageResult::default();
    let mut times = Vec::new();
    for question in questions {
        let start = std::time::Instant::now();
        let answered = engine.ask(map, &question.text, LevelFilter::Auto)?;
        times.push(start.elapsed().as_secs_f64() * 1e3);
        let chosen = answered.as_ref().map(|a| a.chosen(1)).unwrap_or_default();
        let verdict = answered.as_ref().map_or("not understood", |a| a.answer.verdict());
        result.answers.push(AnsweredQuestion { text: question.text.clone(), verdict, found: chosen.clone() });
        let found: BTreeSet<String> = chosen.iter().map(|id| full_name(&map.identities, *id)).collect();
        let is_found = answered.as_ref().is_some_and(|a| matches!(a.answer, Answer::Found(_)));
        let is_open = answered.as_ref().is_none_or(|a| !matches!(a.answer, Answer::Found(_)));
        let is_none = found.is_empty();
        let (right, wrong) = match &question.truth {
            KnownAnswer::All(truth) => (is_found && found == *truth, is_found && found != *truth),
            // "Is there a knob?" has an answer, whichever is meant.
            KnownAnswer::Open(truth) => {
                let all = question.kind == "Question" && found == *truth;
                (is_open || all, is_found && !all)
            }
            KnownAnswer::Nothing => (is_none, !is_none),
        };
        let kind = result.by_kind.entry(question.kind.clone()).or_default();
        for tally in [kind, &mut result.total] {
            tally.asked += 1;
            tally.right += usize::from(right);
            tally.wrong += usize::from(wrong);
            tally.open += usize::from(!right && !wrong);
        }
        if !right {
            let got = format!("{verdict}: {}", found.into_iter().collect::<Vec<_>>().join("; "));
            let wanted = match &question.truth {
                KnownAnswer::All(truth) => truth.iter().cloned().collect::<Vec<_>>().join("; "),
                KnownAnswer::Open(_) => "open".to_owned(),
                KnownAnswer::Nothing => "nothing".to_owned(),
            };
            let (text, kind) = (question.text.clone(), question.kind.clone());
            result.missed.push(MissedQuestion { text, kind, wrong, wanted, got });
        }
    }
    result.median_ms = median(&times);
    Ok(result)
}

fn full_name(identities: &Identities, id: IdentityId) -> String {
    let line = identities.ancestors(id).map(|i| identities.name(i));
    plain(&line.collect::<Vec<_>>().join(" \u{b7} "))
}
