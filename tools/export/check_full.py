"""Full-size graphs with random weights against the official modules with the same weights, and seconds per run.

    python export_clip.py ViT-B-16 --random 1 --out full --name clip
    python export_sam.py vit_b --random 1 --out full --name sam
    python export_sam2.py sam2.1-tiny --random 1 --out full --name sam2
    python check_full.py full --seed 1 [--only sam2]
"""

import argparse
import json
import time
from pathlib import Path

import numpy as np
import torch

from graphs import Graph, relative_error

TOLERANCE = 1e-4


def compare(folder, name, role, inputs, expected, threads):
    """`expected`: output name -> official tensor. The control: the first input, mirrored."""
    file = folder / f"{name}_{role}.onnx"
    graph = Graph(file, threads)
    start = time.perf_counter()
    got = graph(**inputs)
    seconds = time.perf_counter() - start
    first = next(iter(inputs))
    control = graph(**{**inputs, first: inputs[first][..., ::-1]})
    for key, value in expected.items():
        error, wrong = relative_error(got[key], value), relative_error(control[key], value)
        good = error < TOLERANCE < wrong / 10
        print(f"{'ok  ' if good else 'FAIL'} {file.name} {key}: {error:.1e} (control {wrong:.1e}), {seconds:.2f} s, {file.stat().st_size / 1e6:.0f} MB")
        if not good:
            raise SystemExit(1)
    return got


def main():
    ap = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    ap.add_argument("folder", type=Path)
    ap.add_argument("--seed", type=int, default=1)
    ap.add_argument("--threads", type=int, default=1)
    ap.add_argument("--only", nargs="*", default=["clip", "sam", "sam2"])
    a = ap.parse_args()
    rng = np.random.default_rng(0)

    def picture(side):
        return (np.kron(rng.normal(0, 1, (1, 3, 16, 16)), np.ones((1, 1, side // 16, side // 16))) + rng.normal(0, .2, (1, 3, side, side))).astype(np.float32)
    with torch.inference_mode():
        if "clip" in a.only:
            import export_clip
            m = export_clip.load("ViT-B-16", seed=a.seed)
            pixels, tokens = picture(224), np.zeros((1, 77), np.int64)
            tokens[0, :6] = [49406, 320, 1125, 539, 320, 49407]
            compare(a.folder, "clip", "image", {"pixels": pixels}, {"embedding": m.encode_image(torch.from_numpy(pixels)).numpy()}, a.threads)
            compare(a.folder, "clip", "text", {"tokens": tokens}, {"embedding": m.encode_text(torch.from_numpy(tokens)).numpy()}, a.threads)
        if "sam" in a.only:
            import sam_models
            m, image = sam_models.load("vit_b", seed=a.seed), picture(1024)
            compare(a.folder, "sam", "encoder", {"image": image}, {"image_embeddings": m.image_encoder(torch.from_numpy(image)).numpy()}, a.threads)
        if "sam2" in a.only:
            sam2(a, picture(1024), rng)


def sam2(a, image, rng):
    import sam2_models
    m = sam2_models.load("sam2.1-tiny", seed=a.seed)
    described = json.loads((a.folder / "sam2.json").read_text())
    known, side = described["memories"], described["image_size"] // 16
    out = m.forward_image(torch.from_numpy(image))
    official = dict(zip(("high_res_features1", "high_res_features2", "image_embeddings"), (v.numpy() for v in out["backbone_fpn"])))
    compare(a.folder, "sam2", "encoder", {"image": image}, official, a.threads)
    # Frame 9 of 20: a prompted frame 0 and three followed frames, so four memories and as many pointers.
    frames = {t: {"maskmem_features": torch.from_numpy(rng.normal(0, 1, (1, 64, side, side)).astype(np.float32)),
                  "obj_ptr": torch.from_numpy(rng.normal(0, 1, (1, 256)).astype(np.float32))} for t in (0, 4, 7, 8)}
    place = m.memory_encoder.position_encoding(torch.zeros(1, 64, side, side))
    for entry in frames.values():
        entry["maskmem_pos_enc"] = [place]
    known_frames = {"cond_frame_outputs": {0: frames[0]}, "non_cond_frame_outputs": {t: frames[t] for t in (4, 7, 8)}}
    _, features, positions, sizes = m._prepare_backbone_features(out)
    expected = m._prepare_memory_conditioned_features(9, False, features[-1:], positions[-1:], sizes[-1:], known_frames, 20)
    order = [0, 4, 7, 8]
    inputs = {"image_embeddings": official["image_embeddings"], "memory_features": np.concatenate([frames[t]["maskmem_features"].numpy() for t in order]),
              "memory_time": np.array([known - 1, 4, 1, 0]), "memory_valid": np.ones(4, np.float32),
              "object_pointers": np.concatenate([frames[t]["obj_ptr"].numpy() for t in order]), "pointer_offset": np.float32([9, 5, 2, 1]) / np.float32(15),
              "pointer_valid": np.ones(4, np.float32)}
    compare(a.folder, "sam2", "memory_attention", inputs, {"conditioned": expected.numpy()}, a.threads)
    logits = np.kron(rng.normal(0, 6, (1, 1, 16, 16)), np.ones((1, 1, 16, 16))).astype(np.float32)
    full = torch.nn.functional.interpolate(torch.from_numpy(logits), scale_factor=4, mode="bilinear")
    memory, _ = m._encode_new_memory(features, sizes, full, torch.full((1, 1), -1.0), False)
    compare(a.folder, "sam2", "memory_encoder", {"image_embeddings": official["image_embeddings"], "mask_logits": logits,
                                                 "object_score": np.full((1, 1), -1, np.float32), "binarise": np.zeros(1, np.float32)},
            {"memory_features": memory.numpy()}, a.threads)
    mask = (np.kron(rng.random((1, 1, 16, 16)) > .5, np.ones((1, 1, 64, 64)))).astype(np.float32)
    low = m._use_mask_as_output(torch.from_numpy(official["image_embeddings"]), [torch.from_numpy(official[f"high_res_features{k}"]) for k in (1, 2)],
                                torch.from_numpy(mask))[0]
    compare(a.folder, "sam2", "mask_prompt", {"mask": mask}, {"low_res_mask": low.numpy(), "mask_input": m.mask_downsample(torch.from_numpy(mask)).numpy()}, a.threads)
    coords, labels = np.float32([[[300, 400], [700, 200]]]), np.int32([[1, 0]])
    sparse, dense = m.sam_prompt_encoder((torch.from_numpy(coords), torch.from_numpy(labels)), None, None)
    decoder = m.sam_mask_decoder
    masks, iou, _, score = decoder.predict_masks(torch.from_numpy(official["image_embeddings"]), m.sam_prompt_encoder.get_dense_pe(), sparse, dense, False,
                                                 [torch.from_numpy(official[f"high_res_features{k}"]) for k in (1, 2)])
    compare(a.folder, "sam2", "decoder",
            {"point_coords": np.concatenate([coords, np.zeros((1, 1, 2), np.float32)], 1), "point_labels": np.float32([[1, 0, -1]]),
             "mask_input": np.zeros((1, 1, 256, 256), np.float32), "has_mask": np.zeros(1, np.float32), **official},
            {"masks": masks.numpy(), "iou": iou.numpy()}, a.threads)


if __name__ == "__main__":
    main()
