#!/usr/bin/env python3
"""Checks that each constant of the diagnosis says where it comes from: constants.py ROOT, or --self-test.

A constant is a `constexpr` number kName of src/gap whose value names nothing else, or a number of configs/gap. Its comment, directly above or
behind it, says what it is and ends with its origin:
  Choice.  Choice: why.  Source: citation.  Learnt: command, commit.  Derived: from what.  Size: of what.
A size changes no number of a result, as that of a cache; it is left out of the tables. A number in TOML without an origin has that of its table's
comment, or of the file's first one; `Learnt.` alone is as the first one says. scripts/reference writes the tables of docs/reference/constants.md
from these comments, and the numbers after `kName` = in docs/theory/diagnosis.md."""
import re
from dataclasses import dataclass, field
from pathlib import Path

from self_test import misjudged, run

CODE, CONFIGS = "src/gap", "configs/gap"
THEORY = "docs/theory/diagnosis.md"
# Which file a key of the theory is of: the first that has it.
FILES = ("verdict.toml", "model_discrepancy.toml", "contrast_verdict.toml", "session_variation.toml", "bench_session_variation.toml", "beat_averaged/verdict.toml")
KINDS = "Choice|Source|Learnt|Derived|Size"
BEGINS = re.compile(rf"(?:^|[.?] )(?=(?:{KINDS})(?:: |\.))")
COMMIT = re.compile(r"\b[0-9a-f]{7,12}(?P<dirty>-dirty)?\b")
NUMBER = r"-?\d+(?:\.\d+)?(?:e-?\d+)?"
DECLARATION = re.compile(r"(?P<comment>(?:^[ \t]*//.*\n)*)^[ \t]*(?:inline |static )*constexpr (?:double|float|int|std::size_t) (?P<body>k[A-Z][^;]*);(?P<behind>.*)$", re.MULTILINE)
NAME = re.compile(r"\b(k[A-Z]\w*)(?:\[\])? = ")
UNITS = {"nats": "nats", "s": "s", "m": "m", "rad": "rad", "V": "V", "A": "A", "Hz": "Hz", "m_s2": "m/s²", "rad_s": "rad/s", "m_s": "m/s", "kg_m2": "kg m²"}
ACCEPTED = "a comment that ends with Choice., Choice: WHY., Source: CITATION., Learnt: COMMAND, COMMIT., Derived: FROM WHAT. or Size: OF WHAT."


def unit_of(name):
    """The unit that ends a name; `nats` is one itself."""
    ends = [u for u in UNITS if name.endswith("_" + u) or name.rpartition(".")[2] == u]
    return UNITS[max(ends, key=len)] if ends else ""


@dataclass
class Constant:
    name: str
    values: list
    what: str
    origin: str
    file: str
    line: int
    text: str = ""  # the value as the tables have it, if it is no list of numbers
    unit: str = field(default="")

    def __post_init__(self):
        self.unit = self.unit or ("" if self.name.startswith("parameters.") else unit_of(self.name))


def told(comment):
    """What a comment says, and the origin that it ends with."""
    starts = [m.end() for m in BEGINS.finditer(comment)]
    if not starts or not comment.endswith("."):
        return comment, ""
    return comment[:starts[-1]].strip(), comment[starts[-1]:].rstrip(".")


def shown(number):
    """A number as the tables have it: as it is written, but for digits that only a sum has."""
    number = number.strip()
    return number if len(number) < 10 else f"{float(number):.6g}"


def uncommented(lines):
    return " ".join(filter(None, (re.sub(r"^\s*(?:///?<?|#)\s?", "", line).strip() for line in lines)))


def of_code(root):
    """Constants of src/gap, sizes included."""
    found = []
    for path in sorted((root / CODE).rglob("*.[ch]pp")):
        text = path.read_text(encoding="utf-8")
        for d in DECLARATION.finditer(text):
            behind = uncommented([d["behind"]]) if "//" in d["behind"] else ""
            what, origin = told(" ".join(filter(None, [uncommented(d["comment"].splitlines()), behind])))
            names = list(NAME.finditer(d["body"]))
            for k, name in enumerate(names):
                value = d["body"][name.end():names[k + 1].start() if k + 1 < len(names) else None].strip().strip(",").strip("{} \n")
                if re.search(r"[A-Za-z_(]", re.sub(r"\b\d[\d.']*(?:e[-+]?\d+)?[uUlLfF]*", "", value)):
                    continue  # a sum of others, or the number of something
                line = text.count("\n", 0, d.start("body") + name.start()) + 1
                found.append(Constant(name[1], [v.strip() for v in value.split(",")], what, origin, str(path.relative_to(root)), line))
    return found


def of_priors(path, root, entries, of_file):
    """A row for each law of priors.toml. Left and right are one row, and so are an entry without a comment and a like one with the same law before it."""
    found, laws, like, last = [], set(), set(), None
    for line, comment, keys in entries:
        names = re.findall(r'"([^"]+)"', keys["parameters"])
        one_side = {n.partition(".")[0] for n in names} in ({"left"}, {"right"})
        names = [n.partition(".")[2] if one_side else n for n in names]
        law = (keys["law"], keys["sd"], "minor" in keys)
        if (*names, law) in laws:
            continue
        laws.add((*names, law))
        parts = {part for n in names for part in (n.partition(".")[0], n.rpartition(".")[2])}
        if not comment and law == last and parts & like:
            found[-1].name += ", " + ", ".join(names)
            continue
        like, last = parts, law
        what = ["Prior standard deviation.", comment and comment[0].upper() + comment[1:] + ".", "A minor draw." if law[2] else ""]
        unit = "of the value" if law[0] == '"scale_normal"' else next(filter(None, map(unit_of, names[0].split("."))), "")
        found.append(Constant(", ".join(names), [law[1]], " ".join(filter(None, what)), of_file[1], str(path.relative_to(root)), line, unit=unit))
    return found


def of_config(path, root):
    """Constants of a file of configs/gap: a row for each number, and one for all shares or backgrounds without a comment of their own."""
    found, many, priors = [], {}, []
    head, of_file, table, of_table, block = None, ("", ""), "", ("", ""), []
    lines = iter(enumerate(path.read_text(encoding="utf-8").splitlines(), 1))
    for number, line in lines:
        text, _, behind = line.partition("#")
        if text.count('"') % 2 == 1:  # this # is within a string
            text, behind = line, ""
        text = text.strip()
        if not text:
            if behind or line.startswith("#"):
                block.append(line)
            else:
                block = []
            continue
        if text == "[[randomise]]":
            block = []  # a comment above is on all that follow
        comment = uncommented([*block, "#" + behind] if behind else block)
        block = []
        if text.startswith("schema"):
            head, of_file = comment, told(comment)
        elif text == "[[randomise]]":
            priors.append((number, comment, {}))
        elif text.startswith("["):
            table, of_table = text.strip("[]"), told(comment)
        else:
            key, value = (part.strip() for part in text.split("=", 1))
            while value.count("[") > value.count("]"):
                value += next(lines)[1].strip()
            if priors:
                priors[-1][2][key] = value
                continue
            what, origin = told(comment)
            if origin == "Learnt":
                origin = of_file[1]
            of_them = of_table[1] if of_table[1] != "Learnt" else of_file[1]
            numbers = re.findall(NUMBER, value) if '"' not in value else []
            name = f"{table}.{key}".replace('"', "")
            if value in ("true", "false"):
                continue
            of_shares = re.match(r"(bench_)?share\.", table)
            if not comment and (of_shares or table == "background_sd"):
                group = f"{of_shares.group()}CHANNEL.KIND" if of_shares else "background_sd.EFFECT"
                row = many.setdefault(group, Constant(group, [], of_table[0], of_them or of_file[1], str(path.relative_to(root)), number))
                row.what, row.values = row.what or of_table[0], row.values + numbers
                if row not in found:
                    found.append(row)
                continue
            row = Constant(name, numbers, what or of_table[0], origin or of_them or of_file[1], str(path.relative_to(root)), number)
            if not numbers:
                row.text = ", ".join(f"`{n}`" for n in re.findall(r'"([^"]+)"', value))
            found.append(row)
    for row in many.values():
        if len(row.values) == 1:
            row.name = row.name.replace("EFFECT", "other")
            continue
        least, most = (shown(f(row.values, key=float)) for f in (min, max))
        row.text = f"{len(row.values)} numbers, {least} to {most}"
    return found if head is not None and not priors else of_priors(path, root, priors, of_file)


def of_configs(root):
    paths = sorted((root / CONFIGS).glob("*.toml")) + sorted((root / CONFIGS / "beat_averaged").glob("*.toml"))
    return [c for path in paths for c in of_config(path, root)]


def cell(text):
    text = re.sub(r"(?<![`\w])k[A-Z]\w*", r"`\g<0>`", text)
    return text.replace("|", "\\|").replace("<", "&lt;")


def table(root, *folders):
    """The rows of folders and files, as a page has them."""
    out = ["| name | value | unit | what | origin | where |", "|---|---|---|---|---|---|"]
    above = ""
    for c in [*of_code(root), *of_configs(root)]:
        if not any(c.file == f or c.file.startswith(f + "/") for f in folders) or c.origin.startswith("Size"):
            continue
        what, above = ("" if c.what == above else c.what), c.what
        value = c.text or ", ".join(shown(v) for v in c.values)
        name = ", ".join(f"`{n}`" for n in c.name.split(", "))
        out.append(f"| {name} | {value} | {c.unit} | {cell(what)} | {cell(c.origin[:1].lower() + c.origin[1:])} | [{Path(c.file).name}](../../{c.file}) |")
    return "\n".join(out) + "\n"


def named(root):
    """Constants by the name that the theory has for them."""
    code, names = of_code(root), {}
    for c in code:
        if sum(other.name == c.name for other in code) == 1:
            names[c.name] = c
    for file in reversed(FILES):
        if (path := root / CONFIGS / file).exists():
            names |= {c.name: c for c in of_config(path, root) if not c.text}
    return names


def filled(root, text):
    """A page with the numbers after `kName` = as they are now."""
    for name, c in named(root).items():
        numbers = r"(,\s+)".join([NUMBER] * len(c.values))  # the line may end between any two

        def now(use, values=c.values):
            return "".join(before + shown(value) for before, value in zip(use.groups(), values))
        text = re.sub(rf"(`{re.escape(name)}`\s+=\s+){numbers}", now, text)
    return text


def faults(root):
    """One line for each constant without an origin, and for each name in the theory that no constant has."""
    found = []
    for c in [*of_code(root), *of_configs(root)]:
        where = f"{c.file}:{c.line}: {c.name}"
        if not c.origin:
            found.append(f"{where} has no origin; accepted: {ACCEPTED}")
        elif c.origin.startswith("Learnt"):
            commit = COMMIT.search(c.origin)
            if commit is None:
                found.append(f"{where} is learnt, of no commit; accepted: Learnt: COMMAND, COMMIT.")
            elif commit["dirty"]:
                found.append(f"{where} is learnt from a changed commit; accepted: a clean one")
        elif not c.what:
            found.append(f"{where} does not say what it is")
    if (page := root / THEORY).exists():
        names, text = named(root), page.read_text(encoding="utf-8")
        for use in re.finditer(rf"`(k[A-Z]\w*|[\w.]+(?=`\s+=\s+{NUMBER}))`", text):
            if use[1] not in names and use[1] != "kName":
                found.append(f"{THEORY}:{text.count(chr(10), 0, use.start()) + 1}: no one constant is named {use[1]}")
    return found


def self_test():
    """Constants with each kind of origin, and one of each fault."""
    code = "/// Steps. Choice: few are enough.\nconstexpr int kSteps = 4, kOther = 5;\nconstexpr int kAll = 2 * kSteps;\n"
    config = "# Learnt: flappy-gap learn, 3 robots, commit 0123456.\nschema = 1\n\n# Priors. Choices in part.\n[prior]\nnone = 0.1  # Learnt.\n"
    good = {"src/gap/a.cpp": code, "configs/gap/verdict.toml": config, "docs/theory/diagnosis.md": "After `kSteps` = 4 steps.\n"}
    cases = [
        ({}, None),
        ({"src/gap/b.hpp": "constexpr double kReach = 0.3;\n"}, "src/gap/b.hpp:1: kReach has no origin"),
        ({"src/gap/b.hpp": "/// Reach of a step.\nconstexpr double kReach = 0.3;\n"}, "src/gap/b.hpp:2: kReach has no origin"),
        ({"src/gap/b.hpp": "/// Reach. Choice.\n\nconstexpr double kReach = 0.3;\n"}, "src/gap/b.hpp:3: kReach has no origin"),
        ({"src/gap/b.hpp": "/// Choice.\nconstexpr double kReach = 0.3;\n"}, "kReach does not say what it is"),
        ({"src/gap/b.hpp": "constexpr double kReach = 0.3;  // Reach. Derived: half of 0.6.\n"}, None),
        ({"src/gap/b.hpp": "/// Reaches. Source: Bierman 1977.\nconstexpr double kReaches[] = {0.3,\n  1};\n"}, None),
        ({"src/gap/b.hpp": "constexpr const char* kFile = \"a\";\n"}, None),
        ({"configs/gap/a.toml": "schema = 1\n[prior]\nnone = 0.1\n"}, "configs/gap/a.toml:3: prior.none has no origin"),
        ({"configs/gap/a.toml": "# All is new. Learnt: by somebody.\nschema = 1\n[prior]\nnone = 0.1\n"}, "is learnt, of no commit"),
        ({"configs/gap/a.toml": "# All is new. Learnt: x, commit 0123456-dirty.\nschema = 1\n[prior]\nnone = 0.1\n"}, "learnt from a changed commit"),
        ({THEORY: "After `kStep` steps.\n"}, "no one constant is named kStep"),
        ({THEORY: "Of `kSteps` = 4,\n`prior.no`\n= 0.1.\n"}, f"{THEORY}:2: no one constant is named prior.no"),
    ]
    return misjudged(faults, good, cases)


if __name__ == "__main__":
    run(faults, self_test)
