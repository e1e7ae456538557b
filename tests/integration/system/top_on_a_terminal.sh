#!/usr/bin/env bash
# An operator at a terminal: 'plcctl top' shows what the host shows, follows keys and the size of the terminal, and gives commands.
. "$(dirname "$0")/common.sh"

write_host cell1 "$first_core"
write_instance cell1 line1 "$first_core" bottling_line 'share_core = true'
write_instance cell1 line2 "$first_core" bottling_line 'share_core = true'
start_manager cell1
until_true 20 state_is line1 running
until_true 20 state_is line2 running

# A terminal of its own, whose screen can be read.
terminal() { tmux -S "$cell/tmux" -f /dev/null "$@"; }
end_terminal() { terminal kill-server 2>/dev/null || true; }
trap 'end_terminal; clean_up' EXIT
export ASAN_OPTIONS=${ASAN_OPTIONS:-}:detect_leaks=0
terminal new-session -d -x 120 -y 30 "TERM=tmux-256color LC_ALL=C.UTF-8 '$BIN/plcctl' --timeout 10 top --interval 0.2; echo \"ended with \$?\"; sleep 1000"
shows() { terminal capture-pane -p | grep -q -- "$1"; }
shows_not() { ! shows "$1"; }
press() { terminal send-keys "$@"; }
see() { until_true 30 shows "$1" || { terminal capture-pane -p >&2; fail "the screen does not show: $1"; }; }

echo "- the instances"
see '1 host, 2 instances, 2 running'
see 'line1 .*running .*CmpSchedule'

echo "- a look into one: its tasks and their latencies"
press Enter
see 'cell1/line1'
see 'NOW-P99(us)'
see 'Fill .*running'
see 'no exception'
has_latency() { terminal capture-pane -p | grep -E '^Fill ' | grep -q '[▁▂▃▄▅▆▇█]'; }
until_true 30 has_latency || fail "no latency is drawn"
press Escape

echo "- another size of the terminal"
terminal resize-window -x 60 -y 12
see '2 instances'
shows_not PROBLEM || fail "columns that have no room are shown"
terminal resize-window -x 160 -y 40
see PROBLEM

echo "- a command is given when it is confirmed, and another one goes on meanwhile"
press T
see 'Stop line1 of cell1?'
press n
see 'not done'
state_is line1 running || fail "line1 is stopped without a confirmation"
press T
see 'Stop line1 of cell1?'
press y
see 'line1 of cell1 is stopped'
until_true 20 state_is line1 stopped
see 'line1 .*stopped'
press W
see '2: '
press 2
see 'Switch line1 of cell1 to'
press y
see 'line1 of cell1 has '
is_switched() { [ "$(instance line1 scheduler)" != CmpSchedule ]; }
until_true 20 is_switched
press S
press y
see 'line1 of cell1 is started'
until_true 20 state_is line1 running

echo "- a filter, the cores, the keys"
press / line2 Enter
until_true 20 shows_not 'line1 '
press / Escape 3
see 'line1, line2'
press '?'
see 'switch the scheduler'
press x

echo "- a host that is gone, and comes back"
kill -TERM "${managers[-1]}"
wait "${managers[-1]}" || true
press 1
see silent
start_manager cell1
see 'line2 .*running'

echo "- the end gives the terminal back"
press q
see 'ended with 0'
"$BIN/plcctl" top </dev/null >"$cell/out" 2>&1 && fail "top without a terminal"
grep -q 'needs a terminal' "$cell/out" || fail "$(cat "$cell/out")"

echo "- a terminal that is closed ends it, also if it does not hear of that by a signal"
terminal new-window "trap '' HUP; TERM=tmux-256color exec '$BIN/plcctl' --timeout 10 top"
see '2 instances'
top=$(terminal display-message -p '#{pane_pid}')
others+=("$top")
end_terminal
has_ended() { ! kill -0 "$top" 2>/dev/null; }
until_true 20 has_ended
