"""Automatic masks from stored logits, in numpy: the pattern for the program's own, checked against the official code.

README.md has the same steps in words. `answers(crop, layer)` -> logits [points,3,L,L] and IoU [points,3].
"""

import math

import cv2
import numpy as np

from tracker import bilinear


def crops(height, width, layers, overlap=512 / 1500):
    """[(box x0 y0 x1 y1, layer)]"""
    boxes = [((0, 0, width, height), 0)]
    for layer in range(1, layers + 1):
        side = 2 ** layer
        shared = int(overlap * min(height, width) * (2 / side))
        w, h = (math.ceil((shared * (side - 1) + size) / side) for size in (width, height))
        boxes += [((i * (w - shared), j * (h - shared), min(i * (w - shared) + w, width), min(j * (h - shared) + h, height)), layer)
                  for i in range(side) for j in range(side)]
    return boxes


def enlarge(kind, logits, height, width, side):
    """[L,L] -> [height,width]."""
    if kind == "sam2":
        return bilinear(logits, height, width)
    scale = side / max(height, width)
    full = bilinear(logits, side, side)[:int(height * scale + .5), :int(width * scale + .5)]
    return bilinear(full, height, width)


def box_of(mask):
    rows, columns = np.flatnonzero(mask.any(1)), np.flatnonzero(mask.any(0))
    return np.array([columns[0], rows[0], columns[-1], rows[-1]] if len(rows) else [0, 0, 0, 0], float)


def suppress(boxes, scores, threshold):
    """Indices that are kept, best first; equal scores in their order."""
    kept = []
    for i in np.argsort(-np.asarray(scores, np.float32), kind="stable"):
        def overlap(j, i=i):
            w, h = np.minimum(boxes[i][2:], boxes[j][2:]) - np.maximum(boxes[i][:2], boxes[j][:2])
            both = max(w, 0) * max(h, 0)
            total = sum((b[2] - b[0]) * (b[3] - b[1]) for b in (boxes[i], boxes[j])) - both
            return both / total if total > 0 else 0.0
        if all(not overlap(j) > threshold for j in kept):
            kept.append(i)
    return kept


def regions(mask, least, holes):
    """Holes smaller than `least` filled, or islands smaller than it removed; whether anything changed."""
    count, found, stats, _ = cv2.connectedComponentsWithStats((mask ^ holes).astype(np.uint8), connectivity=8)
    areas = stats[1:, cv2.CC_STAT_AREA]
    small = 1 + np.flatnonzero(areas < least)
    if len(small) == 0:
        return mask, False
    if holes:
        return mask | np.isin(found, small), True
    large = [i for i in range(1, count) if i not in small] or [1 + int(np.argmax(areas))]
    return np.isin(found, large), True


def clean_low(logits, most):
    """SAM 2: holes of at most `most` pixels become +10, islands -10."""
    out = logits
    for background, value in ((True, 10.0), (False, -10.0)):
        _, found, stats, _ = cv2.connectedComponentsWithStats(((logits <= 0) == background).astype(np.uint8), connectivity=8)
        out = np.where((found > 0) & (stats[found, cv2.CC_STAT_AREA] <= most), np.float32(value), out)
    return out


def masks(kind, height, width, side, points, settings, answers, offset=1.0):
    """Records in the official order: mask, box (x0 y0 x1 y1), iou, stability, point, crop."""
    least, everything = settings["min_mask_region_area"], []
    boxes = crops(height, width, settings["crop_n_layers"])
    for crop, layer in boxes:
        x0, y0, x1, y1 = crop
        h, w = y1 - y0, x1 - x0
        logits, scores = answers(crop, layer)
        found = []
        for k in range(points * points):
            at = ((k % points + .5) / points * w + x0, (k // points + .5) / points * h + y0)
            for j in range(3):
                if settings["pred_iou_thresh"] > 0 and not scores[k, j] > settings["pred_iou_thresh"]:
                    continue
                low = clean_low(logits[k, j], least) if kind == "sam2" and least > 0 else logits[k, j]
                full = enlarge(kind, low, h, w, side)
                outer = (full > -offset).sum()
                stability = (full > offset).sum() / outer if outer else np.nan
                if settings["stability_score_thresh"] > 0 and not stability >= settings["stability_score_thresh"]:
                    continue
                box = box_of(full > 0) + [x0, y0, x0, y0]
                if (np.abs(box - crop) <= 20)[np.abs(box - [0, 0, width, height]) > 20].any():
                    continue
                whole = np.zeros((height, width), bool)
                whole[y0:y1, x0:x1] = full > 0
                found.append({"mask": whole, "box": box, "iou": float(scores[k, j]), "stability": float(stability), "point": at, "crop": crop})
        keep = suppress([f["box"] for f in found], [f["iou"] for f in found], settings["box_nms_thresh"])
        everything += [found[i] for i in keep]
    if len(boxes) > 1:
        sizes = [1 / ((f["crop"][2] - f["crop"][0]) * (f["crop"][3] - f["crop"][1])) for f in everything]
        everything = [everything[i] for i in suppress([f["box"] for f in everything], sizes, settings["crop_nms_thresh"])]
    if kind == "sam" and least > 0:
        untouched = []
        for f in everything:
            f["mask"], filled = regions(f["mask"], least, True)
            f["mask"], removed = regions(f["mask"], least, False)
            f["box"] = box_of(f["mask"])
            untouched.append(float(not filled and not removed))
        threshold = max(settings["box_nms_thresh"], settings.get("crop_nms_thresh", 0.7))
        everything = [everything[i] for i in suppress([f["box"] for f in everything], untouched, threshold)]
    return everything
