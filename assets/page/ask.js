// Questions: the program's own language as WebAssembly, and the answer below the field.

/** Returns `ask(question)`, which gives an answer or null; null if the page carries no things to ask for. */
async function asking() {
    if (!document.getElementById('language').textContent) return null;
    const [code, scene, known] = await Promise.all(['language', 'asked', 'dictionary'].map(unpack));
    const { instance } = await WebAssembly.instantiate(code);
    const { memory, room, know, open, ask, told } = instance.exports;
    const put = (bytes) => {
        const at = room(bytes.length) >>> 0;
        new Uint8Array(memory.buffer, at, bytes.length).set(bytes);
    };
    put(known);
    know();
    put(scene);
    if (!open()) throw new Error('The names in this page are damaged.');
    return (question) => {
        put(new TextEncoder().encode(JSON.stringify(question)));
        const length = ask() >>> 0;
        return JSON.parse(new TextDecoder().decode(new Uint8Array(memory.buffer, told() >>> 0, length)));
    };
}

/** The text with these words of it marked. */
function marked(text, words) {
    const low = text.toLowerCase();
    // Lower case may have another length in some scripts.
    const places = low.length === text.length ? words.map((w) => [low.indexOf(w), w.length]).filter(([at]) => at >= 0) : [];
    places.sort((a, b) => a[0] - b[0]);
    const pieces = [];
    let from = 0;
    for (const [at, length] of places) {
        if (at < from) continue;
        pieces.push(text.slice(from, at), element('mark', { textContent: text.slice(at, at + length) }));
        from = at + length;
    }
    return [...pieces, text.slice(from)];
}

/** Shows an answer to `text` in `place`; `name(id)` is a full name, `choose(id)` is called for a choice. */
function showAnswer(place, text, answer, name, choose) {
    const { found, ambiguous, guess, said, why, misunderstood, near, notes, steps } = answer;
    const offer = (id) => element('button', { type: 'button', textContent: name(id), onclick: () => choose(id) });
    const line = element('p');
    if (said) line.append(element('b', { textContent: said }));
    else if (ambiguous) line.append(element('b', { textContent: 'Which one? ' }), `${found.length} fit equally.`);
    else if (found.length) line.append(element('b', { textContent: found.length === 1 ? name(found[0]) : `${found.length} things` }));
    else line.append(...marked(text, misunderstood));
    if (found.length && guess) line.append(' ', element('span', { className: 'guess', textContent: 'a guess' }));
    const weak = [...(why && !said ? [why] : []), ...notes].map((t) => element('p', { className: 'weak', textContent: t }));
    const choices = (ambiguous ? found : found.length ? [] : near).slice(0, 6);
    const rows = steps.length < 2 ? [] : steps.map(([what, left]) => element('li', {},
        element('span', { textContent: what.trim() }), element('span', { className: 'weak', textContent: `${left} left` })));
    const parts = [line, ...weak];
    if (choices.length) parts.push(element('div', {}, ...choices.map(offer)));
    if (rows.length) parts.push(element('ol', {}, ...rows));
    place.replaceChildren(...parts);
}
