#!/usr/bin/env python3
"""The clock of the machine is set forward and back, by seconds to days.

It is of the whole machine: no namespace has a CLOCK_REALTIME of its own. So this campaign runs only where PLCHOST_MAY_SET_CLOCK=1
says that nobody else uses the machine.
"""

import os
import sys
import time

from campaign import Campaign, Skipped, main, until

SECONDS = [-86_400, -3_600, -60, -2, -0.5, 0.5, 2, 60, 3_600, 86_400]


class SetClocks(Campaign):
    """The clock of the machine is set forward and back, by seconds to days."""

    name = "set_clocks"
    full = 200

    def make_host(self):
        if os.environ.get("PLCHOST_MAY_SET_CLOCK") != "1":
            raise Skipped("it sets the clock of the whole machine, which PLCHOST_MAY_SET_CLOCK=1 must allow")
        self.offset = time.time() - time.monotonic()
        return super().make_host()

    def set_clock(self, seconds):
        """So far from the right time."""
        time.clock_settime(time.CLOCK_REALTIME, time.monotonic() + self.offset + seconds)

    def fault(self, number):
        seconds = self.chance.choice(SECONDS)
        self.set_clock(seconds)
        told = [ledger.acknowledged for ledger in self.ledgers]
        until("posts go on", lambda: all(ledger.acknowledged > count for ledger, count in zip(self.ledgers, told)))
        time.sleep(self.chance.uniform(0, 0.2))
        return f"{seconds} s"

    def settle(self):
        self.set_clock(0)
        self.host.until_served(self.processes)

    def remove(self):
        if hasattr(self, "offset"):
            self.set_clock(0)
        super().remove()


if __name__ == "__main__":
    sys.exit(main(SetClocks))
