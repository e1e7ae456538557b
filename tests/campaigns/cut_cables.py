#!/usr/bin/env python3
"""The cable between a host and its clients is cut and mended, again and again: at the host's end, at the clients', or at both."""

import os
import subprocess
import sys
import time

from campaign import Campaign, Host, main, until
from load import DdsPoster, PoolPoster

SPACE = "PLC_CAMPAIGN_SPACE"  # in the environment: the namespace of the host; that of the clients is the one of this process
ADDRESSES = {"host": "10.79.0.1", "desk": "10.79.0.2"}


class CutCables(Campaign):
    """The cable between a host and its clients is cut and mended, again and again: at the host's end, at the clients', or at both."""

    name = "cut_cables"
    full = 300
    posters_of = (DdsPoster, PoolPoster)  # plcctl ends if its interface is down when it starts

    def make_host(self):
        return Host([*self.steady, *self.faulty], dds=['interface = "cable"', "allow_unsecured = true"], wrapped=in_space(os.environ[SPACE]),
                    client_interfaces=["cable"])

    def fault(self, number):
        ends = self.chance.choice([["host"], ["desk"], ["host", "desk"]])
        for end in ends:
            self.set_cable(end, "down")
        time.sleep(self.chance.choice([0.05, 0.3, 1.5]) * self.chance.uniform(0.5, 1.5))
        for end in ends:
            self.set_cable(end, "up")
        told = [ledger.acknowledged for ledger in self.ledgers if ledger.event == 0]
        until("posts go on", lambda: all(
            ledger.acknowledged > count for ledger, count in zip((one for one in self.ledgers if one.event == 0), told)))

    def set_cable(self, end, state):
        words = in_space(os.environ[SPACE]) if end == "host" else []
        subprocess.run([*words, "ip", "link", "set", "cable", state], check=True)

    def settle(self):
        self.host.until_served(self.processes)


def in_space(name):
    return ["ip", "netns", "exec", name]


def make_spaces():
    """The names of two namespaces with a cable between them; None: there can be none."""
    names = {end: f"plchost-{end}-{os.getpid()}" for end in ADDRESSES}

    def done(*words):
        return subprocess.run(["ip", *words], check=False, capture_output=True).returncode == 0
    good = all(done("netns", "add", name) and done("-n", name, "link", "set", "lo", "up") for name in names.values())
    good = good and done("-n", names["host"], "link", "add", "name", "cable", "type", "veth", "peer", "name", "cable", "netns", names["desk"])
    for end, name in names.items():
        good = good and done("-n", name, "address", "add", f"{ADDRESSES[end]}/24", "dev", "cable") and done("-n", name, "link", "set", "cable", "up")
    return names, good


def run_within():
    """This campaign as a child, in the namespace of the clients."""
    names, good = {}, False
    try:
        names, good = make_spaces()
        if not good:
            print("skipped: cut_cables: there can be no network namespaces with a cable here (they need ip, CAP_SYS_ADMIN and CAP_NET_ADMIN)")
            return 77
        return subprocess.run([*in_space(names["desk"]), sys.executable, *sys.argv], check=False, env={**os.environ, SPACE: names["host"]}).returncode
    except FileNotFoundError:
        print("skipped: cut_cables: there is no program ip here")
        return 77
    finally:
        for name in names.values():
            subprocess.run(["ip", "netns", "delete", name], check=False, capture_output=True)


if __name__ == "__main__":
    sys.exit(main(CutCables) if SPACE in os.environ else run_within())
