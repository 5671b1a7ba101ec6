"""Tiles with what they show, and which phrase matches which, as arrays."""

import json

import numpy as np

import palette
import texts

NOUNS = sorted({w for k in [*texts.things.KINDS, *texts.things.GROUND] for w in texts.kind_words(k)}
               | {w for p in texts.PARTS for w in texts.part_words(p)})
NOUN = {w: i for i, w in enumerate(NOUNS)}
COLOR = {c: i for i, c in enumerate(palette.NAMES)}
SURFACE = {s: i for i, s in enumerate(palette.SURFACES)}


class Identity:
    """A thing (part None) or a part of it."""

    def __init__(self, scene, thing, part, parent):
        self.scene, self.thing, self.part, self.parent = scene, thing, part, parent
        own = part or thing
        words = texts.part_words(part["base"]) if part else texts.kind_words(thing["kind"])
        self.own = facts(words, own["color"], own["surface"])
        self.whole = facts(texts.kind_words(thing["kind"]), thing["color"], thing["surface"])


def facts(words, color, surface):
    has = np.zeros(len(NOUNS), bool)
    has[[NOUN[w] for w in words]] = True
    return has, COLOR[color], SURFACE[surface]


class Tiles:
    """The rows of one or more files of tiles.py, by scene and view; without those of a few pixels."""

    def __init__(self, paths, least_px=0):
        self.tiles, self.identities, self.views = [], {}, {}
        for path in paths:
            f = np.load(path)
            first = sum(len(t) for t in self.tiles)
            self.tiles.append(f["tiles"])
            for n, spec in json.loads(str(f["specs"])).items():
                self.identities[(path, int(n))] = identities((path, int(n)), spec)
            for i, (n, v, k, px) in enumerate(f["rows"]):
                if px < least_px:
                    continue
                self.views.setdefault(((path, int(n)), int(v)), {})[int(k)] = first + i
        self.tiles = np.concatenate(self.tiles)


def identities(scene, spec):
    """In the order of identities.json: all things, then all parts."""
    out = [Identity(scene, thing, None, None) for thing in spec]
    return out + [Identity(scene, thing, p, k) for k, thing in enumerate(spec) for p in thing["parts"]]


def noun_codes(noun):
    if noun is None:
        return -1, -1, -1
    return (-1 if noun.noun is None else NOUN[noun.noun], -1 if noun.color is None else COLOR[noun.color],
            -1 if noun.surface is None else SURFACE[noun.surface])


def matches(phrases, ids):
    """[phrases, identities] of bool: the same rule as texts.Phrase.matches."""
    def fits(codes, side):
        has = np.array([getattr(i, side)[0] for i in ids])
        color, surface = (np.array([getattr(i, side)[k] for i in ids]) for k in (1, 2))
        noun, c, s = (codes[:, k] for k in range(3))
        shiny = (s[:, None] == SURFACE["shiny"]) & (surface[None] == SURFACE["metal"])
        return np.where(noun[:, None] < 0, True, has[:, np.maximum(noun, 0)].T) \
            & ((c[:, None] < 0) | (c[:, None] == color[None])) \
            & ((s[:, None] < 0) | (s[:, None] == surface[None]) | shiny)
    target = np.array([noun_codes(p.target) for p in phrases])
    whole = np.array([noun_codes(p.whole) for p in phrases])
    compound = np.array([p.whole is not None for p in phrases])
    is_part = np.array([i.part is not None for i in ids])
    return fits(target, "own") & (~compound[:, None] | (is_part[None] & fits(whole, "whole")))
