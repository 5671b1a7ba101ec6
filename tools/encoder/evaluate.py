"""How well phrases find things and parts in scenes that training never saw.

    python evaluate.py MODEL.pt HELD.npz [--json OUT]

One tile an identity: that of the view which shows most of it. Right means that the first answer is one
that the words fit. "found": the right answer's d = cos(query) - max cos(canonical) is above 0. "silent":
for something absent, no identity of the level asked for has d above 0.
"""

import argparse
import json

import numpy as np
import torch

import data
import model
import palette
import texts
from texts import Noun, Phrase


def encode(text, phrases):
    numbers = np.array([texts.tokens(p) for p in phrases])
    return text(torch.from_numpy(numbers[:, :max(2, int((numbers > 0).sum(1).max()))]))


def plain(p):
    """The phrase in its usual wording."""
    say = lambda n: " ".join(w for w in (n.surface, n.color, n.noun) if w)
    return say(p.target) if p.whole is None else f"{say(p.target)} of the {say(p.whole)}"


@torch.no_grad()
def measure(image, text, held, most=None):
    image.eval(), text.eval()
    out, canonical = {}, encode(text, texts.CANONICAL)
    for n, scene in enumerate(list(held.identities)[:most]):
        seen, parent, f = features(image, held, scene)
        parts = sorted(parent)
        dev = f.clone()
        if parts:
            dev[parts] = model.deviated(f[[parent[k] for k in parts]], f[parts])
        # Once to collect the phrases, once with their vectors.
        phrases = {}
        questions(np.random.default_rng(n), seen, parent, f, dev, canonical, lambda p: phrases.setdefault(p, f[0]), lambda *_: None)
        vectors = dict(zip(phrases, encode(text, list(phrases))))
        questions(np.random.default_rng(n), seen, parent, f, dev, canonical, vectors.__getitem__,
                  lambda name, value: out.setdefault(name, []).append(float(value)))
    return {k: [round(float(np.mean(v)), 4), len(v)] for k, v in out.items()}


def features(image, held, scene):
    """Identities of the scene that are seen, the place of each part's thing, and their vectors."""
    ids, best = held.identities[scene], {}
    for (s, _), seen in held.views.items():
        for i, row in seen.items() if s == scene else ():
            spread = int((held.tiles[row].max(-1) > 0).sum())
            if i not in best or spread > best[i][0]:
                best[i] = (spread, row)
    who = sorted(i for i in best if ids[i].part is None or ids[i].parent in best)
    x = torch.from_numpy(held.tiles[[best[i][1] for i in who]]).permute(0, 3, 1, 2).float() / 255
    f = image(x)
    place = {i: n for n, i in enumerate(who)}
    return [ids[i] for i in who], {place[i]: place[ids[i].parent] for i in who if ids[i].part is not None}, f


def questions(rng, seen, parent, f, dev, canonical, vector, note):
    """Asks everything about one scene."""
    things = [k for k in range(len(seen)) if k not in parent]
    parts, everyone = sorted(parent), list(range(len(seen)))
    block, block_dev = (canonical @ f.T).amax(0), (canonical @ dev.T).amax(0)
    def ask(p, features):
        return vector(plain(p)) @ features.T, data.matches([p], seen)[0]
    def first(score, among):
        return among[int(torch.argmax(score[among]))]
    for n in things:
        t = seen[n].thing
        s, hit = ask(Phrase(Noun(t["kind"], t["color"])), f)
        note("object: colour kind", hit[first(s, things)])
        note("object: colour kind, parts compete", hit[first(torch.maximum(s, vector(plain(Phrase(Noun(t["kind"], t["color"])))) @ dev.T), everyone)])
        note("found: object", (s - block)[n] > 0)
        if sum(seen[k].thing["kind"] == t["kind"] for k in things) == 1:
            s, hit = ask(Phrase(Noun(t["kind"])), f)
            note("object: kind", hit[first(s, things)])
    for n in parts:
        t, part = seen[n].thing, seen[n].part
        noun, whole = texts.part_words(part["base"])[0], Noun(t["kind"], t["color"])
        p = Phrase(Noun(noun), whole)
        for name, features, limit in (("raw", f, block), ("deviated", dev, block_dev)):
            s, hit = ask(p, features)
            note(f"part: part of the colour kind, {name}", hit[first(s, parts)])
            if name == "deviated":
                note("found: part of the colour kind", (s - limit)[n] > 0)
        chosen = first(ask(Phrase(whole), f)[0], things)
        mine, own = ([k for k in parts if parent[k] == o] for o in (chosen, parent[n]))
        for name, features in (("raw", f), ("deviated", dev)):
            s, fits = ask(Phrase(Noun(noun)), features)
            note(f"part: two steps, {name}", bool(mine) and hit[first(s, mine)])
            note(f"part: noun among its own thing's parts, {name}", fits[first(s, own)])
            s, fits = ask(Phrase(Noun(noun, part["color"])), features)
            note(f"part: colour part, {name}", fits[first(s, parts)])
    words = {w for x in seen for w in (texts.part_words(x.part["base"]) if x.part else texts.kind_words(x.thing["kind"]))}
    absent = [k for k in texts.things.KINDS if not set(texts.kind_words(k)) & words]
    silent = lambda name, p, features, limit, among: note(f"silent: {name}", (ask(p, features)[0] - limit)[among].max() <= 0)
    for k in map(str, rng.permutation(absent)[:8]):
        silent("absent kind", Phrase(Noun(k)), f, block, things)
        silent("absent colour and kind", Phrase(Noun(k, palette.NAMES[rng.integers(12)])), f, block, things)
        silent("part of an absent kind", Phrase(Noun("handle"), Noun(k)), dev, block_dev, parts)
    for n in things:
        t = seen[n].thing
        colors = [c for c in palette.NAMES if not any(seen[k].thing["kind"] == t["kind"] and seen[k].thing["color"] == c for k in things)]
        silent("wrong colour", Phrase(Noun(t["kind"], colors[rng.integers(len(colors))])), f, block, things)
        p = Phrase(Noun(texts.part_words(texts.PARTS[rng.integers(len(texts.PARTS))])[0]), Noun(t["kind"], t["color"]))
        if not ask(p, dev)[1].any():
            silent("part that the thing lacks", p, dev, block_dev, parts)


def summary(result):
    return "\n".join(f"    {v[0]:.3f}  {k} ({v[1]})" for k, v in result.items())


def load(path):
    state = torch.load(path)
    image, text = model.ImageEncoder(), model.TextEncoder()
    image.load_state_dict(state["image"]), text.load_state_dict(state["text"])
    return image.eval(), text.eval()


def main():
    ap = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    ap.add_argument("model")
    ap.add_argument("held", nargs="+")
    ap.add_argument("--json")
    a = ap.parse_args()
    result = measure(*load(a.model), data.Tiles(a.held))
    print(summary(result))
    if a.json:
        with open(a.json, "w") as f:
            json.dump(result, f, indent=1)


if __name__ == "__main__":
    main()
