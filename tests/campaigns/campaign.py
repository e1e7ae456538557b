"""The frame of a campaign: one kind of fault in number, under load, beside a control run, with the counts as the result.

A campaign starts a host, posts events on three ways, and runs without a fault at first. Then it makes the faults, one after the other.
The result is a line of JSON and a line for people. These counts must be 0:

* lost_beyond_control: cycles that tasks lost beyond those that the machine took from their cores. A witness on each core counts these.
  The rest of the control run is scaled to the time of the faults and taken off.
* events_lost, events_doubled: posts that their poster was told of and no task ran for, and runs without a post. Events that a task
  tells as lost count, too: the load of a campaign gives no cause for them.
* left: processes, descriptors, threads, shared memories and files. More of them than before the faults, or any after the host has ended.
"""

import argparse
import json
import os
import random
import signal
import sys
import time

from host import CORES, FAST_US, Failed, Host, Instance, Skipped, left_between, plchost_client, until
from load import CommandPoster, DdsPoster, Ledger, PoolPoster, Witness, compare

SKIPPED = 77
CONTROL = 60  # s: the longest control run
ROUNDS = 3  # of a share: a stall of the machine takes cycles after its end, too
TOLD = 5  # of the worst faults


class Counts:
    """The counts of the steady instances at one moment."""

    def __init__(self, campaign):
        self.time = time.monotonic()
        self.cycles = {one.name: campaign.host.boards[one.name].cycles for one in campaign.steady}
        self.lost = {one.name: campaign.host.boards[one.name].lost for one in campaign.steady}
        self.taken = {core: witness.taken() for core, witness in campaign.witnesses.items()}


class Campaign:
    """A kind of fault. The file of a campaign has a subclass, and calls main() with it."""

    name = ""
    full = 1000  # faults of a whole campaign
    each = 1  # faults of one call of fault()
    counts_events = True  # posts and runs can be compared
    counts_traces = True
    settled = 10  # s: by then all traces of the faults are gone
    posters_of = (DdsPoster, PoolPoster, CommandPoster)  # of the events e0, e1 and e2

    def __init__(self, seed):
        self.chance = random.Random(seed)
        self.failures, self.more = [], {}
        self.host, self.witnesses, self.posters, self.ledgers = None, {}, [], []

    # ---- Of a subclass

    def steady_instances(self):
        """Those that must not notice anything: one on the first core and one on the last."""
        return [Instance("line1", CORES[0]), Instance("line2", CORES[-1])]

    def faulty_instances(self):
        return []

    def make_host(self):
        return Host([*self.steady, *self.faulty])

    def begin(self):
        """When the host runs."""

    def fault(self, number):
        """`each` faults, and the wait for their end; returns their name. The first call, number -1, is a trial, which does not count."""
        raise NotImplementedError

    def settle(self):
        """Before the counts after the faults are taken."""

    def end(self):
        """Before the host ends."""

    # ---- The frame

    def fail(self, what):
        self.failures.append(what)

    def start_load(self):
        self.ledgers = [Ledger(one.name, event) for one in self.steady for event in range(len(self.posters_of))]
        self.posters = [self.posters_of[ledger.event](self.host, ledger) for ledger in self.ledgers]
        for poster in self.posters:
            poster.start()

    def stop_load(self):
        for poster in self.posters:
            poster.stop()
        self.posters = []

    def run(self, faults, seconds, control):
        """The result, as it is printed."""
        self.steady, self.faulty = self.steady_instances(), self.faulty_instances()
        try:
            self.host = self.make_host()
            self.processes = self.host.start()
            self.witnesses = {core: Witness(core) for core in sorted({one.core for one in self.steady})}
            self.start_load()
            self.begin()
            self.fault(-1)
            self.settle()
            traces = self.host.traces()
            result = self.measured(faults, seconds, control)
            result.update(self.left_since(traces))
            return {**result, **self.more}
        except Failed as failed:
            self.fail(f"broken off: {failed}")
            return {"faults": self.done * self.each, **self.more}
        finally:
            self.remove()

    done = 0

    def measured(self, faults, seconds, control):
        before = last = Counts(self)
        worst = []
        while self.done * self.each < faults and time.monotonic() - before.time < seconds:
            try:
                kind = self.fault(self.done)
            except Failed as failed:
                raise Failed(f"fault {self.done * self.each}: {failed}") from None
            now = Counts(self)
            worst.append((self.excess(last, now), self.done * self.each, kind or self.name))
            last = now
            self.done += 1
            if sys.stderr.isatty() and self.done % 10 == 0:
                print(f"\r{self.name}: {self.done * self.each} of {faults}", end="", file=sys.stderr)
        self.settle()
        after = Counts(self)
        # Behind the faults, so that it is of the same host in the same minutes.
        time.sleep(min(control, max(1.0, after.time - before.time)))
        ended = Counts(self)
        self.stop_load()
        result = {"faults": self.done * self.each, **self.of_cycles(before, after, ended)}
        # A witness may see a stall one fault later.
        result["lost_in_single_faults"] = sum(lost for lost, _, _ in worst)
        result["worst"] = [f"{lost} cycles at fault {number} ({kind})" for lost, number, kind in sorted(worst, reverse=True)[:TOLD] if lost]
        if self.counts_events:
            result.update(self.of_events())
        return result

    def excess(self, first, last):
        """Cycles that were lost between two moments beyond those that the machine took from their cores."""
        return sum(max(0, last.lost[one.name] - first.lost[one.name] - last.taken[one.core] + first.taken[one.core]) for one in self.steady)

    def of_cycles(self, before, after, ended):
        def total(counts, first, last):
            return sum(getattr(last, counts).values()) - sum(getattr(first, counts).values())

        ratio = (after.time - before.time) / (ended.time - after.time)
        beyond = max(0, self.excess(before, after) - ratio * self.excess(after, ended))
        return {"seconds": round(after.time - before.time, 1), "cycles": total("cycles", before, after),
                "lost_cycles": total("lost", before, after), "taken_by_machine": total("taken", before, after),
                "control_seconds": round(ended.time - after.time, 1), "control_cycles": total("cycles", after, ended),
                "control_lost": total("lost", after, ended), "control_taken": total("taken", after, ended),
                "lost_beyond_control": round(beyond)}

    def of_events(self):
        found = compare(self.host, self.ledgers)
        for what in found.pop("faults"):
            self.fail(what)
        return found

    def left_since(self, before):
        """The traces of the faults on the machine, and those of the host when it has ended."""
        left, words = {}, []
        if self.counts_traces:
            # Again, as each process opens and makes files for a moment.
            end = time.monotonic() + self.settled
            while True:
                left, words = left_between(before, self.host.traces())
                if not words or time.monotonic() > end:
                    break
                time.sleep(0.05)
        self.end()
        at_end = self.host.stop()
        for what in [*words, *at_end]:
            self.fail(f"left: {what}")
        return {"left": {**left, "at_end": len(at_end)}}

    def remove(self):
        for poster in self.posters:
            poster.ended.set()
        for witness in self.witnesses.values():
            witness.stop()
        if self.host is not None:
            if self.failures and os.environ.get("PLC_CAMPAIGN_KEEP"):
                self.host.log.rename(os.environ["PLC_CAMPAIGN_KEEP"])
            elif any("broken off" in what or "ended with" in what for what in self.failures):
                sys.stderr.write("".join(self.host.log.read_text(errors="replace").splitlines(keepends=True)[-60:]))
            self.host.remove()


def is_good(result, failures):
    return not failures and not any(result.get(key) for key in ("lost_beyond_control", "events_lost", "events_told_as_lost", "events_doubled"))


def sentence(result):
    """The line for people."""
    left = ", ".join(f"{count} {kind}" for kind, count in result.get("left", {}).items() if count) or "nothing"
    return (f"{result['campaign']}: {result['faults']:,} faults in {result.get('seconds', 0):,} s; "
            f"{result.get('lost_beyond_control', '?')} cycles lost beyond control ({result.get('lost_cycles', '?')} lost of {result.get('cycles', 0):,}, "
            f"{result.get('taken_by_machine', '?')} taken by the machine, {result.get('lost_in_single_faults', '?')} beyond that in single faults); "
            f"{result.get('posts', 0):,} posts, {result.get('events_lost', '-')} lost, {result.get('events_doubled', '-')} doubled; left: {left}; "
            f"{'passed' if result['passed'] else 'FAILED'}")


def main(kind):
    parser = argparse.ArgumentParser(description=f"The campaign {kind.name}: {kind.__doc__}")
    parser.add_argument("--share", type=float, default=1.0, help=f"of the {kind.full:,} faults of a whole campaign (default: 1)")
    parser.add_argument("--seconds", type=float, default=float("inf"), help="no further fault after this time")
    parser.add_argument("--control", type=float, default=CONTROL, help=f"longest control run in seconds (default: {CONTROL})")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    for ending in (signal.SIGTERM, signal.SIGHUP):
        signal.signal(ending, lambda *_: sys.exit(1))
    faults = max(1, round(kind.full * options.share))
    for attempt in range(1 if options.share >= 1 else ROUNDS):
        campaign = kind(options.seed + attempt)
        try:
            result = campaign.run(faults, options.seconds, options.control)
        except Skipped as skipped:
            print(f"skipped: {kind.name}: {skipped}")
            return SKIPPED
        if campaign.failures or not result.get("lost_beyond_control") or attempt == ROUNDS - 1:
            break
        print(f"further round: Campaign.{kind.name}: {result['lost_beyond_control']} cycles were lost beyond control")
    passed = is_good(result, campaign.failures)
    result = {"campaign": kind.name, "seed": options.seed, **result, "failures": len(campaign.failures), "passed": passed}
    print(json.dumps(result))
    print(sentence(result))
    for what in campaign.failures[:20]:
        print(f"  {what}")
    return 0 if passed else 1


__all__ = ["CORES", "FAST_US", "Campaign", "Failed", "Host", "Instance", "Skipped", "main", "plchost_client", "until"]
