// Camera paths: poses at even times, played against the clock.

/** The pose of a path at a time in seconds; frames are [center, rotation, field of view], 8 numbers each. */
function poseAt(path, time) {
    const last = path.frames.length / 8 - 1;
    const at = Math.max(0, Math.min(last, path.seconds > 0 ? time / path.seconds * last : 0));
    const frame = (i) => {
        const f = path.frames.slice(8 * i, 8 * i + 8);
        return { center: f.slice(0, 3), rotation: f.slice(3, 7), fov: f[7] };
    };
    const first = Math.min(Math.floor(at), Math.max(0, last - 1));
    return last > 0 ? between(frame(first), frame(first + 1), at - first) : frame(0);
}

/** Once around what `home` looks at, for scenes that bring no path. */
function aroundPath(home, distance, up, seconds) {
    const middle = add(home.center, axis(home, 2), distance);
    const frames = [];
    for (let i = 0; i <= 90; i++) {
        const turn = about(up, 2 * Math.PI * i / 90);
        const rotation = multiply(turn, home.rotation);
        frames.push(...add(middle, turned([0, 0, 1], rotation), -distance), ...rotation, home.fov);
    }
    return { name: 'Around the scene', seconds, frames };
}

const clockText = (s) => `${Math.floor(s / 60)}:${String(Math.floor(s % 60)).padStart(2, '0')}`;

/** Connects the controls with `paths`; `show(pose)` is called for each moment. */
function playing(paths, show) {
    const [play, choice, slider, clock] = ['play', 'paths', 'time', 'clock'].map((id) => document.getElementById(id));
    let [path, time, since] = [paths[0], 0, null];
    paths.forEach((p, i) => choice.append(element('option', { value: String(i), textContent: p.name })));

    function tell() {
        play.textContent = since === null ? 'Play' : 'Pause';
        slider.value = String(path.seconds > 0 ? time / path.seconds : 0);
        clock.textContent = `${clockText(time)} / ${clockText(path.seconds)}`;
    }
    function pause() {
        since = null;
        tell();
    }
    function tick(now) {
        if (since === null) return;
        time = Math.min(path.seconds, time + (now - since) / 1000);
        since = now;
        show(poseAt(path, time));
        if (time >= path.seconds) pause();
        else requestAnimationFrame(tick);
        tell();
    }
    function toggle() {
        if (since !== null) return pause();
        if (time >= path.seconds) time = 0;
        since = performance.now();
        tell();
        requestAnimationFrame(tick);
    }
    play.onclick = toggle;
    slider.oninput = () => {
        pause();
        time = slider.value * path.seconds;
        show(poseAt(path, time));
        tell();
    };
    choice.onchange = () => {
        [path, time] = [paths[+choice.value], 0];
        pause();
        show(poseAt(path, 0));
    };
    tell();
    return { toggle, pause };
}
