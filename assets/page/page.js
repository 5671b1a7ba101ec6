// The page: what it carries, drawn, listed and listened to.

function fail(title, text) {
    document.body.dataset.state = 'error';
    document.getElementById('message-title').textContent = title;
    document.getElementById('message-text').textContent = text;
}

/** Makes the renderer's global, which travels compressed. */
async function loadRenderer() {
    const url = URL.createObjectURL(new Blob([await unpack('renderer')], { type: 'text/javascript' }));
    await new Promise((done, failed) => {
        document.head.append(element('script', { src: url, onload: done, onerror: () => failed(new Error('The renderer in this page is damaged.')) }));
    });
    URL.revokeObjectURL(url);
}

/** The tint of a color: bright, and far enough from gray. */
function vivid(color) {
    const [low, high] = [Math.min(...color), Math.max(...color)];
    if (high - low < 24) return [70, 150, 240];
    const floor = Math.min(low / high, 0.35);
    return color.map((v) => Math.round(255 * (floor + (1 - floor) * (v - low) / (high - low))));
}

async function start() {
    const scene = JSON.parse(document.getElementById('scene').textContent);
    const canvas = document.getElementById('picture');
    // Identities without Gaussians are left out of the list, their numbers are not.
    const most = scene.identities.reduce((id, it) => Math.max(id, it.id), 0);
    const byId = new Map(scene.identities.map((it) => [it.id, it]));
    const ancestors = (id) => {
        const line = [];
        for (let it = byId.get(id); it; it = byId.get(it.parent)) line.push(it.id);
        return line;
    };

    const state = { selected: 0, hidden: new Set(), flying: null };
    const camera = { pose: null, distance: scene.distance, nearest: scene.distance * 1e-3 };
    let drawn = null;
    let player = null;

    // Views
    const size = () => [canvas.clientWidth, canvas.clientHeight];
    /** The field of view that shows as much of the width in a narrower picture. */
    function fitted(fov) {
        const [width, height] = size();
        const wider = Math.max(1, scene.view.aspect / (width / height || 1));
        return Math.min(2.6, 2 * Math.atan(Math.tan(fov / 2) * wider));
    }
    const home = () => ({ center: scene.view.center, rotation: scene.view.rotation, fov: fitted(scene.view.fov) });
    function show(pose) {
        camera.pose = pose;
        drawn?.look(pose);
    }
    function jump(pose) {
        state.flying = null;
        show(pose);
    }
    function fly(to, distance) {
        player?.pause();
        const [from, near, began] = [camera.pose, camera.distance, performance.now()];
        const still = matchMedia('(prefers-reduced-motion: reduce)').matches;
        const flight = (state.flying = {});
        const step = (now) => {
            if (state.flying !== flight) return;
            const t = still ? 1 : Math.min(1, Math.max(0, now - began) / 700);
            const eased = t * t * (3 - 2 * t);
            camera.distance = near + (distance - near) * eased;
            show(t < 1 ? between(from, to, eased) : to);
            if (t < 1) requestAnimationFrame(step);
            else state.flying = null;
        };
        step(began);
    }
    function flyTo(id) {
        const it = byId.get(id);
        const shorter = Math.min(1, canvas.clientWidth / canvas.clientHeight);
        const distance = Math.max(camera.nearest, 2 * it.radius / (Math.sin(home().fov / 2) * shorter));
        const forward = it.from ?? axis(camera.pose, 2);
        const center = add(it.center, forward, -distance);
        fly(looking(center, it.center, scene.up, home().fov, axis(camera.pose, 1)), distance);
    }
    function reset() {
        fly(home(), scene.distance);
    }

    // What is selected and shown
    const isHidden = (id) => ancestors(id).some((whole) => state.hidden.has(whole));
    function tint() {
        const bytes = new Uint8Array(256 * Math.ceil((most + 1) / 256) * 4);
        bytes[3] = state.selected ? DIMMED : PLAIN;
        for (const it of scene.identities) {
            const line = ancestors(it.id);
            const chosen = line.includes(state.selected);
            const color = chosen ? vivid(byId.get(state.selected).color) : [0, 0, 0];
            const how = isHidden(it.id) ? HIDDEN : !state.selected ? PLAIN : chosen ? TINTED : DIMMED;
            bytes.set([...color, how], 4 * it.id);
        }
        drawn?.tint(bytes);
    }
    const chip = document.getElementById('chosen');
    function select(id) {
        state.selected = id;
        const it = byId.get(id);
        chip.hidden = !it;
        if (it) {
            document.getElementById('chosen-name').textContent = it.full;
            document.getElementById('chosen-count').textContent = `${it.count.toLocaleString('en-US')} Gaussians`;
            chip.querySelector('.swatch').style.background = colorOf(vivid(it.color));
        }
        list.mark(id, ancestors(id));
        tint();
    }
    function hide(id) {
        if (!state.hidden.delete(id)) state.hidden.add(id);
        list.hidden(isHidden);
        tint();
    }
    const list = listing(document.getElementById('list'), scene.identities, (id) => {
        select(id);
        flyTo(id);
    }, hide);
    const words = document.getElementById('words');
    document.getElementById('search').hidden = scene.identities.length === 0;
    words.oninput = () => list.search(words.value);
    words.onkeydown = (e) => {
        const first = e.key === 'Enter' && document.querySelector('#list li:not([hidden]) .name');
        if (first) first.click();
    };

    jump(home());
    if (!document.createElement('canvas').getContext('webgl2')) {
        return fail('This browser does not offer WebGL 2', 'Another browser, or hardware acceleration in this one’s settings, draws the scene.');
    }
    const [gaussians, identity] = [readGaussians(await unpack('gaussians')), readIdentities(await unpack('identities'))];
    await loadRenderer();

    // The picture
    drawn = drawing(canvas, gaussians, identity, most + 1, scene.background, scene.antialias, (due) => {
        document.body.dataset.state = due || state.flying ? 'drawing' : 'resting';
    });
    const fit = () => {
        const [[width, height], ratio] = [size(), Math.min(2, devicePixelRatio || 1)];
        drawn.resize(Math.max(1, Math.round(width * ratio)), Math.max(1, Math.round(height * ratio)));
    };
    const atHome = () => camera.pose.center === scene.view.center && !state.flying;
    new ResizeObserver(() => {
        if (atHome()) show(home());
        fit();
    }).observe(canvas);
    fit();
    show(camera.pose);
    tint();
    canvas.addEventListener('webglcontextlost', () => fail('The graphics device was lost', 'Reload the page to draw it again.'));

    const under = (x, y) => {
        const [width, height] = size();
        const hidden = (i) => identity[i] !== 0 && isHidden(identity[i]);
        return pick(gaussians, identity, camera.pose, x - width / 2, y - height / 2, height, hidden, ancestors);
    };
    let clickedAt = [-1e9, 0, 0];
    const pressed = orbiting(canvas, camera, scene.up, () => {
        state.flying = null;
        player.pause();
        show(camera.pose);
    }, (x, y) => {
        const found = under(x, y);
        const now = performance.now();
        const twice = now - clickedAt[0] < 350 && Math.hypot(x - clickedAt[1], y - clickedAt[2]) < 6;
        clickedAt = [now, x, y];
        if (twice && found) {
            const forward = axis(camera.pose, 2);
            return fly(looking(add(found.point, forward, -found.depth), found.point, scene.up, camera.pose.fov, axis(camera.pose, 1)), found.depth);
        }
        const largest = (parent) => {
            let best = [0, 0.2];
            for (const [id, share] of found?.share ?? []) if (byId.get(id).parent === parent && share > best[1]) best = [id, share];
            return best[0];
        };
        const object = largest(0);
        // Again on what is selected already: one step further in, and from the innermost out again.
        const inner = ancestors(state.selected).includes(object) && object ? largest(state.selected) : 0;
        select(inner || object);
    });

    const paths = [...scene.paths, aroundPath(scene.view, scene.distance, scene.up, 20)];
    player = playing(paths, (pose) => {
        camera.distance = Math.max(camera.nearest, dot(add(scene.focus, pose.center, -1), turned([0, 0, 1], pose.rotation)));
        jump({ ...pose, fov: fitted(pose.fov) });
    });

    // Keys
    const help = document.getElementById('help');
    const explain = () => {
        help.showModal();
        help.scrollTop = 0;
    };
    document.getElementById('keys').onclick = explain;
    document.getElementById('home').onclick = reset;
    document.getElementById('chosen-clear').onclick = () => select(0);
    /** The camera as a file of the program has it. */
    const cameraFile = () => {
        const [width, height] = size();
        const focal = 0.5 * height / Math.tan(camera.pose.fov / 2);
        return {
            width_px: width, height_px: height, focal_px: [focal, focal], principal_px: [width / 2, height / 2],
            world_from_camera: [0, 1, 2].flatMap((i) => axis(camera.pose, i)), center: add(camera.pose.center, scene.origin),
        };
    };
    const actions = {
        ' ': () => player.toggle(),
        '/': () => words.focus(),
        '?': explain,
        Escape: () => (document.body.classList.contains('alone') ? document.body.classList.remove('alone') : select(0)),
        c: () => navigator.clipboard?.writeText(JSON.stringify(cameraFile())),
        f: () => (state.selected ? flyTo(state.selected) : reset()),
        h: () => state.selected && hide(state.selected),
        p: () => document.body.classList.toggle('alone'),
        r: reset,
    };
    addEventListener('keydown', (e) => {
        const typing = e.target.matches('input, select, textarea');
        if (typing && e.key === 'Escape') return e.target.blur();
        const button = e.target.matches('button, summary') && (e.key === ' ' || e.key === 'Enter');
        if (typing || button || help.open || e.ctrlKey || e.metaKey || e.altKey) return undefined;
        const action = actions[e.key.length === 1 ? e.key.toLowerCase() : e.key];
        if (!action && !pressed(e)) return undefined;
        e.preventDefault();
        return action?.();
    });
    window.fmlgs = { camera: cameraFile, frames: drawn.frames, selected: () => state.selected };
    drawn.start();
}

start().catch((e) => {
    console.error(e);
    fail('The scene cannot be shown', e.message);
});
