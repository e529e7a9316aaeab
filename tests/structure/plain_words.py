#!/usr/bin/env python3
"""Checks that code, configuration and documents use the terms of docs/glossary.md: plain_words.py ROOT, or --self-test."""
import re
from pathlib import Path

from self_test import misjudged, run

FOLDERS = ("src", "include", "tools", "configs", "docs", "python/flappy", "python/src")
PAGES = ("README.md", "CONTRIBUTING.md", "SECURITY.md")  # CHANGELOG.md names the old terms
SUFFIXES = {".hpp", ".cpp", ".h", ".c", ".toml", ".md", ".py", ".js", ".idl"}
# What is refused, where (all: everywhere that is looked at), and the term instead. One row of the table for each.
PATTERNS = [
    (r"known by the beat|\bMean(?:Prediction|Wrench|State|Motion|Loads?|Spline|Effects?|Drive|Step|Program|Body|Input|Actuator|Rows|Product|Thrust|Stages)\b", "", "beat-averaged"),
    (r"(?i)\b(?:wings?|vehicles?|robots?) (?:with|of) four angles\b", "", "articulated wings"),
    (r"(?i)\b(?:own[_-]figures|minor figures?|figures of (?:the|a) (?:vehicle|body|robot|sensor))\b|\b(?:Side|Sensor|Beat)Figures\b", "", "parameters"),
    (r"(?i)\bentr(?:y|ies) of the catalogue\b|\bEffectEntry\b|\bentry_freedom\b", "", "effect"),
    (r"\b(?:vanished_size|size_error|SizeColumn|SizeStep|SizeEstimate|EffectSize|kSizeReach)\b|(?i:\bsizes? of (?:the|an|each) effect)", "", "magnitude, shape parameter"),
    (r"\b(?:beside_all|set_lines|find_lines|line_of|refit_beside_background)\b|\bbeside\b", "gap evidence benchmark", "nuisance regressor; given, jointly with"),
    (r"\b(?:plain_|own_sd|usual\(|own_columns_of|fit_beside)", "gap benchmark", "whose it is; baseline; prior scale"),
    (r"\b(?:freeing_nats|price_of)\b|\[doubt\]|\bdoubt\.(?:nats|freedom)\b|\.doubt\b", "", "penalty of an unknown cause, log-prior cost, tempering of the evidence"),
    (r"\bgap::Candidate\b|\bconst Candidate\*|\bstruct Candidate \{(?=.*lag_s)", "", "VehicleHypothesis"),
    (r"\bminders?\b|\bWatched\b|\bWatchedState\b|\bkind_named\b", "", "supervisor, LiveState, JobType"),
    (r"\bk(?:Most|Least)(?:[A-Z_]\w*)?\b", "", "kMax..., kMin..."),
    (r"\b(?:class|struct) (?:Story|Belief|Ailments|Companion)\b|\btell_[a-z_]+\(", "", "what they are"),
    (r"\b(?:fly|tasks|train)/gap\.toml\b", "", "aperture.toml"),
    (r"\bk(?:Torque|Force)[XYZ]\b|\"(?:torque|force)_[xyz]\"", "gap view lab", "angular_acceleration, specific_force"),
    (r"(?i)\banother making\b|\bother makings\b", "", "simulators A, B, C"),
]


def faults(root):
    """One line for each place that uses an old term."""
    found = []
    files = [root / page for page in PAGES if (root / page).exists()]
    files += [p for folder in FOLDERS for p in sorted((root / folder).rglob("*")) if p.suffix in SUFFIXES and p.is_file()]
    for path in files:
        where = path.relative_to(root)
        if where.name == "plain_words.py":
            continue
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
            for pattern, rooms, instead in PATTERNS:
                if rooms and not any(part in where.parts for part in rooms.split()):
                    continue
                match = re.search(pattern, line)
                if match:
                    found.append(f"{where}:{number}: \"{match[0]}\"; say: {instead}")
    return found


def self_test():
    """One line that each row refuses, and lines that none does."""
    good = {"src/sim/a.hpp": "// A figure is drawn.\nconstexpr int kMaxLanes = 4;\n", "docs/a.md": "A minor draw, an entry of a table.\n"}
    bad = ["known by the beat", "struct MeanPrediction {", "wings with four angles", "own_figures", "struct SideFigures {", "an entry of the catalogue", "vanished_size = 1",
           "freeing_nats = 10", "std::vector<gap::Candidate>", "its minder", "kMostLanes", "kLeast = 3", "class Story {", "void tell_verdict() {", "fly/gap.toml",
           "robots of another making"]
    cases = [({}, None), ({"src/gap/x.cpp": "// beside the fit\n"}, "src/gap/x.cpp:1"), ({"src/view/x.cpp": "// beside the fit\n"}, None),
             ({"src/gap/x.cpp": "fit_beside(h);\n"}, "src/gap/x.cpp:1"), ({"src/io/x.hpp": "bool plain_;\n"}, None),
             ({"src/view/x.cpp": "channel == \"torque_x\"\n"}, "src/view/x.cpp:1"), ({"src/model/x.cpp": "\"force_x\"\n"}, None)]
    cases += [({"src/sim/x.hpp": f"// {line}\n"}, "src/sim/x.hpp:1: ") for line in bad]
    return misjudged(faults, good, cases)


if __name__ == "__main__":
    run(faults, self_test)
