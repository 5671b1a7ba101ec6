"""The mask decoder that SAM and SAM 2 share, with less arithmetic than the official modules and the same result.

A handful of tokens attend to thousands of image positions and back. Projected are the tokens instead of the positions
(q . (W k) = (W^T q) . k; the weights of a softmax sum to 1, so values are projected after the weighted mean), and the two
transposed convolutions are products, because their strides are their sizes. Half the work of a prompt, and no layout but
channels last.
"""

import torch


def by_head(a, weight):
    """A projection's weight [inner, C] -> [heads, inner / heads, C]."""
    return weight.reshape(a.num_heads, a.internal_dim // a.num_heads, -1)


def split(a, x):
    """[n,t,inner] -> [n,heads,t,inner / heads]."""
    return x.reshape(*x.shape[:2], a.num_heads, a.internal_dim // a.num_heads).transpose(1, 2)


def tokens_to_image(a, tokens, at, image):
    """tokens [n,t,C] attend to positions `at` [n,hw,C] with values `image`. (The bias of keys adds the same to all scores
    of a token, which the softmax ignores.)"""
    n, t, c = *tokens.shape[:2], a.embedding_dim
    q = split(a, a.q_proj(tokens)) * (a.internal_dim // a.num_heads) ** -0.5
    q = (q @ by_head(a, a.k_proj.weight)).reshape(n, -1, c)
    seen = torch.softmax(q @ at.transpose(1, 2), dim=-1) @ image  # [n,heads * t,C]
    seen = seen.reshape(n, a.num_heads, t, c) @ by_head(a, a.v_proj.weight).transpose(1, 2)
    return a.out_proj(seen.transpose(1, 2).reshape(n, t, a.internal_dim) + a.v_proj.bias)


def image_to_tokens(a, at, tokens_at, tokens):
    """Positions `at` [n,hw,C] attend to tokens [n,t,C]."""
    n, t, c = *tokens.shape[:2], a.embedding_dim
    k = split(a, a.k_proj(tokens_at)) * (a.internal_dim // a.num_heads) ** -0.5
    bias = (k @ by_head(a, a.q_proj.bias)).reshape(n, 1, -1)
    k = (k @ by_head(a, a.q_proj.weight)).reshape(n, -1, c)
    scores = at @ k.transpose(1, 2) + bias  # [n,hw,heads * t]
    scores = torch.softmax(scores.reshape(n, -1, a.num_heads, t), dim=-1).flatten(2)
    v = split(a, a.v_proj(tokens)) @ a.out_proj.weight.reshape(c, a.num_heads, -1).permute(1, 2, 0)
    return scores @ v.reshape(n, -1, c) + a.out_proj.bias


def transformer(m, image, position, tokens):
    """The official `TwoWayTransformer`: image [n,C,h,w], position [1,C,h,w], tokens [n,t,C] -> tokens, image [n,hw,C]."""
    image, position = image.flatten(2).transpose(1, 2), position.flatten(2).transpose(1, 2)
    given = tokens
    for layer in m.layers:
        if layer.skip_first_layer_pe:
            tokens = layer.self_attn(q=tokens, k=tokens, v=tokens)
        else:
            q = tokens + given
            tokens = tokens + layer.self_attn(q=q, k=q, v=tokens)
        tokens = layer.norm1(tokens)
        at = image + position
        tokens = layer.norm2(tokens + tokens_to_image(layer.cross_attn_token_to_image, tokens + given, at, image))
        tokens = layer.norm3(tokens + layer.mlp(tokens))
        image = layer.norm4(image + image_to_tokens(layer.cross_attn_image_to_token, at, tokens + given, tokens))
    a = m.final_attn_token_to_image
    return m.norm_final_attn(tokens + tokens_to_image(a, tokens + given, image + position, image)), image


def doubled(up, x):
    """A transposed convolution of size and stride 2: [n,positions,C] -> [n,positions * 2 * 2,K]."""
    c, k = up.weight.shape[:2]
    x = x @ up.weight.permute(0, 2, 3, 1).reshape(c, 4 * k)
    return x.reshape(x.shape[0], -1, k) + up.bias


def in_order(x, side, times):
    """A map [1,K,H,W] as [1,positions,K], in the order of positions that were doubled so many `times`."""
    k, pairs = x.shape[1], [axis for i in range(times) for axis in (3 + i, 4 + times + i)]
    x = x.reshape(1, k, side, *[2] * times, side, *[2] * times)
    return x.permute(0, 2, 3 + times, *pairs, 1).reshape(1, -1, k)


def masks(d, image, mask_tokens, side, fine=None, middle=None):
    """Logits [n,masks,4 side,4 side] of the tokens [n,masks,C] on image [n,side * side,C]; SAM 2 has two maps more."""
    up, norm, act, up2, act2 = d.output_upscaling
    x = doubled(up, image)
    x = x if middle is None else x + in_order(middle, side, 1)
    x = doubled(up2, act(torch.nn.functional.layer_norm(x, norm.weight.shape, norm.weight, norm.bias, norm.eps)))
    x = act2(x if fine is None else x + in_order(fine, side, 2))
    hyper = torch.stack([mlp(mask_tokens[:, i]) for i, mlp in enumerate(d.output_hypernetworks_mlps)], dim=1)
    x = (x @ hyper.transpose(1, 2)).reshape(-1, side, side, 2, 2, 2, 2, d.num_mask_tokens)
    return x.permute(0, 7, 1, 3, 5, 2, 4, 6).reshape(-1, d.num_mask_tokens, 4 * side, 4 * side)
