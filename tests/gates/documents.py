#!/usr/bin/env python3
"""The documents (each .md that git knows) agree with each other and with the code.

Usage: documents.py [--write] [--programs DIR] [ROOT] (a git checkout); prints each fault. --write makes the generated tables
anew. The table of plcctl's commands is made by plcctl itself: it is held only with --programs, the folder of the programs.

* Each link leads to a file or folder, and its anchor to a heading there.
* Each document is reached from README.md by links; README.md has at most 250 lines.
* A table between "<!-- generated: NAME -->" and "<!-- end of generated -->" is that of today (TABLES below; those of
  the settings, of the configuration and of Modbus are held by instances_unit_test, unit_manager and unit_modbus, here only their keys and meanings).
* The keys in the tables of manager/configuration.md and instances/settings.md are those of the code, and the code has each
  key that a document names, as `[Section] Key` or `Section.Key=1`.
* Each step of manager/walks.md names a function, a file that has it, and is called by the step around it (walks.py).
* Each name `Class::function` is one of the code.
* Each text of a message in manager/troubleshooting.md is a part of one in the code.
* Each file that a document names with its folder, as `folder/file.cpp`, is there, and each unit of a `systemctl` command.
* Each room of runtime/ in the drawing of instances/README.md is a text of instances/rooms.svg.
* Each command in the tables of api/plcctl.md is one of the generated table.
"""

import argparse
import importlib.util
import json
import re
import subprocess
import sys
from pathlib import Path

sys.dont_write_bytecode = True  # beside the gates nothing is left
from walks import walk_faults

README_LINES = 250
BEGIN = re.compile(r"<!-- generated: ([\w-]+).*-->")
END = "<!-- end of generated -->"


class Fault(Exception):
    """A generated table cannot be made: its source is not as expected."""


def prose_lines(text):
    """(line number, line) outside of fenced blocks, without inline code and comments."""
    fenced = False
    for number, line in enumerate(text.split("\n"), 1):
        if line.startswith("```"):
            fenced = not fenced
        elif not fenced:
            yield number, re.sub(r"<!--.*?-->|`[^`]*`", lambda code: "`" if code.group()[0] == "`" else "", line)


def anchors_of(text):
    """The anchors of the headings, as GitHub makes them."""
    anchors = set()
    fenced = False
    for line in text.split("\n"):
        if line.startswith("```"):
            fenced = not fenced
        heading = None if fenced else re.match(r"#+ (.*)", line)
        if heading:
            words = re.sub(r"\[([^]]*)\]\([^)]*\)", r"\1", heading.group(1)).strip().lower()
            anchors.add(re.sub(r"[^\w\- ]", "", words).replace(" ", "-"))
    return anchors


class Documents:
    def __init__(self, root):
        self.root = root
        self.names = subprocess.run(["git", "ls-files", "*.md"], cwd=root, check=True, capture_output=True,
                                    text=True).stdout.split()
        self.texts = {name: (root / name).read_text(encoding="utf-8") for name in self.names}
        self.anchors = {name: anchors_of(text) for name, text in self.texts.items()}

    def links(self, name):
        """(line number, target as written, path from the root or None for the outside, anchor)"""
        for number, line in prose_lines(self.texts[name]):
            for target in re.findall(r"\]\(([^)\s]+)\)", line):
                if re.match(r"[a-z]+:", target):
                    continue
                path, _, anchor = target.partition("#")
                there = (self.root / name).parent / path if path else self.root / name
                yield number, target, there.resolve(), anchor

    def link_faults(self):
        reached = {"README.md"}
        waiting = ["README.md"]
        faults = []
        for name in self.names:
            for number, target, there, anchor in self.links(name):
                where = f"{name}:{number}"
                if not there.is_relative_to(self.root) or not there.exists():
                    faults.append(f"{where}: the link '{target}' leads to no file")
                elif anchor and anchor not in self.anchors.get(str(there.relative_to(self.root)), ()):
                    faults.append(f"{where}: the link '{target}' leads to no heading")
        while waiting:
            for _, _, there, _ in self.links(waiting.pop()):
                found = str(there.relative_to(self.root)) if there.is_relative_to(self.root) else ""
                if found in self.texts and found not in reached:
                    reached.add(found)
                    waiting.append(found)
        faults += [f"{name}: no link leads here from README.md" for name in self.names if name not in reached]
        return faults

    def size_faults(self):
        lines = self.texts["README.md"].count("\n")
        return [f"README.md: {lines} lines; at most {README_LINES}"] if lines > README_LINES else []

    def table_faults(self, write):
        faults = []
        for name, text in self.texts.items():
            made = self.with_tables(name, text, faults)
            if made != text and write:
                (self.root / name).write_text(made, encoding="utf-8")
                self.texts[name] = made
            elif made != text:
                faults.append(f"{name}: a generated table is not up to date: run tests/gates/documents.py --write")
        return faults

    def with_tables(self, name, text, faults):
        out = []
        table = None
        for line in text.split("\n"):
            begin = BEGIN.fullmatch(line)
            if table is None:
                out.append(line)
            elif line == END:
                out += [*table, END]
                table = None
            if begin and begin.group(1) in TABLES:
                try:
                    table = TABLES[begin.group(1)](self.root)
                except Fault as fault:
                    faults.append(f"{name}: the table '{begin.group(1)}': {fault}")
                    return text
            elif begin and begin.group(1) not in MADE_BY_TESTS:
                faults.append(f"{name}: no table is called '{begin.group(1)}'; there are {', '.join(TABLES)}")
                return text
        if table is not None:
            faults.append(f"{name}: a generated table without '{END}'")
            return text
        return "\n".join(out)


# Name in tests/bench/figures.json, condition, what the README says that it is.
FIGURES_FILE = "tests/bench/figures.json"
FIGURES = (
    ("cyclic/CmpScheduleOneShot/1ms", "idle", "`CmpScheduleOneShot`, planned release to start, idle"),
    ("cyclic/CmpScheduleOneShot/1ms", "stress", "the same beside `stress-ng`"),
    ("cyclic/CmpScheduleTimer/1ms", "idle", "`CmpScheduleTimer`, planned release to start, idle"),
    ("cyclic/CmpSchedule/1ms", "idle", "`CmpSchedule`, planned release to start, idle"),
    ("post/process/other-core", "idle", "event from a process on another core to the start of its task"),
    ("post/dds", "idle", "event posted over DDS on the same machine to the start of its task"),
    ("distributed_clock/start", "idle", "start of a cycle off the grid of a drifting reference clock"),
    ("start/plc-instance", "idle", "spawning `plc-instance` to its first cycle"),
)


def tool_of(path, name):
    """A script of the project, as a module."""
    tool = importlib.util.spec_from_file_location(name, Path(__file__).resolve().parent.parent.parent / path)
    module = importlib.util.module_from_spec(tool)
    sys.modules[name] = module
    tool.loader.exec_module(module)
    return module


def figures(root):
    all_rows = json.loads((root / FIGURES_FILE).read_text(encoding="utf-8"))
    found = {(row["name"], row["condition"]): row for row in all_rows}
    rows = ["| | median | 99th percentile | 99.9th | floor's median | 99th percentile | 99.9th |",
            "| --- | --- | --- | --- | --- | --- | --- |"]
    tool = tool_of("tests/bench/figures.py", "figures")
    text = tool.text
    for name, condition, meaning in FIGURES:
        if (name, condition) not in found:
            raise Fault(f"{FIGURES_FILE} has no row '{name}', {condition}")
        row = found[name, condition]
        rows.append("| " + " | ".join([meaning, *(text(row[floor + key]) for floor in ("", "floor_")
                                                  for key in ("p50_us", "p99_us", "p999_us"))]) + " |")
    return [*rows, "", tool.others_in_short(all_rows)]


def all_figures(root):
    rows = json.loads((root / FIGURES_FILE).read_text(encoding="utf-8"))
    return tool_of("tests/bench/figures.py", "figures").tables(rows)


def contract_of(root):
    """api/control.idl, read by the script that makes its reference."""
    reference = tool_of("api/reference.py", "reference")
    return reference, reference.parse(root / "api/control.idl")


def topics(root):
    reference, contract = contract_of(root)
    rows = ["| topic | from | to | meaning |", "| --- | --- | --- | --- |"]
    for kind in (kind for kind in contract.types if kind.is_topic):
        names = ", ".join(f"`{name.strip()}`" for name in kind.tags["topic"].split(","))
        what = reference.text_of(re.split(r"(?<=\.) ", kind.comment)[0])
        ends = [reference.text_of(kind.tags[end]) for end in ("writer", "reader")]
        rows.append(f"| [{names}](reference.md#{kind.name.lower()}) | {ends[0]} | {ends[1]} | {what} |")
    return rows


SECTIONS = {"host": "[host]", "dds": "[dds]", "blocks": "[blocks]", "instance": "[[instance]]"}


def configuration_rows(root):
    """(section, key, effect, meaning) of each key of the host's file."""
    text = (root / "manager/config/config_keys.cpp").read_text(encoding="utf-8")
    for row in re.split(r"\n    (?=(?:host|dds|blocks|instance)<&)", text)[1:]:
        section = SECTIONS[row.split("<")[0]]
        name, effect = (re.search(rf"\.{field} = \"?(\w+)", row) for field in ("name", "when"))
        meaning = re.search(r'\.meaning =\s*((?:"[^"]*"\s*)+)', row)
        if not name or not effect or not meaning:
            raise Fault(f"manager/config/config_keys.cpp: a row of {section} lacks its name, effect or meaning")
        yield section, name[1], effect[1], "".join(re.findall(r'"([^"]*)"', meaning[1]))


def reload_effects(root):
    text = (root / "manager/config/config_changes.cpp").read_text(encoding="utf-8")
    effects = dict(re.findall(r'case (\w+):\s*return "([^"]+)";', text))
    found = {effect: {} for effect in effects}
    for section, key, effect, _ in configuration_rows(root):
        if effect not in effects:
            raise Fault(f"manager/config/config_changes.cpp: describe() has no text for '{effect}'")
        found[effect].setdefault(section, []).append(f"`{key}`")
    rows = ["| keys | a changed one is |", "| --- | --- |"]
    for effect, sections in found.items():
        keys = "; ".join(f"`{section}` {', '.join(names)}" for section, names in sections.items())
        rows.append(f"| {keys} | {effects[effect]} |")
    return rows


def phases(root):
    text = (root / "manager/supervisor/instance_phase.cpp").read_text(encoding="utf-8")
    steps = re.findall(r'\{(\w+), +(\w+), +"([^"]+)"\}', text)
    shown = re.findall(r"pair\{(\w+), InstanceState::(\w+)\}", text)
    if not steps or not shown:
        raise Fault("manager/supervisor/instance_phase.cpp has no table of the steps, or none of the states")
    rows = ["| phase | shown as | leads to | when |", "| --- | --- | --- | --- |"]
    before = None
    for phase, to, trigger in steps:
        states = ", ".join(state for of, state in shown if of == phase)
        cells = (phase, states) if phase != before else ("", "")
        rows.append("| " + " | ".join(cell.replace("_", " ") for cell in (*cells, to)) + f" | {trigger} |")
        before = phase
    return rows


TABLES = {"figures": figures, "all-figures": all_figures, "topics": topics, "reload": reload_effects, "phases": phases}
MADE_BY_TESTS = ("settings", "configuration", "commands", "modbus")
UNIT_FOLDERS = ("manager", "instances/io/modbus")


def commands_of(programs):
    def commands(_root):
        told = subprocess.run([programs / "plcctl", "help"], check=True, capture_output=True, text=True).stdout
        rows = ["| command | does |", "| --- | --- |"]
        for command, text in re.findall(r"^  (\S.*?)(?:  +(\S.*))?$", told, re.MULTILINE):
            rows.append(f"| `{command}` | {text} |")
        if len(rows) < 20:
            raise Fault("'plcctl help' has no commands")
        return rows

    return commands


def command_faults(texts):
    page = "api/plcctl.md"
    text = texts[page]
    known = [re.findall(r"(?<!\S)[a-z][\w-]*", row.split("`")[1]) for row in rows_of(text, "<!-- generated: commands", END)[2:]]
    if not known:
        yield f"{page}: the table of the commands is empty"
    for row in rows_of(text, "| more about |", "\n\n")[2:]:
        for command in re.findall(r"`([^`]*)`", row.strip("|").split(" | ")[0]):
            if command.split() not in known:
                yield f"{page}: plcctl has no command '{command}'"


def setting_rows(root):
    """Each key of an instance's settings: "[Section] Key" -> its meaning; None: known, and without a use here."""
    keys = {}
    for source in sorted((root / "instances/runtime/settings").glob("settings_*.cpp")):
        text = source.read_text(encoding="utf-8")
        names = dict(re.findall(r'string_view (k\w+) = "([^"]*)"', text)) | {"kTaskSections": "Task.NAME"}
        rows = re.split(r"SettingKey\{", text)[1:]
        for row in rows:
            section = re.match(r"\s*\.section = (\w+)", row)
            name = re.search(r'\.name = "([^"]+)"', row)
            if not section or not name:
                continue
            prefix = "Linux." if ".prefixed = true" in row else ""
            meaning = re.search(r'\.meaning =\s*((?:"[^"]*"\s*)+)', row)
            text_of = "".join(re.findall(r'"([^"]*)"', meaning.group(1))) if meaning else None
            keys[f"[{names[section.group(1)]}] {prefix}{name.group(1)}"] = text_of if ".value" in row else None
    return keys


def rows_of(text, begin, end):
    lines = text[text.index(begin):]
    return [line for line in lines[:lines.index(end)].split("\n") if line.startswith("|")]


def settings_faults(root, texts):
    page = "instances/settings.md"
    code = {key: meaning for key, meaning in setting_rows(root).items() if meaning is not None}
    table = {}
    for row in rows_of(texts[page], "<!-- generated: settings", END)[2:]:
        cells = [cell.strip() for cell in row.strip("|").split(" | ")]
        table[cells[0].strip("`")] = cells[-1]
    faults = [f"{page}: no row for the key {key}" for key in code if key not in table]
    faults += [f"{page}: the code has no key {key}" for key in table if key not in code]
    faults += [f"{page}: {key} has another meaning than in the code" for key in code if table.get(key, code[key]) != code[key]]
    return faults


def configuration_faults(root, texts):
    page = "manager/configuration.md"
    code = {(section, key): meaning for section, key, _, meaning in configuration_rows(root)}
    table = {}
    section = None
    for row in rows_of(texts[page], "<!-- generated: configuration", END)[2:]:
        first, meaning = (cell.strip() for cell in row.strip("|").split(" | ")[:2])
        section = (re.search(r"\*\*(\[+\w+\]+)\*\*", first) or [None, section])[1]
        table[(section, re.search(r"`(\w+)`", first)[1])] = meaning
    faults = [f"{page}: no row for the key {' '.join(key)}" for key in code if key not in table]
    faults += [f"{page}: the code has no key {' '.join(key)}" for key in table if key not in code]
    faults += [f"{page}: {' '.join(key)} has another meaning than in the code" for key in code if table.get(key, code[key]) != code[key]]
    loader = (root / "manager/config/load_config.cpp").read_text(encoding="utf-8")
    faults += [f"manager/config/load_config.cpp: the key {key} is read outside of the table in config_keys.cpp" for key in
               re.findall(r'\breader\.(?:text|texts|number|numbers|truth|choice|know)\("(\w+)"', loader)]
    return faults


def named_key_faults(root, texts):
    """Keys that the text of any document names."""
    settings = setting_rows(root)
    sections = {key[1:key.index("]")] for key in settings}
    names = {key.split("] ")[1].removeprefix("Linux.") for key in settings}
    stems = {name.split(".")[0] for name in names if "." in name} - {"Area", "Component", "Task", "0"}
    configuration = {(section.strip("[]"), key) for section, key, _, _ in configuration_rows(root)}
    hosts_sections = {section for section, _ in configuration}
    for page, text in texts.items():
        for number, line in enumerate(text.split("\n"), 1):
            for section, key in re.findall(r"`\[+([\w.]+)\]+ ([A-Za-z][\w.]*)", line):
                plain = re.sub(r"^(Linux|VxWorks)\.", "", re.sub(r"\.\d+\b", ".N", key))
                section = "Task.NAME" if section.startswith("Task.") else section
                known = {key.removeprefix(f"[{section}] ").removeprefix("Linux.") for key in settings if f"[{section}]" in key}
                if section in sections and plain not in known or section in hosts_sections and (section, key) not in configuration:
                    yield f"{page}:{number}: the code has no key [{section}] {key}"
            for key in re.findall(r"`([A-Z]\w+\.\w[\w.]*)(?:=[^`]*)?`", line):
                if key.split(".")[0] in stems and key not in names:
                    yield f"{page}:{number}: the code has no key {key}"


def file_faults(root, texts):
    for page, text in texts.items():
        for number, line in enumerate(text.split("\n"), 1):
            for name in re.findall(r"`((?:[\w.-]+/)+[\w.-]+\.(?:cpp|hpp|h|c|py|sh|idl|md|svg))`", line):
                if not (root / name).exists() and not (root / page).parent.joinpath(name).exists():
                    yield f"{page}:{number}: there is no file {name}"
            for unit in re.findall(r"systemctl (?:-\S+ )*[a-z]+ (?:-\S+ )*([\w-]+@?)", line):
                if not any((root / folder / f"{unit}.service.in").exists() for folder in UNIT_FOLDERS):
                    yield f"{page}:{number}: no unit of systemd is called {unit}"


def room_faults(root, texts):
    """instances/rooms.svg has each room that the drawing of instances/README.md has."""
    drawn = re.search(r"^```layers\n(.*?)^```", texts["instances/README.md"], re.MULTILINE | re.DOTALL)
    rooms = set(re.findall(r"\bruntime/(\w+/)", drawn[1])) if drawn else set()
    boxes = set(re.findall(r">([^<]*)</text>", (root / "instances/rooms.svg").read_text(encoding="utf-8")))
    yield from (f"instances/rooms.svg: the room {room} of instances/README.md is missing" for room in sorted(rooms - boxes))
    if not rooms:
        yield "instances/README.md: its drawing has no room of runtime/"


def sources_of(root, *more):
    return [file for folder in ("api", "instances", "manager", "schedulers", "shm", *more) for file in (root / folder).rglob("*.[ch]pp")]


def name_faults(root, texts):
    code = "\n".join(file.read_text(encoding="utf-8") for file in sources_of(root, "tests"))
    classes = set(re.findall(r"\b(?:class|struct) (?:\[\[nodiscard\]\] )?(\w+)", code))
    words = set(re.findall(r"\w+", code))
    for page, text in texts.items():
        for number, line in enumerate(text.split("\n"), 1):
            for owner, name in re.findall(r"\b([A-Z]\w+)::(\w+)", line):
                if owner not in classes or name not in words:
                    yield f"{page}:{number}: the code has no {owner}::{name}"


def message_faults(root, texts):
    page = "manager/troubleshooting.md"
    # Literals that stand one behind the other are one text.
    code = "\n".join(re.sub(r'"\s*"', "", file.read_text(encoding="utf-8")) for file in sources_of(root))
    for row in rows_of(texts[page], "| text | cause |", "\n\n")[2:]:
        text = row.split("`")[1]
        if text not in code:
            yield f"{page}: no message has '{text}'"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--write", action="store_true")
    parser.add_argument("--programs", type=Path)
    parser.add_argument("root", nargs="?", type=Path, default=Path(__file__).resolve().parent.parent.parent)
    options = parser.parse_args()
    if options.programs:
        TABLES["commands"] = commands_of(options.programs)
    documents = Documents(options.root.resolve())
    faults = documents.table_faults(options.write) + documents.size_faults() + documents.link_faults()
    try:
        faults += settings_faults(documents.root, documents.texts) + configuration_faults(documents.root, documents.texts)
        faults += named_key_faults(documents.root, documents.texts)
        faults += command_faults(documents.texts)
        faults += walk_faults(documents.root, documents.texts)
        faults += file_faults(documents.root, documents.texts)
        faults += room_faults(documents.root, documents.texts)
        faults += name_faults(documents.root, documents.texts)
        faults += message_faults(documents.root, documents.texts)
    except ValueError as wrong:
        faults.append(f"a table of keys is not where it is expected: {wrong}")
    print("\n".join(faults), end="\n" if faults else "")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
