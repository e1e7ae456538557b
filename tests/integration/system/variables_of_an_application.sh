#!/usr/bin/env bash
# The variables of a running program, from anywhere: seen, written, forced, watched and recorded, with each process of the
# host but the instance killed in between.
. "$(dirname "$0")/common.sh"

write_host cell $(seq "$first_core" "$last_core")
write_instance cell line1 "$first_core" line_variables 'share_core = true'
write_instance cell line2 "$first_core" task_faults 'share_core = true'
cp "$cell/cell.toml" "$cell/two.toml"
write_instance cell line3 "$first_core" line_variables 'share_core = true' 'restart = "never"'
start_manager cell
until_true 20 state_is line1 running

value() { asked plcctl read variable line1 "$1" --json | jq -r '.[0].value'; }
field() { asked plcctl list variables line1 "$1" --json | jq -r ".[0].$2"; }
forces() { asked plcctl list forces --json | jq -r 'map("\(.instance) \(.name)=\(.forced_value)") | join(" ")'; }

echo "- seen: names, types, tasks, values"
is "$(asked plcctl list variables line1 --json | jq -r 'map(.name) | join(" ")')" \
  "fast.count fast.twice grid[][] line.label line.setpoint line.stopped line.total" || fail "$(plcctl list variables line1)"
is "$(field fast.count type),$(field fast.count task)" "DINT,Fast" || fail "$(plcctl list variables line1)"
is "$(field grid type)" "ARRAY [1..2, 0..2] OF INT" || fail "$(plcctl list variables line1 grid)"
is "$(value 'grid[2,1]')" 21 || fail "$(plcctl list variables line1 grid)"
is "$(value line.LABEL)" "'press'" || fail "$(value line.label)"
refused "no variable 'line.totel'" plcctl read variable line1 line.totel
refused "'line7'" plcctl list variables line7
refused "no variable of 'line1' is like lane.*" plcctl list variables line1 'lane.*'
refused "no variable of 'line1' is like grid[*]" plcctl list variables line1 'grid[*]'
is "$(asked plcctl list variables line1 'grid[*,*]' --json | jq length)" 6 || fail "$(plcctl list variables line1 'grid[*,*]')"
refused "no variable of 'line1' is like lane.*" plcctl read variable line1 'lane.*'
refused "no variable of 'line1' is like lane.*" plcctl watch variables line1 'lane.*'
refused "no variable of 'line1' is like lane.*" plcctl record variables line1 'lane.*' --duration 0.1

echo "- two variables that a task changes together are never seen apart"
for _ in $(seq 50); do
  asked plcctl read variable line1 fast.count fast.twice --json |
    jq -e '(.[0].value | tonumber) * 2 == (.[1].value | tonumber)' >/dev/null || fail "two values of different cycles"
done

echo "- written: once, between two cycles"
plcctl write variable line1 line.setpoint=40
follows() { is "$(value line.total)" "$1"; }
until_true 10 follows 41
refused "-32768 to 32767" plcctl write variable line1 line.setpoint=40000
refused "declared it as read-only" plcctl write variable line1 line.stopped=TRUE
is "$(value line.setpoint)" 40 || fail "a refused value was written: $(value line.setpoint)"

echo "- forced: the program's own value does not count"
plcctl force variable line1 line.total=7 'grid[1,1]=99'
is "$(forces)" "line1 grid[1,1]=99 line1 line.total=7" || fail "$(plcctl list forces)"
is "$(value line.total)" 7 || fail "$(value line.total)"
told() { instance line1 problem | grep -q '2 variables are forced'; }
until_true 10 told

echo "- the API server and the manager are killed: still forced"
kill -KILL "$(pgrep -P "${managers[0]}" -x plchost-dds)"
until_true 20 follows 7
kill -KILL "${managers[0]}"
wait "${managers[0]}" 2>/dev/null || true
start_manager cell
until_true 20 state_is line1 running
is "$(forces)" "line1 grid[1,1]=99 line1 line.total=7" || fail "$(plcctl list forces)"
is "$(field line.total forced),$(field line.total forced_value),$(field line.setpoint forced)" "true,7,false" || fail "$(plcctl list variables line1)"
is "$(asked plcctl read variable line1 line.total line.setpoint --json | jq -r 'map("\(.forced) \(.forced_value)") | join(",")')" "false null,true 7" ||
  fail "$(plcctl read variable line1 line.total line.setpoint --json)"
asked plcctl read variable line1 line.total | grep -Eq '^line\.total +7 +7$' || fail "$(plcctl read variable line1 line.total)"
asked plcctl read variable line1 grid | grep -Eq '^grid.* elements$' || fail "$(plcctl read variable line1 grid)"
is "$(asked plcctl read variable line1 grid --json | jq -r '"\(.[0].forced) \(.[0].forced_value)"')" "true null" || fail "a forced array in JSON"
is "$(asked plcctl record variables line1 line.total line.setpoint --duration 0.05 | awk -F, 'NR > 1 { print $NF; exit }')" line.total || fail "a recording does not say what is forced"
asked plcctl watch variables line1 line.total --count 1 | grep -q '  forced$' || fail "watch does not say that it is forced"
is "$(asked plcctl watch variables line1 line.total --count 1 --json | jq -r .forced)" true || fail "watch --json"
is "$(instance line1 forces)" 2 || fail "$(instance line1 forces)"

echo "- unforced: the program goes on with its own"
plcctl unforce variable line1 line.total
until_true 10 follows 41
is "$(forces)" "line1 grid[1,1]=99" || fail "$(plcctl list forces)"
plcctl unforce variable line1 --all
is "$(forces)" "" || fail "$(plcctl list forces)"
refused "is not forced" plcctl unforce variable line1 line.total

echo "- watched and recorded"
plcctl watch variables line1 fast.count --interval 0.02 --count 5 --json >"$cell/watched.txt"
is "$(jq -r .value "$cell/watched.txt" | sort -n | uniq | wc -l)" 5 || fail "$(cat "$cell/watched.txt")"
plcctl record variables line1 'fast.*' line.label --interval 0.02 --duration 5 --file "$cell/record.csv"
is "$(head -n 1 "$cell/record.csv")" "time,time_unix_ns,consistent,fast.count,fast.twice,line.label,forced" || fail "$(head -n 3 "$cell/record.csv")"
[ "$(wc -l <"$cell/record.csv")" -gt 5 ] || fail "$(cat "$cell/record.csv")"
awk -F, 'NR > 1 && $4 * 2 != $5 { exit 1 }' "$cell/record.csv" || fail "two values of different cycles: $(cat "$cell/record.csv")"

echo "- a command that goes on until Ctrl-C ends when its output cannot be written, and says so"
for endless in "watch variables line1 fast.count" "watch tasks line1" "logs line1 -f"; do
  code=0
  said=$(timeout 120 "$BIN/plcctl" $endless 2>&1 >/dev/full) || code=$?
  [ "$code" -eq 1 ] && grep -q 'cannot write the output' <<<"$said" || fail "$endless: exit code $code: $said"
done

echo "- a recording that finds no more room ends with a whole line, and says so"
code=0
said=$(trap '' XFSZ; ulimit -f 2; "$BIN/plcctl" --timeout 10 record variables line1 'fast.*' line.label --interval 0.01 --file "$cell/full.csv" 2>&1) || code=$?
[ "$code" -eq 1 ] && grep -q 'cannot write the recording, which ends after [0-9]* samples' <<<"$said" || fail "exit code $code: $said"
awk -F, 'NF != 7 { exit 1 }' "$cell/full.csv" && is "$(tail -c 1 "$cell/full.csv" | wc -l)" 1 || fail "the last line is not whole: $(tail -n 2 "$cell/full.csv")"

echo "- a recording ends in time, and says that the host was silent then"
plcctl record variables line1 line.total --interval 0.02 --duration 6 --file "$cell/silent.csv" 2>"$cell/silent.txt" &
recorder=$!
until_true 10 test -s "$cell/silent.csv"
server=$(pgrep -P "${managers[-1]}" -x plchost-dds)
kill -STOP "$server"
code=0
wait "$recorder" || code=$?
kill -CONT "$server"
is "$code" 3 || fail "exit code $code of a recording: $(cat "$cell/silent.txt")"
until_true 20 state_is line1 running

echo "- a command that its process has not begun before the answer is never carried out"
stopped=$(instance line1 pid)
kill -STOP "$stopped"
refused "it is in exception now" plcctl force variable line1 line.total=9
kill -CONT "$stopped"
until_true 20 state_is line1 running
is "$(forces)" "" || fail "a force that was refused holds: $(plcctl list forces)"

echo "- a reset ends forces, and says so"
plcctl force variable line1 line.total=7
is "$(plcctl reset instance line1)" "line1: reset, and stopped; 1 force ended" || fail "the answer of a reset"
is "$(forces)" "" || fail "$(plcctl list forces)"
plcctl start instance line1
until_true 10 follows 21
plcctl logs line1 | grep -q '1 force ended, because' || fail "$(plcctl logs line1)"
plcctl force variable line1 line.total=7 'grid[1,1]=99'
kill -KILL "$(instance line1 pid)"
ended() { instance line1 problem | grep -q '; 2 forces ended'; }
until_true 20 ended
until_true 20 follows 21
is "$(forces)" "" || fail "$(plcctl list forces)"

echo "- forces that end while no manager runs are told by the next one"
plcctl force variable line1 line.total=7
pid=$(instance line1 pid)
kill -KILL "${managers[-1]}"
wait "${managers[-1]}" 2>/dev/null || true
kill -KILL "$pid"
start_manager cell
unwatched() { instance line1 problem | grep -q 'ended while no manager ran; 1 force ended'; }
until_true 20 unwatched
until_true 20 follows 21

echo "- an instance that stands still answers no longer, the others do"
pid=$(instance line1 pid)
kill -STOP "$pid"
code=0
began=${EPOCHREALTIME//[.,]/}
said=$(plcctl --timeout 2 read variable line1 line.total 2>&1) || code=$?
[ "$code" -eq 3 ] && grep -q "line1': it has not answered within" <<<"$said" || fail "exit code $code: $said"
[ $((${EPOCHREALTIME//[.,]/} - began)) -ge 1900000 ] || fail "it has not waited as long as --timeout says"
plcctl list instances >/dev/null
kill -CONT "$pid"
until_true 20 follows 21
refused "declares no variables" plcctl list variables line2

echo "- an instance that was killed, and then removed, leaves no table of its variables"
table=/dev/shm/$pool-cell.variables.line3
[ -e "$table" ] || fail "it has none"
kill -KILL "$(instance line3 pid)"
until_true 20 state_is line3 failed
[ -e "$table" ] || fail "a process that was killed leaves none any more: this test shows nothing"
cp "$cell/two.toml" "$cell/cell.toml"
plcctl reload host >/dev/null
gone() { [ ! -e "$table" ]; }
until_true 20 gone

kill -TERM "${managers[-1]}"
wait "${managers[-1]}" || fail "the manager ended with $?"
managers=()
nothing_left
