//! Recipes: all choices in which this program differs from the paper. One type, which the window, the command line,
//! the agent and all measurements share.

use std::collections::HashSet;
use std::fmt;

use serde::{Deserialize, Serialize};
use strum::VariantArray;

use super::matching::MatchMode;
use crate::pipeline::semantics::lifting::codes::TOLERANCE;
use crate::scene::{Lifting, MaskGrid, MaskPrompt, Preparation, SemanticMap};

/// Canonical phrases of the paper, which fit anything.
pub const PAPERS_PHRASES: [&str; 3] = ["object", "stuff", "texture"];
/// Canonical phrases of LERF, and of the methods that follow it.
pub(crate) const LERFS_PHRASES: [&str; 4] = ["object", "things", "stuff", "texture"];
/// Temperature that spreads scores over the unit interval, as in LERF.
pub(crate) const TEMPERATURE: f32 = 10.0;

/// Source of the scores of a query.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[derive(clap::ValueEnum, strum::Display, strum::VariantArray)]
#[strum(serialize_all = "kebab-case")]
pub enum MatchBy {
    /// The names that identities have
    Names,
    /// The embeddings that an encoder made of them, as in the paper
    Embedding,
    /// Names first; embeddings where nothing has a name, or if CLIP made them
    #[default]
    Both,
}

/// Strategy for finding pieces of a whole.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[derive(clap::ValueEnum, strum::Display, strum::VariantArray)]
#[strum(serialize_all = "kebab-case")]
pub enum Strategy {
    /// Every part by the whole query and its object by the whole's phrase at once (names: whole-first)
    #[default]
    Joint,
    /// The paper's: the query first; if an object wins, its parts compete, with its phrase among the canonical ones
    TwoSteps,
    /// The query once, whatever wins
    OneStep,
    /// The whole by its own phrase, then its pieces by theirs
    WholeFirst,
}

/// Embeddings of parts that are compared.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
#[derive(clap::ValueEnum, strum::Display, strum::VariantArray)]
pub enum PartEmbedding {
    /// Moved toward their whole's: the paper's semantic deviation
    #[default]
    #[value(name = "on")]
    #[serde(rename = "on")]
    #[strum(serialize = "on")]
    Deviated,
    /// As the encoder made them
    #[value(name = "off")]
    #[serde(rename = "off")]
    #[strum(serialize = "off")]
    Raw,
}

/// Scale on which relevancy is shown.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[derive(clap::ValueEnum, strum::Display, strum::VariantArray)]
#[strum(serialize_all = "kebab-case")]
pub enum RelevancyScale {
    /// As it is, 0 to 1
    #[default]
    Raw,
    /// LERF's: from 0.5 to the largest in the view
    Lerf,
}

/// Rule for "not found".
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[derive(clap::ValueEnum, strum::Display, strum::VariantArray)]
#[strum(serialize_all = "kebab-case")]
pub enum Rejection {
    /// Never: what fits best is the answer, as in the paper
    Never,
    /// Anything less relevant than a canonical phrase
    Canonical,
    /// The same, and anything hardly more relevant for this encoder, of another color, or with a word left
    /// unexplained
    #[default]
    Strict,
}

impl Rejection {
    /// Describes the rule in words: "something is always found".
    pub(crate) fn text(self) -> &'static str {
        match self {
            Self::Never => "something is always found",
            Self::Canonical => "not found if a canonical phrase is nearer",
            Self::Strict => {
                "not found if a canonical phrase is nearer, by a margin, the color is another, or a word says something else"
            }
        }
    }

    /// Returns the least score of an answer, `usual` unless everything is accepted.
    pub(crate) fn threshold(self, usual: f32) -> f32 {
        if self == Self::Never { 0.0 } else { usual }
    }
}

/// Canonical phrases, which fit anything: an answer must be nearer to the query than they are.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct CanonicalPhrases(Vec<String>);

impl CanonicalPhrases {
    pub(crate) const NAMED: [(&str, &'static [&'static str]); 2] =
        [("paper", &PAPERS_PHRASES), ("lerf", &LERFS_PHRASES)];

    pub(crate) fn iter(&self) -> impl Iterator<Item = &str> {
        self.0.iter().map(String::as_str)
    }
}

impl Default for CanonicalPhrases {
    fn default() -> Self {
        Self(PAPERS_PHRASES.map(str::to_owned).to_vec())
    }
}

impl std::str::FromStr for CanonicalPhrases {
    type Err = String;

    /// Parses "paper", "lerf", or phrases with commas between.
    fn from_str(text: &str) -> Result<Self, String> {
        let named = Self::NAMED.iter().find(|(name, _)| *name == text.trim()).map(|(_, phrases)| phrases.join(","));
        let text = named.unwrap_or_else(|| text.to_lowercase());
        let mut phrases: Vec<String> =
            text.split(',').map(str::trim).filter(|p| !p.is_empty()).map(str::to_owned).collect();
        let mut seen = HashSet::new();
        phrases.retain(|p| seen.insert(p.clone()));
        match phrases.len() {
            0 => Err("no phrase is given: write 'paper', 'lerf', or phrases with commas between".into()),
            n if n > 64 => Err(format!("{n} phrases exceed the limit of 64")),
            _ => Ok(Self(phrases)),
        }
    }
}

impl fmt::Display for CanonicalPhrases {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0.join(", "))
    }
}

/// All choices of a query, and those made earlier, when objects were found.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct QueryConfig {
    /// Source of the scores.
    #[serde(rename = "understanding")]
    pub match_by: MatchBy,
    /// Strategy for finding pieces.
    pub strategy: Strategy,
    /// Deviated or raw embeddings of parts.
    #[serde(rename = "deviation")]
    pub parts: PartEmbedding,
    /// Canonical phrases.
    pub canonical: CanonicalPhrases,
    /// Spread of the scores; the order does not depend on it.
    pub temperature: f32,
    /// Scale on which relevancy is shown.
    #[serde(rename = "relevancy")]
    pub scale: RelevancyScale,
    /// Rule that selects the pixels and Gaussians of an answer.
    #[serde(rename = "match")]
    pub masks: MatchMode,
    /// Largest difference per channel of a matching code.
    pub tolerance: f32,
    /// Rule for "not found".
    #[serde(rename = "not_found")]
    pub rejection: Rejection,
    /// Choices made when objects were found.
    pub preparation: Preparation,
}

impl Default for QueryConfig {
    fn default() -> Self {
        Self {
            match_by: MatchBy::default(),
            strategy: Strategy::default(),
            parts: PartEmbedding::default(),
            canonical: CanonicalPhrases::default(),
            temperature: TEMPERATURE,
            scale: RelevancyScale::default(),
            masks: MatchMode::default(),
            tolerance: TOLERANCE,
            rejection: Rejection::default(),
            preparation: Preparation::default(),
        }
    }
}

/// Recipes that have a name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum, strum::Display, strum::VariantArray)]
#[strum(serialize_all = "kebab-case")]
pub enum RecipeName {
    /// This program's way
    Default,
    /// The paper's
    Paper,
}

impl RecipeName {
    /// Returns all of its choices.
    pub fn recipe(self) -> QueryConfig {
        match self {
            Self::Default => QueryConfig::default(),
            Self::Paper => QueryConfig::paper(),
        }
    }
}

impl QueryConfig {
    /// Returns all of the paper's choices.
    pub fn paper() -> Self {
        Self {
            match_by: MatchBy::Embedding,
            strategy: Strategy::TwoSteps,
            temperature: 1.0,
            scale: RelevancyScale::Lerf,
            masks: MatchMode::Codes,
            rejection: Rejection::Never,
            preparation: Preparation {
                lifting: Lifting::Paper,
                prompt: Some(MaskPrompt::Points),
                grid: Some(MaskGrid::All),
                ..Preparation::default()
            },
            ..Self::default()
        }
    }

    /// Returns the name of this recipe; `None` if it is the user's own.
    pub fn name(&self) -> Option<RecipeName> {
        RecipeName::VARIANTS.iter().copied().find(|name| *self == name.recipe())
    }

    /// Reports the choices that the scene was not prepared with; its answers differ from the recipe's.
    pub(crate) fn unmet(&self, map: &SemanticMap) -> Vec<String> {
        let mut unmet = Vec::new();
        if self.match_by == MatchBy::Embedding && map.language.is_none() {
            unmet.push("no encoder has looked at this scene, so nothing is found by embedding: prepare it with 'fmlgs preprocess --encoder'".into());
        }
        let wanted = self.preparation;
        let Some(found) = map.prepared else {
            if wanted != Preparation::default() {
                unmet.push(
                    "this scene does not say how its objects were found; 'fmlgs preprocess --recipe' finds them anew"
                        .into(),
                );
            }
            return unmet;
        };
        let mut differs = |what: &str, wanted: String, found: String| {
            if wanted != found {
                unmet.push(format!(
                    "this scene was prepared with {what} {found}, the recipe says {wanted}; 'fmlgs preprocess' decides that"
                ));
            }
        };
        differs("lifting", wanted.lifting.to_string(), found.lifting.to_string());
        if self.match_by != MatchBy::Names && self.parts == PartEmbedding::Deviated {
            differs("part weight", wanted.part_weight.to_string(), found.part_weight.to_string());
        }
        // Only a recipe with a prompt depends on the way in which masks were followed.
        if let Some(prompt) = wanted.prompt {
            let found = found.prompt.map_or_else(|| "none (masks carried by the Gaussians)".into(), |p| p.to_string());
            differs("SAM 2's prompt", prompt.to_string(), found);
        }
        if let (Some(wanted), Some(found)) = (wanted.grid, found.grid) {
            differs("the grid of points", wanted.to_string(), found.to_string());
        }
        unmet
    }
}

/// The name, if it has one, and all choices.
impl fmt::Display for QueryConfig {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = self.name().map_or_else(|| "own".into(), |n| n.to_string());
        let Preparation { lifting, part_weight, prompt, grid } = self.preparation;
        write!(
            f,
            "recipe {name}: by {}, strategy {}, deviation {} (part weight {part_weight}), canonical phrases {}, \
             temperature {}, relevancy {}, match {} within {:.0}/255, {}, lifting {lifting}",
            self.match_by,
            self.strategy,
            self.parts,
            self.canonical,
            self.temperature,
            self.scale,
            self.masks,
            255.0 * self.tolerance,
            self.rejection.text(),
        )?;
        prompt.map_or(Ok(()), |prompt| write!(f, ", SAM 2 prompted by {prompt}"))?;
        grid.map_or(Ok(()), |grid| write!(f, ", masks asked for at {} points of the grid", grid.text()))
    }
}
