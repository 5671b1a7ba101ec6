//! Conditions on the members of a set: places, pieces, colors, comparisons.

use std::collections::HashSet;
use std::ops::Range;

use super::evaluator::{Evaluator, Outcome};
use super::expression::{Condition, Expression, OrderBy, Relation, SetOf};
use super::outcome::{Matches, Member, Unmet, Why};
use super::relations::{HOLDS, Space, Way};
use super::{adjectives, nouns, order};
use crate::math::format;
use crate::scene::IdentityId;
use crate::scene::colors::row;
use crate::scene::identity::lexicon;

/// Members of a set that colors are to describe: among things, also what others merely hold.
fn with_contents(all: &mut Evaluator<'_>, of: &Expression, words: &[String]) -> Outcome {
    let found = all.set(of)?;
    if !matches!(of.set, SetOf::Any { parts: false, .. }) || !words.iter().any(|word| row(word).is_some()) {
        return Ok(found);
    }
    let contents = nouns::contents(all);
    Ok(Matches { members: found.members.into_iter().chain(contents).collect(), unclear: found.unclear })
}

/// Members of a set for which a condition holds, or does not.
pub(super) fn filtered(
    all: &mut Evaluator<'_>,
    of: &Expression,
    is: &Condition,
    not: bool,
    at: &Range<usize>,
) -> Outcome {
    let anchors = anchors(all, is)?;
    let found = match is {
        Condition::Adjective(words) if !not => with_contents(all, of, words)?,
        _ => all.set(of)?,
    };
    let before = found.clone();
    let mut unclear = found.unclear;
    let kept = match is {
        Condition::Adjective(words) => {
            let mut kept = adjectives::described(all, found, words, not, at)?;
            // A red bowl of apples is one red thing.
            let ids = kept.ids();
            let identities = all.scene.identities;
            kept.members.retain(|m| !of.is_any() || !identities.ancestors(m.id).skip(1).any(|i| ids.contains(&i)));
            kept
        }
        Condition::Placed(relation, anchor) => {
            let space = all.space(at);
            let several = !anchor.is_plural() && anchors[0].len() > 1;
            let all_of = anchor.is_plural() && relation.is_of_view();
            let identities = all.scene.identities;
            let by_parts = matches!(relation, Relation::On | Relation::In | Relation::PartOf);
            let share = |m: &Member, a: IdentityId| match &space {
                _ if by_parts && identities.is_piece(m.id, a) => Some(1.0),
                Ok(space) => space.share(*relation, m.id, a),
                Err(_) => None,
            };
            if several && !not {
                // Which of the anchors is meant does not matter if only one has anything there.
                let owners: HashSet<IdentityId> = anchors[0].iter().map(|a| identities.object_of(*a)).collect();
                let others = || found.members.iter().filter(|m| !owners.contains(&identities.object_of(m.id)));
                let with_each = anchors[0].iter().map(|a| {
                    let there = others().filter(|m| share(m, *a).is_some_and(|s| s >= HOLDS[1]));
                    there.map(|m| m.id).collect::<Vec<_>>()
                });
                let mut with_each = with_each.filter(|ids| !ids.is_empty());
                let first = with_each.next();
                unclear |= first.is_some_and(|first| with_each.any(|other| other != first));
            }
            let holds = |m: &Member| {
                // "The stick behind the body": the body of the same thing, if it has one.
                let whole = identities.object_of(m.id);
                let own = |a: &IdentityId| *a != whole && identities.object_of(*a) == whole;
                let has_own = !by_parts && anchors[0].len() > 1 && anchors[0].iter().any(own);
                let shares = anchors[0].iter().filter(|a| !has_own || own(a)).filter_map(|a| share(m, *a));
                match all_of {
                    true if anchors[0].contains(&m.id) => -1.0,
                    // Of nothing but its own pieces, a thing is on no side.
                    true => shares.reduce(f64::min).unwrap_or(-1.0),
                    false => shares.fold(-1.0, f64::max),
                }
            };
            let kept = found.judged(not, |m| holds(m));
            // Without shapes, only the parts of things are known.
            match space {
                Err(unmet) if not || kept.members.is_empty() => return Err(unmet),
                _ => kept,
            }
        }
        Condition::Between(..) => {
            let space = all.space(at)?;
            let mut ways = Vec::new();
            let [first, second] = [&anchors[0], &anchors[1]];
            for (k, a) in first.iter().enumerate() {
                let from = if first == second { k + 1 } else { 0 };
                ways.extend(second.iter().skip(from).map(|b| space.way(*a, *b)));
            }
            unclear |= ways.len() > 1;
            let ways: Vec<Way> = ways.into_iter().flatten().collect();
            let holds = |m: &Member| ways.iter().filter_map(|way| space.between(m.id, way)).fold(-1.0, f64::max);
            found.judged(not, holds)
        }
        Condition::Has(_) => {
            let identities = all.scene.identities;
            let space = all.space(at).ok();
            let lies = |s: &Space<'_>, piece: IdentityId, m: &Member| {
                let share = |relation| s.share(relation, piece, m.id).unwrap_or(0.0);
                share(Relation::In).max(share(Relation::On))
            };
            let has = |m: &Member| {
                if anchors[0].iter().any(|p| identities.is_piece(*p, m.id)) {
                    return 1.0;
                }
                let near = anchors[0].iter().filter(|p| **p != m.id).filter_map(|p| Some(lies(space?, *p, m)));
                near.fold(0.0, f64::max)
            };
            found.judged(not, has)
        }
        Condition::Compared { order, more, .. } => {
            unclear |= anchors[0].len() > 1 && !is_plural(is);
            order::compared(all, found, (*order, *more), &anchors[0], not, at)?
        }
        Condition::Measured { order, more, meters } => measured(all, found, (*order, *more != not, *meters), at)?,
        Condition::Within { near, meters, .. } => within(all, found, (*near, *meters), &anchors[0], not, at)?,
        Condition::Among(_) => found.judged(not, |m| if anchors[0].contains(&m.id) { 1.0 } else { 0.0 }),
        Condition::Side { order, most } => order::on_side(all, found, (*order, *most != not), at)?,
    };
    let kept = Matches { unclear: unclear || kept.unclear, ..kept };
    let said = all.said(&tail(of, at)).trim_end_matches(" that").trim_end_matches(" which").trim();
    let text = format!("{said}{}", all.seen_from_here(is_of_view(is)));
    let tells_apart = match is {
        Condition::Compared { .. } | Condition::Measured { .. } | Condition::Within { .. } => true,
        Condition::Adjective(_) => !not,
        _ => false,
    };
    if kept.members.is_empty() {
        all.failed |= tells_apart && all.depth == 0;
        return Err(none_is(all, &before, &text, at));
    }
    let is_idle = kept.members.len() == before.members.len();
    all.idle += usize::from(is_idle);
    all.idle_inside |= is_idle && tells_apart && all.depth > 0;
    all.step(&tail(of, at), text, &kept);
    Ok(kept)
}

fn is_plural(is: &Condition) -> bool {
    matches!(is, Condition::Compared { than, .. } if than.is_plural())
}

/// Bytes of a condition: what stands after the things that it is said of.
fn tail(of: &Expression, at: &Range<usize>) -> Range<usize> {
    if !of.at.is_empty() && of.at.end < at.end && of.at.end >= at.start {
        of.at.end..at.end
    } else if at.start < of.at.start {
        at.start..of.at.start
    } else {
        at.clone()
    }
}

/// Returns whether a condition depends on the view.
fn is_of_view(is: &Condition) -> bool {
    match is {
        Condition::Placed(relation, _) => relation.is_of_view(),
        Condition::Compared { order, .. } | Condition::Side { order, .. } => OrderBy::is_of_view(*order),
        _ => false,
    }
}

fn ids(all: &mut Evaluator<'_>, e: &Expression) -> Result<Vec<IdentityId>, Unmet> {
    Ok(all.anchor(e)?.ids())
}

/// Identities that a condition refers to.
fn anchors(all: &mut Evaluator<'_>, is: &Condition) -> Result<[Vec<IdentityId>; 2], Unmet> {
    Ok(match is {
        // The exact "bowl" may be a piece of the bowl that is meant.
        Condition::Placed(Relation::In, anchor) => [all.anchor_or_all(anchor)?.ids(), Vec::new()],
        Condition::Placed(_, anchor) | Condition::Among(anchor) => [ids(all, anchor)?, Vec::new()],
        Condition::Compared { than: of, .. } | Condition::Within { of, .. } => [ids(all, of)?, Vec::new()],
        Condition::Between(a, b) => [ids(all, a)?, ids(all, b)?],
        Condition::Has(piece) => match ids(all, piece) {
            Ok(pieces) => [pieces, Vec::new()],
            // "A mug without a straw": nothing here has one, if that is a thing at all.
            Err(unmet) if unmet.why <= Why::Unknown && unmet.words.iter().all(|w| lexicon::is_noun(w)) => {
                [Vec::new(), Vec::new()]
            }
            Err(unmet) => return Err(unmet),
        },
        Condition::Adjective(_) | Condition::Measured { .. } | Condition::Side { .. } => [Vec::new(), Vec::new()],
    })
}

/// Members within a length of one of several things, or beyond it of all.
fn within(
    all: &Evaluator<'_>,
    found: Matches,
    (near, meters): (bool, f64),
    of: &[IdentityId],
    not: bool,
    at: &Range<usize>,
) -> Outcome {
    let scale = all.scene.place.meters.filter(|m| *m > 0.0).ok_or_else(|| no_scale(all, at))?;
    let space = all.space(at)?;
    let share = |m: &Member| {
        let gaps = of.iter().filter(|id| **id != m.id).filter_map(|id| space.gap(m.id, *id));
        let gap = gaps.fold(f64::INFINITY, f64::min) * scale;
        let by = if near { meters - gap } else { gap - meters };
        if !gap.is_finite() || by < 0.0 {
            0.0
        } else if by > 0.05 * meters {
            1.0
        } else {
            HOLDS[1]
        }
    };
    Ok(found.judged(not, share))
}

fn no_scale(all: &Evaluator<'_>, at: &Range<usize>) -> Unmet {
    let text = "The length of a meter is not known in this scene, so nothing can be compared with a length.";
    Unmet { words: vec![all.said(at).into()], ..all.unmet(Why::NotUnderstood, text, at) }
}

fn measured(
    all: &Evaluator<'_>,
    found: Matches,
    (order, more, meters): (OrderBy, bool, f64),
    at: &Range<usize>,
) -> Outcome {
    let scale = all.scene.place.meters.filter(|m| *m > 0.0).ok_or_else(|| no_scale(all, at))?;
    let space = all.space(at)?;
    let value = |m: &Member| order::value(all, space, m.id, order).map(|v| v * scale);
    Ok(found.kept(|m| {
        let v = value(m)?;
        let (v, limit) = if more { (v, meters) } else { (meters, v) };
        // Within the precision of a measurement it is a guess.
        (v >= limit).then_some(if v >= limit * 1.05 { 1.0 } else { HOLDS[1] })
    }))
}

/// Reason that none of a set is so.
fn none_is(all: &Evaluator<'_>, before: &Matches, text: &str, at: &Range<usize>) -> Unmet {
    let ids: Vec<IdentityId> = before.settled().iter().map(|m| m.id).collect();
    let names: Vec<String> = ids.iter().take(3).map(|id| all.scene.identities.full_name(*id)).collect();
    let text = match names.as_slice() {
        [only] => format!("The {only} is not \u{201c}{text}\u{201d}."),
        names if names.len() == ids.len() => format!("None of these is \u{201c}{text}\u{201d}: {}.", names.join(", ")),
        _ => format!("None of {} is \u{201c}{text}\u{201d}.", format::things(ids.len(), "thing")),
    };
    Unmet { near: ids, ..all.unmet(Why::Nothing, text, at) }
}
