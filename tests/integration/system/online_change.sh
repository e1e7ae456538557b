#!/usr/bin/env bash
# A change of the program on a line that runs. It is sent from an engineer's machine, taken over between two cycles
# with the variables, refused where it does not fit, and kept for what comes after.
. "$(dirname "$0")/common.sh"

write_host cell1 "$first_core"
write_instance cell1 line1 "$first_core" online_1
start_manager cell1
manager=${managers[0]}
until_true 20 state_is line1 running
kept=$cell/cell1.state/applications.cell1/line1
application_is() { [ "$(instance line1 application)" = "$1" ]; }

# report FIELD: the program's report of itself now; FIELD: the word before the figure
report() {
  local before
  before=$(reports)
  plcctl post event line1/report >/dev/null
  more_reports() { [ "$(reports)" -gt "$before" ]; }
  until_true 10 more_reports
  grep -h "application: version " "$cell"/*.log | tail -1 | grep -oE "$1 [0-9]+" | cut -d' ' -f2
}
reports() { cat "$cell"/*.log | grep -c "application: version " || true; }

pid=$(instance line1 pid)
ran=$(report counter)
cycles=$(task line1/Main cycles)
lost=$(task line1/Main lost_cycles)

echo "- the new version is sent and takes over, with the variables; the process and the figures go on"
plcctl load application line1 "$APPLICATIONS/online_2.so" --online | tee "$cell/answer.log"
grep -q "version 1 (online_2.so) is loaded, taken over between two cycles" "$cell/answer.log" || fail "another answer"
application_is "$kept/000001.so" || fail "$(plcctl list instances)"
is "$(instance line1 pid),$(instance line1 restarts)" "$pid,0" || fail "another process"
is "$(report version)" 2 || fail "the code of version 1 runs"
[ "$(report counter)" -gt "$ran" ] || fail "the counter began anew"
[ "$(task line1/Main cycles)" -gt "$cycles" ] || fail "the figures began anew"
is "$(task line1/Main lost_cycles)" "$lost" || echo "  (lost cycles: $(task line1/Main lost_cycles))"
plcctl list transitions line1 --json | grep -q "online change to $kept/000001.so" || fail "$(plcctl show transitions line1)"

echo "- a version that does not fit is refused with the reasons, and the line runs on"
refused "task 'Main': its interval is 3000 us, of the one that runs it is 2000 us" \
  plcctl load application line1 "$APPLICATIONS/online_interval.so" --online
refused "variables 'machine': dwBytes is 24, of the one that runs it is 16" \
  plcctl load application line1 "$APPLICATIONS/online_variables.so" --online --on-host
refused "it is the application 'BottlingLine', 'Online' runs" \
  plcctl load application line1 "$APPLICATIONS/bottling_line.so" --online
echo "- one whose plc_app_init crashes costs a process that only tried it"
refused "is refused" plcctl load application line1 "$APPLICATIONS/online_init_crashes.so" --online
refused "is refused" plcctl load application line1 "$APPLICATIONS/online_init_crashes.so" --online --on-host
is "$(instance line1 pid),$(instance line1 restarts)" "$pid,0" || fail "another process"
application_is "$kept/000001.so" || fail "$(plcctl list instances)"
is "$(report version)" 2 || fail "another version runs"

echo "- back to the version before, online"
plcctl rollback application line1 --online
application_is "$APPLICATIONS/online_1.so" || fail "$(plcctl list instances)"
is "$(report version)" 1 || fail "version 2 still runs"
is "$(instance line1 pid)" "$pid" || fail "another process"

echo "- a crash and a restart begin with the version that was taken over last"
plcctl load application line1 "$APPLICATIONS/online_2.so" --online --on-host --boot
kill -KILL "$pid"
another() { [ "$(instance line1 pid)" != "$pid" ] && state_is line1 running; }
until_true 20 another
application_is "$APPLICATIONS/online_2.so" || fail "$(plcctl list instances)"
is "$(report version)" 2 || fail "another version runs"
plcctl restart instance line1
is "$(report version)" 2 || fail "another version runs"

echo "- of one that is stopped, too; and there must be one"
plcctl stop instance line1
plcctl load application line1 "$APPLICATIONS/online_1.so" --online --on-host
state_is line1 stopped || fail "$(plcctl list instances)"
plcctl start instance line1
is "$(report version)" 1 || fail "another version runs"
plcctl post event line1/fault >/dev/null
until_true 10 state_is line1 exception
refused "load it without --online" plcctl load application line1 "$APPLICATIONS/online_2.so" --online

kill -TERM "$manager"
wait "$manager" || fail "the manager ended with $?"
nothing_left
