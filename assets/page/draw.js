// The picture: Gaussians in the PlayCanvas engine, each tinted by its identity.

// How an identity is drawn, as the fourth number of its tint.
const HIDDEN = 0;
const PLAIN = 85;
const DIMMED = 170;
const TINTED = 255;

// Shares of the picture's sides that are drawn, and how long a picture may take before there are fewer, or more.
const DETAIL = [1, 0.7, 0.5, 0.35, 0.25];
const [SLOW_MS, FAST_MS] = [70, 28];

// Runs for each Gaussian when it is copied into the engine's buffer, whenever a tint changes.
const TINTING = `
uniform sampler2D tints;
uniform vec3 behind;
void modifySplatCenter(inout vec3 center) {}
void modifySplatRotationScale(vec3 original, vec3 modified, inout vec4 rotation, inout vec3 scale) {}
void modifySplatColor(vec3 center, inout vec4 color) {
    uint id = loadIdentity().x;
    vec4 tint = texelFetch(tints, ivec2(id & 255u, id >> 8u), 0);
    float gray = dot(color.rgb, vec3(0.299, 0.587, 0.114));
    if (tint.a < 0.2) {
        color.a = 0.0;
    } else if (tint.a > 0.9) {
        color.rgb = mix(color.rgb, tint.rgb * (0.45 + 0.9 * gray), 0.8);
    } else if (tint.a > 0.5) {
        color.rgb = mix(vec3(gray), behind, 0.65);
    }
}`;

/**
 * Draws `gaussians` into `canvas`: `identity` has a number for each, below `count`; `background` is 0 to 1.
 * `told` is called with whether pictures are due, whenever that may have changed. Throws where there is no WebGL 2.
 */
function drawing(canvas, gaussians, identity, count, background, antialias, told) {
    const device = new pc.WebglGraphicsDevice(canvas, { antialias: false, alpha: false, powerPreference: 'high-performance' });
    const options = new pc.AppOptions();
    options.graphicsDevice = device;
    options.componentSystems = [pc.CameraComponentSystem, pc.GSplatComponentSystem];
    options.devtools = false;
    const app = new pc.AppBase(canvas);
    app.init(options);
    app.autoRender = false;
    const chunks = pc.ShaderChunks.get(device, pc.SHADERLANGUAGE_GLSL);
    const change = (name, from, to) => chunks.set(name, chunks.get(name).replace(from, to));
    // The engine loses Gaussians whose outline in the picture is exactly upright: their long axis has no length there.
    const axes = 'vec2(offDiagonal, lambda1 - diagonal1)';
    change('gsplatCornerVS', axes, `(${axes} + vec2(1e-8, 0.0))`);
    // It lets them fade to nothing at their cut; the program draws them as they were trained.
    change('gsplatPS', '(exp(x * -4.0) - EXP4) * INV_EXP4', 'exp(x * -4.0)');
    app.scene.gsplat.dataFormat = pc.GSPLATDATA_LARGE;
    // As the program draws: no Gaussian is too small, and colors follow the camera at once.
    app.scene.gsplat.minPixelSize = 0;
    app.scene.gsplat.colorUpdateAngle = 1;
    app.scene.gsplat.antiAlias = antialias;

    const camera = new pc.Entity();
    camera.addComponent('camera', { clearColor: new pc.Color(...background, 1), toneMapping: pc.TONEMAP_NONE, nearClip: 0.01, farClip: 1e6 });
    app.root.addChild(camera);

    const { position, scale, rotation, opacity, color, rest, n } = gaussians;
    const [rx, ry, rz, rw] = rotation;
    const columns = {
        x: position[0], y: position[1], z: position[2], rot_0: rw, rot_1: rx, rot_2: ry, rot_3: rz, opacity,
        scale_0: scale[0], scale_1: scale[1], scale_2: scale[2], f_dc_0: color[0], f_dc_1: color[1], f_dc_2: color[2],
    };
    rest.forEach((values, i) => { columns[`f_rest_${i}`] = values; });
    const properties = Object.entries(columns).map(([name, storage]) => ({ type: 'float', name, storage, byteSize: 4 }));
    const data = new pc.GSplatData([{ name: 'vertex', count: n, properties }]);
    data.activated = true;
    const resource = new pc.GSplatResource(device, data);
    resource.format.addExtraStreams([{ name: 'identity', format: pc.PIXELFORMAT_R32U }]);
    const numbers = resource.getTexture('identity');
    numbers.lock().set(identity);
    numbers.unlock();

    const tints = new pc.Texture(device, {
        name: 'tints', width: 256, height: Math.ceil(count / 256), format: pc.PIXELFORMAT_RGBA8, mipmaps: false,
    });
    const splats = new pc.Entity();
    // From the file's axes to those of the scene: half a turn about x.
    splats.setLocalEulerAngles(180, 0, 0);
    splats.addComponent('gsplat');
    splats.gsplat.setWorkBufferModifier({ glsl: TINTING });
    splats.gsplat.setParameter('behind', background);
    splats.gsplat.resource = resource;
    app.root.addChild(splats);

    // Pictures that are still due; Gaussians are sorted beside, and drawn again as soon as they are.
    let due = 0;
    let [shown, sorted] = ['', ''];
    const sorter = () => {
        const views = app.renderer.gsplatDirector?.camerasMap.get(camera.camera.camera);
        return [...(views?.layersMap.values() ?? [])].map((view) => view.gsplatManager).find(Boolean);
    };
    // While the camera moves, pictures that take long have fewer pixels.
    let [level, moved, last, full] = [0, false, 0, [1, 1]];
    const fit = (to) => {
        level = Math.max(0, Math.min(DETAIL.length - 1, to));
        device.setResolution(...full.map((side) => Math.max(1, Math.round(side * DETAIL[level]))));
    };
    app.on('update', () => {
        const manager = sorter();
        const sorting = !manager || manager.cpuSorter?.jobsInFlight > 0 || manager.hasPendingSort;
        const now = performance.now();
        if (moved) {
            const took = now - last;
            if (took > SLOW_MS && took < 2000) fit(level + 1);
            else if (took < FAST_MS && level > 0) fit(level - 1);
        } else if (due === 0 && !sorting && level > 0) {
            fit(0);
            due = 2;
        }
        [moved, last] = [false, now];
        if (due === 0 && !sorting && sorted !== shown) {
            // The order of the last pose: what was asked for while another was sorted is left out by the engine.
            sorted = shown;
            manager.sortNeeded = true;
            due = 2;
        }
        const draws = due > 0 || sorting;
        app.renderNextFrame = draws;
        due = Math.max(0, due - 1);
        told(draws);
    });
    app.scene.on('gsplat:sorted', () => { due = Math.max(due, 2); });

    let frames = 0;
    app.on('framerender', () => { frames += +app.renderNextFrame; });
    const drawn = {
        /** Pictures so far. */
        frames: () => frames,
        draw() {
            due = Math.max(due, 2);
            told(true);
        },
        /** How every identity is drawn: four bytes each. */
        tint(bytes) {
            tints.lock().set(bytes);
            tints.unlock();
            splats.gsplat.setParameter('tints', tints);
            drawn.draw();
        },
        look(pose) {
            camera.setPosition(...pose.center);
            // The engine's camera looks backward along z, with y upwards.
            camera.setRotation(...multiply(pose.rotation, [1, 0, 0, 0]));
            camera.camera.fov = pose.fov * 180 / Math.PI;
            shown = JSON.stringify(pose);
            moved = true;
            drawn.draw();
        },
        resize(width, height) {
            full = [width, height];
            fit(level);
            drawn.draw();
        },
        start() { app.start(); },
    };
    return drawn;
}
