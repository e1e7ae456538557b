# For the system tests: a cell of its own (run directory, pool, DDS domain) and the user's commands.
# Sourced with BIN (the programs) and APPLICATIONS set; ends everything that it started.
set -euo pipefail

# As own_name() makes them: the next test program removes the files of a story that was killed.
pool=$(printf 'plct-%x-%d-story' "$(($(stat -Lc %i /proc/self/ns/pid) & 0xffff))" $$)
cell=$(mktemp -d "${TMPDIR:-/tmp}/$pool.XXXXXX")
managers=()
others=()

exec {domain_holder}< <(exec "$(dirname "${BASH_SOURCE[0]}")/hold_domain.py" $$)
domain_pid=$!
read -r PLCHOST_DOMAIN <&"$domain_holder" || { rm -rf "$cell"; exit 1; }
export PLCHOST_DOMAIN

fail() {
  echo "FAILED: $*" >&2
  for log in "$cell"/*.log; do echo "--- $log" >&2; tail -n 40 "$log" >&2; done
  exit 1
}

# A program that writes on when `grep -q` has found its line is ended by SIGPIPE, and pipefail takes that for a failure. So this
# one reads to the end.
grep() {
  local options=() quiet=no letters
  while [[ ${1:-} == -* && $1 != -- ]]; do
    letters=$1
    [[ $1 == --* || $1 != *q* ]] || { quiet=yes letters=${1//q/}; }
    [ "$letters" = - ] || options+=("$letters")
    shift
  done
  if [ "$quiet" = yes ]; then command grep "${options[@]}" "$@" | cat >/dev/null; else command grep "${options[@]}" "$@"; fi
}

# Instances of a manager that was killed continue to run: only their command lines tell that they belong to this test.
ours() { grep -lFf <(echo "$cell/") /proc/[0-9]*/cmdline 2>/dev/null | cut -d/ -f3 | grep -vx "$$" || true; }

clean_up() {
  local pid
  for pid in "${others[@]}"; do kill -KILL "$pid" 2>/dev/null || true; done
  for pid in "${managers[@]}"; do kill -TERM "$pid" 2>/dev/null || true; done
  for pid in "${managers[@]}"; do wait "$pid" 2>/dev/null || true; done
  for pid in $(ours); do kill -KILL "$pid" 2>/dev/null || true; done
  kill -KILL "$domain_pid" 2>/dev/null || true  # last: another test may take the domain at once
  rm -rf "$cell" "/dev/shm/$pool" "/dev/shm/$pool"[-.]*
}
trap clean_up EXIT

# Its leaks end with it, and a sanitizer would take as long to look for them as it lives.
plcctl() { ASAN_OPTIONS=${ASAN_OPTIONS:-}:detect_leaks=0 "$BIN/plcctl" --timeout 10 "$@"; }

# asked COMMAND...: again while nobody answers (exit code 3)
asked() {
  local try code
  for try in 1 2 3 4 5; do
    code=0
    "$@" || code=$?
    [ "$code" -eq 3 ] || break
  done
  return "$code"
}

# The first and the last core that this test may use.
first_core=$(taskset -cp $$ | sed 's/.*: //' | grep -oE '^[0-9]+')
last_core=$(taskset -cp $$ | sed 's/.*: //' | grep -oE '[0-9]+$')

# write_host HOST CORE...: begins the configuration of a host, "$cell/HOST.toml"
write_host() {
  local host=$1
  shift
  cat >"$cell/$host.toml" <<EOF
[host]
name = "$host"
dds_domain = $PLCHOST_DOMAIN
run_directory = "$cell/$host"
state_directory = "$cell/$host.state"
pool = "$pool-$host"
cores = [$(IFS=,; echo "$*")]
EOF
}

# write_instance HOST NAME CORE APPLICATION [LINE...]: adds an instance to it
write_instance() {
  local file=$cell/$1.toml
  cat >>"$file" <<EOF
[[instance]]
name = "$2"
core = $3
application = "$APPLICATIONS/$4.so"
EOF
  shift 4
  [ $# -eq 0 ] || printf '%s\n' "$@" >>"$file"
}

# start_manager HOST
start_manager() {
  "$BIN/plchostd" --config "$cell/$1.toml" 2>>"$cell/$1.log" &
  managers+=($!)
}

# instance NAME FIELD, task INSTANCE/TASK FIELD
instance() { plcctl list instances --json | jq -r ".[] | select(.name == \"$1\") | .$2"; }
task() { plcctl list tasks --json | jq -r ".[] | select(.instance == \"${1%/*}\" and .task == \"${1#*/}\") | .$2"; }

# lost_while INSTANCE/TASK COMMAND...: sets `lost` to the cycles that the task lost meanwhile; it must go on
lost_while() {
  local lost_task=$1 lost_before cycles_before
  shift
  lost_before=$(task "$lost_task" lost_cycles)
  "$@"
  sleep 0.5  # the status is up to 0.2 s old
  cycles_before=$(task "$lost_task" cycles)
  has_gone_on() { [ "$(task "$lost_task" cycles)" -gt "$cycles_before" ]; }
  until_true 20 has_gone_on
  lost=$(($(task "$lost_task" lost_cycles) - lost_before))
}

# costs_no_cycle INSTANCE/TASK COMMAND...: `COMMAND... 1`, `COMMAND... 2` and so on, until the task has lost no cycle meanwhile.
# Cycles that a witness on the same core would have lost as well do not count.
costs_no_cycle() {
  local of=$1 round rounds=8 before taken
  shift
  coproc WITNESS { exec "$BIN/core_witness" "$(instance "${of%/*}" core)" "$(task "$of" interval_us)"; }
  witnessed() { echo >&"${WITNESS[1]}" && read -r taken <&"${WITNESS[0]}" || fail "no witness"; }
  witnessed
  for ((round = 1; round <= rounds; round++)); do
    before=$taken
    lost_while "$of" "$@" "$round"
    witnessed
    [ "$lost" -gt $((taken - before)) ] || break
    echo "further round: System.$(basename "$0" .sh): $of lost $lost cycles in round $round, of which its core took $((taken - before)) at most"
  done
  kill "$WITNESS_PID" && wait "$WITNESS_PID" 2>/dev/null || true
  [ "$round" -le "$rounds" ] || fail "$of lost cycles in each of $rounds rounds, more than its core took"
}

# until_true SECONDS COMMAND...
# The pause is as long as the look before it: with a sanitizer a look takes a core that the tested programs need.
until_true() {
  local end=$((SECONDS + $1)) began took
  shift
  while began=${EPOCHREALTIME//[.,]/}; ! "$@" >/dev/null 2>&1; do
    [ "$SECONDS" -lt "$end" ] || fail "did not happen in time: $*"
    took=$((${EPOCHREALTIME//[.,]/} - began))
    took=$((took < 50000 ? 50000 : took > 999999 ? 999999 : took))
    sleep "$(printf '0.%06d' "$took")"
  done
}
is() { [ "$1" = "$2" ]; }
state_is() { [ "$(instance "$1" state)" = "$2" ]; }

# totals INSTANCE: the cycles of its tasks, and the lost ones
totals() { plcctl list tasks --json | jq -r "[.[] | select(.instance == \"$1\")] | \"\(map(.cycles) | add) \(map(.lost_cycles) | add)\""; }
# undisturbed INSTANCE CYCLES LOST: since these totals it has run, and lost one cycle in ten at most: a shared machine takes some
ran_on() { [ "$(totals "$1" | cut -d' ' -f1)" -ge $(($2 + 100)) ]; }
undisturbed() {
  local cycles lost
  until_true 20 ran_on "$1" "$2"
  read -r cycles lost <<<"$(totals "$1")"
  [ $((10 * (lost - $3))) -le $((cycles - $2)) ] || fail "$1 has lost $((lost - $3)) cycles beside $((cycles - $2))"
}

# serve_dap INSTANCE: sets `port` to where a client of the Debug Adapter Protocol finds it
serve_dap() {
  local said=$cell/dap-$1.txt
  "$BIN/plcctl" --timeout 10 debug "$1" --dap 0 >"$said" 2>"$cell/dap-$1.log" &
  others+=($!)
  has_port() { grep -qE '127.0.0.1:[0-9]+' "$said"; }
  until_true 20 has_port
  port=$(grep -oE '127.0.0.1:[0-9]+' "$said" | cut -d: -f2)
}

# refused TEXT COMMAND...: the command fails with exit code 1 and says TEXT
refused() {
  local text=$1 output code=0
  shift
  output=$("$@" 2>&1) || code=$?
  [ "$code" -eq 1 ] || fail "exit code $code instead of 1: $* ($output)"
  grep -qF -- "$text" <<<"$output" || fail "'$text' is not in what '$*' says: $output"
}

nothing_left() {
  local left
  left=$(ls /dev/shm | grep -E "^$pool([-.]|\$)" || true)
  [ -z "$left" ] || fail "left in /dev/shm: $left"
  # The API server ends with its manager, but by itself.
  for _ in $(seq 100); do
    [ -n "$(ours)" ] || return 0
    sleep 0.05
  done
  fail "processes left: $(ours | xargs -r ps -o pid=,args= -p)"
}
