"""SAM 2 fixtures: the official predictor's results with reduced, seeded networks."""

import contextlib
import tempfile
from pathlib import Path

import numpy as np
import torch
from PIL import Image
from sam2.sam2_image_predictor import SAM2ImagePredictor

import sam2_models
import scenes
import weights

SEED = 13
SEED_FRAME = 3


def model(seed=SEED, name="sam2.1-tiny"):
    """The reduced predictor with calibrated last layers."""
    m = sam2_models.load(name, seed=seed, reduced=True)
    frames, masks = scenes.film()
    # Sharper attention to memories and stronger answers to them, so that what is remembered shows.
    with torch.no_grad():
        for layer in m.memory_attention.layers:
            layer.cross_attn_image.q_proj.weight.mul_(2.0)
            layer.cross_attn_image.k_proj.weight.mul_(2.0)
            layer.cross_attn_image.out_proj.weight.mul_(2.0)

    def run():
        official_track(m, frames, prompts(masks))
    weights.calibrate_decoder(m.sam_mask_decoder, run)
    return m


def image_predictor(m):
    predictor = SAM2ImagePredictor(m)
    # The official class has the sizes of side 1024 written into it.
    predictor._bb_feat_sizes = [(m.image_size // k,) * 2 for k in (4, 8, 16)]
    return predictor


@contextlib.contextmanager
def as_folder(frames):
    """Frames as the folder that the official loader reads. Lossless files under its names: it looks at
    the name to find them and at the content to decode them."""
    with tempfile.TemporaryDirectory() as folder:
        for t, frame in enumerate(frames):
            Image.fromarray(frame).save(Path(folder) / f"{t:05d}.jpg", format="PNG")
        yield folder


# Prompts: (frame, object, kind, values), in pixels of the film.
def prompts(masks):
    return [(SEED_FRAME, 1, "points", ([[32, 30], [60, 60]], [1, 0])),
            (SEED_FRAME, 2, "box", [48, 38, 72, 62]),
            (SEED_FRAME, 3, "mask", masks[SEED_FRAME][2])]


def second_prompts(masks):
    """One click (three candidate masks), a second conditioning frame, and an object that starts later."""
    return [(2, 1, "points", ([[28, 28]], [1])),
            (8, 1, "points", ([[54, 26], [80, 60]], [1, 0])),
            (6, 2, "mask", masks[6][1]),
            (2, 3, "box+points", ([58, 12, 84, 34], [[70, 24]], [1]))]


def official_add(m, state, prompt):
    frame, name, kind, value = prompt
    if kind == "points":
        return m.add_new_points_or_box(state, frame, name, points=value[0], labels=value[1])
    if kind == "box":
        return m.add_new_points_or_box(state, frame, name, box=value)
    if kind == "box+points":
        return m.add_new_points_or_box(state, frame, name, box=value[0], points=value[1], labels=value[2])
    return m.add_new_mask(state, frame, name, value)


def tracker_add(tracker, prompt):
    frame, name, kind, value = prompt
    if kind == "points":
        tracker.add_points(frame, name, *value)
    elif kind == "box":
        tracker.add_points(frame, name, box=value)
    elif kind == "box+points":
        tracker.add_points(frame, name, value[1], value[2], box=value[0])
    else:
        tracker.add_mask(frame, name, value)


def official_track(m, frames, given, correction=None):
    """{direction: {frame: {object: dict of arrays}}} from the official predictor, forward then reverse;
    with `correction`, one more prompt on a tracked frame and a third pass, forward again."""
    with as_folder(frames) as folder, torch.inference_mode():
        state = m.init_state(folder)
        for prompt in given:
            official_add(m, state, prompt)
        passes = [("forward", False), ("reverse", True)]
        results = {label: collect(m, state, reverse) for label, reverse in passes}
        if correction is not None:
            official_add(m, state, correction)
            results["corrected"] = collect(m, state, False)
    return results


def collect(m, state, reverse):
    found = {}
    for frame, names, full in m.propagate_in_video(state, reverse=reverse):
        found[frame] = {}
        for k, name in enumerate(names):
            per = state["output_dict_per_obj"][k]
            out = per["cond_frame_outputs"].get(frame) or per["non_cond_frame_outputs"][frame]
            found[frame][name] = {"logits": out["pred_masks"][0, 0].numpy().copy(), "full": full[k, 0].numpy().copy(),
                                  "pointer": out["obj_ptr"][0].numpy().copy(), "score": float(out["object_score_logits"]),
                                  "memory": out["maskmem_features"][0].float().numpy().copy()}
    return found


def tracker_track(tracker, frames, given, correction=None, **control):
    tracker.open(list(frames))
    for prompt in given:
        tracker_add(tracker, prompt)
    results = {}
    passes = [("forward", False), ("reverse", True)]
    for label, reverse in passes:
        results[label] = follow(tracker, reverse, **control)
    if correction is not None:
        tracker_add(tracker, correction)
        results["corrected"] = follow(tracker, False, **control)
    return results


def follow(tracker, reverse, **control):
    return {frame: {name: {"logits": o.logits[0, 0], "full": tracker.full_size(o.logits), "pointer": o.pointer[0], "score": float(o.score[0, 0]),
                           "memory": o.memory[0]} for name, o in found.items()}
            for frame, found in tracker.run(reverse, **control)}
