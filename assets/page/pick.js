// What lies under a pixel: the Gaussians along its ray, from the front.

/**
 * What covers a pixel: `share` of its light by identity, wholes and pieces alike, `depth` and `point` of the surface; null
 * where mostly nothing is. `x` and `y` in pixels of a picture `height` pixels high, from its middle; `hidden(i)` says what
 * is not drawn, `whole(id)` lists an identity and what it is a piece of.
 */
function pick(gaussians, identity, pose, x, y, height, hidden, whole) {
    const focal = 0.5 * height / Math.tan(0.5 * pose.fov);
    // In the axes of the file, y and z are the other way round.
    const flip = ([a, b, c]) => [a, -b, -c];
    const [cx, cy, cz] = flip(pose.center);
    const forward = flip(axis(pose, 2));
    const ray = unit(flip(turned([x / focal, y / focal, 1], pose.rotation)));
    const cos = dot(ray, forward);
    const { position: [px, py, pz], scale: [sx, sy, sz], rotation: [rx, ry, rz, rw], opacity } = gaussians;
    const hits = [];
    for (let i = 0; i < gaussians.n; i++) {
        const [dx, dy, dz] = [px[i] - cx, py[i] - cy, pz[i] - cz];
        const along = dx * ray[0] + dy * ray[1] + dz * ray[2];
        if (along <= 0.01) continue;
        // Pictures are blurred by 0.3 square pixels, which is a size in the scene.
        const blur = 0.55 * along * cos / focal;
        const reach = 3 * (Math.max(sx[i], sy[i], sz[i]) + blur);
        const off = dx * dx + dy * dy + dz * dz - along * along;
        if (off > reach * reach || hidden(i)) continue;
        const back = [-rx[i], -ry[i], -rz[i], rw[i]];
        const size = [sx[i] + blur, sy[i] + blur, sz[i] + blur];
        const d = turned([dx, dy, dz], back).map((v, k) => v / size[k]);
        const r = turned(ray, back).map((v, k) => v / size[k]);
        const t = dot(d, r) / dot(r, r);
        const alpha = opacity[i] * Math.exp(-0.5 * Math.max(0, dot(d, d) - t * t * dot(r, r)));
        if (alpha > 1 / 255) hits.push([along * cos, Math.min(alpha, 0.99), i]);
    }
    hits.sort((a, b) => a[0] - b[0]);
    const share = new Map();
    let [left, depth] = [1, 0];
    for (const [z, alpha, i] of hits) {
        const weight = left * alpha;
        if (left >= 0.5 && left - weight < 0.5) depth = z;
        left -= weight;
        for (const id of whole(identity[i])) share.set(id, (share.get(id) ?? 0) + weight);
        if (left < 1e-3) break;
    }
    if (left > 0.5) return null;
    return { share, depth, point: add(pose.center, turned([x / focal, y / focal, 1], pose.rotation), depth) };
}
