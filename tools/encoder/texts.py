"""Phrases for things and parts, what each of them matches, and the tokeniser (src/models/words.rs)."""

import json
import re

import palette
import things

TOKENS = 16
CANONICAL = ["object", "stuff", "texture", "things"]

KIND_WORDS = {
    "controller": ["controller", "gamepad", "game controller", "joypad"], "mug": ["mug", "cup", "coffee mug"],
    "teapot": ["teapot", "tea pot"], "lamp": ["lamp", "table lamp", "desk lamp"],
    "teddy bear": ["teddy bear", "teddy", "bear"], "cookie jar": ["cookie jar", "jar", "biscuit jar"],
    "pot plant": ["pot plant", "plant", "potted plant", "houseplant"], "camera": ["camera", "photo camera"],
    "headphones": ["headphones", "headset", "earphones"], "toy car": ["toy car", "car"],
    "fruit bowl": ["fruit bowl", "bowl", "bowl of fruit"], "vase": ["vase", "flower vase"],
    "clock": ["clock", "alarm clock"], "cake": ["cake", "birthday cake"], "house": ["house", "toy house"],
    "boat": ["boat", "sailboat", "ship"], "rocket": ["rocket", "spaceship"], "robot": ["robot", "toy robot"],
    "bag": ["bag", "handbag"], "umbrella": ["umbrella", "parasol"], "duck": ["duck", "rubber duck"],
    "pan": ["pan", "frying pan"], "bucket": ["bucket", "pail"], "phone": ["phone", "smartphone", "mobile phone"],
    "die": ["die", "dice"], "table": ["table", "desk"], "floor": ["floor", "ground"],
}
PART_WORDS = {
    "stick": ["stick", "thumbstick", "joystick", "analog stick"], "direction pad": ["direction pad", "d pad", "dpad"],
    "button": ["button"], "buttons": ["buttons", "button"], "menu button": ["menu button", "start button", "button"],
    "shutter button": ["shutter button", "button", "shutter"], "trigger": ["trigger", "shoulder button"],
    "coffee": ["coffee", "drink", "liquid"], "shade": ["shade", "lampshade"], "bulb": ["bulb", "light bulb"],
    "muzzle": ["muzzle", "snout"], "eyes": ["eyes", "eye"], "soles": ["soles", "sole"], "leaves": ["leaves", "leaf"],
    "soil": ["soil", "earth"], "wheels": ["wheels", "wheel", "tyres"], "wheel": ["wheel", "wheels", "tyre"],
    "headlights": ["headlights", "headlight", "lights"], "bumpers": ["bumpers", "bumper"],
    "windows": ["windows", "window"], "legs": ["legs", "leg"], "arms": ["arms", "arm"], "petals": ["petals", "flowers", "flower"],
    "stems": ["stems", "stem"], "flower centres": ["flower centres", "flower centers"], "hands": ["hands", "hand"],
    "feet": ["feet", "foot"], "bells": ["bells", "bell"], "candles": ["candles", "candle"], "flames": ["flames", "flame"],
    "cherries": ["cherries", "cherry"], "icing": ["icing", "frosting"], "wings": ["wings", "wing"], "fins": ["fins", "fin"],
    "drumsticks": ["drumsticks", "drumstick"], "screen": ["screen", "display"], "spots": ["spots", "spot"],
    "band padding": ["band padding", "padding"], "cushion": ["cushion", "pad"], "stalk": ["stalk"], "dial": ["dial", "face"],
    "armrests": ["armrests", "armrest"], "rims": ["rims", "rim"], "canopy": ["canopy"], "back": ["back", "backrest"],
    "lens": ["lens", "objective"], "walls": ["walls", "wall"], "beak": ["beak", "bill"], "antenna": ["antenna"],
    "windshield": ["windows"], "boards": ["boards", "floorboards"], "pages": ["pages", "paper"], "wax": ["wax"],
    "flame": ["flame", "fire"], "sail": ["sail", "sails"], "cover": ["cover", "book cover"],
}
for letter in "abxy":
    PART_WORDS[f"button {letter}"] = [f"button {letter}", "button"]
COLOR_WORDS = {c: [c] for c in palette.NAMES} | {"teal": ["teal", "turquoise"], "purple": ["purple", "violet"],
                                                 "grey": ["grey", "gray"]}
SURFACE_WORDS = {"shiny": ["shiny", "glossy"], "matt": ["matt", "matte"], "metal": ["metal", "metallic"],
                 "wooden": ["wooden", "wood"], "striped": ["striped"], "dotted": ["dotted", "spotted"]}
GLUE = ["the", "a", "an", "of", "on", "s", "something", "from", "that", "is", "part", "toy", "with", "and", "my", "one"]


def kind_words(kind):
    return KIND_WORDS.get(kind, [kind])


def part_words(base):
    return PART_WORDS.get(base, [base])


def split(text):
    """Lower-case runs of letters and digits."""
    return re.findall(r"[^\W_]+", text.lower().replace("\u2019", "'"))


def vocabulary():
    words = set(GLUE) | set(palette.SIDES)
    tables = [CANONICAL, *KIND_WORDS.values(), *PART_WORDS.values(), *COLOR_WORDS.values(), *SURFACE_WORDS.values(),
              list(things.KINDS), PARTS]
    for table in tables:
        for phrase in table:
            words |= set(split(phrase))
    return {w: i + 1 for i, w in enumerate(sorted(words))}


def all_parts():
    import numpy as np
    bases = set()
    for make in [*things.KINDS.values(), *things.GROUND.values()]:
        for seed in range(25):
            bases |= {palette.base_name(p[0]) for p in make(things.Dice(np.random.default_rng(seed)))}
    return sorted(bases)


PARTS = all_parts()
VOCAB = vocabulary()


def lookup(word):
    """A word's number, an English plural's singular counting as well; 0 if unknown."""
    for w in (word, word.removesuffix("s"), word.removesuffix("es"), word + "s"):
        if w in VOCAB:
            return VOCAB[w]
    return 0


def tokens(text):
    ids = [i for i in map(lookup, split(text)) if i][:TOKENS]
    return ids + [0] * (TOKENS - len(ids))


class Noun:
    """[surface] [colour] noun: what one half of a phrase says. Absent fields are None."""

    def __init__(self, noun=None, color=None, surface=None):
        self.noun, self.color, self.surface = noun, color, surface

    def fits(self, words, color, surface):
        return (self.noun is None or self.noun in words) and (self.color is None or self.color == color) \
            and (self.surface is None or self.surface == surface or (self.surface, surface) == ("shiny", "metal"))

    def say(self, rng):
        words = []
        if self.surface:
            words.append(rng.choice(SURFACE_WORDS[self.surface]))
        if self.color:
            words.append(rng.choice(COLOR_WORDS[self.color]))
        return " ".join(words + [self.noun] if self.noun else words)


class Phrase:
    """A noun, or a noun of a whole."""

    def __init__(self, target, whole=None, side=None):
        self.target, self.whole, self.side = target, whole, side

    def matches(self, thing, part):
        """`part` is None for the thing itself."""
        if part is None:
            return self.whole is None and self.target.fits(kind_words(thing["kind"]), thing["color"], thing["surface"])
        if not self.target.fits(part_words(part["base"]), part["color"], part["surface"]):
            return False
        return self.whole is None or self.whole.fits(kind_words(thing["kind"]), thing["color"], thing["surface"])

    def say(self, rng):
        t = self.target.say(rng)
        if self.side:
            t = f"{self.side} {t}"
        if self.target.noun is None:
            t = rng.choice(["something {}", "{}", "{} one", "something that is {}"]).format(t)
        article = lambda: rng.choice(["", "", "the ", "a "])
        if self.whole is None:
            return article() + t
        w = self.whole.say(rng)
        form = rng.random()
        if form < .6:
            return f"{article()}{t} of the {w}"
        if form < .8:
            return f"{rng.choice(['', '', 'the '])}{w}'s {t}"
        if form < .9:
            return f"{article()}{t} on the {w}"
        if self.target.color is None and self.target.surface is None and self.side is None:
            return f"{w} {t}"
        return f"{t} of {rng.choice(['a ', ''])}{w}"


def about_whole(rng, thing, color=None, surface=None):
    words = kind_words(thing["kind"])
    noun = words[0] if rng.random() < .6 else rng.choice(words)
    return Noun(noun, thing["color"] if rng.random() < (.65 if color is None else color) else None,
                thing["surface"] if thing["surface"] in SURFACE_WORDS and rng.random() < (.25 if surface is None else surface)
                else None)


def draw(rng, thing, part):
    """A phrase that matches the thing or its part."""
    if part is None:
        if rng.random() < .04:
            return Phrase(Noun(None, thing["color"]))
        return Phrase(about_whole(rng, thing))
    words = part_words(part["base"])
    noun = words[0] if rng.random() < .65 else rng.choice(words)
    side = next((w for w in part["name"].split() if w in palette.SIDES), None) if part["name"] != part["base"] else None
    target = Noun(noun, part["color"] if rng.random() < .4 else None,
                  part["surface"] if part["surface"] in SURFACE_WORDS and rng.random() < .06 else None)
    whole = about_whole(rng, thing, .7, .12) if rng.random() < .65 else None
    return Phrase(target, whole, side if side and rng.random() < .4 else None)


def trained(thing_kind, color):
    return color is None or not palette.kept_whole(thing_kind, color)


def swapped(rng, thing, part):
    """A phrase like one of the thing's own, with something changed: mostly a wrong one. None where the
    change would be a combination that training must not know."""
    p = draw(rng, thing, part)
    halves = [p.target] + ([p.whole] if p.whole else [])
    half = halves[rng.integers(len(halves))]
    if p.whole and p.target.color and p.whole.color and rng.random() < .4:
        p.target.color, p.whole.color = p.whole.color, p.target.color
    elif rng.random() < .55:
        half.color = palette.NAMES[rng.integers(12)]
    elif half is p.target and part is not None:
        half.noun = part_words(PARTS[rng.integers(len(PARTS))])[0]
    else:
        kinds = list(things.KINDS)
        half.noun = kind_words(kinds[rng.integers(len(kinds))])[0]
    return p if allowed(p, thing, part) else None


def allowed(p, thing, part):
    by_word = {w: k for k in [*things.KINDS, *things.GROUND] for w in kind_words(k)}
    for half in [p.target, p.whole]:
        if half is not None and half.color and half.noun in by_word and palette.kept_whole(by_word[half.noun], half.color):
            return False
    if part is not None and p.target.color:
        for base in PARTS:
            if p.target.noun in part_words(base) and palette.kept_part(thing["kind"], base, p.target.color):
                return False
    return True


def save_vocabulary(path, **more):
    with open(path, "w") as f:
        json.dump({**more, "words": VOCAB}, f, indent=0, sort_keys=False)
