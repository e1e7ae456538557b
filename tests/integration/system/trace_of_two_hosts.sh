#!/usr/bin/env bash
# The cycles of two hosts in one file for Perfetto, on the tracks of their tasks and cores. An arrow leads from a post in one
# instance to the cycle for it in another one.
. "$(dirname "$0")/common.sh"

write_host south "$first_core"
write_instance south packer1 "$first_core" packer 'share_core = true'
write_instance south feeder "$first_core" feeding 'share_core = true' 'after = ["packer1"]'
write_host north "$last_core"
write_instance north line1 "$last_core" losses 'share_core = true'
write_instance north line2 "$last_core" losses 'share_core = true' 'autostart = false'
for host in south north; do start_manager "$host"; done
all_run() { [ "$(plcctl list instances --json | jq '[.[] | select(.state == "running")] | length')" = 3 ]; }
until_true 30 all_run

# record FILE ARGUMENT...: the trace, and what is in it as FILE.json
record() {
  local file=$1
  shift
  plcctl record trace "$@" -o "$file" >"$file.said" 2>"$file.errors" || fail "exit code $?: $(cat "$file.said" "$file.errors")"
  "$(dirname "$0")/trace_check.py" "$file" >"$file.json" || fail "$file cannot be right"
}
# told FILTER: of the last trace
told() { jq -r "$1" "$trace.json"; }

echo "- all instances of all hosts"
trace=$cell/all.pftrace
record "$trace" all -d 2s
cat "$trace.said" "$trace.errors"
grep -q "^plcctl: the clock of host 'north' is .* us .* this one, +-" "$trace.errors" || fail "$(cat "$trace.errors")"
grep -qE '^[0-9]+ cycles and [0-9]+ flows from a post to its cycle in ' "$trace.said" || fail "$(cat "$trace.said")"
is "$(stat -c %a "$trace")" 600 || fail "others may read it"
for track in south south/packer1/Product south/feeder/Feed "south/event packer1/product" "south/core $first_core" north/line1/Loser \
  "north/core $last_core"; do
  told '.tracks[]' | grep -qxF "$track" || fail "no track '$track': $(told '.tracks[]')"
done
[ "$(told '.counts["south/feeder/Feed"].cycle')" -ge 20 ] || fail "$(told '.counts')"
[ "$(told ".counts[\"south/core $first_core\"][\"feeder/Feed\"]")" -ge 20 ] || fail "$(told '.counts')"
[ "$(told '.counts["north/line1/Loser"].cycle')" -ge 50 ] || fail "$(told '.counts')"
[ "$(told '.flows["south/event packer1/product > south/feeder/Feed > south/packer1/Product"]')" -ge 20 ] || fail "$(told '.flows')"
is "$(told '.notes["south/packer1/Product"].event')" packer1/product || fail "$(told '.notes')"
# Both run on this machine, by one clock.
for host in south north; do
  told ".notes[\"$host\"] | .ahead_ns <= .uncertainty_ns and -.ahead_ns <= .uncertainty_ns" | grep -qx true || fail "$(told '.notes')"
done
[ "$(told '.to - .from')" -ge 1500000000 ] || fail "$(told '.to - .from') ns"

echo "- one instance, of one host, until Ctrl-C; a restart meanwhile stays on its tracks"
trace=$cell/one.pftrace
echo "the one before" >"$trace"
"$BIN/plcctl" --timeout 10 --host north record trace 'line1' -o "$trace" >"$trace.said" 2>"$trace.errors" &
recording=$!
sleep 1
is "$(cat "$trace")" "the one before" || fail "a file that is not whole has the name"
plcctl --host north restart instance line1
until_true 20 all_run
sleep 1
kill -INT "$recording"
wait "$recording" || fail "exit code $? after Ctrl-C: $(cat "$trace.errors")"
"$(dirname "$0")/trace_check.py" "$trace" >"$trace.json" || fail "$trace cannot be right"
is "$(told '.tracks[]' | grep -c '/Loser$')" 1 || fail "$(told '.tracks[]')"
[ "$(told '.counts["north/line1/runtime"].started')" -ge 1 ] || fail "$(told '.counts')"
is "$(told '.counts["north/line1/runtime"]["new process"]')" 1 || fail "$(told '.counts')"
told '.tracks[]' | grep -q south && fail "another host: $(told '.tracks[]')"

echo "- an instance that does not run has no cycles; one that is not there is refused, and no file is made"
trace=$cell/none.pftrace
record "$trace" line2 -d 300ms
is "$(told '.counts | keys | join(" ")')" north || fail "$(told '.counts')"
refused "no instance 'line3'" plcctl record trace line3 -d 1s -o "$cell/no.pftrace"
refused "is no plain file" plcctl record trace all -d 1s -o "$cell"
if said=$(plcctl record trace all -d 5x -o "$cell/no.pftrace" 2>&1); then fail "-d 5x: $said"; fi
grep -q "allowed are 5s" <<<"$said" || fail "-d 5x: $said"
[ -z "$(find "$cell" -name 'no.pftrace*')" ] || fail "a file is left: $(ls "$cell")"

for manager in "${managers[@]}"; do
  kill -TERM "$manager"
  wait "$manager" || fail "the manager ended with $?"
done
nothing_left
