#!/usr/bin/env python3
"""Bytes are flipped in the shared pages while the host runs, and in its files while it is down."""

import mmap
import os
import re
import struct
import sys
import time

from campaign import Campaign, Failed, main, plchost_client, until
from host import HERE, PATIENCE, SHARED_MEMORY

BATCH = 100  # bytes: of each ten batches nine lie in pages, one in files
LAYOUT = HERE.parent.parent / "shm" / "pool" / "pool_layout.hpp"


class FlippedBytes(Campaign):
    """Bytes are flipped in the shared pages while the host runs, and in its files while it is down."""

    name = "flipped_bytes"
    full = 10_000
    each = BATCH
    counts_events = False  # the counts of posts lie in what is written over
    counts_traces = False  # and so do the names of what a client has made

    def fault(self, number):
        if number >= 0 and number % 10 == 9:
            self.flip_files()
            return "files"
        self.flip_pages()
        return "pages"

    def flip_pages(self):
        memories, flipped = sorted(self.host.memories()), 0
        while flipped < BATCH:
            flipped += self.flip(SHARED_MEMORY / self.chance.choice(memories))
            if flipped % 10 == 9:
                time.sleep(0.002)
        # Requests may be refused, but end.
        for question in (lambda client: client.instances(), lambda client: client.post(self.host.name, "line1/e6"), lambda client: client.objects()):
            self.ask(question)
        self.must_go_on()

    def ask(self, question):
        client = self.host.new_client(timeout=2.0)
        began = time.monotonic()
        try:
            question(client)
        except plchost_client.ClientError:
            self.more["refused_requests"] = self.more.get("refused_requests", 0) + 1
        finally:
            client.close()
        if time.monotonic() - began > PATIENCE:
            self.fail(f"a request took {time.monotonic() - began:.0f} s")

    def must_go_on(self):
        """The manager and the instances are the processes that they were, and cycles go on."""
        if self.host.manager.poll() is not None:
            raise Failed(f"the manager ended with {self.host.manager.returncode}")
        for name, pid in self.processes.items():
            if not os.path.exists(f"/proc/{pid}"):
                raise Failed(f"{name} has ended")
            before = self.host.boards[name].cycles
            until(f"cycles of {name} go on", lambda: self.host.boards[name].cycles > before)

    def flip(self, path):
        """One byte: another one, or one of its bits. In the pool mostly where lists and locks are. Whether there was one."""
        try:
            with open(path, "r+b") as file:
                size = os.fstat(file.fileno()).st_size
                if size == 0:
                    return False
                first, last = 0, size
                if path.name == self.host.pool and self.chance.random() < 0.7:
                    first, last = self.chance.choice(self.hot_parts(file))
                elif self.chance.random() < 0.5:
                    last = min(size, 4096)
                with mmap.mmap(file.fileno(), 0) as memory:
                    at = self.chance.randrange(first, min(last, size))
                    memory[at] = self.chance.randrange(256) if self.chance.random() < 0.5 else memory[at] ^ (1 << self.chance.randrange(8))
        except (OSError, ValueError):
            return False  # its process has removed it meanwhile
        return True

    hot = None

    def hot_parts(self, file):
        """Header, first clients and first references of the pool."""
        if self.hot is None:
            sizes = {name: int(size) for name, size in re.findall(r"static_assert\(sizeof\((\w+)\) == (\d+)", LAYOUT.read_text(encoding="utf-8"))}
            clients = struct.unpack("=12xIQIIII", file.read(40))[4]
            header = sizes["PoolHeader"]
            references = header + clients * sizes["ClientSlot"]
            self.hot = [(0, header), (header, header + 512), (references, references + 4096)]
        return self.hot

    def flip_files(self):
        """The host ends, and starts with damaged files. It need not use them, but an operator can start each instance."""
        self.stop_in_order()
        files, flipped = [path for path in self.host.state.rglob("*") if path.is_file()], 0
        while flipped < BATCH:
            flipped += self.flip(self.chance.choice(files))
        self.host.start_manager()
        until("the host answers", lambda: len(self.host.states()) == len(self.host.instances))
        for name in self.processes:
            def runs():
                state = self.host.states().get(name)
                if state and state.state == "running":
                    return True
                if state and state.state in ("failed", "offline", "stopped", "safe_mode", "exception"):
                    self.more["started_by_hand"] = self.more.get("started_by_hand", 0) + 1
                    self.host.asked(lambda client: client.restart(self.host.name, name))
                return False
            until(f"{name} runs with damaged files", runs)
        self.processes = self.host.until_served()

    def stop_in_order(self):
        self.stop_load()
        left = self.host.stop()
        for what in left:
            self.fail(f"after flipped bytes: {what}")
        self.hot = None

    def start_load(self):
        """None: posts would be counted in what is written over."""

    def settle(self):
        self.must_go_on()


if __name__ == "__main__":
    sys.exit(main(FlippedBytes))
