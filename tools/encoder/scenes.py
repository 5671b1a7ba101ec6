"""Table-top scenes as .glb with a .json beside each that says what every node is.

    python scenes.py OUT --count 400 --seed 1 [--held-out] [--detail 0.8]

Training scenes never hold a combination that palette.py keeps; in held-out scenes every thing has a
kept combination of kind and colour, and most own colours of parts are kept ones.
"""

import argparse
import json
import struct
from pathlib import Path

import numpy as np

import palette
import shapes
import things


def dress(rng, kind, make, held_out, main=None, surface=None):
    """One thing: its parts with colours and surfaces, and its description."""
    main = main or palette.pick(rng, lambda c: palette.kept_whole(kind, c) == held_out)
    words = list(palette.SURFACES)
    surface = surface or words[rng.choice(len(words), p=list(palette.SURFACES.values()))]
    tone = palette.shade(rng, main)
    second = palette.shade(rng, palette.pick(rng, lambda c: c != main) if rng.random() < .6 else
                           ("black" if main == "white" else "white"))
    shared, parts, tones = {}, [], {}
    for name, mesh, role in make(things.Dice(rng)):
        base = palette.base_name(name)
        color = palette.part_color(rng, role, kind, base, main, shared, held_out)
        if color == main and role.split(":")[-1] in ("main", "like"):
            look, rgb = surface, tone
        else:
            look = rng.choice(["plain", "plain", "shiny", "matt", "metal"])
            rgb = tones.setdefault((base, color), palette.shade(rng, color))
        parts.append(dict(name=name, base=base, color=color, surface=look, rgb=rgb, mesh=mesh,
                          second=second, glow="glow" in role))
    return dict(name=f"{main} {kind}", kind=kind, color=main, surface=surface, parts=parts)


def material(glb, rng, part, pictures):
    look = part["surface"]
    rough = {"shiny": rng.uniform(.2, .35), "metal": rng.uniform(.35, .5), "plain": rng.uniform(.4, .7)}.get(look, .95)
    linear = [c / 12.92 if c <= .04045 else ((c + .055) / 1.055) ** 2.4 for c in (x / 255 for x in part["rgb"])]
    pbr = {"metallicFactor": 1.0 if look == "metal" else 0.0, "roughnessFactor": round(float(rough), 3)}
    picture = palette.texture(rng, look, part["rgb"], part["second"], side=glb.picture_px)
    if picture is None:
        pbr["baseColorFactor"] = [round(c, 4) for c in linear] + [1.0]
    else:
        key = (look, part["rgb"])
        if key not in pictures:
            pictures[key] = glb.texture(picture)
        pbr["baseColorTexture"] = {"index": pictures[key]}
    out = {"pbrMetallicRoughness": pbr}
    if part["glow"]:
        out["emissiveFactor"] = [round(.45 * c, 3) for c in linear]
    glb.doc["materials"].append(out)
    return len(glb.doc["materials"]) - 1, picture is not None


class Glb:
    """A binary glTF file as it grows."""

    def __init__(self, picture_px=48):
        self.bytes, self.picture_px = bytearray(), picture_px
        self.doc = {"asset": {"version": "2.0"}, "scene": 0, "nodes": [], "meshes": [], "materials": [], "accessors": [],
                    "bufferViews": [], "samplers": [{}]}

    def view(self, data):
        self.doc["bufferViews"].append({"buffer": 0, "byteOffset": len(self.bytes), "byteLength": len(data)})
        self.bytes += data + b"\0" * (-len(data) % 4)
        return len(self.doc["bufferViews"]) - 1

    def accessor(self, array, kind, component, bounds=False):
        a = {"bufferView": self.view(array.tobytes()), "componentType": component, "count": array.size // {"VEC3": 3,
             "VEC2": 2, "SCALAR": 1}[kind], "type": kind}
        if bounds:
            a["min"], a["max"] = array.min(0).tolist(), array.max(0).tolist()
        self.doc["accessors"].append(a)
        return len(self.doc["accessors"]) - 1

    def texture(self, picture):
        view = self.view(palette.png(picture))
        self.doc.setdefault("images", []).append({"bufferView": view, "mimeType": "image/png"})
        self.doc.setdefault("textures", []).append({"source": len(self.doc["images"]) - 1, "sampler": 0})
        return len(self.doc["textures"]) - 1

    def mesh(self, mesh, material, textured):
        attributes = {"POSITION": self.accessor(np.round(mesh.p * 65536).astype("<f4") / np.float32(65536), "VEC3", 5126, True),
                      "NORMAL": self.accessor(np.round(mesh.n, 3).astype("<f4"), "VEC3", 5126)}
        if textured:
            attributes["TEXCOORD_0"] = self.accessor(np.round(mesh.uv, 3).astype("<f4"), "VEC2", 5126)
        index = self.accessor(mesh.t.astype("<u2").ravel(), "SCALAR", 5123)
        self.doc["meshes"].append({"primitives": [{"attributes": attributes, "indices": index, "material": material}]})
        return len(self.doc["meshes"]) - 1

    def save(self, path):
        self.doc["buffers"] = [{"byteLength": len(self.bytes)}]
        text = json.dumps(self.doc, separators=(",", ":")).encode()
        text += b" " * (-len(text) % 4)
        total = 28 + len(text) + len(self.bytes)
        Path(path).write_bytes(b"glTF" + struct.pack("<III4s", 2, total, len(text), b"JSON") + text
                               + struct.pack("<I4s", len(self.bytes), b"BIN\0") + bytes(self.bytes))


def write(path, rng, placed, picture_px=48):
    """`placed`: (thing, position, turn in degrees)."""
    glb, tops = Glb(picture_px), []
    for thing, (x, y, z), turn in placed:
        children, pictures = [], {}
        for part in thing["parts"]:
            m, textured = material(glb, rng, part, pictures)
            glb.doc["nodes"].append({"name": part["name"], "mesh": glb.mesh(part["mesh"], m, textured)})
            children.append(len(glb.doc["nodes"]) - 1)
        a = np.radians(turn) / 2
        glb.doc["nodes"].append({"name": thing["name"], "translation": [round(float(v), 4) for v in (x, y, z)],
                                 "rotation": [0, round(float(np.sin(a)), 5), 0, round(float(np.cos(a)), 5)],
                                 "children": children})
        tops.append(len(glb.doc["nodes"]) - 1)
    glb.doc["scenes"] = [{"nodes": tops}]
    if not glb.doc.get("images"):
        del glb.doc["samplers"]
    glb.save(path)
    keys = ("name", "base", "color", "surface")
    described = [dict(name=t["name"], kind=t["kind"], color=t["color"], surface=t["surface"],
                      parts=[{k: p[k] for k in keys} for p in t["parts"]]) for t, _, _ in placed]
    Path(path).with_suffix(".json").write_text(json.dumps(described))


def layout(rng, made):
    """Things on the table, on a jittered grid, with the table and the floor."""
    cells = [(x, z) for x in (-.36, -.12, .12, .36) for z in (-.22, 0, .22)]
    order = rng.permutation(len(cells))
    placed = []
    for thing, cell in zip(made, order):
        reach = max(np.abs(p["mesh"].p[:, [0, 2]]).max() for p in thing["parts"])
        grow = min(rng.uniform(.85, 1.15), .115 / reach)
        for p in thing["parts"]:
            p["mesh"] = p["mesh"].scaled(grow, grow, grow)
        x, z = np.array(cells[cell]) + rng.uniform(-.02, .02, 2)
        # Mostly with its face towards the side from which most is seen, sometimes any way round.
        turn = rng.normal(0, 50) if rng.random() < .6 else rng.uniform(0, 360)
        placed.append((thing, (x, .74, z), turn))
    return placed


def main():
    ap = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    ap.add_argument("out", type=Path)
    ap.add_argument("--count", type=int, default=4)
    ap.add_argument("--seed", type=int, default=0)
    ap.add_argument("--held-out", action="store_true")
    ap.add_argument("--detail", type=float, default=.8)
    a = ap.parse_args()
    a.out.mkdir(parents=True, exist_ok=True)
    shapes.DETAIL = a.detail
    kinds, pool = list(things.KINDS), []
    pool_rng = np.random.default_rng([a.seed, 1])
    for i in range(a.count):
        rng = np.random.default_rng([a.seed, 0, i])
        made = []
        for _ in range(int(rng.integers(8, 12))):
            if not pool:
                pool = list(pool_rng.permutation(kinds))
            kind = pool.pop()
            made.append(dress(rng, kind, things.KINDS[kind], a.held_out))
            if rng.random() < .25:  # the same kind in another colour
                made.append(dress(rng, kind, things.KINDS[kind], a.held_out))
        ground = [(dress(rng, k, things.GROUND[k], a.held_out,
                         surface=rng.choice(["wooden", "plain", "matt"])), (0, 0, 0), 0) for k in ("table", "floor")]
        write(a.out / f"{i:04d}.glb", rng, ground + layout(rng, made[:12]))


if __name__ == "__main__":
    main()
