"""SAM 2 video tracking with nothing but the exported graphs, ONNX Runtime and numpy.

The pattern for the program's own tracker: README.md describes the same steps in words. One object at a
time, frames encoded once. Masks are logits; a pixel belongs to the object where the logit is > 0.
"""

import functools
import json
from pathlib import Path

import cv2
import numpy as np
from PIL import Image

from graphs import Graph


class Tracker:
    def __init__(self, metadata):
        metadata = Path(metadata)
        self.m = json.loads(metadata.read_text())
        self.g = {role: Graph(metadata.parent / g["file"]) for role, g in self.m["graphs"].items()}
        self.no_memory = np.array(self.m["no_memory_embedding"], np.float32)[None, :, None, None]
        self.no_pointer = np.array(self.m["no_object_pointer"], np.float32)[None]
        self.side = self.m["image_size"]
        self.frames, self.size, self.objects = [], None, {}

    # --- pictures ---

    def open(self, pictures):
        """`pictures`: uint8 [H,W,3] each, all of one size."""
        self.size = pictures[0].shape[:2]
        self.frames = [self.encode(p) for p in pictures]
        self.objects = {}

    def prepare(self, picture):
        """uint8 [H,W,3] -> float32 [1,3,S,S]: squashed with Pillow's bicubic filter, then normalised."""
        resized = np.asarray(Image.fromarray(picture).resize((self.side, self.side), Image.BICUBIC))
        unit = (resized / 255.0).astype(np.float32)
        unit = (unit - np.array(self.m["mean"], np.float32)) / np.array(self.m["std"], np.float32)
        return unit.transpose(2, 0, 1)[None]

    def encode(self, picture):
        return self.g["encoder"](image=self.prepare(picture))

    # --- prompts ---

    def add_points(self, frame, name, points=None, labels=None, box=None):
        """Points [p,2] and a box [x0,y0,x1,y1], both in pixels of the picture."""
        coords, marks = [], []
        if box is not None:
            coords += [box[:2], box[2:]]
            marks += [2, 3]
        if points is not None:
            coords += list(points)
            marks += list(labels)
        height, width = self.size
        coords = np.array(coords, np.float32) / np.array([width, height], np.float32) * np.float32(self.side)
        o = self.objects.setdefault(name, Object())
        first = frame not in o.tracked
        earlier = o.pending.get(frame) or o.prompted.get(frame) or o.followed.get(frame)
        mask = None if earlier is None else np.clip(earlier.logits, -32, 32)
        if first:
            embeddings = self.frames[frame]["image_embeddings"] + self.no_memory
        else:
            embeddings = self.remember(o, frame, o.tracked[frame])
        out = self.decode(frame, embeddings, coords, np.array(marks, np.float32), mask, self.may_be_three(first, len(marks)))
        out.logits = self.fill(out.logits)
        o.pending[frame] = out
        if not first:
            o.corrections.add(frame)

    def add_mask(self, frame, name, mask):
        """A binary mask of the picture's size."""
        o = self.objects.setdefault(name, Object())
        if mask.shape != (self.side, self.side):
            mask = antialiased(mask.astype(np.float32), self.side) >= 0.5
        mask = mask.astype(np.float32)[None, None]
        given = self.g["mask_prompt"](mask=mask)
        # The pointer comes from the decoder, with the given mask as its prompt and no memory; the mask
        # itself is taken as it is.
        out = self.decode(frame, self.frames[frame]["image_embeddings"], np.zeros((0, 2), np.float32), np.zeros(0, np.float32),
                          given["mask_input"], False)
        there = bool(mask.any())
        out.logits = self.fill(given["low_res_mask"])
        out.score = np.array([[10.0 if there else -10.0]], np.float32)
        if not there:
            out.pointer = self.no_pointer.copy()
        o.pending[frame] = out
        if frame in o.tracked:
            o.corrections.add(frame)

    def may_be_three(self, conditioning, points):
        low, high = self.m["multimask_points"]
        return (conditioning or self.m["multimask_when_tracking"]) and low <= points <= high

    # --- one frame ---

    def decode(self, frame, embeddings, coords, labels, mask, three):
        """The best mask of one object on one frame, its pointer and its occlusion score."""
        # Without a box among the prompts or with one, the video path always adds an empty point.
        if len(labels) == 0:
            coords, labels = np.zeros((1, 2), np.float32), -np.ones(1, np.float32)
        coords, labels = np.concatenate([coords, np.zeros((1, 2), np.float32)]), np.append(labels, np.float32(-1))
        f, quarter = self.frames[frame], self.side // 4
        out = self.g["decoder"](
            image_embeddings=embeddings, high_res_features1=f["high_res_features1"], high_res_features2=f["high_res_features2"],
            point_coords=coords[None], point_labels=labels[None].astype(np.float32),
            mask_input=np.zeros((1, 1, quarter, quarter), np.float32) if mask is None else mask,
            has_mask=np.array([0.0 if mask is None else 1.0], np.float32))
        which, token = self.choose(out["masks"][0], out["iou"][0], three)
        score = out["object_score"]
        logits = out["masks"][:, which:which + 1]
        if score[0, 0] <= 0:
            logits = np.full_like(logits, self.m["absent_score"])
        return Output(logits, out["object_pointers"][:, token], score)

    def choose(self, masks, iou, three):
        """Index of the mask and of the pointer among the four."""
        best = 1 + int(np.argmax(iou[1:]))
        if three:
            return best, best if self.m["pointer_of_best_mask"] else 0
        if self.m["single_mask_falls_back"]:
            delta = self.m["stability_delta"]
            inner, outer = (masks[0] > delta).sum(), (masks[0] > -delta).sum()
            stable = np.float32(inner) / np.float32(outer) if outer > 0 else 1.0
            if stable < np.float32(self.m["stability_threshold"]):
                return best, 0
        return 0, 0

    def fill(self, logits):
        """Background regions (8 neighbours) of at most `fill_hole_area` low-resolution pixels become object."""
        most = self.m["fill_hole_area"]
        if most == 0:
            return logits
        _, found, stats, _ = cv2.connectedComponentsWithStats((logits[0, 0] <= 0).astype(np.uint8), connectivity=8)
        hole = (found > 0) & (stats[found, cv2.CC_STAT_AREA] <= most)
        return np.where(hole, np.float32(0.1), logits)

    def memorise(self, out, frame, logits, prompted):
        features = self.g["memory_encoder"](
            image_embeddings=self.frames[frame]["image_embeddings"], mask_logits=logits, object_score=out.score,
            binarise=np.array([1.0 if prompted and self.m["binarise_prompted"] else 0.0], np.float32))["memory_features"]
        out.memory = to_bfloat16(features)

    def remember(self, o, frame, reverse):
        """The frame's embeddings, conditioned on what is known of the object."""
        memories, pointers = self.select(o, frame, reverse)
        inputs = {
            "image_embeddings": self.frames[frame]["image_embeddings"],
            "memory_features": np.concatenate([out.memory for _, out in memories]),
            "memory_time": np.array([time for time, _ in memories], np.int64),
            "memory_valid": np.ones(len(memories), np.float32),
        }
        if pointers:
            offsets, rows = zip(*pointers)
            inputs.update(object_pointers=np.concatenate(rows), pointer_offset=np.array(offsets, np.float32), pointer_valid=np.ones(len(rows), np.float32))
        else:  # one row that counts for nothing, since no engine likes empty tensors
            inputs.update(object_pointers=np.zeros_like(self.no_pointer), pointer_offset=np.zeros(1, np.float32), pointer_valid=np.zeros(1, np.float32))
        if not self.m["pointer_time"]:
            del inputs["pointer_offset"]
        return self.g["memory_attention"](**inputs)["conditioned"]

    def select(self, o, frame, reverse):
        """Which memories ((time row, output)) and pointers ((offset, row)) a frame sees, in order."""
        known, step = self.m["memories"], -1 if reverse else 1
        chosen, others = closest(o.prompted, frame, self.m["max_conditioning_frames"])
        memories = [(known - 1, out) for out in chosen.values()]
        for age in range(known - 1, 0, -1):  # oldest first
            out = o.followed.get(frame - step * age, others.get(frame - step * age))
            if out is not None:
                memories.append((age - 1, out))
        most = min(len(self.frames), self.m["pointers"])
        pointers = []
        for t, out in chosen.items():
            ahead = (frame - t) * step
            if ahead < 0 and self.m["pointers_only_from_past"]:
                continue
            pointers.append((ahead if self.m["pointer_time_signed"] else abs(ahead), out.pointer))
        for age in range(1, most):
            t = frame - step * age
            if not 0 <= t < len(self.frames):
                break
            out = o.followed.get(t, others.get(t))
            if out is not None:
                pointers.append((age, out.pointer))
        return memories, [(np.float32(t) / np.float32(max(most - 1, 1)), row) for t, row in pointers]

    # --- the whole track ---

    def run(self, reverse=False, start=None, replace_memory=None):
        """Yields (frame, object name -> Output), from the first prompted frame on, or back from it.
        `replace_memory`: changes the conditioned embeddings, for negative controls."""
        for o in self.objects.values():
            for frame, out in o.pending.items():
                self.memorise(out, frame, out.logits, True)
                (o.followed if frame in o.corrections else o.prompted)[frame] = out
                o.corrections.discard(frame)
            o.pending.clear()
            for frame in o.prompted:
                o.followed.pop(frame, None)
        if start is None:
            start = min(t for o in self.objects.values() for t in o.prompted)
        order = range(start, -1, -1) if reverse and start > 0 else [] if reverse else range(start, len(self.frames))
        for frame in order:
            results = {}
            for name, o in self.objects.items():
                out = o.prompted.get(frame)
                if out is None:
                    embeddings = self.remember(o, frame, reverse)
                    if replace_memory is not None:
                        embeddings = replace_memory(self, o, frame, embeddings)
                    out = self.decode(frame, embeddings, np.zeros((0, 2), np.float32), np.zeros(0, np.float32), None, self.may_be_three(False, 0))
                    self.memorise(out, frame, out.logits, False)
                    out.logits = self.fill(out.logits)
                    o.followed[frame] = out
                o.tracked[frame] = reverse
                results[name] = out
            yield frame, results

    def full_size(self, logits):
        """Logits [1,1,h,w] -> [H,W] of the picture: bilinear, half-pixel centres, no anti-aliasing."""
        return bilinear(logits[0, 0], *self.size)


class Object:
    """What is kept of one object: outputs by frame."""

    def __init__(self):
        self.pending, self.prompted, self.followed = {}, {}, {}
        self.tracked, self.corrections = {}, set()


class Output:
    def __init__(self, logits, pointer, score):
        self.logits, self.pointer, self.score, self.memory = logits, pointer, score, None


def closest(prompted, frame, most):
    """The conditioning frames that take part, and the rest: nearest before, nearest from here on, then by distance."""
    if most == -1 or len(prompted) <= most:
        return dict(prompted), {}
    order = []
    before, after = [t for t in prompted if t < frame], [t for t in prompted if t >= frame]
    order += [max(before)] if before else []
    order += [min(after)] if after else []
    rest = sorted((t for t in prompted if t not in order), key=lambda t: abs(t - frame))
    order += rest[:most - len(order)]
    return {t: prompted[t] for t in order}, {t: v for t, v in prompted.items() if t not in order}


def to_bfloat16(values):
    """Rounded to bfloat16 (to nearest, ties to even), as float32: memories are kept in that format."""
    bits = np.ascontiguousarray(values, np.float32).view(np.uint32)
    rounded = (bits + 0x7FFF + ((bits >> 16) & 1)) & np.uint32(0xFFFF0000)
    return rounded.astype(np.uint32).view(np.float32)


@functools.cache
def triangle(inputs, outputs, antialias):
    """[outputs, inputs] weights of bilinear resizing. Anti-aliased, the triangle grows with the shrinkage."""
    scale = inputs / outputs
    reach = max(scale, 1.0) if antialias else 1.0
    centre = (np.arange(outputs) + 0.5) * scale
    weights = np.maximum(0.0, 1.0 - np.abs((np.arange(inputs)[None] + 0.5 - centre[:, None]) / reach))
    if not antialias:
        # Rows past the border take the border pixel. Positions in float32, as PyTorch has them: in float64 a mask's
        # border differs by a pixel now and then.
        weights = np.zeros((outputs, inputs), np.float32)
        at = np.maximum((np.arange(outputs, dtype=np.float32) + np.float32(0.5)) * np.float32(scale) - np.float32(0.5), np.float32(0))
        low = np.minimum(at.astype(int), inputs - 1)
        share = at - low
        weights[np.arange(outputs), low] += 1 - share
        weights[np.arange(outputs), np.minimum(low + 1, inputs - 1)] += share
        return weights
    return (weights / weights.sum(1, keepdims=True)).astype(np.float32)


def antialiased(mask, side):
    return triangle(mask.shape[0], side, True) @ mask @ triangle(mask.shape[1], side, True).T


def bilinear(logits, height, width):
    return triangle(logits.shape[0], height, False) @ logits @ triangle(logits.shape[1], width, False).T
