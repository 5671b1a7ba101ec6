//! What can be decided about a scene, by stable names, and what a person wants instead.

use std::collections::BTreeSet;
use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

/// One thing that a plan decides.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Item {
    /// Bands of the spherical harmonics that are drawn.
    Colour,
    /// When the maps of a view's identities are drawn.
    Maps,
    /// Whether they have a level for parts.
    Parts,
    /// When objects and parts are drawn alone.
    Portraits,
    /// When the encoder that understands phrases is loaded.
    Encoder,
    /// Precision of the features that are stored.
    Precision,
    /// When the graph for moving about is built.
    Navigation,
    /// When depth is drawn.
    Depth,
    /// Size of the pictures to train on.
    Photos,
    /// Photos that are held out.
    Held,
    /// Size of the pictures in which objects are looked for.
    Objects,
    /// Most Gaussians of a training.
    Gaussians,
    /// Which renderer draws.
    Backend,
    /// When the window is drawn.
    Redraw,
    /// How long the renderer keeps its working memory.
    Buffers,
}

/// The only word besides an item's alternative.
const AUTO: &str = "auto";

impl Item {
    /// All of them, in the order of a plan.
    pub const ALL: [Self; 15] = [
        Self::Colour,
        Self::Maps,
        Self::Parts,
        Self::Portraits,
        Self::Encoder,
        Self::Precision,
        Self::Navigation,
        Self::Depth,
        Self::Photos,
        Self::Held,
        Self::Objects,
        Self::Gaussians,
        Self::Backend,
        Self::Redraw,
        Self::Buffers,
    ];

    /// Its name on the command line, the same in every version.
    pub fn id(self) -> &'static str {
        match self {
            Self::Colour => "colour",
            Self::Maps => "maps",
            Self::Parts => "parts",
            Self::Portraits => "portraits",
            Self::Encoder => "encoder",
            Self::Precision => "precision",
            Self::Navigation => "navigation",
            Self::Depth => "depth",
            Self::Photos => "photos",
            Self::Held => "held",
            Self::Objects => "objects",
            Self::Gaussians => "gaussians",
            Self::Backend => "backend",
            Self::Redraw => "redraw",
            Self::Buffers => "buffers",
        }
    }

    /// Its name for people.
    pub fn subject(self) -> &'static str {
        match self {
            Self::Colour => "Colour",
            Self::Maps => "Feature maps",
            Self::Parts => "Part level",
            Self::Portraits => "Portraits",
            Self::Encoder => "Text encoder",
            Self::Precision => "Precision",
            Self::Navigation => "Path graph",
            Self::Depth => "Depth",
            Self::Photos => "Photos",
            Self::Held => "Held out",
            Self::Objects => "Object search",
            Self::Gaussians => "Gaussians",
            Self::Backend => "Backend",
            Self::Redraw => "Redraw",
            Self::Buffers => "Drawing buffers",
        }
    }

    /// What a person can have instead of what the data suggest.
    pub fn alternative(self) -> Option<&'static str> {
        match self {
            Self::Colour | Self::Photos | Self::Objects => Some("full"),
            Self::Maps | Self::Depth | Self::Redraw => Some("always"),
            Self::Parts => Some("on"),
            Self::Portraits | Self::Encoder | Self::Navigation => Some("open"),
            Self::Backend => Some("cpu"),
            Self::Buffers => Some("keep"),
            Self::Precision | Self::Held | Self::Gaussians => None,
        }
    }

    /// The choices that [`Wish`] takes, for help and errors: "colour=auto|full, ...".
    pub fn choices() -> String {
        let one = |item: &Self| item.alternative().map(|a| format!("{}={AUTO}|{a}", item.id()));
        Self::ALL.iter().filter_map(one).collect::<Vec<_>>().join(", ")
    }
}

impl fmt::Display for Item {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.id())
    }
}

/// What a person wants of one item: "colour=full".
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Wish {
    /// Of which.
    pub item: Item,
    /// The alternative instead of what the data suggest.
    pub instead: bool,
}

impl FromStr for Wish {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let unknown = |what: String| format!("{what}; there are {}", Item::choices());
        let Some((id, value)) = text.split_once('=') else {
            return Err(unknown(format!("'{text}' is not ITEM=VALUE")));
        };
        let (id, value) = (id.trim(), value.trim());
        let known = Item::ALL.into_iter().find(|item| item.id() == id);
        let Some((item, alternative)) = known.and_then(|item| Some((item, item.alternative()?))) else {
            return Err(unknown(format!("nothing that can be chosen is called '{id}'")));
        };
        match value {
            AUTO => Ok(Self { item, instead: false }),
            v if v == alternative => Ok(Self { item, instead: true }),
            v => Err(format!("'{v}' is no value of {id}, which is '{AUTO}' or '{alternative}'")),
        }
    }
}

/// The items of which a person wants the alternative.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Overrides(BTreeSet<Item>);

impl Overrides {
    /// Everything on: all alternatives but another backend.
    pub fn everything() -> Self {
        let all = Item::ALL.into_iter().filter(|i| i.alternative().is_some() && *i != Item::Backend);
        Self(all.collect())
    }

    /// Whether the alternative is wanted.
    pub fn has(&self, item: Item) -> bool {
        self.0.contains(&item)
    }

    /// Takes a wish; a later one of the same item wins.
    pub fn set(&mut self, wish: Wish) {
        if wish.instead {
            self.0.insert(wish.item);
        } else {
            self.0.remove(&wish.item);
        }
    }
}

impl FromIterator<Wish> for Overrides {
    fn from_iter<T: IntoIterator<Item = Wish>>(wishes: T) -> Self {
        let mut all = Self::default();
        wishes.into_iter().for_each(|wish| all.set(wish));
        all
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wishes_are_read_and_the_last_one_wins() {
        let read = |text: &str| text.parse::<Wish>();
        let all: Overrides =
            ["colour=full", "maps=always", "colour=auto"].iter().map(|t| read(t).expect("a wish")).collect();
        assert!(all.has(Item::Maps) && !all.has(Item::Colour));
        for (bad, names) in [("colour", "colour=auto|full"), ("shine=on", "maps=auto|always"), ("held=auto", "parts=")]
        {
            assert!(read(bad).expect_err(bad).contains(names), "{bad}");
        }
        assert!(read("colour=always").expect_err("no value").contains("'full'"));
    }

    #[test]
    fn names_are_different_and_stored_ones_come_back() {
        let ids: BTreeSet<&str> = Item::ALL.iter().map(|i| i.id()).collect();
        assert_eq!(ids.len(), Item::ALL.len());
        for item in Item::ALL {
            assert_eq!(serde_json::to_value(item).expect("json"), item.id());
        }
        let all = Overrides::everything();
        let text = serde_json::to_string(&all).expect("json");
        assert_eq!(serde_json::from_str::<Overrides>(&text).expect("json"), all);
        assert!(!all.has(Item::Backend) && all.has(Item::Colour));
    }
}
