#!/usr/bin/env bash
# Faults in number: each campaign makes one kind of fault again and again, under load and beside a control run, and counts.
#   tests/campaigns/run.sh                    all of them, whole: about an hour
#   tests/campaigns/run.sh --quick            a hundredth of each
#   tests/campaigns/run.sh --share 0.1        a tenth of each
#   tests/campaigns/run.sh --only NAME        this one; repeated: these
#   tests/campaigns/run.sh --help             this text, and the names
# --seconds S: no further fault of a campaign after S seconds. --seed N: other moments.
# Each campaign prints a line of JSON and a line for people. BIN and APPLICATIONS: folders of the programs and of the applications,
# by default those of .build/tests. Exit code 1: a campaign has failed. One that cannot run here says so, and counts as skipped.
set -uo pipefail
cd "$(dirname "$0")"
export PYTHONDONTWRITEBYTECODE=1  # the tree of the sources stays as it was
all=(manager api_server instance_faults pool_clients flipped_bytes full_disks cut_cables set_clocks)
chosen=()
options=()
while [ $# -gt 0 ]; do
  case "$1" in
    --quick) options+=(--share 0.01) ;;
    --only)
      [[ " ${all[*]} " == *" ${2:-} "* ]] || { echo "$0: no campaign '${2:-}'; there are ${all[*]}" >&2; exit 2; }
      chosen+=("$2") && shift
      ;;
    --share | --seconds | --seed) options+=("$1" "${2:?"$1 needs a number"}") && shift ;;
    -h | --help) sed -n '2,/^[^#]/s/^# \{0,1\}//p' run.sh; echo "names: ${all[*]}"; exit ;;
    *) echo "$0: unknown option $1; allowed are --quick, --only, --share, --seconds, --seed and --help" >&2; exit 2 ;;
  esac
  shift
done
[ ${#chosen[@]} -gt 0 ] || chosen=("${all[@]}")
failed=()
skipped=()
for name in "${chosen[@]}"; do
  code=0
  "./$name.py" "${options[@]}" || code=$?
  case "$code" in
    0) ;;
    77) skipped+=("$name") ;;
    *) failed+=("$name") ;;
  esac
done
echo "$((${#chosen[@]} - ${#failed[@]} - ${#skipped[@]})) passed, ${#failed[@]} failed${failed[*]:+ (${failed[*]})}, ${#skipped[@]} skipped${skipped[*]:+ (${skipped[*]})}"
[ ${#failed[@]} -eq 0 ]
