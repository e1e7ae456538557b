"""A host of its own with one instance, which runs applications and tells the values of their variables."""

import csv
import io
import os
import pathlib
import re
import signal
import subprocess
import time

HERE = pathlib.Path(__file__).resolve().parent
HOLDER = HERE.parent / "integration/system/hold_domain.py"
NAME = "proof1"


class InstanceOfProof:
    def __init__(self, programs, folder):
        self.programs, self.folder = programs, folder
        # As own_name() of tests/support makes them: the next test program removes those of a run that was killed.
        self.pool = f"plct-{os.stat('/proc/self/ns/pid').st_ino & 0xffff:x}-{os.getpid()}-proof"
        self.processes = []

    def __enter__(self):
        self.domain = os.environ.get("PLCHOST_DOMAIN")
        if not self.domain:
            self.processes.append(subprocess.Popen([HOLDER, str(os.getpid())], stdout=subprocess.PIPE, text=True))
            self.domain = self.processes[0].stdout.readline().strip()
        core = min(os.sched_getaffinity(0))
        config = self.folder / "host.toml"
        config.write_text(f'[host]\nname = "proof"\ndds_domain = {self.domain}\nrun_directory = "{self.folder}/run"\n'
                          f'state_directory = "{self.folder}/state"\npool = "{self.pool}"\ncores = [{core}]\n'
                          f'[[instance]]\nname = "{NAME}"\ncore = {core}\nshare_core = true\nautostart = false\nrestart = "never"\n',
                          encoding="utf-8")
        self.log = (self.folder / "host.log").open("w", encoding="utf-8")
        self.processes.append(subprocess.Popen([self.programs / "plchostd", "--config", config], stdout=self.log, stderr=self.log))
        for _ in range(40):
            if self.plcctl("list", "instances").returncode == 0:
                return self
            time.sleep(0.5)
        self.__exit__()
        raise RuntimeError(f"the host does not answer: {(self.folder / 'host.log').read_text(encoding='utf-8')}")

    def __exit__(self, *_):
        for process in reversed(self.processes):
            process.send_signal(signal.SIGTERM)
            process.wait(timeout=60)
        self.log.close()

    def plcctl(self, *words):
        return subprocess.run([self.programs / "plcctl", "--domain", self.domain, "--timeout", "20", *map(str, words)],
                              capture_output=True, text=True, check=False, timeout=120)

    def samples(self, application, variables, seconds):
        """Of a run of that time: {name in lower case: its elements}, each of one moment between two cycles; or None, and why not."""
        for words in (("load", "application", NAME, application), ("start", "instance", NAME), ("wait", "instance", NAME)):
            for _ in range(3):  # a machine with much other load may take too long for the trial of an application
                done = self.plcctl(*words)
                if done.returncode == 0:
                    break
            else:
                return None, f"{words[0]}: {(done.stderr + done.stdout).strip()}"
        done = self.plcctl("record", "variables", NAME, *variables, "--interval", "0.01", "--duration", seconds)
        state = self.plcctl("list", "instances", "--columns", "state,problem", "-o", "csv").stdout
        stopped = self.plcctl("stop", "instance", NAME)
        if done.returncode != 0 or "running" not in state or stopped.returncode != 0:
            return None, f"it does not run: {state} {done.stderr} {stopped.stderr}".replace("\n", " ")
        names, *lines = csv.reader(io.StringIO(done.stdout))
        return [{name.lower(): values_of(value) for name, value in zip(names[1:-1], line[1:-1])} for line in lines], ""


def values_of(text):
    """The elements of a variable, as plcctl shows it; None: of a type that is not compared."""
    if text.startswith("["):
        return [value_of(part) for part in re.findall(r"'(?:\$.|[^'$])*'|[^\[\], ]+", text)]
    return [value_of(text)]


def value_of(text):
    if text in ("TRUE", "FALSE"):
        return text == "TRUE"
    if text.startswith("'"):
        plain = re.sub(r"\$([0-9A-Fa-f]{2})", lambda code: chr(int(code[1], 16)), text[1:-1])
        return re.sub(r"\$([LNPRT$'])", lambda sign: {"L": "\n", "N": "\n", "P": "\f", "R": "\r", "T": "\t"}.get(sign[1], sign[1]), plain)
    if text.startswith("16#"):
        return int(text[3:], 16)
    try:
        return float(text) if re.search(r"[.en]", text) else int(text)
    except ValueError:
        return None
