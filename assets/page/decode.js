// What the page carries as text becomes arrays again.

/** Bytes of the element `id`: base64 of gzip. */
async function unpack(id) {
    const text = atob(document.getElementById(id).textContent);
    const packed = new Uint8Array(text.length);
    for (let i = 0; i < text.length; i++) packed[i] = text.charCodeAt(i);
    const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream('gzip'));
    return new Uint8Array(await new Response(stream).arrayBuffer());
}

/**
 * Gaussians of a file of the format SPZ, version 3, which is unpacked already. Axes as in the file: x right, y up, z
 * backward. Scales and opacities are activated; `rest[c]` has coefficient c of all, those of one color together.
 */
function readGaussians(bytes) {
    const head = new DataView(bytes.buffer, bytes.byteOffset, 16);
    const [magic, version, n] = [0, 4, 8].map((at) => head.getUint32(at, true));
    if (magic !== 0x5053474e || version !== 3) throw new Error('The Gaussians in this page are damaged.');
    const [degree, bits] = [head.getUint8(12), head.getUint8(13)];
    const coefficients = (degree + 1) ** 2 - 1;
    let at = 16;
    const take = (each) => bytes.subarray(at, (at += each * n));
    const [places, alphas, colors, sizes, turns, waves] = [9, 1, 3, 3, 4, 3 * coefficients].map(take);
    const planes = (count) => Array.from({ length: count }, () => new Float32Array(n));
    const [position, scale, rotation, color] = [planes(3), planes(3), planes(4), planes(3)];
    const [opacity] = planes(1);
    const rest = planes(3 * coefficients);
    const size = Float32Array.from({ length: 256 }, (_, v) => Math.exp(v / 16 - 10));
    const unit = 2 ** -bits;
    for (let i = 0; i < n; i++) {
        for (let a = 0; a < 3; a++) {
            const p = 9 * i + 3 * a;
            position[a][i] = ((places[p] << 8 | places[p + 1] << 16 | places[p + 2] << 24) >> 8) * unit;
            scale[a][i] = size[sizes[3 * i + a]];
            color[a][i] = (colors[3 * i + a] / 255 - 0.5) / 0.15;
            for (let c = 0; c < coefficients; c++) {
                rest[a * coefficients + c][i] = (waves[3 * (i * coefficients + c) + a] - 128) / 128;
            }
        }
        opacity[i] = alphas[i] / 255;
        // Three of x, y, z, w with ten bits each, without the largest, whose place is in the first two bits.
        let word = (turns[4 * i] | turns[4 * i + 1] << 8 | turns[4 * i + 2] << 16 | turns[4 * i + 3] << 24) >>> 0;
        const largest = word >>> 30;
        let left = 1;
        for (let k = 3; k >= 0; k--) {
            if (k === largest) continue;
            const v = (word & 511) / 511 * Math.SQRT1_2;
            rotation[k][i] = word & 512 ? -v : v;
            left -= v * v;
            word >>>= 10;
        }
        rotation[largest][i] = Math.sqrt(Math.max(0, left));
    }
    return { n, degree, position, scale, rotation, opacity, color, rest };
}

/** The number of each Gaussian's identity: all low bytes, then the next ones, then the highest. */
function readIdentities(bytes) {
    const n = bytes.length / 3;
    return Uint32Array.from({ length: n }, (_, i) => bytes[i] | bytes[n + i] << 8 | bytes[2 * n + i] << 16);
}
