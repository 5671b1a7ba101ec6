//! Items of a plan that the user may override, by their names on the command line.

use std::collections::BTreeSet;
use std::str::FromStr;

use serde::{Deserialize, Serialize};
use strum::{IntoStaticStr, VariantArray};

/// Item that the user may override.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, IntoStaticStr, VariantArray)]
#[serde(rename_all = "kebab-case")]
#[strum(serialize_all = "kebab-case")]
pub enum Item {
    /// Time at which identity maps of a view are drawn.
    FeatureMaps,
    /// Time at which the text encoder is loaded.
    Encoder,
    /// Size of the images to train on.
    Photos,
    /// Renderer that draws.
    Backend,
    /// Levels of detail for moving cameras.
    Levels,
}

/// The only word besides an item's alternative.
const AUTO: &str = "auto";

impl Item {
    pub(crate) fn id(self) -> &'static str {
        self.into()
    }

    /// Alternative to the automatic choice.
    pub(crate) fn alternative(self) -> &'static str {
        match self {
            Self::FeatureMaps | Self::Levels => "always",
            Self::Encoder => "eager",
            Self::Photos => "full",
            Self::Backend => "cpu",
        }
    }

    /// The choices that [`PlanOverride`] takes: "photos=auto|full, ...".
    pub(crate) fn choices() -> String {
        let one = |item: &Self| format!("{}={AUTO}|{}", item.id(), item.alternative());
        Self::VARIANTS.iter().map(one).collect::<Vec<_>>().join(", ")
    }
}

/// The user's choice for one item: "photos=full".
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PlanOverride {
    pub(crate) item: Item,
    /// True for the alternative, false for the automatic choice.
    pub(crate) instead: bool,
}

impl FromStr for PlanOverride {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (id, value) = text.split_once('=').unwrap_or((text, ""));
        let item = Item::VARIANTS.iter().copied().find(|item| item.id() == id.trim());
        match (item, value.trim()) {
            (Some(item), AUTO) => Ok(Self { item, instead: false }),
            (Some(item), value) if value == item.alternative() => Ok(Self { item, instead: true }),
            _ => Err(format!("'{text}' is none of {}", Item::choices())),
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
        Self(Item::VARIANTS.iter().copied().filter(|item| *item != Item::Backend).collect())
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
        let all = ["photos=full", "feature-maps=always", "photos = auto"].map(|t| read(t).expect("an override"));
        let all = Overrides::from_iter(all);
        assert!(all.has(Item::FeatureMaps) && !all.has(Item::Photos));
        for bad in ["photos", "photos=always", "shine=on", "color=full"] {
            let error = read(bad).expect_err(bad);
            assert!(error.contains(bad) && error.contains("photos=auto|full"), "{error}");
        }
    }

    #[test]
    fn stored_names_are_those_of_the_command_line() {
        for item in Item::VARIANTS {
            assert_eq!(serde_json::to_value(item).expect("json"), item.id());
        }
        let all = Overrides::everything();
        let text = serde_json::to_string(&all).expect("json");
        assert_eq!(serde_json::from_str::<Overrides>(&text).expect("json"), all);
        assert!(!all.has(Item::Backend) && all.has(Item::Photos));
    }
}
