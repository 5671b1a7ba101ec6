// The list: objects, their parts below them, what is shown and what is selected.

const EYE = 'M1.5 8S4 3.5 8 3.5 14.5 8 14.5 8 12 12.5 8 12.5 1.5 8 1.5 8ZM8 10a2 2 0 1 0 0-4 2 2 0 0 0 0 4';

function element(tag, properties = {}, ...children) {
    const made = Object.assign(document.createElement(tag), properties);
    made.append(...children);
    return made;
}

function eyePicture() {
    const name = 'http://www.w3.org/2000/svg';
    const svg = document.createElementNS(name, 'svg');
    svg.setAttribute('viewBox', '0 0 16 16');
    for (const [d, which] of [[EYE, 'open'], ['M2.5 13.5l11-11', 'slash']]) {
        const path = document.createElementNS(name, 'path');
        path.setAttribute('d', d);
        path.setAttribute('class', which);
        svg.append(path);
    }
    return svg;
}

/** The words of a name or of a query, each behind a space. */
const wordsOf = (text) => ` ${text.toLowerCase().replace(/[^\p{L}\p{N}#]+/gu, ' ').trim()}`;

const colorOf = ([r, g, b]) => `rgb(${r} ${g} ${b})`;

/** Fills `nav` with `identities`; `select(id)` and `hide(id)` are called for clicks. */
function listing(nav, identities, select, hide) {
    const rows = new Map();
    const children = new Map();
    for (const it of identities) {
        if (!children.has(it.parent)) children.set(it.parent, []);
        children.get(it.parent).push(it);
    }

    function branch(parent) {
        const list = element('ul');
        for (const it of children.get(parent) ?? []) {
            const swatch = element('span', { className: 'swatch' });
            swatch.style.background = colorOf(it.color);
            const count = element('span', { className: 'weak', textContent: it.count.toLocaleString('en-US') });
            const name = element('button', { type: 'button', className: 'name', title: it.full },
                swatch, element('span', { textContent: it.name }), count);
            name.dataset.id = it.id;
            const eye = element('button', { type: 'button', className: 'eye', title: `Hide or show ${it.name}` }, eyePicture());
            eye.setAttribute('aria-label', `Hide ${it.full}`);
            eye.setAttribute('aria-pressed', 'false');
            const parts = children.has(it.id) ? branch(it.id) : null;
            const fold = element('button', { type: 'button', className: 'fold' });
            if (parts) {
                fold.setAttribute('aria-label', `Parts of ${it.full}`);
                fold.onclick = () => unfold(it.id, parts.hidden);
            } else {
                fold.style.visibility = 'hidden';
                fold.tabIndex = -1;
            }
            const row = element('div', { className: 'row' }, fold, name, eye);
            const item = element('li', {}, row, ...(parts ? [parts] : []));
            rows.set(it.id, { it, row, eye, fold, parts, item });
            if (parts) unfold(it.id, false);
            name.onclick = () => select(it.id);
            eye.onclick = () => hide(it.id);
            list.append(item);
        }
        return list;
    }
    function unfold(id, open) {
        const { fold, parts } = rows.get(id);
        if (!parts) return;
        parts.hidden = !open;
        fold.setAttribute('aria-expanded', String(open));
    }

    const nothing = element('p', { className: 'empty' });
    if (identities.length === 0) {
        nothing.append(element('b', { textContent: 'No objects in this scene' }),
            'Find objects with FMLGS (Find objects, or fmlgs preprocess) and export the page again.');
    }
    nav.append(branch(0), nothing);

    /** Shows only what `fits`, and what that is a part of; returns how many rows are left. */
    function only(fits) {
        let left = 0;
        // Whether anything below fits by itself; what is below something that fits is there to be unfolded.
        const visit = (parent, within) => {
            let any = false;
            for (const it of children.get(parent) ?? []) {
                const own = within || fits(it);
                const below = visit(it.id, own);
                rows.get(it.id).item.hidden = !(own || below);
                unfold(it.id, below);
                left += +(own || below);
                any ||= !within && (own || below);
            }
            return any;
        };
        visit(0, false);
        return left;
    }

    return {
        only: (ids) => only((it) => ids.includes(it.id)),
        /** Shows only what has a word for each of the query's beginnings in its full name; returns whether anything has. */
        search(text) {
            const words = wordsOf(text).split(' ').filter(Boolean);
            const found = only((it) => words.every((w) => wordsOf(it.full).includes(` ${w}`))) > 0;
            if (identities.length) nothing.textContent = found ? '' : `Nothing is called “${text.trim()}”.`;
            return found;
        },
        /** Marks the rows of `ids` and unfolds what they are parts of. */
        mark(ids, ancestors) {
            for (const [id, { row }] of rows) {
                row.classList.toggle('on', ids.includes(id));
                row.querySelector('.name').setAttribute('aria-pressed', String(ids.includes(id)));
            }
            ids.forEach((id) => ancestors(id).slice(1).forEach((whole) => unfold(whole, true)));
            rows.get(ids[0])?.row.scrollIntoView({ block: 'nearest' });
        },
        hidden(isHidden) {
            for (const [id, { row, eye }] of rows) {
                row.classList.toggle('off', isHidden(id));
                eye.setAttribute('aria-pressed', String(isHidden(id)));
            }
        },
    };
}
