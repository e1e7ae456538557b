"""The load of a campaign: events are posted on three ways, and each post is counted. Witnesses count the cycles that the machine
takes from each core."""

import ctypes
import os
import subprocess
import threading
import time

from host import BIN, FAST_US, Failed, plchost_client, until

TOLD = 5  # faults of each poster


class Ledger:
    """Posts to one event of one instance."""

    def __init__(self, instance, event):
        self.instance, self.event = instance, event
        self.acknowledged = 0  # posts that their poster was told of
        self.uncertain = 0  # posts that may or may not have come: their poster was not told
        self.faults = []

    @property
    def name(self):
        return f"{self.instance}/e{self.event}"


class Poster(threading.Thread):
    """Posts again and again, until stop()."""

    def __init__(self, ledger, pause):
        super().__init__(daemon=True)
        self.ledger, self.pause = ledger, pause
        self.ended = threading.Event()
        self.between = threading.Lock()  # held while posts are under way

    def run(self):
        while not self.ended.wait(self.pause):
            with self.between:
                self.post_and_count(1 + self.ledger.acknowledged % 7)

    def post_and_count(self, count):
        fault = self.post(count)
        if fault:
            self.ledger.uncertain += count
            self.ledger.faults.append(fault)
        else:
            self.ledger.acknowledged += count

    def stop(self):
        self.ended.set()
        self.join()


class DdsPoster(Poster):
    """With the client library. It waits for longer than any restart takes."""

    def __init__(self, host, ledger, pause=0.002):
        super().__init__(ledger, pause)
        self.host, self.client = host.name, host.new_client(timeout=60.0)

    def post(self, count):
        try:
            self.client.post(self.host, self.ledger.name, count)
        except plchost_client.ClientError as error:
            return f"post over DDS: {error}"
        return None


class CommandPoster(Poster):
    """With plcctl: a client that comes and goes."""

    def __init__(self, host, ledger, pause=0.3):
        super().__init__(ledger, pause)
        self.host = host

    def post(self, count):
        said = self.host.plcctl("post", "event", self.ledger.name, "--count", str(count), "-q", timeout=60)
        return None if said.returncode == 0 else f"plcctl post ended with {said.returncode}: {said.stderr.strip()}"


class PoolPoster(Poster):
    """With the C library, as firmware of the host."""

    def __init__(self, host, ledger, pause=0.001):
        super().__init__(ledger, pause)
        self.library = load_pool_library()
        self.pool, self.event = ctypes.c_void_p(), ctypes.c_void_p()
        self.check(self.library.plc_pool_open(host.pool.encode(), 1, ctypes.byref(self.pool)))
        self.check(self.library.plc_event_open(self.pool, ledger.name.encode(), 1, ctypes.byref(self.event)))

    def check(self, result):
        if result < 0:
            raise Failed(f"the pool cannot be used: {self.library.plc_pool_error().decode()}")

    def post(self, count):
        for _ in range(count):
            if self.library.plc_event_post(self.event) < 0:
                return "post to the pool: refused"
        return None

    def stop(self):
        super().stop()
        self.library.plc_event_close(self.event)
        self.library.plc_pool_close(self.pool)


def load_pool_library():
    library = ctypes.CDLL(str(BIN.parent / "lib" / "libplcpool.so"))
    library.plc_pool_error.restype = ctypes.c_char_p
    for name in ("plc_event_post", "plc_event_close", "plc_pool_close"):
        getattr(library, name).argtypes = [ctypes.c_void_p]
    library.plc_event_open.argtypes = library.plc_event_create.argtypes = [ctypes.c_void_p, ctypes.c_char_p, *[ctypes.c_void_p] * 2]
    library.plc_event_open.argtypes = [ctypes.c_void_p, ctypes.c_char_p, ctypes.c_int, ctypes.c_void_p]
    return library


def compare(host, ledgers, patience=10):
    """Four counts of the same posts: of the posters, of the pool, of the tasks, and of the application itself. Nobody posts meanwhile.
    `faults` says each difference in words."""
    keys = [(one.instance, f"e{one.event}") for one in ledgers]

    def figures():
        events = {(event.instance, event.name): event.posts for event in host.asked(lambda client: client.events()) or []}
        told = {(task.instance, task.external_event): (task.cycles, task.lost_events) for task in host.asked(lambda client: client.tasks()) or []}
        return all(key in events and key in told for key in keys) and {key: (events[key], *told[key]) for key in keys}

    def agree():
        found = figures()
        return found and all(found[key][0] == host.boards[one.instance].runs(one.event) + found[key][2] and found[key][0] == sum(found[key][1:])
                             for key, one in zip(keys, ledgers))
    try:
        until("all counts agree", agree, patience)
    except Failed:
        pass  # the counts tell
    found = until("the host tells of its events and tasks", figures)
    faults, lost, doubled, counted = [], 0, 0, 0
    for key, one in zip(keys, ledgers):
        runs, (posts, cycles, told) = host.boards[one.instance].runs(one.event), found[key]
        lost += max(0, one.acknowledged - told - runs, posts - told - runs)
        doubled += max(0, runs - one.acknowledged - one.uncertain, runs - posts)
        counted += told
        if not one.acknowledged <= posts <= one.acknowledged + one.uncertain or runs + told != posts or cycles != runs:
            faults.append(f"{one.name}: {one.acknowledged} posts acknowledged, {one.uncertain} uncertain, {posts} in the pool; {runs} runs; "
                          f"the task tells of {cycles} cycles and {told} lost events")
        faults += [f"{one.name}: {fault}" for fault in one.faults[:TOLD]]
        one.faults.clear()
    return {"posts": sum(one.acknowledged for one in ledgers), "posts_uncertain": sum(one.uncertain for one in ledgers), "events_lost": lost,
            "events_told_as_lost": counted, "events_doubled": doubled, "faults": faults}


class Operator(threading.Thread):
    """Gives commands, and knows what each has led to: an event of an instance is registered and unregistered by turns."""

    def __init__(self, host, instance):
        super().__init__(daemon=True)
        self.host, self.instance = host, instance
        self.client = host.new_client(timeout=10.0)
        self.between = threading.Lock()  # held while a command is under way
        self.ended = threading.Event()
        self.registered = None  # None: the last command was not answered
        self.commands = self.unanswered = 0

    def run(self):
        wanted = True
        while not self.ended.wait(0.02):
            with self.between:
                try:
                    command = self.client.register_event if wanted else self.client.unregister_event
                    command(self.host.name, f"{self.instance}/extra")
                    self.registered, wanted = wanted, not wanted
                    self.commands += 1
                except plchost_client.ClientError as error:
                    # One that was done without its answer is refused when it is repeated.
                    done = error.code == (plchost_client.ClientError.already_exists if wanted else plchost_client.ClientError.not_found)
                    self.unanswered += 0 if done else 1
                    self.registered = wanted if done else None
                    wanted = not wanted if done else wanted

    def is_forgotten(self):
        """Whether the host does not have what it has answered last."""
        with self.between:
            if self.registered is None:
                return False
            for _ in range(50):
                events = self.host.asked(lambda client: client.events()) or []
                if any(event.instance == self.instance and event.name == "extra" and event.registered for event in events) == self.registered:
                    return False
                time.sleep(0.1)
            return True

    def stop(self):
        self.ended.set()
        self.join()


class Witness:
    """How many cycles of Fast the machine has taken from a core: a bare thread above all instances has lost them there, too."""

    def __init__(self, core):
        self.process = subprocess.Popen([BIN / "core_witness", str(core), str(FAST_US)], stdin=subprocess.PIPE, stdout=subprocess.PIPE)

    def taken(self):
        self.process.stdin.write(b"\n")
        self.process.stdin.flush()
        return int(self.process.stdout.readline())

    def stop(self):
        self.process.kill()
        self.process.wait()
        self.process.stdin.close()
        self.process.stdout.close()


def can_set_priority():
    """Whether this process may have real-time threads, as witnesses and tasks are."""
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(1))
        os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
    except OSError:
        return False
    return True
