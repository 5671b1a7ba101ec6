//! The recipe on the command line: one by its name, then single choices.

use super::number;
use crate::pipeline::semantics::query::matching::MatchMode;
use crate::pipeline::semantics::query::recipe::{
    CanonicalPhrases, MatchBy, PartEmbedding, QueryConfig, RecipeName, Rejection, RelevancyScale, Strategy,
};
use crate::scene::SemanticMap;

/// Recipe of answering queries: this program's, the paper's, or any mixture of them.
#[derive(Clone, Debug, Default, clap::Args)]
#[command(next_help_heading = "How questions are answered")]
pub(crate) struct RecipeArgs {
    /// All choices at once; what is given beside it differs from it
    #[arg(long, value_enum)]
    recipe: Option<RecipeName>,
    /// Names or embeddings that a query is compared with
    #[arg(long, value_enum)]
    by: Option<MatchBy>,
    /// Strategy for a query of a part of an object
    #[arg(long, value_enum)]
    strategy: Option<Strategy>,
    /// Semantic deviation: embeddings of parts are moved toward their objects'
    #[arg(long, value_enum)]
    deviation: Option<PartEmbedding>,
    /// Phrases that mean anything: 'paper' (object, stuff, texture), 'lerf' (and things), or others, with commas
    #[arg(long, value_name = "PHRASES")]
    canonical: Option<CanonicalPhrases>,
    /// Spread of scores by embedding: 1 in the paper, 10 in LERF and by default
    #[arg(long, value_parser = number::within(1e-3..=1e3_f32))]
    temperature: Option<f32>,
    /// Scale of relevancy
    #[arg(long, value_enum)]
    relevancy: Option<RelevancyScale>,
    /// Rule that selects the pixels and Gaussians of an answer
    #[arg(long = "match", value_enum)]
    matching: Option<MatchMode>,
    /// The same as '--match codes'
    #[arg(long, conflicts_with = "matching")]
    blend: bool,
    /// Largest difference per channel of a match, in 255ths
    #[arg(long, value_parser = number::within(0.0..=255.0_f32))]
    tolerance: Option<f32>,
    /// Rule by which a query has no answer
    #[arg(long, value_enum)]
    not_found: Option<Rejection>,
}

impl RecipeArgs {
    pub(crate) fn recipe(&self) -> QueryConfig {
        let base = self.recipe.unwrap_or(RecipeName::Default).recipe();
        QueryConfig {
            match_by: self.by.unwrap_or(base.match_by),
            strategy: self.strategy.unwrap_or(base.strategy),
            parts: self.deviation.unwrap_or(base.parts),
            canonical: self.canonical.clone().unwrap_or(base.canonical),
            temperature: self.temperature.unwrap_or(base.temperature),
            scale: self.relevancy.unwrap_or(base.scale),
            masks: if self.blend { MatchMode::Codes } else { self.matching.unwrap_or(base.masks) },
            tolerance: self.tolerance.map_or(base.tolerance, |t| t / 255.0),
            rejection: self.not_found.unwrap_or(base.rejection),
            preparation: base.preparation,
        }
    }

    /// Lines on the requested recipe, and on its parts that the scene was not prepared for; nothing for the default.
    pub(crate) fn lines(&self, map: &SemanticMap) -> Vec<String> {
        let recipe = self.recipe();
        if self.recipe.is_none() && recipe == QueryConfig::default() {
            return Vec::new();
        }
        let unmet = recipe.unmet(map).into_iter().map(|text| format!("note: {text}"));
        std::iter::once(recipe.to_string()).chain(unmet).collect()
    }
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;
    use crate::scene::{Lifting, MaskPrompt, Preparation};

    #[derive(clap::Parser)]
    struct Line {
        #[command(flatten)]
        args: RecipeArgs,
    }

    fn recipe(line: &str) -> QueryConfig {
        Line::try_parse_from(std::iter::once("x").chain(line.split_whitespace())).expect(line).args.recipe()
    }

    #[test]
    fn every_flag_changes_its_choice_and_no_other() {
        assert_eq!((recipe(""), recipe("--recipe default")), (QueryConfig::default(), QueryConfig::default()));
        assert_eq!(recipe("--recipe paper"), QueryConfig::paper());
        let paper = QueryConfig::paper;
        let phrases: CanonicalPhrases = "a thing,it".parse().expect("phrases");
        let cases = [
            ("--by names", QueryConfig { match_by: MatchBy::Names, ..paper() }),
            ("--strategy joint", QueryConfig { strategy: Strategy::Joint, ..paper() }),
            ("--deviation off", QueryConfig { parts: PartEmbedding::Raw, ..paper() }),
            (
                "--canonical lerf",
                QueryConfig { canonical: "object,things,stuff,texture".parse().expect("four"), ..paper() },
            ),
            ("--temperature 4", QueryConfig { temperature: 4.0, ..paper() }),
            ("--relevancy raw", QueryConfig { scale: RelevancyScale::Raw, ..paper() }),
            ("--match relevancy", QueryConfig { masks: MatchMode::Relevancy, ..paper() }),
            ("--tolerance 51", QueryConfig { tolerance: 0.2, ..paper() }),
            ("--not-found strict", QueryConfig { rejection: Rejection::Strict, ..paper() }),
        ];
        for (flag, wanted) in cases {
            assert_eq!(recipe(&format!("--recipe paper {flag}")), wanted, "{flag}");
            assert_ne!(wanted, paper(), "{flag}");
            assert_eq!(wanted.name(), None, "{flag}");
        }
        assert_eq!(recipe("--blend").masks, MatchMode::Codes);
        let own = Line::try_parse_from(["x", "--canonical", "A thing, it"]).expect("phrases").args.recipe();
        assert_eq!(own.canonical, phrases);
        for bad in
            [&["--canonical", ","][..], &["--temperature", "0"], &["--by", "magic"], &["--blend", "--match", "codes"]]
        {
            assert!(Line::try_parse_from(["x"].iter().chain(bad)).is_err(), "{bad:?}");
        }
    }

    #[test]
    fn what_is_printed_is_the_recipe_and_what_the_scene_is_not() {
        let lines = |line: &str, map: &SemanticMap| {
            Line::try_parse_from(std::iter::once("x").chain(line.split_whitespace())).expect(line).args.lines(map)
        };
        let mut map = SemanticMap { language: Some(Default::default()), ..SemanticMap::default() };
        assert!(lines("", &map).is_empty(), "nobody asked for a recipe");
        let default = lines("--recipe default", &map);
        assert!(default.len() == 1 && default[0].starts_with("recipe default: by both, strategy joint"), "{default:?}");
        let paper = lines("--recipe paper", &map);
        assert!(paper[0].starts_with("recipe paper: by embedding, strategy two-steps, deviation on"), "{paper:?}");
        assert!(paper[0].contains("temperature 1,") && paper[0].contains("lifting paper, SAM 2 prompted by points"));
        assert!(paper.len() == 2 && paper[1].contains("does not say"), "{paper:?}");
        map.prepared = Some(QueryConfig::paper().preparation);
        assert_eq!(lines("--recipe paper", &map).len(), 1, "it was prepared so");
        map.prepared = Some(Preparation { part_weight: 0.5, ..Preparation::default() });
        let notes = lines("--recipe paper", &map)[1..].join("\n");
        for wanted in ["lifting votes, the recipe says paper", "part weight 0.5, the recipe says 0.7", "says points"] {
            assert!(notes.contains(wanted), "{wanted}: {notes}");
        }
        assert!(!lines("--recipe paper --deviation off", &map).join("\n").contains("part weight 0.5"));
        assert_eq!(QueryConfig::paper().preparation.lifting, Lifting::Paper);
        assert_eq!(QueryConfig::paper().preparation.prompt, Some(MaskPrompt::Points));
        map.language = None;
        assert!(lines("--by embedding", &map).join("\n").contains("no encoder has looked at this scene"));
    }
}
