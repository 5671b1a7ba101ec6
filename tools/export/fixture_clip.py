"""CLIP fixtures: tokens, prepared pictures, embeddings, all by OpenCLIP itself."""

import json

import ftfy
import numpy as np
import open_clip
import torch
from open_clip.tokenizer import basic_clean
from PIL import Image
from safetensors.numpy import save_file

import awkward
import export_clip
import scenes

SEED = 1


def class_names(files):
    """Class names, one a line; of a table `id,name,corrected name` the last column."""
    names = []
    for file in files:
        for line in file.read_text(encoding="utf-8").splitlines():
            names.append(line.split(",")[-1] if file.suffix == ".csv" else line)
    return [n for n in names if n]


def write_tokens(out, name_files):
    """`clip_tokens.json`: the texts, in order names then awkward. `clip_tokens.safetensors`: `ids` uint16, the
    rows up to and with the end token one after another, `ends` uint32, where each row stops."""
    tokeniser = open_clip.get_tokenizer("ViT-B-16")
    names, strange = class_names(name_files), awkward.strings()
    rows = tokeniser(names + strange).numpy()
    ids, ends = [], []
    for row in rows:
        # A text may name the end token itself, so the row ends at the last one; the padding is 0.
        length = int(np.nonzero(row)[0].max()) + 1
        ids.append(row[:length].astype(np.uint16))
        ends.append(length + (ends[-1] if ends else 0))
    save_file({"ids": np.concatenate(ids), "ends": np.array(ends, np.uint32)}, str(out / "clip_tokens.safetensors"))
    described = [{"text": t, "cleaned": basic_clean(t), "repaired": ftfy.fix_text(t) != t} for t in strange]
    (out / "clip_tokens.json").write_text(json.dumps({"context": 77, "start": 49406, "end": 49407, "names": names, "awkward": described},
                                                     ensure_ascii=True, indent=0) + "\n")
    return rows, names, strange


def pictures():
    """uint8 [H,W,3] of odd sizes: wide, high, tiny, smaller than the model's side, and already right."""
    frames, _ = scenes.film()
    rng = np.random.default_rng(4)
    return [frames[0][:57, :], frames[5][:, :41], frames[2][20:25, 30:37], np.kron(frames[9][:20, :31], np.ones((6, 6, 1), np.uint8)),
            rng.integers(0, 256, (64, 64, 3)).astype(np.uint8)]


def model():
    return export_clip.load(seed=SEED, reduced=True)


def prepare(m, picture):
    settings = export_clip.image_settings(m)
    transform = open_clip.transform.image_transform_v2(open_clip.transform.PreprocessCfg(
        size=tuple(settings["image_size"]), mean=tuple(settings["mean"]), std=tuple(settings["std"]), interpolation=settings["interpolation"],
        resize_mode=settings["resize_mode"]), is_train=False)
    return transform(Image.fromarray(picture)).numpy()


def token_rows(m):
    rng, rows = np.random.default_rng(6), np.zeros((6, m.context_length), np.int64)
    for k, length in enumerate((0, 1, 7, 30, 74, 75)):
        rows[k, 0], rows[k, 1 + length] = 1022, 1023
        rows[k, 1:1 + length] = rng.integers(0, 1022, length)
    return rows


def write_networks(out):
    m = model()
    export_clip.write(m, out, "clip")
    tensors = {}
    for k, picture in enumerate(pictures()):
        tensors[f"picture{k}"], tensors[f"pixels{k}"] = picture, prepare(m, picture)
    tokens = token_rows(m)
    with torch.no_grad():
        pixels = np.stack([tensors[f"pixels{k}"] for k in range(len(pictures()))])
        tensors["image_embedding"] = m.encode_image(torch.from_numpy(pixels)).numpy()
        tensors["text_embedding"] = m.encode_text(torch.from_numpy(tokens)).numpy()
    tensors["tokens"] = tokens
    save_file({k: np.ascontiguousarray(v) for k, v in tensors.items()}, str(out / "clip.safetensors"))
