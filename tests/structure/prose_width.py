#!/usr/bin/env python3
"""Checks that prose in documents is wrapped at one width: prose_width.py ROOT [--write], or --self-test. --write wraps it.

Headings, tables, code and formulas on lines of their own stay as they are.
"""
import re
import sys
from pathlib import Path

from self_test import misjudged, run

WIDTH = 120
PAGES = ("README.md", "CONTRIBUTING.md", "SECURITY.md", "CHANGELOG.md", "docs", "tools", "examples")
ITEM = re.compile(r"^( *)([-*]|\d+\.) +")
UNBREAKABLE = re.compile(r"(?:`[^`]*`|\$[^$]+\$|\[[^\]]*\]\([^)\s]*\)|[^\s`$[]|[`$[])+")
# A word that would begin something else at the start of a line.
STARTS = re.compile(r"^(?:[-+*>|#]+|\d+[.)]|=+|<.*)$")


def wrapped(words, first, rest):
    """Lines of at most WIDTH characters; `first` and `rest` are what they begin with."""
    lines, line = [], first
    empty = True
    for word in words:
        if not empty and len(line) + 1 + len(word) > WIDTH and not STARTS.match(word):
            lines.append(line)
            line, empty = rest, True
        line += word if empty else " " + word
        empty = False
    return [*lines, line]


def rewrapped(text):
    """The page with each paragraph and each item of a list wrapped."""
    out, block, first, rest = [], [], "", ""
    fenced = formula = False

    def end():
        nonlocal block
        if block:
            out.extend(wrapped(UNBREAKABLE.findall(" ".join(block)), first, rest))
        block = []

    for line in text.split("\n"):
        item = ITEM.match(line)
        indent = len(line) - len(line.lstrip(" "))
        if line.startswith(("```", "~~~")):
            fenced = not fenced
        single = line.strip().startswith("$$") and line.strip().endswith("$$") and len(line.strip()) > 3
        if line.strip().startswith("$$") and not single or formula and line.strip().endswith("$$"):
            formula = not formula
            plain = False
        else:
            plain = not (fenced or formula or single)
        inside = bool(block) and len(rest) > 0 and indent == len(rest)  # a further line of an item
        if not plain or not line.strip() or line.lstrip().startswith(("|", "#", "<", "![", ">", "```")):
            end()
            out.append(line)
            if line.strip():
                first = rest = ""
        elif item and not (indent >= 4 and not rest and not block):
            end()
            first, rest = item[0], " " * len(item[0])
            block = [line[len(item[0]):].strip()]
        elif indent >= 4 and not inside and not block and indent != len(rest):
            end()
            out.append(line)
        elif block:
            block.append(line.strip())
        else:
            first = rest = " " * indent
            block = [line.strip()]
    end()
    return "\n".join(out)


def pages(root):
    for name in PAGES:
        path = root / name
        yield from sorted(path.rglob("*.md")) if path.is_dir() else [path] if path.exists() else []


def faults(root):
    """One line for each page that is wrapped in another way, with its first such line."""
    found = []
    for path in pages(root):
        is_, should = path.read_text(encoding="utf-8").split("\n"), rewrapped(path.read_text(encoding="utf-8")).split("\n")
        first = next((i for i, pair in enumerate(zip(is_, should)) if pair[0] != pair[1]), None)
        if first is None and len(is_) != len(should):
            first = min(len(is_), len(should))
        if first is not None:
            found.append(f"{path.relative_to(root)}:{first + 1}: is not wrapped at {WIDTH} characters; tests/structure/{Path(__file__).name} . --write")
    return found


def self_test():
    """Pages that are wrapped, and one of each kind that is not."""
    word, full = "word " * 23, " ".join(["word"] * 24)
    good = {"README.md": f"# A heading {word * 3}\n\n{full}\nword.\n\n- {' '.join(['word'] * 23)}\n  word\n- two\n\n    code {word * 9}\n\n| a {word * 9}|\n"}
    cases = [
        ({}, None),
        ({"docs/a.md": f"{full} word word\n"}, "docs/a.md:1: is not wrapped"),
        ({"docs/a.md": "two\nlines\n"}, "docs/a.md:1: "),
        ({"docs/a.md": "- an item\n  of two lines\n- more\n"}, "docs/a.md:1: "),
        ({"docs/a.md": f"$$ {word * 9} $$\n\n$$\n{word * 9}\n$$\n"}, None),
        ({"docs/a.md": "1. one\n\n       code of one\n2. two\n"}, None),
        ({"docs/a.md": f"{full[:-5]} `two words`\n"}, "docs/a.md:1: "),
        ({"docs/a.md": f"{full[:-5]}\n`two words`\n"}, None),
    ]
    return misjudged(faults, good, cases)


if __name__ == "__main__":
    if sys.argv[2:] == ["--write"]:
        for page in pages(Path(sys.argv[1])):
            page.write_text(rewrapped(page.read_text(encoding="utf-8")), encoding="utf-8")
    else:
        run(faults, self_test)
