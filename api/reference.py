#!/usr/bin/env python3
"""Makes the operations of control.idl from shm/operations/operations.def, and the reference in reference.md from control.idl;
holds control.idl to its own rules.

  reference.py --write               writes the operations into control.idl, and the reference into reference.md
  reference.py --check               says what is wrong: no comment, no QoS, a type that others would not
                                     understand, or a file that is not up to date
  reference.py --compatible OLD.idl  says which types and constants of OLD.idl are not the same in control.idl
Each exits with 1 if something is wrong. --root DIR: the folder of control.idl and reference.md, instead of its own.
"""

import argparse
import pathlib
import re
import sys

sys.dont_write_bytecode = True
sys.path.insert(0, str(pathlib.Path(__file__).parent / "generate"))
from contract import TAGS, Fault, meaning, parse, partition_of, qos_of, quality  # noqa: E402
from operations import operations_of, with_operations  # noqa: E402
from rows import words_of  # noqa: E402

BEGIN = "<!-- The reference begins here. It is made: api/reference.py --write -->"
END = "<!-- The reference ends here. -->"


def faults_of(contract, name):
    """The breaches of the rules that the head of control.idl states."""
    seen = {}
    for constant in contract.constants:
        if not constant.comment:
            yield f"{name}:{constant.line}: {constant.name} has no comment"
        number = (constant.name.split("_")[0], constant.value)
        if number in seen:
            yield f"{name}:{constant.line}: {constant.name} has the value of {seen[number]}"
        seen[number] = constant.name
    for kind in contract.types:
        where = f"{name}:{kind.line}: {kind.name}"
        if not kind.comment:
            yield f"{where} has no comment"
        if "@final" not in kind.annotations:
            yield f"{where} is not @final"
        if kind.is_topic == ("@nested" in kind.annotations):
            yield f"{where} is neither @topic nor @nested"
        for tag in TAGS if kind.is_topic else ():
            if not kind.tags.get(tag):
                yield f"{where} has no '{tag}:'"
        if kind.is_topic and all(kind.tags.get(tag) for tag in TAGS):
            yield from (f"{name}:{kind.line}: {fault}" for fault in faults_of_topic(contract, kind))
        grows = kind.is_topic or kind.name.endswith("Record")
        if grows and (not kind.members or kind.members[-1].name != "ext"):
            yield f"{where} does not end with ext"
        for member in kind.members:
            where = f"{name}:{member.line}: {kind.name}.{member.name}"
            if not meaning(contract, member):
                yield f"{where} has no comment"
            if re.match(r"(string|sequence<\s*\w+\s*>)($|\s|\[)", member.type):
                yield f"{where} has no bound"
            if re.search(r"@optional|@id|wstring|map<|union|enum", member.type):
                yield f"{where}: not every vendor understands {member.type}"
    for first in contract.types:
        names = [member.name.lower() for member in first.members]
        for twice in sorted({n for n in names if names.count(n) > 1}):
            yield f"{name}:{first.line}: {first.name} has two members called {twice}"


def faults_of_topic(contract, kind):
    """The parts of a topic that the generator would not understand."""
    for read in (lambda: qos_of(contract, kind), lambda: partition_of(kind)):
        try:
            read()
        except Fault as fault:
            yield str(fault)


def changes_since(old, new):
    """The changes that an old program would not expect."""
    constants = {c.name: (c.type, c.value) for c in new.constants}
    types = {t.name: t for t in new.types}
    for constant in old.constants:
        if constants.get(constant.name) != (constant.type, constant.value):
            yield f"constant {constant.name} = {constant.value} is not what it was"
    for kind in old.types:
        now = types.get(kind.name)
        if now is None:
            yield f"type {kind.name} is gone"
            continue
        if kind.annotations != now.annotations:
            yield f"type {kind.name} is {now.annotations}, was {kind.annotations}"
        was = [(m.key, m.type, m.name) for m in kind.members]
        has = [(m.key, m.type, m.name) for m in now.members]
        for before, after in zip(was, has):
            if before != after:
                yield f"type {kind.name}: member {before[1]} {before[2]} is now {after[1]} {after[2]}"
                break
        else:
            if len(was) != len(has):
                yield f"type {kind.name} has {len(has)} members, had {len(was)}"
        if kind.tags.get("topic") != now.tags.get("topic"):
            yield f"type {kind.name} is of topic {now.tags.get('topic')}, was of {kind.tags.get('topic')}"
        for tag in ("writer", "reader"):
            if kind.tags.get(tag) != now.tags.get(tag):
                yield f"type {kind.name}: its {tag} is '{now.tags.get(tag)}', was '{kind.tags.get(tag)}'"
        if kind.is_topic and now.is_topic and qos_of(old, kind) != qos_of(new, now):
            yield f"type {kind.name}: its QoS is '{quality(new, now)}', was '{quality(old, kind)}'"
        yield from changes_of_words(kind, now)


def changes_of_words(kind, now):
    """A code may get a word more, behind the others."""
    members = {member.name: member for member in now.members}
    for member in (member for member in kind.members if member.name in members):
        was, has = words_of(member), words_of(members[member.name])
        if has[: len(was)] != was:
            yield f"type {kind.name}: the codes of {member.name} are {', '.join(has) or 'without words'}, were {', '.join(was)}"


def text_of(text):
    return re.sub(r"([|<*])", r"\\\1", re.sub(r"\s+", " ", text))


def reference(contract):
    lines = [BEGIN, "", "## Reference"]
    for paragraph in contract.head.split("\n\n")[1:-1]:  # but for what this file is, and the fields of all types
        lines += ["", text_of(paragraph)]
    lines += ["", "### Topics", "", "| topic | type | key | from | to | QoS |", "| --- | --- | --- | --- | --- | --- |"]
    for kind in (t for t in contract.types if t.is_topic):
        topics = ", ".join(f"`{t.strip()}`" for t in kind.tags["topic"].split(","))
        keys = ", ".join(m.name for m in kind.members if m.key) or "none"
        cells = [topics, f"[{kind.name}](#{kind.name.lower()})", keys]
        cells += [text_of(kind.tags["writer"]), text_of(kind.tags["reader"]), text_of(quality(contract, kind))]
        lines.append("| " + " | ".join(cells) + " |")
    lines += ["", "### Fields of all types", "", "| member | meaning |", "| --- | --- |"]
    lines += [f"| `{name}` | {text_of(text)} |" for name, text in contract.common.items()]
    lines += ["", "### Operations", "", text_of(contract.constants_comment), ""]
    lines += ["| constant | value | meaning |", "| --- | --- | --- |"]
    lines += [f"| `{c.name}` | {c.value} | {text_of(c.comment)} |" for c in contract.constants]
    for kind in contract.types:
        lines += ["", f"### {kind.name}", "", text_of(kind.comment), ""]
        lines += ["| member | type | meaning |", "| --- | --- | --- |"]
        for member in kind.members:
            key = "key; " if member.key else ""
            row = f"| `{member.name}` | `{member.type}` | {key}{text_of(meaning(contract, member))} |"
            lines.append(row)
    return "\n".join(lines + ["", END])


def with_reference(page, made):
    before, begin, rest = page.partition(BEGIN)
    _, end, after = rest.partition(END)
    if not begin or not end:
        raise Fault("reference.md has no place for the reference: the two lines that begin with <!-- The reference")
    return before + made + after


def bring_up_to_date(path, made, write):
    """Writes what was made; or the fault, if nothing is to be written."""
    if path.read_text() == made:
        return []
    if write:
        path.write_text(made)
        return []
    return [f"{path.name} is not up to date: run api/reference.py --write"]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    what = parser.add_mutually_exclusive_group(required=True)
    what.add_argument("--write", action="store_true")
    what.add_argument("--check", action="store_true")
    what.add_argument("--compatible", type=pathlib.Path, metavar="OLD.idl")
    parser.add_argument("--root", type=pathlib.Path, default=pathlib.Path(__file__).parent)
    options = parser.parse_args()
    idl, page = options.root / "control.idl", options.root / "reference.md"
    try:
        if not options.compatible:
            operations = operations_of(options.root.parent / "shm/operations/operations.def")
            found = bring_up_to_date(idl, with_operations(idl.read_text(), operations), options.write)
        contract = parse(idl)
        if options.compatible:
            found = [f"{idl.name}: {f}" for f in changes_since(parse(options.compatible), contract)]
        else:
            found += faults_of(contract, idl.name)
            if not found:
                found = bring_up_to_date(page, with_reference(page.read_text(), reference(contract)), options.write)
    except Fault as fault:
        found = [str(fault)]
    print("\n".join(found), end="\n" if found else "")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
