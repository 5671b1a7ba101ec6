"""The official segment-anything models: from a checkpoint, or with seeded random weights, full size or reduced."""

from functools import partial

import torch
from segment_anything import sam_model_registry
from segment_anything.modeling import ImageEncoderViT, MaskDecoder, PromptEncoder, Sam, TwoWayTransformer

import weights

SIDE, WIDTH = 128, 32
MEAN, STD = [123.675, 116.28, 103.53], [58.395, 57.12, 57.375]


def reduced():
    """Official modules of 1/8 of the side and the width. Windows of 5 do not divide 8, so that padding
    takes part as it does at full size (14 and 64)."""
    grid = SIDE // 16
    return Sam(
        image_encoder=ImageEncoderViT(depth=2, embed_dim=32, img_size=SIDE, mlp_ratio=4, norm_layer=partial(torch.nn.LayerNorm, eps=1e-6),
                                      num_heads=2, patch_size=16, qkv_bias=True, use_rel_pos=True, global_attn_indexes=[1], window_size=5,
                                      out_chans=WIDTH),
        prompt_encoder=PromptEncoder(embed_dim=WIDTH, image_embedding_size=(grid, grid), input_image_size=(SIDE, SIDE), mask_in_chans=16),
        mask_decoder=MaskDecoder(num_multimask_outputs=3, transformer=TwoWayTransformer(depth=2, embedding_dim=WIDTH, mlp_dim=64, num_heads=8),
                                 transformer_dim=WIDTH, iou_head_depth=3, iou_head_hidden_dim=32),
        pixel_mean=MEAN, pixel_std=STD)


def load(name="vit_b", checkpoint=None, seed=None, small=False):
    model = reduced() if small else sam_model_registry[name](checkpoint=checkpoint)
    if checkpoint is None:
        weights.randomise(model, seed)
    return model.eval()
