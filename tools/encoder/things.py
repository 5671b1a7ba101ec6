"""Kinds of things: each function returns parts as (name, mesh, role), proportions drawn at random.

A role says where a part's colour comes from (palette.py): "main" is the colour that the whole thing
is called by, "own" a colour of the part's own, "like main" mostly the main one, "natural:brown" mostly
that one, "letter:green" always that one. Parts that come in pairs ("left stick") carry the side in
their name; a picture of one part cannot tell its side, and texts treat it as idle.
"""

import numpy as np

from shapes import Mesh, ball, bent, box, cone, curve, cylinder, grid, lathe, pillow, torus, total, tube, turned


class Dice:
    """Proportions around 1."""

    def __init__(self, rng):
        self.rng = rng

    def __call__(self, low=0.8, high=1.25):
        return self.rng.uniform(low, high)

    def often(self, p):
        return self.rng.random() < p


def controller(d):
    w, r = 0.06 * d(), 0.022 * d()
    def rim(a):
        c, s = np.cos(a), np.sin(a)
        grip = np.exp(-((np.abs(np.abs(c) - 0.8)) / 0.2) ** 2) * (s < 0)
        return 0.95 * w * (0.62 + 0.38 * abs(c)) + 0.028 * d.grip * grip
    d.grip = d(0.7, 1.3)
    top = r * 1.05
    body = pillow(rim, 0.017, 0.016).at(0, top * 0.8, 0)
    y = top * 0.8 + 0.013
    stick = lambda x: (cylinder(0.005, 0.010) + cylinder(0.0105, 0.004).at(0, 0.009, 0)).at(x, y, 0.014)
    parts = [("body", body, "main"),
             ("left stick", stick(-0.02), "stick:black"), ("right stick", stick(0.02), "stick:black"),
             ("direction pad", (box(0.028, 0.009, 0.010) + box(0.010, 0.009, 0.028)).at(-0.038, y + 0.001, -0.008),
              "natural:black")]
    for side, x in (("left", -1), ("right", 1)):
        parts.append((f"{side} trigger", box(0.034, 0.014, 0.014, 0.6).turned("y", 10 * x).at(x * 0.042, top, -0.037),
                      "trigger:like"))
    button = lambda dx, dz: cylinder(0.0066, 0.009).at(0.038 + dx, y - 0.003, -0.009 + dz)
    spots = {"a": (0, 0.0125), "b": (0.0125, 0), "x": (-0.0125, 0), "y": (0, -0.0125)}
    if d.often(0.55):
        usual = {"a": "green", "b": "red" if d.often(0.5) else "orange", "x": "blue" if d.often(0.5) else "purple",
                 "y": "yellow"}
        parts += [(f"button {k}", button(*at), f"letter:{usual[k]}") for k, at in spots.items()]
    elif d.often(0.5):
        parts.append(("button", cylinder(0.013, 0.009).at(0.038, y - 0.002, -0.009), "own"))
    else:
        parts.append(("buttons", total([button(*at) for at in spots.values()]), "own"))
    if d.often(0.4):
        parts.append(("menu button", box(0.009, 0.005, 0.006).at(0, y + 0.002, -0.016), "natural:white"))
    return parts


def cup_wall(r, h, base, lip):
    return turned([[0, 0], [r * base, 0], [r * base * 1.1, h * .06], [r, h * .5], [r * lip, h * .97], [r * lip - .003, h],
                   [r * lip - .006, h * .96], [r - .006, h * .5], [r * base, h * .1], [0, h * .09]], 1, 22)


def loop(x, low, high, reach, thick):
    m = (low + high) / 2
    return bent([[x, high, 0], [x + reach * .6, high, 0], [x + reach, m + (high - low) * .2, 0],
                 [x + reach * .9, m - (high - low) * .2, 0], [x + reach * .5, low, 0], [x, low, 0]], thick, 3)


def mug(d):
    r, h = 0.042 * d(), 0.095 * d(.7, 1.3)
    return [("body", cup_wall(r, h, d(.7, .95), d(.92, 1.1)), "main"),
            ("handle", loop(r * .94, h * .25, h * .82, 0.033 * d(), 0.006 * d()), "own like"),
            ("coffee", lathe([[r * .85, h * d(.7, .84)], [0, h * .85]]), "natural:brown")]


def kettle(d):
    r, h = 0.09 * d(.85, 1.15), 0.14 * d()
    spout = curve([[r * .8, h * .33, 0], [r * 1.08, h * .48, 0], [r * 1.26, h * .7, 0], [r * 1.48, h * .94, 0]], 3)
    arc = [[-.66 * r, h * .88, 0], [-.8 * r, h * 1.25, 0], [-.45 * r, h * 1.55, 0], [0, h * 1.66, 0],
           [.45 * r, h * 1.55, 0], [.8 * r, h * 1.25, 0], [.66 * r, h * .88, 0]]
    return [("body", turned([[r * .82, h * .07], [r * .97, h * .2], [r, h * .42], [r * .92, h * .68], [r * .5, h * .98],
                             [0, h]], 2, 24), "main"),
            ("base", turned([[0, 0], [r * .8, 0], [r * .89, h * .05], [r * .85, h * .11]], 1), "natural:grey"),
            ("lid", turned([[r * .53, h * .96], [r * .55, h], [r * .3, h * 1.1], [0, h * 1.15]], 2), "own like"),
            ("knob", ball(0.013 * d()).at(0, h * 1.22, 0), "own:black"),
            ("spout", tube(spout, np.linspace(.026, .012, len(spout)) * d()), "like"),
            ("handle", bent(arc, 0.0085 * d()), "own:black")]


def teapot(d):
    r = 0.07 * d()
    y = r * .85
    spout = curve([[r * .75, y * .8, 0], [r * 1.2, y * .9, 0], [r * 1.45, y * 1.5, 0], [r * 1.75, y * 1.8, 0]], 3)
    parts = [("body", ball(r, r * .85, r).at(0, y, 0), "main"),
             ("lid", turned([[r * .5, y * 1.78], [r * .48, y * 1.9], [0, y * 2.1]], 2), "own like"),
             ("knob", ball(0.011 * d()).at(0, y * 2.2, 0), "own"),
             ("spout", tube(spout, np.linspace(.018, .008, len(spout))), "like"),
             ("handle", loop(r * .85, y * .55, y * 1.5, .04 * d(), .0075 * d()).scaled(-1, 1, 1), "own like")]
    if d.often(.6):
        parts.append(("base", cylinder(r * .55, y * .2), "own like"))
    return parts


def lamp(d):
    r, h, s = 0.07 * d(), 0.30 * d(.75, 1.1), d(.8, 1.15)
    top, low = h * 1.25, h * .8
    big, small = .1 * s, (.055 if d.often(.7) else .095) * s
    return [("base", turned([[0, 0], [r, 0], [r * 1.04, .007], [r * .85, .017], [r * .3, .026], [0, .034]], 1), "own"),
            ("stem", cylinder(0.0075 * d(), h * 1.05, 10), "own:yellow"),
            ("bulb", ball(.024, .03, .024).at(0, h * 1.0, 0), "natural:white glow"),
            ("shade", lathe([[big, low], [small, top], [small - .003, top], [big - .003, low]], 26), "main"),
            ] + ([("switch", cylinder(.01, .012).at(.042, .014, 0), "own:red")] if d.often(.7) else [])


def teddy_bear(d):
    b, hd, limb = d(.85, 1.15), d(.9, 1.2), d()
    y = .07 * b
    top = y + .10 * b
    arm = lambda s: ball(.018 * limb, .045, .02 * limb).turned("z", 34 * s).turned("x", -28).at(s * .06 * b, y + .022, .02)
    leg = lambda s: ball(.023 * limb, .023 * limb, .05).turned("y", 24 * s).at(s * .045 * b, .024, .055)
    sole = lambda s: ball(.017 * limb, .017 * limb, .006).turned("y", 24 * s).at(s * .064 * b, .025, .099)
    ear = lambda s: ball(.021, .021, .011).at(s * .04 * hd, top + .036 * hd, -.006)
    parts = [("body", ball(.058 * b, .07 * b, .052 * b).at(0, y, 0), "main"),
             ("belly", ball(.038 * b, .046 * b, .013).at(0, y, .043 * b), "own:white"),
             ("head", ball(.051 * hd, .046 * hd, .045 * hd).at(0, top, .004), "main"),
             ("muzzle", ball(.024 * hd, .019 * hd, .019).at(0, top - .01, .042 * hd), "own:white"),
             ("nose", ball(.0105, .0075, .007).at(0, top - .003, .059 * hd), "natural:black"),
             ("eyes", ball(.0066, .007, .005).at(.019 * hd, top + .011, .04 * hd).pair(), "natural:black")]
    if d.often(.6):
        parts += [("scarf", torus(.036, .0115).at(0, top - .042 * hd, .003)
                   + ball(.012, .03, .007).at(.02, top - .07 * hd, .05 * b), "own")]
    for s, side in ((-1, "left "), (1, "right ")):
        parts += [(side + "ear", ear(s), "ear:like"), (side + "arm", arm(s), "arm:main"),
                  (side + "leg", leg(s), "leg:main")]
    if d.often(.6):
        parts.append(("soles", sole(1) + sole(-1), "own:white"))
    return parts


def cookie_jar(d):
    r, h = .064 * d(), .13 * d()
    return [("jar", turned([[0, 0], [r * .78, 0], [r * .9, h * .06], [r * 1.03, h * .35], [r, h * .73], [r * .8, h]], 2, 22),
             "main"),
            ("rim", turned([[r * .78, h * .97], [r * .86, h * .98], [r * .86, h * 1.04], [r * .78, h * 1.06]], 1), "own"),
            ("lid", turned([[r * .84, h * 1.05], [r * .87, h * 1.08], [r * .4, h * 1.22], [0, h * 1.26]], 2), "own like"),
            ("knob", ball(.0125 * d()).at(0, h * 1.34, 0), "own")]


def book(d):
    w, l, t, b = .14 * d(), .195 * d(), .03 * d(.6, 1.5), .004
    covers = box(w, b, l).at(0, b / 2, 0) + box(w, b, l).at(0, t - b / 2, 0) + box(b, t, l).at((b - w) / 2, t / 2, 0)
    parts = [("cover", covers, "main"), ("pages", box(w - .011, t - 2 * b, l - .01).at(-.002, t / 2, 0), "natural:white")]
    if d.often(.4):
        parts.append(("bookmark", box(.014, .0015, l * .35).at(w * .1, t * .55, l * .6), "own"))
    return parts


def pot_plant(d):
    r, h = .056 * d(), .09 * d()
    n = int(d.rng.integers(7, 15))
    size, leaves = .15 * d(.7, 1.25), []
    wide = d(.6, 1.4)
    for i in range(n):
        rise, bend = np.radians(80 - 45 * i / n), d(.6, 1.4)
        t = np.linspace(0, 1, 6)[:, None]
        a = rise - bend * t ** 2
        step = np.hstack([np.cos(a), np.sin(a)]) * size / 6 * d(.8, 1.2)
        s = np.cumsum(step, 0)
        half = wide * .026 * np.sin(np.pi * np.clip((t + .1) / 1.15, 0, 1))
        side = np.array([-1, 0, 1])
        p = np.stack([s[:, :1] + 0 * side, s[:, 1:] + .2 * half * side ** 2, half * side], -1)
        nrm = np.stack([-np.sin(a) + 0 * side, np.cos(a) + 0 * side, 0 * a + 0 * side], -1)
        uv = np.stack([np.broadcast_to((side + 1) / 2, (6, 3)), np.broadcast_to(t, (6, 3))], -1)
        leaves.append(grid(p, nrm, uv).turned("y", 137.5 * i).at(0, h, 0))
    return [("saucer", turned([[0, 0], [r, 0], [r * 1.2, .01], [r * 1.1, .012], [0, .006]], 1), "own like"),
            ("pot", lathe([[0, .006], [r * .72, .006], [r, h * .8], [r * 1.1, h * .8], [r * 1.1, h], [r * .98, h],
                           [r * .95, h * .85]], 22), "main"),
            ("soil", lathe([[r * .97, h * .93], [0, h * .96]]), "natural:brown"),
            ("leaves", total(leaves), "natural:green")]


def camera(d):
    w, h, z = .13 * d(.85, 1.15), .062 * d(), .042 * d()
    l = .03 * d(.85, 1.1)
    fwd = lambda m, x, y, depth: m.turned("x", 90).at(x, y, depth)
    return [("body", box(w, h, z, .4).at(0, h / 2, 0), "main"),
            ("top plate", box(w * .98, .02, z * .95, .5).at(0, h + .008, 0), "own:grey"),
            ("viewfinder", box(.036, .02, z * .85, .5).at(0, h + .024, 0), "own:grey"),
            ("lens", fwd(lathe([[l, 0], [l, .012], [l * .9, .014], [l * .9, .038 * d()], [l * .7, .038], [l * .6, .03]], 22),
                         0, h * .52, z * .45), "own:black"),
            ("glass", fwd(ball(l * .62, .006, l * .62), 0, h * .52, z * .45 + .032), "own:blue"),
            ("flash", box(.026, .013, .006).at(w * .34, h + .008, z * .5), "natural:white"),
            ("shutter button", cylinder(.008, .009).at(-w * .37, h + .017, .004), "own:red"),
            ("dial", cylinder(.0125, .011).at(w * .35, h + .017, 0), "own:black")]


def headphones(d):
    half, cup = .074 * d(.9, 1.1), .039 * d(.9, 1.1)
    def arch(rad, a0, a1):
        a = np.linspace(a0, a1, 18)
        return np.stack([rad * np.cos(a), 0 * a, -1.15 * rad * np.sin(a)], 1)
    lie = lambda m: m.scaled(1, d.wide, 1).turned("x", 14).at(0, cup, 0)
    d.wide = d(1.6, 2.4)
    shell = lambda: turned([[0, -.022], [cup * .5, -.021], [cup * .85, -.016], [cup, -.006], [cup, .004], [0, .004]], 1, 20)
    side = lambda m, s: m.turned("z", 90 * s).at(s * half, cup, .004)
    return [("band", lie(tube(arch(half + .01, 0, np.pi), .0055)), "band:main"),
            ("band padding", lie(tube(arch(half + .0035, .28 * np.pi, .72 * np.pi), .0062)), "own:black"),
            ("left cup", side(shell(), -1), "cup:main"), ("right cup", side(shell(), 1), "cup:main"),
            ("left cushion", side(torus(cup * .7, .0105).at(0, .009, 0), -1), "cushion:black"),
            ("right cushion", side(torus(cup * .7, .0105).at(0, .009, 0), 1), "cushion:black")]


def toy_car(d):
    l, h, w, r = .15 * d(), .036 * d(), .07 * d(), .019 * d()
    c = l * .53 * d(.8, 1.2)
    wheel = lambda x, s: (cylinder(r, .014) + ball(r * .45, .003, r * .45).at(0, .014, 0)).turned("x", 90 * s) \
        .at(x, r, s * (w / 2 - .008))
    y = r * 1.9
    parts = [("body", box(l, h, w, .6).at(0, y, 0), "main"),
             ("windows", box(c, h, w * .83, .5).at(-.008, y + h * .68, 0), "natural:blue"),
             ("roof", box(c * .9, .01, w * .8, .8).at(-.008, y + h * 1.24, 0), "own like"),
             ("headlights", (ball(.005, .0085, .0085).at(l / 2, y + .003, w * .3)
                             + ball(.005, .0085, .0085).at(l / 2, y + .003, -w * .3)), "natural:white"),
             ("bumpers", box(.01, .01, w * .95).at(l / 2 + .001, y - h * .33, 0)
              + box(.01, .01, w * .95).at(-l / 2 - .001, y - h * .33, 0), "own:grey")]
    four = [(a, b, x, s) for a, x in (("front", 1), ("back", -1)) for b, s in (("left", -1), ("right", 1))]
    if d.often(.5):
        parts += [(f"{a} {b} wheel", wheel(x * l * .29, s), "wheel:black") for a, b, x, s in four]
    else:
        parts.append(("wheels", total([wheel(x * l * .29, s) for _, _, x, s in four]), "wheel:black"))
    return parts


def fruit_bowl(d):
    r, h = .088 * d(.9, 1.1), .058 * d()
    bowl = turned([[0, 0], [r * .37, 0], [r * .42, h * .1], [r * .75, h * .45], [r, h], [r * .97, h * 1.03], [r * .7, h * .52],
                   [r * .3, h * .2], [0, h * .17]], 2, 24)
    spots = d.rng.permutation(4)
    place = [(-.034, .02), (.036, .026), (.0, -.036), (.004, .0)]
    def at(m, k, up=0):
        x, z = place[spots[k]]
        return m.at(x, h + (.028 if spots[k] == 3 else -.004) + up, z)
    apple = turned([[0, -.028], [.012, -.031], [.027, -.018], [.034, .004], [.028, .026], [.014, .032], [0, .024]], 2)
    stalk = bent([[0, .022, 0], [.001, .034, 0], [.005, .044, 0]], .0018)
    pear = turned([[0, -.03], [.022, -.026], [.031, -.006], [.025, .014], [.015, .032], [.012, .046], [0, .053]], 2)
    lemon = turned([[0, -.039], [.006, -.034], [.021, -.018], [.026, 0], [.021, .018], [.006, .034], [0, .039]], 1)
    tilt = lambda m: m.turned("x", d.rng.uniform(-40, 40)).turned("z", d.rng.uniform(-30, 30))
    parts = [("bowl", bowl, "main"), ("apple", at(apple, 0), "either:red,green"), ("stalk", at(stalk, 0), "natural:brown"),
             ("orange", at(ball(.032 * d(.9, 1.1)), 1), "letter:orange"),
             ("pear", at(tilt(pear), 2), "either:green,yellow"),
             ("lemon", at(tilt(lemon.turned("z", 90)), 3), "letter:yellow")]
    if d.often(.35):
        a = np.linspace(-1.1, 1.1, 9)
        banana = tube(np.stack([.075 * np.sin(a), -.06 * np.cos(a) + .06, 0 * a], 1), .014 * np.cos(a * .9) ** .5 + .002)
        parts[-1] = ("banana", at(banana.turned("y", d.rng.uniform(0, 180)), 3), "letter:yellow")
    return parts


def chair(d):
    w, h, b, t = .09 * d(), .09 * d(), .1 * d(), .01
    leg = lambda x, z: box(t, h, t).at(x * w * .44, h / 2, z * w * .44)
    parts = [("seat", box(w, .012, w, .6).at(0, h, 0), "main"),
             ("legs", total([leg(x, z) for x in (-1, 1) for z in (-1, 1)]), "own like"),
             ("back", box(w, b, .01, .5).at(0, h + b / 2, -w * .45), "own like")]
    if d.often(.6):
        parts.append(("cushion", box(w * .85, .02, w * .85, .9).at(0, h + .015, .003), "own"))
    if d.often(.4):
        parts.append(("armrests", (box(.01, .008, w * .8).at(w * .46, h + .045, 0)
                                   + box(.008, .045, .008).at(w * .46, h + .022, w * .35)).pair(), "own like"))
    return parts


def bottle(d):
    r, h = .032 * d(), .17 * d()
    neck = r * d(.3, .45)
    parts = [("body", turned([[0, 0], [r * .9, 0], [r, h * .05], [r, h * .5], [r * .8, h * .62], [neck, h * .75]], 1), "main"),
             ("neck", cylinder(neck, h * .22, 12).at(0, h * .74, 0), "like"),
             ("cap", cylinder(neck * 1.3, h * .09, 12).at(0, h * .94, 0), "own")]
    if d.often(.8):
        parts.append(("label", lathe([[r * 1.02, h * .14], [r * 1.02, h * .42]]), "own"))
    return parts


def vase(d):
    r, h = .04 * d(), .13 * d()
    n = int(d.rng.integers(3, 7))
    stems, blooms, hearts = [], [], []
    for i in range(n):
        a, lean = 2.4 * i, d(.2, .9) * .07
        tip = np.array([np.cos(a) * lean, h * d(1.4, 1.8), np.sin(a) * lean])
        stems.append(bent([[0, h * .6, 0], [tip[0] * .5, h * 1.1, tip[2] * .5], tip], .0022, 2, 6))
        petals = total([ball(.012, .004, .007).at(.012, 0, 0).turned("y", 72 * k) for k in range(5)])
        blooms.append(petals.at(*tip))
        hearts.append(ball(.006).at(*tip + [0, .003, 0]))
    return [("body", turned([[0, 0], [r * .7, 0], [r * .85, h * .1], [r * d(), h * .4], [r * .5, h * .8], [r * .7, h]], 2), "main"),
            ("stems", total(stems), "natural:green"), ("petals", total(blooms), "own"),
            ("flower centres", total(hearts), "natural:yellow")]


def clock(d):
    r = .065 * d()
    fwd = lambda m, y=0, z=0: m.turned("x", 90).at(0, r + .012 + y, z)
    hand = lambda l, a: box(.006, l, .003).at(0, l / 2, 0).turned("z", a).at(0, r + .012, .026)
    parts = [("case", fwd(cylinder(r, .035, 26), z=-.014), "main"), ("dial", fwd(cylinder(r * .85, .004, 26), z=.019), "natural:white"),
             ("hands", hand(r * .7, d.rng.uniform(0, 360)) + hand(r * .45, d.rng.uniform(0, 360)), "own:black"),
             ("feet", cone(.005, .02, .01).at(r * .5, 0, 0).pair(), "own")]
    if d.often(.7):
        parts += [("bells", ball(.024, .018, .024).at(r * .5, r * 2 + .015, 0).pair(), "own"),
                  ("hammer", box(.01, .026, .01).at(0, r * 2 + .02, 0), "own:black")]
    return parts


def hammer(d):
    l = .17 * d()
    parts = [("handle", tube(np.array([[-l / 2, .014, 0], [0, .013, 0], [l / 2, .014, 0]]), [.012, .009, .010]), "main"),
             ("head", box(.026, .026, .075 * d(), .4).at(l / 2, .015, 0), "own:grey")]
    if d.often(.6):
        parts.append(("grip", cylinder(.0145, l * .38).turned("z", 90).at(-l * .12, .0145, 0), "own"))
    return parts


def screwdriver(d):
    h, s, r = .075 * d(), .085 * d(), .015 * d()
    flat = lambda m: m.turned("z", -90).at(-.07, r, 0)
    return [("handle", flat(lathe([[0, 0], [r, 0], [r, h * .7], [r * .6, h * .85], [r * .8, h], [0, h]], 8)), "main"),
            ("shaft", flat(cylinder(.005 * d(), s, 10).at(0, h, 0)), "natural:grey"),
            ("tip", flat(box(.013, .018, .004).at(0, h + s, 0)), "own:black")]


def cake(d):
    r, h, layers = .07 * d(), .03 * d(), int(d.rng.integers(1, 3))
    tiers = total([cylinder(r * (1 - .3 * k), h, 24).at(0, .008 + k * h, 0) for k in range(layers)])
    top, rt = .008 + layers * h, r * (1 - .3 * (layers - 1))
    parts = [("plate", cylinder(r * 1.25, .008, 24), "own:white"), ("sponge", tiers, "main"),
             ("icing", pillow(lambda a: rt * (1.02 + .06 * np.sin(7 * a)), .012, .006).at(0, top, 0), "own")]
    n = int(d.rng.integers(1, 6))
    ring = [(rt * .6 * np.cos(6.28 * i / n), rt * .6 * np.sin(6.28 * i / n)) for i in range(n)]
    if d.often(.7):
        parts += [("candles", total([cylinder(.005, .04, 8).at(x, top + .008, z) for x, z in ring]), "own"),
                  ("flames", total([ball(.005, .009, .005, 8).at(x, top + .056, z) for x, z in ring]), "either:orange,yellow glow")]
    else:
        parts.append(("cherries", total([ball(.011, segments=10).at(x, top + .017, z) for x, z in ring]), "natural:red"))
    return parts


def candle(d):
    r, h = .022 * d(), .09 * d(.5, 1.4)
    parts = [("wax", turned([[0, .008], [r, .008], [r, h], [r * .8, h * 1.02], [0, h * .96]], 1), "main"),
             ("wick", cylinder(.0022, .016, 6).at(0, h * .97, 0), "natural:black"),
             ("flame", turned([[0, 0], [.009, .008], [.007, .018], [0, .034]], 2, 10).at(0, h + .008, 0), "either:orange,yellow glow"),
             ("holder", turned([[0, 0], [r * 2, 0], [r * 2.3, .012], [r * 2, .014], [r * 1.2, .006], [0, .008]], 1), "own")]
    if d.often(.4):
        parts.append(("handle", torus(.014, .004, 14).turned("x", 90).at(r * 2.2 + .014, .016, 0), "own like"))
    return parts


def house(d):
    w, h, l = .1 * d(), .07 * d(), .11 * d()
    roof = lathe([[.78, 0], [0, 1]], 4).turned("y", 45).scaled(w * 1.05, h * .75, l * 1.05).at(0, h, 0)
    pane = lambda x: box(.022, .022, .006).at(x, h * .62, l / 2)
    return [("walls", box(w, h, l, .05).at(0, h / 2, 0), "main"), ("roof", roof, "own:red"),
            ("door", box(.024, h * .55, .008).at(0, h * .28, l / 2), "own"),
            ("windows", pane(w * .32).pair(), "own:blue"),
            ("chimney", box(.018, .045, .018).at(w * .25, h * 1.5, 0), "own")]


def boat(d):
    l, w = .085 * d(), .033 * d()
    hull = pillow(lambda a: l * w / np.sqrt((w * np.cos(a)) ** 2 + (l * np.sin(a)) ** 2), .004, .035, 2.2).at(0, .036, 0)
    m = .16 * d()
    sail = lambda s, k: plate([[.004 * s, .06, 0], [s * l * .75 * k, .065, .004], [.004 * s, m * .95 * (1 if s > 0 else .8), 0]])
    parts = [("hull", hull, "main"), ("mast", cylinder(.004, m, 8).at(0, .038, 0), "own:brown"),
             ("sail", sail(1, d(.7, 1)) + sail(-1, d(.6, .9)), "own:white")]
    if d.often(.5):
        parts.append(("flag", box(.026, .015, .003).at(.014, .036 + m * .97, 0), "own"))
    if d.often(.4):
        parts.append(("cabin", box(l * .5, .022, w * .8).at(-l * .3, .05, 0), "own"))
    return parts


def plate(p):
    """A thin three-cornered plate."""
    p = np.array(p, float)
    n = np.cross(p[1] - p[0], p[2] - p[0])
    n /= np.linalg.norm(n)
    uv = np.array([[0, 1], [1, 1], [0, 0]], float)
    front = Mesh(p + n * .0008, np.tile(n, (3, 1)), uv, [[0, 1, 2]])
    back = Mesh(p - n * .0008, np.tile(-n, (3, 1)), uv, [[2, 1, 0]])
    return front + back


def rocket(d):
    r, h = .03 * d(), .13 * d()
    fin = lambda k: box(.04 * d.fin, .045, .006).at(r + .012, .022, 0).turned("y", 120 * k)
    d.fin = d()
    return [("body", turned([[r * .8, .015], [r * 1.05, h * .4], [r * .85, h * .85]], 3), "main"),
            ("nose", cone(r * .87, h * .4).at(0, h * .85, 0), "own:red"), ("fins", total([fin(k) for k in range(3)]), "own"),
            ("window", cylinder(.013 * d(), .01).turned("x", 90).at(0, h * .6, r * .96), "own:blue"),
            ("engine", cone(r * .75, .02, r * .5), "own:grey")]


def robot(d):
    w, h, b = .07 * d(), .075 * d(), .045 * d()
    leg = .04 * d()
    arm = lambda: (box(.016, h * .8, .016, .5).at(0, -h * .4, 0)).turned("z", 14).at(w / 2 + .010, leg + h * .95, 0)
    top = leg + h + b
    return [("body", box(w, h, w * .65, .3).at(0, leg + h / 2, 0), "main"), ("head", box(w * .75, b, w * .6, .4).at(0, leg + h + b / 2 + .004, 0), "own like"),
            ("eyes", ball(.0085, .0085, .006).at(w * .18, leg + h + b * .6, w * .31).pair(), "own"),
            ("arms", arm().pair(), "own"), ("legs", box(.024, leg, .028, .3).at(w * .26, leg / 2, 0).pair(), "own"),
            ("antenna", cylinder(.0026, .03, 6).at(0, top, 0) + ball(.008, segments=10).at(0, top + .032, 0), "own"),
            ("button", cylinder(.012, .01).turned("x", 90).at(0, leg + h * .55, w * .32), "own")]


def bag(d):
    w, h, z = .12 * d(), .09 * d(), .045 * d()
    grip = bent([[-w * .28, h * .95, 0], [-w * .25, h * 1.4, 0], [0, h * 1.6, 0], [w * .25, h * 1.4, 0], [w * .28, h * .95, 0]], .006)
    return [("body", box(w, h, z, .6).at(0, h / 2, 0), "main"), ("handle", grip, "own"),
            ("flap", box(w * 1.02, h * .5, .008, .5).at(0, h * .76, z / 2), "own like"),
            ("buckle", box(.024, .02, .008).at(0, h * .52, z / 2 + .006), "own:yellow")] \
        + ([("pocket", box(w * .5, h * .36, .014, .6).at(0, h * .22, z / 2), "own")] if d.often(.4) else [])


def umbrella(d):
    r, h = .1 * d(), .15 * d()
    hook = bent([[0, .03, 0], [0, .012, 0], [.01, .002, 0], [.022, .006, 0], [.024, .018, 0]], .006)
    n = 8
    dome = pillow(lambda a: r * (1 - .08 * abs(np.sin(n * a / 2))), h * .36, -.004, 2.0, 32).at(0, h * .8, 0)
    return [("canopy", dome, "main"), ("shaft", cylinder(.0042, h * 1.05, 8).at(0, .03, 0), "own:grey"),
            ("handle", hook, "own:brown"), ("tip", cone(.007, .03).at(0, h * 1.14, 0), "own")]


def duck(d):
    b, hd = d(), d()
    return [("body", ball(.06 * b, .04 * b, .045 * b).at(0, .04 * b, 0), "main"),
            ("head", ball(.03 * hd).at(.038 * b, .095 * b, 0), "like"),
            ("beak", ball(.017, .006, .013).at(.038 * b + .034 * hd, .092 * b, 0), "natural:orange"),
            ("eyes", ball(.0055, .006, .004, 8).at(.038 * b + .019 * hd, .105 * b, .019 * hd)
             + ball(.0055, .006, .004, 8).at(.038 * b + .019 * hd, .105 * b, -.019 * hd), "natural:black"),
            ("wings", ball(.035, .02, .008).turned("y", 8).at(-.012, .046 * b, .043 * b)
             + ball(.035, .02, .008).turned("y", -8).at(-.012, .046 * b, -.043 * b), "own like")]


def hat(d):
    r, h = .052 * d(), .06 * d()
    return [("crown", turned([[r, .006], [r * .98, h * .6], [r * .8, h], [0, h * 1.02]], 2, 22), "main"),
            ("brim", turned([[r * .98, .006], [r * 1.8 * d(.85, 1.1), .003], [r * 1.7, 0], [r * .95, .001]], 1, 24), "like"),
            ("ribbon", lathe([[r * 1.02, .008], [r * 1.03, .024 * d()]], 22), "own")] \
        + ([("feather", ball(.008, .04, .003).turned("z", -25).at(r * 1.05, .05, 0), "own")] if d.often(.4) else [])


def pan(d):
    r, h = .075 * d(), .035 * d(.7, 1.5)
    parts = [("body", lathe([[0, 0], [r * .85, 0], [r, h], [r * .97, h], [r * .82, .006], [0, .006]], 24), "main"),
             ("handle", tube(np.array([[r * .95, h * .85, 0], [r * 1.4, h, 0], [r * 2.1, h * 1.15, 0]]), [.009, .009, .011]), "own:black")]
    if d.often(.5):
        parts += [("lid", turned([[r, h], [r, h + .006], [r * .5, h + .018], [0, h + .022]], 1, 22), "own"),
                  ("knob", ball(.012, .01, .012).at(0, h + .03, 0), "own")]
    return parts


def bucket(d):
    r, h = .06 * d(), .1 * d()
    a = np.linspace(0, np.pi, 14)
    bow = np.stack([r * np.cos(a), h * .95 + .05 * d() * np.sin(a), .04 * np.sin(a)], 1)
    return [("body", lathe([[0, 0], [r * .72, 0], [r, h], [r * .96, h], [r * .7, .006], [0, .006]], 24), "main"),
            ("rim", torus(r * .99, .005, 24, 6).at(0, h, 0), "own"), ("handle", tube(bow, .004), "own")] \
        + ([("sand", turned([[r * .93, h * .86], [r * .5, h * .93], [0, h]], 1), "natural:yellow")] if d.often(.5) else [])


def drum(d):
    r, h = .06 * d(), .07 * d()
    stick = lambda z: (cylinder(.0045, .13, 8) + ball(.009, segments=8).at(0, .13, 0)).turned("z", -88).at(-.065, h * 1.05 + .008, z)
    return [("shell", lathe([[r, .006], [r, h]], 24), "main"), ("skin", lathe([[r, h * 1.01], [0, h * 1.02]], 24), "natural:white"),
            ("rims", torus(r, .006, 24, 6).at(0, h, 0) + torus(r, .006, 24, 6).at(0, .007, 0), "own"),
            ("drumsticks", stick(.012).turned("y", 20) + stick(-.012).turned("y", -15), "own:brown")]


def phone(d):
    w, l, t = .065 * d(), .13 * d(), .011
    stand = d.often(.6)
    pose = (lambda m: m.turned("x", 62).at(0, l * .47, 0)) if stand else (lambda m: m.at(0, t / 2, 0))
    parts = [("case", pose(box(w, t, l, .6)), "main"), ("screen", pose(box(w * .88, .002, l * .8).at(0, t / 2, -l * .04)), "own:black"),
             ("button", pose(cylinder(.008, .003).at(0, t / 2, l * .43)), "own")]
    if stand:
        parts.append(("stand", box(w * .6, .012, .05).at(0, .006, -.012) + box(w * .4, l * .5, .008).turned("x", -28).at(0, l * .26, -.05), "own"))
    return parts


def die(d):
    s = .05 * d(.9, 1.3)
    spots = [(x, y) for x in (-.25, .25) for y in (-.25, .25)] + [(0, 0)]
    pip = lambda x, y: ball(s * .09, .002, s * .09, 8).at(x * s, s, y * s)
    front = lambda x, y: ball(s * .09, s * .09, .002, 8).at(x * s, s / 2 + y * s, s / 2)
    return [("body", box(s, s, s, .35).at(0, s / 2, 0), "main"),
            ("spots", total([pip(*q) for q in spots] + [front(*q) for q in spots[:4]]
                            + [front(*q).turned("y", 90) for q in spots[4:]]), "own")]


def table(d):
    w, z = 1.0 * d(.9, 1.15), .8 * d(.95, 1.15)
    leg = lambda x, s: box(.05, .7, .05).at(x * w * .45, .35, s * z * .45)
    parts = [("top", box(w, .03, z, .4).at(0, .725, 0), "main"), ("frame", box(w * .92, .06, z * .9).at(0, .68, 0), "like")]
    legs = [(a, b, x, s) for a, s in (("front", 1), ("back", -1)) for b, x in (("left", -1), ("right", 1))]
    if d.often(.6):
        parts += [(f"{a} {b} leg", leg(x, s), "leg:like") for a, b, x, s in legs]
    else:
        parts.append(("legs", total([leg(x, s) for _, _, x, s in legs]), "leg:like"))
    return parts


def floor(d):
    parts = [("boards", box(3.2, .02, 3.2).at(0, -.02, 0), "main"), ("rug", box(1.7 * d(), .008, 1.3 * d()).at(0, .0, 0), "own")]
    if d.often(.5):
        parts.append(("rug border", box(1.9, .006, 1.75).at(0, -.002, 0), "own"))
    return parts


KINDS = {f.__name__.replace("_", " "): f for f in [
    controller, mug, kettle, teapot, lamp, teddy_bear, cookie_jar, book, pot_plant, camera, headphones, toy_car,
    fruit_bowl, chair, bottle, vase, clock, hammer, screwdriver, cake, candle, house, boat, rocket, robot, bag,
    umbrella, duck, hat, pan, bucket, drum, phone, die]}
GROUND = {"table": table, "floor": floor}
