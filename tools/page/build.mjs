// Makes assets/page/renderer.js: what the page uses of the PlayCanvas engine, in one minified file.
//
// usage: npm ci && node build.mjs      (in this folder; FMLGS itself needs neither npm nor node)
import { build } from 'esbuild';
import { cpSync, readFileSync, statSync } from 'node:fs';

const { version } = JSON.parse(readFileSync('node_modules/playcanvas/package.json'));
const out = new URL('../../assets/page/', import.meta.url);

// Shaders for WebGPU, which the page does not use.
const unused = /[\\/]shader-lib[\\/]wgsl[\\/]chunks[\\/]/;
const without = {
    name: 'without shaders for WebGPU',
    setup(b) {
        b.onLoad({ filter: unused }, ({ path }) => {
            const [, names] = readFileSync(path, 'utf8').match(/export \{([^}]*)\}/);
            const exported = names.split(',').map((n) => n.trim().split(/\s+/).pop());
            const empty = (n) => (n === 'default' ? 'export default "";' : `export const ${n} = "";`);
            return { contents: exported.map(empty).join('\n') };
        });
    },
};

const result = await build({
    entryPoints: ['renderer.js'],
    bundle: true,
    minify: true,
    format: 'iife',
    globalName: 'pc',
    target: 'es2022',
    charset: 'utf8',
    legalComments: 'none',
    banner: { js: `/* PlayCanvas engine ${version}, MIT license, copyright PlayCanvas Ltd.: see renderer.LICENSE.txt */` },
    metafile: true,
    plugins: [without],
    outfile: new URL('renderer.js', out).pathname,
});
cpSync('node_modules/playcanvas/LICENSE', new URL('renderer.LICENSE.txt', out).pathname);
if (process.argv.includes('--sizes')) {
    const [bundle] = Object.values(result.metafile.outputs);
    const inputs = Object.entries(bundle.inputs).sort((a, b) => b[1].bytesInOutput - a[1].bytesInOutput);
    for (const [name, { bytesInOutput }] of inputs.slice(0, 60)) console.log(bytesInOutput, name.replace(/.*playcanvas\/build\//, ''));
}
console.log(`playcanvas ${version}: ${statSync(new URL('renderer.js', out)).size} bytes`);
