"""Joins what tools/gpu_day.sh wrote into one document (gpu_day.json) and one table (gpu_day.md).

usage: table.py OUT
"""

import json
import pathlib
import sys


def read(path):
    """A step's document; a text that is none is kept as it is (the tests of kernels)."""
    text = path.read_text(errors="replace").strip()
    try:
        return json.loads(text)
    except ValueError:
        return text[-2000:] or None


def stages(timing):
    """Where the time goes: pairs of the GPU, four numbers of the CPU."""
    told = timing.get("stages_ms") or []
    pairs = told if told and isinstance(told[0], list) else zip(["project", "sort", "bin", "blend"], told)
    return ", ".join(f"{name} {ms:.2f}" for name, ms in pairs)


def rows(steps):
    """Rows of the table: what, on what, result, where the time goes."""
    failed = steps.get("failed") or []
    for name in failed:
        yield [name, "", "**failed**", "see its log"]
    if isinstance(steps.get("kernels"), str):
        results = [line for line in steps["kernels"].splitlines() if line.startswith("test result")]
        yield ["tests of kernels", f"{len(results)} files", "; ".join(sorted(set(r.split(".")[0] for r in results))), ""]
    for step in ["images", "steps"]:
        found = steps.get(step) or {}
        for where, key in [("GPU", "gpu_render"), ("CPU", "render"), ("GPU", "gpu_train"), ("CPU", "train")]:
            for t in found.get(key, []):
                size = "x".join(str(n) for n in t["size"])
                what = "image" if "render" in key else "training step"
                on = f"{t['name']}, {t['gaussians']}, {size}"
                yield [f"{what}, {where}", on, f"{t.get('total_ms', t.get('step_ms')):.2f} ms", stages(t)]
                if t.get("bytes_ms"):
                    yield [f"{what} as bytes", on, f"{t['bytes_ms']:.2f} ms", ""]
                if t.get("staying_ms"):
                    yield [f"{what} that stays on the GPU", on, f"{t['staying_ms']:.2f} ms", ""]
                if t.get("texture_ms"):
                    yield [f"{what} that a window paints", on, f"{t['texture_ms']:.2f} ms", ""]
                if t.get("labels_ms"):
                    yield ["what its pixels belong to", on, "{:.2f} ms, on the CPU {:.2f} ms".format(*t["labels_ms"]), ""]
    for name, found in steps.items():
        if not isinstance(found, dict):
            continue
        if name.startswith("gsplat_") and "missing" in found:
            yield [name.replace("_", ", "), "", "not measured", found["missing"]]
        for t in found.get("images", []) if name == "gsplat_images" else []:
            result = f"{t['total_ms']:.2f} ms, {t['staying_ms']:.2f} ms" if "total_ms" in t else t["missing"]
            yield ["image, gsplat: alone, among many", f"{t['name']}, {t.get('gaussians', '')}, {t.get('size', '')}", result, ""]
        if "train_" in name:
            who = f"gsplat ({name.split('_')[1]})" if name.startswith("gsplat") else "training"
            for last in (found.get("evaluations") or found.get("curve") or [])[-1:]:
                result = f"{last['psnr']:.2f} dB after {last['secs']:.1f} s"
                yield [f"{who}, {name.split('_')[-1]} steps", f"{last['gaussians']} Gaussians", result, ""]


def main():
    out = pathlib.Path(sys.argv[1])
    steps = {p.stem: read(p) for p in sorted(out.glob("*.json")) if p.name != "gpu_day.json"}
    failed = out / "failed"
    steps["failed"] = failed.read_text().split() if failed.exists() else []
    adapter = (steps.get("images") or steps.get("steps") or {}).get("gpu")
    (out / "gpu_day.json").write_text(json.dumps({"adapter": adapter, **steps}, indent=1))
    head = [["what", "on what", "result", "where the time goes (ms)"], ["---"] * 4]
    lines = [f"Adapter: {adapter or 'none was asked'}", ""]
    lines += ["| " + " | ".join(cells) + " |" for cells in head + list(rows(steps))]
    text = "\n".join(lines) + "\n"
    (out / "gpu_day.md").write_text(text)
    print(text)


if __name__ == "__main__":
    main()
