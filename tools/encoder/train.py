"""Trains both halves.

    python train.py OUT.pt --tiles TRAIN.npz ... --held HELD.npz --minutes 20 [--start OUT.pt]

Each step takes some views; phrases of what they show, phrases with something changed, and phrases of
other scenes are held against the features of things, of parts, and of parts deviated towards their
things. What matches is worked out from the words, so "mug" matches every mug in the batch.

An encoder that was trained on deviated features gains by deviation because it was made for it. The
control (--without-deviation) sees features of things and parts as they are, as CLIP does; phrases such
as "handle of the red mug" then stand against the handle's own feature.
"""

import argparse
import math
import time

import numpy as np
import torch
import torch.nn.functional as F

import data
import evaluate
import model
import texts


def augment(x, rng):
    """Other exposure, tint, sharpness, size and place; x is [n, 3, s, s]."""
    n, s = len(x), x.shape[-1]
    r = lambda low, high, shape: torch.from_numpy(rng.uniform(low, high, shape).astype(np.float32))
    inside = (x.amax(1, keepdim=True) > .004).float()
    x = x * r(.72, 1.3, (n, 1, 1, 1)) * r(.94, 1.06, (n, 3, 1, 1))
    gamma = torch.nonzero(r(0, 1, n) < .3)[:, 0]
    x[gamma] = x[gamma].clamp(1e-4, 1) ** r(.8, 1.22, (len(gamma), 1, 1, 1)) * inside[gamma]
    flip = r(0, 1, n) < .5
    x[flip] = x[flip].flip(3)
    soft = torch.nonzero(r(0, 1, n) < .2)[:, 0]
    for side in (s // 4, s // 2):
        some = soft[:: 2] if side == s // 4 else soft[1:: 2]
        if len(some):
            x[some] = F.interpolate(F.interpolate(x[some], size=side, mode="area"), size=s, mode="bilinear")
    moved = torch.nonzero(r(0, 1, n) < .22)[:, 0]
    if len(moved):
        k = len(moved)
        zoom, shear = r(1, 1.18, k), r(-.06, .06, k)
        theta = torch.stack([torch.stack([zoom, shear, r(-.09, .09, k)], 1), torch.stack([-shear, zoom, r(-.09, .09, k)], 1)], 1)
        x[moved] = F.grid_sample(x[moved], F.affine_grid(theta, [k, 3, s, s], align_corners=False), align_corners=False)
    return (x + .012 * torch.randn_like(x) * (x > .004)).clamp(0, 1)


class Batches:
    def __init__(self, tiles, seed):
        self.t, self.rng = tiles, np.random.default_rng(seed)
        self.keys = list(tiles.views)
        self.everyone = [i for ids in tiles.identities.values() for i in ids]

    def draw(self, views):
        rng, rows, ids, parent = self.rng, [], [], []
        for k in rng.permutation(len(self.keys))[:views]:
            (scene, view), seen = self.keys[k], self.t.views[self.keys[k]]
            at = {}
            for i, row in seen.items():
                who = self.t.identities[scene][i]
                if who.part is None:
                    at[i] = len(rows)
                elif who.parent not in at or rng.random() < .1:
                    continue
                rows.append(row)
                ids.append(who)
                parent.append(-1 if who.part is None else at[who.parent])
        phrases = []
        for who in ids:
            phrases.append(texts.draw(rng, who.thing, who.part))
            if rng.random() < (.3 if who.part is None else -1):
                phrases.append(texts.draw(rng, who.thing, who.part))
            if rng.random() < .2:
                phrases.append(texts.swapped(rng, who.thing, who.part))
        for _ in range(24):
            who = self.everyone[rng.integers(len(self.everyone))]
            phrases.append(texts.draw(rng, who.thing, who.part))
        phrases = [p for p in phrases if p]
        tokens = np.array([texts.tokens(p.say(rng)) for p in phrases])
        return self.t.tiles[rows], ids, np.array(parent), phrases, tokens


def rank_loss(scores, hit, skip, scale):
    """Softmax of each positive against the negatives of its row."""
    e = torch.where(hit | skip, torch.tensor(-1e4), scores * scale)
    negative = torch.logsumexp(e, 1, keepdim=True)
    loss = F.softplus(negative - scores * scale)
    weight = hit.float() / hit.float().sum(1, keepdim=True).clamp(min=1)
    rows = (hit.any(1)).float()
    return (loss * weight).sum() / rows.sum().clamp(min=1)


def step_loss(image, text, scale, batch, rng, deviation=True):
    tiles, ids, parent, phrases, tokens = batch
    x = torch.from_numpy(tiles).permute(0, 3, 1, 2).float() / 255
    f = image.small(augment(F.avg_pool2d(x, 2), rng))
    longest = max(2, int((tokens > 0).sum(1).max()))
    canonical = np.array([texts.tokens(c) for c in texts.CANONICAL])
    t = text(torch.from_numpy(np.concatenate([tokens, canonical])[:, :longest]))
    q, c = t[:-len(canonical)], t[-len(canonical):]
    parts = np.flatnonzero((parent >= 0) & deviation)
    every = torch.cat([f, model.deviated(f[parent[parts]], f[parts])]) if deviation else f
    m = data.matches(phrases, ids)
    hit = torch.from_numpy(np.concatenate([m, m[:, parts]], 1))
    compound = np.array([p.whole is not None for p in phrases])
    # Raw parts are no matter of such phrases where there are deviated ones.
    raw_part = np.concatenate([(parent >= 0) & deviation, np.zeros(len(parts), bool)])
    skip = torch.from_numpy(compound[:, None] & raw_part[None])
    hit &= ~skip
    s = q @ every.T
    # A column compares its phrases; phrases that match all the same are no rivals.
    ranking = rank_loss(s, hit, skip, scale) + .5 * rank_loss(s.T, hit.T, skip.T, scale)
    d = s - (c @ every.T).amax(0, keepdim=True)
    tau, margin = 20.0, .04
    positive = F.softplus(tau * (margin - d))[hit].mean()
    rivals = torch.where(hit | skip, torch.tensor(-1e4), tau * (d + margin))
    # As if a scene were a twentieth of the batch.
    negative = F.softplus(torch.logsumexp(rivals, 1) - math.log(20)).mean()
    return ranking, positive, negative


def main():
    ap = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    ap.add_argument("out")
    ap.add_argument("--tiles", nargs="+", required=True)
    ap.add_argument("--held", nargs="+", required=True)
    ap.add_argument("--minutes", type=float, default=20)
    ap.add_argument("--steps", type=int, help="instead of minutes, so that two trainings can be compared")
    ap.add_argument("--without-deviation", action="store_true", help="train the control")
    ap.add_argument("--views", type=int, default=7)
    ap.add_argument("--rate", type=float, default=2e-3)
    ap.add_argument("--least-px", type=int, default=40)
    ap.add_argument("--weight", type=float, default=.35, help="of being above or below the canonical phrases")
    ap.add_argument("--start")
    ap.add_argument("--look-every", type=float, default=200, help="seconds between looks at a few held-out scenes")
    ap.add_argument("--threads", type=int, default=2)
    ap.add_argument("--seed", type=int, default=0)
    a = ap.parse_args()
    torch.set_num_threads(a.threads)
    torch.manual_seed(a.seed)
    image, text, scale = model.ImageEncoder(), model.TextEncoder(), torch.nn.Parameter(torch.tensor(math.log(15.0)))
    if a.start:
        old = torch.load(a.start)
        image.load_state_dict(old["image"]), text.load_state_dict(old["text"])
    image = image.to(memory_format=torch.channels_last)
    batches, held = Batches(data.Tiles(a.tiles, a.least_px), a.seed), data.Tiles(a.held)
    print(len(batches.t.tiles), "tiles,", len(held.tiles), "held out", flush=True)
    groups = [{"params": [*image.parameters(), *text.parameters()], "weight_decay": .02}, {"params": [scale], "weight_decay": 0}]
    optimiser = torch.optim.AdamW(groups, lr=a.rate)
    began, step, last = time.time(), 0, time.time()
    while (share := step / a.steps if a.steps else (time.time() - began) / (60 * a.minutes)) < 1:
        rate = a.rate * min(1, (step + 1) / 60) * max(.01, .5 + .5 * math.cos(math.pi * share))
        for g in optimiser.param_groups:
            g["lr"] = rate
        image.train(), text.train()
        losses = step_loss(image, text, scale.exp().clamp(max=40), batches.draw(a.views), batches.rng,
                           not a.without_deviation)
        loss = losses[0] + a.weight * (1.5 * losses[1] + losses[2])
        optimiser.zero_grad()
        loss.backward()
        torch.nn.utils.clip_grad_norm_([*image.parameters(), *text.parameters()], 1.0)
        optimiser.step()
        step += 1
        if step % 25 == 0:
            print(f"{step} {time.time() - began:.0f}s rank {losses[0]:.3f} found {losses[1]:.3f} absent {losses[2]:.3f} scale {scale.exp():.1f}",
                  flush=True)
        if time.time() - last > a.look_every:
            last = time.time()
            torch.save({"image": image.state_dict(), "text": text.state_dict()}, a.out)
            print(evaluate.summary(evaluate.measure(image, text, held, most=8)), flush=True)
    torch.save({"image": image.state_dict(), "text": text.state_dict()}, a.out)
    print(evaluate.summary(evaluate.measure(image, text, held)), flush=True)


if __name__ == "__main__":
    main()
