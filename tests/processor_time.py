"""The processor time of each test that a ctest runs, read from /proc while it runs."""

import os
import pathlib

TICK = os.sysconf("SC_CLK_TCK")


def words_of(process):
    return [word.decode(errors="replace") for word in (process / "cmdline").read_bytes().split(b"\0")[:-1]]


class ProcessorTime:
    """Of the children of one ctest. The time after the last look at a test is not in it, nor are processes that it left behind."""

    def __init__(self, ctest, commands):
        self.ctest = ctest
        # A script's interpreter stands before it in the command that /proc shows.
        self.names = {tuple(command): name for name, command in commands.items()}
        self.used = {}  # process and its start: name and seconds

    def look(self):
        for child in self.children():
            try:
                # The name of the process stands in parentheses, and may hold any character.
                fields = (child / "stat").read_text(errors="replace").rpartition(")")[2].split()
                key = child.name, fields[19]
                name = self.used[key][0] if key in self.used else self.name_of(words_of(child))
            except (OSError, IndexError):
                continue  # it has ended
            if name:
                self.used[key] = name, sum(int(ticks) for ticks in fields[11:15]) / TICK

    def seconds(self):
        result = {}
        for name, used in self.used.values():
            result[name] = result.get(name, 0) + used
        return result

    def children(self):
        try:
            ids = pathlib.Path(f"/proc/{self.ctest}/task/{self.ctest}/children").read_text(encoding="ascii").split()
        except OSError:
            return []
        return [pathlib.Path("/proc") / number for number in ids]

    def name_of(self, words):
        for first in range(len(words)):
            name = self.names.get(tuple(words[first:]))
            if name:
                return name
        return None
