//! Embeddings, codes, and answers to queries.

use glam::DVec3;

use super::source::Numbers;
use super::{Verdict, promise};
use fmlgs::math::vector::{dot, unit};
use fmlgs::pipeline::semantics::lifting::codes::{RADIUS, assign, matches};
use fmlgs::pipeline::semantics::query::localize::{Answer, Scorer, localize};
use fmlgs::pipeline::semantics::query::parse::ParsedQuery;
use fmlgs::pipeline::semantics::query::recipe::Strategy;
use fmlgs::pipeline::semantics::relevancy::{advantage, deviate, score};
use fmlgs::scene::{Identities, Level, LevelFilter};

/// Directions have unit length or are refused; scores of them are between 0 and 1.
pub fn relevancy(n: &mut Numbers) -> Verdict {
    let channels = 1 + n.below(20);
    let zeros = n.chance(0.05);
    let mut vector = || -> Vec<f32> { (0..channels).map(|_| if zeros { 0.0 } else { n.around(-1.0, 1.0) }).collect() };
    let raw = [vector(), vector(), vector(), vector()];
    let temperature = n.size(1e-6, 1e6) as f32;
    let weight = n.plain(0.0, 1.0) as f32;
    let units: Option<Vec<Vec<f32>>> = raw.iter().map(|v| unit(v)).collect();
    let Some(units) = units else {
        let usable = |v: &Vec<f32>| v.iter().all(|x| x.is_finite()) && v.iter().any(|x| *x != 0.0);
        promise!(!raw.iter().all(usable), "a vector with a direction was refused");
        return Verdict::Refused;
    };
    let is_unit = |v: &[f32]| (dot(v, v) - 1.0).abs() < 1e-5;
    promise!(units.iter().all(|v| is_unit(v)), "a direction is not of unit length");
    let deviated = deviate(&units[0], &units[1], weight);
    promise!(deviated.as_ref().is_none_or(|v| is_unit(v)), "a deviated direction is not of unit length");
    let canonical: Vec<Vec<f32>> = units[2..].to_vec();
    let s = score(advantage(&units[0], &units[1], &canonical), temperature);
    promise!((0.0..=1.0).contains(&s), "the score is {s}");
    let exact = units[0].iter().zip(&units[1]).map(|(a, b)| f64::from(*a) * f64::from(*b)).sum::<f64>();
    promise!((f64::from(dot(&units[0], &units[1])) - exact).abs() < 1e-5, "a cosine is off");
    Verdict::Held
}

/// Identities, some of them parts of others.
fn identities(n: &mut Numbers, most: usize) -> Identities {
    let mut all = Identities::default();
    for i in 0..n.below(most) {
        let parent = n.below(i + 1) as u32;
        let level = if parent == 0 { Level::Object } else { Level::Part };
        all.add(level, parent, vec![format!("thing {i}")]);
    }
    all
}

/// Codes are in the cube, on their sphere, and each its own, wherever identities are.
pub fn codes(n: &mut Numbers) -> Verdict {
    let mut all = identities(n, 40);
    let spread = n.size(1e-6, 1e6);
    let centers: Vec<DVec3> = (0..n.below(all.len() + 3))
        .map(|_| if n.chance(0.2) { DVec3::ZERO } else { DVec3::new(n.wide(0.0, spread), n.wide(0.0, spread), 0.0) })
        .collect();
    assign(&mut all, &centers);
    let codes: Vec<[f32; 3]> = all.iter().map(|(_, i)| i.code).collect();
    for (i, code) in codes.iter().enumerate() {
        let off = code.iter().map(|c| (c - 0.5).powi(2)).sum::<f32>().sqrt();
        promise!((off - RADIUS).abs() < 1e-4, "code {i} is {code:?}");
        let twins = codes[..i].iter().any(|c| matches(*c, *code, 1e-4));
        promise!(!twins, "code {i} is another's");
    }
    Verdict::Held
}

/// Scores from nowhere.
struct Anything<'a> {
    n: &'a mut Numbers,
    count: usize,
    asked: Vec<(String, Option<String>, Vec<f32>)>,
}

impl Scorer for Anything<'_> {
    fn scores(&mut self, phrase: &str, against: Option<&str>) -> Vec<f32> {
        let known = self.asked.iter().find(|a| a.0 == phrase && a.1.as_deref() == against);
        if let Some(known) = known {
            return known.2.clone();
        }
        let scores: Vec<f32> = (0..self.count).map(|_| self.n.around(0.0, 1.0)).collect();
        self.asked.push((phrase.into(), against.map(str::to_owned), scores.clone()));
        scores
    }

    fn threshold(&self) -> f32 {
        0.5
    }

    fn resolution(&self) -> f32 {
        0.001
    }
}

/// Answers are ordered, of identities that there are, and a score that is no number never hides one that
/// is.
pub fn localizing(n: &mut Numbers) -> Verdict {
    let all = identities(n, 30);
    let query = n.pick(&["lamp", "lid of the kettle", "the doll's eye", "a of b of c"]);
    let kind = n.pick(&[LevelFilter::Auto, LevelFilter::Object, LevelFilter::Part]);
    let strategy = n.pick(&[Strategy::WholeFirst, Strategy::TwoSteps, Strategy::OneStep, Strategy::Joint]);
    let Some(phrase) = ParsedQuery::parse(query) else { return Verdict::Broken("the phrase is none".into()) };
    let mut scorer = Anything { n, count: all.len(), asked: Vec::new() };
    let answer = localize(&all, &phrase, kind, strategy, &mut scorer);
    let hits = answer.hits();
    promise!(hits.iter().all(|h| all.get(h.identity).is_some()), "an identity that there is not");
    let ordered = hits.windows(2).all(|w| w[0].score >= w[1].score || w[1].score.is_nan());
    promise!(ordered, "the answers are not in order: {hits:?}");
    if let Answer::Found(hits) | Answer::Ambiguous(hits) = &answer {
        promise!(hits[0].score >= 0.5, "found with a score of {}", hits[0].score);
    }
    // Where one list of scores decides: the best number among the candidates is the answer's.
    if phrase.whole.is_none() && kind == LevelFilter::Auto {
        let best = scorer.asked.iter().flat_map(|a| &a.2).copied().filter(|s| !s.is_nan()).fold(f32::NAN, f32::max);
        let first = hits.first().map_or(f32::NAN, |h| h.score);
        promise!(best.is_nan() || first == best, "the best score is {best}, the first answer's {first}");
    }
    Verdict::Held
}
