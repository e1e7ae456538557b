#!/usr/bin/env bash
# A host that works for hours: instances, storms of events, switches, loads, online changes, and kills of everything.
#   tests/soak/run.sh --hours H                  writes a report with plots into .build/soak
#   tests/soak/run.sh --hours H --report DIR     writes it there
#   tests/soak/run.sh --quick                    a minute
#   tests/soak/run.sh --help                     this text
# --instances N (default 16) and --tasks N (default 200, of all instances together): cores are shared if there are fewer.
# --seed N: other moments. BIN and APPLICATIONS: folders of the programs and of the applications, by default those of .build/tests.
# Exit code 0: each invariant held all along, and each resource was flat. 1: not so, and the report says when. 2: usage.
set -euo pipefail
cd "$(dirname "$0")"
export PYTHONDONTWRITEBYTECODE=1  # the tree of the sources stays as it was
options=()
time=
while [ $# -gt 0 ]; do
  case "$1" in
    --quick) time=0.0167 ;;
    --hours) time=${2:?"--hours needs a number"} && shift ;;
    --report | --instances | --tasks | --seed) options+=("$1" "${2:?"$1 needs a value"}") && shift ;;
    -h | --help) sed -n '2,/^[^#]/s/^# \{0,1\}//p' run.sh; exit ;;
    *) echo "$0: unknown option $1; allowed are --quick, --hours, --report, --instances, --tasks, --seed and --help" >&2; exit 2 ;;
  esac
  shift
done
[ -n "$time" ] || { echo "$0: --hours is missing (or --quick)" >&2; exit 2; }
exec ./soak.py --hours "$time" "${options[@]}"
