//! Answers in words: counts, names, yes and no, colors and sizes.

use super::expression::{Asks, OrderBy};
use super::outcome::{Unmet, Why};
use super::{QueryScene, Understood};
use crate::math::format;
use crate::scene::IdentityId;
use crate::scene::colors::{COLORS, ColorVerdict};

/// Most names in a sentence.
const MOST: usize = 12;

/// Puts the answer in words, where the sentence asks for words.
pub(super) fn complete(scene: &QueryScene<'_>, answer: &mut Understood) {
    let ids: Vec<IdentityId> = answer.found.settled().iter().map(|m| m.id).collect();
    let names = list(scene, &ids);
    let nothing = answer.unmet.as_ref();
    answer.said = match (answer.asks, nothing) {
        (_, Some(Unmet { why: Why::NotUnderstood | Why::Failed, .. })) => None,
        (Asks::Count, None) => Some(format!("{}: {names}.", ids.len())),
        (Asks::Count, Some(unmet)) => Some(format!("0. {}", unmet.text)),
        (Asks::Truth, None) => Some(format!("Yes: {names}.")),
        (Asks::Truth, Some(unmet)) => Some(format!("No. {}", unmet.text)),
        (Asks::Names, None) => Some(format!("{}.", format::capital(&names))),
        (Asks::Colors, None) => Some(colors(scene, &ids)),
        (Asks::Size(order), None) => Some(sizes(scene, &ids, order)),
        (Asks::Things | Asks::Names | Asks::Colors | Asks::Size(_), _) => None,
    };
    // A count of none is an answer, and so is "no".
    if matches!(answer.asks, Asks::Truth | Asks::Count) {
        answer.plural = true;
    }
}

fn list(scene: &QueryScene<'_>, ids: &[IdentityId]) -> String {
    let mut names: Vec<String> = ids.iter().take(MOST).map(|id| scene.identities.full_name(*id)).collect();
    if ids.len() > MOST {
        names.push(format!("{} more", ids.len() - MOST));
    }
    format::list(&names)
}

fn colors(scene: &QueryScene<'_>, ids: &[IdentityId]) -> String {
    let of = |id: &IdentityId| {
        let has = |row: &usize| scene.identities.colors.judge(*id, *row) == Some(ColorVerdict::Yes);
        let named: Vec<&str> = (0..COLORS.len()).filter(has).map(|row| COLORS[row][0]).collect();
        let name = format::capital(&scene.identities.full_name(*id));
        if named.is_empty() {
            format!("{name}: no color that has a name.")
        } else {
            format!("{name}: {}.", named.join(", "))
        }
    };
    ids.iter().take(MOST).map(of).collect::<Vec<_>>().join(" ")
}

fn sizes(scene: &QueryScene<'_>, ids: &[IdentityId], order: OrderBy) -> String {
    let up = scene.place.view.map_or(glam::DVec3::Z, |v| v.up);
    let of = |id: &IdentityId| {
        let name = format::capital(&scene.identities.full_name(*id));
        let Some(e) = scene.identities.shapes.extent(*id, up) else { return format!("{name}: not measured.") };
        let length = |units: f64| format::length(units, scene.place.meters);
        match order {
            OrderBy::Height => format!("{name}: {} high.", length(e.height)),
            OrderBy::Length => format!("{name}: {} x {} x {}.", length(e.length), length(e.width), length(e.height)),
            OrderBy::Breadth => format!("{name}: {} wide.", length(e.length)),
            _ => format!("{name}: {} deep.", length(e.width)),
        }
    };
    ids.iter().take(MOST).map(of).collect::<Vec<_>>().join(" ")
}
