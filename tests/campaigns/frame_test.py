#!/usr/bin/env python3
"""The counts of campaigns and soaks: each fault that they are to find is found, and nothing else is."""

import collections
import pathlib
import sys
import types
import unittest
import xml.etree.ElementTree as ElementTree

import campaign
from host import Instance, left_between
from load import Ledger, compare

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "soak"))
import report  # noqa: E402


def told(**members):
    return types.SimpleNamespace(**members)


class FakeHost:
    """That tells of one event and its task."""

    def __init__(self, posts, cycles, lost_events, runs):
        self.events, self.tasks = [told(instance="line1", name="e0", posts=posts)], [
            told(instance="line1", external_event="e0", cycles=cycles, lost_events=lost_events)]
        self.boards = {"line1": told(runs=lambda event: runs)}

    def asked(self, question):
        return question(told(events=lambda: self.events, tasks=lambda: self.tasks))


def compared(acknowledged, uncertain, posts, cycles, lost_events, runs):
    ledger = Ledger("line1", 0)
    ledger.acknowledged, ledger.uncertain = acknowledged, uncertain
    found = compare(FakeHost(posts, cycles, lost_events, runs), [ledger], patience=0)
    return found["events_lost"], found["events_doubled"], found["events_told_as_lost"], len(found["faults"])


class Events(unittest.TestCase):
    def test_agree(self):
        self.assertEqual(compared(10, 0, 10, 10, 0, 10), (0, 0, 0, 0))

    def test_uncertain_ones_may_have_come_or_not(self):
        self.assertEqual(compared(10, 3, 10, 10, 0, 10), (0, 0, 0, 0))
        self.assertEqual(compared(10, 3, 13, 13, 0, 13), (0, 0, 0, 0))

    def test_lost_in_the_pool(self):
        self.assertEqual(compared(10, 0, 9, 9, 0, 9), (1, 0, 0, 1))

    def test_lost_by_the_task(self):
        self.assertEqual(compared(10, 0, 10, 9, 0, 9), (1, 0, 0, 1))

    def test_told_as_lost(self):
        self.assertEqual(compared(10, 0, 10, 8, 2, 8), (0, 0, 2, 0))

    def test_posted_twice(self):
        self.assertEqual(compared(10, 0, 11, 11, 0, 11), (0, 1, 0, 1))
        self.assertEqual(compared(10, 1, 12, 12, 0, 12), (0, 1, 0, 1))

    def test_run_twice(self):
        self.assertEqual(compared(10, 0, 10, 10, 0, 11), (0, 1, 0, 1))


class Cycles(unittest.TestCase):
    def beyond(self, lost, taken, control_lost, control_taken):
        """After 10 s of faults and 5 s of control."""
        sut = campaign.Campaign(1)
        sut.steady = [Instance("line1", 0)]
        moments = [told(time=0, lost={"line1": 0}, taken={0: 0}, cycles={"line1": 0}), told(time=10, lost={"line1": lost}, taken={0: taken}, cycles={"line1": 5000}),
                   told(time=15, lost={"line1": lost + control_lost}, taken={0: taken + control_taken}, cycles={"line1": 7500})]
        return sut.of_cycles(*moments)["lost_beyond_control"]

    def test_that_the_machine_took_do_not_count(self):
        self.assertEqual(self.beyond(5, 5, 0, 0), 0)
        self.assertEqual(self.beyond(5, 9, 0, 0), 0)

    def test_beyond_these_count(self):
        self.assertEqual(self.beyond(5, 3, 0, 0), 2)

    def test_those_of_the_control_run_are_scaled(self):
        self.assertEqual(self.beyond(5, 3, 1, 0), 0)
        self.assertEqual(self.beyond(6, 3, 1, 0), 1)

    def test_fail_the_campaign(self):
        self.assertTrue(campaign.is_good({"lost_beyond_control": 0, "events_lost": 0}, []))
        for key in ("lost_beyond_control", "events_lost", "events_doubled", "events_told_as_lost"):
            self.assertFalse(campaign.is_good({key: 1}, []))
        self.assertFalse(campaign.is_good({}, ["left: a file"]))


class Traces(unittest.TestCase):
    def test_more_than_before_is_left(self):
        before, after = collections.defaultdict(collections.Counter), collections.defaultdict(collections.Counter)
        before["descriptors"].update(manager=20, instance=30)
        after["descriptors"].update(manager=21, instance=25)
        after["shared_memory"].update(["pool.memory.old"])
        counts, words = left_between(before, after)
        self.assertEqual((counts["descriptors"], counts["shared_memory"], counts["files"]), (1, 1, 0))
        self.assertEqual(words, ["descriptors: 1 more (manager)", "shared_memory: 1 more (pool.memory.old)"])


class Growth(unittest.TestCase):
    def series(self, values, least=1):
        sut = report.Series("memory", "manager", "MiB", least)
        for at, value in enumerate(values):
            sut.add(10 * at, value)
        return sut

    def test_that_goes_on_is_found(self):
        sut = self.series([10 + 0.1 * at for at in range(100)])
        self.assertFalse(sut.is_flat())
        self.assertAlmostEqual(sut.per_hour(), 36)

    def test_of_the_first_quarter_is_none(self):
        self.assertTrue(self.series([min(25, at) for at in range(100)]).is_flat())

    def test_up_and_down_is_none(self):
        self.assertTrue(self.series([10 + at % 3 for at in range(100)]).is_flat())

    def test_is_not_told_of_a_minute(self):
        self.assertTrue(self.series([10 + 10 * at for at in range(7)]).is_flat())

    def test_of_no_samples_is_none(self):
        self.assertTrue(self.series([]).is_flat())

    def test_has_a_picture(self):
        picture = report.plot("memory & more", "MiB", [self.series([1, 2, 3])], [("manager killed", [5, 10])])
        lines = [part.get("points") for part in ElementTree.fromstring(picture) if part.tag.endswith("polyline")]
        self.assertEqual(len(lines[0].split()), 3)


if __name__ == "__main__":
    unittest.main()
