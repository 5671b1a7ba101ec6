"""The official SAM 2 models: from a checkpoint, or with seeded random weights, full size or reduced."""

import sys
import types

import cv2
import numpy as np
import torch
from sam2.build_sam import build_sam2_video_predictor
from sam2.modeling.sam.mask_decoder import MaskDecoder
from sam2.modeling.sam.transformer import TwoWayTransformer

import weights

CONFIGS = {f"{v}-{n}": f"configs/{d}/{d}_hiera_{s}.yaml"
           for v, d in (("sam2", "sam2"), ("sam2.1", "sam2.1"))
           for n, s in (("tiny", "t"), ("small", "s"), ("base-plus", "b+"), ("large", "l"))}

# 1/8 of the side and of the width. The ratios that the pipeline depends on stay: stride 16, masks at
# stride 4, a pointer of four memory widths.
SIDE, WIDTH, MEMORY = 128, 32, 8
REDUCED = [
    f"++model.image_size={SIDE}",
    "++model.image_encoder.trunk.embed_dim=8",
    "++model.image_encoder.trunk.stages=[1,1,2,1]",
    "++model.image_encoder.trunk.global_att_blocks=[3]",
    f"++model.image_encoder.neck.d_model={WIDTH}",
    f"++model.image_encoder.neck.position_encoding.num_pos_feats={WIDTH}",
    "++model.image_encoder.neck.backbone_channel_list=[64,32,16,8]",
    f"++model.memory_attention.d_model={WIDTH}",
    "++model.memory_attention.num_layers=2",
    f"++model.memory_attention.layer.d_model={WIDTH}",
    "++model.memory_attention.layer.dim_feedforward=64",
    *(f"++model.memory_attention.layer.{a}.{k}" for a in ("self_attention", "cross_attention")
      for k in (f"embedding_dim={WIDTH}", f"feat_sizes=[{SIDE // 16},{SIDE // 16}]")),
    f"++model.memory_attention.layer.cross_attention.kv_in_dim={MEMORY}",
    f"++model.memory_encoder.out_dim={MEMORY}",
    f"++model.memory_encoder.position_encoding.num_pos_feats={MEMORY}",
    f"+model.memory_encoder.in_dim={WIDTH}",
    f"+model.memory_encoder.mask_downsampler.embed_dim={WIDTH}",
    f"++model.memory_encoder.fuser.layer.dim={WIDTH}",
]


def use_cpu_components():
    """The official connected components (8 neighbours, area at every pixel) exist for CUDA only, and
    are skipped without it. The same function from OpenCV, so that hole filling takes place."""
    def components(mask):
        labels, areas = np.zeros(mask.shape, np.int32), np.zeros(mask.shape, np.int32)
        for n in range(mask.shape[0]):
            _, found, stats, _ = cv2.connectedComponentsWithStats(mask[n, 0].cpu().numpy().astype(np.uint8), connectivity=8)
            labels[n, 0], areas[n, 0] = found, np.where(found > 0, stats[found, cv2.CC_STAT_AREA], 0)
        return torch.from_numpy(labels), torch.from_numpy(areas)
    if "sam2._C" not in sys.modules:
        import sam2
        sam2._C = sys.modules["sam2._C"] = types.SimpleNamespace(get_connected_componnets=components)


def load(name="sam2.1-tiny", checkpoint=None, seed=None, reduced=False):
    """The official video predictor on the CPU (its base class serves single images too)."""
    use_cpu_components()
    model = build_sam2_video_predictor(CONFIGS[name], checkpoint, device="cpu", hydra_overrides_extra=list(REDUCED) if reduced else [])
    if reduced:
        shrink_decoder(model)
    if checkpoint is None:
        weights.randomise(model, seed)
    # Memories are kept as bfloat16. With pointers beside them they become float32 again; an object
    # without pointers in the past would fail on the CPU, where no autocast widens them.
    model.memory_attention.register_forward_pre_hook(lambda m, args, named: (args, {**named, "memory": named["memory"].float()}), with_kwargs=True)
    return model.eval()


def shrink_decoder(model):
    """The decoder's inner widths are fixed in the official constructor; the official class takes others."""
    model.sam_mask_decoder = MaskDecoder(
        num_multimask_outputs=3, transformer=TwoWayTransformer(depth=2, embedding_dim=WIDTH, mlp_dim=64, num_heads=8), transformer_dim=WIDTH,
        iou_head_depth=3, iou_head_hidden_dim=32, use_high_res_features=True, iou_prediction_use_sigmoid=model.iou_prediction_use_sigmoid,
        pred_obj_scores=True, pred_obj_scores_mlp=True, use_multimask_token_for_obj_ptr=True, **(model.sam_mask_decoder_extra_args or {}))
