# The power of the machine is cut while it writes: QEMU is killed, and with it goes what the kernel has not given to the disk.
# A file that run.sh sources. An operator on the machine gives one command after the other, and each answer is told here over ssh.
# After each cut the machine boots, and has to be as the last answers said.

# Step N: event cutN comes, cutN-3 goes, five products are packed. Each eighth step changes what line2 is to be. The step in which
# the power was cut is done again.
cat >"$applications/operator.sh" <<'EOF'
n=$1
says() { # says ANSWER COMMAND...
  answer=$1
  shift
  plcctl "$@" >/dev/null 2>&1 && echo "$answer"
}
while :; do
  n=$((n + 1))
  says "came $n" register event "line1/cut$n"
  says "gone $((n - 3))" unregister event "line1/cut$((n - 3))"
  says "packed $n" post event packer1/product --count 5 --wait=run
  case $((n % 32)) in
    8) says "line2 $n" stop instance line2 ;;
    16) says "line2 $n" set scheduler line2 CmpScheduleTimer ;;
    24) says "line2 $n" start instance line2 ;;
    0)
      says "loaded $n" load application line2 /applications/bottling_line.so --boot
      says "line2 $n" set scheduler line2 CmpSchedule
      ;;
  esac
done 2>/dev/null
EOF
gcc -std=c11 -O2 -shared -fPIC -I instances -o "$applications/packer.so" instances/examples/packer/packer.c
printf '[CmpSchedule]\nTask.Freewheeling.Cycletime=10\n' >"$applications/packer.cfg"
cat >>"$applications/instances" <<'EOF'

[[instance]]
name = "packer1"
core = 1
share_core = true
application = "/applications/packer.so"
settings = "/applications/packer.cfg"
EOF

# last WORD [SECONDS]: the number in the last answer of that word; with SECONDS: of those that came so long before the last of all
last() {
  awk -v word="$1" -v age="${2:-0}" '{ end = $1 } $2 == word { at[++count] = $1; number[count] = $3 }
    END { while (count > 0 && at[count] > end - age) count--; print (count > 0) ? number[count] : 0 }' "$work/answers"
}
events() { plcctl list events --json | jq -r '.[] | select(.instance == "line1") | .event' | sed -n 's/^cut//p' | sort -n | paste -sd' '; }
# line2_after STEP: its state and scheduler
line2_after() {
  case $(($1 / 8 % 4)) in
    0) echo "running CmpSchedule" ;;
    1) echo "stopped CmpSchedule" ;;
    2) echo "stopped CmpScheduleTimer" ;;
    3) echo "running CmpScheduleTimer" ;;
  esac
}
line2_is() { plcctl list instances --json | jq -r '.[] | select(.name == "line2") | "\(.state) \(.scheduler)"'; }
products() { plcctl logs packer1 | sed -nE 's/.* products ([0-9]+),.*/\1/p' | tail -n 1; }

cut_power() {
  kill -KILL "$machine"
  wait "$machine" 2>/dev/null || true
  rm -f "$work/ssh"
}

# looks_after_cut STEP CUT: the answers up to STEP hold. Only the step that was under way may be done or not.
looks_after_cut() {
  local step=$1 cut=$2 there first newest kept problems
  there=$(events)
  first=${there%% *} newest=${there##* }
  [ "${newest:-0}" -ge "$(last came)" ] || fail "event cut$(last came) was registered, and after the cut there are: $there"
  [ "${first:-0}" -gt "$(last gone)" ] || fail "event cut$(last gone) was unregistered, and after the cut there are: $there"
  [ $((newest - step)) -le 1 ] || fail "after step $step there are the events $there"
  if [ $((step % 8)) -ge 1 ] && [ $((step % 8)) -le 6 ]; then
    is_as_told() { [ "$(line2_is)" = "$(line2_after "$step")" ]; }
    until_true 20 is_as_told
  fi
  # Retain variables are written once a second.
  has_counted() { [ -n "$(products)" ]; }
  until_true 20 has_counted
  kept=$(products)
  [ "$kept" -ge $((5 * $(last packed 2.5))) ] || fail "$((5 * $(last packed 2.5))) products were packed 2.5 s before the cut, and $kept are left"
  [ "$kept" -le $((5 * (step + 1 + cut))) ] || fail "$kept products after step $step"
  problems=$(on_machine journalctl -q --no-pager -b -u plchostd | grep -E 'checksum|damaged|corrupt' || true)
  [ -z "$problems" ] || fail "a file was damaged: $problems"
  on_machine plcctl verify audit /var/lib/plchost/audit.plchost >"$log" 2>&1 || fail "the log of changes is not whole"
  [ "$(last came 2.5)" -lt 1 ] || on_machine grep -rqF "\"argument\":\"cut$(last came 2.5)\"" /var/lib/plchost/audit.plchost ||
    fail "the registration of cut$(last came 2.5) is not in the log of changes"
}

# power_cuts COUNT
power_cuts() {
  local cut step=0 seconds longest=7
  [ "$machine_is_emulated" = no ] || longest=60
  : >"$work/answers"
  for ((cut = 1; cut <= $1; cut++)); do
    { ssh_machine "sh /applications/operator.sh $((step > 0 ? step - 1 : 0))" </dev/null 2>/dev/null || true; } |
      while read -r answer; do echo "$EPOCHREALTIME $answer"; done >>"$work/answers" &
    operator=$!
    seconds=$((RANDOM % longest)).$((RANDOM % 10))
    sleep "$seconds"
    cut_power
    wait "$operator" 2>/dev/null || true
    step=$(last packed)
    [ "$(last came)" -le "$step" ] || step=$(($(last came) - 1))
    machine_boot >/dev/null
    until_true 300 has_booted
    until_true 60 plcctl wait instance line1 packer1 --timeout 30
    looks_after_cut "$step" "$cut"
    step=$(events) && step=${step##* }
    [ $((cut % 10)) -ne 0 ] || echo "  $cut cuts, $step steps of the operator"
  done
  plcctl start instance line2 >"$log" 2>&1 || fail "line2 does not start"
  [ "$step" -ge "$1" ] || fail "in $1 cuts the operator has done $step steps"
}
