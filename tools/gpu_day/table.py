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


def stages(samples):
    """Rows of what `fmlgs bench` measured; the parts of a stage stand beside it."""
    for whole in samples:
        if ": " in whole["stage"]:
            continue
        mine = [s for s in samples if s["on"] == whole["on"] and s["stage"].startswith(whole["stage"] + ": ")]
        parts = [f"{s['stage'].split(': ')[1]} {s['median']:.2f}" for s in mine if s["unit"] == "ms"]
        yield [whole["stage"], whole["on"], f"{whole['median']:.4g} {whole['unit']}", ", ".join(parts)]


def rows(steps):
    """Rows of the table: what, on what, result, where the time goes."""
    failed = steps.get("failed") or []
    for name in failed:
        yield [name, "", "**failed**", "see its log"]
    if isinstance(steps.get("kernels"), str):
        results = [line for line in steps["kernels"].splitlines() if line.startswith("test result")]
        yield ["tests of kernels", f"{len(results)} files", "; ".join(sorted(set(r.split(".")[0] for r in results))), ""]
    for step in ["images", "steps"]:
        yield from stages((steps.get(step) or {}).get("samples", []))
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
