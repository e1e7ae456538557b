"""Lists of tests of which something is expected: tests/retries.txt and tests/skips.txt."""

import fnmatch


class Expected:
    """Each line: KIND PATTERN REASON. KIND: any, plain, sanitized, address or thread. PATTERN: a name with * and ?."""

    def __init__(self, path, kind="any"):
        kinds = {"any", kind} | ({"sanitized"} if kind in ("address", "thread") else set())
        self.entries = []
        if not path:
            return
        with open(path, encoding="utf-8") as file:
            for number, line in enumerate(file, 1):
                words = line.split("#")[0].split(maxsplit=2)
                if words and len(words) < 3:
                    raise SystemExit(f"{path}:{number}: a line is KIND PATTERN REASON")
                if words and words[0] in kinds:
                    self.entries.append((words[1], words[2].strip()))

    def reason(self, name, *labels):
        """Why it is expected of the test of this name; None: it is not. With labels: only lines whose reason begins with one."""
        for pattern, reason in self.entries:
            if fnmatch.fnmatchcase(name, pattern) and (not labels or reason.startswith(labels)):
                return reason
        return None
