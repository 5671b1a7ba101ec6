"""Results with features of Gaussians that a text encoder's vectors are compared with."""

import numpy as np
import torch

import torch_files
from plain import NAMES
from reference import cosines, relevancy, softmax, unit
from sample import Sample
from scene import DIMENSION
from torch_files import parameter


def _relevancies(s, suffix, gaussians, pixels, texts):
    if gaussians is not None:
        s.expect(f"relevancy_gaussians{suffix}", relevancy(gaussians, texts))
    if pixels is not None:
        s.expect(f"relevancy_pixels{suffix}", relevancy(pixels, texts))


def save_autoencoder(s, name, encoder, norms, decoder):
    """LangSplat's autoencoder of a scene: pairs of weight and bias of the encoder's and decoder's linear layers, and
    weight, bias, mean and variance of the normalization before each of the encoder's but the first."""
    state, of = {}, lambda array: torch.from_numpy(np.asarray(array, np.float32))
    for i, (weight, bias) in enumerate(encoder):
        # Linear, then BatchNorm and ReLU before the next one.
        if i:
            scale, shift, mean, variance = norms[i - 1]
            state |= {
                f"encoder.{3 * i - 2}.weight": of(scale), f"encoder.{3 * i - 2}.bias": of(shift),
                f"encoder.{3 * i - 2}.running_mean": of(mean), f"encoder.{3 * i - 2}.running_var": of(variance),
                f"encoder.{3 * i - 2}.num_batches_tracked": torch.tensor(100),
            }
        state |= {f"encoder.{3 * i}.weight": of(weight), f"encoder.{3 * i}.bias": of(bias)}
    for i, (weight, bias) in enumerate(decoder):
        state |= {f"decoder.{2 * i}.weight": of(weight), f"decoder.{2 * i}.bias": of(bias)}
    torch_files.save(state, s.path("autoencoder", "ckpt", name, "best_ckpt.pth"))


def save_level(s, name, level, codes):
    """LangSplat's checkpoint of a level, 1 to 3, with codes of three numbers."""
    feature, folder = parameter(codes), f"{name}_{level}"
    s.model_folder("output", folder, extra=f", feature_level={level}, language_features_name='language_features_dim3'")
    s.checkpoint(s.plain_parts(), [feature], [("language_feature", feature, 0.0025)], "output", folder, "chkpnt30000.pth")


def langsplat(root, scene):
    """LangSplat: 13-tuples of three levels, an autoencoder. The decoder is narrower than the official one (9 hidden
    numbers instead of up to 256), so that the file is small; its depth and names are the official ones."""
    s = Sample(root, "langsplat", scene)
    r = torch_files.seeded(11)
    hidden = 9
    widths = [3] + [hidden] * 6 + [DIMENSION]
    decoder = [(r.normal(0, 0.5, (b, a)), r.normal(0, 0.2, b)) for a, b in zip(widths, widths[1:])]
    centers = unit(r.normal(size=(4, 3)))

    def hide(codes):
        for weight, bias in decoder[:-1]:
            codes = np.maximum(codes @ weight.T + bias, 0)
        return codes

    # The last layer is such that each cluster's code is decoded to about its feature.
    decoder[-1] = (np.linalg.lstsq(hide(centers), scene.cluster_features, rcond=1e-3)[0].T, r.normal(0, 0.01, DIMENSION))
    decoder = [(w.astype(np.float32).astype(np.float64), b.astype(np.float32).astype(np.float64)) for w, b in decoder]

    def decode(codes):
        weight, bias = decoder[-1]
        return hide(codes) @ weight.T + bias

    encoder = [DIMENSION, hidden, hidden, hidden, hidden, 3]
    layers = [(r.normal(0, 0.1, (b, a)), np.zeros(b)) for a, b in zip(encoder, encoder[1:])]
    norms = [(np.ones(a), np.zeros(a), np.zeros(a), np.ones(a)) for a in encoder[1:-1]]
    save_autoencoder(s, "made_up", layers, norms, decoder)
    for level in (1, 2, 3):
        codes = (centers[scene.cluster] + r.normal(0, 0.05 * level, (len(scene.xyz), 3))).astype(np.float32)
        save_level(s, "made_up", level, codes)
        s.expect(f"codes_{level}", codes)
        rendered = s.blended(unit(codes, 1e-9))
        s.expect(f"codes_pixels_{level}", rendered)
        gaussians = decode(unit(codes))
        s.expect(f"decoded_first_rows_{level}", unit(gaussians[:4]))
        seen = s.weights().sum(-1, keepdims=True) > 0
        _relevancies(s, f"_{level}", gaussians, np.where(seen, decode(rendered), 0), scene.texts)


def langsplat_v2(root, scene):
    """LangSplatV2: 14-tuples with logits and a codebook; K is 6 instead of 64, so that the files are small."""
    s = Sample(root, "langsplat_v2", scene)
    r = torch_files.seeded(12)
    size = 6
    for level in (1, 2, 3):
        book = unit(r.normal(0, 0.4 / DIMENSION**0.5, (size, DIMENSION)) + scene.cluster_features[np.arange(size) % 4])
        book = book.astype(np.float32)[None]
        logits = r.normal(0, 1, (len(scene.xyz), size))
        logits[np.arange(len(logits)), scene.cluster] += 3
        logits = logits.astype(np.float32)
        tensors = [parameter(logits), parameter(book)]
        folder = f"made_up_0_{level}"
        s.model_folder("output", folder, extra=f", feature_level={level}")
        s.checkpoint(
            s.plain_parts(), tensors,
            [("language_feature_logits", tensors[0], 0.0025), ("language_feature_codebooks", tensors[1], 0.0025)],
            "output", folder, "chkpnt10000.pth", iteration=10000,
        )
        weights = softmax(logits.astype(np.float64))
        fourth = np.sort(weights, axis=1)[:, -4:-3]
        weights = np.where(weights >= fourth, weights, 0)
        weights /= weights.sum(1, keepdims=True) + 1e-10
        s.expect(f"logits_{level}", logits)
        s.expect(f"codebook_{level}", book)
        s.expect(f"weights_{level}", weights)
        rendered = s.blended(weights)
        s.expect(f"weights_pixels_{level}", rendered)
        book = book[0].astype(np.float64)
        _relevancies(s, f"_{level}", weights @ book, rendered @ book, scene.texts)


def occams(root, scene):
    """Occam's LGS: LangSplat's 13-tuple with [N, 512]; each level keeps other Gaussians."""
    s = Sample(root, "occams_lgs", scene)
    s.model_folder()
    s.ply("point_cloud", "iteration_30000", "point_cloud.ply")
    for level, rows in ((1, np.arange(0, 15)), (2, np.arange(6, 20)), (3, np.arange(1, 32, 2))):
        features = scene.features(20 + level)[rows] * np.linspace(0.5, 3, len(rows), dtype=np.float32)[:, None]
        feature = torch.from_numpy(features)
        empty = parameter(np.zeros((1, 3)))
        s.checkpoint(
            s.plain_parts(rows), [feature], [("language_feature", empty, 0.0025)],
            f"chkpnt30000_langfeat_{level}.pth", iteration=0, rows=rows,
        )
        s.expect(f"rows_{level}", rows.astype(np.int64))
        s.expect(f"features_first_rows_{level}", features[:2])
        _relevancies(s, f"_{level}", features, s.blended(features, rows), scene.texts)


def feature_3dgs(root, scene):
    """Feature 3DGS: 16 Gaussians with 512 numbers; and with `--speedup` 16 numbers and a decoder (official: 128)."""
    s = Sample(root, "feature_3dgs", scene)
    r = torch_files.seeded(13)
    rows = slice(0, 16)
    features = scene.features(31)[rows]
    s.model_folder("lseg", extra=", foundation_model='lseg', speedup=False")
    names = [f"semantic_{i}" for i in range(DIMENSION)]
    s.ply("lseg", "point_cloud", "iteration_7000", "point_cloud.ply", rows=rows, after=[(names, features)])
    s.expect("semantic_first_rows", features[:2])
    s.expect("cosines_gaussians", cosines(features, scene.texts))
    s.expect("cosines_pixels", cosines(s.blended(features, rows), scene.texts))

    small, codes = 16, np.eye(4, 16)[scene.cluster] + r.normal(0, 0.1, (len(scene.xyz), 16))
    codes = codes.astype(np.float32)
    weight = r.normal(0, 0.02, (DIMENSION, small))
    weight[:, :4] += scene.cluster_features.T
    weight, bias = weight.astype(np.float32), r.normal(0, 0.01, DIMENSION).astype(np.float32)
    s.model_folder("lseg_speedup", extra=", foundation_model='lseg', speedup=True")
    s.ply(
        "lseg_speedup", "point_cloud", "iteration_7000", "point_cloud.ply",
        after=[([f"semantic_{i}" for i in range(small)], codes)],
    )
    state = {"conv.weight": torch.from_numpy(weight)[:, :, None, None], "conv.bias": torch.from_numpy(bias)}
    torch_files.save(state, s.path("lseg_speedup", "decoder_chkpnt7000.pth"))
    feature = parameter(codes[:, None])
    # In the checkpoint the feature is last.
    parts = s.plain_parts()
    groups = [("semantic_feature", feature, 1e-3)]
    content = (3, *parts, *s.counters(), torch_files.adam(groups), np.float32(3.52), feature)
    torch_files.save((content, 7000), s.path("lseg_speedup", "chkpnt7000.pth"))
    decode = lambda c: c @ weight.T.astype(np.float64) + bias  # noqa: E731
    rendered = s.blended(codes)
    seen = s.weights().sum(-1, keepdims=True) > 0
    s.expect("speedup_semantic", codes)
    s.expect("speedup_pixels", rendered)
    s.expect("speedup_cosines_gaussians", cosines(decode(codes.astype(np.float64)), scene.texts))
    s.expect("speedup_cosines_pixels", cosines(np.where(seen, decode(rendered), 0), scene.texts))


def legaussians(root, scene):
    """LEGaussians: 14-tuple of another order than LangSplatV2's; an index decoder (official: 128 and 256 hidden
    numbers, 128 words) and a codebook of CLIP's 512 and DINO's 384 numbers in the folder of the photos."""
    s = Sample(root, "legaussians", scene)
    r = torch_files.seeded(14)
    words, hidden = 8, [12, 24]
    codes = (np.eye(4, 8)[scene.cluster] * 2 + r.normal(0, 0.2, (len(scene.xyz), 8))).astype(np.float32)
    uncertainty = r.normal(-4, 0.5, (len(scene.xyz), 1)).astype(np.float32)
    s.model_folder("output")
    s.ply(
        "output", "point_cloud", "iteration_30000", "point_cloud.ply",
        after_harmonics=[([f"clip_f_indices_{i}" for i in range(8)], codes)],
        after_opacity=[(["uncertainty"], uncertainty)],
    )
    xyz, dc, rest, scaling, rotation, opacity = s.plain_parts()
    semantic, unsure = parameter(codes), parameter(uncertainty)
    parts = [xyz, dc, rest, semantic, scaling, rotation, opacity, unsure]
    s.checkpoint(parts, [], [("clip_f_indices", semantic, 1e-3)], "output", "chkpnt30000.pth")
    widths = [8, *hidden, words]
    layers = [
        (r.normal(0, 1.2 / a**0.5, (b, a)).astype(np.float32), r.normal(0, 0.1, b).astype(np.float32))
        for a, b in zip(widths, widths[1:])
    ]
    state = {}
    for i, (weight, bias) in enumerate(layers):
        state[f"conv{i + 1}.weight"] = torch.from_numpy(weight)[:, :, None, None]
        state[f"conv{i + 1}.bias"] = torch.from_numpy(bias)
    torch_files.save(state, s.path("output", "index_decoder_chkpnt30000.pth"))
    book = r.normal(0, 0.3 / DIMENSION**0.5, (words, DIMENSION + 384))
    book[:, :DIMENSION] += scene.cluster_features[np.arange(words) % 4]
    book = book.astype(np.float32)
    name = "pyrclip_dino01_00_12_896_1_20260102-030405_codebook.pt"
    torch_files.save({"embedding.weight": torch.from_numpy(book)}, s.path("data", "made_up", "images", name))

    def decode(x):
        for i, (weight, bias) in enumerate(layers):
            x = x @ weight.T.astype(np.float64) + bias
            x = np.maximum(x, 0) if i < 2 else x
        return softmax(x) @ book[:, :DIMENSION].astype(np.float64)

    rendered = s.blended(codes)
    seen = s.weights().sum(-1, keepdims=True) > 0
    gaussians, pixels = decode(unit(codes)), np.where(seen, decode(unit(rendered)), 0)
    s.expect("codes", codes)
    s.expect("codes_pixels", rendered)
    s.expect("codebook_first_words", book[:2])
    _relevancies(s, "", gaussians, pixels, scene.texts)
    s.expect("relevancy_pixels_temperature_100", relevancy(pixels, scene.texts, 100.0))


def gags(root, scene):
    """GAGS: `semantic_0..15` and a residual decoder (official: 256 hidden numbers). The last layer is such that each
    cluster's code is decoded to about its feature."""
    s = Sample(root, "gags", scene)
    r = torch_files.seeded(15)
    hidden = 10
    widths = [16] + [hidden] * 8 + [DIMENSION]
    layers = [
        (r.normal(0, 1 / a**0.5, (b, a)).astype(np.float32), r.normal(0, 0.1, b).astype(np.float32))
        for a, b in zip(widths, widths[1:])
    ]
    codes = (np.eye(4, 16)[scene.cluster] + r.normal(0, 0.2, (len(scene.xyz), 16))).astype(np.float32)

    def hide(x):
        x = kept = np.asarray(x, np.float64)
        for i, (weight, bias) in enumerate(layers[:-1]):
            # Skips the second and the third of three layers.
            kept = x if i in (1, 4) else kept
            x = np.maximum(x @ weight.T.astype(np.float64) + bias, 0)
            x = x + kept if i in (2, 5) else x
        return x

    shown = np.concatenate([hide(np.eye(4, 16)), np.ones((4, 1))], axis=1)
    last = np.linalg.lstsq(shown, scene.cluster_features, rcond=1e-3)[0].T.astype(np.float32)
    layers[-1] = (last[:, :-1], last[:, -1])

    def decode(x):
        weight, bias = layers[-1]
        return unit(hide(x) @ weight.T.astype(np.float64) + bias)

    s.model_folder()
    s.ply(
        "point_cloud", "iteration_30000", "point_cloud.ply", after=[([f"semantic_{i}" for i in range(16)], codes)]
    )
    state = {}
    for i, (weight, bias) in enumerate(layers):
        weight, bias = np.ascontiguousarray(weight), np.ascontiguousarray(bias)
        state[f"decoder.{2 * i}.weight"] = torch.from_numpy(weight)[:, :, None, None]
        state[f"decoder.{2 * i}.bias"] = torch.from_numpy(bias)
    torch_files.save({"module_state_dict": state}, s.path("decoder_chkpnt30000.pth"))
    rendered = s.blended(codes)
    seen = s.weights().sum(-1, keepdims=True) > 0
    s.expect("codes", codes)
    s.expect("codes_pixels", rendered)
    s.expect("decoded_first_rows", decode(codes[:4]))
    _relevancies(s, "", decode(codes), np.where(seen, decode(rendered), 0), scene.texts)


def dr_splat(root, scene):
    """Dr.Splat: [N, 2 + M] uint8 and a faiss index of product quantization: d 24, M 6, 8 lists (official: 512, 128,
    1024), hence texts of 24 numbers; the byte layout is the official one."""
    s = Sample(root, "dr_splat", scene)
    r = torch_files.seeded(16)
    d, parts, lists = 24, 6, 8
    coarse = unit(r.normal(size=(lists, d))).astype(np.float32)
    residual = r.normal(0, 0.05, (parts, 256, d // parts)).astype(np.float32)
    codes = r.integers(0, 256, (len(scene.xyz), 2 + parts), dtype=np.uint8)
    codes[:, 0], codes[:, 1] = scene.cluster, 0
    codes[5] = 255
    s.model_folder()
    feature = torch.from_numpy(codes)
    empty = parameter(np.zeros((1, 3)))
    s.checkpoint(s.plain_parts(), [feature], [("language_feature", empty, 0.0025)], "chkpnt0.pth", iteration=0)
    s.path("pq_index.faiss").write_bytes(_faiss(d, parts, coarse, residual))
    texts = unit(np.concatenate([coarse[:1] + r.normal(0, 0.05, (1, d)), r.normal(size=(4, d))])).astype(np.float32)
    vectors = np.zeros((len(codes), d))
    for i, code in enumerate(codes):
        if not (code == 255).all():
            steps = np.concatenate([residual[m, code[2 + m]] for m in range(parts)])
            vectors[i] = coarse[int(code[0]) + 256 * int(code[1])].astype(np.float64) + steps
    s.expect("codes", codes)
    s.expect("vectors", vectors)
    s.expect("texts", texts)
    _relevancies(s, "", vectors, s.blended(unit(vectors)), texts)


def _faiss(d, parts, coarse, residual):
    """Bytes of faiss's IndexIVFPQ with a flat quantizer for inner products and empty lists."""
    u32, u64 = (lambda n: int(n).to_bytes(4, "little")), (lambda n: int(n).to_bytes(8, "little"))

    def header(count):
        return u32(d) + u64(count) + u64(1 << 20) * 2 + b"\x01" + u32(0)

    lists = len(coarse)
    flat = b"IxFI" + header(lists) + u64(coarse.size) + coarse.tobytes()
    quantizer = u64(d) + u64(parts) + u64(8) + u64(residual.size) + residual.tobytes()
    direct_map = b"\x00" + u64(0)
    inverted = b"ilar" + u64(lists) + u64(parts) + b"sprs" + u64(0)
    return b"IwPQ" + header(0) + u64(lists) + u64(1) + flat + direct_map + b"\x01" + u64(parts) + quantizer + inverted


def splat_distiller(root, scene):
    """splat-distiller: features beside a checkpoint of gsplat."""
    s = Sample(root, "splat_distiller", scene)
    rows = slice(0, 16)
    features = scene.features(32)[rows]
    splats = {
        "means": scene.xyz, "scales": scene.log_scale, "quats": scene.rotation, "opacities": scene.opacity[:, 0],
        "sh0": scene.sh[:, :1], "shN": scene.sh[:, 1:],
    }
    state = torch.nn.ParameterDict({name: parameter(v[rows]) for name, v in splats.items()}).state_dict()
    torch_files.save({"step": 29999, "splats": state}, s.path("ckpts", "ckpt_29999_rank0.pt"))
    torch_files.save(torch.from_numpy(features), s.path("ckpts", "ckpt_29999_rank0_features.pt"))
    s.expect("features_first_rows", features[:2])
    _relevancies(s, "", features, s.blended(features, rows), scene.texts)


def ludvig(root, scene):
    """LUDVIG: a `.ply` and an array of NumPy."""
    s = Sample(root, "ludvig", scene)
    rows = slice(0, 16)
    features = scene.features(33)[rows]
    s.ply("gaussians.ply", rows=rows)
    np.save(s.path("features.npy"), features)
    _relevancies(s, "", features, s.blended(features, rows), scene.texts)


def semantic_gaussians(root, scene):
    """Semantic Gaussians: features of the Gaussians that were seen, in f16, and which those are."""
    s = Sample(root, "semantic_gaussians", scene)
    seen = np.arange(len(scene.xyz)) % 5 != 3
    features = scene.features(34)[seen].astype(np.float16)
    s.model_folder("output")
    s.ply("output", "point_cloud", "iteration_30000", "point_cloud.ply")
    torch_files.save({"feat": torch.from_numpy(features), "mask_full": torch.from_numpy(seen)}, s.path("fusion", "0.pt"))
    whole = np.zeros((len(seen), DIMENSION))
    whole[seen] = features
    s.expect("seen", seen)
    s.expect("features_first_rows", features[:2])
    s.expect("cosines_gaussians", cosines(whole, scene.texts))
    s.expect("cosines_pixels", cosines(s.blended(whole), scene.texts))
    _relevancies(s, "", whole, s.blended(whole), scene.texts)


ALL = [
    langsplat, langsplat_v2, occams, feature_3dgs, legaussians, gags, dr_splat, splat_distiller, ludvig,
    semantic_gaussians,
]
