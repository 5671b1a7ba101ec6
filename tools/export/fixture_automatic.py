"""Automatic masks: what the official generators of SAM and SAM 2 keep of the same stored logits.

The networks are taken out: in their place stands a store of low-resolution logits, one answer for every
point of every crop. Everything after it (enlarging, scores, thresholds, boxes, suppression, crop edges,
small regions) is the official code.
"""

import json

import numpy as np
import torch
from safetensors.numpy import save_file
from sam2.automatic_mask_generator import SAM2AutomaticMaskGenerator
from segment_anything import SamAutomaticMaskGenerator

import fixture_sam2
import sam_models

HEIGHT, WIDTH, SIDE, LOW = 180, 240, 128, 32
POINTS = 4  # a side
# A logit is (stored int8 + 0.37) * 0.125: between two pixels nothing then adds up to exactly 0 or 1, where the
# last bit of a sum would decide.
STEP, SHIFT = 0.125, 0.37

SETTINGS = {
    # The thresholds of LangSplat, one crop layer, small regions cleaned.
    "crops": {"pred_iou_thresh": 0.7, "stability_score_thresh": 0.85, "box_nms_thresh": 0.7, "crop_n_layers": 1, "crop_nms_thresh": 0.7,
              "crop_n_points_downscale_factor": 1, "min_mask_region_area": 100},
    # The whole picture only, and nothing cleaned.
    "plain": {"pred_iou_thresh": 0.75, "stability_score_thresh": 0.8, "box_nms_thresh": 0.6, "crop_n_layers": 0, "min_mask_region_area": 0},
    # Little is refused by score, so that suppression and crop edges decide.
    "loose": {"pred_iou_thresh": 0.0, "stability_score_thresh": 0.5, "box_nms_thresh": 0.5, "crop_n_layers": 1, "crop_nms_thresh": 0.5,
              "crop_n_points_downscale_factor": 1, "min_mask_region_area": 30},
}


# SAM 2 cleans at low resolution (32 x 32 here), so its areas are in those pixels.
SAM2_AREA = {"crops": 6, "plain": 0, "loose": 3}


def objects(seed=9):
    """Things on a 240 x 180 picture as functions of x, y: positive inside, about linear across the edge."""
    rng, things = np.random.default_rng(seed), []
    for _ in range(14):
        cx, cy, a, b, turn = rng.uniform(20, 220), rng.uniform(20, 160), rng.uniform(18, 55), rng.uniform(16, 45), rng.uniform(0, 3.14)

        def inside(x, y, cx=cx, cy=cy, a=a, b=b, turn=turn):
            u, v = (x - cx) * np.cos(turn) + (y - cy) * np.sin(turn), -(x - cx) * np.sin(turn) + (y - cy) * np.cos(turn)
            return (1 - np.hypot(u / a, v / b)) * 40
        things.append(inside)
    return things


def crops():
    from segment_anything.utils.amg import generate_crop_boxes
    boxes, _ = generate_crop_boxes((HEIGHT, WIDTH), 1, 512 / 1500)
    return boxes


def logits(square):
    """int8 [crops, points, 3, 32, 32] and IoU float32 [crops, points, 3]: the thing under the point in the middle
    mask, a part and a whole around it, with holes, islands and noise of their own. `square`: the model squashes
    (SAM 2) instead of scaling the longer side (SAM)."""
    from segment_anything.utils.amg import build_point_grid
    rng, things = np.random.default_rng(2), objects()
    all_logits, all_iou = [], []
    for x0, y0, x1, y1 in crops():
        w, h = x1 - x0, y1 - y0
        scale = (w / LOW, h / LOW) if square else (max(w, h) / LOW,) * 2
        gx, gy = np.meshgrid((np.arange(LOW) + .5) * scale[0] + x0, (np.arange(LOW) + .5) * scale[1] + y0)
        for px, py in build_point_grid(POINTS) * np.array([w, h]) + np.array([x0, y0]):
            values = [t(px, py) for t in things]
            hit = int(np.argmax(values))
            base = things[hit](gx, gy)
            near = np.hypot(gx - px, gy - py)
            part = np.minimum(base, (rng.uniform(10, 26) - near) * 1.5)
            whole = np.maximum(base, things[(hit + 1) % len(things)](gx, gy))
            trio, scores = [part, base, whole], rng.uniform(.55, 1.0, 3)
            if values[hit] < 0:
                scores *= .9
            for k in range(3):
                spots = rng.uniform(0, 1, 3) < .4
                if spots[0]:  # a hole
                    at = np.argwhere(trio[k] > 1)
                    if len(at):
                        y, x = at[rng.integers(len(at))]
                        trio[k] = np.where(np.hypot(*(np.indices((LOW, LOW)) - np.array([y, x])[:, None, None])) < rng.uniform(.5, 1.6), -4, trio[k])
                if spots[1]:  # an island
                    y, x = rng.integers(0, LOW, 2)
                    trio[k] = np.where(np.hypot(*(np.indices((LOW, LOW)) - np.array([y, x])[:, None, None])) < rng.uniform(.5, 2.0), 5, trio[k])
                if spots[2]:  # a soft edge, so that stability differs
                    trio[k] = trio[k] * rng.uniform(.1, .8)
            all_logits.append([np.clip(np.round(t / STEP), -127, 127) for t in trio])
            all_iou.append(scores)
    shape = (len(crops()), POINTS * POINTS, 3)
    return np.array(all_logits, np.int8).reshape(*shape, LOW, LOW), np.array(all_iou, np.float32).reshape(shape)


class Stored:
    """Answers in the order in which the generators ask: crop by crop, batch by batch."""

    def __init__(self, values, iou):
        self.values, self.iou = torch.from_numpy((values.astype(np.float32) + np.float32(SHIFT)) * np.float32(STEP)).flatten(0, 1), torch.from_numpy(iou).flatten(0, 1)
        self.next = 0

    def take(self, count):
        part = slice(self.next, self.next + count)
        self.next += count
        return self.values[part], self.iou[part]


def sam_result(stored, settings):
    model = sam_models.load(seed=1, small=True)
    generator = SamAutomaticMaskGenerator(model, points_per_side=POINTS, points_per_batch=7, output_mode="uncompressed_rle", **settings)
    model.mask_decoder.forward = lambda **asked: stored.take(asked["sparse_prompt_embeddings"].shape[0])
    return generator.generate(np.zeros((HEIGHT, WIDTH, 3), np.uint8))


def sam2_result(stored, settings, model):
    generator = SAM2AutomaticMaskGenerator(model, points_per_side=POINTS, points_per_batch=7, output_mode="uncompressed_rle", **settings)
    generator.predictor._bb_feat_sizes = [(model.image_size // k,) * 2 for k in (4, 8, 16)]
    decoder = model.sam_mask_decoder
    decoder.forward = lambda **asked: (*stored.take(asked["sparse_prompt_embeddings"].shape[0]), None, None)
    try:
        return generator.generate(np.zeros((HEIGHT, WIDTH, 3), np.uint8))
    finally:
        del decoder.forward


def plain(results):
    return [{"counts": r["segmentation"]["counts"], "area": int(r["area"]), "bbox": [float(v) for v in r["bbox"]],
             "predicted_iou": r["predicted_iou"], "stability_score": r["stability_score"], "point": [float(v) for v in r["point_coords"][0]],
             "crop_box": [float(v) for v in r["crop_box"]]} for r in results]


def write(out):
    tensors, described = {}, {"height": HEIGHT, "width": WIDTH, "side": SIDE, "points_per_side": POINTS, "step": STEP, "shift": SHIFT,
                              "crop_boxes": crops(), "settings": SETTINGS, "sam2_min_mask_region_area": SAM2_AREA, "results": {"sam": {}, "sam2": {}}}
    model = fixture_sam2.model()
    for kind, square in (("sam", False), ("sam2", True)):
        values, iou = logits(square)
        tensors[f"{kind}.logits"], tensors[f"{kind}.iou"] = values, iou
        for name, settings in SETTINGS.items():
            count = 1 if settings["crop_n_layers"] == 0 else len(values)
            stored = Stored(values[:count], iou[:count])
            if kind == "sam2":
                settings = {**settings, "min_mask_region_area": SAM2_AREA[name]}
            results = sam_result(stored, settings) if kind == "sam" else sam2_result(stored, settings, model)
            described["results"][kind][name] = plain(results)
            print(f"automatic masks, {kind}, {name}: {len(results)} of {3 * count * POINTS ** 2} kept")
    save_file(tensors, str(out / "automatic.safetensors"))
    (out / "automatic.json").write_text(json.dumps(described, separators=(",", ":")) + "\n")
