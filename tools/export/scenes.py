"""A tiny film for the tracker's tests: shapes that move over a textured ground."""

import numpy as np

FRAMES, HEIGHT, WIDTH = 12, 72, 96


def film(seed=5):
    """uint8 [12,72,96,3] and the shapes' masks bool [12,3,72,96]. The third shape is hidden behind
    a bar for some frames."""
    rng = np.random.default_rng(seed)
    y, x = np.mgrid[0:HEIGHT, 0:WIDTH].astype(np.float64)
    ground = sum(rng.uniform(10, 25) * np.sin(rng.uniform(.05, .35) * x + rng.uniform(.05, .35) * y + rng.uniform(0, 6))[..., None]
                 * rng.uniform(.3, 1, 3) for _ in range(6)) + 110
    frames, masks = [], []
    for t in range(FRAMES):
        disc = (x - 20 - 4.2 * t) ** 2 + (y - 24 - 6 * np.sin(t / 3)) ** 2 < 13 ** 2
        turn = .12 * t
        u, v = (x - 68 + 2.5 * t) * np.cos(turn) + (y - 50) * np.sin(turn), -(x - 68 + 2.5 * t) * np.sin(turn) + (y - 50) * np.cos(turn)
        box = np.maximum(abs(u), abs(v)) < 11
        wedge = (y > 8 + t) & (y < 30 + t) & (abs(x - 82 + 5 * t) < (y - 8 - t) * .55)
        bar = (x > 36) & (x < 52)
        frame = ground + 3 * t
        for shape, colour in ((wedge, (30, 90, 220)), (bar & (t > 4), (60, 60, 60)), (box, (225, 200, 40)), (disc, (210, 50, 60))):
            shade = 1 + .18 * np.sin(.5 * x + .3 * y)[..., None]
            frame = np.where(shape[..., None], np.array(colour) * shade, frame)
        frames.append(np.clip(frame + rng.normal(0, 4, frame.shape), 0, 255).astype(np.uint8))
        masks.append([disc, box & ~disc, wedge & ~(bar & (t > 4)) & ~box & ~disc])
    return np.array(frames), np.array(masks)
