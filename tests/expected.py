"""Lists of tests of which something is expected: tests/retries.txt and tests/skips.txt."""

import fnmatch

# Each kind of line is held against one kind of build, which has all tests that such lines name.
HELD_BY = {"any": "plain", "plain": "plain", "sanitized": "address", "address": "address", "thread": "thread", "threads": "threads",
           "emulated": "emulated"}
LEFT_OUT = "left out:"  # begins the reason of what a build does not have


class Expected:
    """Each line: KIND PATTERN REASON. KIND: any, plain, sanitized, address, thread, threads or emulated. PATTERN: a name with * and ?."""

    def __init__(self, path, kind="any"):
        kinds = {"any", kind} | ({"sanitized"} if kind in ("address", "thread", "threads") else set()) | ({"thread"} if kind == "threads" else set())
        self.entries = []
        self.held = []  # by this kind of build: where the line stands, its pattern and its reason
        if not path:
            return
        with open(path, encoding="utf-8") as file:
            for number, line in enumerate(file, 1):
                words = line.split("#")[0].split(maxsplit=2)
                if words and (len(words) < 3 or words[0] not in HELD_BY):
                    raise SystemExit(f"{path}:{number}: a line is KIND PATTERN REASON, with one of the kinds {', '.join(HELD_BY)}")
                if words and words[0] in kinds:
                    pattern, reason = words[1], words[2].strip()
                    self.entries.append((pattern, reason))
                    # A plain build leaves out only what misses a package, and elsewhere has it.
                    if HELD_BY[words[0]] == kind and not (kind == "plain" and reason.startswith(LEFT_OUT)):
                        self.held.append((f"{path}:{number}", pattern, reason))

    def reason(self, name, *labels):
        """Why it is expected of the test of this name; None: it is not. With labels: only lines whose reason begins with one."""
        for pattern, reason in self.entries:
            if fnmatch.fnmatchcase(name, pattern) and (not labels or reason.startswith(labels)):
                return reason
        return None

    def second_run(self, name):
        """Why it may run again, by tests/retries.txt; None: that does not name it."""
        return self.reason(name, "time", "slow")

    def is_slow(self, name):
        """Whether it may run again only because every program of this build is slow."""
        return self.second_run(name) is not None and self.reason(name, "time") is None

    def may_stall(self, name):
        """Whether it may run again, by tests/retries.txt, if the machine stood still while it ran (stalls.py)."""
        return self.reason(name, "stall") is not None

    def skipped(self, name):
        """Why it may be skipped, by tests/skips.txt; None: that does not name it."""
        return next((reason for pattern, reason in self.entries
                     if fnmatch.fnmatchcase(name, pattern) and not reason.startswith(LEFT_OUT)), None)

    def left_out(self, name):
        """Why the build may leave it out, by tests/skips.txt; None: that does not name it."""
        return self.reason(name, LEFT_OUT)

    def of_no_test(self, names, left_out):
        """The lines that this kind of build holds, and that match none of these: place and pattern."""
        return [(place, pattern) for place, pattern, reason in self.held
                if not fnmatch.filter(left_out if reason.startswith(LEFT_OUT) else names, pattern)]
