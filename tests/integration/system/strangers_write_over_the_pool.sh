#!/usr/bin/env bash
# A program with the right to write the pool writes anything anywhere in it, under a running manager and instances.
. "$(dirname "$0")/common.sh"

write_host cell $(seq "$first_core" "$last_core")
write_instance cell line1 "$first_core" bottling_line 'share_core = true'
write_instance cell line2 "$last_core" bottling_line 'share_core = true'
start_manager cell
until_true 20 state_is line1 running
until_true 20 state_is line2 running

# flip SEED: for two seconds, most of it where the lists and locks are
flip() {
  python3 - "/dev/shm/$pool-cell" "$1" <<'PYTHON'
import mmap, random, sys, time
path, seed = sys.argv[1], int(sys.argv[2])
chance = random.Random(seed)
with open(path, "r+b") as file, mmap.mmap(file.fileno(), 0) as pool:
    header, clients, references = 704, 512 * 64, 4096
    hot = [(0, header), (header, header + 512), (header + clients, header + clients + references)]
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
  # What is asked meanwhile may be refused, but ends.
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
