"""Reads own.txt: what WordNet lacks, or says otherwise than people in front of a scene."""

from collections import defaultdict
from pathlib import Path

from wordnet import WordNet, key


class Own:
    """Changes to WordNet."""

    def __init__(self, path: Path, all: WordNet) -> None:
        self.all = all
        # Concepts that replace those of a word.
        self.senses: dict[str, list[str]] = {}
        # Further words with their concepts.
        self.words: dict[str, list[str]] = defaultdict(list)
        self.links: dict[str, list[str]] = defaultdict(list)
        self.cuts: set[tuple[str, str]] = set()
        # Concepts that say nothing about a thing.
        self.general: set[str] = set()
        # Concepts of things that show something: a teddy bear is called a bear.
        self.likenesses: set[str] = set()
        self.modifiers: dict[str, str] = {}
        self.spellings: dict[str, str] = {}
        self.plurals: dict[str, str] = {}
        wrong = []
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
            line = line.split("#")[0]
            for change in filter(None, map(str.strip, line.split(";"))):
                try:
                    self.read(change)
                except ValueError as error:
                    wrong.append(f"{path.name}:{number}: {change}: {error}")
        if wrong:
            raise SystemExit("\n".join(wrong))

    def read(self, line: str) -> None:
        for sign, reader in (
            (" -> ", self.spelling),
            (" => ", self.plural),
            (" !< ", self.cut),
            (" < ", self.link),
            (" = ", self.synonym),
            (": ", self.sense),
        ):
            left, found, right = line.partition(sign)
            if found:
                return reader(left.strip(), [r.strip() for r in right.split(",")])
        raise ValueError("not understood")

    def spelling(self, british: str, american: list[str]) -> None:
        self.spellings[british] = american[0]

    def plural(self, plural: str, one: list[str]) -> None:
        self.plurals[plural] = one[0]

    def cut(self, concepts: str, parents: list[str]) -> None:
        for concept in concepts.split(","):
            for parent in parents:
                pair = (self.concept(concept.strip()), self.concept(parent))
                if pair[1] not in self.all.synsets[pair[0]].parents:
                    raise ValueError(f"WordNet does not say that {concept} is a kind of {parent}")
                self.cuts.add(pair)

    def link(self, all_words: str, parents: list[str]) -> None:
        above = [self.concept(p) for p in parents]
        for words in map(str.strip, all_words.split(",")):
            if words.endswith(" *"):
                self.modifiers[words[:-2]] = above[0]
            else:
                self.name(words, above)

    def name(self, words: str, above: list[str]) -> None:
        """Words between bars name one concept."""
        first, *others = [w.strip() for w in words.split("|")]
        concept = self.concept(first) if "/" in first else f"own {key(first)}"
        if "/" not in first and concept not in self.links:
            self.words[key(first)].append(concept)
        for word in others:
            self.words[key(word)].append(concept)
        self.links[concept] += above

    def synonym(self, word: str, concepts: list[str]) -> None:
        for one in word.split("|"):
            self.words[key(one)] += [self.concept(c) for c in concepts]

    def sense(self, word: str, senses: list[str]) -> None:
        if word in ("general", "likenesses"):
            getattr(self, word).update(self.concept(s) for s in senses)
        else:
            self.senses[key(word)] = [self.concept(f"{word}/{n}") for n in senses[0].split() if n != "-"]

    def concept(self, text: str) -> str:
        """The concept of "word/3", by WordNet's number, or of an own word."""
        word, found, number = text.rpartition("/")
        if found:
            return self.all.sense(key(word), int(number))
        concept = f"own {key(text)}"
        if concept not in self.links:
            raise ValueError(f"{text} was not named before")
        return concept
