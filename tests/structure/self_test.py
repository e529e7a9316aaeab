"""What the checks of structure are tried on: trees of files with a fault or without."""

import sys
import tempfile
from pathlib import Path


def misjudged(faults, good, cases):
    """Of trees, each `good` and what a case adds, the first that gives other than the one fault expected (None: no fault)."""
    for extra, expected in cases:
        with tempfile.TemporaryDirectory() as folder:
            for name, text in {**good, **extra}.items():
                path = Path(folder, name)
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_text(text, encoding="utf-8")
            found = faults(Path(folder))
        right = found == [] if expected is None else len(found) == 1 and expected in found[0]
        if not right:
            return [f"self-test: {extra} gave {found}, not {expected}"]
    return []


def run(faults, self_test):
    """The check of the tree that is named, or its own test."""
    problems = self_test() if sys.argv[1:] == ["--self-test"] else faults(Path(sys.argv[1]))
    print("\n".join(problems) or "no fault")
    sys.exit(1 if problems else 0)
