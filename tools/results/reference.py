"""Plain NumPy reference in f64: splatting of any channels, and relevancy.

It follows the renderer on the CPU (`src/render/cpu`): tangents clamped to 1.3 times the picture's half extent, 0.3 px²
added to both axes of the covariance, alpha = min(0.999, opacity exp(-q / 2)) counted from 1/255 on, front to back by the
depth of the centers, a pixel closed before the splat that would bring its transmittance under 1e-4, pixel centers at
half pixels, background 0. Tiles are not needed: a splat outside of its tiles has an alpha below 1/255 there.
"""

import numpy as np

from scene import FOCAL, HEIGHT, WIDTH

ALPHA_MIN, ALPHA_MAX, LEAST, BLUR, CLAMP, NEAR = 1 / 255, 0.999, 1e-4, 0.3, 1.3, 0.01


def rotations(quaternions):
    """Matrices of quaternions w x y z of any length."""
    w, x, y, z = (quaternions / np.linalg.norm(quaternions, axis=1, keepdims=True)).T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.array(rows).transpose(2, 0, 1)


def weights(camera, xyz, log_scale, rotation, opacity):
    """Blending weight of each Gaussian at each pixel, [H, W, N]; `opacity` are logits."""
    world_from_camera, center = camera
    xyz, log_scale, rotation = (np.asarray(a, np.float64) for a in (xyz, log_scale, rotation))
    opacity = 1 / (1 + np.exp(-np.asarray(opacity, np.float64).reshape(-1)))
    axes = world_from_camera.T
    local = (xyz - center) @ axes.T
    z = local[:, 2]
    jacobian = np.empty((len(xyz), 2, 3))
    for axis, size in enumerate((WIDTH, HEIGHT)):
        limit = CLAMP * size * 0.5 / FOCAL
        tangent = np.clip(local[:, axis] / z, -limit, limit)
        jacobian[:, axis] = (FOCAL / z)[:, None] * (axes[axis] - tangent[:, None] * axes[2])
    factor = jacobian @ rotations(rotation) * np.exp(log_scale)[:, None, :]
    covariance = factor @ factor.transpose(0, 2, 1) + BLUR * np.eye(2)
    conic = np.linalg.inv(covariance)
    mean = FOCAL * local[:, :2] / z[:, None] + np.array([WIDTH, HEIGHT]) / 2
    order = [i for i in np.argsort(z, kind="stable") if z[i] > NEAR]
    out = np.zeros((HEIGHT, WIDTH, len(xyz)))
    for row in range(HEIGHT):
        for column in range(WIDTH):
            left = 1.0
            for i in order:
                d = np.array([column + 0.5, row + 0.5]) - mean[i]
                alpha = min(ALPHA_MAX, opacity[i] * np.exp(-0.5 * d @ conic[i] @ d))
                if alpha < ALPHA_MIN:
                    continue
                if left * (1 - alpha) < LEAST:
                    break
                out[row, column, i] = alpha * left
                left *= 1 - alpha
    return out


def unit(rows, floor=0.0):
    """Rows divided by their length; rows of length 0 stay."""
    rows = np.asarray(rows, np.float64)
    length = np.linalg.norm(rows, axis=-1, keepdims=True) + floor
    return np.divide(rows, length, out=np.zeros_like(rows), where=length > 0)


def cosines(rows, texts):
    """Cosines of rows with each text."""
    return unit(rows) @ unit(texts).T


def relevancy(rows, texts, temperature=10.0):
    """LERF's relevancy of the first text against the others, the canonicals; 0 for rows of length 0."""
    found = cosines(rows, texts) * temperature
    against = np.exp(found[..., 1:] - found[..., :1])
    value = (1 / (1 + against)).min(axis=-1)
    return np.where(np.linalg.norm(rows, axis=-1) > 0, value, 0.0)


def softmax(rows):
    """Softmax over the last axis."""
    rows = np.exp(rows - rows.max(axis=-1, keepdims=True))
    return rows / rows.sum(axis=-1, keepdims=True)
