//! Embeddings, relevancy and codes at their limits.

use glam::DVec3;

use super::{Case, Finding};
use crate::math::stats::worst;
use crate::math::vector::unit;
use crate::pipeline::semantics::lifting::codes::{self, TOLERANCE};
use crate::pipeline::semantics::query::localize::{Scorer, localize};
use crate::pipeline::semantics::query::parse::ParsedQuery;
use crate::pipeline::semantics::query::recipe::Strategy;
use crate::pipeline::semantics::relevancy::{advantage, deviate, score};
use crate::scene::{Identities, LevelFilter};

/// Identities whose codes are assigned, each an object.
fn identities(n: usize) -> Identities {
    let mut all = Identities::objects(n);
    let centers: Vec<DVec3> =
        (0..n).map(|i| DVec3::new((i % 16) as f64, (i / 16 % 16) as f64, (i / 256) as f64)).collect();
    codes::assign(&mut all, &centers);
    all
}

struct Fixed([f32; 4]);

impl Scorer for Fixed {
    fn scores(&mut self, _: &str, _: Option<&str>) -> Vec<f32> {
        self.0.to_vec()
    }

    fn threshold(&self) -> f32 {
        0.5
    }

    fn resolution(&self) -> f32 {
        0.001
    }
}

pub(crate) fn cases() -> Vec<Case> {
    let language = |name: &'static str, run: fn(bool) -> Finding| Case::new("language", name, run);
    vec![
        language("identical embeddings are no more than anything", |faulty| {
            let v = [0.6, 0.8, 0.0];
            let canonical = if faulty { vec![0.6, 0.799, 0.04] } else { v.to_vec() };
            let s = score(advantage(&v, &v, &[canonical]), 10.0);
            Finding::within("score of a phrase that is a canonical one", f64::from((s - 0.5).abs()), 1e-6)
        }),
        language("an embedding of zeros has no direction", |faulty| {
            let nothing = if faulty { 1e-30 } else { 0.0 };
            Finding::is("it is refused", unit(&[nothing; 8]).is_none())
        }),
        language("a part opposite to its whole", |faulty| {
            let cancel = deviate(&[1.0, 0.0], &[-1.0, 0.0], if faulty { 0.51 } else { 0.5 });
            let kept = deviate(&[1.0, 0.0], &[-1.0, 0.0], 0.7);
            Finding::is(
                "half and half cancels out, else it has length one",
                cancel.is_none() && kept == Some(vec![1.0, 0.0]),
            )
        }),
        language("opposite embeddings are least alike", |faulty| {
            let v = [0.6, 0.8, 0.0];
            let w = if faulty { v } else { [-0.6, -0.8, 0.0] };
            let sideways = [0.8_f32, -0.6, 0.0];
            let s =
                [score(advantage(&v, &w, &[sideways.to_vec()]), 10.0), score(advantage(&v, &v, &[w.to_vec()]), 10.0)];
            Finding::is(
                format!("score {:.1e} where nothing speaks for it, {} where all does", s[0], s[1]),
                s[0] < 1e-4 && s[1] > 0.999,
            )
        }),
        language("embeddings of length 1e-30 and 1e30", |faulty| {
            let error = [1e-30_f32, 1e30].map(|s| {
                let u = if faulty && s > 1.0 { vec![f32::NAN] } else { unit(&[3.0 * s, 4.0 * s]).unwrap_or_default() };
                u.first().map_or(f64::NAN, |x| f64::from((x - 0.6).abs()))
            });
            Finding::within("unit length all the same", worst(error), 1e-6)
        }),
        language("logits of +-1e4", |faulty| {
            let (high, low) = (score(1e4, if faulty { 1e-4 } else { 1.0 }), score(-1e4, 1.0));
            Finding::is(format!("scores {high} and {low}"), high == 1.0 && low == 0.0)
        }),
        language("temperatures from 1e-6 to 1e6", |faulty| {
            let s = [1e-6, 1.0, if faulty { f32::NAN } else { 1e6 }].map(|t| score(0.1, t));
            Finding::is(format!("{s:?}"), s.iter().all(|s| (0.5..=1.0).contains(s)))
        }),
        language("one identity", |faulty| {
            let mut all = identities(1);
            if faulty && let Some(identity) = all.get_mut(1) {
                identity.code = [0.5; 3];
            }
            Finding::is("it has a code", all.get(1).is_some_and(|i| i.code != [0.5; 3]))
        }),
        language("4,096 identities", |faulty| {
            let mut all = identities(4_096);
            let twin = all.get(1).map(|i| i.code).filter(|_| faulty);
            if let (Some(twin), Some(last)) = (twin, all.get_mut(4_096)) {
                last.code = twin;
            }
            let finite = all.iter().all(|(_, i)| i.code.iter().all(|c| (0.0..=1.0).contains(c)));
            let mut codes: Vec<[u32; 3]> = all.iter().map(|(_, i)| i.code.map(f32::to_bits)).collect();
            codes.sort_unstable();
            codes.dedup();
            Finding::is(format!("{} different codes", codes.len()), finite && codes.len() == 4_096)
        }),
        language("a score that is NaN hides nothing", |faulty| {
            let Some(phrase) = ParsedQuery::parse("lamp") else { return Finding::is("no phrase", false) };
            let best = if faulty { f32::NAN } else { 0.9 };
            let answer = localize(
                &identities(4),
                &phrase,
                LevelFilter::Auto,
                Strategy::WholeFirst,
                &mut Fixed([f32::NAN, best, f32::NAN, 0.2]),
            );
            let first = answer.hits().first().map(|h| h.identity);
            Finding::is(format!("{}, {} answers", answer.verdict(), answer.hits().len()), first == Some(2))
        }),
        language("codes one tolerance apart", |faulty| {
            let code = [0.5, 0.25, 0.75];
            let beside = |by: f32| [code[0] + by, code[1], code[2]];
            let (inside, outside) = (beside(0.99 * TOLERANCE), beside(if faulty { 0.99 } else { 1.01 } * TOLERANCE));
            let holds = codes::matches(inside, code, TOLERANCE) && !codes::matches(outside, code, TOLERANCE);
            Finding::is("one within, one beyond", holds)
        }),
    ]
}
