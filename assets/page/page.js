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

    // `asked` is the last answer, to which Enter flies; `talked` is what "it" stands for in a question.
    const state = { selected: [], hidden: new Set(), flying: null, asked: null, talked: null };
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
    /** Flies to a view of all `ids`; of one, from where a photo saw it best. */
    function flyTo(ids) {
        const all = ids.map((id) => byId.get(id)).filter(Boolean);
        if (all.length === 0) return;
        const middle = all.reduce((sum, it) => add(sum, it.center, 1 / all.length), [0, 0, 0]);
        const reach = (it) => it.radius + Math.hypot(...add(it.center, middle, -1));
        const shorter = Math.min(1, canvas.clientWidth / canvas.clientHeight);
        const room = all.length === 1 ? 2 : 1.2;
        const distance = Math.max(camera.nearest, room * Math.max(...all.map(reach)) / (Math.sin(home().fov / 2) * shorter));
        const forward = (all.length === 1 && all[0].from) || axis(camera.pose, 2);
        const center = add(middle, forward, -distance);
        fly(looking(center, middle, scene.up, home().fov, axis(camera.pose, 1)), distance);
    }
    function reset() {
        fly(home(), scene.distance);
    }

    // What is selected and shown
    const isHidden = (id) => ancestors(id).some((whole) => state.hidden.has(whole));
    function tint() {
        const bytes = new Uint8Array(256 * Math.ceil((most + 1) / 256) * 4);
        const any = state.selected.length > 0;
        bytes[3] = any ? DIMMED : PLAIN;
        for (const it of scene.identities) {
            const chosen = ancestors(it.id).find((id) => state.selected.includes(id));
            const color = chosen ? vivid(byId.get(chosen).color) : [0, 0, 0];
            const how = isHidden(it.id) ? HIDDEN : !any ? PLAIN : chosen ? TINTED : DIMMED;
            bytes.set([...color, how], 4 * it.id);
        }
        drawn?.tint(bytes);
    }
    const chip = document.getElementById('chosen');
    function select(ids) {
        state.selected = ids.filter((id) => byId.has(id));
        const all = state.selected.map((id) => byId.get(id));
        chip.hidden = all.length === 0;
        if (all.length) {
            const count = all.reduce((sum, it) => sum + it.count, 0);
            document.getElementById('chosen-name').textContent = all.length === 1 ? all[0].full : `${all.length} things`;
            document.getElementById('chosen-count').textContent = `${count.toLocaleString('en-US')} Gaussians`;
            chip.querySelector('.swatch').style.background = colorOf(vivid(all[0].color));
        }
        list.mark(state.selected, ancestors);
        tint();
    }
    function hide(ids) {
        for (const id of ids) if (!state.hidden.delete(id)) state.hidden.add(id);
        list.hidden(isHidden);
        tint();
    }
    function goTo(ids) {
        select(ids);
        flyTo(ids);
    }
    /** Selects by hand, in place of what was asked for. */
    function choose(ids) {
        state.asked = null;
        select(ids);
    }
    const list = listing(document.getElementById('list'), scene.identities, (id) => {
        choose([id]);
        flyTo([id]);
    }, (id) => hide([id]));

    // Questions
    const words = document.getElementById('words');
    const place = document.getElementById('answer');
    let [asks, kept] = [null, []];
    document.getElementById('search').hidden = scene.identities.length === 0;
    const question = (text) => asks?.({
        text, eye: camera.pose.center, forward: axis(camera.pose, 2), last: state.talked ?? state.selected,
    });
    /** Answers while somebody types: shows what is found, or lists names that begin so. */
    function answer() {
        const text = words.value;
        const told = text.trim() ? question(text) : null;
        const before = state.asked;
        if (!before) kept = state.selected;
        state.asked = told?.found.length ? told.found : null;
        const named = state.asked ? list.only(state.asked) : list.search(text);
        place.hidden = !told || (!state.asked && named);
        if (!place.hidden) {
            showAnswer(place, text, told, (id) => byId.get(id)?.full ?? `#${id}`, (id) => goTo(state.asked = [id]));
        }
        // Without an answer, what was selected before is selected again.
        if (state.asked || before) select(state.asked ?? kept);
    }
    words.onfocus = () => { state.talked = state.selected; };
    words.oninput = answer;
    words.onkeydown = (e) => {
        if (e.key !== 'Enter') return;
        if (state.asked) goTo(state.asked);
        else document.querySelector('#list li:not([hidden]) .name')?.click();
        state.talked = state.selected;
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
        const [one] = state.selected.length === 1 ? state.selected : [0];
        const inner = ancestors(one).includes(object) && object ? largest(one) : 0;
        const chosen = inner || object;
        choose(chosen ? [chosen] : []);
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
    document.getElementById('chosen-clear').onclick = () => choose([]);
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
        Escape: () => (document.body.classList.contains('alone') ? document.body.classList.remove('alone') : choose([])),
        c: () => navigator.clipboard?.writeText(JSON.stringify(cameraFile())),
        f: () => (state.selected.length ? flyTo(state.selected) : reset()),
        h: () => hide(state.selected),
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
    window.fmlgs = { camera: cameraFile, frames: drawn.frames, selected: () => state.selected, name: (id) => byId.get(id).full };
    drawn.start();
    try {
        asks = await asking();
    } catch (e) {
        // Older browsers, or a damaged page: names are still searched.
        console.warn(e);
    }
    words.placeholder = asks ? 'Ask: largest thing on the table' : 'Search names';
    window.fmlgs.ask = asks && question;
    if (words.value) answer();
}

start().catch((e) => {
    console.error(e);
    fail('The scene cannot be shown', e.message);
});
