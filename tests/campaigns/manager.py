#!/usr/bin/env python3
"""The manager is killed at any moment, also in the midst of its start, while events are posted and commands are given."""

import sys
import time

from campaign import Campaign, main
from load import Operator


class Manager(Campaign):
    """The manager is killed at any moment, also in the midst of its start, while events are posted and commands are given."""

    name = "manager"
    full = 1000

    def begin(self):
        self.host.client.register_event(self.host.name, "line2/kept")  # so that the files for registered events are there already
        self.operator = Operator(self.host, "line2")
        self.operator.start()

    def fault(self, number):
        self.host.kill_manager()
        self.host.start_manager()
        if number >= 0 and self.chance.random() < 0.3:
            time.sleep(self.chance.uniform(0, 0.3))  # killed in the midst of its start
            return
        self.host.until_served(self.processes)
        if self.operator.is_forgotten():
            self.fail(f"kill {number}: the host does not have what it has answered")
        time.sleep(self.chance.uniform(0, 0.2))

    def settle(self):
        self.host.until_served(self.processes)

    def end(self):
        self.operator.stop()
        self.more.update(commands=self.operator.commands, commands_unanswered=self.operator.unanswered)


if __name__ == "__main__":
    sys.exit(main(Manager))
