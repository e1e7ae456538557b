"""The operations of control.idl, made from the table of operations, shm/operations/operations.def."""

import dataclasses
import re
import textwrap

from contract import Fault

ROW = re.compile(r"^OPERATION\((\w+), (\d+),\s*((?:\"(?:[^\"\\]|\\.)*\"\s*)+)(.*?)\)$", re.DOTALL | re.MULTILINE)
INTERNAL = ".place = Place::internal"
ROLES = {"kEngineer": "eng", "kViewer": "all"}  # the others are operators'


@dataclasses.dataclass
class Operation:
    verb: str
    number: int
    comment: str  # as control.idl has it

    @property
    def constant(self):
        return f"OPERATION_{self.verb.upper()}"


def operations_of(path):
    """Those that clients can ask for, by number."""
    text = path.read_text()
    rows = ROW.findall(text)
    if len(rows) != len(re.findall(r"^OPERATION\(", text, re.MULTILINE)):
        raise Fault(f"{path.name}: a row is not understood; a row is OPERATION(verb, number, \"text\", members of Operation)")
    found = []
    for verb, number, meaning, members in rows:
        if INTERNAL in members:
            continue
        role = next((topic for role, topic in ROLES.items() if f".role = {role}" in members), "op")
        of_host = "no instance: " if ".names_instance = false" in members else ""
        text = "".join(re.findall(r"\"((?:[^\"\\]|\\.)*)\"", meaning))
        found.append(Operation(verb, int(number), f"{role + ':':4} {of_host}{text}"))
    return sorted(found, key=lambda operation: operation.number)


def block(operations):
    """Their constants in control.idl."""
    lines = []
    width = max(len(operation.constant) for operation in operations)
    for operation in operations:
        head = f"  const long {operation.constant:{width}} = {str(operation.number) + ';':4}"
        begin = f"{head} // "
        told = textwrap.wrap(operation.comment, 130 - len(begin), fix_sentence_endings=False, subsequent_indent="     ")
        lines.append(begin + told[0])
        lines += [" " * (len(begin) - 3) + "// " + more for more in told[1:]]
    return "\n".join(lines) + "\n"


def with_operations(idl, operations):
    """control.idl with these operations."""
    constants = re.compile(r"(?:^  const long OPERATION_.*\n(?:^ {12,}//.*\n)*)+", re.MULTILINE)
    if len(constants.findall(idl)) != 1:
        raise Fault("control.idl: the constants OPERATION_... are not in one place, without a line between them")
    return constants.sub(lambda _: block(operations), idl)
