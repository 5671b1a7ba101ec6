"""Looks words up in the asset as src/scene/identity/lexicon.rs does, to try changes without building."""

import zlib
from pathlib import Path

# Words that part a name from what it is made of, holds or stands on, and amounts that are named before a thing.
PARTING = {"of", "in", "on", "with", "for"}
AMOUNTS = {"pair", "piece", "set", "slice", "bunch", "pile", "stack", "group", "couple", "row"}


class Lexicon:
    def __init__(self, asset: Path) -> None:
        text = zlib.decompress(asset.read_bytes()).decode()
        words, concepts, first, plurals, spellings = text.split("@")
        pairs = lambda section: dict(l.split("\t") if "\t" in l else (l, "") for l in section.splitlines())
        self.words, self.first, self.plurals, self.spellings = map(pairs, (words, first, plurals, spellings))
        self.concepts = concepts.splitlines()

    def of(self, listed: str) -> list[int]:
        return [int(n) for n in listed.removeprefix("!").split()]

    def kinship(self, concepts: list[int], asked: set[int]) -> str | None:
        if asked & set(concepts):
            return "same"
        return "kind" if asked & self.above(concepts) else None

    def above(self, concepts: list[int]) -> set[int]:
        seen, left = set(), list(concepts)
        while left:
            for parent in self.of(self.concepts[left.pop()]):
                if parent not in seen:
                    seen.add(parent)
                    left.append(parent)
        return seen

    def is_a(self, name: str, asked: str) -> str | None:
        words = head(name.split())
        wanted = set(self.of(self.words.get(asked, "")))
        for at in range(len(words)):
            suffix = " ".join(words[at:])
            if suffix == asked:
                return "same"
            if suffix in self.words:
                concepts = self.of(self.words[suffix])
                found = self.kinship(concepts, wanted)
                if found:
                    return found
                if not any(self.concepts[c].startswith("!") for c in [*concepts, *self.above(concepts)]):
                    break
        known = next((i for i in range(len(words)) if " ".join(words[i:]) in self.words), len(words))
        first = [int(self.first[w]) for w in words[:known] if w in self.first]
        return "kind" if first and (self.kinship(first, wanted)) else None


def head(words: list[str]) -> list[str]:
    """The words of a name without what it holds or stands on, and without its letter or number: "button a"."""
    for at, word in enumerate(words):
        if at > 0 and word in PARTING:
            words = words[at + 1 :] if words[at - 1] in AMOUNTS else words[:at]
            break
    while len(words) > 1 and (len(words[-1]) == 1 or words[-1].isdigit()):
        words = words[:-1]
    return words
