#!/usr/bin/env python3
"""A campaign finds the faults that are planted: a post that nobody counted, cycles that an instance lost, and a memory that is left."""

import os
import signal
import sys
import time

from campaign import Campaign, is_good
from host import SHARED_MEMORY

PLANTED = 3


class Planted(Campaign):
    """Three planted faults."""

    name = "planted"
    settled = 1

    def fault(self, number):
        if number == 0:
            self.host.client.post(self.host.name, "line1/e0", 1)
        elif number == 1:
            os.kill(self.processes["line2"], signal.SIGSTOP)
            time.sleep(0.1)
            os.kill(self.processes["line2"], signal.SIGCONT)
        elif number == 2:
            (SHARED_MEMORY / f"{self.host.pool}.planted").write_bytes(b"x")


def main():
    campaign = Planted(1)
    result = campaign.run(PLANTED, 60, 0.5)
    wrong = [key for key, found in (("events_doubled", result.get("events_doubled") == 1), ("lost_beyond_control", result.get("lost_beyond_control", 0) > 0),
                                    ("left", result.get("left", {}).get("shared_memory") == 1),
                                    ("the whole", not is_good(result, campaign.failures))) if not found]
    print(*campaign.failures, sep="\n")
    print(f"not found: {', '.join(wrong)}; {result}" if wrong else "each planted fault was found")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
