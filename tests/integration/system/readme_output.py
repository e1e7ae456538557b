"""Whether programs print the lines that the README shows.

Any number matches a number, but counts of posts and of cycles that ran for them are exact. Any spaces match spaces, and anything matches "...".
"""
import re

EXACT_COLUMN = r"\bPOSTS\b"
EXACT_NUMBER = r"(?<![\w.])\d+(?= (posted|of them|rejected|ran,|events lost))"
EXACT = "\u0001"  # stands before a number that is exact


def pattern_of(line, columns=(), placed=lambda text: text):
    """None: the line is a picture, or stands for any. `columns`: places of numbers that are exact."""
    axis = re.fullmatch(r"(\s*\d+(ns|us|ms|s))+", line)
    if line.strip() in ("...", "") or axis or re.search(r"[\u2500-\u259f]", line):
        return None
    exact = {found.start() for found in re.finditer(EXACT_NUMBER, line)}
    for begin, end in columns:
        exact |= {found.start() for found in re.finditer(r"(?<!\S)\d+(?!\S)", line)
                  if found.start() < end and begin < found.end()}
    for at in sorted(exact, reverse=True):
        line = line[:at] + EXACT + line[at:]
    parts = [re.escape(part) for part in re.split(r"\.\.\.", placed(line))]
    pattern = ".*".join(re.sub(EXACT + r"?\d+(\\\.\d+)*", number, part) for part in parts)
    return re.compile(re.sub(r"(\\ )+", r"\\s+", pattern))


def number(found):
    return rf"(?<![0-9.]){found[0][1:]}(?![0-9.])" if found[0].startswith(EXACT) else "[0-9.]+"


def missing(expected, output, placed=lambda text: text):
    """The first line that is expected and does not come."""
    lines = iter(output.split("\n"))
    columns = []
    for line in expected:
        heads = [found.span() for found in re.finditer(EXACT_COLUMN, line)]
        columns = heads or (columns if line.strip() else [])
        pattern = pattern_of(line, columns, placed)
        if pattern is not None and not any(pattern.search(one) for one in lines):
            return line
    return None
