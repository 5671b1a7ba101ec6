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
    longest = torch.from_numpy(np.array([texts.tokens(p) for p in phrases]))
    return text(longest)


def plain(p):
    """The phrase in its usual wording."""
    say = lambda n: " ".join(w for w in (n.surface, n.color, n.noun) if w)
    return say(p.target) if p.whole is None else f"{say(p.target)} of the {say(p.whole)}"


@torch.no_grad()
def measure(image, text, held, size=64, most=None):
    image.eval(), text.eval()
    rng, out = np.random.default_rng(0), {}
    def note(name, value):
        out.setdefault(name, []).append(float(value))
    canonical = encode(text, texts.CANONICAL)
    for scene in list(held.identities)[:most]:
        ids, best = held.identities[scene], {}
        for (s, _), seen in held.views.items():
            for i, row in seen.items() if s == scene else ():
                spread = int((held.tiles[row].max(-1) > 0).sum())
                if i not in best or spread > best[i][0]:
                    best[i] = (spread, row)
        best = {i: r for i, (_, r) in best.items() if ids[i].part is None or ids[i].parent in best}
        who = sorted(best)
        x = torch.from_numpy(held.tiles[[best[i] for i in who]]).permute(0, 3, 1, 2).float() / 255
        f = image(x if size == 64 else torch.nn.functional.interpolate(x, size=size, mode="area"))
        place = {i: n for n, i in enumerate(who)}
        things = [n for n, i in enumerate(who) if ids[i].part is None]
        parts = [n for n, i in enumerate(who) if ids[i].part is not None]
        parent = {n: place[ids[who[n]].parent] for n in parts}
        dev = f.clone()
        dev[parts] = model.deviated(f[[parent[n] for n in parts]], f[parts])
        block = torch.maximum((canonical @ f.T).amax(0), torch.full((len(who),), -2.0))
        block_dev = (canonical @ dev.T).amax(0)
        seen = [ids[i] for i in who]
        def ask(p, features):
            q = encode(text, [plain(p)])[0]
            hit = data.matches([p], seen)[0]
            return q @ features.T, hit
        def first(score, among):
            return among[int(torch.argmax(score[among]))]
        for n in things:
            t = seen[n].thing
            p = Phrase(Noun(t["kind"], t["color"]))
            s, hit = ask(p, f)
            top = first(s, things)
            note("object: colour kind", hit[top])
            note("object: colour kind, among all", hit[first(torch.where(torch.arange(len(who)) >= 0, s, s), list(range(len(who))))])
            note("found: object", (s - block)[n] > 0)
            if sum(seen[k].thing["kind"] == t["kind"] for k in things) == 1:
                s, hit = ask(Phrase(Noun(t["kind"])), f)
                note("object: kind", hit[first(s, things)])
        for n in parts:
            t, part = seen[n].thing, seen[n].part
            noun = texts.part_words(part["base"])[0]
            whole = Noun(t["kind"], t["color"])
            p = Phrase(Noun(noun), whole)
            s, hit = ask(p, dev)
            note("part: part of the colour kind, deviated", hit[first(s, parts)])
            note("found: part of the colour kind", (s - block_dev)[n] > 0)
            note("part: the same, raw features", hit[first(s * 0 + encode(text, [plain(p)])[0] @ f.T, parts)])
            so, _ = ask(Phrase(whole), f)
            chosen = first(so, things)
            mine = [k for k in parts if parent[k] == chosen]
            for name, features in (("raw", f), ("deviated", dev)):
                sp, _ = ask(Phrase(Noun(noun)), features)
                note(f"part: two steps, {name}", bool(mine) and hit[first(sp, mine)])
                own = [k for k in parts if parent[k] == parent[n]]
                note(f"part: noun among its own thing's parts, {name}", hit[first(sp, own)])
            p = Phrase(Noun(noun, part["color"]))
            for name, features in (("raw", f), ("deviated", dev)):
                s, hit = ask(p, features)
                note(f"part: colour part, {name}", hit[first(s, parts)])
        kinds = {seen[n].thing["kind"] for n in things}
        absent = [k for k in texts.things.KINDS if k not in kinds and not set(texts.kind_words(k)) & {w for x in seen for w in
                  (texts.part_words(x.part["base"]) if x.part else texts.kind_words(x.thing["kind"]))}]
        for k in rng.permutation(absent)[:8]:
            s, _ = ask(Phrase(Noun(str(k))), f)
            note("silent: absent kind", (s - block)[things].max() <= 0)
            s, _ = ask(Phrase(Noun(str(k), palette.NAMES[rng.integers(12)])), f)
            note("silent: absent colour and kind", (s - block)[things].max() <= 0)
            s, _ = ask(Phrase(Noun("handle"), Noun(str(k))), dev)
            note("silent: part of an absent kind", (s - block_dev)[parts].max() <= 0)
        for n in things:
            colors = [c for c in palette.NAMES if not any(seen[k].thing["kind"] == seen[n].thing["kind"] and seen[k].thing["color"] == c
                                                          for k in things)]
            s, hit = ask(Phrase(Noun(seen[n].thing["kind"], colors[rng.integers(len(colors))])), f)
            note("silent: wrong colour", (s - block)[things].max() <= 0)
            foreign = [p for p in texts.PARTS if p not in {b for k in parts if parent[k] == n for b in
                       [seen[k].part["base"], *texts.part_words(seen[k].part["base"])]}]
            t = seen[n].thing
            p = Phrase(Noun(texts.part_words(foreign[rng.integers(len(foreign))])[0]), Noun(t["kind"], t["color"]))
            s, hit = ask(p, dev)
            if not hit.any() and parts:
                note("silent: part that the thing lacks", (s - block_dev)[parts].max() <= 0)
    return {k: [round(float(np.mean(v)), 4), len(v)] for k, v in out.items()}


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
