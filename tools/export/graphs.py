"""Writes a module as an ONNX graph, and runs graphs with ONNX Runtime.

Every graph is opset 17, float32, with named inputs and outputs. What stands in the way of a small
engine is kept out: no complex numbers, no Loop, If or sequences, no shape that depends on values.
"""

import hashlib
import json
from pathlib import Path

import numpy as np
import onnx
import onnxruntime
import torch

OPSET = 17
# Whether what depends on weights alone is computed here. Not for templates, whose weights come later: engines do it then.
FOLD = True
FORBIDDEN = {"Loop", "If", "Scan", "SequenceEmpty", "SequenceInsert", "ConcatFromSequence", "SequenceAt", "NonZero", "Unique"}


def export(module, inputs, outputs, path, dynamic=None):
    """Writes `module` to `path`. `inputs`: name -> example tensor, in the order of `forward`;
    `outputs`: names; `dynamic`: input or output name -> {axis: symbol}."""
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    module.eval()
    # The fused attention that PyTorch prefers in evaluation has no ONNX form; the plain one is the same function.
    torch.backends.mha.set_fastpath_enabled(False)
    with torch.no_grad():
        torch.onnx.export(module, tuple(inputs.values()), str(path), input_names=list(inputs), output_names=list(outputs),
                          dynamic_axes=dynamic or {}, opset_version=OPSET, dynamo=False, do_constant_folding=FOLD,
                          # Otherwise norms over batches are folded into the convolutions before them; engines do that too.
                          training=torch.onnx.TrainingMode.PRESERVE)
    model = onnx.load(str(path))
    label_shapes(model, inputs, dynamic or {})
    present = {node.op_type for node in model.graph.node} & FORBIDDEN
    if present:
        raise SystemExit(f"{path.name}: {sorted(present)} may not be in a graph")
    kept = {value.name for value in model.graph.input}
    if kept != set(inputs):
        raise SystemExit(f"{path.name}: inputs {sorted(set(inputs) - kept)} have no effect")
    shorten(model.graph)
    onnx.save(model, str(path))
    onnx.checker.check_model(str(path))
    print(f"{path.name}: {path.stat().st_size:,} bytes, {len(model.graph.node)} nodes")
    return path


def label_shapes(model, inputs, dynamic):
    """The exporter leaves outputs of dynamic graphs with invented symbols; names that repeat the inputs' are plainer."""
    del model.graph.value_info[:]
    symbols = {s for axes in dynamic.values() for s in axes.values()}
    for value in model.graph.output:
        axes = dynamic.get(value.name, {})
        for axis, dim in enumerate(value.type.tensor_type.shape.dim):
            if axis in axes:
                dim.dim_param = axes[axis]
            elif dim.dim_param and dim.dim_param not in symbols:
                # Not declared dynamic, so the number is known to the caller; drop the invented name.
                dim.ClearField("dim_param")


def shorten(graph):
    """Short names for nodes and for what passes between them. The exporter's spell out the whole path through the
    module (most of the bytes of a small graph), and record where in the sources a node came from, with file paths."""
    kept = {v.name for v in graph.input} | {v.name for v in graph.output} | {t.name for t in graph.initializer}
    names = {}
    for k, node in enumerate(graph.node):
        node.doc_string, node.name = "", f"{node.op_type}{k}"
        del node.metadata_props[:]
        for values in (node.input, node.output):
            for i, name in enumerate(values):
                if name and name not in kept:
                    values[i] = names.setdefault(name, f"v{len(names)}")


class Graph:
    """One ONNX graph under ONNX Runtime, one thread, called with named arrays."""

    def __init__(self, path, threads=1):
        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads = threads
        options.log_severity_level = 3
        self.session = onnxruntime.InferenceSession(str(path), options, providers=["CPUExecutionProvider"])
        self.outputs = [o.name for o in self.session.get_outputs()]

    def __call__(self, **inputs):
        values = self.session.run(None, {k: np.ascontiguousarray(v) for k, v in inputs.items()})
        return dict(zip(self.outputs, values))


def relative_error(got, expected):
    """The largest difference, relative to the largest expected magnitude. Shapes have to be equal."""
    got, expected = np.asarray(got, np.float64), np.asarray(expected, np.float64)
    if got.shape != expected.shape:
        return float("inf")
    if got.size == 0:
        return 0.0
    return float(np.abs(got - expected).max() / max(np.abs(expected).max(), 1e-12))


def iou(a, b):
    """Intersection over union of two binary masks; two empty masks are equal."""
    a, b = np.asarray(a, bool), np.asarray(b, bool)
    union = np.logical_or(a, b).sum()
    return 1.0 if union == 0 else float(np.logical_and(a, b).sum() / union)


def save_metadata(path, files, **fields):
    """The JSON that describes one set of graphs; `files`: role -> path of a graph beside it."""
    graphs = {}
    for role, file in files.items():
        file = Path(file)
        model = onnx.load(str(file), load_external_data=False)
        graphs[role] = {"file": file.name, "bytes": file.stat().st_size, "sha256": hashlib.sha256(file.read_bytes()).hexdigest(),
                        "inputs": [v.name for v in model.graph.input], "outputs": [v.name for v in model.graph.output]}
    Path(path).write_text(json.dumps({"version": 1, **fields, "opset": OPSET, "graphs": graphs}, indent=1) + "\n")
    print(Path(path).name)


def numbers(tensor):
    """A float32 tensor as plain numbers that read back to the same bits."""
    return [float(np.float32(v)) for v in tensor.detach().reshape(-1).tolist()]
