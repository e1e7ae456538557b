#!/usr/bin/env bash
# The API server has a user of its own: it serves all that it served before, and can do nothing else. The manager has the rights
# that its unit gives it.
. "$(dirname "$0")/common.sh"

[ "$(id -u)" -eq 0 ] || { echo "only root can start programs as other users"; exit 77; }
for program in setpriv pgrep; do
  command -v "$program" >/dev/null || { echo "no $program"; exit 77; }
done
# Numbers that no account has.
user=64042 group=64041
chmod 711 "$cell"
setpriv --reuid "$user" --regid "$group" --clear-groups test -x "$cell" ||
  fail "user $user may not enter $cell, or a folder above it"
rights=(setpriv --regid "$group" --clear-groups --no-new-privs --bounding-set=-all,+sys_nice,+ipc_lock,+setuid,+setgid
  --inh-caps=-all)
start_service() { # start_service HOST: as start_manager
  (umask 0027 && exec "${rights[@]}" "$BIN/plchostd" --config "$cell/$1.toml" 2>>"$cell/$1.log") &
  managers+=($!)
}
server() { pgrep -f "^$BIN/plchost-dds --host cell1 .*$cell/" || true; }
# status PID FIELD: of /proc/PID/status, its words with single spaces
status() { sed -n "s/^$2:\t*//p" "/proc/$1/status" | tr -s '\t ' ' '; }
capabilities() { status "$1" CapEff,CapPrm,CapInh,CapAmb; }

write_host cell1 "$first_core"
write_instance cell1 line1 "$first_core" bottling_line
sed -i "/^\[host\]/i [dds]\nuser = \"$user\"\n" "$cell/cell1.toml"
start_service cell1
manager=${managers[0]}
until_true 30 state_is line1 running

echo "- the API server is another user, without capabilities, and below every task"
pid=$(server)
is "$(status "$pid" Uid)" "$user $user $user $user" || fail "its user: $(status "$pid" Uid)"
is "$(status "$pid" Gid)" "$group $group $group $group" || fail "its group: $(status "$pid" Gid)"
is "$(status "$pid" NoNewPrivs)" 1 || fail "it may gain rights"
for set in CapEff CapPrm CapInh CapAmb; do
  is "$(status "$pid" "$set")" 0000000000000000 || fail "$set: $(status "$pid" "$set")"
done
most=$(ulimit -Hr)
if [ "$most" = unlimited ] || [ "$most" -gt 21 ]; then most=21; fi
is "$(sed -n 's/^Max realtime priority *[0-9]* *\([0-9]*\) .*/\1/p' "/proc/$pid/limits")" "$most" || fail "$(grep realtime "/proc/$pid/limits")"
grep -q "files: those that it needs" "$cell/cell1.log" || grep -q "has no Landlock" "$cell/cell1.log" || fail "the log does not say which files it sees"

echo "- an instance has the rights for real time, and none of the manager's"
is "$(status "$(instance line1 pid)" CapPrm)" "$(printf '%016x' $(((1 << 23) | (1 << 14))))" || fail "$(status "$(instance line1 pid)" CapPrm)"

echo "- it serves: posts, variables, logs, applications, the log of changes"
cycles=$(task line1/Fill cycles)
plcctl reset statistics line1 >/dev/null || fail "a command"
plcctl list objects >/dev/null && plcctl logs line1 -n 1 >/dev/null && plcctl list variables line1 >/dev/null || fail "it shows less"
plcctl load application line1 "$APPLICATIONS/packer.so" || fail "no download"
is "$(plcctl list applications line1 --json | jq -r '.[] | select(.loaded == "loaded") | .file')" packer.so || fail "$(plcctl list applications)"
audit=$cell/cell1.state/audit.cell1
record=$(cat "$audit"/audit.*)
grep -q '"download application"' <<<"$record" || fail "no record: $record"
is "$(find "$audit" -type f -not -perm -060 -printf x)" "" || fail "the manager's group cannot write: $(ls -lR "$audit")"

echo "- the manager ends it, also one that stands still, and the next one has the same rights"
kill -STOP "$pid"
is_another() { [ -n "$(server)" ] && [ "$(server)" != "$pid" ]; }
until_true 30 is_another
until_true 30 state_is line1 running
is "$(status "$(server)" Uid)" "$user $user $user $user" || fail "its user: $(status "$(server)" Uid)"

echo "- a manager that is killed leaves no server, and the next one adopts the instance"
line1=$(instance line1 pid)
kill -KILL "$manager" && wait "$manager" 2>/dev/null || true
none() { [ -z "$(server)" ]; }
until_true 10 none
start_service cell1
until_true 30 state_is line1 running
is "$(instance line1 pid)" "$line1" || fail "line1 is another process"
is "$(grep -c 'was put there by another user' "$cell/cell1.log")" 0 || fail "its files were taken away"

echo "- without the user the server has the manager's, and the log of changes goes on"
sed -i '/^user = /d' "$cell/cell1.toml"
manager=${managers[1]}
kill -HUP "$manager"
is_roots() { [ -n "$(server)" ] && [ "$(status "$(server)" Uid)" = "0 0 0 0" ]; }
until_true 30 is_roots
until_true 30 plcctl reset statistics line1
refused_writes() { grep -c 'cannot write the audit log\|cannot open .*audit' "$cell/cell1.log" || true; }
is "$(refused_writes)" 0 || fail "$(grep audit "$cell/cell1.log")"

echo "- a user that it cannot become keeps the server from starting, and no instance"
sed -i "/^\[dds\]/a user = \"$user\"" "$cell/cell1.toml"
kill -TERM "$manager" && wait "$manager" || true
nothing_left
rights=(setpriv --regid "$group" --clear-groups --no-new-privs --bounding-set=-all,+sys_nice,+ipc_lock --inh-caps=-all)
start_service cell1
says_why() { grep -q 'cannot become user 64042: that takes root with CAP_SETUID and CAP_SETGID' "$cell/cell1.log"; }
until_true 20 says_why
runs() { grep -q 'instance line1: .*running' "$cell/cell1.log" && pgrep -f "plc-instance --name line1 .*$cell/"; }
until_true 20 runs
kill -TERM "${managers[2]}" && wait "${managers[2]}" || true
nothing_left
