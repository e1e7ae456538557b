#!/usr/bin/env bash
# The configuration is changed while instances run: `plcctl reload host` and SIGHUP, told over DDS, to the service manager and in
# the audit log. The service manager hears from the manager's loop as long as that goes round.
. "$(dirname "$0")/common.sh"

write_host cell "$first_core"
write_instance cell line1 "$first_core" bottling_line 'share_core = true'
cp "$cell/cell.toml" "$cell/one.toml"
write_instance cell line2 "$first_core" packer 'share_core = true'
export NOTIFY_SOCKET=$cell/notify WATCHDOG_USEC=400000
python3 - "$NOTIFY_SOCKET" "$cell/notified" <<'PYTHON' &
import socket, sys
listener = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
listener.bind(sys.argv[1])
while True:
    said = listener.recv(4096).decode()
    with open(sys.argv[2], "a", encoding="utf-8") as told:
        told.write(said.replace("\n", " ") + "\n")
PYTHON
others+=($!)
for _ in $(seq 100); do [ -S "$NOTIFY_SOCKET" ] && break; sleep 0.1; done
start_manager cell
plcctl wait instance line1 line2 --timeout 30
pid_of() { plcctl list instances --json | python3 -c "
import json, sys
print(next((i['pid'] for i in json.load(sys.stdin) if i['name'] == '$1'), 'none'))"; }
line1=$(pid_of line1)
line2=$(pid_of line2)

[ "$(plcctl reload host)" = "nothing has changed" ] || fail "an unchanged file changes something"

# A change of plchost-dds only is used by a new one; the answer comes before, and no instance is touched.
sed -i '/^pool = /a labels = ["hall2"]' "$cell/cell.toml" "$cell/one.toml"
[ "$(plcctl reload host)" = "[host] labels changed, used at once; plchost-dds is restarted for it, and the PLCs run on" ] ||
  fail "the answer of another label"
for _ in $(seq 200); do plcctl --label hall2 list hosts >"$cell/said" 2>&1 && grep -q cell "$cell/said" && break; sleep 0.1; done
plcctl --label hall2 list hosts | grep -q cell || fail "the label is not told"
[ "$(pid_of line1)" = "$line1" ] || fail "another label restarts an instance"
plcctl wait instance line1 line2 --timeout 30

# A faulty file changes nothing, and each fault has its line.
cp "$cell/cell.toml" "$cell/good.toml"
printf '[[instance]]\nname = "line3"\ncore = %s\nshare_core = true\nrestart = "now"\nstart = 1\n' "$first_core" >>"$cell/cell.toml"
code=0
plcctl reload host 2>"$cell/said" || code=$?
[ "$code" = 1 ] || fail "a faulty file is answered with $code"
grep -q "plcctl: .*cell.toml:[0-9]*: .*'line3' restart: .*on-failure" "$cell/said" || fail "$(cat "$cell/said")"
[ "$(grep -c '^plcctl: ' "$cell/said")" -ge 2 ] || fail "not each fault has its line: $(cat "$cell/said")"
[ "$(pid_of line3)" = none ] || fail "a faulty file adds an instance"

# line2 is removed: it runs, is listed as removed, and disappears when it is stopped.
cp "$cell/one.toml" "$cell/cell.toml"
[ "$(plcctl reload host)" = "instance 'line2': removed; it runs until it is stopped" ] || fail "the answer of the removal"
[ "$(pid_of line2)" = "$line2" ] || fail "a removed instance does not run on"
plcctl list instances -o wide 2>/dev/null | grep -q "removed from the configuration" || plcctl list instances | grep -q "removed from" ||
  fail "the removal is not listed: $(plcctl list instances)"
plcctl list instances --json | grep -q '"removed": *true' || fail "the removal is not flagged"
! plcctl restart instance line2 2>"$cell/said" || fail "a removed instance is restarted"
plcctl stop instance line2
for _ in $(seq 100); do [ "$(pid_of line2)" = none ] && break; sleep 0.1; done
[ "$(pid_of line2)" = none ] || fail "a stopped instance is still listed: $(plcctl list instances)"

# It comes again with SIGHUP, as an operator left it.
cp "$cell/good.toml" "$cell/cell.toml"
kill -HUP "${managers[0]}"
for _ in $(seq 200); do [ "$(pid_of line2)" = none ] || break; sleep 0.1; done
plcctl start instance line2
[ "$(pid_of line1)" = "$line1" ] || fail "an unchanged instance was restarted"
for _ in $(seq 100); do grep -q "READY=1 STATUS=" "$cell/notified" && break; sleep 0.1; done
grep -v "^WATCHDOG=1$" "$cell/notified" | grep -A1 "^RELOADING=1 MONOTONIC_USEC=[0-9]*$" | grep -q "^READY=1 STATUS=the configuration" ||
  fail "the service manager is not told: $(cat "$cell/notified")"

# A manager that stands still shows no sign, and its instances run on.
signs() { grep -c "^WATCHDOG=1$" "$cell/notified"; }
more_signs_than() { [ "$(signs)" -gt "$1" ]; }
until_true 20 more_signs_than 2
kill -STOP "${managers[0]}"
for _ in $(seq 100); do grep -q "^State:.*T" "/proc/${managers[0]}/status" && break; sleep 0.1; done
# Its words of before lie in the socket in front of this one.
python3 -c 'import socket, sys; socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM).sendto(b"MARK", sys.argv[1])' "$NOTIFY_SOCKET"
until_true 20 grep -qx MARK "$cell/notified"
still=$(signs)
sleep 1
[ "$(signs)" = "$still" ] || fail "a manager that stands still shows that it goes round"
kill -CONT "${managers[0]}"
until_true 20 more_signs_than "$still"
[ "$(pid_of line1)" = "$line1" ] || fail "line1 was restarted"
