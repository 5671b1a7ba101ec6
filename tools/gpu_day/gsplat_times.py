"""Times gsplat, from its package, on the splats and cameras that `fmlgs bench` draws, and on its own garden crop.

usage: gsplat_times.py images SPLAT.ply... [--size WxH]... [--repeats N]
       gsplat_times.py garden test_garden.npz [--repeats N]

Prints one JSON document. Needs torch with a GPU and gsplat; without them it says so in the document ("missing").
Never run yet: there was no GPU.
"""

import argparse
import json
import math
import statistics
import time

SH_C0 = 0.28209479177387814


def read_ply(path):
    """A splat in INRIA's layout as a dict of arrays; only `.ply`, as gsplat has no reader of its own."""
    import numpy as np

    with open(path, "rb") as file:
        names, count = [], 0
        while (line := file.readline().decode("ascii", "replace").split()) != ["end_header"]:
            if not line:
                raise ValueError(f"{path}: its header does not end")
            if line[:2] == ["element", "vertex"]:
                count = int(line[2])
            elif line[:2] == ["property", "float"]:
                names.append(line[2])
        table = np.fromfile(file, "<f4", count * len(names)).reshape(count, len(names))
    column = {name: table[:, k] for k, name in enumerate(names)}
    stack = lambda prefix, n: np.stack([column[f"{prefix}{k}"] for k in range(n)], 1)
    rest = sum(name.startswith("f_rest_") for name in names)
    sh = stack("f_dc_", 3)[:, None, :]
    if rest:
        bands = stack("f_rest_", rest).reshape(count, 3, rest // 3).transpose(0, 2, 1)
        sh = np.concatenate([sh, bands], 1)
    return {
        "means": np.stack([column[a] for a in "xyz"], 1),
        "quats": stack("rot_", 4),
        "scales": np.exp(stack("scale_", 3)),
        "opacities": 1 / (1 + np.exp(-column["opacity"])),
        "sh": sh,
    }


def views(means, width, height):
    """The three cameras of `measure::bench::views_of`: view matrices and intrinsics."""
    import numpy as np

    low, high = np.percentile(means, [2, 98], axis=0)
    center, radius = (low + high) / 2, float(np.linalg.norm(high - low)) / 2
    focal = height / 2 / math.tan(0.4)
    matrices = []
    for angle, height_over, distance in [(0.3, -0.3, 2.2), (2.4, -0.9, 1.6), (4.4, 0.2, 3.0)]:
        eye = center + np.array([math.cos(angle), height_over, math.sin(angle)]) * radius * distance
        forward = (center - eye) / np.linalg.norm(center - eye)
        right = np.cross(forward, [0.0, -1.0, 0.0])
        right /= np.linalg.norm(right)
        rotation = np.stack([right, np.cross(forward, right), forward])
        matrix = np.eye(4)
        matrix[:3, :3], matrix[:3, 3] = rotation, -rotation @ eye
        matrices.append(matrix)
    return np.stack(matrices), np.array([[focal, 0, width / 2], [0, focal, height / 2], [0, 0, 1]])


def timed(run, repeats):
    """Median milliseconds, after one run that does not count."""
    import torch

    run()
    taken = []
    for _ in range(repeats):
        torch.cuda.synchronize()
        start = time.perf_counter()
        run()
        torch.cuda.synchronize()
        taken.append(1e3 * (time.perf_counter() - start))
    return statistics.median(taken)


def images(splats, sizes, repeats):
    import torch
    from gsplat import rasterization

    rows = []
    for path in splats:
        if not path.endswith(".ply"):
            rows.append({"name": path, "missing": "only .ply is read"})
            continue
        splat = read_ply(path)
        on_device = {k: torch.tensor(v, dtype=torch.float32, device="cuda") for k, v in splat.items()}
        degree = math.isqrt(splat["sh"].shape[1]) - 1
        for width, height in sizes:
            matrices, intrinsics = views(splat["means"], width, height)
            matrices = torch.tensor(matrices, dtype=torch.float32, device="cuda")
            intrinsics = torch.tensor(intrinsics, dtype=torch.float32, device="cuda")
            draw = lambda k: rasterization(
                *(on_device[n] for n in ["means", "quats", "scales", "opacities", "sh"]),
                matrices[k : k + 1], intrinsics[None], width, height, sh_degree=degree, packed=False,
            )
            with torch.no_grad():
                ms = statistics.median(timed(lambda: draw(k), repeats) for k in range(3))
            rows.append({"name": path, "gaussians": len(splat["means"]), "size": [width, height], "total_ms": ms})
    return rows


def garden(path, repeats):
    """An image and a training step (L1) of the crop that gsplat tests itself with."""
    import numpy as np
    import torch
    from gsplat import rasterization

    data = np.load(path)
    tensor = lambda a: torch.tensor(np.asarray(a), dtype=torch.float32, device="cuda")
    means, colors = tensor(data["means3d"]), tensor(data["colors"]) / 255
    n, (height, width) = len(means), (int(data["height"]), int(data["width"]))
    leaves = [means, torch.full((n, 4), 0.5, device="cuda"), torch.full((n, 3), 0.01, device="cuda"),
              torch.full((n,), 0.5, device="cuda"), colors]
    leaves = [leaf.requires_grad_() for leaf in leaves]
    draw = lambda: rasterization(*leaves, tensor(data["viewmats"])[:1], tensor(data["Ks"])[:1], width, height)[0]
    step = lambda: draw().sub(0.5).abs().mean().backward()
    return {"gaussians": n, "size": [width, height], "image_ms": timed(draw, repeats), "step_ms": timed(step, repeats)}


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("what", choices=["images", "garden"])
    parser.add_argument("paths", nargs="+")
    parser.add_argument("--size", action="append", default=[])
    parser.add_argument("--repeats", type=int, default=20)
    args = parser.parse_args()
    try:
        import gsplat
        import torch

        if not torch.cuda.is_available():
            raise ImportError("torch sees no GPU")
        about = {"gsplat": gsplat.__version__, "device": torch.cuda.get_device_name()}
        sizes = [tuple(int(n) for n in size.split("x")) for size in args.size or ["1280x720"]]
        work = images(args.paths, sizes, args.repeats) if args.what == "images" else garden(args.paths[0], args.repeats)
        print(json.dumps({**about, args.what: work}))
    except ImportError as why:
        print(json.dumps({"missing": str(why)}))


if __name__ == "__main__":
    main()
