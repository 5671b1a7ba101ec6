"""Other shapes of things that the encoder knows by name: no function of things.py is used, so that what is
measured on assets/eval/unseen.glb is not the recognition of a shape family that training drew from.

    python unseen.py ../../assets/eval

Written and rendered after the encoders were trained, scored once (docs/notes/queries.md), and never to be trained on.
"""

import argparse
from pathlib import Path

import numpy as np

import palette
import scenes
import shapes
from eval_scenes import LARGEST, single
from shapes import ball, bent, box, cone, cylinder, lathe, torus, total, tube, turned


def mug(d):
    """Square, with a corner for a handle."""
    w, h = .07 * d(), .085 * d()
    wall = total([box(w, h, .006).at(0, h / 2, s * w / 2) + box(.006, h, w).at(s * w / 2, h / 2, 0) for s in (-1, 1)])
    grip = box(.035, .01, .012).at(w / 2 + .017, h * .75, 0) + box(.01, h * .6, .012).at(w / 2 + .032, h * .48, 0)
    return [("body", wall + box(w, .006, w).at(0, .003, 0), "main"), ("handle", grip, "own"),
            ("coffee", box(w * .9, .004, w * .9).at(0, h * .8, 0), "natural:brown")]


def lamp(d):
    """A reading lamp on a bent arm."""
    h = .2 * d()
    head = lambda m: m.turned("z", 55).at(.095, h * 1.05, 0)
    arm = bent([[0, .015, 0], [-.05, h * .6, 0], [0, h * 1.1, 0], [.07, h * 1.12, 0]], .006)
    return [("base", box(.11, .018, .09, .4).at(0, .009, 0), "own"), ("stem", arm, "own:grey"),
            ("shade", head(cone(.055, .075, .018).turned("x", 180).at(0, .03, 0)), "main"),
            ("bulb", head(ball(.02).at(0, -.045, 0)), "natural:white glow"),
            ("switch", box(.014, .01, .014).at(.03, .022, .02), "own:red")]


def chair(d):
    """A stool that turns, with a curved back."""
    r, h = .05 * d(), .1 * d()
    spokes = total([box(.075, .01, .014).at(.03, .008, 0).turned("y", 72 * k) for k in range(5)])
    a = np.linspace(-.9, .9, 9)
    back = tube(np.stack([r * 1.05 * np.sin(a), 0 * a + h + .07, -r * 1.05 * np.cos(a)], 1), .016)
    return [("seat", cylinder(r, .016, 22).at(0, h, 0), "main"),
            ("legs", spokes + cylinder(.007, h, 10), "own:grey"),
            ("back", back + cylinder(.005, .07, 8).at(0, h, -r * .95), "own like"),
            ("cushion", ball(r * .9, .012, r * .9).at(0, h + .02, 0), "own")]


def clock(d):
    """As tall as a cupboard."""
    w, h = .05 * d(), .19 * d()
    fwd = lambda m: m.turned("x", 90)
    return [("case", box(w, h, w * .8).at(0, h / 2, 0) + cone(w * .72, .03, .012, 4).turned("y", 45).at(0, h, 0), "main"),
            ("dial", fwd(cylinder(w * .4, .006, 22)).at(0, h * .82, w * .4), "natural:white"),
            ("hands", fwd(box(.004, .004, w * .55)).at(0, h * .86, w * .4 + .008)
             + box(w * .3, .004, .004).at(.006, h * .82, w * .4 + .008), "own:black"),
            ("feet", total([box(.014, .014, .014).at(x * w * .4, .007, z * w * .35) for x in (-1, 1) for z in (-1, 1)]), "own")]


def boat(d):
    """A barge with a house and a funnel, no sail."""
    l, w = .16 * d(), .055 * d()
    hull = box(l * .8, .03, w, .3).at(-.01, .015, 0) + box(l * .16, .022, w * .6, .6).at(l * .43, .02, 0)
    return [("hull", hull, "main"), ("cabin", box(l * .3, .035, w * .75).at(-l * .2, .047, 0), "own"),
            ("mast", cylinder(.0035, .085, 8).at(l * .18, .03, 0), "own:brown"),
            ("flag", box(.03, .02, .003).at(l * .18 + .016, .1, 0), "own")]


def house(d):
    """A round tower."""
    r, h = .042 * d(), .12 * d()
    window = lambda a, y: box(.016, .02, .008).at(0, y, r).turned("y", a)
    return [("walls", lathe([[r * 1.08, 0], [r, h * .4], [r * .95, h]], 22), "main"),
            ("roof", cone(r * 1.3, h * .5).at(0, h, 0), "own:red"),
            ("door", box(.024, .045, .01).at(0, .0225, r * 1.04), "own"),
            ("windows", total([window(a, h * .7) for a in (-50, 0, 50)]), "own:blue"),
            ("chimney", box(.012, .05, .012).at(r * .55, h * 1.3, 0), "own")]


def bottle(d):
    """A flat flask."""
    w, h, z = .075 * d(), .1 * d(), .03 * d()
    return [("body", ball(w / 2, h / 2, z / 2).at(0, h / 2, 0) + box(w * .5, .012, z * .9).at(0, .006, 0), "main"),
            ("neck", box(.016, .03, .016).at(0, h + .008, 0), "like"), ("cap", box(.022, .014, .022).at(0, h + .028, 0), "own"),
            ("label", box(w * .5, h * .35, .004).at(0, h * .5, z / 2 + .001), "own")]


def teapot(d):
    """Straight, with its handle over the top."""
    r, h = .055 * d(), .075 * d()
    arc = [[-r, h, 0], [-r * .9, h * 1.6, 0], [0, h * 1.9, 0], [r * .9, h * 1.6, 0], [r, h, 0]]
    spout = tube(np.array([[r * .9, h * .35, 0], [r * 1.35, h * .7, 0], [r * 1.7, h * 1.05, 0]]), [.012, .01, .007])
    return [("body", cylinder(r, h, 6), "main"), ("lid", cone(r * .9, .02, r * .3, 6).at(0, h, 0), "own like"),
            ("knob", box(.016, .016, .016).at(0, h + .028, 0), "own"), ("spout", spout, "like"),
            ("handle", bent(arc, .006), "own")]


def toy_car(d):
    """A lorry: six wheels, the cab in front of an open box."""
    l, w, r = .17 * d(), .06 * d(), .016
    wheel = lambda x, s: torus(r * .7, r * .45, 12, 6).turned("x", 90).at(x, r, s * w / 2)
    wheels = total([wheel(x * l, s) for x in (-.36, -.18, .3) for s in (-1, 1)])
    bed = box(l * .6, .008, w).at(-l * .18, .032, 0) + total(
        [box(l * .6, .03, .005).at(-l * .18, .05, s * w / 2) for s in (-1, 1)])
    return [("body", bed + box(l * .25, .06, w, .3).at(l * .3, .056, 0), "main"),
            ("windows", box(.006, .024, w * .8).at(l * .427, .07, 0), "natural:blue"),
            ("roof", box(l * .22, .008, w * .9).at(l * .3, .09, 0), "own like"), ("wheels", wheels, "own:black"),
            ("headlights", box(.006, .01, .012).at(l * .43, .038, w * .3) + box(.006, .01, .012).at(l * .43, .038, -w * .3),
             "natural:white")]


def robot(d):
    """Round, with one eye in a dome."""
    r = .045 * d()
    arm = bent([[r * .9, r * 1.6, 0], [r * 1.5, r * 1.5, .01], [r * 1.55, r * .9, .03]], .008)
    return [("body", ball(r).at(0, r * 1.35, 0), "main"), ("head", turned([[r * .7, r * 2.2], [r * .55, r * 2.7], [0, r * 2.9]], 2), "own like"),
            ("eyes", ball(.013).at(0, r * 2.45, r * .5), "own"), ("arms", arm.pair(), "own"),
            ("legs", cylinder(.012, r * .8, 8).at(r * .45, 0, 0).pair(), "own"),
            ("antenna", bent([[0, r * 2.85, 0], [.01, r * 3.2, 0], [-.005, r * 3.5, 0]], .0028), "own"),
            ("button", box(.018, .018, .01).at(0, r * 1.4, r), "own")]


KINDS = {f.__name__.replace("_", " "): f for f in [mug, lamp, chair, clock, boat, house, bottle, teapot, toy_car, robot]}


def table(d):
    """Round, on one foot."""
    return [("top", cylinder(.62, .03, 32).at(0, .71, 0), "main"), ("legs", cylinder(.05, .7, 12) + cone(.3, .05, .06, 20), "own")]


def main():
    ap = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    ap.add_argument("out", type=Path)
    ap.add_argument("--seed", type=int, default=2026)
    a = ap.parse_args()
    path = a.out / "unseen.glb"
    for detail in (.9, .75, .6, .5):
        shapes.DETAIL = detail
        rng = np.random.default_rng(a.seed)
        made = [scenes.dress(rng, kind, make, True) for kind, make in KINDS.items()]
        made = [dict(thing, parts=single(thing["parts"])) for thing in made]
        ground = scenes.dress(rng, "table", table, True, surface="wooden")
        scenes.write(path, rng, [(ground, (0, 0, 0), 0)] + scenes.layout(rng, made), picture_px=24)
        path.with_suffix(".json").unlink()
        if path.stat().st_size <= LARGEST:
            break
    print(path.name, path.stat().st_size, "bytes, detail", detail, ", ".join(t["name"] for t in made),
          "; colors", sorted({palette.base_name(p["name"]) for t in made for p in t["parts"]}))


if __name__ == "__main__":
    main()
