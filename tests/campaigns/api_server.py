#!/usr/bin/env python3
"""The API server is killed at any moment while three kinds of clients post."""

import os
import signal
import sys
import time

from campaign import Campaign, main, until


class ApiServer(Campaign):
    """The API server is killed at any moment while three kinds of clients post."""

    name = "api_server"
    full = 1000

    def fault(self, number):
        before = until("there is an API server", self.host.server)
        os.kill(before, signal.SIGKILL)
        until("the manager starts another one", lambda: self.host.server() not in (None, before))
        # Some are killed before they serve.
        if number < 0 or self.chance.random() < 0.7:
            told = [ledger.acknowledged for ledger in self.ledgers if ledger.event == 0]
            until("posts over DDS go on", lambda: all(
                ledger.acknowledged > count for ledger, count in zip((one for one in self.ledgers if one.event == 0), told)))
        time.sleep(self.chance.uniform(0, 0.3))

    def settle(self):
        self.host.until_served(self.processes)


if __name__ == "__main__":
    sys.exit(main(ApiServer))
