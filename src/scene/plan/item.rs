//! Items that a plan decides, by stable names, and the user's overrides.

use std::collections::BTreeSet;
use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};
use strum::{EnumProperty, EnumString, IntoStaticStr, VariantArray};

/// An item that a plan decides: its name on the command line, the same in every version (with the name of earlier
/// versions, if another), its subject for the user, and its alternative.
#[derive(
    Clone,
    Copy,
    Debug,
    PartialEq,
    Eq,
    PartialOrd,
    Ord,
    Hash,
    Serialize,
    Deserialize,
    EnumProperty,
    EnumString,
    IntoStaticStr,
    VariantArray,
)]
#[serde(rename_all = "kebab-case")]
#[strum(serialize_all = "kebab-case")]
pub enum Item {
    /// Bands of the spherical harmonics that are drawn.
    #[serde(alias = "colour")]
    #[strum(to_string = "color", serialize = "colour", props(subject = "Color", instead = "full"))]
    Color,
    /// Time at which identity maps of a view are drawn.
    #[serde(alias = "maps")]
    #[strum(to_string = "feature-maps", serialize = "maps", props(subject = "Feature maps", instead = "always"))]
    FeatureMaps,
    /// Part level of these maps.
    #[strum(props(subject = "Part level", instead = "on"))]
    Parts,
    /// Time at which objects and parts are drawn alone.
    #[serde(alias = "portraits")]
    #[strum(to_string = "thumbnails", serialize = "portraits", props(subject = "Thumbnails", instead = "eager"))]
    Thumbnails,
    /// Time at which the text encoder is loaded.
    #[strum(props(subject = "Text encoder", instead = "eager"))]
    Encoder,
    /// Precision of the features that are stored.
    #[strum(props(subject = "Precision"))]
    Precision,
    /// Time at which the navigation graph is built.
    #[strum(props(subject = "Navigation graph", instead = "eager"))]
    Navigation,
    /// Time at which depth is drawn.
    #[strum(props(subject = "Depth", instead = "always"))]
    Depth,
    /// Size of the images to train on.
    #[strum(props(subject = "Photos", instead = "full"))]
    Photos,
    /// Photos that are held out.
    #[serde(alias = "held")]
    #[strum(to_string = "holdout", serialize = "held", props(subject = "Holdout"))]
    Holdout,
    /// Size of the images in which objects are searched for.
    #[strum(props(subject = "Object search", instead = "full"))]
    Objects,
    /// Most Gaussians of a training.
    #[strum(props(subject = "Gaussians"))]
    Gaussians,
    /// Renderer that draws.
    #[strum(props(subject = "Backend", instead = "cpu"))]
    Backend,
    /// Time at which the window is drawn.
    #[strum(props(subject = "Redraw", instead = "always"))]
    Redraw,
    /// Lifetime of the renderer's working memory.
    #[strum(props(subject = "Render buffers", instead = "keep"))]
    Buffers,
    /// Levels of detail for moving cameras.
    #[strum(props(subject = "Levels of detail", instead = "always"))]
    Levels,
}

/// The only word besides an item's alternative.
const AUTO: &str = "auto";
/// Name of "eager" in earlier versions.
const FORMER_EAGER: &str = "open";

impl Item {
    pub(crate) fn id(self) -> &'static str {
        self.into()
    }

    pub(crate) fn subject(self) -> &'static str {
        self.get_str("subject").unwrap_or_default()
    }

    /// Alternative to the automatic choice.
    pub(crate) fn alternative(self) -> Option<&'static str> {
        self.get_str("instead")
    }

    /// The choices that [`PlanOverride`] takes, for help and errors: "color=auto|full, ...".
    pub(crate) fn choices() -> String {
        let one = |item: &Self| item.alternative().map(|a| format!("{}={AUTO}|{a}", item.id()));
        Self::VARIANTS.iter().filter_map(one).collect::<Vec<_>>().join(", ")
    }
}

impl fmt::Display for Item {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.id())
    }
}

/// The user's choice for one item: "color=full".
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PlanOverride {
    pub(crate) item: Item,
    /// True for the alternative, false for the automatic choice.
    pub(crate) instead: bool,
}

impl FromStr for PlanOverride {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let unknown = |what: String| format!("{what}; there are {}", Item::choices());
        let Some((id, value)) = text.split_once('=') else {
            return Err(unknown(format!("'{text}' is not ITEM=VALUE")));
        };
        let (id, value) = (id.trim(), value.trim());
        let known = Item::from_str(id).ok().and_then(|item| Some((item, item.alternative()?)));
        let Some((item, alternative)) = known else {
            return Err(unknown(format!("nothing that can be chosen is called '{id}'")));
        };
        match value {
            AUTO => Ok(Self { item, instead: false }),
            v if v == alternative => Ok(Self { item, instead: true }),
            FORMER_EAGER if alternative == "eager" => Ok(Self { item, instead: true }),
            v => Err(format!("'{v}' is no value of {id}, which is '{AUTO}' or '{alternative}'")),
        }
    }
}

/// Items for which the user chose the alternative.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Overrides(BTreeSet<Item>);

impl Overrides {
    /// Everything on: all alternatives but another backend.
    pub fn everything() -> Self {
        let all = Item::VARIANTS.iter().copied().filter(|i| i.alternative().is_some() && *i != Item::Backend);
        Self(all.collect())
    }

    pub(crate) fn has(&self, item: Item) -> bool {
        self.0.contains(&item)
    }

    /// Applies an override; a later one of the same item wins.
    pub(crate) fn set(&mut self, one: PlanOverride) {
        if one.instead {
            self.0.insert(one.item);
        } else {
            self.0.remove(&one.item);
        }
    }
}

impl FromIterator<PlanOverride> for Overrides {
    fn from_iter<T: IntoIterator<Item = PlanOverride>>(overrides: T) -> Self {
        let mut all = Self::default();
        overrides.into_iter().for_each(|one| all.set(one));
        all
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn overrides_are_read_and_the_last_one_wins() {
        let read = |text: &str| text.parse::<PlanOverride>();
        let all = ["color=full", "feature-maps=always", "color=auto"].map(|t| read(t).expect("an override"));
        let all = Overrides::from_iter(all);
        assert!(all.has(Item::FeatureMaps) && !all.has(Item::Color));
        for (bad, names) in
            [("color", "color=auto|full"), ("shine=on", "feature-maps=auto|always"), ("holdout=auto", "parts=")]
        {
            assert!(read(bad).expect_err(bad).contains(names), "{bad}");
        }
        assert!(read("color=always").expect_err("no value").contains("'full'"));
        assert!(read("depth=open").is_err());
    }

    #[test]
    fn words_of_earlier_versions_are_understood() {
        for (former, now) in [
            ("colour=full", "color=full"),
            ("maps=always", "feature-maps=always"),
            ("portraits=open", "thumbnails=eager"),
            ("encoder=open", "encoder=eager"),
        ] {
            assert_eq!(former.parse::<PlanOverride>(), now.parse(), "{former}");
            assert!(now.parse::<PlanOverride>().is_ok());
        }
        let stored: Overrides = serde_json::from_str(r#"["color", "maps", "portraits", "held"]"#).expect("read");
        assert!([Item::Color, Item::FeatureMaps, Item::Thumbnails, Item::Holdout].iter().all(|i| stored.has(*i)));
    }

    #[test]
    fn names_are_different_and_stored_ones_come_back() {
        let ids: BTreeSet<&str> = Item::VARIANTS.iter().map(|i| i.id()).collect();
        assert_eq!(ids.len(), Item::VARIANTS.len());
        for item in Item::VARIANTS {
            assert_eq!(serde_json::to_value(item).expect("json"), item.id());
            assert!(!item.subject().is_empty());
        }
        let all = Overrides::everything();
        let text = serde_json::to_string(&all).expect("json");
        assert_eq!(serde_json::from_str::<Overrides>(&text).expect("json"), all);
        assert!(!all.has(Item::Backend) && all.has(Item::Color));
    }
}
