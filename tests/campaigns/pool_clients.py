#!/usr/bin/env python3
"""Clients of the pool are killed within their calls, while another one goes on.

pool_clients.py --nursery POOL EVENT: for each line of its input, a number, makes so many clients, kills them and answers with a line.
"""

import ctypes
import json
import mmap
import os
import random
import signal
import subprocess
import sys
import time

from campaign import Campaign, Failed, main
from host import end_with_parent
from load import load_pool_library

BATCH = 10
OBJECTS = "victim/"  # with which the names of their objects begin
BEGUN, ENDED, CONNECTED = range(3)  # posts of all clients, and whether the newest one is connected


class PoolClients(Campaign):
    """Clients of the pool are killed within their calls, while another one goes on."""

    name = "pool_clients"
    full = 10_000
    each = BATCH

    def begin(self):
        self.begun = self.ended = 0
        self.longest = 0.0
        self.nursery = subprocess.Popen([sys.executable, __file__, "--nursery", self.host.pool, "line1/e7"], stdin=subprocess.PIPE,
                                        stdout=subprocess.PIPE, text=True, preexec_fn=end_with_parent)

    def fault(self, number):
        self.nursery.stdin.write(f"{BATCH}\n")
        self.nursery.stdin.flush()
        line = self.nursery.stdout.readline()
        if not line:
            raise Failed("the client that goes on has ended")
        told = json.loads(line)
        self.begun, self.ended, self.longest = told["begun"], told["ended"], max(self.longest, told["longest_ms"])
        for what in told["faults"]:
            self.fail(what)

    def settle(self):
        # A post counts if its client was killed before it could say so.
        runs = self.host.boards["line1"].runs(7)
        for _ in range(100):
            if runs >= self.ended:
                break
            time.sleep(0.05)
            runs = self.host.boards["line1"].runs(7)
        if not self.ended <= runs <= self.begun:
            self.fail(f"line1/e7: {self.ended} to {self.begun} posts of killed clients, {runs} runs")
        objects = [one.name for one in self.host.client.objects(self.host.name, OBJECTS + "*")]
        if objects:
            self.fail(f"objects of killed clients are left: {objects[:5]} and {len(objects)} in all")
        self.more.update(posts_of_the_killed=runs, longest_call_of_another_ms=round(self.longest, 1))

    def end(self):
        self.nursery.stdin.close()
        self.nursery.wait()

    def remove(self):
        if getattr(self, "nursery", None):
            self.nursery.kill()
            self.nursery.wait()
        super().remove()


# ---- The process that makes the clients: it has one thread


def live(library, pool_name, event_name, marks, chance):
    """A client: calls of all kinds, in any order, until it is killed. Its posts are counted before and after."""
    pool, event, made = ctypes.c_void_p(), ctypes.c_void_p(), ctypes.c_void_p()
    if library.plc_pool_open(pool_name, 1, ctypes.byref(pool)) < 0 or library.plc_event_open(pool, event_name, 1, ctypes.byref(event)) < 0:
        return
    marks[CONNECTED] = 1
    while True:
        what = chance.randrange(6)
        name = f"{OBJECTS}{chance.randrange(8)}".encode()
        if what < 2:
            marks[BEGUN] += 1
            library.plc_event_post(event)
            marks[ENDED] += 1
        elif what == 2:
            library.plc_event_create(pool, name + b"e", None, ctypes.byref(made))
            if chance.random() < 0.5 and made:
                library.plc_event_close(made)
        elif what == 3:
            library.plc_semaphore_create(pool, name + b"s", 1, None, ctypes.byref(made))
        elif what == 4:
            library.plc_memory_create(pool, name + b"m", 4096, None, ctypes.byref(made))
        elif library.plc_mutex_create(pool, name + b"x", None, ctypes.byref(made)) >= 0:
            if library.plc_mutex_lock(made, 1_000_000) >= 0 and chance.random() < 0.5:
                library.plc_mutex_unlock(made)
        made.value = None


def nursery(pool_name, event_name):
    library, chance = load_pool_library(), random.Random(1)
    library.plc_semaphore_create.argtypes = [ctypes.c_void_p, ctypes.c_char_p, ctypes.c_uint, ctypes.c_void_p, ctypes.c_void_p]
    library.plc_memory_create.argtypes = [ctypes.c_void_p, ctypes.c_char_p, ctypes.c_size_t, ctypes.c_void_p, ctypes.c_void_p]
    library.plc_mutex_create.argtypes = [ctypes.c_void_p, ctypes.c_char_p, ctypes.c_void_p, ctypes.c_void_p]
    library.plc_mutex_lock.argtypes = [ctypes.c_void_p, ctypes.c_long]
    for name in ("plc_mutex_unlock", "plc_mutex_close", "plc_semaphore_close", "plc_memory_close"):
        getattr(library, name).argtypes = [ctypes.c_void_p]
    # Of ctypes, which writes a number by one store: a client is killed before it or behind it.
    marks = (ctypes.c_uint64 * 3).from_buffer(mmap.mmap(-1, 4096))
    pool = ctypes.c_void_p()
    if library.plc_pool_open(pool_name, 1, ctypes.byref(pool)) < 0:
        sys.exit(library.plc_pool_error().decode())
    for line in sys.stdin:
        faults, longest = [], 0.0
        for _ in range(int(line)):
            marks[CONNECTED] = 0
            child = os.fork()
            if child == 0:
                live(library, pool_name, event_name, marks, random.Random(chance.random()))
                os._exit(1)
            # Some are killed while they connect.
            end = time.monotonic() + (chance.uniform(0, 0.004) if chance.random() < 0.2 else 5)
            while not marks[CONNECTED] and time.monotonic() < end:
                time.sleep(0.0002)
            time.sleep(chance.uniform(0, 0.002))
            os.kill(child, signal.SIGKILL)
            if not os.WIFSIGNALED(os.waitpid(child, 0)[1]):
                faults.append("a client has ended before it was killed: it could not use the pool")
            began = time.monotonic()
            made = ctypes.c_void_p()
            result = library.plc_semaphore_create(pool, b"survivor", 1, None, ctypes.byref(made))
            if result < 0:
                faults.append(f"the client that goes on cannot make an object: {library.plc_pool_error().decode()}")
            else:
                library.plc_semaphore_close(made)
            longest = max(longest, time.monotonic() - began)
        print(json.dumps({"begun": marks[BEGUN], "ended": marks[ENDED], "longest_ms": longest * 1000, "faults": faults}), flush=True)


if __name__ == "__main__":
    if sys.argv[1:2] == ["--nursery"]:
        nursery(sys.argv[2].encode(), sys.argv[3].encode())
    else:
        sys.exit(main(PoolClients))
