#!/usr/bin/env bash
# The disk is full, has become read-only, or takes 5 s for each write. No cycle is lost, the API answers, and the faults are told.
# All is written when the disk is well again.
. "$(dirname "$0")/common.sh"

write_host cell1 "$first_core"
write_instance cell1 packer1 "$first_core" packer 'share_core = true'
write_instance cell1 line1 "$first_core" bottling_line 'share_core = true'
export RECORDED_FOLDER=$cell/cell1.state DISK_FAULT=$cell/disk_fault
LD_PRELOAD=$BIN/storage_recorder.so start_manager cell1
until_true 20 state_is packer1 running
until_true 20 state_is line1 running
audit=$cell/cell1.state/audit.cell1

# disk FAULT: it is so from now on
disk() { echo "$1" >"$DISK_FAULT.new" && mv "$DISK_FAULT.new" "$DISK_FAULT"; }
host() { plcctl list hosts --json | jq -r ".[0].$1"; }
says() { [[ "$(instance "$1" problem)" == *"$2"* ]]; }
unrecorded() { [[ "$(host unrecorded)" == *"$1"* ]]; }
is_recorded() { [ -z "$(host unrecorded)" ]; }
is_well() { [ -z "$(instance packer1 problem)" ]; }
stops() { cat "$audit"/*.log | grep -c '"what":"stop"' || true; }
products() { plcctl logs packer1 | grep -oE 'products [0-9]+' | tail -n 1; }

# as_it_fails FAULT RETAIN AUDIT: the problems that must be told of retain variables and of the audit log; "": none
as_it_fails() {
  local fault=$1 retain=$2 log=$3 said
  disk "$fault"
  plcctl post event packer1/product --count 3 --wait=run >/dev/null || fail "$fault: a post"
  for verb in stop start; do
    said=$(plcctl "$verb" instance packer1 2>&1) || fail "$fault: $verb: $said"
    grep -q 'a power cut would undo' <<<"$said" || fail "$fault: $verb says nothing of the disk: $said"
    is "$(host state)" alive || fail "$fault: the host is $(host state)"
  done
  [ -z "$retain" ] || until_true 20 says packer1 "$retain"
  [ -z "$log" ] || until_true 20 unrecorded "$log"
  rm "$DISK_FAULT"
}
full() { as_it_fails full 'No space left on device' 'No space left on device'; }
read_only() { as_it_fails read-only 'Read-only file system' 'Read-only file system'; }
slow() { as_it_fails 'slow 5000' '' 'the disk does not answer'; }

for fault in full read_only slow; do
  echo "- $fault"
  before=$(stops)
  costs_no_cycle line1/Fill "$fault"
  on_disk() { plcctl stop instance packer1 && [[ "$(plcctl start instance packer1 2>&1)" != *'power cut'* ]]; }
  until_true 60 on_disk
  until_true 60 is_recorded
  until_true 60 is_well
  [ "$(stops)" -gt "$before" ] || fail "nothing is recorded: $(tail -n 3 "$audit"/*.log)"
  "$BIN/plcctl" verify audit "$audit" >"$cell/verified" || fail "$(cat "$cell/verified")"
  [ "$fault" = slow ] || grep -q 'could not be written' "$cell/verified" || fail "the log does not say that records are missing"
done

echo "- the disk has all that it had refused: the values outlive the memory"
until_true 20 is_well
before=$(products)
kill -TERM "${managers[0]}"
wait "${managers[0]}" || fail "the manager ended with $?"
nothing_left
managers=()
start_manager cell1
until_true 20 state_is packer1 running
as_before() { is "$(products)" "$before"; }
until_true 20 as_before
kill -TERM "${managers[0]}"
wait "${managers[0]}" || fail "the manager ended with $?"
nothing_left
