"""Makes programs of the TEST blocks of STruC++'s suite, so that an application itself finds out which of their statements hold.

A block becomes a program, and each ASSERT in it a counter. That is above 0 if it held each time, below 0 if it did not once, and 0
if it was not reached. Statements behind ADVANCE_TIME run in a later cycle of the task. The programs under test become function blocks,
as a program cannot have another one.
"""

import re

TICK_MS = 10
TEXT = r"'(?:\$.|''|[^'$])*'|\"(?:\$.|[^\"$])*\""
COMMENT = re.compile(rf"(?P<text>{TEXT})|\(\*.*?\*\)|/\*.*?\*/|//[^\n]*", re.S)
TOKEN = re.compile(rf"(?P<text>{TEXT})|(?P<word>[A-Za-z_]\w*)|\d[\w.]*|.", re.S)
# ASSERT_FALSE has its branches the other way round: STruC++ takes no NOT of a method's value.
CONDITION = {"ASSERT_TRUE": "({0})", "ASSERT_FALSE": "({0})", "ASSERT_EQ": "({0}) = ({1})", "ASSERT_NEQ": "({0}) <> ({1})",
             "ASSERT_NEAR": "ABS(({0}) - ({1})) <= ({2})"}
UNITS_MS = {"ms": 1, "s": 1000, "m": 60_000}


def without_comments(text):
    return COMMENT.sub(lambda part: part["text"] or " ", text)


def parts(text, separator):
    """Of a list: a separator in a text or in parentheses does not count."""
    found, depth, begin = [], 0, 0
    for token in TOKEN.finditer(text):
        depth += (token[0] in "([") - (token[0] in ")]")
        if token[0] == separator and depth == 0:
            found.append(text[begin:token.start()].strip())
            begin = token.end()
    return found + [text[begin:].strip()]


def with_own_names(text, names):
    """The variables of a block get names that no word of a compiler has. Members and parameters keep theirs."""
    made, depth, last = [], 0, ""
    for token in TOKEN.finditer(text):
        part = token[0]
        if token["word"] and part.lower() in names and last not in (".", "#") and text[token.end():token.end() + 1] != "#":
            is_parameter = depth > 0 and re.match(r"\s*(:=|=>)", text[token.end():])
            part = part if is_parameter else "its_" + part
        depth += (part == "(") - (part == ")")
        last = last if part.isspace() else part
        made.append(part)
    return "".join(made)


def milliseconds(duration):
    return sum(int(number) * UNITS_MS[unit] for number, unit in re.findall(r"(\d+)(ms|s|m)", duration.lower()))


class Block:
    """A program that stands for a TEST block."""

    def __init__(self, name, number, text):
        self.name, self.program = name, f"Stated{number}"
        self.counters, self.cycles = [], 1
        declarations = []
        while section := re.match(r"\s*VAR\b(.*?)\bEND_VAR\b", text, re.S | re.I):
            declarations += [one for one in parts(section[1], ";") if one]
            text = text[section.end():]
        names = {name.strip().lower() for one in declarations for name in one.split(":")[0].split(",")}
        self.variables = []
        for one in declarations:
            left, right = one.split(":", 1)
            self.variables.append(f"{with_own_names(left, names)}: {right};")
        self.steps = {1: []}
        for statement in parts(text, ";"):
            self.add(statement, names)

    def add(self, statement, names):
        call = re.fullmatch(r"(ASSERT_\w+|ADVANCE_TIME)\s*\((.*)\)", statement, re.S)
        if call is None:
            self.steps[self.cycles] += [with_own_names(statement, names) + ";"] if statement else []
        elif call[1] == "ADVANCE_TIME":
            ticks, rest = divmod(milliseconds(call[2]), TICK_MS)
            if ticks == 0 or rest != 0:
                raise ValueError(f"{self.name}: {statement}: no number of cycles of {TICK_MS} ms")
            self.cycles += ticks
            self.steps[self.cycles] = []
        else:
            condition = CONDITION[call[1]].format(*parts(with_own_names(call[2], names), ","))
            counter = f"held{len(self.counters)}"
            self.counters.append((f"{self.program}i.{counter}".lower(), f"{self.name}: {statement}"))
            branches = [f"{counter} := {counter} + 1;", f"{counter} := -1000000;"]
            if call[1] == "ASSERT_FALSE":
                branches.reverse()
            self.steps[self.cycles].append(f"IF {condition} THEN {branches[0]} ELSE {branches[1]} END_IF;")

    def text(self):
        counters = "".join(f"  {counter.split('.')[1]} : DINT;\n" for counter, _ in self.counters)
        variables = "".join(f"  {one}\n" for one in self.variables)
        steps = "".join(f"IF cycle = {cycle} THEN\n  " + "\n  ".join(statements) + "\nEND_IF;\n"
                        for cycle, statements in self.steps.items() if statements)
        return f"PROGRAM {self.program}\nVAR\n  cycle : DINT;\n{counters}{variables}END_VAR\ncycle := cycle + 1;\n{steps}END_PROGRAM\n"


def blocks_of(tests):
    found = re.findall(rf"\bTEST\s+({TEXT})(.*?)\bEND_TEST\b", without_comments(tests), re.S)
    return [Block(name[1:-1], number, text) for number, (name, text) in enumerate(found)]


def program_of(source, blocks):
    """The source with these blocks, without its configuration."""
    source = re.sub(r"(?im)^(\s*)PROGRAM\s+\w+\s+END_PROGRAM\b", r"\1", source)  # of the suite: to have a program at all
    source = re.sub(r"(?im)^(\s*)PROGRAM\b", r"\1FUNCTION_BLOCK", source)
    # MATIEC wants a statement in each.
    source = re.sub(r"(?im)(\bEND_VAR\s*)^(\s*END_PROGRAM\b)", r"\1VAR a_body : BOOL; END_VAR\na_body := TRUE;\n\2", source)
    source = re.sub(r"(?im)^(\s*)END_PROGRAM\b", r"\1END_FUNCTION_BLOCK", source)
    return source + "\n" + "".join(block.text() for block in blocks)
