"""segment-anything or MobileSAM checkpoint -> `NAME_encoder.onnx`, `NAME_decoder.onnx`, `NAME.json`.

    python export_sam.py vit_b --checkpoint sam_vit_b_01ec64.pth --out models/ --name sam-vit-b
    python export_sam.py vit_b --random 1 --out models/ --name sam-random
    python export_sam.py --reduced --random 1 --out models/ --name sam-small
"""

import argparse
from pathlib import Path

import torch
from segment_anything.modeling import image_encoder as official

import graphs
import sam_models
import two_way
from prompts import dense_position, embed_points


# Most bytes of weights in one graph: protocol buffers end at 2 GiB, so that ViT-H becomes two.
MOST_WEIGHTS = 3 << 29


class Encoder(torch.nn.Module):
    """image [1,3,S,S] (normalised, zeros right of and below the picture) -> embeddings [1,256,S/16,S/16]; or a part of it:
    the blocks from `first` to before `last`, with what comes before the first and after the last of all."""

    def __init__(self, model, first, last):
        super().__init__()
        self.encoder, self.first, self.last = model.image_encoder, first, last

    def forward(self, x):
        e = self.encoder
        if self.first == 0:
            x = e.patch_embed(x) + e.pos_embed
        for block in e.blocks[self.first:self.last]:
            x = block(x)
        return e.neck(x.permute(0, 3, 1, 2)) if self.last == len(e.blocks) else x


class TinyEncoder(torch.nn.Module):
    """The same of MobileSAM, whose official code has a side of 64 written into it."""

    def __init__(self, model):
        super().__init__()
        self.encoder = model.image_encoder

    def forward(self, x):
        e = self.encoder
        for attention in (m for m in e.modules() if hasattr(m, "attention_bias_idxs")):
            # The official code looks the biases up when evaluation begins; here the graph does.
            attention.ab = attention.attention_biases[:, attention.attention_bias_idxs]
        x = e.patch_embed(x)
        for layer in e.layers:
            x = layer(x)
        side = e.img_size // 16
        return e.neck(x.reshape(1, side, side, -1).permute(0, 3, 1, 2))


def encoders(model):
    """Role, module, input and output of the graphs that make the encoder."""
    e = model.image_encoder
    if not hasattr(e, "blocks"):
        return [("encoder", TinyEncoder(model), "image", "image_embeddings")]
    n = len(e.blocks)
    if sum(p.nbytes for p in e.parameters()) <= MOST_WEIGHTS:
        return [("encoder", Encoder(model, 0, n), "image", "image_embeddings")]
    return [("encoder", Encoder(model, 0, n // 2), "image", "hidden"), ("encoder_rest", Encoder(model, n // 2, n), "hidden", "image_embeddings")]


class Decoder(torch.nn.Module):
    """One picture, n prompts -> all four masks."""

    def __init__(self, model):
        super().__init__()
        self.prompt, self.decoder, self.side = model.prompt_encoder, model.mask_decoder, model.image_encoder.img_size

    def forward(self, image_embeddings, point_coords, point_labels, mask_input, has_mask):
        p, d = self.prompt, self.decoder
        sparse = embed_points(p, point_coords, point_labels, self.side)
        given = has_mask[:, None, None, None]
        dense = given * p.mask_downscaling(mask_input) + (1 - given) * p.no_mask_embed.weight.reshape(1, -1, 1, 1)
        own = torch.cat([d.iou_token.weight, d.mask_tokens.weight])[None]
        tokens = torch.cat([own + torch.zeros_like(sparse[:, :1, :1]), sparse], dim=1)
        hidden, source = two_way.transformer(d.transformer, image_embeddings + dense, dense_position(p), tokens)
        masks = two_way.masks(d, source, hidden[:, 1:1 + d.num_mask_tokens], self.side // 16)
        return masks, d.iou_prediction_head(hidden[:, 0])


def with_products(attention, q, rel_pos_h, rel_pos_w, q_size, k_size):
    """The official decomposed relative positions, with its two sums over channels as matrix products."""
    (h, w), c = q_size, q.shape[-1]
    rows, columns = official.get_rel_pos(h, k_size[0], rel_pos_h), official.get_rel_pos(w, k_size[1], rel_pos_w)
    at = q.reshape(-1, h, w, c)
    by_row = at @ rows.transpose(1, 2)  # [n,h,w,C] @ [h,C,k]
    by_column = (at.transpose(1, 2) @ columns.transpose(1, 2)).transpose(1, 2)
    scores = attention.reshape(-1, h, w, *k_size) + by_row[..., :, None] + by_column[..., None, :]
    return scores.reshape(-1, h * w, k_size[0] * k_size[1])


def write(model, out, name, architecture, source=""):
    side, c = model.image_encoder.img_size, model.mask_decoder.transformer_dim
    grid = side // 16
    # Relative position tables do not depend on the picture: constants.
    kept = official.add_decomposed_rel_pos
    official.add_decomposed_rel_pos = with_products
    files, x = {}, torch.zeros(1, 3, side, side)
    try:
        for role, module, given, result in encoders(model):
            files[role] = graphs.export(module, {given: x}, [result], out / f"{name}_{role}.onnx")
            x = torch.zeros(1, grid, grid, model.image_encoder.patch_embed.proj.out_channels) if result == "hidden" else None
    finally:
        official.add_decomposed_rel_pos = kept
    n = {0: "n"}
    files["decoder"] = graphs.export(
        Decoder(model), {"image_embeddings": torch.zeros(1, c, grid, grid), "point_coords": torch.zeros(2, 3, 2), "point_labels": torch.ones(2, 3),
                         "mask_input": torch.zeros(2, 1, 4 * grid, 4 * grid), "has_mask": torch.zeros(2)},
        ["masks", "iou"], out / f"{name}_decoder.onnx",
        {"point_coords": {0: "n", 1: "p"}, "point_labels": {0: "n", 1: "p"}, "mask_input": n, "has_mask": n, "masks": n, "iou": n})
    graphs.save_metadata(out / f"{name}.json", files, kind="sam", name=name, architecture=architecture, source=source, image_size=side,
                         mean=[m / 255 for m in sam_models.MEAN], std=[s / 255 for s in sam_models.STD], mean_255=sam_models.MEAN,
                         std_255=sam_models.STD, embed_dim=c, mask_threshold=model.mask_threshold,
                         # Made for small machines: the program asks it sparingly.
                         small=not hasattr(model.image_encoder, "blocks"))
    return files


def main():
    ap = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    ap.add_argument("model", nargs="?", default="vit_b", choices=["vit_b", "vit_l", "vit_h", "vit_t"], help="vit_t is MobileSAM")
    ap.add_argument("--checkpoint", type=Path)
    ap.add_argument("--random", type=int, metavar="SEED", help="random weights")
    ap.add_argument("--reduced", action="store_true", help="a tiny architecture, for tests")
    ap.add_argument("--out", type=Path, required=True)
    ap.add_argument("--name", required=True)
    ap.add_argument("--source", default="", help="where the checkpoint is from, for the metadata")
    a = ap.parse_args()
    if (a.checkpoint is None) == (a.random is None):
        ap.error("give either --checkpoint or --random")
    model = sam_models.load(a.model, str(a.checkpoint) if a.checkpoint else None, a.random, a.reduced)
    write(model, a.out, a.name, a.model + (" reduced" if a.reduced else ""), a.source)


if __name__ == "__main__":
    main()
