#!/usr/bin/env bash
# Programs of others, in C++ and in Python, built with what `cmake --install` puts there.
. "$(dirname "$0")/common.sh"
source=$(cd "$(dirname "$0")/../../.." && pwd)

write_host north "$first_core"
write_instance north packer1 "$first_core" packer 'scheduler = "CmpScheduleTimer"' 'share_core = true'
write_instance north press1 "$first_core" line_variables 'share_core = true'
start_manager north
until_true 20 state_is packer1 running
until_true 20 state_is press1 running

echo "- installed: found by pkg-config and by CMake"
cmake --install "$BIN/.." --component plchost-client --prefix "$cell/usr" >"$cell/install.log" || fail "not installed"
library=$(dirname "$(find "$cell/usr" -name 'libplchost-client.so')")
export PKG_CONFIG_PATH=$library/pkgconfig LD_LIBRARY_PATH=$library
for example in hold_variable post_event; do
  # shellcheck disable=SC2046  # flags are words
  g++ -std=c++17 -Wall -Wextra -Werror "$source/api/library/examples/$example.cpp" -o "$cell/$example" \
    $(pkg-config --cflags --libs plchost-client) 2>"$cell/g++.log" || fail "not built by pkg-config: $example"
done
mkdir "$cell/project"
cat >"$cell/project/CMakeLists.txt" <<EOF
cmake_minimum_required(VERSION 3.25)
project(line CXX)
find_package(plchost-client 0.1 REQUIRED)
add_executable(watch_line $source/api/library/examples/watch_line.cpp)
target_link_libraries(watch_line plchost::plchost-client)
EOF
{ cmake -S "$cell/project" -B "$cell/project/build" -DCMAKE_PREFIX_PATH="$cell/usr" && cmake --build "$cell/project/build"; } \
  >"$cell/project.log" 2>&1 || fail "not built by CMake"

echo "- a post that is run, and one that is refused"
said=$("$cell/post_event" north packer1/product) || fail "not posted"
grep -q "^run by packer1/Product, there and back in [0-9]* us" <<<"$said" || fail "$said"
if said=$("$cell/post_event" north packer1/nothing 2>&1); then fail "posted to nothing"; fi
grep -q "packer1/nothing" <<<"$said" || fail "$said"
if said=$("$cell/post_event" north nothing 2>&1); then fail "no event"; fi
grep -q "'nothing' is not of the form INSTANCE/EVENT" <<<"$said" || fail "$said"

echo "- a variable that is held at a value, and those that are watched meanwhile"
"$cell/hold_variable" north press1 line.total 7 6 'line.*' 'fast.*' >"$cell/held.log" 2>&1 || fail "not held"
grep -q "^forced: line.total to 7" "$cell/held.log" || fail "no force: $(cat "$cell/held.log")"
grep -q "line.total=7 forced " "$cell/held.log" || fail "not watched: $(cat "$cell/held.log")"
sed -nE '/of several cycles/d; s/.*fast.count=([0-9]+) fast.twice=([0-9]+) .*/\1 \2/p' "$cell/held.log" >"$cell/pairs.txt"
awk '2 * $1 != $2 { exit 1 }' "$cell/pairs.txt" || fail "values of different cycles: $(cat "$cell/held.log")"
[ "$(wc -l <"$cell/pairs.txt")" -ge 5 ] || fail "too few samples: $(cat "$cell/held.log")"
is "$(plcctl list forces --json)" "[]" || fail "$(plcctl list forces)"
if said=$("$cell/hold_variable" north press1 line.stopped TRUE 1 'line.*' 2>&1); then fail "it is read-only"; fi
grep -q "'line.stopped': the application has declared it as read-only" <<<"$said" || fail "$said"

echo "- Python"
PYTHONPATH=$BIN/../python python3 "$source/api/library/examples/line.py" north packer1/product >"$cell/line.log" 2>&1 ||
  fail "line.py"
for line in "packer1: running under CmpScheduleTimer" "posted: 1" "a task ran" "refused with code 2: "; do
  grep -q "^$line" "$cell/line.log" || fail "'$line' is not in: $(cat "$cell/line.log")"
done

echo "- Python reads what an instance has said, and has the host read its configuration"
cat >"$cell/logs.py" <<'EOF'
import os, threading, plchost_client
with plchost_client.Client(domain=int(os.environ["PLCHOST_DOMAIN"]), timeout=20.0) as client:
    said = client.logs("north", "packer1")
    assert any(line.source == "manager" for line in said), [line.text for line in said]
    (newest,) = client.logs("north", "packer1", newest=1)  # it says a line each second
    assert newest.number >= said[-1].number, (newest.number, said[-1].number)
    assert all(line.number > said[-1].number for line in client.logs("north", "packer1", after=said[-1]))
    later = client.logs("north", "packer1", after=said[0])
    assert [line.text for line in later][: len(said) - 1] == [line.text for line in said[1:]]
    assert client.reload("north") == "nothing has changed"
    objects = client.objects("north", "packer1/*")
    assert "packer1/product" in [one.name for one in objects], [one.name for one in objects]
    assert len(client.objects()) == client.hosts()[0].objects
    assert all(node.name for node in client.nodes()) and all(route.from_node for route in client.routes())
    clock = client.read_clock()
    assert abs(clock.offset) <= clock.uncertainty, (clock.offset, clock.uncertainty)
    assert "clock_source" in [finding.id for finding in client.check_host()]
    seen, there = [], threading.Event()
    with client.watch_status("instance", "north", lambda one: (seen.append(one), there.set())):
        assert there.wait(20)
    assert seen[0]["instance"] == "packer1" and seen[0]["removed"] is False, seen
    try:
        client.logs("north", "nobody")
        raise AssertionError("there is no such instance")
    except plchost_client.ClientError as error:
        assert error.code == plchost_client.ClientError.not_found == 2, error
    try:
        client.download_application("north", "packer1", "/dev/null")
        raise AssertionError("it is no file")
    except plchost_client.ClientError as error:
        assert error.code == plchost_client.ClientError.wrong_type == 13, error
with plchost_client.Client(domain=int(os.environ["PLCHOST_DOMAIN"]), timeout=20.0, host="north") as client:
    assert client.instances()[0].name == "packer1"
    try:
        client.instances("south")
        raise AssertionError("it is for another host")
    except plchost_client.ClientError as error:
        assert error.code == 1, error
EOF
PYTHONPATH=$BIN/../python python3 "$cell/logs.py" || fail "logs and reload"

echo "- Python writes, forces and watches variables"
cat >"$cell/variables.py" <<'EOF'
import os, threading, time, plchost_client
def refused(code, call, *arguments):
    try:
        call(*arguments)
    except plchost_client.ClientError as error:
        assert error.code == code, error
        return str(error)
    raise AssertionError(f"{arguments} is not refused")
with plchost_client.Client(domain=int(os.environ["PLCHOST_DOMAIN"]), timeout=20.0) as client:
    of = ("north", "press1")
    def follows(name, value):
        end = time.monotonic() + 20
        while client.sample(*of, [name]).variables[0].value != value:
            assert time.monotonic() < end, (name, value)
    assert "20 -> 40" in client.write_variable(*of, "line.setpoint", "40")
    follows("line.total", "41")
    groups, enough, held = [], threading.Event(), threading.Event()
    def on_group(sampled):
        assert sampled, sampled.text
        groups.append((sampled.sample.consistent, [int(one.value) for one in sampled.sample.variables]))
        if len(groups) >= 10:
            enough.set()
    def on_total(sampled):
        if sampled and sampled.sample.variables[0].forced and sampled.sample.variables[0].value == "7":
            held.set()
    with client.watch_variables(*of, ["fast.count", "fast.twice"], 0.02, on_group), \
            client.watch_variables(*of, ["line.total"], 0.1, on_total):
        client.force_variable(*of, "line.total", "7")
        assert held.wait(20) and enough.wait(20), groups
    assert all(2 * count == twice for consistent, (count, twice) in groups if consistent), groups
    assert any(consistent for consistent, _ in groups), groups
    forced = [(one.host, one.instance, one.name, one.forced_value, one.type) for one in client.forces()]
    assert forced == [("north", "press1", "line.total", "7", "DINT")], forced
    assert client.forces("north", "packer1") == []
    client.unforce_variable(*of, "line.total")
    follows("line.total", "41")
    client.force_variable(*of, name="grid[1,1]", value="99")
    client.unforce_all(*of)
    assert client.forces("north") == []
    client.force_variable(*of, "grid[1,1]", "98")
    client.unforce_variable(*of, "*")
    assert client.forces("north") == []
    error = plchost_client.ClientError
    assert "did you mean" in refused(error.not_found, client.write_variable, *of, "line.totel", "1")
    refused(error.refused, client.force_variable, *of, "line.stopped", "TRUE")
    refused(error.wrong_state, client.unforce_variable, *of, "line.total")
    refused(error.invalid_argument, client.write_variable, *of, "line.total=5", "1")
    refused(error.invalid_argument, client.unforce_variable, *of, "line.*")
    refused(error.not_found, client.forces, "north", "press7")
    assert "10 to 3600000" in refused(error.invalid_argument, client.watch_variables, *of, ["fast.*"], 0.001, print)
    unknown = threading.Event()
    with client.watch_variables(*of, ["line.totel"], 0.01, lambda one: unknown.set() if one.code == error.not_found else None):
        assert unknown.wait(20)
EOF
PYTHONPATH=$BIN/../python python3 "$cell/variables.py" >"$cell/variables.log" 2>&1 || fail "variables of Python"

echo "- Python sends an application, and shows what there is"
(cat "$APPLICATIONS/packer.so" && echo "of another digest") >"$cell/other.so"
cat >"$cell/sends.py" <<'EOF'
import hashlib, os, sys, threading, time, plchost_client
file, other = sys.argv[1:]
with plchost_client.Client(domain=int(os.environ["PLCHOST_DOMAIN"]), timeout=20.0) as client:
    told = []
    client.download_application("north", "packer1", file, progress=told.append)
    assert told[-1] == os.path.getsize(file), told
    (kept,) = [one for one in client.applications("north") if one.version == 1]
    assert kept.sha256 == hashlib.sha256(open(file, "rb").read()).hexdigest(), kept.sha256
    assert kept.file_name == "packer.so" and kept.from_ and not kept.boot, (kept.file_name, kept.from_)
    outcomes, loaded = [], threading.Event()
    client.download_and_tell("north", "packer1", other, lambda outcome: (outcomes.append(outcome), loaded.set()), boot=True)
    assert client.instances("north")[0].name == "packer1"  # a download holds up no other call
    assert loaded.wait(60) and outcomes[0], outcomes
    assert [one.version for one in client.applications("north") if one.boot] == [2]
    client.rollback_application("north", "packer1")
    assert client.exceptions("north")[0].count == 0
    client.post_and_wait("north", "packer1/product")
    for _ in range(200):  # they come once a second
        figures = client.statistics("north", "packer1", "Product")
        if figures.recorded > 0:
            break
        time.sleep(0.1)
    assert 0 < figures.execution.max < 1, figures.execution.max
    assert figures.execution_histogram.total == sum(bar.count for bar in figures.execution_histogram.bars) > 0
    assert client.instances("north")[0].restart_policy in ("never", "on-failure", "always")
EOF
PYTHONPATH=$BIN/../python python3 "$cell/sends.py" "$APPLICATIONS/packer.so" "$cell/other.so" || fail "an application that Python sends"

echo "- Python records variables"
cat >"$cell/records.py" <<'EOF'
import os, signal, sys, threading, plchost_client
with plchost_client.Client(domain=int(os.environ["PLCHOST_DOMAIN"]), timeout=20.0) as client:
    of = ("north", "press1", ["fast.*", "line.label"])
    assert client.record_variables(*of, interval=0.02, count=5, file=sys.argv[1]) == 5
    written = open(sys.argv[1]).read().splitlines()
    assert len(written) == 6 and written[0].startswith("time,time_unix_ns,consistent,fast.count,"), written
    texts = []
    assert client.record_variables(*of, interval=0.01, sink=lambda lines: texts.append(lines) or len(texts) < 3) == 3
    assert "".join(texts).splitlines()[0] == written[0], texts
    assert client.record_variables(*of, duration=0.2, sink=texts.append) in range(1, 4)
    def refused(what, **how):
        try:
            client.record_variables(*of, **how)
        except plchost_client.ClientError as error:
            assert error.code == plchost_client.ClientError.invalid_argument, error
            assert what in str(error), error
            return
        raise AssertionError(f"{how} is not refused")
    refused("say the duration", file=sys.argv[1])
    refused("name the file", count=1)
    refused("a file or a sink", count=1, file=sys.argv[1], sink=texts.append)
    refused("duration -1 ms", duration=float("nan"), count=1, file=sys.argv[1])
    refused("interval 0 ms", interval=-1.0, count=1, file=sys.argv[1])
    def raises(lines):
        raise KeyError("mine")
    try:
        client.record_variables(*of, sink=raises)
        raise AssertionError("its exception is lost")
    except KeyError:
        pass
    signal.signal(signal.SIGINT, signal.default_int_handler)
    file = {"file": sys.argv[1] + ".ended", "duration": 1e6}
    for way in {"interval": 0.02, "sink": texts.append}, {"interval": 3600, "count": 2, "sink": texts.append}, {"interval": 0.02, **file}:
        threading.Timer(0.2, os.kill, (os.getpid(), signal.SIGINT)).start()
        try:
            client.record_variables(*of, **way)  # for ever, without a line of Python
            raise AssertionError("Ctrl-C is lost")
        except KeyboardInterrupt:
            pass
    ended = open(sys.argv[1] + ".ended").read().splitlines()
    assert ended[0] == written[0] and len(ended) > 1, ended
EOF
PYTHONPATH=$BIN/../python timeout 120 python3 "$cell/records.py" "$cell/record.csv" || fail "recordings of Python"
plcctl record variables press1 'fast.*' line.label --duration 0.05 --interval 0.02 --file "$cell/of_plcctl.csv"
is "$(head -n 1 "$cell/record.csv")" "$(head -n 1 "$cell/of_plcctl.csv")" || fail "the recordings of Python and plcctl differ"

echo "- Python begins watches while others end"
cat >"$cell/watches.py" <<'EOF'
import os, plchost_client
with plchost_client.Client(domain=int(os.environ["PLCHOST_DOMAIN"]), timeout=20.0) as client:
    for _ in range(300):
        client.watch_hosts(lambda host: None).stop()
        client.watch_variables("north", "press1", ["fast.*"], 0.01, lambda sampled: None).stop()
EOF
PYTHONPATH=$BIN/../python timeout 60 python3 "$cell/watches.py" >"$cell/watches.log" 2>&1 || fail "watches that begin and end: $?"

echo "- Python ends in peace while a client watches, and a callback that raises is told"
cat >"$cell/ends.py" <<'EOF'
import os, threading, plchost_client
client = plchost_client.Client(domain=int(os.environ["PLCHOST_DOMAIN"]), timeout=10.0)
client.hosts()
calls = threading.Semaphore(0)
def raises(item):
    calls.release()
    raise ValueError("mine")
watch = client.watch_tasks("", raises)
other = client.watch_hosts(print)
for _ in range(2):  # at the second call, what the first one has raised was told
    assert calls.acquire(timeout=60)
del other
EOF
for _ in $(seq 10); do
  PYTHONPATH=$BIN/../python python3 "$cell/ends.py" >"$cell/ends.log" 2>&1 || fail "it ended with $?"
done
grep -q "ValueError: mine" "$cell/ends.log" || fail "a callback has failed without a word"

echo "- watches go on when the server is killed, and when the host comes again"
"$cell/project/build/watch_line" 120 >"$cell/watch.log" 2>&1 &
watcher=$!
others+=("$watcher")
saw() { [ "$(grep -c "$1" "$cell/watch.log")" -ge "$2" ]; }
until_true 20 saw "^host north answers" 1
until_true 20 saw "^north/packer1/Product: " 1
until_true 20 saw "^north/packer1: application stopped -> running" 1
server=$(plcctl list hosts --json | jq '.[0].server_pid')
kill -STOP "$server"  # the next one is there within 0.1 s, sooner than a slow client sees that this one is gone
until_true 20 saw "^host north is silent" 1
kill -KILL "$server" || true  # or the manager has, after 10 s
until_true 20 saw "^host north answers" 2
plcctl stop instance packer1
until_true 20 saw "^north/packer1: application stopping -> stopped" 1
plcctl start instance packer1  # an instance that an operator has stopped stays so when the host comes again
kill -TERM "${managers[0]}"
wait "${managers[0]}" || fail "the manager ended with $?"
until_true 20 saw "^host north is silent" 2
before=$(grep -c "^north/packer1/Product: " "$cell/watch.log")
"$cell/post_event" north packer1/product >"$cell/late.log" 2>&1 &
late=$!
others+=("$late")
start_manager north
wait "$late" || fail "a post does not wait for its host: $(cat "$cell/late.log")"
until_true 20 saw "^host north answers" 3
until_true 20 saw "^north/packer1/Product: " $((before + 1))
kill -TERM "$watcher"
wait "$watcher" || true

kill -TERM "${managers[1]}"
wait "${managers[1]}" || fail "the manager ended with $?"
nothing_left
