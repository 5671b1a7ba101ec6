"""Checkpoint fixtures: the reduced networks as the official code stores them and their templates, and small files of
every kind that the program reads, whose numbers follow a rule: the k-th of a tensor is k / 8."""

from collections import OrderedDict

import torch
from safetensors.torch import save_file

import export_clip
import fixture_clip
import graphs
import template


def counted(*shape, dtype=torch.float32):
    return (torch.arange(torch.Size(shape).numel(), dtype=torch.float64) / 8).reshape(shape).to(dtype)


class Inner(torch.nn.Module):
    def __init__(self):
        super().__init__()
        self.weight = torch.nn.Parameter(counted(3, 4, dtype=torch.float16))
        self.register_buffer("steps", torch.tensor([3], dtype=torch.int64))

    def forward(self, x):
        return x @ self.weight.float()


class Script(torch.nn.Module):
    def __init__(self):
        super().__init__()
        self.inner, self.scale = Inner(), torch.nn.Parameter(counted(5))
        self.sizes = [1, 2, 3]

    def forward(self, x):
        return self.inner(x).sum() + self.scale.sum() + self.sizes[0]


def write(out):
    whole = counted(4, 6)
    tensors = OrderedDict(
        single=counted(2, 3), half=counted(7, dtype=torch.float16), brain=counted(2, 2, dtype=torch.bfloat16),
        double=counted(3, dtype=torch.float64), count=torch.tensor([5, 6], dtype=torch.int64),
        turned=whole.t(), piece=whole[1:3, 2:5], scalar=torch.tensor(0.5), parameter=torch.nn.Parameter(counted(4)))
    tensors._metadata = {"": {"version": 1}}
    torch.save({"model": tensors, "epoch": 3, "rate": 0.5, "names": ["a", "b"], "done": True}, out / "tiny.pt")
    torch.jit.script(Script()).save(str(out / "tiny_script.pt"))
    save_file({k: v.detach().contiguous() for k, v in tensors.items() if k not in ("turned", "piece")}, str(out / "tiny.safetensors"))
    graphs.FOLD = False
    model = fixture_clip.model()
    torch.save(model.state_dict(), out / "clip.pt")
    # Of other weights, so that none of them can stay in it.
    template.write(export_clip, export_clip.load(seed=99, reduced=True), None, "clip", out)
    (out / "clip.zip").rename(out / "clip_template.zip")


def write_masks(out):
    """Of SAM, SAM 2 and MobileSAM; the graphs of the first two are those of their other fixtures."""
    import export_sam
    import export_sam2
    import fixture_sam
    import fixture_sam2
    import sam2_models
    import sam_models
    mobile = sam_models.load("vit_t", None, 4, True)
    graphs.FOLD = True
    export_sam.write(mobile, out, "mobile", "vit_t reduced")
    torch.save(fixture_sam.model().state_dict(), out / "sam.pth")
    torch.save({"model": fixture_sam2.model().state_dict()}, out / "sam2.pt")
    torch.save(mobile.state_dict(), out / "mobile.pt")
    graphs.FOLD = False
    whole = export_sam.MOST_WEIGHTS
    for name, kind, export, model in (("sam", "sam", export_sam, sam_models.load(seed=99, small=True)),
                                      ("sam", "sam_parts", export_sam, sam_models.load(seed=99, small=True)),
                                      ("sam2", "sam2", export_sam2, sam2_models.load(seed=99, reduced=True)),
                                      ("mobile", "mobile", export_sam, sam_models.load("vit_t", None, 99, True))):
        export_sam.MOST_WEIGHTS = 0 if kind == "sam_parts" else whole
        template.write(export, model, None, name, out)
        (out / f"{name}.zip").rename(out / f"{kind}_template.zip")
