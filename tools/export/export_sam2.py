"""SAM 2 or 2.1 checkpoint -> five ONNX graphs and `NAME.json`.

    python export_sam2.py sam2.1-tiny --checkpoint sam2.1_hiera_tiny.pt --out models/ --name sam2.1-tiny
    python export_sam2.py sam2.1-tiny --random 1 --out models/ --name sam2-random
    python export_sam2.py --reduced --random 1 --out models/ --name sam2-small

Graphs: encoder, decoder, mask prompt, memory encoder, memory attention. README.md says what goes in
and out of each, and how they make a tracker.
"""

import argparse
from pathlib import Path

import torch
import torch.nn.functional as F

import graphs
import matrices
import sam2_models
import two_way
from prompts import dense_position, embed_points

# Rows of queries that attend to the memories at a time. At full size all 4,096 together would need
# half a gigabyte of scores per layer; the result does not depend on it.
QUERY_ROWS = 512


class Encoder(torch.nn.Module):
    """image [1,3,S,S] -> embeddings at stride 16 and the decoder's maps at strides 4 and 8."""

    def __init__(self, model):
        super().__init__()
        self.model = model
        trunk, side = model.image_encoder.trunk, model.image_size // 4
        # The table is stretched with a bicubic filter: by the graph, as products with a matrix that is made here, as
        # not every engine can make it.
        up = matrices.resizing(trunk.pos_embed.shape[-1], side, False, "bicubic")
        trunk._get_pos_embed = lambda size: stretched(trunk, side, up)

    def forward(self, image):
        maps = self.model.forward_image(image)["backbone_fpn"]
        return maps[2], maps[0], maps[1]


def stretched(trunk, side, up):
    """The official `_get_pos_embed` of a square, with products."""
    table, window = trunk.pos_embed, trunk.pos_embed_window
    tiles = side // window.shape[-1]
    tiled = torch.cat([torch.cat([window] * tiles, dim=2)] * tiles, dim=3)
    return (up @ table @ up.T + tiled).permute(0, 2, 3, 1)


class Decoder(torch.nn.Module):
    """One picture, n prompts -> all four masks and what belongs to each."""

    def __init__(self, model):
        super().__init__()
        self.prompt, self.decoder, self.pointer = model.sam_prompt_encoder, model.sam_mask_decoder, model.obj_ptr_proj
        self.soft, self.fixed = model.soft_no_obj_ptr, model.fixed_no_obj_ptr
        self.no_pointer, self.side = model.no_obj_ptr, model.image_size

    def forward(self, image_embeddings, high_res_features1, high_res_features2, point_coords, point_labels, mask_input, has_mask):
        p, d = self.prompt, self.decoder
        sparse = embed_points(p, point_coords, point_labels, self.side)
        given = has_mask[:, None, None, None]
        dense = given * p.mask_downscaling(mask_input) + (1 - given) * p.no_mask_embed.weight.reshape(1, -1, 1, 1)
        own = torch.cat([d.obj_score_token.weight, d.iou_token.weight, d.mask_tokens.weight])[None]
        tokens = torch.cat([own + torch.zeros_like(sparse[:, :1, :1]), sparse], dim=1)
        hidden, source = two_way.transformer(d.transformer, image_embeddings + dense, dense_position(p), tokens)
        mask_tokens = hidden[:, 2:2 + d.num_mask_tokens]
        masks = two_way.masks(d, source, mask_tokens, self.side // 16, high_res_features1, high_res_features2)
        score = d.pred_obj_score_head(hidden[:, 0])
        there = torch.sigmoid(score) if self.soft else (score > 0).to(score.dtype)
        there = there[:, None]
        pointers = self.pointer(mask_tokens)
        pointers = (there * pointers if self.fixed else pointers) + (1 - there) * self.no_pointer
        return masks, d.iou_prediction_head(hidden[:, 1]), score, pointers


class MaskPrompt(torch.nn.Module):
    """A given mask as a prompt and as an output: mask [1,1,S,S] of 0 and 1."""

    def __init__(self, model):
        super().__init__()
        self.conv = model.mask_downsample
        self.register_buffer("down", matrices.resizing(model.image_size, model.image_size // 4, True))

    def forward(self, mask):
        return self.conv(mask), self.down @ (mask * 20.0 - 10.0) @ self.down.T


class MemoryEncoder(torch.nn.Module):
    """A picture's embeddings and an object's mask logits -> its memory of that frame."""

    def __init__(self, model):
        super().__init__()
        self.encoder = model.memory_encoder
        self.scale, self.bias = model.sigmoid_scale_for_mem_enc, model.sigmoid_bias_for_mem_enc
        self.register_buffer("up", matrices.resizing(model.image_size // 4, model.image_size, False))
        absent = model.no_obj_embed_spatial
        # SAM 2.0 has no such table: zeros keep one signature for both versions.
        self.register_buffer("absent", torch.zeros(1, model.mem_dim) if absent is None else absent.detach())

    def forward(self, image_embeddings, mask_logits, object_score, binarise):
        mask = self.up @ mask_logits @ self.up.T
        hard = binarise[:, None, None, None]
        mask = hard * (mask > 0).to(mask.dtype) + (1 - hard) * torch.sigmoid(mask)
        e = self.encoder
        x = e.pix_feat_proj(image_embeddings) + e.mask_downsampler(mask * self.scale + self.bias)
        x = e.out_proj(e.fuser(x))
        return x + ((object_score <= 0).to(x.dtype) * self.absent)[..., None, None]


class MemoryAttention(torch.nn.Module):
    """A picture's embeddings -> the same, conditioned on m memories and p pointers of one object.

    Rotary encodings are written with real numbers. Memories and pointers whose `valid` is 0 are left
    out exactly: their scores become so low that the softmax rounds them to zero.
    """

    def __init__(self, model):
        super().__init__()
        self.attention, self.project = model.memory_attention, model.obj_ptr_tpos_proj
        self.width, self.memory_width, self.side = model.hidden_dim, model.mem_dim, model.image_size // 16
        self.timed, self.projected = model.add_tpos_enc_to_obj_ptrs, model.proj_tpos_enc_in_obj_ptrs
        hw = self.side * self.side
        position = model.image_encoder.neck.position_encoding(torch.zeros(1, self.width, self.side, self.side))
        self.image_position = self.table(position.flatten(2).transpose(1, 2))  # [1,hw,C]
        position = model.memory_encoder.position_encoding(torch.zeros(1, self.memory_width, self.side, self.side))
        self.memory_position = self.table(position.flatten(2).transpose(1, 2))  # [1,hw,64]
        self.register_buffer("times", model.maskmem_tpos_enc.detach().reshape(-1, 1, self.memory_width))  # [7,1,64]
        first = model.memory_attention.layers[0]
        if first.self_attn.num_heads != 1 or first.cross_attn_image.num_heads != 1 or first.pos_enc_at_attn or first.pos_enc_at_cross_attn_queries:
            raise SystemExit("this memory attention is of a kind that no published configuration has")
        rotation = first.self_attn.compute_cis(end_x=self.side, end_y=self.side)  # [hw,C/2]
        # Pairs (even, odd) turn together; each factor is repeated for both members.
        self.cosine = self.table(rotation.real.repeat_interleave(2, dim=-1).float())
        self.sine = self.table(rotation.imag.repeat_interleave(2, dim=-1).float())
        # x @ swap = (-x1, x0, -x3, x2, ...): the quarter turn of every pair.
        swap = torch.zeros(self.width, self.width)
        even = torch.arange(0, self.width, 2)
        swap[even + 1, even], swap[even, even + 1] = -1.0, 1.0
        self.register_buffer("swap", swap)
        half = self.width // 2 if self.projected else self.memory_width // 2
        self.register_buffer("periods", 10000.0 ** (2 * (torch.arange(half).float() // 2) / half))
        self.tokens = hw

    def table(self, values):
        """A table of positions, made of its rows and columns."""
        return matrices.Separable(values, self.side, self.side)

    def turned(self, x):
        return x * self.cosine() + (x @ self.swap) * self.sine()

    def forward(self, image_embeddings, memory_features, memory_time, memory_valid, object_pointers, pointer_offset, pointer_valid):
        c, m, hw, parts = self.width, self.memory_width, self.tokens, self.width // self.memory_width
        memory = memory_features.reshape(-1, m, hw).transpose(1, 2)  # [m,hw,64]
        memory_at = memory + self.memory_position() + self.times[memory_time]
        pointers = object_pointers.reshape(-1, parts, m)
        pointers_at = pointers
        if self.timed:
            angle = pointer_offset[:, None] / self.periods
            time = self.project(torch.cat([angle.sin(), angle.cos()], dim=-1))
            pointers_at = pointers + time[:, None]
        # One number per key, added to its score. -1e9 leaves nothing of it.
        hidden = torch.cat([((memory_valid - 1) * 1e9)[:, None].expand(-1, hw).reshape(1, -1),
                            ((pointer_valid - 1) * 1e9)[:, None].expand(-1, parts).reshape(1, -1)], dim=1)
        values = torch.cat([memory.reshape(1, -1, m), pointers.reshape(1, -1, m)], dim=1)
        x = image_embeddings.reshape(1, c, hw).transpose(1, 2)
        if self.attention.pos_enc_at_input:
            x = x + 0.1 * self.image_position()
        for layer in self.attention.layers:
            a, y = layer.self_attn, layer.norm1(x)
            q, k, v = self.turned(a.q_proj(y)), self.turned(a.k_proj(y)), a.v_proj(y)
            x = x + a.out_proj(attend(q, k, v, None))
            a, y = layer.cross_attn_image, layer.norm2(x)
            key_memory, key_pointers = (memory_at, pointers_at) if layer.pos_enc_at_cross_attn_keys else (memory, pointers)
            q = self.turned(a.q_proj(y))
            k = torch.cat([self.turned(a.k_proj(key_memory)).reshape(1, -1, c), a.k_proj(key_pointers).reshape(1, -1, c)], dim=1)
            # Values are projected after the weighted mean instead of before (the weights sum to 1, so it is the same):
            # 64 wide instead of 256, a third less work.
            x = x + a.out_proj(a.v_proj(attend(q, k, values, hidden)))
            x = x + layer.linear2(layer.activation(layer.linear1(layer.norm3(x))))
        return self.attention.norm(x).transpose(1, 2).reshape(1, c, self.side, self.side)


def attend(q, k, v, hidden):
    """Attention of one head, QUERY_ROWS queries at a time: q [1,n,C], k [1,keys,C], v [1,keys,any]."""
    turned, out = (k * q.shape[-1] ** -0.5).transpose(1, 2), []
    for start in range(0, q.shape[1], QUERY_ROWS):
        scores = q[:, start:start + QUERY_ROWS] @ turned
        if hidden is not None:
            scores = scores + hidden
        out.append(F.softmax(scores, dim=-1) @ v)
    return out[0] if len(out) == 1 else torch.cat(out, dim=1)


def write(model, out, name, architecture, source=""):
    side, c, m = model.image_size, model.hidden_dim, model.mem_dim
    s16, s4 = side // 16, side // 4
    embeddings, fine, middle = torch.zeros(1, c, s16, s16), torch.zeros(1, c // 8, s4, s4), torch.zeros(1, c // 4, side // 8, side // 8)
    files = {}
    files["encoder"] = graphs.export(Encoder(model), {"image": torch.zeros(1, 3, side, side)},
                                     ["image_embeddings", "high_res_features1", "high_res_features2"], out / f"{name}_encoder.onnx")
    n = {0: "n"}
    files["decoder"] = graphs.export(
        Decoder(model), {"image_embeddings": embeddings, "high_res_features1": fine, "high_res_features2": middle,
                         "point_coords": torch.zeros(2, 3, 2), "point_labels": torch.ones(2, 3), "mask_input": torch.zeros(2, 1, s4, s4),
                         "has_mask": torch.zeros(2)},
        ["masks", "iou", "object_score", "object_pointers"], out / f"{name}_decoder.onnx",
        {"point_coords": {0: "n", 1: "p"}, "point_labels": {0: "n", 1: "p"}, "mask_input": n, "has_mask": n, "masks": n, "iou": n,
         "object_score": n, "object_pointers": n})
    files["mask_prompt"] = graphs.export(MaskPrompt(model), {"mask": torch.zeros(1, 1, side, side)}, ["mask_input", "low_res_mask"],
                                         out / f"{name}_mask_prompt.onnx")
    files["memory_encoder"] = graphs.export(
        MemoryEncoder(model), {"image_embeddings": embeddings, "mask_logits": torch.zeros(1, 1, s4, s4), "object_score": torch.zeros(1, 1),
                               "binarise": torch.zeros(1)}, ["memory_features"], out / f"{name}_memory_encoder.onnx")
    attention = {"image_embeddings": embeddings, "memory_features": torch.zeros(3, m, s16, s16), "memory_time": torch.zeros(3, dtype=torch.int64),
                 "memory_valid": torch.ones(3), "object_pointers": torch.zeros(2, c), "pointer_offset": torch.zeros(2), "pointer_valid": torch.ones(2)}
    if not model.add_tpos_enc_to_obj_ptrs:
        del attention["pointer_offset"]
    module = MemoryAttention(model)
    if "pointer_offset" not in attention:
        module = Untimed(module)
    m_axis, p_axis = {0: "m"}, {0: "p"}
    files["memory_attention"] = graphs.export(
        module, attention, ["conditioned"], out / f"{name}_memory_attention.onnx",
        {k: (m_axis if k.startswith("memory") else p_axis) for k in attention if k != "image_embeddings"})
    graphs.save_metadata(
        out / f"{name}.json", files, kind="sam2", name=name, architecture=architecture, source=source,
        image_size=side, mean=[0.485, 0.456, 0.406], std=[0.229, 0.224, 0.225], embed_dim=c, memory_dim=m,
        memories=model.num_maskmem, pointers=model.max_obj_ptrs_in_encoder, pointer_time=model.add_tpos_enc_to_obj_ptrs,
        pointer_time_signed=model.use_signed_tpos_enc_to_obj_ptrs, pointers_only_from_past=model.only_obj_ptrs_in_the_past_for_eval,
        max_conditioning_frames=model.max_cond_frames_in_attn, memory_stride=model.memory_temporal_stride_for_eval,
        multimask_points=[model.multimask_min_pt_num, model.multimask_max_pt_num], multimask_when_tracking=model.multimask_output_for_tracking,
        pointer_of_best_mask=model.use_multimask_token_for_obj_ptr,
        stability_delta=model.sam_mask_decoder.dynamic_multimask_stability_delta, stability_threshold=model.sam_mask_decoder.dynamic_multimask_stability_thresh,
        single_mask_falls_back=model.sam_mask_decoder.dynamic_multimask_via_stability,
        binarise_prompted=model.binarize_mask_from_pts_for_mem_enc, fill_hole_area=getattr(model, "fill_hole_area", 0),
        absent_score=-1024.0, no_memory_embedding=graphs.numbers(model.no_mem_embed), no_object_pointer=graphs.numbers(model.no_obj_ptr))
    return files


class Untimed(torch.nn.Module):
    """SAM 2.0 gives pointers no time: its graph has no such input."""

    def __init__(self, inner):
        super().__init__()
        self.inner = inner

    def forward(self, image_embeddings, memory_features, memory_time, memory_valid, object_pointers, pointer_valid):
        return self.inner(image_embeddings, memory_features, memory_time, memory_valid, object_pointers, None, pointer_valid)


def main():
    ap = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    ap.add_argument("model", nargs="?", default="sam2.1-tiny", choices=sam2_models.CONFIGS)
    ap.add_argument("--checkpoint", type=Path)
    ap.add_argument("--random", type=int, metavar="SEED", help="random weights")
    ap.add_argument("--reduced", action="store_true", help="a tiny architecture, for tests")
    ap.add_argument("--out", type=Path, required=True)
    ap.add_argument("--name", required=True)
    ap.add_argument("--source", default="", help="where the checkpoint is from, for the metadata")
    a = ap.parse_args()
    if (a.checkpoint is None) == (a.random is None):
        ap.error("give either --checkpoint or --random")
    model = sam2_models.load(a.model, str(a.checkpoint) if a.checkpoint else None, a.random, a.reduced)
    write(model, a.out, a.name, a.model + (" reduced" if a.reduced else ""), a.source)


if __name__ == "__main__":
    main()
