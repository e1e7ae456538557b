#!/usr/bin/env bash
# A program from an engineer's machine to its instance: sent, kept, rolled back, started with. A broken one is refused while the
# running one runs on; clients and servers die in the midst of it.
. "$(dirname "$0")/common.sh"

write_host cell1 "$first_core"
echo 'application_versions = 3' >>"$cell/cell1.toml"
write_instance cell1 line1 "$first_core" bottling_line
start_manager cell1
manager=${managers[0]}
until_true 20 state_is line1 running
kept=$cell/cell1.state/applications.cell1/line1

# version FIELD VALUE FIELD2: FIELD2 of the kept application whose FIELD is VALUE
version() { plcctl list applications line1 --json | jq -r ".[] | select(.$1 == \"$2\") | .$3"; }
numbers() { plcctl list applications --json | jq -r 'map(.version | numbers | tostring) | join(",")'; }
application_is() { [ "$(instance line1 application)" = "$1" ]; }
in_shm() { compgen -G "/dev/shm/$pool-cell1.download.*" >/dev/null; }
# A download takes half a second: looked for without a pause, and begun again if it was over before it was seen.
begin_download() { # begin_download FILE: $client sends it
  local end=$((SECONDS + 60))
  while [ "$SECONDS" -lt "$end" ]; do
    "$BIN/plcctl" load application line1 "$1" >"$cell/client.log" 2>&1 &
    client=$!
    others+=("$client")
    while kill -0 "$client" 2>/dev/null; do
      if in_shm; then return; fi
    done
    wait "$client" || fail "a download: $(cat "$cell/client.log")"
  done
  fail "no download was seen"
}
newest() { printf '%s/%06d.so' "$kept" "$(plcctl list applications line1 --json | jq 'map(.version | numbers) | max')"; }

echo "- a broken one is refused before the running one is touched"
good=$APPLICATIONS/packer.so
cp "$good" "$cell/foreign.so"
printf '\267\000' | dd of="$cell/foreign.so" bs=1 seek=18 conv=notrunc status=none # e_machine: another processor
head -c $(($(stat -c %s "$good") / 2)) "$good" >"$cell/truncated.so"
: >"$cell/empty.so"
pid=$(instance line1 pid)
cycles=$(task line1/Fill cycles)
refused "foreign.so is refused" plcctl load application line1 "$cell/foreign.so"
refused "truncated.so is refused" plcctl load application line1 "$cell/truncated.so"
refused "fault_wrong_version.so is refused" plcctl load application line1 "$APPLICATIONS/fault_wrong_version.so"
refused "fault_missing_init.so is refused" plcctl load application line1 "$APPLICATIONS/fault_missing_init.so"
refused "fault_undefined_symbol.so is refused" plcctl load application line1 "$APPLICATIONS/fault_undefined_symbol.so"
refused "common.sh is refused" plcctl load application line1 "$(dirname "$0")/common.sh"
refused "empty.so is empty" plcctl load application line1 "$cell/empty.so"
refused "nowhere.so cannot be opened here" plcctl load application line1 "$cell/nowhere.so"
mkfifo "$cell/fifo.so"
truncate -s 2G "$cell/huge.so"
refused "fifo.so is no plain file" timeout 20 "$BIN/plcctl" load application line1 "$cell/fifo.so"
refused "no host takes more than" timeout 20 "$BIN/plcctl" load application line1 "$cell/huge.so"
refused "fault_exits.so is refused: it ends its process" plcctl load application line1 "$APPLICATIONS/fault_exits.so"
refused "fault_exits.so is refused: it ends its process" plcctl load application line1 "$APPLICATIONS/fault_exits.so" --on-host
refused "no instance 'line7'" plcctl load application line7 "$good"
more_cycles() { [ "$(task line1/Fill cycles)" -gt "$cycles" ]; }
until_true 10 more_cycles
is "$(instance line1 pid),$(instance line1 restarts)" "$pid,0" || fail "line1 was disturbed: $(plcctl list instances)"
is "$(task line1/Fill lost_cycles)" 0 || echo "  (lost cycles: $(task line1/Fill lost_cycles))"
is "$(numbers)" "" || fail "a refused file is kept: $(plcctl list applications)"
[ -z "$(find "$kept" -name '*.so*' 2>/dev/null)" ] || fail "left of refused files: $(ls "$kept")"

echo "- sent, kept and loaded; the same digest here and there"
plcctl load application line1 "$good" || fail "loading failed"
application_is "$kept/000001.so" || fail "$(plcctl list instances)"
state_is line1 running || fail "line1 does not run"
cmp "$good" "$kept/000001.so" || fail "another file is there"
is "$(version file packer.so sha256)" "$(sha256sum "$good" | cut -d' ' -f1)" || fail "the digest"
is "$(version file packer.so loaded)" loaded || fail "$(plcctl list applications)"
plcctl load application line1 "$APPLICATIONS/drive_axis.so" --boot
is "$(version file drive_axis.so loaded),$(version file drive_axis.so boot)" loaded,boot || fail "$(plcctl list applications)"

echo "- back to the version before, and to the one before that"
plcctl rollback application line1
application_is "$kept/000001.so" || fail "not version 1: $(plcctl list instances)"
plcctl rollback application line1
application_is "$APPLICATIONS/bottling_line.so" || fail "not the configured one: $(plcctl list instances)"
refused "was not sent to 'line1'" plcctl rollback application line1

echo "- the boot application is what the instance starts with, also after the manager"
kill -TERM "$manager"
wait "$manager" || fail "the manager ended with $?"
nothing_left
start_manager cell1
manager=${managers[1]}
until_true 20 state_is line1 running
application_is "$kept/000002.so" || fail "it started with $(instance line1 application)"
grep -qF "instance line1: its boot application is version 2 (" "$cell/cell1.log" || fail "the log does not tell what won"
echo "- the application of the configuration takes that back"
plcctl load application line1 "$APPLICATIONS/bottling_line.so" --on-host --boot
[ ! -e "$kept/boot" ] || fail "the boot application is still $(cat "$kept/boot")"
plcctl load application line1 "$APPLICATIONS/packer.so" --on-host --boot
is "$(version boot boot file)" "$APPLICATIONS/packer.so" || fail "$(plcctl list applications)"

echo "- a manager that is killed costs nothing: the instance runs on, with the loaded application"
plcctl load application line1 "$APPLICATIONS/held.so"
pid=$(instance line1 pid)
kill_the_manager() {
  kill -KILL "$manager"
  wait "$manager" 2>/dev/null || true
  start_manager cell1
  manager=${managers[-1]}
  until_true 20 state_is line1 running
  is "$(instance line1 pid)" "$pid" || fail "another process"
}
costs_no_cycle line1/Output kill_the_manager
application_is "$kept/000003.so" || fail "$(plcctl list instances)"

echo "- nor does a plchost-dds that is killed"
kill_the_server() {
  server=$(pgrep -P "$manager" -x plchost-dds)
  kill -KILL "$server"
  another_server() { pgrep -P "$manager" -x plchost-dds | grep -qvx "$server"; }
  until_true 20 another_server
  until_true 20 state_is line1 running
}
costs_no_cycle line1/Output kill_the_server
is "$(instance line1 pid)" "$pid" || fail "another process"

echo "- of more than [host] application_versions the oldest goes, but not the boot application"
plcctl load application line1 "$kept/000002.so" --on-host --boot
for file in packer bottling_line packer bottling_line; do plcctl load application line1 "$APPLICATIONS/$file.so"; done
is "$(numbers)" 2,6,7 || fail "$(plcctl list applications)"

# The largest that is allowed, and still an application: bytes behind an ELF file have no meaning.
cp "$APPLICATIONS/drive_axis.so" "$cell/large.so"
truncate -s 64M "$cell/large.so"
echo "- a client that is killed: nothing is left of its half, and the next one gets in"
for try in 1 2 3 4 5; do
  begin_download "$cell/large.so"
  kill -STOP "$client"
  ! in_shm || break
  [ "$try" -lt 5 ] || fail "it was too fast to be stopped"
  kill -CONT "$client"
  wait "$client"
done
pid=$(instance line1 pid)
refused "is just being sent another one, large.so" plcctl load application line1 "$good"
kill -KILL "$client"
wait "$client" 2>/dev/null || true
gone() { ! in_shm; }
until_true 20 gone
is "$(instance line1 pid)" "$pid" || fail "line1 was disturbed"

echo "- a plchost-dds that is killed in the midst: its client begins anew with the next one"
begin_download "$cell/large.so"
kill -KILL "$(pgrep -P "$manager" -x plchost-dds)"
wait "$client" || fail "the client gave up: $(cat "$cell/client.log")"
application_is "$(newest)" || fail "$(plcctl list instances)"
cmp "$cell/large.so" "$(newest)" || fail "another file is there"
truncate -s +1 "$cell/large.so"
refused "this host takes up to 67108864" plcctl load application line1 "$cell/large.so"

echo "- the loaded one is in the audit log, with its digest; the list is as it should be"
audit=$cell/cell1.state/audit.cell1
grep -qF "sha256 $(sha256sum "$good" | cut -d' ' -f1)" "$audit"/*.log || fail "the digest is not in the audit log"
plcctl verify audit "$audit" >/dev/null || fail "the audit log is damaged"

kill -TERM "$manager"
wait "$manager" || fail "the manager ended with $?"
nothing_left
