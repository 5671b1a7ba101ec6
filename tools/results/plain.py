"""Plain trainings: 3DGS, gsplat, splatfacto, 2DGS, Mip-Splatting."""

import json

import numpy as np
import torch
from plyfile import PlyData, PlyElement

import torch_files
from reference import rotations
from sample import Sample
from scene import look_at
from torch_files import parameter

NAMES = ["xyz", "f_dc", "f_rest", "scaling", "rotation", "opacity"]


def _groups(parts):
    return [(name, part, 1e-3) for name, part in zip(NAMES, parts)]


def inria(root, scene):
    """3DGS: two iterations, a checkpoint with the optimizer and a scalar of NumPy 1."""
    s = Sample(root, "3dgs", scene)
    s.model_folder()
    s.ply("point_cloud", "iteration_7000", "point_cloud.ply", rows=slice(0, 12))
    s.ply("point_cloud", "iteration_30000", "point_cloud.ply")
    points = np.empty(4, [(n, "f4") for n in ("x", "y", "z", "nx", "ny", "nz")] + [(n, "u1") for n in ("red", "green", "blue")])
    for i, name in enumerate(("x", "y", "z")):
        points[name] = scene.xyz[:4, i]
    for name in ("nx", "ny", "nz"):
        points[name] = 0
    for name in ("red", "green", "blue"):
        points[name] = 128
    PlyData([PlyElement.describe(points, "vertex")]).write(str(s.path("input.ply")))
    parts = s.plain_parts()
    s.checkpoint(parts, [], _groups(parts), "chkpnt30000.pth", scale=np.float64(3.52), old_numpy=True)


def two_d(root, scene):
    """2DGS: two scales."""
    s = Sample(root, "2dgs", scene)
    s.model_folder(extra=", render_items=['RGB', 'Alpha', 'Normal', 'Depth', 'Edge', 'Curvature']")
    s.ply("point_cloud", "iteration_30000", "point_cloud.ply", scales=2)


def mip(root, scene):
    """Mip-Splatting: `filter_3D` last; expected are scales and opacities with the filter in them."""
    s = Sample(root, "mip_splatting", scene)
    s.model_folder(extra=", kernel_size=0.1, load_allres=False, ray_jitter=False, resample_gt_image=False, sample_more_highres=False")
    filters = np.random.default_rng(3).uniform(0.02, 0.12, (len(scene.xyz), 1)).astype(np.float32)
    s.ply("point_cloud", "iteration_30000", "point_cloud.ply", after=[(["filter_3D"], filters)])
    square = np.exp(2 * scene.log_scale.astype(np.float64))
    wider = square + filters.astype(np.float64) ** 2
    sure = 1 / (1 + np.exp(-scene.opacity.astype(np.float64)))
    s.expect("filter_3d", filters)
    s.expect("scales_with_filter", np.sqrt(wider))
    s.expect("opacity_with_filter", sure * np.sqrt(square.prod(1) / wider.prod(1))[:, None])


def gsplat(root, scene):
    """gsplat's `simple_trainer.py`: two ranks of the last step, one of an earlier one."""
    s = Sample(root, "gsplat", scene)

    def splats(rows):
        return torch.nn.ParameterDict({
            "means": parameter(scene.xyz[rows]), "scales": parameter(scene.log_scale[rows]),
            "quats": parameter(scene.rotation[rows]), "opacities": parameter(scene.opacity[rows, 0]),
            "sh0": parameter(scene.sh[rows, :1]), "shN": parameter(scene.sh[rows, 1:]),
        }).state_dict()

    for step, rank, rows in ((6999, 0, slice(0, 8)), (29999, 0, slice(0, 20)), (29999, 1, slice(20, None))):
        data = {"step": step, "splats": splats(rows)}
        torch_files.save(data, s.path("ckpts", f"ckpt_{step}_rank{rank}.pt"))
    s.text(
        "antialiased: false\nckpt: null\ndata_dir: data/made_up\ndata_factor: 4\nglobal_scale: 1.0\n"
        "normalize_world_space: true\nresult_dir: results/made_up\nsh_degree: 3\n"
        "strategy: !!python/object:gsplat.strategy.default.DefaultStrategy\n  absgrad: false\n  prune_opa: 0.005\n",
        "cfg.yml",
    )


def splatfacto(root, scene):
    """nerfstudio's splatfacto: Gaussians in the data parser's axes; expected are world positions and rotations."""
    s = Sample(root, "splatfacto", scene)
    turn, _ = look_at([1.0, 2.0, -2.0])
    shift, size = np.array([0.3, -0.2, 0.1]), 0.4
    run = ("made_up", "splatfacto", "2026-01-02_030405")
    s.text(
        json.dumps({"transform": np.hstack([turn, shift[:, None]]).tolist(), "scale": size}, indent=4),
        *run, "dataparser_transforms.json",
    )
    s.text(
        "!!python/object:nerfstudio.engine.trainer.TrainerConfig\n_target: !!python/name:nerfstudio.engine.trainer.Trainer ''\n"
        "data: &id001 !!python/object/apply:pathlib.PosixPath\n- data\n- made_up\nmethod_name: splatfacto\n"
        "output_dir: !!python/object/apply:pathlib.PosixPath\n- outputs\npipeline: !!python/object:nerfstudio.pipelines.base_pipeline.VanillaPipelineConfig\n"
        "  datamanager: !!python/object:nerfstudio.data.datamanagers.full_images_datamanager.FullImageDatamanagerConfig\n"
        "    dataparser: !!python/object:nerfstudio.data.dataparsers.colmap_dataparser.ColmapDataParserConfig\n"
        "      data: *id001\n  model: !!python/object:nerfstudio.models.splatfacto.SplatfactoModelConfig\n"
        "    rasterize_mode: classic\n    sh_degree: 3\ntimestamp: 2026-01-02_030405\n",
        *run, "config.yml",
    )
    means = (scene.xyz.astype(np.float64) @ turn.T + shift) * size
    # Quaternion of the turn, and its products with those of the Gaussians.
    q = _quaternion(turn)
    quats = np.array([_product(q, r) for r in scene.rotation.astype(np.float64)])
    values = {
        "means": means, "scales": scene.log_scale + np.log(size), "quats": quats,
        "features_dc": scene.sh[:, 0], "features_rest": scene.sh[:, 1:], "opacities": scene.opacity,
    }
    tensors = {name: parameter(v) for name, v in values.items()}
    state = {"_model.device_indicator_param": torch.zeros(0)}
    state |= {f"_model.gauss_params.{name}": t.detach() for name, t in tensors.items()}
    state["_model.lpips.net.net.slice1.0.weight"] = torch.zeros(4, 3, 3, 3)
    state["_model.camera_optimizer.pose_adjustment"] = torch.zeros(2, 6)
    rates = {"base_lrs": [0.00016], "last_epoch": 29999, "_last_lr": [np.float64(1.6e-6)], "lr_lambdas": [None]}
    data = {
        "step": 29999,
        "pipeline": state,
        "optimizers": {name: torch_files.adam([(name, t, 1e-3)]) for name, t in list(tensors.items())[:1]},
        "schedulers": {"means": rates},
        "scalers": {"scale": 65536.0, "growth_factor": 2.0, "backoff_factor": 0.5, "growth_interval": 2000, "_growth_tracker": 0},
    }
    torch_files.save(data, s.path(*run, "nerfstudio_models", "step-000029999.ckpt"), old_numpy=True)
    s.expect("means", means)
    s.expect("world_xyz", scene.xyz)
    s.expect("world_scales", np.exp(scene.log_scale))
    s.expect("world_rotations", rotations(scene.rotation.astype(np.float64)))


def _quaternion(m):
    w = np.sqrt(max(0.0, 1 + np.trace(m))) / 2
    return np.array([w, *(np.array([m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]]) / (4 * w))])


def _product(a, b):
    v = a[0] * b[1:] + b[0] * a[1:] + np.cross(a[1:], b[1:])
    return np.array([a[0] * b[0] - a[1:] @ b[1:], *v])


ALL = [inria, two_d, mip, gsplat, splatfacto]
