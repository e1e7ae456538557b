#!/usr/bin/env python3
"""A host that works for hours. Half of its instances are steady: they are never ended, and each post of theirs is counted. The others
are killed, loaded, reset and stopped. Storms of events, switches of schedulers, online changes and clients that come and go are for
all. The API server and the manager are killed, too. Invariants are held all along, and resources are sampled."""

import argparse
import json
import os
import pathlib
import random
import signal
import sys
import threading
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "campaigns"))
from host import APPLICATIONS, CORES, SHARED_MEMORY, Failed, Host, Instance, plchost_client, read  # noqa: E402
from load import CommandPoster, DdsPoster, Ledger, PoolPoster, Witness, compare  # noqa: E402

import report  # noqa: E402

OWN_TASKS = 9  # of counting_line without Parameter.Tasks
SAMPLE = 2.0  # s between two samples
COMPARE = 30.0  # s between two comparisons of all counts, for which nobody posts
SCHEDULERS = ("CmpSchedule", "CmpScheduleTimer", "CmpScheduleOneShot")
VERSIONS = ("counting_line", "counting_line_2")
AUDIT_MIB = 64 * 16  # api/audit.md
KEPT = 3  # files for each instance: loaded, boot application, and one more (application_versions)
BACK = 60  # s in which an instance that is not steady must run again


class Storm(PoolPoster):
    """Thousands of posts at once, now and then: more than the tasks run for in that time."""

    def __init__(self, host, ledger, chance):
        super().__init__(host, ledger, pause=0)
        self.chance = chance

    def run(self):
        while not self.ended.wait(self.chance.uniform(2, 6)):
            with self.between:
                self.post_and_count(self.chance.randrange(1000, 20_000))


class Soak:
    def __init__(self, options):
        self.chance = random.Random(options.seed)
        self.options = options
        tasks = max(0, -(-options.tasks // options.instances) - OWN_TASKS)
        # A storm is more than a task may lag behind. It must count the posts that it drops.
        settings = ["[CmpSchedule]", "ExternalEvent.MaxBacklog=200", "[Application]", f"Parameter.Tasks={tasks}", "[SysTimer]", "Linux.IdleStates=Allow"]
        keys = ["crash_limit = 100", "crash_window_s = 1", "restart_delay_ms = 50"]
        instances = [Instance(f"line{number}", CORES[number % len(CORES)], settings=settings, keys=keys) for number in range(options.instances)]
        self.steady, self.others = instances[: len(instances) // 2], instances[len(instances) // 2:]
        self.tasks = options.instances * (tasks + OWN_TASKS)
        self.host = Host(instances, keys=["application_versions = 1"])
        self.application_mib = (APPLICATIONS / f"{VERSIONS[0]}.so").stat().st_size / 2**20 + 0.1
        self.failures, self.counts, self.series, self.marks = [], {}, {}, {}
        self.ended = threading.Event()
        self.killing = threading.Lock()  # held while a manager or an API server is gone
        self.posters, self.ledgers, self.witnesses = [], [], {}

    # ---- Invariants

    def fail(self, what):
        self.failures.append(f"{time.monotonic() - self.began:.0f} s: {what}")
        print(f"  {self.failures[-1]}", file=sys.stderr)

    def count(self, what, number=1):
        self.counts[what] = self.counts.get(what, 0) + number

    def look(self):
        """Processes and cycles of the steady instances; all others come back."""
        for one in self.steady:
            cycles = self.host.boards[one.name].cycles
            if not os.path.exists(f"/proc/{self.processes[one.name]}"):
                self.fail(f"{one.name} has ended")
            elif cycles == self.seen.get(one.name):
                self.fail(f"{one.name} runs no cycles")
            self.seen[one.name] = cycles
        now = time.monotonic()
        for one in self.others:
            cycles = self.host.boards[one.name].cycles
            if cycles != self.seen.get(one.name):
                self.seen[one.name], self.since[one.name] = cycles, now
            elif now - self.since[one.name] > BACK:
                state = self.host.states().get(one.name)
                self.fail(f"{one.name} has not run for {BACK} s: {state.state + ' ' + state.problem if state else 'not shown'}")
                self.since[one.name] = now

    def compare(self):
        """All counts of posts agree while nobody posts."""
        with self.killing:
            for poster in self.posters:
                poster.between.acquire()
            try:
                found = compare(self.host, self.ledgers)
                self.count("comparisons")
                for what in found.pop("faults"):
                    self.fail(what)
                self.counts.update(found)
                for name, pid in self.processes.items():
                    state = self.host.states().get(name)
                    if state is None or state.pid != pid or state.state != "running":
                        self.fail(f"{name} is {state.state if state else 'not shown'}, process {state.pid if state else 0} instead of {pid}")
            except Failed as failed:
                self.fail(str(failed))
            finally:
                for poster in self.posters:
                    poster.between.release()

    # ---- Resources

    def sample(self):
        at, traces = time.monotonic() - self.began, self.host.traces()
        for role in ("manager", "API server", "instance"):
            if traces["processes"][role]:
                self.add("memory", role, "MiB", at, traces["resident_kib"][role] / 1024, 4)
                self.add("descriptors", role, "descriptors", at, traces["descriptors"][role], 16)
                self.add("threads", role, "threads", at, traces["threads"][role], 8)
        self.add("processes", "all", "processes", at, sum(traces["processes"].values()), 2)
        own = next(int(line.split()[1]) for line in read("/proc/self/status").decode().splitlines() if line.startswith("VmRSS:"))
        self.add("memory of the clients", "this program", "MiB", at, own / 1024, 8)
        memories = sum((SHARED_MEMORY / name).stat().st_blocks for name in self.host.memories() if (SHARED_MEMORY / name).exists())
        self.add("shared memory", "all", "MiB", at, memories / 2048, 2)
        self.add("shared memories", "all", "files", at, len(traces["shared_memory"]), 4)
        sizes = {"audit": 0, "applications": 0, "": 0}  # MiB, by how the folder's name begins
        for path in [*self.host.run.rglob("*"), *self.host.state.rglob("*")]:
            if path.is_file():
                begin = next((begin for begin in sizes if begin and any(part.startswith(begin + ".") for part in path.parts)), "")
                sizes[begin] += path.stat().st_blocks / 2048
        # The first two have bounds of their own, which they come to in time.
        self.add("disk", "audit log", "MiB", at, sizes["audit"], AUDIT_MIB)
        self.add("disk", "kept applications", "MiB", at, sizes["applications"], KEPT * len(self.others) * self.application_mib)
        self.add("disk", "all others", "MiB", at, sizes[""], 2)
        lost, taken = self.lost_cycles()
        self.add("lost cycles", "steady instances", "cycles", at, lost, float("inf"))
        self.add("lost cycles", "taken by the machine", "cycles", at, taken, float("inf"))

    def lost_cycles(self):
        """Of the steady instances; and those that the machine took from them, from each on its core."""
        taken = {core: witness.taken() for core, witness in self.witnesses.items()}
        return sum(self.host.boards[one.name].lost for one in self.steady) - self.lost_before, sum(taken[one.core] for one in self.steady)

    def add(self, group, name, unit, at, value, least):
        self.series.setdefault((group, name), report.Series(group, name, unit, least)).add(at, value)

    # ---- Disturbances: each a thread of its own

    def again(self, what, least, most, action):
        def run():
            chance = random.Random(f"{self.options.seed} {what}")
            while not self.ended.wait(chance.uniform(least, most)):
                try:
                    action(chance)
                    self.count(what)
                except plchost_client.ClientError as error:
                    # Of a manager or a server that was killed meanwhile, or of an instance that another disturbance has in its hands.
                    self.count(f"{what}: refused or not answered")
                    self.refusals[f"{what}: {str(error)[:120]}"] = self.refusals.get(f"{what}: {str(error)[:120]}", 0) + 1
                except (Failed, OSError) as error:
                    self.fail(f"{what}: {error}")
        thread = threading.Thread(target=run, daemon=True)
        thread.start()
        return thread

    def mark(self, what):
        self.marks.setdefault(what, []).append(time.monotonic() - self.began)

    def kill_server(self, _):
        with self.killing:
            server = self.host.server()
            if server is None:
                return
            os.kill(server, signal.SIGKILL)
            self.mark("API server killed")
            self.host.until_answered()

    def kill_manager(self, _):
        with self.killing:
            self.host.kill_manager()
            self.mark("manager killed")
            self.host.start_manager()
            self.host.until_answered()

    def kill_instance(self, chance):
        state = self.host.states().get(chance.choice(self.others).name)
        if state and state.pid:
            try:
                os.kill(state.pid, chance.choice([signal.SIGKILL, signal.SIGSEGV, signal.SIGABRT]))
            except ProcessLookupError:
                return  # it has ended meanwhile
            self.mark("instance killed")

    def switch(self, chance):
        self.commander.set_scheduler(self.host.name, chance.choice(self.host.instances).name, chance.choice(SCHEDULERS))

    def change_online(self, chance):
        name = chance.choice(self.steady).name
        self.version[name] = not self.version.get(name, False)
        self.commander.load_application(self.host.name, name, str(APPLICATIONS / f"{VERSIONS[self.version[name]]}.so"), online=True)

    def load(self, chance):
        name, file = chance.choice(self.others).name, str(APPLICATIONS / f"{chance.choice(VERSIONS)}.so")
        if chance.random() < 0.5:
            self.loader.load_application(self.host.name, name, file)
        else:
            self.loader.download_application(self.host.name, name, file)
        self.loader.start(self.host.name, name)

    def stop_and_start(self, chance):
        name = chance.choice(self.others).name
        chance.choice([self.commander.stop, self.commander.reset])(self.host.name, name)
        self.commander.start(self.host.name, name)

    def start_all(self, _):
        """Another disturbance may have been refused its start."""
        for name, state in self.host.states().items():
            if state.state in ("stopped", "offline", "failed", "safe_mode"):
                self.commander.start(self.host.name, name)
            elif state.state == "exception":
                self.fail(f"{name} is in exception: {state.problem}")
                self.commander.restart(self.host.name, name)

    def come_and_go(self, chance):
        if chance.random() < 0.3:
            self.host.plcctl("list", "tasks")
            return
        with self.host.new_client(timeout=10.0) as client:
            client.post(self.host.name, f"{self.others[0].name}/e6")
            client.objects()

    # ---- All together

    def start_load(self):
        for one in self.steady:
            self.ledgers += [Ledger(one.name, event) for event in range(4)]
        kinds = {0: lambda ledger: DdsPoster(self.host, ledger, pause=0.02), 1: lambda ledger: PoolPoster(self.host, ledger, pause=0.01),
                 2: lambda ledger: CommandPoster(self.host, ledger, pause=4.0),
                 3: lambda ledger: Storm(self.host, ledger, random.Random(f"{self.options.seed} {ledger.name}"))}
        self.posters = [kinds[ledger.event](ledger) for ledger in self.ledgers]
        for poster in self.posters:
            poster.start()

    def disturb(self):
        self.commander, self.loader = self.host.new_client(timeout=30.0), self.host.new_client(timeout=30.0)
        return [self.again(*each) for each in (
            ("API server killed", 8, 25, self.kill_server), ("manager killed", 15, 45, self.kill_manager),
            ("instances killed", 2, 8, self.kill_instance), ("schedulers switched", 0.5, 2, self.switch),
            ("online changes", 1, 4, self.change_online), ("applications loaded", 3, 10, self.load),
            ("stopped and started", 2, 8, self.stop_and_start), ("clients that came and went", 0.3, 2, self.come_and_go),
            ("looks for stopped instances", 5, 10, self.start_all))]

    def run(self):
        seconds = self.options.hours * 3600
        self.version, self.refusals, self.seen, self.since = {}, {}, {}, {}
        try:
            self.began = time.monotonic()
            processes = self.host.start()
            self.processes = {one.name: processes[one.name] for one in self.steady}
            self.witnesses = {core: Witness(core) for core in CORES}
            self.lost_before = sum(self.host.boards[one.name].lost for one in self.steady)
            self.began = time.monotonic()
            self.since = {one.name: self.began for one in self.others}
            self.start_load()
            threads = self.disturb()
            compared = self.began
            while time.monotonic() - self.began < seconds:
                time.sleep(SAMPLE)
                self.sample()
                self.look()
                if time.monotonic() - compared > COMPARE:
                    self.compare()
                    compared = time.monotonic()
            self.ended.set()
            for thread in threads:
                thread.join(120)
            self.compare()
            for poster in self.posters:
                poster.stop()
            self.counts["cycles of the steady instances"] = sum(
                self.host.boards[one.name].cycles + self.host.boards[one.name].other_cycles() for one in self.steady)
            self.counts["lost cycles of the steady instances"], self.counts["cycles that the machine took from them"] = self.lost_cycles()
            for what in self.host.stop():
                self.fail(f"left at the end: {what}")
            return self.report()
        except Failed as failed:
            self.fail(f"broken off: {failed}")
            sys.stderr.write("".join(self.host.log.read_text(errors="replace").splitlines(keepends=True)[-60:]))
            return self.report()
        finally:
            self.ended.set()
            for poster in self.posters:
                poster.ended.set()
            for witness in self.witnesses.values():
                witness.stop()
            self.host.remove()

    def report(self):
        folder = self.options.report
        series = list(self.series.values())
        grown = [f"{one.group} of {one.name} grew by {report.nice(one.growth())} {one.unit}, bound {report.nice(one.bound())}"
                 for one in series if not one.is_flat()]
        passed = not self.failures and not grown
        summary = [f"{self.options.hours:g} hours, {self.options.instances} instances with {self.tasks} tasks on {len(CORES)} cores, seed {self.options.seed}: "
                   f"{'passed' if passed else 'FAILED'}."]
        report.write(folder, summary, series, self.counts, self.failures + grown, list(self.marks.items()))
        told = {"hours": self.options.hours, "instances": self.options.instances, "tasks": self.tasks, "passed": passed, "counts": self.counts,
                "refusals": self.refusals, "failures": self.failures, "grown": grown,
                "slopes_per_hour": {f"{one.group}: {one.name}": round(one.per_hour(), 3) for one in series}}
        (folder / "soak.json").write_text(json.dumps(told, indent=1) + "\n", encoding="utf-8")
        print(json.dumps({key: told[key] for key in ("hours", "instances", "tasks", "passed", "counts")}))
        print(summary[0], *[f"  {what}" for what in [*self.failures, *grown][:20]], f"report: {folder / 'report.md'}", sep="\n")
        return 0 if passed else 1


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--hours", type=float, required=True)
    parser.add_argument("--instances", type=int, default=16)
    parser.add_argument("--tasks", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--report", type=pathlib.Path, default=pathlib.Path(__file__).resolve().parent.parent.parent / ".build" / "soak")
    options = parser.parse_args()
    for ending in (signal.SIGTERM, signal.SIGHUP):
        signal.signal(ending, lambda *_: sys.exit(1))
    return Soak(options).run()


if __name__ == "__main__":
    sys.exit(main())
