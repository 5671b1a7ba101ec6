"""segment-anything checkpoint -> `NAME_encoder.onnx`, `NAME_decoder.onnx`, `NAME.json`.

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
from prompts import dense_position, embed_points


class Encoder(torch.nn.Module):
    """image [1,3,S,S] (normalised, zeros right of and below the picture) -> embeddings [1,256,S/16,S/16]."""

    def __init__(self, model):
        super().__init__()
        self.encoder = model.image_encoder

    def forward(self, image):
        return self.encoder(image)


class Decoder(torch.nn.Module):
    """One picture, n prompts -> all four masks."""

    def __init__(self, model):
        super().__init__()
        self.prompt, self.decoder, self.side = model.prompt_encoder, model.mask_decoder, model.image_encoder.img_size
        # Of the weights: in a template the graph computes it.
        self.register_buffer("dense_position", model.prompt_encoder.get_dense_pe().detach() if graphs.FOLD else None)

    def forward(self, image_embeddings, point_coords, point_labels, mask_input, has_mask):
        p, d = self.prompt, self.decoder
        sparse = embed_points(p, point_coords, point_labels, self.side)
        given = has_mask[:, None, None, None]
        dense = given * p.mask_downscaling(mask_input) + (1 - given) * p.no_mask_embed.weight.reshape(1, -1, 1, 1)
        own = torch.cat([d.iou_token.weight, d.mask_tokens.weight])[None]
        tokens = torch.cat([own + torch.zeros_like(sparse[:, :1, :1]), sparse], dim=1)
        position = dense_position(p) if self.dense_position is None else self.dense_position
        hidden, source = d.transformer(image_embeddings + dense, position, tokens)
        mask_tokens = hidden[:, 1:1 + d.num_mask_tokens]
        h, w = image_embeddings.shape[-2:]
        features = d.output_upscaling(source.transpose(1, 2).reshape(-1, d.transformer_dim, h, w))
        hyper = torch.stack([mlp(mask_tokens[:, i]) for i, mlp in enumerate(d.output_hypernetworks_mlps)], dim=1)
        masks = (hyper @ features.reshape(-1, d.transformer_dim // 8, 16 * h * w)).reshape(-1, d.num_mask_tokens, 4 * h, 4 * w)
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
    try:
        encoder = graphs.export(Encoder(model), {"image": torch.zeros(1, 3, side, side)}, ["image_embeddings"], out / f"{name}_encoder.onnx")
    finally:
        official.add_decomposed_rel_pos = kept
    n = {0: "n"}
    decoder = graphs.export(
        Decoder(model), {"image_embeddings": torch.zeros(1, c, grid, grid), "point_coords": torch.zeros(2, 3, 2), "point_labels": torch.ones(2, 3),
                         "mask_input": torch.zeros(2, 1, 4 * grid, 4 * grid), "has_mask": torch.zeros(2)},
        ["masks", "iou"], out / f"{name}_decoder.onnx",
        {"point_coords": {0: "n", 1: "p"}, "point_labels": {0: "n", 1: "p"}, "mask_input": n, "has_mask": n, "masks": n, "iou": n})
    files = {"encoder": encoder, "decoder": decoder}
    graphs.save_metadata(out / f"{name}.json", files, kind="sam", name=name, architecture=architecture, source=source, image_size=side,
                         mean=[m / 255 for m in sam_models.MEAN], std=[s / 255 for s in sam_models.STD], mean_255=sam_models.MEAN,
                         std_255=sam_models.STD, embed_dim=c, mask_threshold=model.mask_threshold)
    return files


def main():
    ap = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    ap.add_argument("model", nargs="?", default="vit_b", choices=["vit_b", "vit_l", "vit_h"])
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
