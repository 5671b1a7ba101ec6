"""Results with classes, clusters or affinities of Gaussians."""

import numpy as np
import torch

import torch_files
from reference import cosines, relevancy, softmax, unit
from sample import Sample
from scene import DIMENSION


def save_classes(s, features, weight, bias):
    """Gaussian Grouping's Gaussians with features, and its classifier."""
    s.model_folder(extra=f", num_classes={len(bias)}, object_path='object_mask'")
    where = ("point_cloud", "iteration_30000")
    s.ply(*where, "point_cloud.ply", after=[([f"obj_dc_{i}" for i in range(features.shape[1])], features)])
    state = {"weight": torch.from_numpy(weight)[:, :, None, None], "bias": torch.from_numpy(bias)}
    torch_files.save(state, s.path(*where, "classifier.pth"))


def gaussian_grouping(root, scene):
    """Gaussian Grouping: 16 numbers a Gaussian and a linear classifier of 256 classes."""
    s = Sample(root, "gaussian_grouping", scene)
    r = torch_files.seeded(21)
    classes = np.array([7, 3, 200, 0])
    features = np.eye(4, 16)[scene.cluster] * 2 + r.normal(0, 0.3, (len(scene.xyz), 16))
    weight = r.normal(0, 0.1, (256, 16))
    weight[classes, np.arange(4)] += 4
    features, weight = features.astype(np.float32), weight.astype(np.float32)
    bias = r.normal(0, 0.1, 256).astype(np.float32)
    save_classes(s, features, weight, bias)
    logits = lambda o: o @ weight.T.astype(np.float64) + bias  # noqa: E731
    sure = softmax(logits(features.astype(np.float64)))
    rendered = s.blended(features)
    s.expect("features", features)
    s.expect("features_pixels", rendered)
    s.expect("classes_gaussians", sure.argmax(1))
    s.expect("probability_of_class_7_gaussians", sure[:, 7])
    s.expect("classes_pixels", logits(rendered).argmax(-1))
    s.expect("probability_of_class_7_pixels", softmax(logits(rendered))[..., 7])


def saga(root, scene):
    """SAGA: 32 numbers a Gaussian, a gate of the scale; a click at pixel (7, 6) (column, row), scale 0.5."""
    s = Sample(root, "saga", scene)
    r = torch_files.seeded(22)
    features = unit(np.eye(4, 32)[scene.cluster] + r.normal(0, 0.1, (len(scene.xyz), 32)))
    features = (features * r.uniform(0.8, 1.0, (len(scene.xyz), 1))).astype(np.float32)
    weight, bias = r.normal(0, 2, (32, 1)).astype(np.float32), r.normal(0, 1, 32).astype(np.float32)
    s.model_folder()
    s.ply("point_cloud", "iteration_30000", "scene_point_cloud.ply")
    where = ("point_cloud", "iteration_10000")
    s.ply(
        *where, "contrastive_feature_point_cloud.ply", harmonics=False,
        before=[([f"f_{i}" for i in range(32)], features)],
    )
    state = {"0.weight": torch.from_numpy(weight), "0.bias": torch.from_numpy(bias)}
    torch_files.save(state, s.path(*where, "scale_gate.pt"))
    selected = torch.from_numpy(scene.cluster == 0)
    torch_files.save(selected, s.path("segmentation_res", "kettle.pt"))
    gate = 1 / (1 + np.exp(-(weight[:, 0].astype(np.float64) * 0.5 + bias)))
    rendered = s.blended(features)
    point = unit(unit(rendered[6, 7]) * gate)
    s.expect("features", features)
    s.expect("feature_of_pixel", rendered[6, 7])
    s.expect("gate_at_half", gate)
    s.expect("click_scores", (1 + unit(features * gate) @ point) / 2)
    s.expect("selected", selected.numpy())


def opengaussian(root, scene):
    """OpenGaussian: 6 numbers a Gaussian, leaves of clusters with features (k1 4, k2 3; official 64 and 10 or 5)."""
    s = Sample(root, "opengaussian", scene)
    r = torch_files.seeded(23)
    roots, leaves = 4, 3
    total = roots * leaves
    book = unit(np.repeat(np.eye(4, 6), leaves, axis=0) + r.normal(0, 0.3, (total, 6))).astype(np.float32)
    leaf_of = scene.cluster * leaves + np.arange(len(scene.xyz)) // 4 % leaves
    features = (book[leaf_of] + r.normal(0, 0.02, (len(leaf_of), 6))).astype(np.float32)
    occurrences = r.integers(2, 30, total).astype(np.float32)
    occurrences[:3] = [3, 20, 12]
    language = unit(
        np.repeat(scene.cluster_features, leaves, axis=0) + r.normal(0, 0.4 / DIMENSION**0.5, (total, DIMENSION))
    )
    language = (language * r.uniform(0.8, 1, (total, 1))).astype(np.float32)
    s.model_folder()
    where = ("point_cloud", "iteration_70000")
    names = ["ins_feat_r", "ins_feat_g", "ins_feat_b", "ins_feat_r2", "ins_feat_g2", "ins_feat_b2"]
    colors = r.integers(0, 256, (len(leaf_of), 3), dtype=np.uint8)
    s.ply(*where, "point_cloud.ply", before=[(names, features)], last=[(["red", "green", "blue"], colors)])
    root_book = np.concatenate([np.eye(4, 6), r.normal(size=(4, 3))], axis=1).astype(np.float32)
    for name, centers, index in (("root_code_book", root_book, scene.cluster), ("leaf_code_book", book, leaf_of)):
        torch_files.save({"ins_feat": torch.from_numpy(centers)}, s.path(*where, name, "kmeans_centers.pth"))
        bits = int(np.ceil(np.log2(len(centers))))
        text = "".join(format(int(i), f"0{bits}b") for i in index)
        packed = bytes(int(text[i : i + 8].ljust(8, "0"), 2) for i in range(0, len(text), 8))
        s.path(*where, name, "kmeans_inds.bin").write_bytes(packed)
    score = r.uniform(0.3, 0.9, total).astype(np.float32)
    arrays = {"leaf_feat": language, "leaf_score": score, "occu_count": occurrences, "leaf_ind": leaf_of}
    s.path("cluster_lang.npz").write_bytes(torch_files.archive(_npz(arrays)))
    kept = np.where(occurrences[:, None] < 5, 0, language.astype(np.float64))
    found = cosines(kept, scene.texts)[:, 0]
    best = int(found.argmax())
    chosen = [best]
    for leaf in np.argsort(-found, kind="stable")[:10][1:]:
        if leaf - best < leaves and np.linalg.norm(book[best].astype(np.float64) - book[leaf]) < 0.9:
            chosen.append(int(leaf))
    s.expect("features", features)
    s.expect("leaf_of", leaf_of.astype(np.int64))
    s.expect("cosines_leaves", found)
    s.expect("chosen_leaves", np.array(chosen, np.int64))
    s.expect("relevancy_leaves", relevancy(kept, scene.texts))
    chosen_gaussians = np.isin(leaf_of, chosen)
    s.expect("chosen_gaussians", chosen_gaussians)
    # Only the chosen Gaussians are rendered.
    s.expect("silhouette_pixels", s.weights(np.flatnonzero(chosen_gaussians)).sum(-1))


def _npz(arrays):
    import io

    for name, array in arrays.items():
        out = io.BytesIO()
        np.save(out, array)
        yield f"{name}.npy", out.getvalue()


def thgs(root, scene):
    """THGS and ReLaGS: superpoints of four levels over splats of 2DGS, features of levels 1 to 3."""
    s = Sample(root, "thgs", scene)
    r = torch_files.seeded(24)
    n = len(scene.xyz)
    coarse = scene.cluster.copy()
    coarse[9] = -1
    middle = np.where(coarse < 0, -1, scene.cluster * 2 + np.arange(n) // 4 % 2)
    fine = np.where(coarse < 0, -1, scene.cluster * 3 + np.arange(n) // 4 % 3)
    labels = [np.arange(n), fine, middle, coarse]
    features = []
    for each in (3, 2, 1):
        rows = np.repeat(scene.cluster_features, each, axis=0) + r.normal(0, 0.4 / DIMENSION**0.5, (4 * each, DIMENSION))
        features.append(unit(rows).astype(np.float32))
    s.model_folder()
    s.ply("point_cloud", "iteration_30000", "point_cloud.ply", scales=2)
    data = {
        "nag": [torch.from_numpy(label.astype(np.int64)) for label in labels],
        "nag_feat": [torch.from_numpy(f) for f in features],
    }
    torch_files.save(data, s.path("sai_nag.pt"))
    torch_files.save(torch.from_numpy(fine.astype(np.int64)), s.path("nag-l1.pt"))
    found = {(level, i): c for level in (2, 3) for i, c in enumerate(cosines(features[level - 1], scene.texts)[:, 0])}
    best = sorted(found, key=lambda k: -found[k])[:3]
    member = np.zeros(n, bool)
    for level, segment in best:
        member |= labels[level] == segment
    for level in range(4):
        s.expect(f"labels_{level}", labels[level].astype(np.int64))
    for level in (1, 2, 3):
        s.expect(f"relevancy_segments_{level}", relevancy(features[level - 1], scene.texts))
    s.expect("three_best_level_and_segment", np.array(best, np.int64))
    s.expect("member_of_three_best", member)


def laga(root, scene):
    """LaGa: SAGA's features, and descriptors of clusters of three levels: 2 a cluster (official: 20)."""
    s = Sample(root, "laga", scene)
    r = torch_files.seeded(25)
    each, counts = 2, (4, 4, 2)
    affinity = unit(np.eye(4, 32)[scene.cluster] + r.normal(0, 0.1, (len(scene.xyz), 32))).astype(np.float32)
    s.model_folder()
    s.ply("point_cloud", "iteration_30000", "scene_point_cloud.ply")
    where = ("point_cloud", "iteration_30000")
    s.ply(
        *where, "contrastive_feature_point_cloud.ply", harmonics=False,
        before=[([f"f_{i}" for i in range(32)], affinity)],
    )
    features, weights, scores = [], [], []
    for count in counts:
        rows = scene.cluster_features[np.repeat(np.arange(count), each)]
        rows = unit(rows + r.normal(0, 0.5 / DIMENSION**0.5, rows.shape)) * r.uniform(0.8, 1, (len(rows), 1))
        features.append(rows.astype(np.float32))
        weight = r.uniform(0.5, 1, count * each)
        # Some clusters have fewer.
        weight[each - 1 :: 2 * each] = 0
        weights.append(weight.astype(np.float32))
        score = r.uniform(0, 0.5, (len(scene.xyz), count))
        score[np.arange(len(score)), scene.cluster % count] += 1
        scores.append(score.astype(np.float32))
    for name, values in (
        ("multi_lvl_cluster_features", features), ("multi_lvl_cluster_feature_weights", weights),
        ("multi_lvl_seg_scores", scores),
    ):
        torch_files.save([torch.from_numpy(v) for v in values], s.path(*where, f"{name}.pth"))
    relevancies, positives = [], []
    for level, count in enumerate(counts):
        s.expect(f"features_first_rows_{level + 1}", features[level][:2])
        s.expect(f"weights_{level + 1}", weights[level])
        s.expect(f"clusters_{level + 1}", scores[level].argmax(1))
        value = (relevancy(features[level], scene.texts) * weights[level]).reshape(count, each)
        best = value.argmax(1)
        cosine = cosines(features[level], scene.texts)[:, 0].reshape(count, each)[np.arange(count), best]
        cluster = scores[level].argmax(1)
        relevancies.append(value.max(1)[cluster])
        positives.append(cosine[cluster])
        s.expect(f"relevancy_gaussians_{level + 1}", relevancies[-1])
    whole, nearest = np.mean(relevancies, axis=0), np.max(positives, axis=0)
    s.expect("relevancy_gaussians", whole)
    s.expect("cosine_gaussians", nearest)
    # As LaGa chooses Gaussians, without its filter over neighbors of like color.
    normal = np.clip(whole, np.quantile(whole, 0.25), None)
    normal = (normal - normal.min()) / (normal.max() - normal.min())
    chosen = (normal >= 0.6) & (nearest >= 0.23)
    s.expect("chosen_gaussians", chosen)
    s.expect("membership_pixels", s.blended(chosen[:, None])[..., 0])


ALL = [gaussian_grouping, saga, opengaussian, thgs, laga]
