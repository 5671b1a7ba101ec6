//! Offers of the chat: sentences that ask for what it does not do itself, and the actions that do it.

use crate::pipeline::semantics::lifting::edit::Edit;
use crate::scene::colors;
use crate::scene::identity::name_words::{singular, words};
use crate::scene::{Identities, IdentityId, NO_IDENTITY};
use crate::ui::actions::{Action, Pane};
use crate::ui::object_menu::{self, MenuThing};
use crate::worker::ViewMode;

/// Most words between two words of a phrase.
const GAP: usize = 3;
/// Most words before the name of a thing, such as "of the".
const ARTICLES: usize = 2;

/// Actions that are offered.
enum Offered {
    These(fn() -> Vec<Action>),
    /// An action on the thing that the sentence names; without one, the list of objects.
    OnThing(fn(IdentityId) -> Action),
}

use Offered::{OnThing, These};

/// Phrases and what they ask for; the first row that fits counts. The words of a phrase may have others between them;
/// `a|b` is one of several words, `{}` the name of a thing, `{color}` a color.
const OFFERS: &[(&[&str], Offered)] = &[
    (
        &[
            "screenshot",
            "screen shot",
            "snapshot",
            "save|capture|grab picture|image|view|screen",
            "take a|another picture|photo|image|shot",
            "as png",
        ],
        These(|| vec![Action::Screenshot]),
    ),
    (
        &["play path|flight|keyframe", "fly along path|keyframe"],
        These(|| vec![Action::PlayPath, Action::ShowPane(Pane::Camera)]),
    ),
    (
        &[
            "video|movie|film|gif|animation|camera|turntable|flight around|of {}",
            "fly|orbit|circle|go|goes|turn|spin|move|walk around {}",
            "orbit|circle|turntable {}",
        ],
        OnThing(|id| Action::Turntable(Some(id))),
    ),
    (
        &[
            "video",
            "movie",
            "animation",
            "turntable",
            "mp4",
            "make|save|export|record gif",
            "film {}",
            "fly|orbit|circle around",
            "go|goes around",
            "camera path|tour|move|movement",
            "keyframe",
        ],
        These(|| vec![Action::ShowPane(Pane::Camera), Action::AddKey, Action::ExportVideo]),
    ),
    (&["conversation|chat save|export", "save|export conversation|chat"], These(|| vec![Action::SaveChat])),
    (
        &["export|save|write|download mask", "mask as|to|into png|coco|file|folder"],
        These(|| vec![Action::ExportAll, Action::ExportPhrases]),
    ),
    (&["other|own|my|load|use|open|choose mask", "load|import|use label"], These(|| vec![Action::ChooseMasks])),
    (&["web page|site|viewer", "webpage", "website", "html"], These(|| vec![Action::ExportPage])),
    (&["export|save|write|download all|everything|every"], These(|| vec![Action::ExportAll, Action::ExportPly])),
    (
        &["export|download|write {}", "save {} as|to|in|into", "give|get|need|want {} as ply|spz|sog|glb|splat|file"],
        OnThing(Action::ExportTarget),
    ),
    (
        &["export", "save|write|download scene|gaussian|splat|model|ply|spz|sog|glb"],
        These(|| vec![Action::ExportPly, Action::ExportAll, Action::ExportPage]),
    ),
    (
        &["stop|pause|cancel|halt|interrupt|resume train|training|job|search"],
        These(|| vec![Action::PauseJob, Action::Cancel]),
    ),
    (
        &["train anew|again|afresh", "retrain", "new training", "begin|start over"],
        These(|| vec![Action::TrainAnew, Action::StartTraining]),
    ),
    (
        &[
            "start|begin|run|continue|launch|do train|training",
            "train",
            "how train|training",
            "optimize|fit gaussian|scene",
        ],
        These(|| vec![Action::StartTraining]),
    ),
    (&["psnr", "ssim", "evaluate", "held out"], These(|| vec![Action::Evaluate])),
    (
        &["floater", "artifact", "clean|tidy", "remove|delete stray|noise|haze|needle|gaussian|splat", "denoise"],
        These(|| vec![Action::MeasureSplats]),
    ),
    (&["crop", "clip|cut box", "cut|trim away|off|out scene|gaussian|background|rest"], These(|| vec![Action::Crop])),
    (&["compare|comparison scene|training|run|model", "compare two"], These(|| vec![Action::ChooseComparison])),
    (
        &[
            "compare|comparison|next|versus|vs|against|difference photo|picture|image|truth|original",
            "ground truth",
            "compare",
        ],
        These(|| vec![Action::ToggleCompare, Action::Show(ViewMode::Difference)]),
    ),
    (&["side by side", "split view|screen", "two view"], These(|| vec![Action::ToggleSplit])),
    (&["measure", "ruler", "tape", "set|change scale|unit", "scale meter|metre|unit"], These(|| vec![Action::Measure])),
    (
        &["depth map|view|image|picture", "show|see|display|color|draw depth"],
        These(|| vec![Action::Show(ViewMode::Depth)]),
    ),
    (&["alpha", "opacity"], These(|| vec![Action::Show(ViewMode::Alpha)])),
    (&["inspect", "property|parameter gaussian|splat|pixel"], These(|| vec![Action::Inspect])),
    (
        &[
            "recolor|recolour|repaint|paint|tint|dye",
            "color|colour {} {color}",
            "make|turn|change|want {} {color}",
            "change|another|new|different color|colour {}",
            "move|shift|push|pull|slide|drag|lift|raise|lower {}",
            "rotate|turn|spin|tilt|flip {}",
            "scale|resize|enlarge|shrink|stretch|duplicate|clone|copy {}",
            "put|place|set {} on|onto|next|beside|under|left|right|behind|in|into|up|down|by",
            "make {} bigger|larger|smaller|taller|shorter|wider|twice|half",
            "copy of {}",
        ],
        OnThing(Action::Transform),
    ),
    (&["split|divide {}"], OnThing(|id| Action::Change(Edit::Split(id)))),
    (&["correct|fix|refine {}", "mask|outline|extent of {}"], OnThing(Action::Correct)),
    (
        &["add|include photo|picture|image", "more|additional photo|picture|image"],
        These(|| vec![Action::AddFolder, Action::AddPhoto]),
    ),
    (
        &["select|mark|add|create|make|define new object|thing", "add|mark|label object"],
        These(|| vec![Action::SegmentNew(Some(NO_IDENTITY))]),
    ),
    (&["find|detect|recognize|search object", "segment"], These(|| vec![Action::FindObjects, Action::SegmentPhoto])),
    (
        &["open|load another|other|new|different scene|file|folder|splat|data", "open|load scene|file|folder"],
        These(|| vec![Action::OpenFolder, Action::OpenFile]),
    ),
    (&["dark|light theme|mode"], These(|| super::actions::THEMES.map(Action::UseTheme).to_vec())),
    (&["full screen", "fullscreen"], These(|| vec![Action::FillWindow])),
    (&["larger|bigger text|font|letter"], These(|| vec![Action::LargerText])),
    (&["key|keyboard shortcut", "shortcut"], These(|| vec![Action::Shortcuts])),
    (&["reset view|camera", "start|initial|first view"], These(|| vec![Action::ResetView])),
];

/// Actions for a sentence that the chat did not understand. `is_missing`: it was understood but names a thing that is
/// not there; a single word is then no reason to offer something else.
pub(super) fn offers(sentence: &str, all: &Identities, is_missing: bool) -> Vec<(Action, String)> {
    let mut said = words(sentence);
    // To turn a thing off is no turn.
    if let Some(at) = switch(&said) {
        said.remove(at);
    }
    let fit = OFFERS.iter().find_map(|(phrases, offered)| {
        let mut clear = phrases.iter().filter(|phrase| !is_missing || phrase.contains(' '));
        Some((offered, clear.find_map(|phrase| fits(phrase, &said, all))?))
    });
    let thing = || (0..said.len()).find_map(|at| named_at(&said, at, all)).map(|(id, _)| id);
    match fit {
        None => Vec::new(),
        Some((These(actions), _)) => actions().into_iter().map(|action| (action.clone(), action.text())).collect(),
        Some((OnThing(action), named)) => match named.or_else(thing) {
            Some(id) => {
                let action = action(id);
                let known = object_menu::named_actions(MenuThing { all, id, is_hidden: false })
                    .into_iter()
                    .find(|(known, _)| *known == action);
                vec![known.unwrap_or_else(|| (action.clone(), action.text()))]
            }
            None => {
                let list = Action::ShowPane(Pane::Objects);
                vec![(list.clone(), list.text())]
            }
        },
    }
}

/// The word "turn" or "switch" of "turn the lamp off" and "turn on the lamp".
fn switch(said: &[String]) -> Option<usize> {
    let is_end = |word: Option<&String>| word.is_none_or(|w| matches!(w.as_str(), "and" | "then" | "please" | "again"));
    let switches = |at: &usize| {
        let rest = &said[at + 1..];
        let ends = |k: usize| match rest[k].as_str() {
            "off" => true,
            "on" => k == 0 || is_end(rest.get(k + 1)),
            _ => false,
        };
        (0..rest.len().min(GAP + ARTICLES)).any(ends)
    };
    (0..said.len()).filter(|at| matches!(said[*at].as_str(), "turn" | "switch")).find(switches)
}

/// Compares a phrase with a sentence: its words must occur in this order, not far from each other. Returns the thing
/// at the place of its `{}`, if it has one.
fn fits(phrase: &str, said: &[String], all: &Identities) -> Option<Option<IdentityId>> {
    let (mut at, mut gap, mut thing) = (0, said.len(), None);
    for item in phrase.split(' ') {
        if item == "{}" {
            let places = (at..said.len()).take(if at == 0 { said.len() } else { ARTICLES + 1 });
            let (place, (id, words)) = places.map(|p| (p, named_at(said, p, all))).find_map(|(p, n)| Some((p, n?)))?;
            (at, gap, thing) = (place + words, GAP, Some(id));
            continue;
        }
        let is_word = |word: &String| match item {
            "{color}" => colors::row(word).is_some(),
            _ => item.split('|').any(|one| singular(one) == *word),
        };
        let next = said[at..].iter().take(gap + 1).position(is_word)?;
        (at, gap) = (at + next + 1, GAP);
    }
    Some(thing)
}

/// The thing whose name begins at a word of a sentence, and the number of its words; `None` if it could be one of
/// several. Where no whole name begins, the last words of one do: "the bear" for "teddy bear".
fn named_at(said: &[String], at: usize, all: &Identities) -> Option<(IdentityId, usize)> {
    let named = |at: usize| {
        let begins = |name: &[String], is_whole: bool| {
            let cut = if is_whole { 0..1 } else { 1..name.len() };
            cut.map(|from| &name[from..]).find(|end| said[at..].starts_with(end)).map_or(0, <[String]>::len)
        };
        let of = |is_whole: bool| -> Vec<(IdentityId, usize)> {
            let longest = |id| all.words().names(id).iter().map(|name| begins(name, is_whole)).max().unwrap_or(0);
            all.iter().map(|(id, _)| (id, longest(id))).filter(|(_, n)| *n > 0).collect()
        };
        let whole = of(true);
        if whole.is_empty() { of(false) } else { whole }
    };
    let most = named(at).into_iter().map(|(_, n)| n).max()?;
    let ids: Vec<IdentityId> = named(at).into_iter().filter(|(_, n)| *n == most).map(|(id, _)| id).collect();
    // "the lid of the kettle": the lid whose whole is named as well.
    let wholes: Vec<IdentityId> = (0..said.len()).flat_map(named).map(|(id, _)| id).collect();
    let mut within = ids.iter().filter(|id| wholes.iter().any(|whole| all.is_piece(**id, *whole)));
    match (ids.as_slice(), within.next(), within.next()) {
        ([one], _, _) | (_, Some(one), None) => Some((*one, most)),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Level;

    fn table() -> Identities {
        let mut all = Identities::default();
        let kettle = all.add(Level::Object, NO_IDENTITY, vec!["kettle".into()]);
        all.add(Level::Part, kettle, vec!["lid".into()]);
        let jar = all.add(Level::Object, NO_IDENTITY, vec!["cookie jar".into()]);
        all.add(Level::Part, jar, vec!["lid".into()]);
        all.add(Level::Object, NO_IDENTITY, vec!["red controller".into()]);
        all.add(Level::Object, NO_IDENTITY, vec!["blue controller".into()]);
        all.add(Level::Object, NO_IDENTITY, vec!["teddy bear".into()]);
        all.add(Level::Object, NO_IDENTITY, vec!["camera".into()]);
        all
    }

    fn first(sentence: &str) -> Option<Action> {
        offers(sentence, &table(), false).into_iter().next().map(|(action, _)| action)
    }

    #[test]
    fn a_sentence_that_asks_for_an_action_is_offered_that_action() {
        for (sentence, action) in [
            ("take a screenshot and save it", Action::Screenshot),
            ("can you save this picture?", Action::Screenshot),
            ("make the red controller green", Action::Transform(5)),
            ("I want the bear to be purple: paint it", Action::Transform(7)),
            ("change the color of the kettle", Action::Transform(1)),
            ("now a camera move that circles the bear", Action::Turntable(Some(7))),
            ("move the kettle next to the camera please", Action::Transform(1)),
            ("recolor something", Action::ShowPane(Pane::Objects)),
            ("rotate the teddy bear by 90 degrees", Action::Transform(7)),
            ("duplicate the lid of the kettle", Action::Transform(2)),
            ("make a video that goes around the bear", Action::Turntable(Some(7))),
            ("fly around the kettle", Action::Turntable(Some(1))),
            ("turn the kettle on its side", Action::Transform(1)),
            ("turn the lid of the jar to the left", Action::Transform(4)),
            ("make a video that goes around", Action::ShowPane(Pane::Camera)),
            ("record a short movie of all this", Action::ShowPane(Pane::Camera)),
            ("export the kettle as glb", Action::ExportTarget(1)),
            ("write the whole scene to a spz", Action::ExportPly),
            ("put this on a web page", Action::ExportPage),
            ("save the masks as coco", Action::ExportAll),
            ("start training", Action::StartTraining),
            ("Could we train for some more steps?", Action::StartTraining),
            ("pause the training", Action::PauseJob),
            ("how do I measure?", Action::Measure),
            ("clean the floaters", Action::MeasureSplats),
            ("crop the scene to the table", Action::Crop),
            ("compare with the photo", Action::ToggleCompare),
            ("compare it with another training run", Action::ChooseComparison),
            ("show the depth map", Action::Show(ViewMode::Depth)),
            ("what is the PSNR of this?", Action::Evaluate),
            ("segment the scene", Action::FindObjects),
            ("use my own masks", Action::ChooseMasks),
            ("can it be made sharper with more photos?", Action::AddFolder),
            ("save this chat", Action::SaveChat),
        ] {
            assert_eq!(first(sentence), Some(action), "{sentence}");
        }
    }

    #[test]
    fn sentences_about_the_scene_are_offered_nothing() {
        for sentence in [
            "what colour is the lamp?",
            "where is the camera",
            "which of them is the reddest one",
            "is the kettle hotter than the bear",
            "why is the jar so big",
            "where's my phone?",
            "turn me maybe 90 degrees to the left so I get the kettle",
            "this jar is in my way, take it off the picture for a second",
            "undo the change to the red controller",
            "tell me a joke",
            "turn the camera off",
            "turn off the kettle please",
            "which is bigger, the camera or the teddy bear, and turn the kettle on",
            "",
        ] {
            assert_eq!(first(sentence), None, "{sentence}");
        }
        // A thing that is not there is no wish, unless it is said with its verb.
        let missing = |sentence| offers(sentence, &table(), true).len();
        assert_eq!((missing("hide the video"), missing("where is the ruler")), (0, 0));
        assert!(missing("remove the gaussians that float") > 0 && missing("save the scene") > 0);
    }

    #[test]
    fn offers_carry_the_names_of_menus_and_palette() {
        let said = |sentence| offers(sentence, &table(), false).into_iter().map(|(_, name)| name).collect::<Vec<_>>();
        assert_eq!(said("take a screenshot"), [Action::Screenshot.text()]);
        assert_eq!(said("paint the kettle blue"), ["Move, turn or recolor: kettle"]);
        // Every action of the table is in the menu of a thing or in the palette.
        let (palette, menu) =
            (Action::all(), object_menu::named_actions(MenuThing { all: &table(), id: 1, is_hidden: false }));
        for (phrases, offered) in OFFERS {
            let actions = match offered {
                These(actions) => actions(),
                OnThing(action) => vec![action(1)],
            };
            let is_known = |a: &Action| palette.contains(a) || menu.iter().any(|(m, _)| m == a);
            assert!(actions.iter().all(is_known), "{phrases:?}");
        }
    }
}
