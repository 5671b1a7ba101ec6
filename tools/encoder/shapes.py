"""Triangle meshes of simple shapes: the same family as tools/demo_scene/shapes.rs, coarser."""

import numpy as np

DETAIL = 1.0  # share of the usual number of segments


def fine(segments, least=6):
    return max(least, int(round(segments * DETAIL)))


class Mesh:
    """Positions, normals, texture coordinates (one row a vertex) and triangles. y is up, metres."""

    def __init__(self, p, n, uv, t):
        self.p, self.n, self.uv, self.t = (np.asarray(a) for a in (p, n, uv, t))

    def map(self, m):
        m = np.asarray(m, float)
        n = self.n @ np.linalg.inv(m)
        n /= np.maximum(np.linalg.norm(n, axis=1, keepdims=True), 1e-9)
        t = self.t[:, ::-1] if np.linalg.det(m) < 0 else self.t
        return Mesh(self.p @ m.T, n, self.uv, t)

    def at(self, x, y, z):
        return Mesh(self.p + np.array([x, y, z]), self.n, self.uv, self.t)

    def scaled(self, x, y, z):
        return self.map(np.diag([x, y, z]))

    def turned(self, axis, degrees):
        c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
        m = {"x": [[1, 0, 0], [0, c, -s], [0, s, c]],
             "y": [[c, 0, s], [0, 1, 0], [-s, 0, c]],
             "z": [[c, -s, 0], [s, c, 0], [0, 0, 1]]}[axis]
        return self.map(m)

    def __add__(self, o):
        return Mesh(np.vstack([self.p, o.p]), np.vstack([self.n, o.n]), np.vstack([self.uv, o.uv]),
                    np.vstack([self.t, o.t + len(self.p)]))

    def pair(self):
        """With its mirror image at x = 0."""
        return self + self.scaled(-1, 1, 1)


def total(meshes):
    out = meshes[0]
    for m in meshes[1:]:
        out = out + m
    return out


def grid(p, n, uv):
    """A mesh from arrays [rows, columns, 3|3|2]."""
    r, c = p.shape[:2]
    i = np.arange(r * c).reshape(r, c)
    a, b, d, e = i[:-1, :-1].ravel(), i[:-1, 1:].ravel(), i[1:, :-1].ravel(), i[1:, 1:].ravel()
    t = np.vstack([np.stack([a, b, e], 1), np.stack([a, e, d], 1)])
    return Mesh(p.reshape(-1, 3), n.reshape(-1, 3), uv.reshape(-1, 2), t)


def curve(points, steps):
    """Catmull and Rom through the points."""
    p = np.asarray(points, float)
    p = np.vstack([2 * p[0] - p[1], p, 2 * p[-1] - p[-2]])
    out = [p[1]]
    for i in range(1, len(p) - 2):
        p0, p1, p2, p3 = p[i - 1:i + 3]
        for s in range(1, steps + 1):
            t = s / steps
            out.append(p1 + 0.5 * ((p2 - p0) * t + (2 * p0 - 5 * p1 + 4 * p2 - p3) * t * t
                                   + (3 * p1 - p0 - 3 * p2 + p3) * t ** 3))
    return np.array(out)


def lathe(profile, segments=18):
    """Surface of revolution about y; the profile is (radius, height), bottom up, outside right."""
    p, segments = np.asarray(profile, float), segments if segments <= 4 else fine(segments)
    d = np.diff(p, axis=0)
    d /= np.maximum(np.linalg.norm(d, axis=1, keepdims=True), 1e-9)
    rows = []
    for i in range(len(p)):
        before, after = (d[i - 1] if i else None), (d[i] if i < len(d) else None)
        if before is None or after is None:
            rows.append((p[i], after if before is None else before))
        elif before @ after < 0.82:
            rows += [(p[i], before), (p[i], after)]
        else:
            m = before + after
            rows.append((p[i], m / np.linalg.norm(m)))
    q, t = np.array([r[0] for r in rows]), np.array([r[1] for r in rows])
    along = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(q, axis=0), axis=1))])
    v = 1 - along / max(along[-1], 1e-9)
    a = 2 * np.pi * (np.arange(segments + 1) % segments) / segments
    s, c = np.sin(a), np.cos(a)
    col = lambda x: np.repeat(x[:, None], segments + 1, 1)
    pos = np.stack([q[:, :1] * c, col(q[:, 1]), -q[:, :1] * s], -1)
    nor = np.stack([t[:, 1:] * c, col(-t[:, 0]), -t[:, 1:] * s], -1)
    uv = np.stack([np.repeat(np.arange(segments + 1)[None] / segments, len(q), 0), col(v)], -1)
    return grid(pos, nor, uv)


def turned(points, steps=2, segments=18):
    return lathe(np.maximum(curve(points, steps), [0, -9]), segments)


def cylinder(radius, height, segments=16):
    r = min(radius, height) * 0.15
    return lathe([[0, 0], [radius - r, 0], [radius, r], [radius, height - r], [radius - r, height], [0, height]],
                 segments)


def cone(radius, height, top=0.0, segments=16):
    return lathe([[0, 0], [radius, 0], [top, height], [0, height]] if top else [[0, 0], [radius, 0], [0, height]],
                 segments)


def ball(x, y=None, z=None, segments=14):
    a = np.linspace(-np.pi / 2, np.pi / 2, fine(segments) // 2 + 1)
    y, z = x if y is None else y, x if z is None else z
    return lathe(np.stack([np.maximum(np.cos(a), 0), np.sin(a)], 1), segments).scaled(x, y, z)


def tube(path, radii, segments=10, closed=False):
    p = np.asarray(path, float)
    n, segments = len(p), fine(segments, 5)
    r = np.broadcast_to(np.asarray(radii, float), n)
    tan = np.roll(p, -1, 0) - np.roll(p, 1, 0) if closed else np.gradient(p, axis=0)
    tan /= np.maximum(np.linalg.norm(tan, axis=1, keepdims=True), 1e-9)
    side = np.cross(tan[0], [0.3, 0.9, 0.31])
    sides = []
    for t in tan:
        side = side - t * (side @ t)
        side /= max(np.linalg.norm(side), 1e-9)
        sides.append(side)
    up = np.cross(tan, sides)
    ring = [(p[i], sides[i], up[i], r[i], 0.0, tan[i]) for i in range(n)]
    if closed:
        ring.append(ring[0])
    else:
        ring = [(p[0], sides[0], up[0], 1e-5, -1.0, tan[0])] + [ring[0]] + ring[1:] \
            + [(p[-1], sides[-1], up[-1], 1e-5, 1.0, tan[-1])]
    a = 2 * np.pi * (np.arange(segments + 1) % segments) / segments
    pos, nor, uv = [], [], []
    for k, (c, s, u, rad, lean, t) in enumerate(ring):
        out = np.cos(a)[:, None] * s + np.sin(a)[:, None] * u
        pos.append(c + out * rad)
        nor.append(np.broadcast_to(t * lean, out.shape) if lean else out)
        uv.append(np.stack([np.arange(segments + 1) / segments, np.full(segments + 1, k / (len(ring) - 1))], 1))
    return grid(np.array(pos), np.array(nor), np.array(uv))


def bent(points, radius, steps=3, segments=10):
    return tube(curve(points, steps), radius, segments)


def torus(radius, thick, segments=22, around=8):
    segments = fine(segments, 8)
    a = 2 * np.pi * np.arange(segments) / segments
    return tube(np.stack([radius * np.cos(a), 0 * a, -radius * np.sin(a)], 1), thick, around, closed=True)


def box(x, y, z, bevel=0.12):
    """A box about the origin with bevelled edges; texture over each side."""
    h = np.array([x, y, z]) / 2
    b = bevel * h.min()
    meshes = []
    axes = [((1, 0, 0), (0, 0, -1), (0, 1, 0)), ((-1, 0, 0), (0, 0, 1), (0, 1, 0)), ((0, 1, 0), (1, 0, 0), (0, 0, -1)),
            ((0, -1, 0), (1, 0, 0), (0, 0, 1)), ((0, 0, 1), (1, 0, 0), (0, 1, 0)), ((0, 0, -1), (-1, 0, 0), (0, 1, 0))]
    for n, u, v in (map(np.array, a) for a in axes):
        hu, hv = h @ abs(u), h @ abs(v)
        us, vs = np.array([-hu, -hu + b, hu - b, hu]), np.array([-hv, -hv + b, hv - b, hv])
        pos = (n * (h @ abs(n)))[None, None] + us[None, :, None] * u + vs[:, None, None] * v
        core = np.clip(pos, -(h - b), h - b)
        out = pos - core
        out /= np.maximum(np.linalg.norm(out, axis=-1, keepdims=True), 1e-9)
        uv = np.stack(np.broadcast_arrays(0.5 + 0.5 * us[None] / hu, 0.5 - 0.5 * vs[:, None] / hv), -1)
        meshes.append(grid(core + out * b, out, uv))
    return total(meshes)


def pillow(outline, height, depth, fullness=3.0, segments=36, rings=6):
    """A flat pad with an outline (radius by angle), inflated above and below y = 0."""
    segments = fine(segments, 16)
    a = 2 * np.pi * (np.arange(segments + 1) % segments) / segments
    s = np.sin(np.pi / 2 * np.arange(rings + 1) / rings)[:, None]
    lift = np.maximum(1 - s ** fullness, 0) ** (1 / min(fullness, 2.5))
    r = np.array([outline(x) for x in a])[None]
    halves = []
    for tall in (height, -depth):
        pos = np.stack([r * s * np.cos(a), tall * lift + 0 * a, -r * s * np.sin(a)], -1)
        nor = np.stack([s * np.cos(a), np.sign(tall) * (0.05 + lift) + 0 * a, -s * np.sin(a)], -1)
        nor /= np.linalg.norm(nor, axis=-1, keepdims=True)
        uv = np.stack([0.5 + 0.5 * s * np.cos(a), 0.5 + 0.5 * s * np.sin(a)], -1)
        m = grid(pos, nor, uv)
        halves.append(Mesh(m.p, m.n, m.uv, m.t[:, ::-1]) if tall > 0 else m)
    return halves[0] + halves[1]
