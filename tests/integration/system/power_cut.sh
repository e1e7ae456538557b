#!/usr/bin/env bash
# The files of a host, cut at every change. Its programs are recorded while an operator works, and each state that a power cut
# may have left is read again. The host starts on some of them.
. "$(dirname "$0")/common.sh"

top=$cell/disk
mkdir "$top"
write_host cell1 "$first_core"
sed -i "s,^state_directory.*,state_directory = \"$top/state\"," "$cell/cell1.toml"
echo 'application_versions = 2' >>"$cell/cell1.toml"
write_instance cell1 packer1 "$first_core" packer 'share_core = true'
write_instance cell1 line1 "$first_core" task_faults 'share_core = true'
begin() {
  start_manager cell1
  until_true 20 state_is packer1 running
  until_true 20 state_is line1 running
}
end() {
  kill -TERM "${managers[-1]}"
  wait "${managers[-1]}" || fail "the manager ended with $?"
  nothing_left
}
export RECORDING=$cell/recording RECORDED_FOLDER=$top
LD_PRELOAD=$BIN/storage_recorder.so begin

# kept TEXT: the files with that text in their paths are on the disk: the host has said so
kept() { "$BIN/storage_replay" mark "kept $1"; }
# told TEXT COMMAND...: the same when COMMAND was answered
told() {
  local what=$1
  shift
  plcctl "$@" || fail "plcctl $*"
  kept "$what"
}
newest() { plcctl list applications packer1 --json | jq -r 'map(.version | numbers) | max'; }
exception_is() { [ "$(plcctl show exception line1 --json | jq -r '.[0].present')" = "$1" ]; }

echo "- an operator works, with stops, schedulers, events, applications, faults and kills"
told line1.wish stop instance line1
told line1.wish start instance line1
told packer1.wish set scheduler packer1 CmpScheduleTimer
told packer1.events register event packer1/later
told packer1.events register event packer1/latest
told packer1.events unregister event packer1/later
# load APPLICATION [--boot]
load() {
  told applications.cell1 load application packer1 "$APPLICATIONS/$1.so" "${@:2}"
  kept packer1.wish
}
load packer
load bottling_line --boot
load drive_axis
told packer1.wish rollback application packer1
load packer --boot
for _ in 1 2 3; do
  plcctl post event packer1/product --count 5 --wait=run >/dev/null
  sleep 1.1  # values are written once a second
done
plcctl post event line1/divide >/dev/null
until_true 20 exception_is true
told line1.wish reset instance line1
told line1.wish start instance line1
kill -KILL "$(instance line1 pid)"
restarted() { [ "$(instance line1 restarts)" = 1 ]; }
until_true 20 restarted
until_true 20 state_is line1 running
pkill -KILL -f "plchost-dds --host cell1 .*$pool-cell1 "
until_true 20 state_is line1 running
told packer1.wish stop instance packer1
end
kept all
unset RECORDED_FOLDER

echo "- each state is read"
"$BIN/storage_replay" check "$RECORDING" "$top" "$cell/cut" || fail "files are not as they should be after a power cut"
audit=$top/state/audit.cell1
"$BIN/plcctl" verify audit "$audit" || fail "the log is not whole"

echo "- a host starts on some of them"
"$BIN/storage_replay" leave "$RECORDING" "$top" "$cell/left" 3
for state in 1 2 3; do
  rm -rf "$top"
  cp -a "$cell/left/$state" "$top"
  start_manager cell1
  up() { plcctl list instances --json | jq -e 'length == 2 and all(.state == "running" or .state == "stopped")'; }
  until_true 20 up
  ! grep -E 'checksum|damaged|corrupt' "$cell/cell1.log" || fail "a file was damaged"
  end
done
