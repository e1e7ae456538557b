#!/usr/bin/env python3
"""The disk of the state and the shared memory fill up by turns, and are freed again."""

import errno
import os
import pathlib
import signal
import subprocess
import sys
import tempfile
import time

from campaign import CORES, Campaign, Failed, Host, Instance, Skipped, main, plchost_client, until
from host import SHARED_MEMORY

STATE_MIB = 4
SHARED_MEMORY_MIB = 96
SPACE = "PLC_CAMPAIGN_SPACE"  # in the environment: the process has mounts of its own


def mount(folder, mebibytes):
    said = subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={mebibytes}m", "plchost-campaign", folder], check=False, capture_output=True, text=True)
    if said.returncode:
        raise Skipped(f"no disk can be mounted: {said.stderr.strip()}")


def fill(folder):
    """The file that takes the rest of a disk."""
    path = pathlib.Path(folder) / "filler"
    with open(path, "wb") as file:
        try:
            while True:
                os.write(file.fileno(), bytes(4096))
        except OSError as error:
            if error.errno != errno.ENOSPC:
                raise
    return path


class FullDisks(Campaign):
    """The disk of the state and the shared memory fill up by turns, and are freed again."""

    name = "full_disks"
    full = 100

    def faulty_instances(self):
        return [Instance("line3", CORES[-1], keys=["restart_delay_ms = 50", "crash_limit = 100", "crash_window_s = 1"])]

    def make_host(self):
        mount(SHARED_MEMORY, SHARED_MEMORY_MIB)
        self.disk = pathlib.Path(tempfile.mkdtemp(prefix="plct-disk."))
        mount(self.disk, STATE_MIB)
        return Host([*self.steady, *self.faulty], state=self.disk / "state")

    def begin(self):
        self.host.client.register_event(self.host.name, "line2/kept")  # so that the files for registered events are there already
        self.host.client.register_event(self.host.name, "line2/extra")
        self.registered, self.refused, self.answered = True, 0, 0

    def fault(self, number):
        if number % 2:
            self.fill_state()
        else:
            self.fill_shared_memory()

    def fill_state(self):
        """Commands are answered, one way or the other. When the disk is free, all is told to be well, and what was answered holds."""
        filler = fill(self.disk)
        try:
            end = time.monotonic() + self.chance.uniform(0.2, 1.5)
            while time.monotonic() < end:
                self.command()
        finally:
            filler.unlink()
        self.command()
        until("the host tells that all is recorded", self.is_recorded)

    def command(self):
        command = self.host.client.unregister_event if self.registered else self.host.client.register_event
        began = time.monotonic()
        try:
            command(self.host.name, "line2/extra")
            self.registered = not self.registered
            self.answered += 1
        except plchost_client.ClientError as error:
            if error.code == plchost_client.ClientError.timed_out:
                self.fail(f"a command was not answered in {time.monotonic() - began:.1f} s: {error}")
            self.refused += 1

    def is_recorded(self):
        hosts = self.host.asked(lambda client: client.hosts())
        return hosts and not hosts[0].unrecorded and not hosts[0].unsaved

    def fill_shared_memory(self):
        """An instance that ends meanwhile starts again when there is room, by itself or by a command."""
        before = until("line3 runs", lambda: self.running("line3"))
        filler = fill(SHARED_MEMORY)
        try:
            os.kill(before.pid, signal.SIGKILL)
            time.sleep(self.chance.uniform(0.1, 1.0))
        finally:
            filler.unlink()
        state = until("line3 runs again, or has failed", lambda: self.running("line3", before.pid) or self.failed("line3"))
        if state.state == "failed":
            self.fail(f"line3 failed for want of shared memory, which is a matter of time: {state.problem}")
            self.host.client.restart(self.host.name, "line3")
            until("line3 runs again", lambda: self.running("line3", before.pid))

    def running(self, name, other_than=0):
        state = self.host.states().get(name)
        return state if state and state.state == "running" and state.pid != other_than else None

    def failed(self, name):
        state = self.host.states().get(name)
        return state if state and state.state == "failed" else None

    def settle(self):
        self.more.update(commands=self.answered, commands_refused=self.refused)
        states = self.host.until_served()
        for name in ("line1", "line2"):
            if states[name] != self.processes[name]:
                self.fail(f"{name} is another process")

    def end(self):
        """The next manager knows all that the host has answered."""
        self.host.kill_manager()
        self.host.start_manager()
        self.host.until_served()

        def holds():
            events = self.host.asked(lambda client: client.events()) or []
            return any(event.name == "extra" and event.registered for event in events) == self.registered
        try:
            until("the host has what it answered", holds, 5)
        except Failed as failed:
            self.fail(str(failed))

    def remove(self):
        super().remove()
        if getattr(self, "disk", None):
            subprocess.run(["umount", self.disk], check=False)
            self.disk.rmdir()
        subprocess.run(["umount", SHARED_MEMORY], check=False)


if __name__ == "__main__":
    if SPACE not in os.environ:
        # As root it has mounts of its own, which end with it.
        alone = ["unshare", "--mount", "--propagation", "private"]
        if subprocess.run([*alone, "true"], check=False, capture_output=True).returncode:
            print("skipped: full_disks: this process may have no mounts of its own (it needs CAP_SYS_ADMIN)")
            sys.exit(77)
        os.environ[SPACE] = "1"
        os.execvp(alone[0], [*alone, sys.executable, *sys.argv])
    sys.exit(main(FullDisks))
