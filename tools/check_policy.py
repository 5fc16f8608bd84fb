#!/usr/bin/env python3
"""Checks a policy's ONNX file against its safetensors by other people's software.

    pip install onnx onnxruntime numpy
    tools/check_policy.py policies/prestoe/kick.safetensors policies/prestoe/kick.onnx

onnx checks the model's form; onnxruntime runs it on random observations; NumPy computes the same from the tensors of
the safetensors file, whose header is read here by hand. Ends with code 1 when they differ by more than 1e-4.
"""
import json
import struct
import sys

import numpy as np
import onnx
import onnxruntime


def tensors(path):
    data = open(path, "rb").read()
    (length,) = struct.unpack("<Q", data[:8])
    header = json.loads(data[8 : 8 + length])
    found = {}
    for name, entry in header.items():
        if name != "__metadata__" and entry["dtype"] == "F32":
            start, end = entry["data_offsets"]
            values = np.frombuffer(data[8 + length + start : 8 + length + end], dtype="<f4")
            found[name] = values.reshape(entry["shape"])
    return found, json.loads(header["__metadata__"]["instep"])


def main(policy, model):
    found, header = tensors(policy)
    onnx.checker.check_model(onnx.load(model), full_check=True)
    rng = np.random.default_rng(1)
    mean, deviation = found["observation.mean"], found["observation.deviation"]
    seen = (mean + deviation * rng.normal(scale=2.0, size=(64, len(mean)))).astype(np.float32)
    seen[0] = 1e6  # far outside: the clip must hold
    x = np.clip((seen - mean) / deviation, -10, 10)
    layer = 0
    while f"actor.{layer}.weight" in found:
        if layer:
            x = np.maximum(x, 0) if header["activation"] == "relu" else np.where(x > 0, x, np.expm1(x))
        x = x @ found[f"actor.{layer}.weight"].T + found[f"actor.{layer}.bias"]
        layer += 1
    session = onnxruntime.InferenceSession(model)
    (action,) = session.run(["action"], {"observation": seen})
    worst = np.abs(action - x).max() / max(1.0, np.abs(x).max())
    print(f"{header['robot']}: {len(mean)} observations, {x.shape[1]} actions, {layer} layers; worst difference {worst:.1e}")
    return int(worst > 1e-4)


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    sys.exit(main(*sys.argv[1:]))
