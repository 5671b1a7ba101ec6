"""Trains gsplat, from its package, on the photos that `fmlgs train` is given, and prints PSNR against seconds.

usage: gsplat_train.py FOLDER [--strategy mcmc|default] [--steps N] [--gaussians N] [--max-side PX] [--marks S,S,...]

FOLDER holds a transforms.json without distortion and its photos, with a sparse cloud. As in gsplat's own trainer: L1 with
0.2 D-SSIM, harmonics up to degree 3, its learning rates and starting values, its MCMC strategy under a cap of Gaussians
or its default one, which has none. Milestones, meant for 30,000 steps, are scaled as `fmlgs train` scales its own. Every
eighth photo is held out. Seconds are those of the steps alone. Prints one JSON document; without a GPU or gsplat it says
so in it ("missing").
"""

import argparse
import json
import pathlib
import time


def dataset(folder, max_side):
    """Photos [height, width, 3] in 0 to 1, world-to-camera matrices, intrinsics, points [n, 3] and their colors."""
    import numpy as np
    from PIL import Image

    about = json.loads((folder / "transforms.json").read_text())
    if any(about.get(k, 0) for k in ["k1", "k2", "p1", "p2"]):
        raise ValueError("the photos are distorted")
    intrinsics = np.array([[about["fl_x"], 0, about["cx"]], [0, about["fl_y"], about["cy"]], [0, 0, 1]])
    frames = sorted(about["frames"], key=lambda frame: frame["file_path"])
    images = [Image.open(folder / f["file_path"]).convert("RGB") for f in frames]
    size = images[0].size
    scale = min(1.0, max_side / max(size))
    small = tuple(round(side * scale) for side in size)
    intrinsics[0] *= small[0] / size[0]
    intrinsics[1] *= small[1] / size[1]
    photos = [np.asarray(image.resize(small, Image.BOX), dtype=np.float32) / 255 for image in images]
    # The file's cameras look along -z with y up; gsplat's along z with y down.
    poses = [np.array(f["transform_matrix"]) @ np.diag([1, -1, -1, 1]) for f in frames]
    head, body = (folder / about["ply_file_path"]).read_bytes().split(b"end_header\n", 1)
    if b"binary_little_endian" not in head or head.count(b"property") != 6:
        raise ValueError("points must be x, y, z, red, green, blue")
    points = np.frombuffer(body, [("at", "<f4", 3), ("color", "u1", 3)])
    return photos, [np.linalg.inv(p) for p in poses], intrinsics, points["at"].copy(), points["color"] / 255


def ssim(a, b):
    """Mean SSIM of two pictures [1, 3, height, width], with Wang's window."""
    import torch
    import torch.nn.functional as F

    line = torch.exp(-((torch.arange(11, device=a.device) - 5.0) ** 2) / (2 * 1.5**2))
    line = line / line.sum()
    window = (line[:, None] * line[None, :]).expand(15, 1, 11, 11)
    sums = F.conv2d(torch.cat([a, b, a * a, b * b, a * b], 1), window, padding=5, groups=15)
    ma, mb, aa, bb, ab = sums.split(3, 1)
    c1, c2 = 0.01**2, 0.03**2
    return (((2 * ma * mb + c1) * (2 * (ab - ma * mb) + c2)) / ((ma**2 + mb**2 + c1) * (aa - ma**2 + bb - mb**2 + c2))).mean()


def train(folder, mcmc, steps, gaussians, max_side, marks):
    import numpy as np
    import torch
    from gsplat import DefaultStrategy, MCMCStrategy, rasterization

    torch.manual_seed(0)
    photos, cameras, intrinsics, at, colors = dataset(folder, max_side)
    height, width = photos[0].shape[:2]
    tensor = lambda a: torch.tensor(np.asarray(a), dtype=torch.float32, device="cuda")
    photos, cameras, intrinsics, at = [tensor(p) for p in photos], [tensor(c) for c in cameras], tensor(intrinsics)[None], tensor(at)
    centers = torch.stack([torch.linalg.inv(c)[:3, 3] for c in cameras])
    extent = float((centers - centers.mean(0)).norm(dim=1).max()) * 1.1
    spacing = torch.cdist(at, at).topk(4, largest=False).values[:, 1:].square().mean(1).sqrt().clamp(min=1e-6)
    n = len(at)
    values = {
        "means": (at, 1.6e-4 * extent),
        "scales": (torch.log(spacing * (0.1 if mcmc else 1.0))[:, None].repeat(1, 3), 5e-3),
        "quats": (torch.rand((n, 4), device="cuda"), 1e-3),
        "opacities": (torch.logit(torch.full((n,), 0.5 if mcmc else 0.1, device="cuda")), 5e-2),
        "sh0": (((tensor(colors) - 0.5) / 0.28209479177387814)[:, None, :], 2.5e-3),
        "shN": (torch.zeros((n, 15, 3), device="cuda"), 2.5e-3 / 20),
    }
    p = torch.nn.ParameterDict({k: torch.nn.Parameter(v) for k, (v, _) in values.items()}).cuda()
    optimizers = {k: torch.optim.Adam([{"params": p[k], "lr": lr, "name": k}], eps=1e-15, fused=True) for k, (_, lr) in values.items()}
    decay = torch.optim.lr_scheduler.ExponentialLR(optimizers["means"], 0.01 ** (1 / steps))
    every = max(20, min(100, steps // 75))
    if mcmc:
        strategy = MCMCStrategy(
            cap_max=gaussians, refine_start_iter=steps // 60, refine_stop_iter=steps * 5 // 6, refine_every=every)
    else:
        strategy = DefaultStrategy(refine_start_iter=steps // 60, refine_stop_iter=steps // 2, refine_every=every)
    strategy.check_sanity(p, optimizers)
    state = strategy.initialize_state() if mcmc else strategy.initialize_state(scene_scale=extent)

    def draw(k, degree):
        return rasterization(
            p["means"], p["quats"], torch.exp(p["scales"]), torch.sigmoid(p["opacities"]),
            torch.cat([p["sh0"], p["shN"]], 1), cameras[k][None], intrinsics, width, height, sh_degree=degree, packed=False,
        )

    held_out = [k for k in range(len(photos)) if k % 8 == 0]
    trained = [k for k in range(len(photos)) if k % 8]

    def psnr(degree):
        with torch.no_grad():
            errors = [(draw(k, degree)[0][0].clamp(0, 1) - photos[k]).square().mean() for k in held_out]
        return float(np.mean([-10 * np.log10(float(e)) for e in errors]))

    curve, order, secs, due = [], [], 0.0, list(marks)
    torch.cuda.synchronize()
    start = time.perf_counter()
    for step in range(steps):
        order = order or torch.randperm(len(trained)).tolist()
        k = trained[order.pop()]
        degree = min(3, step * 30 // steps if steps < 30_000 else step // 1000)
        picture, _, info = draw(k, degree)
        a, b = picture.permute(0, 3, 1, 2), photos[k][None].permute(0, 3, 1, 2)
        loss = 0.8 * (a - b).abs().mean() + 0.2 * (1 - ssim(a, b))
        if mcmc:
            loss = loss + 0.01 * torch.sigmoid(p["opacities"]).mean() + 0.01 * torch.exp(p["scales"]).mean()
        strategy.step_pre_backward(p, optimizers, state, step, info)
        loss.backward()
        for optimizer in optimizers.values():
            optimizer.step()
            optimizer.zero_grad(set_to_none=True)
        decay.step()
        if mcmc:
            strategy.step_post_backward(p, optimizers, state, step, info, lr=decay.get_last_lr()[0])
        else:
            strategy.step_post_backward(p, optimizers, state, step, info, packed=False)
        if due and secs + time.perf_counter() - start >= due[0]:
            torch.cuda.synchronize()
            secs += time.perf_counter() - start
            due = [mark for mark in due if mark > secs]
            curve.append({"secs": secs, "step": step + 1, "psnr": psnr(degree), "gaussians": len(p["means"])})
            torch.cuda.synchronize()
            start = time.perf_counter()
    torch.cuda.synchronize()
    secs += time.perf_counter() - start
    curve.append({"secs": secs, "step": steps, "psnr": psnr(3), "gaussians": len(p["means"])})
    return {"folder": folder.name, "size": [width, height], "steps_per_s": steps / secs, "curve": curve}


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--strategy", choices=["mcmc", "default"], default="mcmc")
    parser.add_argument("--steps", type=int, default=3000)
    parser.add_argument("--gaussians", type=int, default=45_000)
    parser.add_argument("--max-side", type=int, default=512)
    parser.add_argument("--marks", default="1,2,4,8,16,32")
    args = parser.parse_args()
    try:
        import gsplat
        import torch

        if not torch.cuda.is_available():
            raise ImportError("torch sees no GPU")
        marks = [float(s) for s in args.marks.split(",")]
        about = {"gsplat": gsplat.__version__, "device": torch.cuda.get_device_name()}
        print(json.dumps({**about, **train(args.folder, args.strategy == "mcmc", args.steps, args.gaussians, args.max_side, marks)}))
    except ImportError as why:
        print(json.dumps({"missing": str(why)}))


if __name__ == "__main__":
    main()
