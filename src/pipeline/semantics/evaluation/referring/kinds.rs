//! Kinds of things and the nouns that belong to them, in clear cases, and things that no scene has.

/// A kind of things.
pub(super) struct TrueKind {
    /// Name of one, and of several.
    pub(super) names: [&'static str; 2],
    /// Nouns of the kind.
    pub(super) holds: &'static [&'static str],
    /// Nouns that some people count in.
    pub(super) perhaps: &'static [&'static str],
}

/// Kinds that sentences ask for; some have nothing in any scene.
pub(super) static KINDS: [TrueKind; 24] = [
    kind(["piece of fruit", "pieces of fruit"], &["apple", "orange", "lemon", "pear"], &[]),
    kind(["animal", "animals"], &["duck", "teddy bear"], &[]),
    kind(["vehicle", "vehicles"], &["car", "boat", "truck", "motorcycle"], &["rocket"]),
    kind(["toy", "toys"], &["toy car", "teddy bear"], &["robot", "duck", "rocket", "boat", "house", "motorcycle"]),
    kind(["piece of furniture", "pieces of furniture"], &["table", "chair"], &["lamp", "rug"]),
    kind(
        ["container", "containers"],
        &["mug", "bottle", "cookie jar", "fruit bowl", "bag"],
        &["kettle", "teapot", "pan", "pot", "saucer", "plate", "pot plant", "case", "jar", "bowl", "holder"],
    ),
    kind(["drinking vessel", "drinking vessels"], &["mug"], &["bottle", "teapot", "bowl"]),
    kind(["building", "buildings"], &["house"], &["cabin"]),
    kind(["timepiece", "timepieces"], &["clock"], &["dial"]),
    kind(["bird", "birds"], &["duck"], &[]),
    kind(["watercraft", "watercraft"], &["boat"], &["hull"]),
    kind(["gamepad", "gamepads"], &["controller"], &[]),
    kind(["houseplant", "houseplants"], &["pot plant"], &["leaf"]),
    kind(["stuffed animal", "stuffed animals"], &["teddy bear"], &["duck"]),
    kind(["automobile", "automobiles"], &["toy car"], &["truck", "motorcycle"]),
    kind(["motorbike", "motorbikes"], &["motorcycle"], &[]),
    kind(["lorry", "lorries"], &["truck"], &["car"]),
    kind(["spacecraft", "spacecraft"], &["rocket"], &[]),
    kind(["musical instrument", "musical instruments"], &[], &[]),
    kind(["weapon", "weapons"], &[], &["rocket"]),
    kind(["insect", "insects"], &[], &[]),
    kind(["vegetable", "vegetables"], &[], &[]),
    kind(["reptile", "reptiles"], &[], &[]),
    kind(["gemstone", "gemstones"], &[], &[]),
];

const fn kind(names: [&'static str; 2], holds: &'static [&'static str], perhaps: &'static [&'static str]) -> TrueKind {
    TrueKind { names, holds, perhaps }
}

/// Things with a hollow that others can be in.
pub(super) const HOLLOWS: [&str; 8] = ["fruit bowl", "bowl", "mug", "teapot", "kettle", "bag", "cookie jar", "pan"];

/// Parts that are in their whole rather than pieces of it.
pub(super) const CONTENTS: [&str; 5] = ["apple", "orange", "lemon", "pear", "coffee"];

/// Everyday things that are in none of the scenes.
pub(super) const ABSENT: [&str; 60] = [
    "toaster",
    "microwave",
    "refrigerator",
    "dishwasher",
    "vacuum cleaner",
    "washing machine",
    "piano",
    "violin",
    "guitar",
    "trumpet",
    "drum",
    "accordion",
    "bicycle",
    "skateboard",
    "helicopter",
    "submarine",
    "train",
    "tractor",
    "elephant",
    "giraffe",
    "penguin",
    "shark",
    "snake",
    "horse",
    "cow",
    "spider",
    "hammer",
    "screwdriver",
    "saw",
    "drill",
    "wrench",
    "shovel",
    "ladder",
    "broom",
    "bucket",
    "axe",
    "sword",
    "telescope",
    "microscope",
    "typewriter",
    "printer",
    "television",
    "bathtub",
    "toilet",
    "mattress",
    "curtain",
    "sofa",
    "wardrobe",
    "fireplace",
    "tennis racket",
    "football",
    "surfboard",
    "tent",
    "parachute",
    "crown",
    "necklace",
    "sandwich",
    "pizza",
    "pineapple",
    "cucumber",
];

/// Parts that nothing in the scenes has.
pub(super) const ABSENT_PARTS: [&str; 10] =
    ["keyboard", "propeller", "chimney", "beak", "antler", "hoof", "sail", "curtain", "moustache", "tentacle"];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_do_not_contradict_themselves() {
        for kind in &KINDS {
            assert!(!kind.holds.iter().any(|noun| kind.perhaps.contains(noun)), "{}", kind.names[0]);
        }
        let mut nouns = ABSENT.to_vec();
        nouns.sort_unstable();
        nouns.dedup();
        assert_eq!(nouns.len(), 60, "one is listed twice");
        assert!(KINDS.iter().all(|k| k.holds.iter().chain(k.perhaps).all(|noun| !ABSENT.contains(noun))));
    }
}
