//! Identities of a scene: objects and their parts.
//!
//! A parent's number is smaller than its pieces', so every walk up the tree ends.

pub(crate) mod lexicon;
pub(crate) mod name_words;
pub(crate) mod whole_names;

use std::sync::{Arc, OnceLock};

use serde::{Deserialize, Serialize};

use self::name_words::SceneWords;
use self::whole_names::{WholeNames, key};
use super::Bounds;
use super::colors::SeenColors;
use super::semantic_map::{BACKGROUND_CODE, CODE_CHANNELS};
use super::shapes::SeenShapes;
use super::text;
use crate::math::format::things;

/// Object or part.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Level {
    /// A thing.
    Object,
    /// A piece of an object.
    Part,
}

/// Level of the identities asked for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "snake_case")]
pub enum LevelFilter {
    /// As the words say, else whatever fits better
    #[default]
    #[serde(rename = "any")]
    Auto,
    /// A whole object
    Object,
    /// A part
    Part,
}

impl LevelFilter {
    /// Returns whether identities of `level` are asked for.
    pub(crate) fn accepts(self, level: Level) -> bool {
        match self {
            Self::Auto => true,
            Self::Object => level == Level::Object,
            Self::Part => level == Level::Part,
        }
    }
}

/// Number of an identity: its place in the list plus one; 0 is [`NO_IDENTITY`].
pub type IdentityId = u32;

/// No identity: the number of unlabeled pixels and Gaussians.
pub const NO_IDENTITY: IdentityId = 0;

/// One object or part, the same in every view.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Identity {
    /// Object or part.
    pub level: Level,
    /// Identity that it is a part of; `NO_IDENTITY` for objects.
    pub parent: IdentityId,
    /// Names from the user or a label file, bounded by [`text::name`]; the first is shown.
    #[serde(deserialize_with = "text::read_names")]
    pub names: Vec<String>,
    /// Its point in code space, each coordinate in 0..1.
    pub code: [f32; 3],
    /// True if the user named, selected, merged, split, corrected or added it: a new search for objects keeps it.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub by_hand: bool,
}

/// All identities of a scene. Parents come before their parts.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Identities {
    list: Vec<Identity>,
    /// Names of what was removed from the scene for good.
    #[serde(default, skip_serializing_if = "Vec::is_empty", deserialize_with = "text::read_names")]
    pub(crate) removed: Vec<String>,
    /// Blur with which labels were found to be drawn best, px²; `None` = that of pictures.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) blur_px2: Option<f32>,
    /// Color of each, once computed from its Gaussians.
    #[serde(skip)]
    pub(crate) colors: SeenColors,
    /// Shape of each, once computed from its Gaussians.
    #[serde(skip)]
    pub(crate) shapes: SeenShapes,
    #[serde(skip)]
    known: Known,
}

/// Names, computed at first use.
#[derive(Clone, Debug, Default)]
struct Known {
    whole: OnceLock<Arc<WholeNames>>,
    words: OnceLock<Arc<SceneWords>>,
    /// Children of each, by number from 0.
    children: OnceLock<Arc<[Vec<IdentityId>]>>,
}

impl PartialEq for Known {
    /// Always equal: names follow from the list.
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

impl Identities {
    /// `count` unnamed objects.
    pub fn objects(count: usize) -> Self {
        let mut all = Self::default();
        for _ in 0..count {
            all.add(Level::Object, NO_IDENTITY, Vec::new());
        }
        all
    }

    /// Adds an identity. A parent that does not exist yet becomes [`NO_IDENTITY`].
    pub fn add(&mut self, level: Level, parent: IdentityId, names: Vec<String>) -> IdentityId {
        let parent = if self.get(parent).is_some() { parent } else { NO_IDENTITY };
        let names = names.iter().map(|name| text::name(name)).collect();
        self.known = Known::default();
        self.list.push(Identity { level, parent, names, code: [0.5; 3], by_hand: false });
        self.list.len() as IdentityId
    }

    /// Returns whether any of them has a name.
    pub(crate) fn have_names(&self) -> bool {
        self.list.iter().any(|i| i.names.iter().any(|name| !key(name).is_empty()))
    }

    /// Number of identities.
    pub fn len(&self) -> usize {
        self.list.len()
    }

    /// Number of identities of a level.
    pub(crate) fn count(&self, level: Level) -> usize {
        self.list.iter().filter(|i| i.level == level).count()
    }

    /// Numbers of each level in words: "3 objects and 1 part", "1 object".
    pub(crate) fn counted(&self) -> String {
        let [objects, parts] = [Level::Object, Level::Part].map(|level| self.count(level));
        match parts {
            0 => things(objects, "object"),
            _ => format!("{} and {}", things(objects, "object"), things(parts, "part")),
        }
    }

    /// Returns whether there are no identities.
    pub fn is_empty(&self) -> bool {
        self.list.is_empty()
    }

    /// The identity with this number.
    pub fn get(&self, id: IdentityId) -> Option<&Identity> {
        self.list.get((id as usize).checked_sub(1)?)
    }

    /// The identity with this number, to change it.
    pub fn get_mut(&mut self, id: IdentityId) -> Option<&mut Identity> {
        self.known = Known::default();
        self.list.get_mut((id as usize).checked_sub(1)?)
    }

    /// All of them with their numbers.
    pub fn iter(&self) -> impl Iterator<Item = (IdentityId, &Identity)> {
        self.list.iter().enumerate().map(|(i, identity)| (i as IdentityId + 1, identity))
    }

    /// Gives an identity another first name, bounded by [`text::name`].
    pub(crate) fn rename(&mut self, id: IdentityId, name: &str) {
        if let Some(identity) = self.get_mut(id) {
            let name = text::name(name);
            identity.names.retain(|n| *n != name);
            identity.names.insert(0, name);
        }
    }

    /// Records names of removed identities, once each.
    pub(crate) fn add_removed(&mut self, names: impl IntoIterator<Item = String>) {
        let new: Vec<String> = names.into_iter().filter(|name| !self.removed.contains(name)).collect();
        self.removed.extend(new);
    }

    /// Marks an identity as edited by the user.
    pub(crate) fn mark_by_hand(&mut self, id: IdentityId) {
        self.get_mut(id).into_iter().for_each(|identity| identity.by_hand = true);
    }

    /// Its own name: the first, or its number.
    pub fn name(&self, id: IdentityId) -> String {
        let named = self.get(id).and_then(|i| i.names.iter().find(|name| !key(name).is_empty())).cloned();
        named.unwrap_or_else(|| if id == NO_IDENTITY { "nothing".into() } else { format!("#{id}") })
    }

    /// Its own name as it is shown, with its number where others are called the same: "mug #3".
    pub(crate) fn label(&self, id: IdentityId) -> String {
        let label = (id as usize).checked_sub(1).and_then(|i| self.whole_names().labels.get(i).cloned());
        label.unwrap_or_else(|| self.name(id))
    }

    /// Its label with those of its wholes: "button a · red controller". Typed, it finds this identity and no other.
    pub fn full_name(&self, id: IdentityId) -> String {
        let full = (id as usize).checked_sub(1).and_then(|i| self.whole_names().full.get(i).cloned());
        full.unwrap_or_default()
    }

    /// Identities of these levels that a text as a whole names: by a name, a label, or a full name.
    pub fn called(&self, text: &str, level: LevelFilter) -> Vec<IdentityId> {
        self.whole_names().called(text, self, level)
    }

    fn whole_names(&self) -> &WholeNames {
        self.known.whole.get_or_init(|| Arc::new(WholeNames::new(self)))
    }

    /// Words of all names.
    pub(crate) fn words(&self) -> &SceneWords {
        self.known.words.get_or_init(|| Arc::new(SceneWords::new(self)))
    }

    /// Gives identities the shapes of boxes in world space, by number from 0.
    pub fn set_boxes(&mut self, boxes: &[Option<Bounds>]) {
        self.shapes = SeenShapes::of_boxes(boxes);
    }

    /// An identity and its parents, inside out: itself first, its object last.
    pub fn ancestors(&self, id: IdentityId) -> impl Iterator<Item = IdentityId> + '_ {
        let known = |id: IdentityId| self.get(id).map(|_| id);
        // Parents come before their parts, so numbers fall and the walk ends.
        std::iter::successors(known(id), move |&at| self.get(at).and_then(|i| known(i.parent)).filter(|p| *p < at))
    }

    /// Returns whether `id` is a piece of `whole`, directly or not; nothing is a piece of itself.
    pub(crate) fn is_piece(&self, id: IdentityId, whole: IdentityId) -> bool {
        self.ancestors(id).skip(1).any(|i| i == whole)
    }

    /// Returns whether two identities are the same, or one is a piece of the other.
    pub(crate) fn are_related(&self, a: IdentityId, b: IdentityId) -> bool {
        a == b || self.is_piece(a, b) || self.is_piece(b, a)
    }

    pub(crate) fn object_of(&self, id: IdentityId) -> IdentityId {
        self.ancestors(id).last().unwrap_or(NO_IDENTITY)
    }

    /// For each number from 0, whether it is `id` or a piece of it.
    pub(crate) fn descendants(&self, id: IdentityId) -> Vec<bool> {
        let mut inside = vec![false; self.list.len() + 1];
        for (i, identity) in self.iter() {
            inside[i as usize] = i == id || inside[identity.parent as usize];
        }
        inside
    }

    /// Codes of an identity's object and of itself as a part. A missing object or part has the background's code.
    pub(crate) fn codes(&self, id: IdentityId) -> [f32; CODE_CHANNELS] {
        let code = |id: IdentityId, level: Level| {
            self.get(id).filter(|i| i.level == level).map_or(BACKGROUND_CODE, |i| i.code)
        };
        let (object, part) = (code(self.object_of(id), Level::Object), code(id, Level::Part));
        std::array::from_fn(|c| if c < 3 { object[c] } else { part[c - 3] })
    }

    /// Identities whose parent it is.
    pub(crate) fn children(&self, id: IdentityId) -> impl Iterator<Item = IdentityId> + '_ {
        let all = self.known.children.get_or_init(|| {
            let mut all = vec![Vec::new(); self.list.len() + 1];
            let inner = self.iter().filter(|(_, i)| i.parent != NO_IDENTITY);
            inner.for_each(|(id, i)| all.get_mut(i.parent as usize).into_iter().for_each(|of| of.push(id)));
            all.into()
        });
        all.get(id as usize).into_iter().flatten().copied()
    }
}

/// Unnamed objects that are boxes, each with its center and its edges.
#[cfg(test)]
pub(crate) fn of_boxes(boxes: &[([f64; 3], [f64; 3])]) -> Identities {
    use glam::DVec3;
    let mut all = Identities::objects(boxes.len());
    let cube = |(c, s): &([f64; 3], [f64; 3])| {
        let (c, h) = (DVec3::from(*c), DVec3::from(*s) * 0.5);
        Some(Bounds { min: c - h, max: c + h })
    };
    all.set_boxes(&[None].into_iter().chain(boxes.iter().map(cube)).collect::<Vec<_>>());
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_and_pieces_follow_the_tree() {
        let mut all = Identities::default();
        let doll = all.add(Level::Object, NO_IDENTITY, vec!["doll".into()]);
        let piano = all.add(Level::Object, NO_IDENTITY, vec![]);
        let face = all.add(Level::Part, doll, vec!["face".into()]);
        let eye = all.add(Level::Part, face, vec!["eye".into()]);
        assert_eq!(all.ancestors(eye).collect::<Vec<_>>(), [eye, face, doll]);
        assert_eq!((all.object_of(eye), all.object_of(piano), all.object_of(99)), (doll, piano, NO_IDENTITY));
        assert_eq!(all.descendants(doll), [false, true, false, true, true]);
        assert_eq!(all.descendants(face), [false, false, false, true, true]);
        assert_eq!(all.children(doll).collect::<Vec<_>>(), [face]);
        assert_eq!((all.name(piano), all.name(eye), all.name(0)), ("#2".into(), "eye".into(), "nothing".into()));
        assert_eq!(all.add(Level::Part, 77, vec![]), 5);
        assert_eq!(all.get(5).map(|i| i.parent), Some(NO_IDENTITY));
    }

    #[test]
    fn names_are_those_of_the_whole_line() {
        let mut all = Identities::default();
        assert!(all.is_empty());
        assert_eq!(all.len(), 0);
        let doll = all.add(Level::Object, NO_IDENTITY, vec!["red doll".into(), "rosa".into()]);
        let face = all.add(Level::Part, doll, vec![]);
        let eye = all.add(Level::Part, face, vec!["eye".into()]);
        assert!(!all.is_empty() && all.len() == 3);
        assert_eq!(all.full_name(eye), "eye · #2 · red doll");
        assert_eq!(
            (all.children(NO_IDENTITY).count(), all.ancestors(NO_IDENTITY).count(), all.ancestors(9).count()),
            (0, 0, 0)
        );
        // An object's own code and none of a part; a part's both.
        all.get_mut(doll).expect("there").code = [0.1; 3];
        all.get_mut(eye).expect("there").code = [0.9; 3];
        assert_eq!(all.codes(doll), [0.1, 0.1, 0.1, 0.5, 0.5, 0.5]);
        assert_eq!(all.codes(eye), [0.1, 0.1, 0.1, 0.9, 0.9, 0.9]);
        assert_eq!(all.codes(NO_IDENTITY), [0.5; 6]);
        assert!(all.get_mut(NO_IDENTITY).is_none() && all.get_mut(4).is_none());
    }
}
