"""When each test ran, by the lines that ctest prints while it runs them."""

import re
import time

BEGIN = re.compile(r"^\s*Start\s+(\d+): (\S+)$")
END = re.compile(r"^\s*\d+/\d+ Test\s+#(\d+): (\S+) .*?([\d.]+) sec\s*$")


class WhenRun:
    """Of the tests of these names. Each line may be read late, by a stall that the test saw, too: so the time that the test took counts
    from its end as well."""

    def __init__(self, names):
        self.names = set(names)
        self.began = {}  # number and name
        self.ran = {}  # name: begin and end (CLOCK_MONOTONIC)

    def follow(self, said, copy):
        for line in said:
            self.take(line.decode(errors="replace").rstrip("\n"), time.monotonic())
            copy.write(line)
            copy.flush()

    def take(self, line, now):
        begin, end = BEGIN.match(line), END.match(line)
        if begin and begin.group(2) in self.names:
            self.began.setdefault(begin.groups(), now)
        elif end and end.groups()[:2] in self.began:
            self.ran.setdefault(end.group(2), (min(self.began[end.groups()[:2]], now - float(end.group(3))), now))
