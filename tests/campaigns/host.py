"""A host of a campaign: its configuration, its processes, a client of it, and the traces that it leaves on the machine."""

import collections
import ctypes
import mmap
import os
import pathlib
import resource
import shutil
import signal
import struct
import subprocess
import sys
import tempfile
import time

HERE = pathlib.Path(__file__).resolve().parent
BUILD = HERE.parent.parent / ".build" / "tests"
BIN = pathlib.Path(os.environ.get("BIN", BUILD / "bin"))
APPLICATIONS = pathlib.Path(os.environ.get("APPLICATIONS", BUILD / "applications"))
SHARED_MEMORY = pathlib.Path("/dev/shm")
CORES = sorted(os.sched_getaffinity(0))
FAST_US = 2000  # interval of the task Fast of counting_line
ROLES = {"plchostd": "manager", "plchost-dds": "API server", "plc-instance": "instance"}
PATIENCE = 30  # s: for what takes less than a second on a machine that does nothing else

sys.path.insert(0, str(BIN.parent / "python"))
import plchost_client  # noqa: E402  before any other module that loads libddsc


class Failed(Exception):
    """A campaign that cannot go on."""


class Skipped(Exception):
    """A campaign that cannot run here."""


def until(what, condition, seconds=PATIENCE):
    """The first result of `condition` that counts as true."""
    end = time.monotonic() + seconds
    while True:
        began = time.monotonic()
        result = condition()
        if result:
            return result
        if began > end:
            raise Failed(f"did not happen in {seconds} s: {what}")
        time.sleep(min(1.0, max(0.01, time.monotonic() - began)))


def read(path):
    try:
        return pathlib.Path(path).read_bytes()
    except OSError:
        return b""


class Board:
    """The counts of an instance, as its application writes them (counting_line.cpp)."""

    FIELDS = {"starts": 0, "cycles": 1, "lost": 2, "longest": 3}
    RUNS, OTHERS, WORDS = 8, 16, 56

    def __init__(self, path):
        path.write_bytes(bytes(8 * self.WORDS))
        path.chmod(0o666)
        with open(path, "r+b") as file:
            self.memory = mmap.mmap(file.fileno(), 8 * self.WORDS)

    def word(self, at):
        return struct.unpack_from("<Q", self.memory, 8 * at)[0]

    def __getattr__(self, name):
        return self.word(self.FIELDS[name])

    def runs(self, event):
        return self.word(self.RUNS + event)

    def other_cycles(self):
        return sum(self.word(at) for at in range(self.OTHERS, self.WORDS))


class Instance:
    """A line of the configuration."""

    def __init__(self, name, core, application="counting_line", settings=(), keys=()):
        self.name, self.core, self.application, self.settings, self.keys = name, core, application, list(settings), list(keys)


class Host:
    """A manager with its instances, in a folder and under a name of its own. `wrapped`: words before the manager's program, as "ip netns exec", which it takes the place of."""

    def __init__(self, instances, name="cell", dds=(), keys=(), wrapped=(), state=None, client_interfaces=("lo",)):
        space = os.stat("/proc/self/ns/pid").st_ino & 0xffff
        # As own_name() makes them: the next test program removes the files of a campaign that was killed.
        self.pool = f"plct-{space:x}-{os.getpid()}-{name}"
        self.cell = pathlib.Path(tempfile.mkdtemp(prefix=self.pool + "."))
        self.cell.chmod(0o755)
        self.name, self.instances, self.wrapped = name, instances, list(wrapped)
        self.state = state or self.cell / "state"
        self.run = self.cell / "run"
        self.log = self.cell / "host.log"
        self.boards = {one.name: Board(self.cell / f"{one.name}.board") for one in instances}
        self.manager = None
        self.client_interfaces = list(client_interfaces)
        resource.setrlimit(resource.RLIMIT_CORE, (0, resource.getrlimit(resource.RLIMIT_CORE)[1]))  # of those that are made to crash
        self.holder = subprocess.Popen([HERE.parent / "integration" / "system" / "hold_domain.py", str(os.getpid())], stdout=subprocess.PIPE)
        domain = self.holder.stdout.readline()
        if not domain:
            raise Failed("no DDS domain is free")
        self.domain = int(domain)
        self.client_ = None
        self.write(dds, keys)

    def write(self, dds, keys):
        lines = ["[host]", f'name = "{self.name}"', f"dds_domain = {self.domain}", f'run_directory = "{self.run}"',
                 f'state_directory = "{self.state}"', f'pool = "{self.pool}"', f"cores = {CORES}", *keys, "[dds]", *dds]
        for one in self.instances:
            lines += ["[[instance]]", f'name = "{one.name}"', f"core = {one.core}", "share_core = true",
                      f'application = "{APPLICATIONS / one.application}.so"', "restart_delay_max_ms = 200", *one.keys]
            settings = self.cell / f"{one.name}.cfg"
            # So that both files of retain variables are there after 200 ms.
            settings.write_text("\n".join(["[Retain]", "IntervalMs=100", *one.settings]) + "\n", encoding="utf-8")
            lines.append(f'settings = "{settings}"')
        self.configuration = self.cell / "host.toml"
        self.configuration.write_text("\n".join(lines) + "\n", encoding="utf-8")

    # ---- Its processes

    def start_manager(self):
        with open(self.log, "ab") as log:
            self.manager = subprocess.Popen([*self.wrapped, BIN / "plchostd", "--config", self.configuration], stdin=subprocess.DEVNULL,
                                            stderr=log, env={**os.environ, "PLC_CAMPAIGN": str(self.cell)})

    def kill_manager(self):
        self.manager.kill()
        self.manager.wait()

    def processes(self):
        """Those of this host: number and role. Its folder stands in the command line of each."""
        mark, found = f"{self.cell}/".encode(), {}
        for entry in os.scandir("/proc"):
            if not entry.name.isdigit() or int(entry.name) == os.getpid():
                continue
            words = read(f"/proc/{entry.name}/cmdline")
            if mark in words:
                found[int(entry.name)] = ROLES.get(os.path.basename(words.split(b"\0")[0].decode(errors="replace")), "other")
        return found

    def server(self):
        """The number of plchost-dds; None: there is none."""
        return next((pid for pid, role in self.processes().items() if role == "API server"), None)

    # ---- As a client sees it

    @property
    def client(self):
        if self.client_ is None:
            self.client_ = self.new_client(timeout=20.0)
        return self.client_

    def new_client(self, timeout):
        return plchost_client.Client(domain=self.domain, interfaces=self.client_interfaces, host=self.name, timeout=timeout)

    def plcctl(self, *words, timeout=20):
        interfaces = [word for name in self.client_interfaces for word in ("--interface", name)]
        return subprocess.run([BIN / "plcctl", "--domain", str(self.domain), *interfaces, "--timeout", str(timeout), *words], check=False,
                              capture_output=True, text=True, stdin=subprocess.DEVNULL)

    def asked(self, question):
        """The answer of a client; nothing while the host does not answer."""
        try:
            return question(self.client)
        except plchost_client.ClientError:
            return None

    def states(self):
        return {one.name: one for one in self.asked(lambda client: client.instances()) or []}

    def until_served(self, processes=None):
        """Until this manager tells of all instances that they run. `processes`: by name, the only ones that they may be."""
        def is_served():
            if self.manager.poll() is not None:
                raise Failed(f"the manager ended with {self.manager.returncode}")
            hosts = self.asked(lambda client: client.hosts())
            if not hosts or hosts[0].manager_pid != self.manager.pid:
                return False
            states = self.states()
            return all(one.name in states and states[one.name].state == "running" for one in self.instances) and states
        states = until("each instance runs, as the host tells", is_served, 2 * PATIENCE)
        found = {name: one.pid for name, one in states.items()}
        if processes is not None and found != processes:
            raise Failed(f"the instances were the processes {processes}, and are {found}")
        return found

    def until_answered(self):
        """Until this manager and its API server answer, whatever the instances do."""
        def is_answered():
            hosts = self.asked(lambda client: client.hosts())
            return hosts and hosts[0].answers and hosts[0].manager_pid == self.manager.pid and self.asked(lambda client: client.read_clock()) is not None
        until("the host answers", is_answered, 2 * PATIENCE)

    def start(self):
        self.start_manager()
        return self.until_served()

    def stop(self):
        """In order. All that is left: a text each."""
        self.manager.terminate()
        try:
            code = self.manager.wait(2 * PATIENCE)
        except subprocess.TimeoutExpired:
            return ["the manager has not ended"]
        left = [] if code == 0 else [f"the manager ended with {code}"]
        try:
            until("the API server ends", lambda: not self.processes(), 5)
        except Failed:
            left += [f"process {pid}: {role}" for pid, role in self.processes().items()]
        left += [f"shared memory {name}" for name in sorted(self.memories())]
        return left + [f"file {path.name}" for path in sorted(self.run.glob("*")) if path.suffix not in (".exception", ".lock")]

    def remove(self):
        """All that the campaign has made, whatever state it is in."""
        if self.client_ is not None:
            self.client_.close()
        for pid in self.processes():
            try:
                os.kill(pid, signal.SIGKILL)
            except ProcessLookupError:
                pass
        if self.manager is not None:
            self.manager.wait()
        self.holder.kill()
        self.holder.wait()
        for name in self.memories():
            (SHARED_MEMORY / name).unlink(missing_ok=True)
        shutil.rmtree(self.cell, ignore_errors=True)

    # ---- Its traces

    def memories(self):
        return {name for name in os.listdir(SHARED_MEMORY) if name == self.pool or name.startswith((self.pool + ".", self.pool + "-"))}

    def traces(self):
        """Processes, descriptors, threads and resident KiB by role; names of shared memories and files."""
        found = collections.defaultdict(collections.Counter)
        for pid, role in self.processes().items():
            try:
                found["descriptors"][role] += len(os.listdir(f"/proc/{pid}/fd"))
                threads = len(os.listdir(f"/proc/{pid}/task"))
            except OSError:
                continue  # it has ended meanwhile
            found["threads"][role] += threads
            found["processes"][role] += 1
            found["resident_kib"][role] += next((int(line.split()[1]) for line in read(f"/proc/{pid}/status").decode().splitlines()
                                                 if line.startswith("VmRSS:")), 0)
        found["shared_memory"] = collections.Counter(self.memories())
        for folder in (self.run, self.state):
            # The last exceptions of an instance and the log of changes are kept for people, and have bounds of their own.
            found["files"] += collections.Counter(str(path.relative_to(folder)) for path in folder.rglob("*")
                                                  if path.suffix not in (".exception", ".exceptions")
                                                  and not path.name.startswith("exceptions.")
                                                  and not path.parent.name.startswith("audit."))
        return found


def left_between(before, after, kinds=("processes", "descriptors", "threads", "shared_memory", "files")):
    """Traces that were not there before: by kind, how many, and in words."""
    counts, words = {}, []
    for kind in kinds:
        more = after[kind] - before[kind]
        counts[kind] = sum(more.values())
        words += [f"{kind}: {count} more ({name})" for name, count in sorted(more.items())]
    return counts, words


def end_with_parent():
    """Of a child of a campaign, between fork and exec."""
    ctypes.CDLL(None).prctl(1, signal.SIGKILL)
