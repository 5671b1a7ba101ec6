//! Effects of the last stroke beside the selection itself, told in a line of the card.

use crate::jobs::select::MarkEffect;
use crate::math::format::capital;
use crate::scene::IdentityId;

/// Line of the card, and all there is to tell.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct ToldEffect {
    pub(super) line: String,
    pub(super) all: String,
    /// True if another identity loses more than a few percent.
    pub(super) is_warning: bool,
}

impl ToldEffect {
    /// The effect with identities by their `name`; `None` if there is nothing to tell.
    pub(super) fn new(effect: &MarkEffect, name: &dyn Fn(IdentityId) -> String) -> Option<Self> {
        let told = |text: &String| format!("{}.", capital(text));
        let [left, taken, along] = effect.sentences(name).map(|text| text.as_ref().map(told));
        let is_warning = effect.others.iter().any(|other| !other.is_left && other.is_large());
        let limited = effect.is_limited.then(|| {
            let all = "The click could have changed much more of what is known. A line changes more.";
            ("Only near the click".to_owned(), all.to_owned())
        });
        let along = along.map(|all| ("Only along the line".to_owned(), all));
        let whole = |text: Option<String>| text.map(|text| (text.clone(), text));
        let all = [whole(left), limited, along, whole(taken)];
        let mut each: Vec<(String, String)> = all.into_iter().flatten().collect();
        if is_warning {
            each.rotate_right(1);
        }
        let line = each.first()?.0.clone();
        let all: Vec<String> = each.into_iter().map(|(_, all)| all).collect();
        Some(Self { line, all: all.join("\n"), is_warning })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pipeline::semantics::lifting::splat_tree::others::OtherChange;

    #[test]
    fn losses_come_first_then_what_was_left_and_everything_is_told() {
        let name = |id: IdentityId| ["", "mouth", "cup"][id as usize].to_owned();
        let change = |id, share, is_left| OtherChange { id, gaussians: 20, share, is_left };
        let told = |is_limited, others: &[OtherChange]| {
            ToldEffect::new(&MarkEffect { is_limited, others: others.to_vec(), ..MarkEffect::default() }, &name)
        };
        let left = "Left 20 Gaussians of 'mouth' as they were: the stroke does not touch it.";
        let both = told(true, &[change(1, 0.5, true), change(2, 0.01, false)]).expect("told");
        assert!(both.line == left && !both.is_warning, "{both:?}");
        let lines: Vec<&str> = both.all.lines().collect();
        assert_eq!(lines.len(), 3, "{lines:?}");
        assert!(lines[1].contains("A line changes more") && lines[2] == "Took 20 Gaussians from 'cup' (1.0 %).");
        let large = told(false, &[change(1, 0.5, true), change(2, 0.2, false)]).expect("told");
        assert_eq!((large.line.as_str(), large.is_warning), ("Took 20 Gaussians from 'cup' (20 %).", true));
        assert!(large.all.ends_with(left), "{}", large.all);
        assert_eq!(told(true, &[]).map(|told| told.line).as_deref(), Some("Only near the click"));
        let along = ToldEffect::new(&MarkEffect { is_along: true, ..MarkEffect::default() }, &name).expect("told");
        assert!(along.line == "Only along the line" && along.all.starts_with("Changed only what is along the line:"));
        // The control: a stroke that changes nothing else.
        assert_eq!(told(false, &[]), None);
    }
}
