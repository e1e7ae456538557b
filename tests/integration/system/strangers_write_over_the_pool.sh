#!/usr/bin/env bash
# A program with the right to write the pool writes anything anywhere in it, under a running manager and instances.
. "$(dirname "$0")/common.sh"

write_host cell $(seq "$first_core" "$last_core")
write_instance cell line1 "$first_core" bottling_line 'share_core = true'
write_instance cell line2 "$last_core" bottling_line 'share_core = true'
start_manager cell
until_true 20 state_is line1 running
until_true 20 state_is line2 running

# Where the lists and locks are: the compiler holds the sizes of the parts, and the pool says how many there are of each.
bounds=$(python3 - "/dev/shm/$pool-cell" "$(dirname "$0")/../../../shm/pool/pool_layout.hpp" <<'PYTHON'
import re, struct, sys
with open(sys.argv[2]) as file:
    sizes = {name: int(size) for name, size in re.findall(r"static_assert\(sizeof\((\w+)\) == (\d+)", file.read())}
with open(sys.argv[1], "rb") as file:
    entry, size, objects, buckets, clients, references = struct.unpack("=12xIQIIII", file.read(40))
ends, end = [], 0
for part in (sizes["PoolHeader"], clients * sizes["ClientSlot"], references * sizes["ReferenceEntry"], objects * entry, buckets * 4):
    end += part
    ends.append(end)
if entry != sizes["ObjectEntry"] or end != size:
    sys.exit(f"the pool has another layout: its parts end at {end} of {size}")
print(*ends[:3])
PYTHON
) || fail "where the parts of the pool lie is not known"

# flip SEED: for two seconds, most of it where the lists and locks are
flip() {
  python3 - "/dev/shm/$pool-cell" "$1" $bounds <<'PYTHON'
import mmap, random, sys, time
path, seed = sys.argv[1], int(sys.argv[2])
header, clients, references = map(int, sys.argv[3:])
chance = random.Random(seed)
with open(path, "r+b") as file, mmap.mmap(file.fileno(), 0) as pool:
    # The first clients and references are those in use.
    hot = [(0, header), (header, header + 512), (clients, clients + 4096)]
    end, count = time.time() + 2, 0
    while time.time() < end:
        first, last = chance.choice(hot + [(0, len(pool))])
        place = chance.randrange(first, last)
        pool[place] = chance.randrange(256) if chance.random() < 0.5 else pool[place] ^ (1 << chance.randrange(8))
        count += 1
        if count % 16 == 0:
            time.sleep(0.0003)
PYTHON
}

pids() { echo "${managers[0]} $(instance line1 pid) $(instance line2 pid)"; }
alive() { kill -0 "${managers[0]}" && pgrep -P "${managers[0]}" plc-instance >/dev/null; }
cycles() { task "$1/Fill" cycles; }
more_than() { [ "$(cycles "$1")" -gt "$2" ]; }

before=$(pids)
for seed in 1 2 3 4; do
  one=$(cycles line1)
  two=$(cycles line2)
  flip "$seed" &
  flipper=$!
  # A request meanwhile may be refused, but ends.
  while kill -0 "$flipper" 2>/dev/null; do
    plcctl list instances >/dev/null 2>&1 || true
    plcctl register event line1/new >/dev/null 2>&1 || true
    plcctl post event line1/new >/dev/null 2>&1 || true
  done
  wait "$flipper"
  alive || fail "the manager or its instances ended"
  until_true 20 more_than line1 "$one"
  until_true 20 more_than line2 "$two"
done
echo "- all are the processes that they were, and their tasks run"
is "$(pids)" "$before" || fail "before: $before, now: $(pids)"

echo "- the manager ends in order and leaves nothing; the next one starts them on a new pool"
kill -TERM "${managers[0]}"
wait "${managers[0]}" || fail "the manager ended with $?"
nothing_left
start_manager cell
until_true 20 state_is line1 running
until_true 20 state_is line2 running
kill -TERM "${managers[1]}"
wait "${managers[1]}" || fail "the manager ended with $?"
nothing_left
