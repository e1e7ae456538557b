#!/usr/bin/env bash
# Folders are layers. Each of the six folders (and tests) draws its own in its README.md, in a block ```layers. Every
# include of the code has to follow an arrow, and every arrow is used. Usage: layers.sh [ROOT]; prints each wrong include and drawing.
#
#   main ─► ./ ─► a/ b/        a layer may include what lies to the right of its arrow, and what those may include
#   * ─► shm/base/             every layer of this drawing may; a name that begins with one of the six is another house's
#
# A layer is a folder without its sub-folders ("a/"; "./": the top), or a folder with all below it ("examples/..."). It
# may also be the files of one name ("a/name": a/name.hpp, a/name.cpp), which are then no part of their folder's layer.
# To the right of an arrow "a/..." may also stand for all layers below a/.
set -euo pipefail
cd "${1:-$(dirname "$0")/../..}"
exec python3 - <<'PYTHON'
import os, re, sys

HOUSES = ("shm", "schedulers", "instances", "api", "manager", "tests")
ARROW = re.compile(r"\s*─+►\s*")
faults = []


def read_drawing(house):
    """Adds the layers and arrows of one README to `arrows`: layer -> {layer: where it is drawn}."""
    readme, drawn, every, inside = f"{house}/README.md", [], [], False
    if not os.path.exists(readme):
        return None
    lines = open(readme, encoding="utf-8").read().splitlines()
    if "```layers" not in lines:
        return None

    def named(word):
        if word.split("/")[0] in HOUSES:
            return word
        return f"{house}/" if word == "./" else f"{house}/{word}"

    for number, line in enumerate(lines, 1):
        if line.startswith("```"):
            inside = line == "```layers"
        elif inside and line.strip():
            steps = [step.split() for step in ARROW.split(line.strip())]
            for left, right in zip(steps, steps[1:]):
                if left == ["*"]:
                    every += [named(word) for word in right]
                    continue
                drawn += [(named(a), named(b), f"{readme}:{number}") for a in left for b in right]
            if len(steps) == 1:
                drawn += [(named(a), named(a), f"{readme}:{number}") for a in steps[0]]
    own = {layer for arrow in drawn for layer in arrow[:2] if layer.startswith(f"{house}/")}
    for layer in own:
        arrows.setdefault(layer, {})
    for a, b, where in drawn:
        if a != b:
            arrows.setdefault(a, {}).setdefault(b, where)
    for layer in own:
        for target in every:
            if layer != target:
                arrows[layer].setdefault(target, readme)
    return own


def sources(layer):
    """Whether there is a file in the layer."""
    folder, _, name = layer.rpartition("/")
    if name == "...":
        return any(f.endswith(KINDS) for _, _, files in os.walk(folder) for f in files)
    if not os.path.isdir(folder):
        return False
    return any(f.endswith(KINDS) and name in ("", f.rpartition(".")[0]) for f in os.listdir(folder))


def layer_of(path):
    """The layer that a file belongs to; None: it is in no drawing."""
    folder, _, file = path.rpartition("/")
    for layer in (f"{folder}/{file.rpartition('.')[0]}", f"{folder}/"):
        if layer in arrows:
            return layer
    while folder:
        if f"{folder}/..." in arrows:
            return f"{folder}/..."
        folder = folder.rpartition("/")[0]
    return None


def included(folder, bracket, name):
    """The file from the top; None: it is of the system, or made by the build."""
    beside = os.path.normpath(f"{folder}/{name}")
    if bracket == '"' and os.path.exists(beside):
        name = beside
    if "/" not in name:  # a header for applications and clients, which lie in one folder when they are installed
        name = next((f"{house}/{name}" for house in HOUSES if os.path.exists(f"{house}/{name}")), name)
    return name if "/" in name and name.split("/")[0] in HOUSES else None


def reach(layer, known):
    """All that the layer may include, by any number of arrows."""
    if layer not in known:
        known[layer] = set()
        for target in arrows.get(layer, {}):
            known[layer] |= {target} | reach(target, known)
    return known[layer]


def find_circle():
    """The layers of one way that ends where it began, the first by name in front; or nothing."""
    done, way = set(), []

    def walk(layer):
        if layer in way:
            circle = way[way.index(layer):]
            first = circle.index(min(circle))
            return circle[first:] + circle[:first + 1]
        if layer in done:
            return None
        way.append(layer)
        for target in arrows.get(layer, {}):
            if found := walk(target):
                return found
        way.pop()
        done.add(layer)
        return None

    return next(filter(None, map(walk, list(arrows))), None)


KINDS = (".hpp", ".cpp", ".h", ".c")
arrows = {}
houses = [house for house in HOUSES if os.path.isdir(house)]
for house in houses:
    if read_drawing(house) is None:
        if any(f.endswith(KINDS) for _, _, files in os.walk(house) for f in files):
            faults.append(f"{house}/README.md: it has no drawing of its layers (a block ```layers)")
for layer, targets in arrows.items():
    for target in [target for target in targets if target.endswith("/...") and target not in arrows]:
        below = [name for name in arrows if name.startswith(target[:-3]) and name != layer]
        targets.update((name, "") for name in below)  # not each of them is used
        if below:
            del targets[target]
for layer in [*arrows, *(target for targets in arrows.values() for target in targets)]:
    if not sources(layer):
        faults.append(f"{layer.split('/')[0]}/README.md: there is no layer {layer}, or no file in it")
    elif layer not in arrows:
        faults.append(f"{layer.split('/')[0]}/README.md: the layer {layer} is not in the drawing of its own README.md")
if circle := find_circle():
    faults.append("the arrows go round: " + " ─► ".join(circle))
else:
    known = {}
    include = re.compile(r'\s*#\s*include\s*(["<])([^">]+)[">]')
    undrawn, used = set(), set()
    for house in houses:
        for folder, _, files in os.walk(house):
            for file in sorted(files):
                path = f"{folder}/{file}"
                if not file.endswith(KINDS):
                    continue
                here = layer_of(path)
                if here is None:
                    undrawn.add(folder)
                    continue
                for number, line in enumerate(open(path, encoding="utf-8", errors="replace"), 1):
                    found = include.match(line)
                    target = found and included(folder, *found.groups())
                    there = target and layer_of(target)
                    if not there or there == here:
                        continue
                    used.add((here, there))
                    if there not in reach(here, known):
                        faults.append(f"{path}:{number}: {here} may not include {there} ({found[2]})")
    for layer, targets in [(layer, dict(targets)) for layer, targets in arrows.items()]:
        for target, where in targets.items():
            if ":" not in where or (layer, target) in used:
                continue  # for every layer, or it is used itself
            del arrows[layer][target]
            known = {}
            if all(there in reach(here, known) for here, there in used):
                faults.append(f"{where}: no include uses the arrow {layer} ─► {target}")
            arrows[layer][target] = where
    faults += [f"{folder}: it is not in the drawing of {folder.split('/')[0]}/README.md" for folder in sorted(undrawn)]
if not arrows:
    faults.append("no drawing and no folder of the code was found: is this the project?")
print(*dict.fromkeys(faults), sep="\n", end="\n" if faults else "")
sys.exit(bool(faults))
PYTHON
