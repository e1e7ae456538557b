#!/usr/bin/env bash
# An engineer finds out what a running program does: with commands, and with a client of the Debug Adapter Protocol. The
# neighbour on the same host loses no cycle by it.
. "$(dirname "$0")/common.sh"

write_host cell $(seq "$first_core" "$last_core")
write_instance cell line1 "$first_core" steps 'share_core = true'
write_instance cell line2 "$last_core" bottling_line 'share_core = true'
start_manager cell
until_true 20 state_is line1 running
until_true 20 state_is line2 running

echo "- commands, each an argument"
plcctl debug line1 'break Counter:14 if n > 5' wait stack 'print n' 'set n = 100' next print quit >"$cell/commands.txt" ||
  fail "$(cat "$cell/commands.txt")"
grep -q 'task Main halts: breakpoint 1 at Counter:14 (src/steps.st)  Main.counter' "$cell/commands.txt" || fail "$(cat "$cell/commands.txt")"
grep -q '#1 Main:23' "$cell/commands.txt" || fail "$(cat "$cell/commands.txt")"
grep -q 'Main.counter.n = 100' "$cell/commands.txt" || fail "$(cat "$cell/commands.txt")"
grep -q 'task Main halts: step at Main:24' "$cell/commands.txt" || fail "$(cat "$cell/commands.txt")"
runs_on() { local before; before=$(task line1/Main cycles); sleep 1.2; [ "$(task line1/Main cycles)" -gt "$before" ]; }
until_true 10 runs_on

echo "- lines of standard input"
printf 'pause Other\nwait\ntasks\nquit\n' | plcctl debug line1 >"$cell/lines.txt" || fail "$(cat "$cell/lines.txt")"
grep -q 'task Other halts: pause at Other:' "$cell/lines.txt" || fail "$(cat "$cell/lines.txt")"

echo "- a session lasts, also if each line that comes in 12 s is a comment"
(echo 'pause Other'; echo wait; for _ in $(seq 240); do echo '# nothing'; sleep 0.05; done; echo 'stack Other') |
  plcctl debug line1 >"$cell/comments.txt" || fail "$(cat "$cell/comments.txt")"
grep -q '^#0 Other:' "$cell/comments.txt" || fail "$(cat "$cell/comments.txt")"

echo "- commands that are refused"
refused "is no debug build" plcctl debug line2 tasks
refused "no POU" plcctl debug line1 'break Nothing:3'
refused "'help' lists them" plcctl debug line1 dance

echo "- one engineer's story over the Debug Adapter Protocol"
serve_dap line1
story() { python3 "$(dirname "$0")/dap_client.py" "$port" story || fail "the story over DAP"; }
costs_no_cycle line2/Fill story
until_true 10 runs_on

echo "- garbage on the port ends that connection, and nothing else"
python3 "$(dirname "$0")/dap_client.py" "$port" garbage || fail "garbage"
python3 "$(dirname "$0")/dap_client.py" "$port" story || fail "the story after garbage"

echo "- a second client is told why it is refused, and a silent one is left"
python3 "$(dirname "$0")/dap_client.py" "$port" second || fail "second"

echo "- VS Code with its extension: a breakpoint halts all tasks"
extension=$(dirname "$0")/../../../instances/debugging/vscode/package.json
is "$(jq -r .version "$extension")" "$("$BIN/plcctl" --version)" || fail "the extension has another version than plcctl"
python3 "$(dirname "$0")/dap_client.py" "$port" vscode "$extension" || fail "vscode"
until_true 10 runs_on

echo "- a client that vanishes: its breakpoints go, and the task goes on"
python3 "$(dirname "$0")/dap_client.py" "$port" vanish || fail "vanish"
until_true 10 runs_on

echo "- a debugger that is killed: the same, after its lease"
plcctl debug line1 'break Main:24' wait 'wait 600' >"$cell/killed.txt" 2>&1 &
others+=($!)
halted() { grep -q 'task Main halts' "$cell/killed.txt"; }
until_true 20 halted
pkill -KILL -P $! 2>/dev/null || kill -KILL $!
until_true 30 runs_on
plcctl logs line1 | grep -q 'its debugger was silent for 10 s' || fail "$(plcctl logs line1)"

echo "- where the host allows no debug builds, none is loaded"
sed -i '/^pool = /a allow_debug = false' "$cell/cell.toml"
refused "line1' application: $APPLICATIONS/steps.so is a debug build" plcctl reload host
sed -i 's/steps\.so/bottling_line.so/' "$cell/cell.toml"
plcctl reload host >"$cell/reloaded.txt" || fail "$(cat "$cell/reloaded.txt")"
grep -q '^\[host\] allow_debug changed' "$cell/reloaded.txt" || fail "$(cat "$cell/reloaded.txt")"
grep -q "^instance 'line1': runs a debug build; it runs on" "$cell/reloaded.txt" || fail "$(cat "$cell/reloaded.txt")"
if grep -q "line2.*debug build" "$cell/reloaded.txt"; then fail "line2 has none: $(cat "$cell/reloaded.txt")"; fi
refused "allow_debug = false" plcctl debug line1 'break Main:24'
until_true 10 runs_on
pid=$(instance line2 pid)
refused "allow_debug = false" plcctl load application line2 "$APPLICATIONS/steps.so"
until_true 20 state_is line2 running
is "$(instance line2 pid)" "$pid" || fail "line2 was restarted"

echo "- where the host allows them again, a debug build that ran on is debugged"
sed -i 's/^allow_debug = false/allow_debug = true/' "$cell/cell.toml"
plcctl reload host >"$cell/reloaded.txt" || fail "$(cat "$cell/reloaded.txt")"
grep -q "^instance 'line1': runs a debug build; a debugger can halt its tasks again" "$cell/reloaded.txt" || fail "$(cat "$cell/reloaded.txt")"
plcctl debug line1 'break Main:24' wait >"$cell/again.txt" || fail "$(cat "$cell/again.txt")"
grep -q 'task Main halts' "$cell/again.txt" || fail "$(cat "$cell/again.txt")"
until_true 10 runs_on

kill -TERM "${managers[-1]}"
wait "${managers[-1]}" || fail "the manager ended with $?"
managers=()
nothing_left
