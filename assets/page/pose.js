// Cameras: a pose is a center, a rotation [x, y, z, w] whose axes are right, down and forward, and a vertical field of
// view in radians.

const add = (a, b, s = 1) => a.map((v, i) => v + s * b[i]);
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const length = (a) => Math.hypot(...a);
const unit = (a) => { const l = length(a) || 1; return a.map((v) => v / l); };
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const mix = (a, b, t) => a.map((v, i) => v + (b[i] - v) * t);

function multiply([ax, ay, az, aw], [bx, by, bz, bw]) {
    return [
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    ];
}

/** A vector turned by a rotation. */
function turned(v, [x, y, z, w]) {
    const t = cross([x, y, z], v).map((c) => 2 * c);
    return add(add(v, t, w), cross([x, y, z], t));
}

const axis = (pose, i) => turned([0, 1, 2].map((k) => +(k === i)), pose.rotation);
const about = (v, angle) => [...v.map((c) => c * Math.sin(angle / 2)), Math.cos(angle / 2)];

/** The rotation with these axes. */
function rotationOf(x, y, z) {
    const m = [x, y, z];
    const trace = x[0] + y[1] + z[2];
    if (trace > 0) {
        const s = 2 * Math.sqrt(trace + 1);
        return [(y[2] - z[1]) / s, (z[0] - x[2]) / s, (x[1] - y[0]) / s, s / 4];
    }
    const i = [0, 1, 2].reduce((best, k) => (m[k][k] > m[best][best] ? k : best));
    const [j, k] = [(i + 1) % 3, (i + 2) % 3];
    const s = 2 * Math.sqrt(1 + m[i][i] - m[j][j] - m[k][k]);
    const q = [0, 0, 0, (m[j][k] - m[k][j]) / s];
    q[i] = s / 4;
    q[j] = (m[i][j] + m[j][i]) / s;
    q[k] = (m[i][k] + m[k][i]) / s;
    return q;
}

/** From `center` towards `target`, with `up` upwards; `fallback` is the down axis where both are along one line. */
function looking(center, target, up, fov, fallback) {
    const forward = unit(add(target, center, -1));
    let right = cross(forward, up);
    if (length(right) < 1e-4) right = cross(fallback, forward);
    right = unit(right);
    return { center, rotation: rotationOf(right, cross(forward, right), forward), fov };
}

/** The rotation between two, by the shorter way. */
function slerp(a, b, t) {
    let cos = a.reduce((s, v, i) => s + v * b[i], 0);
    const sign = cos < 0 ? -1 : 1;
    cos = Math.min(1, cos * sign);
    const angle = Math.acos(cos);
    const [s, u] = angle < 1e-4 ? [1 - t, t] : [Math.sin((1 - t) * angle) / Math.sin(angle), Math.sin(t * angle) / Math.sin(angle)];
    const q = a.map((v, i) => v * s + sign * b[i] * u);
    const l = Math.hypot(...q);
    return q.map((v) => v / l);
}

const between = (a, b, t) => ({
    center: mix(a.center, b.center, t),
    rotation: slerp(a.rotation, b.rotation, t),
    fov: a.fov + (b.fov - a.fov) * t,
});
