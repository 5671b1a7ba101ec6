"""int8 and float16 variants of exported graphs, and a table of what they cost.

    python quantise.py models/clip-vit-b16.json --out models/quantised

int8: weights of matrix products as int8, activations quantised as they come (dynamic). float16: weights are
stored as float16 and widened when the graph is loaded, sums stay float32: half the file, the same
speed, every engine. The error is measured on seeded inputs of the
graphs' own shapes, except that pictures pass through the encoder first where one stands beside a graph.
"""

import argparse
import json
import time
from pathlib import Path

import numpy as np
import onnx
from onnxruntime.quantization import QuantType, quantize_dynamic

from graphs import Graph

SIZES = {"n": 2, "p": 3, "m": 3}


def example(graph, known, rng):
    """Inputs for a graph: what a graph before it gave under the same name, else seeded values in range."""
    values = {}
    for v in graph.input:
        kind = v.type.tensor_type
        shape = [d.dim_value or SIZES.get(d.dim_param, 1) for d in kind.shape.dim]
        if v.name in known:
            x = known[v.name]
        elif v.name == "tokens":
            x = rng.integers(1, 900, shape)
            x[:, 12] = 1023 if known["vocabulary"] == 1024 else 49407
            x[:, 13:] = 0
        elif v.name == "memory_time":
            x = np.arange(shape[0])[::-1]
        elif v.name == "point_labels":
            x = np.tile([1.0, 0.0, -1.0], (shape[0], 1))
        elif v.name == "point_coords":
            x = rng.uniform(0, known["side"], shape)
        elif v.name in ("has_mask", "binarise"):
            x = np.zeros(shape)
        elif v.name.endswith("_valid"):
            x = np.ones(shape)
        elif v.name == "mask":
            x = np.kron(rng.random((1, 1, 4, 4)) > .5, np.ones((1, 1, shape[2] // 4, shape[3] // 4)))
        elif v.name in ("image", "pixels"):
            coarse = rng.normal(0, 1, (*shape[:2], 8, 8))
            x = np.kron(coarse, np.ones((1, 1, shape[2] // 8, shape[3] // 8))) + rng.normal(0, .2, shape)
        else:
            x = rng.normal(0, 1, shape)
        values[v.name] = np.asarray(x, np.int64 if kind.elem_type == onnx.TensorProto.INT64 else np.float32)
    return values


def error(got, expected):
    """Largest over outputs of the root mean square difference, relative to the root mean square of the output."""
    return max(float(np.sqrt(np.mean((got[k] - expected[k]) ** 2) / max(np.mean(expected[k] ** 2), 1e-20))) for k in expected)


def least_cosine(got, expected):
    """Least cosine between a row of a result and of its reference, for embeddings."""
    if "embedding" not in expected:
        return None
    a, b = got["embedding"], expected["embedding"]
    return float(((a * b).sum(1) / np.linalg.norm(a, axis=1) / np.linalg.norm(b, axis=1)).min())


def timed(graph, inputs):
    graph(**inputs)
    start = time.perf_counter()
    out = graph(**inputs)
    return out, time.perf_counter() - start


def main():
    ap = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    ap.add_argument("metadata", type=Path, nargs="+")
    ap.add_argument("--out", type=Path, required=True)
    a = ap.parse_args()
    a.out.mkdir(parents=True, exist_ok=True)
    print(f"{'graph':32} {'variant':8} {'MB':>8} {'error':>9} {'cosine':>8} {'seconds':>8}")
    for path in a.metadata:
        m = json.loads(path.read_text())
        known, rng = {"side": m["image_size"], "vocabulary": m.get("vocab_size")}, np.random.default_rng(0)
        for role, entry in m["graphs"].items():
            source = path.parent / entry["file"]
            model = onnx.load(str(source))
            inputs = example(model.graph, known, rng)
            expected, seconds = timed(Graph(source), inputs)
            if role == "encoder":
                known.update(expected)
            row(source.name, "float32", source, 0.0, 1.0 if "embedding" in expected else None, seconds)
            for variant, make in (("int8", int8), ("float16", float16)):
                target = a.out / f"{source.stem}_{variant}.onnx"
                try:
                    make(source, model, target)
                    got, seconds = timed(Graph(target), inputs)
                    row(source.name, variant, target, error(got, expected), least_cosine(got, expected), seconds)
                except Exception as problem:  # an operator that has no such form: said in the table, the others go on
                    print(f"{source.name:32} {variant:8} not possible: {str(problem).splitlines()[0][:120]}")


def row(name, variant, file, off, cosine, seconds):
    print(f"{name:32} {variant:8} {file.stat().st_size / 1e6:8.1f} {off:9.1e} {'' if cosine is None else f'{cosine:8.5f}':>8} {seconds:8.3f}")


def int8(source, model, target):
    quantize_dynamic(str(source), str(target), op_types_to_quantize=["MatMul", "Gemm"], weight_type=QuantType.QInt8, per_channel=True)


def float16(source, model, target):
    copy = onnx.ModelProto()
    copy.CopyFrom(model)
    widen = []
    for tensor in copy.graph.initializer:
        values = onnx.numpy_helper.to_array(tensor)
        # Small tensors are norms and biases: nothing to save, and all precision kept.
        if tensor.data_type != onnx.TensorProto.FLOAT or values.size < 1024:
            continue
        name, narrow = tensor.name, values.astype(np.float16)
        if not np.array_equal(np.isfinite(narrow), np.isfinite(values)):
            raise ValueError(f"{name} does not fit float16")
        tensor.CopyFrom(onnx.numpy_helper.from_array(narrow, f"{name}_half"))
        widen.append(onnx.helper.make_node("Cast", [f"{name}_half"], [name], name=f"widen {name}", to=onnx.TensorProto.FLOAT))
    # Nodes are in order of use, so these come first.
    nodes = [*widen, *copy.graph.node]
    del copy.graph.node[:]
    copy.graph.node.extend(nodes)
    onnx.checker.check_model(copy)
    onnx.save(copy, str(target))


if __name__ == "__main__":
    main()
