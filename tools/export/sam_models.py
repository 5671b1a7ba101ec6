"""The official segment-anything and MobileSAM models: from a checkpoint, or with seeded random weights, full size or reduced."""

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
    return assembled(ImageEncoderViT(
        depth=2, embed_dim=32, img_size=SIDE, mlp_ratio=4, norm_layer=partial(torch.nn.LayerNorm, eps=1e-6), num_heads=2, patch_size=16,
        qkv_bias=True, use_rel_pos=True, global_attn_indexes=[1], window_size=5, out_chans=WIDTH))


def reduced_tiny():
    """The official TinyViT in the same way. The stride of its third step depends on a width of 320 in the official code, and
    its neck is always 256 wide."""
    from mobile_sam.modeling import TinyViT
    from mobile_sam.modeling.tiny_vit_sam import LayerNorm2d
    encoder = TinyViT(img_size=SIDE, embed_dims=[8, 16, 24, 32], depths=[1, 1, 1, 1], num_heads=[1, 2, 2, 2], window_sizes=[7, 7, 5, 7],
                      num_classes=4, drop_path_rate=0.0)
    encoder.layers[2].downsample.conv2.c.stride = (1, 1)
    encoder.neck = torch.nn.Sequential(torch.nn.Conv2d(32, WIDTH, 1, bias=False), LayerNorm2d(WIDTH),
                                       torch.nn.Conv2d(WIDTH, WIDTH, 3, padding=1, bias=False), LayerNorm2d(WIDTH))
    return assembled(encoder)


def assembled(encoder):
    grid = SIDE // 16
    return Sam(
        image_encoder=encoder,
        prompt_encoder=PromptEncoder(embed_dim=WIDTH, image_embedding_size=(grid, grid), input_image_size=(SIDE, SIDE), mask_in_chans=16),
        mask_decoder=MaskDecoder(num_multimask_outputs=3, transformer=TwoWayTransformer(depth=2, embedding_dim=WIDTH, mlp_dim=64, num_heads=8),
                                 transformer_dim=WIDTH, iou_head_depth=3, iou_head_hidden_dim=32),
        pixel_mean=MEAN, pixel_std=STD)


def official(name, checkpoint):
    if name == "vit_t":
        from mobile_sam import sam_model_registry as mobile
        return mobile[name](checkpoint=checkpoint)
    return sam_model_registry[name](checkpoint=checkpoint)


def load(name="vit_b", checkpoint=None, seed=None, small=False):
    if small:
        model = reduced_tiny() if name == "vit_t" else reduced()
    else:
        model = official(name, checkpoint)
    if checkpoint is None:
        weights.randomise(model, seed)
    return model.eval()
