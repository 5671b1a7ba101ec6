//! Orders and comparisons by a quantity: largest, second from the left, nearest, taller than.

use std::ops::Range;

use super::evaluator::{Evaluator, Outcome};
use super::expression::OrderBy;
use super::outcome::{Matches, Member, Unmet, Why};
use super::relations::Space;
use crate::scene::{IdentityId, Level};

/// Relative difference of two quantities under which they count as equal.
const ALIKE: f64 = 0.03;

/// Quantity of an identity; `None` if it cannot be measured.
pub(super) fn value(all: &Evaluator<'_>, space: &Space<'_>, id: IdentityId, order: OrderBy) -> Option<f64> {
    let axes = space.axes();
    let shape = space.shapes.get(id)?;
    let extent = || space.shapes.extent(id, axes.up);
    Some(match order {
        OrderBy::Size => extent()?.volume(),
        OrderBy::Height => extent()?.height,
        OrderBy::Length => extent().map(|e| e.length.max(e.height))?,
        OrderBy::Breadth => extent()?.length,
        OrderBy::Width => extent()?.width,
        OrderBy::Thickness => extent().map(|e| e.width.min(e.height))?,
        OrderBy::Up => {
            let (low, high) = shape.span(axes.up);
            0.5 * (low + high)
        }
        OrderBy::Right => (shape.center() - space.view.eye).dot(axes.right),
        OrderBy::Distance => shape.center().distance(space.view.eye),
        OrderBy::Lightness => all.scene.identities.colors.lightness(id)?,
    })
}

/// Difference under which two values of an order count as equal.
fn slack(space: &Space<'_>, id: IdentityId, order: OrderBy, value: f64) -> f64 {
    match order {
        OrderBy::Up | OrderBy::Right | OrderBy::Distance => {
            0.03 * space.shapes.get(id).map_or(0.0, |s| s.bounds.radius())
        }
        OrderBy::Lightness => 0.02,
        // A volume has the errors of three lengths.
        OrderBy::Size => 4.0 * ALIKE * value.abs(),
        _ => ALIKE * value.abs(),
    }
}

/// Takes `count` members after the first `first` ones, by an order.
pub(super) fn ranked(
    all: &mut Evaluator<'_>,
    found: Matches,
    (order, most, superlative): (OrderBy, bool, bool),
    [first, count]: [usize; 2],
    at: &Range<usize>,
) -> Outcome {
    let members = found.settled();
    if members.len() <= 1 && first == 0 {
        return Ok(Matches { members, unclear: found.unclear });
    }
    // A comparative needs two things: of three, "the left one" stays unclear.
    if !superlative && members.len() > 2 {
        return Ok(Matches { members, unclear: true });
    }
    let space = all.space(at)?;
    let sign = if most { -1.0 } else { 1.0 };
    let measured = members.iter().filter_map(|m| Some((sign * value(all, space, m.id, order)?, *m)));
    let mut values: Vec<(f64, Member)> = measured.collect();
    values.sort_by(|a, b| a.0.total_cmp(&b.0));
    let slack = |v: &(f64, Member)| slack(space, v.1.id, order, v.0);
    let picked = pick(all, &values, [first, count], slack, at)?;
    let picked = Matches { unclear: found.unclear || picked.unclear, ..picked };
    let said = format!("{}{}", all.said(at), all.seen_from_here(order.is_of_view()));
    all.step(at, said, &picked);
    Ok(picked)
}

/// Takes members from sorted values; those that cannot be told apart from the last one make it unclear.
fn pick(
    all: &Evaluator<'_>,
    values: &[(f64, Member)],
    [first, count]: [usize; 2],
    slack: impl Fn(&(f64, Member)) -> f64,
    at: &Range<usize>,
) -> Outcome {
    let n = values.len();
    if n <= first || (count > 1 && n < first + count) {
        let text = match n {
            0 => "Nothing here has a size or place to compare.".to_owned(),
            1 => "There is only one of them here.".to_owned(),
            n => format!("There are only {n} of them here."),
        };
        let near = values.iter().map(|(_, m)| m.id).collect();
        return Err(Unmet { near, ..all.unmet(Why::Nothing, text, at) });
    }
    let last = first + count - 1;
    let alike =
        |a: usize, b: usize| (values[b].0 - values[a].0).abs() <= slack(&values[a]).max(slack(&values[b])).max(1e-12);
    let (mut from, mut to) = (first, last);
    while from > 0 && alike(from - 1, from) {
        from -= 1;
    }
    while to + 1 < n && alike(to, to + 1) {
        to += 1;
    }
    let unclear = from < first || to > last;
    let members = values[from..=to].iter().map(|(_, m)| *m).collect();
    Ok(Matches { members, unclear })
}

/// Takes the members nearest to, or farthest from, one of several things.
pub(super) fn nearest(
    all: &mut Evaluator<'_>,
    found: Matches,
    anchors: &Matches,
    far: bool,
    [first, count]: [usize; 2],
    at: &Range<usize>,
) -> Outcome {
    let space = all.space(at)?;
    let identities = all.scene.identities;
    let sign = if far { -1.0 } else { 1.0 };
    let mut result = Matches { unclear: found.unclear || anchors.unclear, ..Matches::default() };
    for anchor in &anchors.members {
        let related = |id: IdentityId| identities.are_related(id, anchor.id);
        // What carries a thing touches it, and is not meant by "nearest".
        let carries = |id: IdentityId| {
            identities.get(id).is_some_and(|i| i.level == Level::Object)
                && (space.rests(anchor.id, id, 4) || space.rests(id, anchor.id, 4))
        };
        let far_of = |m: &Member| {
            let gap = space.gap(m.id, anchor.id)?;
            let middle = space.shapes.get(m.id)?.center().distance(space.shapes.get(anchor.id)?.center());
            // Of things that touch, the middles decide.
            Some(sign * (gap + 0.05 * middle))
        };
        let members = found.settled();
        let all_free = members.iter().filter(|m| !related(m.id) && !carries(m.id)).copied().collect::<Vec<_>>();
        let free =
            if all_free.is_empty() { members.into_iter().filter(|m| !related(m.id)).collect() } else { all_free };
        let mut values: Vec<(f64, Member)> = free.iter().filter_map(|m| Some((far_of(m)?, *m))).collect();
        values.sort_by(|a, b| a.0.total_cmp(&b.0));
        let size = space.shapes.get(anchor.id).map_or(0.0, |s| s.bounds.radius());
        let one = pick(all, &values, [first, count], |v| ALIKE * (v.0.abs() + size), at)?;
        result.unclear |= one.unclear;
        let new = one.members.into_iter().filter(|m| !result.members.iter().any(|o| o.id == m.id)).collect::<Vec<_>>();
        result.members.extend(new);
    }
    result.unclear |= result.members.len() > count.max(1) && anchors.members.len() > 1;
    let said = all.said(at);
    all.step(at, said, &result);
    Ok(result)
}

/// Members with more or less of a quantity than all of `than`.
pub(super) fn compared(
    all: &Evaluator<'_>,
    found: Matches,
    (order, more): (OrderBy, bool),
    than: &[IdentityId],
    not: bool,
    at: &Range<usize>,
) -> Outcome {
    let space = all.space(at)?;
    let sign = if more { 1.0 } else { -1.0 };
    let of = |id: IdentityId| value(all, space, id, order);
    let identities = all.scene.identities;
    let share = |m: &Member| {
        let Some(own) = of(m.id).filter(|_| !than.contains(&m.id)) else { return 0.0 };
        // A thing is neither nearer nor farther than its own piece.
        let apart = |other: &&IdentityId| !order.is_of_view() || !identities.are_related(m.id, **other);
        let over = |other: &IdentityId| {
            let theirs = of(*other)?;
            let slack = slack(space, m.id, order, own).max(slack(space, *other, order, theirs)).max(1e-12);
            let by = sign * (own - theirs);
            Some(if by > slack {
                1.0
            } else if by > -slack {
                0.7
            } else {
                0.0
            })
        };
        than.iter().filter(apart).filter_map(over).reduce(f64::min).unwrap_or(0.0)
    };
    let kept = found.judged(not, share);
    Ok(if not { kept.kept(|m| (!than.contains(&m.id)).then_some(m.sure)) } else { kept })
}

/// Members on one side of the middle of the picture, or of the others.
pub(super) fn on_side(
    all: &Evaluator<'_>,
    found: Matches,
    (order, most): (OrderBy, bool),
    at: &Range<usize>,
) -> Outcome {
    let space = all.space(at)?;
    let of = |m: &Member| value(all, space, m.id, order);
    let mut values: Vec<f64> = found.members.iter().filter_map(of).collect();
    values.sort_by(f64::total_cmp);
    let middle = match (order, values.as_slice()) {
        (OrderBy::Right, _) => 0.0,
        (_, []) => return Ok(Matches::default()),
        (_, values) => 0.5 * (values[0] + values[values.len() - 1]),
    };
    Ok(found.kept(|m| of(m).filter(|v| (*v > middle) == most).map(|_| 0.8)))
}
