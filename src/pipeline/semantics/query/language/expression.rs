//! Expressions: what a sentence means, as sets of identities taken from other sets.

use std::ops::Range;

use serde::{Deserialize, Serialize};

use crate::scene::IdentityId;
use crate::scene::identity::name_words;

/// Relation of one thing to another, the anchor.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Relation {
    /// A part of it, by the hierarchy of identities.
    #[default]
    PartOf,
    /// To its left in the current view.
    LeftOf,
    /// To its right in the current view.
    RightOf,
    /// Nearer to the camera.
    InFrontOf,
    /// Farther from the camera.
    Behind,
    /// Standing or lying on it, also on top of other things that do; or a part of it.
    On,
    /// Higher than it, over its footprint.
    Above,
    /// Lower than it, within its footprint.
    Under,
    /// Inside it, or a part of it.
    In,
    /// Close to it.
    Near,
    /// Close to it on any side.
    Around,
    /// In contact with it.
    Touching,
}

impl Relation {
    /// All relations.
    pub const ALL: [Self; 12] = [
        Self::PartOf,
        Self::LeftOf,
        Self::RightOf,
        Self::InFrontOf,
        Self::Behind,
        Self::On,
        Self::Above,
        Self::Under,
        Self::In,
        Self::Near,
        Self::Around,
        Self::Touching,
    ];

    /// Words that stand between the two things: "a mug ... the laptop".
    pub(crate) fn text(self) -> &'static str {
        match self {
            Self::PartOf => "part of",
            Self::LeftOf => "left of",
            Self::RightOf => "right of",
            Self::InFrontOf => "in front of",
            Self::Behind => "behind",
            Self::On => "on",
            Self::Above => "above",
            Self::Under => "under",
            Self::In => "in",
            Self::Near => "near",
            Self::Around => "around",
            Self::Touching => "touching",
        }
    }

    /// Returns whether the relation depends on the view.
    pub(crate) fn is_of_view(self) -> bool {
        matches!(self, Self::LeftOf | Self::RightOf | Self::InFrontOf | Self::Behind)
    }
}

/// Quantity by which things are compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum OrderBy {
    /// Volume of the thing's own upright box.
    Size,
    /// Extent along the up direction of the scene.
    Height,
    /// Longest edge of the upright box.
    Length,
    /// Longer horizontal edge.
    Breadth,
    /// Shorter horizontal edge.
    Width,
    /// Shortest edge.
    Thickness,
    /// Position along the up direction.
    Up,
    /// Position to the right in the current view.
    Right,
    /// Distance from the camera.
    Distance,
    /// Mean lightness of the color.
    Lightness,
}

impl OrderBy {
    /// Returns whether the order depends on the view.
    pub(crate) fn is_of_view(self) -> bool {
        matches!(self, Self::Right | Self::Distance)
    }
}

/// Expression, with the bytes of the text that it stands for.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Expression {
    pub(crate) set: SetOf,
    pub(crate) at: Range<usize>,
}

type Inner = Box<Expression>;

/// Set of identities.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum SetOf {
    /// By words of names, kinds and colors; the last word is the thing itself.
    Words {
        words: Vec<String>,
        /// True if several are meant.
        plural: bool,
    },
    /// By a whole name.
    Called(String),
    /// Any object ("thing"), or any part.
    Any {
        parts: bool,
        plural: bool,
    },
    /// Things like the one that was spoken of last ("one").
    Kin {
        plural: bool,
    },
    /// Identity that was spoken of last ("it"), or all of the last answer ("them").
    Last {
        plural: bool,
    },
    /// By number.
    Numbered(IdentityId),
    PartOf(Inner, Inner),
    /// Members of a set for which a condition holds, or does not.
    Where {
        of: Inner,
        is: Condition,
        not: bool,
    },
    /// Members with the most or the least of a quantity: `count` of them, after the `first`.
    Ranked {
        of: Inner,
        order: OrderBy,
        most: bool,
        first: usize,
        count: usize,
        superlative: bool,
    },
    /// Members nearest to another thing, or farthest from it.
    Nearest {
        of: Inner,
        to: Inner,
        far: bool,
        first: usize,
        count: usize,
    },
    /// One by its place in an order that is not said: "the third mug".
    Nth {
        of: Inner,
        nth: usize,
    },
    /// All of an exact number.
    Counted {
        of: Inner,
        count: usize,
    },
    /// All of them; `both` if there must be two.
    Every {
        of: Inner,
        both: bool,
    },
    /// Any one of them ("a mug").
    One(Inner),
    /// All but the last one that was spoken of.
    Other(Inner),
    /// All of several sets; with `either`, those that are there.
    Union {
        of: Vec<Expression>,
        either: bool,
    },
    Except(Inner, Inner),
}

/// Condition on a thing.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Condition {
    /// Adjectives: a color, or words of names.
    Adjective(Vec<String>),
    Placed(Relation, Inner),
    Between(Inner, Inner),
    Has(Inner),
    /// More or less of a quantity than another thing.
    Compared {
        order: OrderBy,
        more: bool,
        than: Inner,
    },
    /// More or less than a length in meters.
    Measured {
        order: OrderBy,
        more: bool,
        meters: f64,
    },
    /// Nearer to, or farther from, a thing than a length in meters.
    Within {
        near: bool,
        meters: f64,
        of: Inner,
    },
    /// Of another set: "that are toys".
    Among(Inner),
    /// On one side of the middle of the picture: "the mugs on the left".
    Side {
        order: OrderBy,
        most: bool,
    },
}

/// Sentence: a question about a set.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Sentence {
    pub(crate) asks: Asks,
    pub(crate) set: Expression,
}

/// Form of the answer that a sentence asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Asks {
    /// The things themselves.
    Things,
    /// The things, by their names: "what is on the table".
    Names,
    Count,
    /// Answer yes or no: there are any, or something is so.
    Truth,
    Colors,
    Size(OrderBy),
}

impl Expression {
    pub(crate) fn new(set: SetOf, at: Range<usize>) -> Self {
        Self { set, at }
    }

    /// Returns whether several things are meant.
    pub(crate) fn is_plural(&self) -> bool {
        match &self.set {
            SetOf::Words { plural, .. }
            | SetOf::Any { plural, .. }
            | SetOf::Kin { plural }
            | SetOf::Last { plural } => *plural,
            SetOf::Called(name) => name
                .split_whitespace()
                .next_back()
                .is_some_and(|w| name_words::singular(&w.to_lowercase()) != w.to_lowercase()),
            SetOf::Union { either: true, .. } | SetOf::Numbered(_) | SetOf::One(_) | SetOf::Nth { .. } => false,
            SetOf::PartOf(of, _) | SetOf::Where { of, .. } | SetOf::Other(of) | SetOf::Except(of, _) => of.is_plural(),
            SetOf::Ranked { count, of, superlative, .. } => *count > 1 || (!superlative && of.is_plural()),
            SetOf::Nearest { count, .. } => *count > 1,
            SetOf::Counted { .. } | SetOf::Every { .. } | SetOf::Union { .. } => true,
        }
    }

    /// Returns whether anything may be meant, restricted or not.
    pub(crate) fn is_any(&self) -> bool {
        match &self.set {
            SetOf::Any { parts, .. } => !parts,
            SetOf::Where { of, .. } => of.is_any(),
            _ => false,
        }
    }

    /// Word of the thing itself, if it is said: the "mug" of "the red mug left of the lamp".
    pub(crate) fn head(&self) -> Option<String> {
        match &self.set {
            SetOf::Words { words, .. } => words.last().cloned(),
            SetOf::Called(name) => name_words::words(name).pop(),
            SetOf::PartOf(of, _) | SetOf::Where { of, .. } | SetOf::Other(of) | SetOf::Except(of, _) => of.head(),
            SetOf::Ranked { of, .. } | SetOf::Nearest { of, .. } | SetOf::Counted { of, .. } => of.head(),
            SetOf::Every { of, .. } | SetOf::One(of) | SetOf::Nth { of, .. } => of.head(),
            _ => None,
        }
    }
}
