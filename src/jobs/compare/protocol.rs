//! Another method's result by the protocols of the literature: a row of scores for each rule that makes masks, so that
//! a paper's number and the fair number stand side by side.

use std::path::PathBuf;

use serde::Serialize;

use super::subject::CompareSubject;
use super::vectors::{KnownVectors, TextFunction};
use super::views::{self, ViewChoice, WantedViews};
use crate::jobs::JobError;
use crate::jobs::evaluate_masks::Protocol;
use crate::pipeline::observer::{Observer, Ticker};
use crate::pipeline::semantics::evaluation::by_rule::{PhraseInView, RuleScores, RuleTally, WinningClasses};
use crate::pipeline::semantics::evaluation::{Unit, means};

/// Longer side of views unless another is asked for, px: that of LERF-OVS.
const MAX_SIDE_PX: u32 = 1_008;

/// Choices of an evaluation.
#[derive(Clone, Debug)]
pub(crate) struct ResultEvaluation {
    pub(crate) labels: PathBuf,
    pub(crate) views: WantedViews,
    /// Data set with the photos; else the cameras beside the result count.
    pub(crate) photos: Option<PathBuf>,
    pub(crate) max_side_px: Option<u32>,
    pub(crate) protocol: Protocol,
}

/// Scores of a result, by rule.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct ResultScores {
    pub(crate) method: String,
    pub(crate) protocol: String,
    /// Names of the compared views.
    pub(crate) views: Vec<String>,
    pub(crate) queries: usize,
    pub(crate) rules: Vec<RuleScores>,
    /// Mean IoU if every pixel is given to its most relevant class (3D-OVS).
    pub(crate) argmax_miou: Option<f64>,
    /// Comparisons of those classes.
    #[serde(skip)]
    pub(crate) argmax_units: Vec<Unit>,
    pub(crate) notes: Vec<String>,
}

/// Scores a result; `encode` gives the vectors of phrases.
///
/// # Errors
/// If the protocol needs objects of this program, the result cannot be read or asked, or there are no labels.
pub(crate) fn evaluate(
    scene: CompareSubject,
    request: &ResultEvaluation,
    encode: TextFunction<'_>,
    observer: &mut dyn Observer,
) -> Result<ResultScores, JobError> {
    let protocol = request.protocol;
    if !matches!(protocol, Protocol::Masks | Protocol::Langsplat | Protocol::Ovs3d | Protocol::PartRecall) {
        let text = format!(
            "the protocol {} needs objects of this program; results of other methods are measured by masks, langsplat, \
             3d-ovs and part-recall",
            protocol.name()
        );
        return Err(JobError::Protocol(text));
    }
    let mut scenes = [scene];
    let chosen = ViewChoice {
        wanted: request.views.clone(),
        photos: request.photos.clone(),
        truth: Some(request.labels.clone()),
        max_side_px: request.max_side_px.unwrap_or(MAX_SIDE_PX),
    };
    let (views, notes) = views::choose(&scenes, &chosen)?;
    let [scene] = &mut scenes;
    let mut vectors = KnownVectors::new(encode, 1);
    let named = views.iter().filter_map(|view| view.truth.as_ref()).flatten().map(|c| c.name.clone());
    let mut classes: Vec<String> = named.collect();
    classes.sort();
    classes.dedup();
    let (mut tally, mut queries, mut of_winner) = (RuleTally::default(), 0, Vec::<Unit>::new());
    let mut ticker = Ticker::new("Measuring masks", views.len());
    for (v, view) in views.iter().enumerate() {
        ticker.tick(v, observer)?;
        let Some(camera) = view.cameras.first() else { continue };
        scene.answers.look(camera)?;
        let size = (camera.width_px as usize, camera.height_px as usize);
        let mut winning = WinningClasses::new(size);
        for (k, class) in classes.iter().enumerate() {
            let category = view.category(class);
            // Only where classes compete does it matter what is not in a view.
            if category.is_none() && protocol != Protocol::Ovs3d {
                continue;
            }
            let phrase = views::as_phrase(class);
            let levels = scene.answers.levels(&phrase, &mut vectors)?;
            let own = match category {
                Some(_) => scene.answers.own_mask(&phrase, &levels, &mut vectors)?,
                None => None,
            };
            let answer = PhraseInView { levels, own, size };
            winning.add(k, &answer);
            if let Some(category) = category {
                tally.add(&view.name, category, &answer);
                queries += 1;
            }
        }
        let unit = |(k, class): (usize, &String)| {
            let category = view.category(class)?;
            Some(category.unit(&view.name, winning.mask(k).iou(&category.mask), None))
        };
        of_winner.extend(classes.iter().enumerate().filter_map(unit));
    }
    ticker.tick(views.len(), observer)?;
    Ok(ResultScores {
        method: scene.name.clone(),
        protocol: protocol.name(),
        views: views.into_iter().map(|view| view.name).collect(),
        queries,
        rules: tally.scores(),
        argmax_miou: (protocol == Protocol::Ovs3d).then(|| means(&of_winner).0),
        argmax_units: of_winner,
        notes,
    })
}
