#!/usr/bin/env python3
"""Table of docs/results/plan.md from two plans of one vehicle, without reference flights and with them.

    scripts/results/plan_table.py ALONE/plan.json REFERENCE/plan.json
"""

import json
import sys

alone, reference = (json.load(open(name)) for name in sys.argv[1:3])


def cell(plan, effect):
    found = next((e for e in plan["effects"] if e["effect"] == effect), None)
    if found is None:
        return "unseen | -"
    sure = "-" if found["sure_from"] is None else f"{found['sure_from']:.2g}"
    return f"{found['probability']:.2f} | {sure}"


def helps(effect):
    """Choices besides reference flights that name an effect which the flights alone do not."""
    names = [c["name"] for c in alone["choices"] if effect in c["gained"] and c["name"] != "reference"]
    return ", ".join(names[:4]) + (", ..." if len(names) > 4 else "")


print("| effect | alone | sure from | with reference | sure from | named alone also with |\n|---|---|---|---|---|---|")
for effect in [r for r in alone["rivals"] if r != "parameters"] + alone["unseen"]:
    print(f"| {effect} | {cell(alone, effect)} | {cell(reference, effect)} | {helps(effect)} |")
for name, plan in (("alone", alone), ("with reference", reference)):
    mean = sum(e["probability"] for e in plan["effects"]) / (len(plan["effects"]) + len(plan["unseen"]))
    print(f"\nmean probability {name}: {mean:.2f}")
