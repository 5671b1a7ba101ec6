//! The table of a data set: the paper's printed rows, and ours, as JSON and as Markdown.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;

use serde::Serialize;

use super::printed::{self, printed};
use super::rows::{ARGMAX, POOLED};
use super::scene::SceneResult;
use super::{LABELS, PaperTable, REGIONS, ReproduceSettings};
use crate::math::stats::mean;
use crate::scene::text;

/// Most bytes of a semantic map on disk.
pub(crate) const MOST_MAP_BYTES: u64 = 3_000_000;

/// A row of a metric.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct TableRow {
    pub(crate) name: String,
    /// True if it is the paper's, as printed.
    pub(crate) printed: bool,
    /// Values by scene.
    pub(crate) scenes: BTreeMap<String, f64>,
    /// Mean of the scenes' means; in a printed row the paper's own value for all.
    pub(crate) mean_of_scenes: Option<f64>,
    /// Mean of all queries.
    pub(crate) mean_of_queries: Option<f64>,
}

/// All rows of one metric.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct MetricTable {
    pub(crate) metric: String,
    /// The table of the paper that the printed rows are from.
    pub(crate) source: Option<&'static str>,
    pub(crate) rows: Vec<TableRow>,
}

/// Contents of a table.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct TableDocument {
    pub(crate) settings: ReproduceSettings,
    /// Protocol of the comparison.
    pub(crate) protocol: &'static str,
    pub(crate) metrics: Vec<MetricTable>,
    pub(crate) scenes: Vec<SceneResult>,
    /// Notes that a reader needs to judge the numbers.
    pub(crate) notes: Vec<String>,
}

fn protocol(table: PaperTable) -> &'static str {
    match table {
        PaperTable::LerfOvs => "langsplat",
        PaperTable::SpinNerf => "spin-nerf, at 1008 x 567 px",
        PaperTable::Ovs3d => "3d-ovs: every class by its own mask, and by arg-max",
        PaperTable::PartAblation => "part-recall: share of part queries whose mask has an IoU of 0.5 or more",
        PaperTable::RefLerf => "ref-lerf: the answer to every sentence against its object's mask, empty masks left out",
    }
}

impl TableDocument {
    pub(super) fn new(settings: &ReproduceSettings, scenes: Vec<SceneResult>) -> Self {
        let papers = printed(settings.table);
        let mut metrics: Vec<String> = papers.iter().map(|p| p.metric.to_owned()).collect();
        let ours: BTreeSet<&String> = scenes.iter().flat_map(|s| s.rows.iter().flat_map(|r| r.scores.keys())).collect();
        let more: Vec<String> = ours.into_iter().filter(|m| !metrics.contains(m)).cloned().collect();
        metrics.extend(more);
        let table = |metric: String| {
            let paper = papers.iter().find(|p| p.metric == metric);
            let mut rows: Vec<TableRow> = paper.into_iter().flat_map(printed_rows).collect();
            rows.extend(match metric.as_str() {
                printed::TIME => vec![time_row(&scenes)],
                _ => measured_rows(&metric, &scenes),
            });
            MetricTable { metric, source: paper.map(|p| p.title), rows }
        };
        let metrics = metrics.into_iter().map(table).collect();
        let notes = notes(settings, &scenes);
        Self { settings: settings.clone(), protocol: protocol(settings.table), metrics, scenes, notes }
    }

    /// Returns the table as Markdown.
    pub(crate) fn markdown(&self) -> String {
        let table: &str = self.settings.table.into();
        let mut out = format!("# {table}\n\n");
        self.notes.iter().for_each(|note| line(&mut out, &format!("- {note}")));
        let names: Vec<&str> = self.scenes.iter().map(|s| s.scene.as_str()).collect();
        for MetricTable { metric, source, rows } in &self.metrics {
            let source = source.map_or_else(String::new, |s| format!(" (printed rows: \"{s}\")"));
            line(&mut out, &format!("\n## {metric}{source}\n"));
            let head = ["row"].iter().chain(&names).chain(&["mean of scenes", "mean of queries"]).copied();
            row(&mut out, &head.map(str::to_owned).collect::<Vec<_>>());
            row(&mut out, &vec!["---".to_owned(); names.len() + 3]);
            for r in rows {
                let cell = |value: Option<f64>| value.map_or_else(|| "-".to_owned(), |v| number(metric, v));
                let name = if r.printed { format!("{}, as printed", r.name) } else { format!("**{}**", r.name) };
                let own = names.iter().map(|n| cell(r.scenes.get(*n).copied()));
                let cells = std::iter::once(name).chain(own);
                row(&mut out, &cells.chain([cell(r.mean_of_scenes), cell(r.mean_of_queries)]).collect::<Vec<_>>());
            }
        }
        line(&mut out, "\n## Scenes\n");
        let head = "scene|photos|labeled photos compared|trained on|size|Gaussians|PSNR of held-out photos|objects|\
                    parts|semantic map|training s|finding objects s|query ms, median (95 %)|without encoding the text";
        row(&mut out, &head.split('|').map(str::to_owned).collect::<Vec<_>>());
        row(&mut out, &vec!["---".to_owned(); head.split('|').count()]);
        self.scenes.iter().for_each(|s| row(&mut out, &facts(s)));
        out
    }
}

fn line(out: &mut String, text: &str) {
    // Writing into a string cannot fail.
    let _ = writeln!(out, "{text}");
}

fn row(out: &mut String, cells: &[String]) {
    let cells = cells.iter().map(|c| text::line(c).replace('|', "/")).collect::<Vec<_>>();
    line(out, &format!("| {} |", cells.join(" | ")));
}

fn number(metric: &str, value: f64) -> String {
    match metric {
        _ if !value.is_finite() => "-".into(),
        printed::TIME if value < 0.1 => format!("{value:.4}"),
        printed::TIME => format!("{value:.2}"),
        _ => format!("{value:.1}"),
    }
}

fn printed_rows(paper: &printed::PrintedTable) -> Vec<TableRow> {
    let of = |(name, values): &(&str, &[f64])| TableRow {
        name: (*name).into(),
        printed: true,
        scenes: paper.scenes.iter().map(|s| (*s).to_owned()).zip(values.iter().copied()).collect(),
        mean_of_scenes: values.last().copied(),
        mean_of_queries: None,
    };
    paper.rows.iter().map(of).collect()
}

fn measured_rows(metric: &str, scenes: &[SceneResult]) -> Vec<TableRow> {
    let mut names: Vec<&str> = Vec::new();
    for row in scenes.iter().flat_map(|s| &s.rows).filter(|r| r.scores.contains_key(metric)) {
        if !names.contains(&row.name.as_str()) {
            names.push(&row.name);
        }
    }
    let of = |name: &str| {
        let scores = |s: &SceneResult| s.rows.iter().find(|r| r.name == name)?.scores.get(metric).cloned();
        let scores: Vec<(String, Vec<f64>)> =
            scenes.iter().filter_map(|s| Some((s.scene.clone(), scores(s)?))).collect();
        // A scene without queries has no mean.
        let asked = scores.into_iter().filter(|s| !s.1.is_empty()).collect::<Vec<_>>();
        let all: Vec<f64> = asked.iter().flat_map(|s| s.1.iter().copied()).collect();
        let scenes: BTreeMap<String, f64> = asked.into_iter().map(|(scene, values)| (scene, mean(&values))).collect();
        let of_scenes: Vec<f64> = scenes.values().copied().collect();
        let some = |values: &[f64]| (!values.is_empty()).then(|| mean(values));
        let (mean_of_scenes, mean_of_queries) = (some(&of_scenes), some(&all));
        TableRow { name: name.into(), printed: false, scenes, mean_of_scenes, mean_of_queries }
    };
    names.into_iter().map(of).collect()
}

/// Returns the seconds of this program's queries, including the text's encoding, as the paper counts them.
fn time_row(scenes: &[SceneResult]) -> TableRow {
    let scenes: BTreeMap<_, _> = scenes.iter().map(|s| (s.scene.clone(), 1e-3 * s.times.whole_ms[0])).collect();
    let all: Vec<f64> = scenes.values().copied().collect();
    let name = "this program, median, the view drawn before".into();
    TableRow { name, printed: false, mean_of_scenes: Some(mean(&all)), mean_of_queries: None, scenes }
}

fn facts(s: &SceneResult) -> Vec<String> {
    let ms = |[half, most]: [f64; 2]| format!("{half:.1} ({most:.1})");
    let over = if s.found.map_bytes < MOST_MAP_BYTES { "" } else { ", OVER 3 MB" };
    vec![
        s.scene.clone(),
        s.photos.to_string(),
        s.views.len().to_string(),
        if s.trained_on { "yes" } else { "no" }.into(),
        format!("{} x {}", s.size_px[0], s.size_px[1]),
        s.trained.gaussians.to_string(),
        s.trained.psnr.map_or_else(|| "-".into(), |v| format!("{v:.2}")),
        s.found.counts.objects.to_string(),
        s.found.counts.parts.to_string(),
        format!("{:.3} MB{over}", s.found.map_bytes as f64 / 1e6),
        format!("{:.1}", s.trained.secs),
        format!("{:.1}", s.found.secs),
        ms(s.times.whole_ms),
        ms(s.times.without_text_ms),
    ]
}

fn notes(settings: &ReproduceSettings, scenes: &[SceneResult]) -> Vec<String> {
    let mut notes = vec![
        format!("Protocol: {}. Labels are matched with photos by name.", protocol(settings.table)),
        format!(
            "Settings: {} steps of training, longer side at most {} px, encoder '{}'{}.",
            settings.train.steps,
            settings.train.max_side_px,
            settings.encoder,
            if settings.encoder == "demo" { " (knows made-up things only)" } else { "" }
        ),
        match settings.masks.as_str() {
            LABELS => "Masks: those of labeled photos that are not compared, where a segmenter is meant to find them. \
                       The numbers say how well masks are carried and asked for, not how well they are found."
                .into(),
            REGIONS => "Masks: found by the built-in regions, which are rough; the paper's are SAM's.".into(),
            network => format!("Masks: found by '{network}'."),
        },
        match settings.labeled_in_training {
            true => "Labeled photos were trained on, as in the literature.".into(),
            false if settings.table == PaperTable::RefLerf => {
                "Test photos were held out of training, by ReferSplat's split.".into()
            }
            false => {
                "Labeled photos that are compared were held out of training; in the literature they are not.".into()
            }
        },
        "Rows in bold are measured here. Baselines among them are what pieces of this program can stand for, not the \
         programs of their authors. All ask by embedding, whatever the labels call things, but 'by name' and, for \
         sentences, 'this program'."
            .to_owned(),
    ];
    match settings.table {
        PaperTable::LerfOvs => notes.push(format!(
            "'{POOLED}' never empties its counts from query to query, so that it is no mean IoU; the paper's mean IoU \
             was very probably made by that evaluator, and is comparable with nothing else here."
        )),
        PaperTable::SpinNerf => notes.push(
            "The paper does not say what it asked for; here it is the scene's name, or what --query says.".into(),
        ),
        PaperTable::Ovs3d => notes.push(format!("'{ARGMAX}' is how 3D-OVS itself counts.")),
        PaperTable::PartAblation => notes.push(
            "The paper does not publish its scenes and queries of this table; these are other ones. A part counts as \
             found by its mask's IoU with the label, whatever its score."
                .into(),
        ),
        PaperTable::RefLerf => notes.push(
            "Every sentence counts here; ReferSplat's script keeps one mask of each category and view, whichever \
             sentence came last. Sentences and masks are read as its code reads them; the real data set was never tried."
                .into(),
        ),
    }
    let unknown: BTreeSet<&String> = scenes.iter().flat_map(|s| &s.unknown_phrases).collect();
    if !unknown.is_empty() {
        let list = unknown.iter().map(|u| format!("'{u}'")).collect::<Vec<_>>().join(", ");
        notes.push(format!("The encoder knows no word of {list}: not found by embedding."));
    }
    notes
}
