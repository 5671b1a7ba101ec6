"""Colours, surfaces, and which combinations are kept for the held-out scenes only."""

import colorsys
import struct
import zlib

import numpy as np

COLORS = {
    "red": (205, 35, 40), "orange": (238, 125, 30), "yellow": (245, 205, 50), "green": (45, 150, 65),
    "teal": (30, 150, 145), "blue": (35, 85, 205), "purple": (130, 75, 190), "pink": (240, 120, 160),
    "brown": (115, 70, 40), "black": (36, 36, 40), "white": (238, 236, 230), "grey": (140, 142, 148),
}
NAMES = list(COLORS)
# Words for the surface of a thing's main parts, and how often each occurs.
SURFACES = {"plain": .34, "shiny": .14, "matt": .1, "metal": .1, "wooden": .1, "striped": .11, "dotted": .11}
SIDES = ("left", "right", "front", "back", "upper", "lower")


def base_name(part):
    """The part's name without its side."""
    words = part.split()
    return " ".join(w for w in words[:-1] if w not in SIDES) + (" " if len(words) > 1 else "") + words[-1] \
        if any(w in SIDES for w in words[:-1]) else part


def bucket(*words, of):
    return zlib.crc32("|".join(words).encode()) % of


def kept_whole(kind, color):
    """Whether no training scene has a thing of this kind and colour: two colours of each kind."""
    ranked = sorted(NAMES, key=lambda c: zlib.crc32(f"whole|{kind}|{c}".encode()))
    return color in ranked[:2]


def kept_part(kind, part, color):
    """Whether no training scene has this colour on this part of this kind (own colours only)."""
    return bucket("part", kind, part, color, of=7) == 0


def shade(rng, name, spread=1.0):
    """The colour by that name, a little different every time."""
    h, s, v = colorsys.rgb_to_hsv(*(c / 255 for c in COLORS[name]))
    h += rng.normal(0, .011) * spread
    if name in ("black", "white", "grey"):
        s = s * rng.uniform(.3, 1.5)
        v += rng.normal(0, .025) * spread + (.02 if name == "black" else 0)
    else:
        s *= rng.uniform(.8, 1.1)
        v *= rng.uniform(.82, 1.12)
    return tuple(int(round(255 * c)) for c in colorsys.hsv_to_rgb(h % 1, min(max(s, 0), 1), min(max(v, .04), 1)))


def pick(rng, allowed):
    names = [c for c in NAMES if allowed(c)]
    return names[rng.integers(len(names))] if names else None


def own_color(rng, kind, part, held_out):
    """A colour for a part that training may show; in held-out scenes mostly one that it never showed."""
    if held_out and rng.random() < .7:
        got = pick(rng, lambda c: kept_part(kind, part, c))
        if got:
            return got
    return pick(rng, lambda c: not kept_part(kind, part, c))


def part_color(rng, role, kind, part, main, shared, held_out):
    """The colour of a part by its role (things.py); `shared` holds what pairs have in common."""
    role = role.replace(" glow", "")
    free = lambda: own_color(rng, kind, part, held_out)
    head, _, rest = role.partition(":")
    if head == "main":
        return main
    if head == "like":
        return main if rng.random() < .85 else free()
    if head == "own":
        return rest if rest and rng.random() < .35 and not kept_part(kind, part, rest) else free()
    if head == "own like":
        return main if rng.random() < .4 else free()
    if head == "natural":
        return rest if rng.random() < .85 else free()
    if head == "letter":
        return rest
    if head == "either":
        choices = rest.split(",")
        return choices[rng.integers(len(choices))]
    if head not in shared:
        usual = {"main": main, "like": main}.get(rest, rest)
        keeps = rng.random() < .6 and (usual == main or not kept_part(kind, part, usual))
        shared[head] = usual if keeps else free()
        shared[head + " differ"] = rng.random() < .12
    return free() if shared[head + " differ"] else shared[head]


def noise(rng, side, cells):
    g = rng.random((cells, cells))
    i = np.arange(side) * cells / side
    f, t = i.astype(int), i % 1
    t = t * t * (3 - 2 * t)
    r = g[f] * (1 - t)[:, None] + g[(f + 1) % cells] * t[:, None]
    return r[:, f] * (1 - t) + r[:, (f + 1) % cells] * t


def texture(rng, surface, color, second, side=48):
    """A picture for the surface, or None for one flat colour."""
    base, other = np.array(color, float), np.array(second, float)
    v, u = np.mgrid[0:side, 0:side] / side
    if surface == "striped":
        n = int(rng.integers(3, 7))
        across = (u if rng.random() < .35 else v) + (u if rng.random() < .2 else 0)
        m = ((across * n) % 1 < rng.uniform(.25, .42))[..., None]
    elif surface == "dotted":
        n = int(rng.integers(3, 6))
        x, y = u * n, v * n
        x = x + .5 * (np.floor(y) % 2) if n % 2 == 0 else x
        m = (np.hypot(x % 1 - .5, y % 1 - .5) < rng.uniform(.22, .33))[..., None]
    elif surface == "wooden":
        warp = noise(rng, side, 4) * .5 + noise(rng, side, 12) * .12
        m = (.5 + .5 * np.sin(6.28 * (v * rng.integers(3, 7) + warp * 3)))[..., None]
        other = base * .62
    elif surface == "speckled":
        m = (noise(rng, side, 24) > .72)[..., None]
    else:
        return None
    return np.clip(base + (other - base) * m, 0, 255).astype(np.uint8)


def png(picture):
    """The bytes of an RGB PNG."""
    h, w = picture.shape[:2]
    raw = b"".join(b"\0" + picture[y].tobytes() for y in range(h))
    chunk = lambda kind, data: struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", w, h, 8, 2, 0, 0, 0)) \
        + chunk(b"IDAT", zlib.compress(raw, 9)) + chunk(b"IEND", b"")
