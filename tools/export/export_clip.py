"""OpenCLIP checkpoint -> `NAME_image.onnx`, `NAME_text.onnx`, `NAME.json`.

    python export_clip.py ViT-B-16 --checkpoint open_clip_pytorch_model.bin --out models/ --name clip-vit-b16
    python export_clip.py ViT-B-16 --random 1 --out models/ --name clip-random
    python export_clip.py --reduced --random 1 --out models/ --name clip-small

Image graph: `pixels` float32 [n,3,S,S] -> `embedding` float32 [n,D]; text graph: `tokens` int64 [n,T]
-> `embedding` float32 [n,D]. Embeddings are raw: the caller scales them to unit length.
"""

import argparse
from pathlib import Path

import open_clip
import torch
import torch.nn.functional as F
from open_clip import model as open_clip_model
from open_clip import transformer as open_clip_transformer

import graphs
import weights

# A ViT and a text transformer of 1/500 of ViT-B/16. The small vocabulary keeps the table of a
# committed graph small; its last id still ends a text.
REDUCED = {
    "embed_dim": 32,
    "vision_cfg": {"image_size": 64, "layers": 2, "width": 32, "head_width": 16, "patch_size": 16},
    "text_cfg": {"context_length": 77, "vocab_size": 1024, "width": 32, "heads": 2, "layers": 2},
}


class Image(torch.nn.Module):
    def __init__(self, model):
        super().__init__()
        self.model = model

    def forward(self, pixels):
        return self.model.encode_image(pixels)


class Text(torch.nn.Module):
    def __init__(self, model):
        super().__init__()
        self.model = model

    def forward(self, tokens):
        return self.model.encode_text(tokens)


class TextOfAnyLength(torch.nn.Module):
    """The same of rows that may end after the end token: the official steps, positions and mask cut to them."""

    def __init__(self, model):
        super().__init__()
        self.model = model

    def forward(self, tokens):
        t, m = tokens.shape[1], self.model
        x = m.token_embedding(tokens) + m.positional_embedding[:t]
        x = m.ln_final(m.transformer(x, attn_mask=m.attn_mask[:t, :t]))
        x = open_clip_model.text_global_pool(x, tokens, "argmax")
        return m.text_projection(x) if isinstance(m.text_projection, torch.nn.Linear) else x @ m.text_projection


def attention_of_any_length(self, query, key, value, need_weights=False, attn_mask=None, **more):
    """The official self-attention of rows of one batch, written so that no length becomes fixed when it is exported."""
    n, t, width = query.shape
    each = F.linear(query, self.in_proj_weight, self.in_proj_bias).reshape(n, t, 3 * self.num_heads, self.head_dim).transpose(1, 2)
    q, k, v = each.chunk(3, 1)
    weights = torch.softmax(q @ k.transpose(2, 3) * self.head_dim ** -.5 + attn_mask, -1)
    return self.out_proj((weights @ v).transpose(1, 2).reshape(n, t, width)), None


def may_be_cut(model):
    """Whether a token sees those before it alone, and the end token's row is the result."""
    return getattr(model, "text_pool_type", None) == "argmax" and model.attn_mask is not None and model.text_projection is not None


def pool_by_one_hot(pool):
    """The official pooling of text features, with the row of the end token taken by a product with
    zeros and one 1 (the same value) instead of by indices, which small engines do not gather by."""
    def pooled(x, text=None, pool_type="argmax", **more):
        if pool_type != "argmax":
            return pool(x, text, pool_type, **more)
        at = text.argmax(dim=-1)
        hot = (torch.arange(x.shape[1])[None] == at[:, None]).to(x.dtype)
        return (x * hot[:, :, None]).sum(1)
    return pooled


def load(name=None, checkpoint=None, seed=None, reduced=False):
    """The official model, its image settings, and its tokeniser's kind."""
    if reduced:
        model = open_clip.CLIP(REDUCED["embed_dim"], REDUCED["vision_cfg"], REDUCED["text_cfg"])
    else:
        model = open_clip.create_model(name, pretrained=checkpoint, load_weights=checkpoint is not None) if checkpoint \
            else open_clip.create_model(name, pretrained=None)
    if checkpoint is None:
        weights.randomise(model, seed)
    return model.eval()


def image_settings(model):
    """How pictures are prepared: official defaults where the model states nothing else."""
    visual = model.visual
    size = visual.image_size
    stated = dict(getattr(visual, "preprocess_cfg", {}) or {})
    stated.setdefault("size", size)
    pre = open_clip.transform.PreprocessCfg(**stated)
    size = pre.size if isinstance(pre.size, (tuple, list)) else (pre.size, pre.size)
    return {"image_size": list(size), "mean": list(pre.mean), "std": list(pre.std), "interpolation": pre.interpolation,
            "resize_mode": pre.resize_mode, "fill": 0}


def tokeniser_kind(name, vocab):
    """What turns text to tokens; `clip-bpe` is the byte pair encoding of CLIP with 49,408 ids."""
    config = (open_clip.get_model_config(name) or {}) if name else {}
    text = config.get("text_cfg", {})
    if "hf_tokenizer_name" in text:
        return {"kind": "hugging-face", "source": text["hf_tokenizer_name"], "settings": text.get("tokenizer_kwargs", {})}
    return {"kind": "clip-bpe", "start": vocab - 2, "end": vocab - 1, "pad": 0, "clean": "lower", "truncate": "keep end"}


def main():
    ap = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    ap.add_argument("model", nargs="?", default="ViT-B-16", help="name of an OpenCLIP architecture")
    ap.add_argument("--checkpoint", type=Path)
    ap.add_argument("--random", type=int, metavar="SEED", help="random weights")
    ap.add_argument("--reduced", action="store_true", help="a tiny architecture, for tests")
    ap.add_argument("--out", type=Path, required=True)
    ap.add_argument("--name", required=True)
    ap.add_argument("--source", default="", help="where the checkpoint is from, for the metadata")
    a = ap.parse_args()
    if (a.checkpoint is None) == (a.random is None):
        ap.error("give either --checkpoint or --random")
    model = load(a.model, str(a.checkpoint) if a.checkpoint else None, a.random, a.reduced)
    write(model, a.out, a.name, None if a.reduced else a.model, a.source)


def write(model, out, name, architecture=None, source=""):
    settings = image_settings(model)
    context, vocab = model.context_length, getattr(model, "vocab_size", None) or model.text.vocab_size
    height, width = settings["image_size"]
    # Two of each, so that nothing of the example's size is taken for granted.
    pixels = torch.zeros(2, 3, height, width)
    tokens = torch.zeros(2, context, dtype=torch.int64)
    tokens[:, 0], tokens[0, 4], tokens[1, 9] = vocab - 2, vocab - 1, vocab - 1
    image = graphs.export(Image(model), {"pixels": pixels}, ["embedding"], out / f"{name}_image.onnx",
                          {"pixels": {0: "n"}, "embedding": {0: "n"}})
    wrapped, axes = (TextOfAnyLength(model), {0: "n", 1: "t"}) if may_be_cut(model) else (Text(model), {0: "n"})
    official, attention = open_clip_transformer.text_global_pool, torch.nn.MultiheadAttention.forward
    open_clip_transformer.text_global_pool = open_clip_model.text_global_pool = pool_by_one_hot(official)
    if 1 in axes:
        torch.nn.MultiheadAttention.forward = attention_of_any_length
    try:
        text = graphs.export(wrapped, {"tokens": tokens}, ["embedding"], out / f"{name}_text.onnx",
                             {"tokens": axes, "embedding": {0: "n"}})
    finally:
        open_clip_transformer.text_global_pool = open_clip_model.text_global_pool = official
        torch.nn.MultiheadAttention.forward = attention
    with torch.no_grad():
        dimension = model.encode_text(tokens).shape[1]
    bias = getattr(model, "logit_bias", None)
    quick = any(type(m).__name__ == "QuickGELU" for m in model.modules())
    graphs.save_metadata(out / f"{name}.json", {"image": image, "text": text}, kind="clip", name=name, architecture=architecture or "reduced",
                         source=source, embed_dim=dimension, **settings, context_length=context, vocab_size=vocab,
                         tokenizer=tokeniser_kind(architecture, vocab), activation="quick_gelu" if quick else "gelu",
                         logit_scale=float(model.logit_scale.exp()), logit_bias=None if bias is None else float(bias))


if __name__ == "__main__":
    main()
