"""Robot models that are malformed: broken XML, elements missing, unknown or twice, values that are none."""

from __future__ import annotations

import copy
import random
import re
from collections.abc import Iterator
from xml.etree import ElementTree

from tests.support.mutants.mutant import Mutant

Element = ElementTree.Element
_NUMBERS = re.compile(r"^[-+0-9.eE ]+$")
_BAD_WORDS = {
    "a word": ("wide", "it is no number"),
    "no number": ("nan", "it is no number"),
    "an infinity": ("inf", "nothing is so large"),
    "a huge number": ("1e400", "no double is so large"),
    "two points": ("0.1.2", "it is no number"),
    "a comma": ("0,1", "numbers have points"),
    "a unit": ("1m", "numbers have no units"),
    "hexadecimal junk": ("0xzz", "it is no number"),
}


def xml_mutants(content: bytes, key: str, seed: int, cuts: int = 25) -> Iterator[Mutant]:
    """Text that is no XML, or XML that nobody should have to expand."""
    rng, text = random.Random(seed), content.decode()
    body = text.index("?>") + 2 if "?>" in text else 0
    end = text.rindex("</")
    for place in sorted(rng.sample(range(body + 1, end), cuts)):
        yield Mutant("cut off", f"byte {place}", "the root never closes", text[:place].encode(), key)
    tags = [match.start() for match in re.finditer(r"</", text)]
    for place in rng.sample(tags, min(8, len(tags))):
        close = text.index(">", place) + 1
        yield Mutant(
            "unclosed", f"byte {place}", "a tag never closes", (text[:place] + text[close:]).encode(), key
        )
    for kind, changed, because in _edits(text, body):
        assert changed != text, kind
        yield Mutant(
            kind, "the file", because, changed.encode("latin-1" if kind == "a picture" else "utf-8"), key
        )


def _edits(text: str, body: int) -> Iterator[tuple[str, str, str]]:
    """Changes of the text as such; ``body`` is where the declaration ends."""
    head, rest = text[:body], text[body:]
    unknown = text.replace("<mass>6", "<mass>&six;", 1).replace('mass value="6', 'mass value="&six;', 1)
    nested = "<model name='a'>" * 20_000 + "</model>" * 20_000
    six, file = '<!DOCTYPE m [<!ENTITY six "6">]>', '<!DOCTYPE m [<!ENTITY x SYSTEM "file:///etc/hostname">]>'
    named = rest.replace('name="base"', 'name="&j;"', 1)
    prefixed = text.replace("<link", "<x:link", 1).replace("</link", "</x:link", 1)
    yield "empty", "", "it says nothing"
    yield "blank", "  \n", "it says nothing"
    yield "no XML", "robot: {base: disc}\n", "it is no XML"
    yield "a picture", "\x89PNG\r\n", "it is no XML"
    yield "another root", "<html><body/></html>", "it is a page"
    yield "two roots", text + "<sdf version='1.9'/>", "XML has one root"
    yield "text after the end", text + "and so on", "XML has one root"
    twice = text.replace('name="base"', 'name="base" name="base"', 1)
    yield "an attribute twice", twice, "it says two things"
    yield "an attribute without quotes", text.replace('name="base"', "name=base", 1), "XML wants quotes"
    yield "a bare ampersand", text.replace('name="base"', 'name="base & co"', 1), "it begins an entity"
    yield "an unknown entity", unknown, "nobody says what it stands for"
    yield "a comment without end", text.replace("<link", "<!-- <link", 1), "it swallows the rest"
    yield "entities of entities", head + _bomb() + named, "a thousand million names"
    yield "an entity", head + six + rest, "models declare no entities"
    yield "a file as an entity", head + file + rest, "models declare no entities"
    yield "20000 elements in each other", f"<sdf version='1.9'>{nested}</sdf>", "nothing is so deep"
    yield "a namespace from nowhere", prefixed, "the prefix is bound to nothing"


def _bomb() -> str:
    lines = ['<!DOCTYPE m [<!ENTITY a "base">']
    lines += [f'<!ENTITY {b} "{f"&{a};" * 10}">' for a, b in zip("abcdefghi", "bcdefghij", strict=True)]
    return "".join(lines) + "]>"


def number_mutants(content: bytes, key: str) -> Iterator[Mutant]:
    """Every number of a model as something that is none, and vectors with a number too many or too few."""
    root = ElementTree.fromstring(content)
    for place, element in enumerate(root.iter()):
        values = {None: (element.text or "").strip(), **element.attrib}
        for name, value in values.items():
            if name in ("version", "name") or not value or not _NUMBERS.match(value):
                continue
            parts, field = value.split(), name or element.tag
            for index, (kind, (word, because)) in enumerate(_BAD_WORDS.items()):
                no_limit = kind == "an infinity" and field in ("lower", "upper", "effort", "velocity")
                if (place + index) % 3 == 0 and not no_limit:
                    at = (place + index) % len(parts)
                    text = " ".join([*parts[:at], word, *parts[at + 1 :]])
                    yield _changed(kind, root, place, name, text, because, key)
            if len(parts) > 1 and field != "diffuse":  # A colour of three numbers is opaque.
                yield _changed(
                    "a number too few", root, place, name, " ".join(parts[:-1]), "it is a vector", key
                )
            if len(parts) > 1:
                yield _changed("a number too many", root, place, name, f"{value} 7", "it is a vector", key)


def _changed(
    kind: str, root: Element, place: int, name: str | None, text: str, because: str, key: str
) -> Mutant:
    tree = copy.deepcopy(root)
    element = list(tree.iter())[place]
    if name is None:
        element.text = text
    else:
        element.set(name, text)
    return Mutant(kind, f"{element.tag} {name or ''} = {text}", because, ElementTree.tostring(tree), key)


def element_mutants(content: bytes, key: str) -> Iterator[Mutant]:
    """Elements and attributes that are misspelt, and required ones that are gone."""
    root = ElementTree.fromstring(content)
    for place, element in enumerate(root.iter()):
        tree = copy.deepcopy(root)
        list(tree.iter())[place].tag = f"{element.tag}_"
        yield Mutant(
            "misspelt element", element.tag, "no element has this name", ElementTree.tostring(tree), key
        )
        for name in element.attrib:
            tree = copy.deepcopy(root)
            changed = list(tree.iter())[place]
            changed.set(f"{name}_", changed.attrib.pop(name))
            what = f"{element.tag} {name}"
            yield Mutant(
                "misspelt attribute", what, "no attribute has this name", ElementTree.tostring(tree), key
            )


def edited_mutants(content: bytes, edits: list[tuple[str, str, str, str]], key: str) -> Iterator[Mutant]:
    """Edits by hand: each (kind, old, new, because)."""
    text = content.decode()
    for kind, old, new, because in edits:
        assert old in text, old
        changed = text.replace(old, new, 1)
        if "<world" in new:
            changed = changed.replace("</model>", "</world>")
        yield Mutant(kind, old[:40], because, changed.encode(), key)


SDF_EDITS = [
    ("another version", 'version="1.9"', 'version="99.0"', "no such version exists"),
    ("a negative radius", "<radius>0.25", "<radius>-0.25", "it is a length"),
    ("no size", "<size>0.35 0.1", "<size>0 0.1", "it is a length"),
    ("a negative mass", "<mass>6", "<mass>-6", "it is a mass"),
    ("an impossible inertia", "<izz>0.1875", "<izz>9", "no body has such moments"),
    ("an unknown kind of joint", 'type="revolute"', 'type="rotary"', "no joint has this name"),
    ("a joint to nowhere", "<child>link_2</child>", "<child>link_7</child>", "no link has this name"),
    ("limits exchanged", "<lower>-1.87", "<lower>2.5", "the lower is above the upper"),
    ("an axis of no length", "<xyz>0 0 1", "<xyz>0 0 0", "it has no direction"),
    ("two links of one name", '<link name="link_2">', '<link name="base">', "nobody can tell them apart"),
    ("a pose from nowhere", 'relative_to="elbow"', 'relative_to="knee"', "no frame has this name"),
    ("no model", '<model name="long_blue">', '<world name="long_blue">', "a world is no robot"),
]
"""Slips in the shipped robot with one joint."""
