"""Writes everything in `tests/fixtures/networks`: reduced graphs, and official results with them.

    python fixtures.py --out ../../tests/fixtures/networks --names coco_names.txt lvis_names.txt oid_names.txt objects365_names.csv

`--names`: class names, one a line (of a .csv the last column). Only the parts named in `--only` are written.
"""

import argparse
from pathlib import Path

import torch

PARTS = ("tokens", "clip", "sam", "automatic", "sam2", "checkpoints", "mask_checkpoints")


def main():
    ap = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    ap.add_argument("--out", type=Path, required=True)
    ap.add_argument("--names", type=Path, nargs="*", default=[])
    ap.add_argument("--only", nargs="*", choices=PARTS, default=PARTS)
    a = ap.parse_args()
    a.out.mkdir(parents=True, exist_ok=True)
    torch.set_num_threads(1)  # sums in one order, so that a second run writes the same bytes
    if "tokens" in a.only:
        import fixture_clip
        if not a.names:
            ap.error("the tokens need --names")
        _, names, strange = fixture_clip.write_tokens(a.out, a.names)
        print(f"tokens of {len(names)} names and {len(strange)} awkward strings")
    if "clip" in a.only:
        import fixture_clip
        fixture_clip.write_networks(a.out)
    if "sam" in a.only:
        import fixture_sam
        fixture_sam.write(a.out)
    if "automatic" in a.only:
        import fixture_automatic
        fixture_automatic.write(a.out)
    if "sam2" in a.only:
        import fixture_sam2_write
        fixture_sam2_write.write(a.out)
    if "checkpoints" in a.only:
        import fixture_checkpoints
        fixture_checkpoints.write(a.out)
    if "mask_checkpoints" in a.only:
        import fixture_checkpoints
        fixture_checkpoints.write_masks(a.out)
    for file in sorted(a.out.iterdir()):
        file.chmod(0o644)
    print(f"{sum(f.stat().st_size for f in a.out.iterdir()):,} bytes in all")


if __name__ == "__main__":
    main()
