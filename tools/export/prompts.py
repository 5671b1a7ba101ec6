"""Points and boxes as embeddings, for the decoders of SAM and SAM 2 (their official prompt encoders have the same parts)."""

import torch


def embed_points(prompt, coords, labels, side):
    """Sparse prompt embeddings: points [n,p,2] in model pixels, labels [n,p] (-1 none, 0 background,
    1 foreground, 2 and 3 the corners of a box). The table row is chosen by products with 0 and 1."""
    at = 2 * ((coords + 0.5) / side) - 1
    at = (2 * torch.pi) * (at @ prompt.pe_layer.positional_encoding_gaussian_matrix)
    embedding = torch.cat([torch.sin(at), torch.cos(at)], dim=-1)
    labels = labels[..., None]
    embedding = embedding * (labels != -1).to(embedding.dtype)
    for value, table in [(-1, prompt.not_a_point_embed), *enumerate(prompt.point_embeddings)]:
        embedding = embedding + (labels == value).to(embedding.dtype) * table.weight
    return embedding


def dense_position(prompt):
    """The official `get_dense_pe`, of a constant grid."""
    h, w = prompt.image_embedding_size
    y, x = torch.meshgrid((torch.arange(h) + 0.5) / h, (torch.arange(w) + 0.5) / w, indexing="ij")
    grid = torch.stack([x, y], dim=-1).numpy()
    return prompt.pe_layer._pe_encoding(torch.from_numpy(grid)).permute(2, 0, 1)[None]
