#!/usr/bin/env python3
"""Instances have every fault of a list, one after the other, on one core. Their neighbour on another core must not notice."""

import collections
import os
import signal
import sys
import time

from campaign import CORES, Campaign, Failed, Instance, Skipped, main, plchost_client, until

# Of a signal from outside, of task_faults.cpp, and of counting_line.cpp. The ones that take longest are last.
SIGNALS = ["KILL", "SEGV", "ABRT", "BUS", "FPE", "ILL", "TRAP", "SYS", "TERM", "INT", "HUP", "QUIT", "PIPE", "USR1", "USR2", "ALRM", "XCPU", "STOP"]
OF_TASKS = ["divide", "read_null", "write_null", "call_null", "recurse", "alloca", "abort", "illegal", "throw", "write_wild", "break", "bad_log",
            "variable", "overrun", "loop", "sleep", "busy", "starve", "soft_hog", "hog", "high_hog", "highest_hog", "late_hog", "deaf_hog", "two_hogs"]
OF_PROCESSES = ["exit", "exit_at_once", "throw", "heap", "pages", "forks", "threads", "descriptors", "grow", "halt"]
SHOWS = 2.0  # s: after that a fault has no consequence that the host shows


def interleaved(*lists):
    """So that a share has faults of each list."""
    longest = max(map(len, lists))
    return [one[at] for at in range(longest) for one in lists if at < len(one)]


class InstanceFaults(Campaign):
    """Instances have every fault of a list, one after the other, on one core. Their neighbour on another core must not notice."""

    name = "instance_faults"
    full = 530

    def steady_instances(self):
        if len(CORES) < 2:
            raise Skipped("it needs two cores: on one, a thread above all others takes it from the neighbour")
        return [Instance("line1", CORES[0])]

    def faulty_instances(self):
        keys, settings = ["crash_limit = 100", "crash_window_s = 1", "restart_delay_ms = 50"], ["[CmpSchedule]", "Watchdog.DefaultTimeMs=400"]
        return [Instance("tasks", CORES[-1], "task_faults", settings, keys),
                Instance("process", CORES[-1], "counting_line", [*settings, "[Application]", "Parameter.Faults=1"], keys)]

    def begin(self):
        self.outcomes = collections.defaultdict(collections.Counter)
        self.list = interleaved([("tasks", event) for event in OF_TASKS], [("process", event) for event in OF_PROCESSES],
                                [("process", getattr(signal, f"SIG{name}")) for name in SIGNALS])

    def fault(self, number):
        name, what = self.list[number % len(self.list)] if number >= 0 else ("process", signal.SIGKILL)
        before = until(f"{name} runs", lambda: self.running(name))
        if isinstance(what, signal.Signals):
            os.kill(before.pid, what)
        else:
            try:
                self.host.client.post(self.host.name, f"{name}/{what}")
            except plchost_client.ClientError as error:
                self.fail(f"{what}: the post failed: {error}")
        outcome = self.outcome(name, before.pid)
        self.outcomes[getattr(what, "name", what)][outcome] += 1
        if outcome != "another process":
            self.restart(name, what)
        until(f"{name} runs again after {what}", lambda: self.running(name))
        neighbour = self.host.states().get("line1")
        if neighbour is None or neighbour.pid != self.processes["line1"] or neighbour.state != "running":
            self.fail(f"{what}: the neighbour is {neighbour.state if neighbour else 'not shown'}")
        return str(getattr(what, "name", what))

    def running(self, name):
        state = self.host.states().get(name)
        return state if state and state.state == "running" else None

    def outcome(self, name, pid):
        """The first state that it has after the fault, other than running as the same process."""
        end = time.monotonic() + SHOWS
        while time.monotonic() < end:
            state = self.host.states().get(name)
            if state and state.state == "exception":
                return "exception"
            if state and state.pid != pid and state.state == "running":
                return "another process"
            time.sleep(0.01)
        return self.host.states()[name].state

    def restart(self, name, what):
        end = time.monotonic() + 60
        while True:
            try:
                self.host.client.restart(self.host.name, name)
                return
            except plchost_client.ClientError as error:
                if time.monotonic() > end:
                    raise Failed(f"{name} cannot be restarted after {what}: {error}") from None
                time.sleep(0.2)

    def settle(self):
        self.more["outcomes"] = {what: dict(counts) for what, counts in self.outcomes.items()}
        self.host.until_served()


if __name__ == "__main__":
    sys.exit(main(InstanceFaults))
