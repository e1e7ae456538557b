#!/usr/bin/env bash
# A watcher of changes of state sees each of a start, stop, reset and start once and in order, also when the API server is
# killed in between. The list shows the same.
. "$(dirname "$0")/common.sh"

write_host cell "$first_core"
for name in line1 line2; do
  write_instance cell "$name" "$first_core" bottling_line 'share_core = true' 'autostart = false'
done
start_manager cell
until_true 20 state_is line1 offline
is "$(plcctl list transitions --json | jq length)" 0 || fail "transitions before anything was done: $(plcctl list transitions)"
if said=$(plcctl list transitions lime1 2>&1); then fail "a list of no instance: $said"; fi
grep -qF "no instance 'lime1' (did you mean 'line1'?)" <<<"$said" || fail "$said"

# Programs of this shell itself, not of a function: so that a signal reaches them.
"$BIN/plcctl" --timeout 20 watch transitions line1 --json >"$cell/watch.json" 2>"$cell/watch.log" &
watch=$!
"$BIN/plcctl" --timeout 20 watch transitions line1 >"$cell/watch.text" 2>>"$cell/watch.log" &
text=$!
"$BIN/plcctl" --timeout 20 watch transitions --count 13 >"$cell/watch.all" 2>>"$cell/watch.log" &
all=$!
others+=("$watch" "$text" "$all")

# seen SOURCE: "from>to" of each, in the order of their lines
seen() { jq -r "select(.of == \"$1\") | .from + \">\" + .to" "$cell/watch.json" | tr '\n' ' '; }
lines() { wc -l <"$cell/$1"; }
has_lines() { [ "$(lines watch.json)" -ge "$1" ] && [ "$(lines watch.text)" -ge "$1" ]; }
# expect COUNT APPLICATION PROCESS: so many lines in all, and these changes of state. The instance and the manager
# write them, so the order is that of each of the two.
expect() {
  until_true 20 has_lines "$1"
  is "$(seen application)" "$2" || fail "of the application: $(seen application)"
  is "$(seen process)" "$3" || fail "of the process: $(seen process)"
}

echo "- start"
plcctl start instance line1
application="none>stopped stopped>running "
process="offline>starting starting>running "
expect 4 "$application" "$process"

echo "- another instance is not shown, unless all are"
plcctl start instance line2

echo "- stop"
plcctl stop instance line1
application+="running>stopping stopping>stopped "
expect 6 "$application" "$process"

echo "- reset, and the API server is killed"
kill -KILL "$(pgrep -P "${managers[0]}" -x plchost-dds)"
until_true 20 state_is line1 stopped
plcctl reset instance line1
application+="none>stopped "
process+="stopped>stopping stopping>starting starting>stopped "
expect 10 "$application" "$process"

echo "- start"
plcctl start instance line1
application+="stopped>running "
expect 11 "$application" "$process"

echo "- each once and in order, with the numbers of the ring"
sleep 0.5  # a second one would have come by now
is "$(jq -r .sequence "$cell/watch.json" | tr '\n' ' ')" "$(seq -s' ' 1 11) " || fail "numbers: $(jq -r .sequence "$cell/watch.json")"
is "$(lines watch.text)" 11 || fail "lines: $(cat "$cell/watch.text")"
is "$(jq -r '[.of, .from, .to] | join(" ")' "$cell/watch.json")" \
  "$(awk '$2 == "cell/line1" { print $3, $4, $6 }' "$cell/watch.text")" || fail "the lines differ: $(cat "$cell/watch.text")"
is "$(jq -c '[.instance, .sequence, .of, .from, .to, .reason, .time_unix_ns]' "$cell/watch.json")" \
  "$(plcctl list transitions line1 --json | jq -c 'sort_by(.sequence) | .[] | [.instance, .sequence, .of, .from, .to, .reason, .time_unix_ns]')" ||
  fail "the list differs: $(plcctl list transitions line1)"

echo "- --count ends it, of all instances"
wait "$all" || fail "watch --count ended with $?"
is "$(lines watch.all)" 13 || fail "lines: $(cat "$cell/watch.all")"
grep -q ' cell/line2 ' "$cell/watch.all" || fail "line2 is not among all"

echo "- SIGTERM ends a watch in order"
kill -TERM "$watch" "$text"
wait "$watch" && wait "$text" || fail "a watch ended with $?"

kill -TERM "${managers[0]}"
wait "${managers[0]}" || fail "the manager ended with $?"
nothing_left
