"""SAM fixtures, and decoder fixtures of SAM 2: official results on a single picture."""

import numpy as np
import torch
from safetensors.numpy import save_file
from segment_anything import SamPredictor

import export_sam
import sam_models
import scenes
import weights

SEED = 3

# Prompts in pixels of the picture (96 x 72): several points, one click, a box, a box with a point inside,
# and a click that refines the mask found by the first one. `batch`: five prompts of one point each.
CASES = {
    "points": {"points": [[18, 24], [40, 20], [70, 50]], "labels": [1, 0, 1]},
    "click": {"points": [[68, 50]], "labels": [1]},
    "box": {"box": [4, 8, 36, 40]},
    "box_points": {"box": [50, 30, 90, 66], "points": [[66, 48], [85, 60]], "labels": [1, 0]},
    "refined": {"points": [[20, 26]], "labels": [1], "mask_of": "click"},
}
BATCH = [[10, 10], [30, 60], [48, 36], [70, 50], [90, 5]]


def model():
    m = sam_models.load(seed=SEED, small=True)
    frames, _ = scenes.film()
    predictor = SamPredictor(m)

    def run():
        for t in (0, 6):
            predictor.set_image(frames[t])
            for y in range(8, 72, 16):
                for x in range(8, 96, 16):
                    predictor.predict(np.array([[x, y]], np.float32), np.array([1]))
    weights.calibrate_decoder(m.mask_decoder, run)
    return m


def write(out):
    m = model()
    export_sam.write(m, out, "sam", "vit reduced")
    predictor, picture = SamPredictor(m), scenes.film()[0][0]
    predictor.set_image(picture)
    # `resized`: after Pillow's bilinear filter; then normalised, then zeros to the right and below.
    tensors = {"picture": picture, "resized": predictor.transform.apply_image(picture),
               "image_embeddings": predictor.get_image_embedding().numpy()}
    size = picture.shape[:2]
    for name, case in CASES.items():
        coords, labels = graph_points(case, predictor.transform.apply_coords, size, pad_with_box=False)
        mask = tensors[f"{case['mask_of']}.masks"][:, :1] if "mask_of" in case else None
        given = {"coords": None, "labels": None, "box": None}
        if "points" in case:
            given["coords"] = torch.as_tensor(predictor.transform.apply_coords(np.array(case["points"], float), size), dtype=torch.float)[None]
            given["labels"] = torch.as_tensor(case["labels"], dtype=torch.int)[None]
        if "box" in case:
            given["box"] = torch.as_tensor(predictor.transform.apply_boxes(np.array(case["box"], float), size), dtype=torch.float)
        both = [predictor.predict_torch(given["coords"], given["labels"], given["box"], None if mask is None else torch.from_numpy(mask), three,
                                        return_logits=True) for three in (False, True)]
        tensors.update(case_tensors(name, coords, labels, mask, both))
        if name == "click":
            tensors["click.full"] = both[1][0][0].numpy()
    batch = torch.as_tensor(predictor.transform.apply_coords(np.array(BATCH, float)[:, None], size), dtype=torch.float)
    both = [predictor.predict_torch(batch, torch.ones(len(BATCH), 1), None, None, three, return_logits=True) for three in (False, True)]
    coords = np.concatenate([batch.numpy(), np.zeros((len(BATCH), 1, 2), np.float32)], 1)
    tensors.update(case_tensors("batch", coords, np.tile(np.float32([1, -1]), (len(BATCH), 1)), None, both))
    save_file({k: np.ascontiguousarray(v) for k, v in tensors.items()}, str(out / "sam.safetensors"))


def graph_points(case, scale, size, pad_with_box):
    """What the decoder graph takes for a case. SAM: points, an empty point unless there is a box, then the
    box's corners. SAM 2: the box's corners, points, always an empty point."""
    coords = np.array(case.get("points", np.zeros((0, 2))), float).reshape(-1, 2)
    labels, box = list(case.get("labels", [])), np.array(case["box"], float).reshape(2, 2) if "box" in case else np.zeros((0, 2))
    corners = [2, 3][:len(box)]
    if pad_with_box:
        coords, labels = np.concatenate([scale(np.concatenate([box, coords]), size), [[0, 0]]]), corners + labels + [-1]
    elif len(box):
        coords, labels = scale(np.concatenate([coords, box]), size), labels + corners
    else:
        coords, labels = np.concatenate([scale(coords, size), [[0, 0]]]), labels + [-1]
    return coords[None].astype(np.float32), np.array([labels], np.float32)


def case_tensors(name, coords, labels, mask, both):
    """`both`: official results (full size, IoU, low resolution) for one mask and for three; the graph gives all four."""
    found = {f"{name}.coords": coords, f"{name}.labels": labels,
             f"{name}.masks": np.concatenate([b[2].numpy() for b in both], 1), f"{name}.iou": np.concatenate([b[1].numpy() for b in both], 1)}
    if mask is not None:
        found[f"{name}.mask_input"] = mask
    return found
