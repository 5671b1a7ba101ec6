"""Times gsplat, from its package, on the splats and cameras that `fmlgs bench` draws.

usage: gsplat_times.py SPLAT.ply... [--size WxH]... [--repeats N]

Prints one JSON document: milliseconds of an image that is waited for, and of one among many that follow each other; both
stay on the GPU. Needs torch with a GPU and gsplat; without them it says so in the document ("missing").
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
    """Median milliseconds of a run that is waited for, and the mean of many that follow each other."""
    import torch

    run()
    taken = []
    for _ in range(repeats):
        torch.cuda.synchronize()
        start = time.perf_counter()
        run()
        torch.cuda.synchronize()
        taken.append(1e3 * (time.perf_counter() - start))
    start = time.perf_counter()
    for _ in range(5 * repeats):
        run()
    torch.cuda.synchronize()
    return statistics.median(taken), 1e3 * (time.perf_counter() - start) / (5 * repeats)


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
                taken = [timed(lambda: draw(k), repeats) for k in range(3)]
            waited, following = (statistics.median(t[i] for t in taken) for i in range(2))
            about = {"name": path, "gaussians": len(splat["means"]), "size": [width, height]}
            rows.append({**about, "total_ms": waited, "staying_ms": following})
    return rows


def main():
    parser = argparse.ArgumentParser()
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
        print(json.dumps({**about, "images": images(args.paths, sizes, args.repeats)}))
    except ImportError as why:
        print(json.dumps({"missing": str(why)}))


if __name__ == "__main__":
    main()
