// Mouse, touch and keys move the camera about a point.

/** Half a turn across so many pixels. */
const HALF_TURN_PX = 500;

/**
 * Moves `camera.pose`, which looks at a point `camera.distance` ahead, by what happens on `canvas`; `moved` is called
 * after each change, `clicked` with places where a press ends where it began.
 */
function orbiting(canvas, camera, up, moved, clicked) {
    const pivot = () => add(camera.pose.center, axis(camera.pose, 2), camera.distance);
    const pixel = () => 2 * camera.distance * Math.tan(camera.pose.fov / 2) / canvas.clientHeight;

    function orbit(dx, dy) {
        const at = pivot();
        const { rotation, fov } = camera.pose;
        // Not over the poles, where left and right change places.
        const steep = Math.asin(Math.max(-1, Math.min(1, dot(axis(camera.pose, 2), up))));
        const tilt = Math.max(-1.5, Math.min(1.5, steep - dy)) - steep;
        const turn = multiply(about(up, -dx), multiply(about(axis(camera.pose, 0), tilt), rotation));
        camera.pose = { center: add(at, turned([0, 0, 1], turn), -camera.distance), rotation: unit(turn), fov };
        moved();
    }
    function pan(dx, dy) {
        const by = add(axis(camera.pose, 0).map((v) => -dx * v), axis(camera.pose, 1), -dy);
        camera.pose = { ...camera.pose, center: add(camera.pose.center, by, pixel()) };
        moved();
    }
    function zoom(factor) {
        const distance = Math.max(camera.nearest, camera.distance * factor);
        camera.pose = { ...camera.pose, center: add(camera.pose.center, axis(camera.pose, 2), camera.distance - distance) };
        camera.distance = distance;
        moved();
    }

    const fingers = new Map();
    let [travel, pinched] = [0, false];
    const spread = () => {
        const [a, b] = [...fingers.values()];
        return { middle: [(a.x + b.x) / 2, (a.y + b.y) / 2], apart: Math.hypot(a.x - b.x, a.y - b.y) || 1 };
    };
    canvas.addEventListener('pointerdown', (e) => {
        canvas.setPointerCapture(e.pointerId);
        if (fingers.size === 0) [travel, pinched] = [0, false];
        fingers.set(e.pointerId, { x: e.clientX, y: e.clientY });
        pinched ||= fingers.size > 1;
    });
    canvas.addEventListener('pointermove', (e) => {
        const before = fingers.get(e.pointerId);
        if (!before) return;
        const [dx, dy] = [e.clientX - before.x, e.clientY - before.y];
        const was = fingers.size === 2 && spread();
        fingers.set(e.pointerId, { x: e.clientX, y: e.clientY });
        travel += Math.abs(dx) + Math.abs(dy);
        if (was) {
            const now = spread();
            pan(now.middle[0] - was.middle[0], now.middle[1] - was.middle[1]);
            zoom(was.apart / now.apart);
        } else if (travel > 4) {
            const pans = e.buttons & 6 || e.shiftKey;
            if (pans) pan(dx, dy);
            else orbit(dx * Math.PI / HALF_TURN_PX, dy * Math.PI / HALF_TURN_PX);
        }
    });
    const ends = (e) => {
        const pressed = fingers.delete(e.pointerId);
        if (pressed && e.type === 'pointerup' && travel <= 4 && !pinched && e.button === 0) clicked(e.offsetX, e.offsetY);
    };
    canvas.addEventListener('pointerup', ends);
    canvas.addEventListener('pointercancel', ends);
    canvas.addEventListener('contextmenu', (e) => e.preventDefault());
    canvas.addEventListener('wheel', (e) => {
        e.preventDefault();
        const lines = e.deltaMode === 0 ? e.deltaY : 30 * e.deltaY;
        zoom(Math.exp(Math.max(-300, Math.min(300, lines)) * 0.0015));
    }, { passive: false });

    const step = Math.PI / 24;
    const arrows = { ArrowLeft: [1, 0], ArrowRight: [-1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
    /** Whether a key moved the camera. */
    return function pressed(e) {
        const arrow = arrows[e.key];
        if (arrow && e.shiftKey) pan(40 * arrow[0], 40 * arrow[1]);
        else if (arrow) orbit(step * arrow[0], step * arrow[1]);
        else if (e.key === '+' || e.key === '=') zoom(0.87);
        else if (e.key === '-') zoom(1.15);
        else return false;
        return true;
    };
}
