#!/usr/bin/env python3
"""Writes tests/fixtures/networks/lama.onnx: a network with the inputs and outputs of LaMa's ONNX file.

What is masked becomes the mean of what is not. No weights, so that what is right is known without running it elsewhere.
"""

from pathlib import Path

import numpy as np
import onnx
from onnx import TensorProto, helper, numpy_helper

SIDE = 32


def main() -> None:
    def info(name: str, channels: int) -> onnx.ValueInfoProto:
        return helper.make_tensor_value_info(name, TensorProto.FLOAT, [1, channels, SIDE, SIDE])

    one = numpy_helper.from_array(np.float32(1.0), "one")
    byte = numpy_helper.from_array(np.float32(255.0), "byte")
    nodes = [
        helper.make_node("Sub", ["one", "mask"], ["known"]),
        helper.make_node("Mul", ["image", "known"], ["rest"]),
        helper.make_node("GlobalAveragePool", ["rest"], ["sum"]),
        helper.make_node("GlobalAveragePool", ["known"], ["share"]),
        helper.make_node("Div", ["sum", "share"], ["mean"]),
        helper.make_node("Mul", ["mean", "mask"], ["filled"]),
        helper.make_node("Add", ["rest", "filled"], ["all"]),
        helper.make_node("Mul", ["all", "byte"], ["output"]),
    ]
    graph = helper.make_graph(nodes, "lama", [info("image", 3), info("mask", 1)], [info("output", 3)], [one, byte])
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=8)
    onnx.checker.check_model(model)
    out = Path(__file__).resolve().parents[2] / "tests/fixtures/networks/lama.onnx"
    out.write_bytes(model.SerializeToString())


if __name__ == "__main__":
    main()
