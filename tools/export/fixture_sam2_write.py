"""Writes the SAM 2 fixtures: graphs, single-picture cases, and two tracks with their prompts."""

import json

import numpy as np
import torch
from safetensors.numpy import save_file

import export_sam2
import fixture_sam
import fixture_sam2 as reference
import scenes

CORRECTION = (10, 1, "points", ([[30, 40]], [1]))


def write_image(m, out):
    """`sam2.safetensors`: as `sam.safetensors`; `NAME.single` is the official single mask, which falls back to the best of
    three where it is unstable, `NAME.masks` are the four without that."""
    predictor, picture = reference.image_predictor(m), scenes.film()[0][0]
    predictor.set_image(picture)
    f = predictor._features
    tensors = {"picture": picture, "image": predictor._transforms(picture)[None].numpy(), "image_embeddings": f["image_embed"].numpy(),
               "high_res_features1": f["high_res_feats"][0].numpy(), "high_res_features2": f["high_res_feats"][1].numpy()}
    size, side = picture.shape[:2], m.image_size

    def scale(coords, size):
        return (torch.tensor(np.asarray(coords), dtype=torch.float) / torch.tensor([size[1], size[0]]) * side).numpy()

    batch = {"points": None}
    for name, case in [*fixture_sam.CASES.items(), ("batch", batch)]:
        if case is batch:
            coords = np.concatenate([scale(fixture_sam.BATCH, size)[:, None], np.zeros((len(fixture_sam.BATCH), 1, 2), np.float32)], 1)
            labels, mask = np.tile(np.float32([1, -1]), (len(coords), 1)), None
        else:
            coords, labels = fixture_sam.graph_points(case, scale, size, pad_with_box=True)
            mask = np.clip(tensors[f"{case['mask_of']}.masks"][:, :1], -32, 32) if "mask_of" in case else None
        # The official predictor adds the empty point itself.
        arguments = (torch.from_numpy(coords[:, :-1].astype(np.float32)), torch.from_numpy(labels[:, :-1].astype(np.int32)), None,
                     None if mask is None else torch.from_numpy(mask))
        d, kept = m.sam_mask_decoder, m.sam_mask_decoder.dynamic_multimask_via_stability
        single = predictor._predict(*arguments, False, return_logits=True)
        d.dynamic_multimask_via_stability = False
        both = [predictor._predict(*arguments, three, return_logits=True) for three in (False, True)]
        d.dynamic_multimask_via_stability = kept
        tensors.update(fixture_sam.case_tensors(name, coords, labels, mask, both))
        tensors[f"{name}.single"], tensors[f"{name}.single_iou"] = single[2].numpy(), single[1].numpy()
        if name == "click":
            tensors["click.full"] = both[1][0][0].numpy()
    save_file({k: np.ascontiguousarray(v) for k, v in tensors.items()}, str(out / "sam2.safetensors"))


def tracks():
    """Name -> (prompts, correction)."""
    _, masks = scenes.film()
    return {"first": (reference.prompts(masks), None), "second": (reference.second_prompts(masks), CORRECTION)}


def write_video(m, out):
    """`sam2_video.safetensors` and `.json`. Of each pass of each track, over its frames f in order and objects o = 1, 2, 3:
    full uint8 [f,o,72*96/8] (bits of logits > 0 at the film's size, most significant first), pointer float32 [f,o,32],
    score float32 [f,o]; of the first track also logits float32 [f,o,32,32] and memory float32 [f,o,8,8,8]."""
    frames, masks = scenes.film()
    tensors, described = {"frames": frames}, {"image_size": m.image_size, "tracks": {}}
    with reference.as_folder(frames) as folder, torch.inference_mode():
        state = m.init_state(folder)
        # What the official loader made of the first frame, before it was normalised: whole numbers / 255.
        mean, std = torch.tensor([0.485, 0.456, 0.406])[:, None, None], torch.tensor([0.229, 0.224, 0.225])[:, None, None]
        tensors["resized0"] = (255 * (state["images"][0] * std + mean)).round().to(torch.uint8).permute(1, 2, 0).numpy().copy()
        features = m.forward_image(state["images"][:1])["backbone_fpn"]
        for name, value in zip(("high_res_features1", "high_res_features2", "image_embeddings"), features):
            tensors[f"frame0.{name}"] = value.numpy().copy()
    for name, (given, correction) in tracks().items():
        steps = []
        kept = m._prepare_memory_conditioned_features

        def watched(frame_idx, is_init_cond_frame, **more):
            value = kept(frame_idx=frame_idx, is_init_cond_frame=is_init_cond_frame, **more)
            if not is_init_cond_frame:
                steps.append((frame_idx, value[0].numpy().copy()))
            return value
        m._prepare_memory_conditioned_features = watched
        results = reference.official_track(m, frames, given, correction)
        m._prepare_memory_conditioned_features = kept
        if name == "first":
            # The intermediate step of three frames: embeddings after memory attention, objects 1, 2, 3.
            for frame in (4, 8, 11):
                tensors[f"first.conditioned{frame}"] = np.stack([v for t, v in steps if t == frame][:3])
        entry = {"prompts": [describe(tensors, f"{name}.prompt{k}", p) for k, p in enumerate(given)], "passes": {}}
        if correction is not None:
            entry["correction"] = describe(tensors, f"{name}.correction", correction)
        for label, found in results.items():
            order = list(found)
            entry["passes"][label] = order

            def stack(key):
                return np.stack([[found[t][k][key] for k in (1, 2, 3)] for t in order])
            full = stack("full") > 0
            tensors[f"{name}.{label}.pointer"] = stack("pointer")
            tensors[f"{name}.{label}.score"] = stack("score").astype(np.float32)
            tensors[f"{name}.{label}.full"] = np.packbits(full.reshape(*full.shape[:2], -1), axis=-1)
            if name == "first":
                tensors[f"{name}.{label}.logits"], tensors[f"{name}.{label}.memory"] = stack("logits"), stack("memory")
            print(f"track {name}, {label}: {len(order)} frames, share of the picture {full.mean((2, 3)).min():.2f} ... {full.mean((2, 3)).max():.2f}, "
                  f"absent {(stack('score') <= 0).mean():.2f}")
        described["tracks"][name] = entry
    save_file({k: np.ascontiguousarray(v) for k, v in tensors.items()}, str(out / "sam2_video.safetensors"))
    (out / "sam2_video.json").write_text(json.dumps(described, indent=1) + "\n")


def describe(tensors, key, prompt):
    frame, name, kind, value = prompt
    entry = {"frame": frame, "object": name}
    if kind == "mask":
        tensors[key] = value.astype(np.uint8)
        entry["mask"] = key
    else:
        if kind in ("box", "box+points"):
            entry["box"] = value if kind == "box" else value[0]
        if kind in ("points", "box+points"):
            entry["points"], entry["labels"] = value[-2], value[-1]
    return entry


def write(out):
    m = reference.model()
    export_sam2.write(m, out, "sam2", "sam2.1-tiny reduced")
    write_image(m, out)
    write_video(m, out)
