"""Seeded random weights for networks whose checkpoints are not at hand.

Default initialisations hide mistakes: biases, position tables and layer scales start at zero (or
1e-6), so a graph that forgets them would still agree. Every parameter gets a value that matters.
"""

import torch


@torch.no_grad()
def randomise(module, seed, gain=1.0):
    """Fills every parameter of `module` from `seed`, by its kind and shape.

    matrices and kernels  normal, deviation gain / sqrt(inputs of one output)
    norm weights          1 + 0.1 normal
    biases                0.1 normal
    layer scales          uniform 0.3 ... 0.8
    tables and tokens     normal, deviation 0.5 (added to features of about unit size)
    """
    g = torch.Generator().manual_seed(seed)
    for name, buffer in module.named_buffers():
        # Random frequencies of point encodings: drawn when the official module is made, from no seed.
        if name.endswith("positional_encoding_gaussian_matrix"):
            buffer.copy_(torch.randn(buffer.shape, generator=g))
        # What batches were like: of norms over batches.
        elif name.endswith("running_mean"):
            buffer.copy_(0.1 * torch.randn(buffer.shape, generator=g))
        elif name.endswith("running_var"):
            buffer.copy_(0.5 + torch.rand(buffer.shape, generator=g))

    def normal(p, deviation):
        return torch.randn(p.shape, generator=g) * deviation

    norms = (torch.nn.LayerNorm, torch.nn.BatchNorm2d)
    for name, owner in module.named_modules():
        is_norm = isinstance(owner, norms) or type(owner).__name__.startswith("LayerNorm")
        for key, p in owner.named_parameters(recurse=False):
            if is_norm:
                p.copy_(normal(p, 0.1) + (1.0 if key == "weight" else 0.0))
            elif key == "gamma":
                p.copy_(0.3 + 0.5 * torch.rand(p.shape, generator=g))
            elif isinstance(owner, torch.nn.ConvTranspose2d) and key == "weight":
                p.copy_(normal(p, gain / p.shape[0] ** 0.5))
            elif isinstance(owner, (torch.nn.Linear, torch.nn.Conv2d, torch.nn.MultiheadAttention)) and p.dim() >= 2:
                p.copy_(normal(p, gain / (p[0].numel() ** 0.5)))
            elif key.endswith("bias") and p.dim() == 1:
                p.copy_(normal(p, 0.1))
            elif p.dim() == 0:
                continue  # temperatures
            elif key in ("proj", "text_projection"):
                p.copy_(normal(p, gain / p.shape[0] ** 0.5))
            else:
                p.copy_(normal(p, 0.5))
    return module


@torch.no_grad()
def calibrate_decoder(decoder, run, spread=8.0, area=0.3, iou=(0.8, 0.8), score=(1.2, 1.0), rounds=4):
    """Makes the masks of a random decoder worth comparing: neither empty nor full.

    `run()` decodes a set of example prompts. Measured on them, the last layers are shifted and scaled:
    every mask token's logits get deviation `spread` and are positive on a share `area` of the
    pixels; predicted IoU (before a sigmoid, if there is one) and occlusion score get (mean, deviation).
    """
    for _ in range(rounds):  # a track feeds on its own masks, so what was measured moves a little each time
        seen = {}
        hooks = [decoder.output_upscaling[-1].register_forward_hook(lambda m, i, o: seen.setdefault("features", []).append(o.flatten(2)))]
        for k, mlp in enumerate(decoder.output_hypernetworks_mlps):
            hooks.append(mlp.register_forward_hook(lambda m, i, o, k=k: seen.setdefault(k, []).append(o)))
        heads = {"iou": decoder.iou_prediction_head}
        if getattr(decoder, "pred_obj_scores", False):
            heads["score"] = decoder.pred_obj_score_head
        for name, head in heads.items():
            hooks.append(head.layers[-1].register_forward_hook(lambda m, i, o, name=name: seen.setdefault(name, []).append(o)))
        run()
        for hook in hooks:
            hook.remove()
        features = torch.cat(seen["features"])  # [n,c,pixels]
        mean = features.mean((0, 2))
        for k, mlp in enumerate(decoder.output_hypernetworks_mlps):
            hyper, last = torch.cat(seen[k]), mlp.layers[-1]
            logits = torch.einsum("nc,ncp->np", hyper, features)
            last.bias -= torch.quantile(logits.flatten()[:200_000], 1 - area) / (mean @ mean) * mean
            factor = spread / logits.std()
            last.weight *= factor
            last.bias *= factor
        for name, head in heads.items():
            values, (middle, deviation), last = torch.cat(seen[name]), {"iou": iou, "score": score}[name], head.layers[-1]
            factor = deviation / values.std(0).clamp_min(1e-6)
            shift = middle - values.mean(0) * factor
            last.weight *= factor[:, None]
            last.bias *= factor
            last.bias += shift
