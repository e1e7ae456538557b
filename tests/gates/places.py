#!/usr/bin/env python3
"""One of each thing of PLACES, which the READMEs tell how to add, is added to a scratch copy of the tree.

It compiles, and the parts that are made from it name it. The files that were written by hand are those of the table below
"To add a ..." in its README. It must be each of them, no other, and not more than PLACES allows. Their texts are in
places.txt.

Usage: places.py [ROOT [NAME...]] (a git checkout, else this one; names of PLACES, else all of them); prints each fault.
"""

import argparse
import fnmatch
import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).resolve().parents[2]
WARNINGS = ["-Wall", "-Wextra", "-Werror"]
PLANTS = dict(re.findall(r"^=== (.*)\n((?:(?!===).*\n)*)", Path(__file__).with_suffix(".txt").read_text(encoding="utf-8"), re.MULTILINE))


class Fault(Exception):
    """Something cannot be added as the README says."""


class Scratch:
    """A copy of the tree, in which things are planted."""

    def __init__(self, root, folder):
        self.root = folder / "tree"
        self.made = folder / "made"  # by the build, from the contract
        names = self.run(["git", "ls-files", "-z", "-c", "-o", "--exclude-standard"], cwd=root).split("\0")
        for name in filter(None, names):
            if (root / name).is_file():
                (self.root / name).parent.mkdir(parents=True, exist_ok=True)
                shutil.copy(root / name, self.root / name)
        self.git("init", "-q")
        self.git("add", "-A", "-f")
        self.git("-c", "user.name=places", "-c", "user.email=places@localhost", "commit", "-q", "-m", "before")

    @staticmethod
    def run(command, **options):
        done = subprocess.run(command, capture_output=True, text=True, env=os.environ | {"LC_ALL": "C"}, **options)
        if done.returncode != 0:
            raise Fault(f"{' '.join(map(str, command[:3]))} ...:\n{done.stdout}{done.stderr}"[:4000])
        return done.stdout

    def git(self, *arguments):
        return self.run(["git", *arguments], cwd=self.root)

    def begin(self):
        self.git("reset", "-q", "--hard")
        self.git("clean", "-qfd")
        shutil.rmtree(self.made, ignore_errors=True)
        self.made.mkdir()

    def touched(self):
        lines = self.git("status", "--porcelain", "-uall").splitlines()
        return {line[3:]: line.startswith("??") for line in lines}  # file: it is new

    def plant(self, file, at, text, *, before=False, instead=False):
        """Writes a text behind `at`, which the file has once; or before it, or instead of it."""
        path = self.root / file
        old = path.read_text(encoding="utf-8")
        if old.count(at) != 1:
            raise Fault(f"{file} has {old.count(at)} times '{at}', where something is planted")
        path.write_text(old.replace(at, text if instead else text + at if before else at + text), encoding="utf-8")

    def add(self, file, text):
        (self.root / file).write_text(text, encoding="utf-8")

    def compile(self, *files, standard="c++23"):
        self.run(["g++", f"-std={standard}", *WARNINGS, "-fsyntax-only", "-I", self.root, "-isystem", self.made,
                  *(self.root / file for file in files)])

    def check(self, text, **options):
        """Compiles a text, which asserts."""
        (self.made / "check.cpp").write_text(text, encoding="utf-8")
        self.compile(self.made / "check.cpp", **options)

    def must_be_red(self, diagnostic, action):
        try:
            action()
        except Fault as fault:
            if diagnostic not in str(fault):
                raise Fault(f"'{diagnostic}' is not said, but: {fault}") from None
        else:
            raise Fault(f"nobody says '{diagnostic}'")

    def symbols(self, file, kinds):
        """The functions that the object of a file has (T, W) or needs (U)."""
        made = self.made / "object.o"
        self.run(["g++", "-std=c++23", "-c", "-I", self.root, "-o", made, self.root / file])
        return re.findall(rf"^[\da-f ]{{16}} [{kinds}] (.*)$", self.run(["nm", "-C", made]), re.MULTILINE)

    def must_make(self, function, user, maker):
        """One file needs the function, the other one has it."""
        for file, kinds in ((user, "U"), (maker, "TW")):
            if not any(function in name for name in self.symbols(file, kinds)):
                raise Fault(f"{file} has nothing of {function}")

    def must_build(self, folder, file):
        """The CMakeLists.txt of the folder finds the file."""
        plot = self.made / "cmake"
        plot.mkdir()
        functions = {name: 'message(STATUS "${ARGV}")' for name in ("plchost_library", "plchost_program")}
        functions |= dict.fromkeys(("plchost_command_line", "plchost_manual", "target_compile_definitions"), "")
        lines = [f"function({name})\n{body}\nendfunction()" for name, body in functions.items()]
        lines = ["cmake_minimum_required(VERSION 3.25)", "project(places NONE)", *lines, f"add_subdirectory({self.root / folder} built)"]
        (plot / "CMakeLists.txt").write_text("\n".join(lines), encoding="utf-8")
        if file not in self.run(["cmake", "-S", plot, "-B", plot / "build"]):
            raise Fault(f"{folder}/CMakeLists.txt does not find {file}")

    def generate(self):
        """Makes what the build makes from the contract, but for the types in C."""
        self.run([sys.executable, self.root / "api/generate/generate.py", self.root / "api/control.idl", self.made])

    def types_in_c(self):
        self.run(["idlc", "-Wno-implicit-extensibility", self.root / "api/control.idl"], cwd=self.made)

    def contract(self, action):
        return self.run([sys.executable, self.root / "api/reference.py", action])

    def documents(self):
        """Writes the tables that are made, and holds the documents against the code."""
        self.contract("--write")
        self.run([sys.executable, self.root / "tests/gates/documents.py", "--write"])
        self.run([self.root / "tests/gates/contract.sh"])


def scheduler(scratch):
    scratch.add("schedulers/policies/planted.cpp", PLANTS["policy"])
    scratch.plant("schedulers/policies/registry.hpp", "inline constexpr std::tuple kPolicies{", '\n    PolicyName<class Planted>{"Planted"},')
    yield
    scratch.check(PLANTS["policy is listed"])
    scratch.must_make("make_policy_entry<plchost::Planted>", "schedulers/policies/registry.cpp", "schedulers/policies/planted.cpp")
    scratch.must_build("schedulers", "policies/planted.cpp")


def kind_of_task(scratch):
    scratch.plant("shm/base/task_kind.hpp", "freewheeling = 3", ", planted = 4")
    scratch.plant("shm/base/task_kind.hpp", 'TaskKindTraits{.kind = TaskKind::freewheeling, .name = "freewheeling"},',
                  '\n    TaskKindTraits{.kind = TaskKind::planted, .name = "planted"},')
    scratch.add("schedulers/tasks/kinds/planted_kind.cpp", PLANTS["kind"])
    scratch.plant("instances/plc_app.h", "#define External 0x0002", "\n#define Planted 0x0004\n", before=True)
    scratch.plant("api/control.idl", "2 external (event), 3 freewheeling", ", 4 planted")
    yield
    scratch.must_make("make_kind_entry<(plchost::TaskKind)4>", "schedulers/tasks/task_kind.cpp", "schedulers/tasks/kinds/planted_kind.cpp")
    scratch.must_build("schedulers", "tasks/kinds/planted_kind.cpp")
    scratch.check(PLANTS["application with a task of the kind"], standard="c++17")
    scratch.generate()
    scratch.check(PLANTS["kind has its word"])
    scratch.documents()


def command(scratch):
    scratch.plant("shm/operations/operations.def", "// Only the manager asks for these.", PLANTS["operation"], before=True)
    scratch.plant("instances/runtime/instance/instance_control.cpp", "static constexpr std::array kOwn = {", PLANTS["function of the operation"])
    yield
    scratch.must_be_red("control.idl is not up to date", lambda: scratch.contract("--check"))
    scratch.documents()
    scratch.generate()
    scratch.check(PLANTS["operation is in the contract"])
    scratch.types_in_c()
    scratch.compile("instances/runtime/instance/instance_control.cpp", "api/cli/verbs/command_verbs.cpp", "api/cli/verbs/host_commands.cpp")


def histogram(scratch):
    scratch.plant("shm/base/task_statistics.hpp", "  count,\n};", "  planted,\n", before=True)
    scratch.plant("shm/pages/instance_page.cpp", ".version = 14}", ".version = 15}", instead=True)
    scratch.plant("schedulers/tasks/task_recorder.cpp", "statistics_[TaskHistogram::execution].record(cycle.end - cycle.start);",
                  "\n    statistics_[TaskHistogram::planted].record(cycle.spun);")
    jitter, planted = "DurationHistogram jitter_positive_histogram;  // and of the rest", "\n    DurationHistogram planted_histogram;  // of plants"
    scratch.plant("api/control.idl", jitter, planted)
    scratch.must_be_red("type TaskStatistics", lambda: scratch.run([scratch.root / "tests/gates/contract.sh"]))
    scratch.plant("tests/integration/contract/control_v1.idl", jitter, planted)
    scratch.plant("api/server/status/statistics_writer.cpp", "  histograms.put(sample.latency_histogram, latency);",
                  "\n  histograms.put(sample.planted_histogram, digest_of(TaskHistogram::planted, 0, 1'000));")
    yield
    scratch.documents()
    scratch.types_in_c()
    scratch.generate()
    scratch.check(PLANTS["histogram has its parts"])
    scratch.compile("shm/pages/instance_page.cpp", "schedulers/tasks/task_recorder.cpp", "api/server/status/statistics_writer.cpp",
                    "api/client/statistics_cache.cpp", "api/cli/rows/statistics_rows.cpp")


def status_topic(scratch):
    scratch.plant("api/control.idl", "  // An object of the pool, with all that is known of it.", PLANTS["topic"], before=True)
    scratch.plant("api/server/status/status_publisher.cpp", "  running_ = 0;\n", PLANTS["samples of the topic"])
    yield
    scratch.documents()
    scratch.types_in_c()
    scratch.generate()
    scratch.check(PLANTS["topic has its parts"])
    scratch.compile("api/server/status/status_publisher.cpp")
    scratch.add("api/server/status/planted_watch.cpp", "// a class of its own")
    scratch.must_build("api/server", "status/planted_watch.cpp")


def key(scratch):
    keys = "manager/config/config_keys.cpp"
    scratch.plant("manager/config/manager_config.hpp", "struct BlocksConfig {", "\n  bool planted = false;")
    scratch.must_be_red("each key of [blocks] has its row", lambda: scratch.compile(keys))
    scratch.plant(keys, "constexpr std::array kBlocksKeys = {",
                  '\n    blocks<&BlocksConfig::planted, TruthKey>({.name = "planted", .when = at_once, .meaning = "a plant"}),')
    yield
    scratch.compile(keys)
    scratch.must_be_red("no row for the key [blocks] planted", scratch.documents)


def setting(scratch):
    table = "instances/runtime/settings/settings_schedule.cpp"
    scratch.plant(table, "constexpr std::array kScheduleKeys = {", "\n" + PLANTS["setting"].rstrip())
    scratch.must_be_red("'planted' is not a member of 'plchost::InstanceSettings'", lambda: scratch.compile(table))
    scratch.plant("instances/runtime/settings/settings.hpp", "struct InstanceSettings {", "\n  Duration planted = std::chrono::milliseconds(7);")
    yield
    scratch.check(f'#include "{table}"\n' + PLANTS["setting has its range"])
    scratch.must_be_red("no row for the key [CmpSchedule] Planted", scratch.documents)


def type_of_pool_object(scratch):
    scratch.plant("shm/pool/pool_layout.hpp", "event = 2, mutex = 3", ", latch = 4")
    scratch.plant("shm/pool/pool_layout.hpp", "kObjectTypes = 4;", "kObjectTypes = 5;", instead=True)
    scratch.plant("shm/pool/pool_layout.hpp", "return std::uint64_t{entry.mutex.owner()}; }}", PLANTS["traits of the type"].rstrip())
    scratch.plant("shm/pool/pool_layout.hpp", "  std::atomic<std::uint32_t> reserved;", "  std::atomic<std::uint32_t> latch;", instead=True)
    scratch.plant("shm/pool/pool_layout.hpp", "kPoolVersion = 6;", "kPoolVersion = 7;", instead=True)
    scratch.add("shm/pool/shared_latch.hpp", PLANTS["class of the type"])
    scratch.add("shm/pool/shared_latch.cpp", PLANTS["source of the class"])
    scratch.plant("shm/plc_pool.h", "typedef struct plc_memory plc_memory;", PLANTS["C interface of the type"])
    scratch.plant("shm/library/plc_pool.cpp", '#include "shm/pool/object_pool.hpp"', PLANTS["C++ side of that interface"])
    scratch.plant("api/control.idl", "0 memory, 1 semaphore, 2 event, 3 mutex", ", 4 latch")
    yield
    scratch.compile("shm/library/plc_pool.cpp", "shm/pool/shared_latch.cpp")
    scratch.must_build("shm/pool", "shared_latch.cpp")
    scratch.generate()
    scratch.check(PLANTS["type has its word"])
    scratch.documents()


# README, and the most files that issue and README allow.
PLACES = {
    "scheduler": (scheduler, "schedulers/README.md", 2),
    "kind of task": (kind_of_task, "schedulers/README.md", 4),
    "command": (command, "api/README.md", 2),
    "histogram": (histogram, "api/README.md", 6),
    "status topic": (status_topic, "api/README.md", 2),
    "key": (key, "manager/configuration.md", 2),
    "setting": (setting, "instances/README.md", 2),
    "type of pool object": (type_of_pool_object, "shm/README.md", 6),
}


def rows_of_table(root, page, name):
    """The files of each row of the table: all of them are to be touched; those of a cell with "or" are alternatives."""
    text = (root / page).read_text(encoding="utf-8")
    section = re.search(rf"^## To add an? {name}\n(.*?)(?=^## |\Z)", text, re.MULTILINE | re.DOTALL)
    table = re.search(r"^\| file \| \w+ \|\n\| --- \| --- \|\n((?:\|.*\n)*)", section[1] if section else "", re.MULTILINE)
    rows = re.findall(r"^\| ([^|]*`[^|]*) \|", table[1] if table else "", re.MULTILINE)
    if not rows:
        raise Fault(f"{page}: no table of files below 'To add a {name}'")
    for cell in rows:
        files = re.findall(r"`([^`]+)`", cell)
        yield from [files] if " or " in cell else [[file] for file in files]


def is_named(file, new, name):
    """A folder stands for a new file in it."""
    return new and str(Path(file).parent) + "/" == name if name.endswith("/") else fnmatch.fnmatch(file, name)


def table_faults(root, name, touched):
    _, page, limit = PLACES[name]
    rows = list(rows_of_table(root, page, name))
    for file, new in touched.items():
        if not any(is_named(file, new, named) for row in rows for named in row):
            yield f"{page}: 'To add a {name}' does not name {file}, which has to be touched"
    for row in rows:
        if not any(is_named(file, new, named) for file, new in touched.items() for named in row):
            yield f"{page}: 'To add a {name}' names {' or '.join(row)}, which need not be touched"
    if len(touched) > limit:
        yield f"a {name} touches {len(touched)} files, at most {limit}: {', '.join(touched)}"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("root", nargs="?", type=Path, default=HERE)
    parser.add_argument("names", nargs="*", metavar="NAME")
    options = parser.parse_args()
    unknown = [name for name in options.names if name not in PLACES]
    if unknown:
        parser.error(f"no {unknown[0]!r}; there are {', '.join(PLACES)}")
    faults = []
    with tempfile.TemporaryDirectory() as folder:
        scratch = Scratch(options.root.resolve(), Path(folder))
        for name in options.names or PLACES:
            try:
                scratch.begin()
                steps = PLACES[name][0](scratch)
                next(steps)  # all that is written by hand
                faults += table_faults(scratch.root, name, scratch.touched())
                next(steps, None)
            except Fault as fault:
                faults.append(f"to add a {name}: {fault}")
    print("\n".join(faults), end="\n" if faults else "")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
