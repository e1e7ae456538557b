#!/usr/bin/env bash
# Usage: names_each_case.sh PROGRAM KIND
set -euo pipefail
cd "$(dirname "$0")/.."
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
export PLANTED_MARK=$folder/mark
fail() { echo "FAILED: $*"; cat "$folder/said" "$folder/results"; exit 1; }

export PLCHOST_STALLS=$folder/stalls  # not those of the machine
touch "$folder/stalls"
printf 'any Planted.%s\n' 'SucceedsAtItsSecondRun time planted' 'Fails rounds planted' '*Stall* stall planted' >"$folder/retries"
code=0
./cases.py --limit 10 --results "$folder/results" --retries "$folder/retries" --kind "$2" "$1" >"$folder/said" 2>&1 || code=$?
[ "$code" -eq 1 ] || fail "exit code $code instead of 1"

# expect RESULT CASE
expect() { grep -q "^$1	.*	Planted\.$2\$" "$folder/results" || fail "$2 is not $1"; }
expect passed Succeeds
expect failed Fails
expect skipped IsSkipped
expect failed Aborts
expect passed SucceedsBehindOneThatAborts
expect failed EndsTheProcess
expect failed Hangs
expect retried SucceedsAtItsSecondRun
expect retried SucceedsAtItsSecondRunAfterAStall
expect failed HasNoSecondRunWithoutAStall
expect failed LeavesAProcess
expect failed SpoilsTheEnd
says() { grep -qF -- "$1" "$folder/said" || fail "it does not say: $1"; }
says "said by the case that fails"
says "FAILED: Planted.Aborts ended its process by signal 6"
says "FAILED: Planted.EndsTheProcess ended its process with exit code 0"
says "FAILED: Planted.Hangs takes longer than 10.0 s"
says "again: Planted.SucceedsAtItsSecondRun"
says "again: Planted.SucceedsAtItsSecondRunAfterAStall, as the machine stood still for 1,240 ms"
grep -q "^retried	.*	1.240	" "$folder/results" || fail "the results do not tell the stall"
! grep -q "again: Planted.Fails" "$folder/said" || fail "a case with rounds of its own has a second run"

# A share is a part, and all of them are the whole.
for share in 0 1 2; do
  ./cases.py --limit 10 --share "$share/3" --results "$folder/share" "$1" >/dev/null 2>&1 || true
  cut -f 4 "$folder/share"
done | sort >"$folder/shares"
cut -f 4 "$folder/results" | sort | cmp - "$folder/shares" || fail "the shares are not the whole"

# Cases that are not run here.
echo 'any Planted.Hangs not run: planted' >"$folder/skips"
./cases.py --limit 10 --results "$folder/results" --skips "$folder/skips" --without 'Planted.Fails:Planted.LeavesA*' --kind "$2" "$1" >"$folder/said" 2>&1 || true
expect skipped Hangs
expect passed Succeeds
! grep -qE "Planted.(Fails|LeavesAProcess)" "$folder/results" || fail "a case that runs elsewhere was run"
! grep -qF "RUN      ] Planted.Hangs" "$folder/said" || fail "a case that is not to be run was run"
