"""manager/walks.md against the code. A part of documents.py.

* Each step names a function and a file that has it; so does each row of "Where to look".
* A step that is indented below another one is called there: the caller's body has its name, or the name that follows "as". A comment
  calls nothing.
"""

import re

PAGE = "manager/walks.md"
STEP = re.compile(r"( *)([\w:]+) +((?:\w+/)+\w+\.[ch]pp)\b(?: +as ([\w>-]+))?")
ROW = re.compile(r"\| [^|]+ \| `([\w:]+)` \| `([\w/]+\.[ch]pp)` \|$")
# A comment; or a text or character, which may look like one.
COMMENT = re.compile(r"""(//[^\n]*|/\*.*?\*/)|"(?:\\.|[^"\\\n])*"|'(?:\\.|[^'\\\n])'""", re.DOTALL)
# Between a function's parameters and its body: const, noexcept, the type that it returns, how members begin.
BEFORE_BODY = re.compile(r"[\s\w:<>&,*\[\]()-]*?(?::\s[^;{]*(?:\{[^{}]*\}[^;{]*)*)?\{")


def end_of(code, start, opening, closing):
    """Behind the bracket that closes what was opened just before `start`."""
    depth = 1
    while start < len(code) and depth:
        depth += (code[start] == opening) - (code[start] == closing)
        start += 1
    return start


def bodies_of(code, owner, name):
    """The bodies of all functions of that name: those outside of the class, or else those in it."""
    outside = list(re.finditer(rf"\b{owner}::{name}\(", code)) if owner else []
    bodies = []
    for found in outside or re.finditer(rf"\b{name}\(", code):
        behind = end_of(code, found.end(), "(", ")")
        before = BEFORE_BODY.match(code, behind)
        if before and ";" not in before.group():
            bodies.append(code[before.end():end_of(code, before.end(), "{", "}")])
    return bodies


def code_of(path):
    """The text of the file without its comments."""
    text = path.read_text(encoding="utf-8") if path.exists() else ""
    return COMMENT.sub(lambda found: " " if found[1] else found[0], text)


def has_function(code, owner, name):
    if not owner:
        return re.search(rf"\b{name}\(", code)
    in_class = re.search(rf"\b(class|struct) [^;{{]*\b{owner}\b", code) and re.search(rf"\b{name}\(", code)
    return re.search(rf"\b{owner}::{name}\(", code) or in_class


def walk_faults(root, texts):
    steps = rows = 0
    callers = []  # (indentation, function, bodies) of the steps around this one
    for number, line in enumerate(texts[PAGE].split("\n"), 1):
        row, step = ROW.match(line), STEP.match(line)
        if not row and not step:
            callers = []
            continue
        steps += bool(step)
        rows += bool(row)
        function, file = row.groups() if row else step.group(2, 3)
        code = code_of(root / file)
        owner, _, name = function.rpartition("::")
        owner = owner.split("::")[-1]
        if not has_function(code, owner, name):
            yield f"{PAGE}:{number}: {file} has no function {function}"
        if row:
            continue
        indentation, known_as = len(step[1]), (step[4] or name).split("->")[-1]
        callers = [caller for caller in callers if caller[0] < indentation]
        if callers and not any(re.search(rf"\b{known_as}\b", body) for body in callers[-1][2]):
            yield f"{PAGE}:{number}: {callers[-1][1]} does not call {known_as}"
        callers.append((indentation, function, bodies_of(code, owner, name)))
    if steps < 50 or rows < 5:
        yield f"{PAGE}: only {steps} steps and {rows} rows found"
