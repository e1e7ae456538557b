#!/usr/bin/env bash
# Stories of the packages on a machine of its own: a bare Debian that boots systemd as process 1.
#   tests/machine/run.sh [--packages FOLDER] [--before FOLDER] [--container | --rt] [--power-cuts N] [SUITE]
# SUITE: bookworm or trixie; default: the Debian of this machine. FOLDER: the packages for it, from manager/package.sh, which is
# called without --packages. --before: the packages of a version before. The way back to them, and the upgrade from them, are then
# stories, too. The machine is QEMU with Debian's kernel; --rt: with its real-time kernel, and set up by 'plcctl check host --fix';
# --container: systemd-nspawn, in seconds. --power-cuts: QEMU is killed N times while the machine writes. The Debian is kept in
# .build/machine; a story changes nothing in it.
# As root. Exit code 77: no such machine can be made here, and nothing was tested.
set -euo pipefail

packages= before= cuts=0
kind=emulated kernel=linux-image-amd64 kernel_line=
suite=$(. /etc/os-release && echo "$VERSION_CODENAME")
while [ $# -gt 0 ]; do
  case "$1" in
    --packages) packages=$(realpath -e "${2:?"--packages needs a folder"}") && shift ;;
    --before) before=$(realpath -e "${2:?"--before needs a folder"}") && shift ;;
    --container) kind=container ;;
    --power-cuts) cuts=${2:?"--power-cuts needs a number"} && shift ;;
    --rt) kernel=linux-image-rt-amd64 ;;
    -h | --help) sed -n '2,/^[^#]/s/^# \{0,1\}//p' "$0"; exit ;;
    -*) echo "tests/machine/run.sh: unknown option $1; allowed are --packages, --before, --container, --rt, --power-cuts and --help" >&2; exit 2 ;;
    *) suite=$1 ;;
  esac
  shift
done
cd "$(dirname "$0")/../.."
root=$PWD/.build/machine/$suite-$kind
[ "$kind" = container ] || root+=-${kernel#linux-image-}
work=$(mktemp -d "${TMPDIR:-/tmp}/plchost-machine.XXXXXX")
log=$work/log
applications=$work/applications
machine=
told=
clean_up() {
  local code=$?
  # A command has failed that no line asks about.
  [ "$code" -eq 0 ] || [ -n "$told" ] || echo "FAILED: exit code $code; the words of the command stand above" >&2
  [ -z "$machine" ] || { kill "$machine" && wait "$machine"; } 2>/dev/null || true
  rm -rf "$work"
}
trap clean_up EXIT
trap 'told=yes; exit 130' INT TERM
fail() {
  told=yes
  echo "FAILED: $*" >&2
  tail -n 30 "$log" >&2
  [ ! -s "$work/console" ] || tail -n 5 "$work/console" >&2
  [ -z "$machine" ] || on_machine journalctl -q --no-pager -n 40 -u plchostd >&2 || true
  exit 1
}
cannot() { told=yes; echo "no machine can be made here: $*; nothing was tested" >&2; exit 77; }
. tests/machine/stories.sh

[ "$(id -u)" -eq 0 ] || cannot "only root can"
machine_environment=(HOME=/root TERM=dumb LC_ALL=C.UTF-8 PATH=/usr/sbin:/usr/bin:/sbin:/bin DEBIAN_FRONTEND=noninteractive)
. "tests/machine/$kind.sh"
for program in "${machine_programs[@]}" g++; do
  command -v "$program" >/dev/null || cannot "$program is missing; .ci/packages machine installs all that is needed"
done
if [ -z "$packages" ]; then
  packages=$PWD/.build/packages
  manager/package.sh "$packages" >"$log" || fail "no packages"
fi

# The root has all that the packages depend on: the machine has no network.
if [ ! -e "$root/made" ]; then
  rm -rf "$root"
  .ci/debian_root "$suite" "$root" "$machine_packages" >"$log" 2>&1 || cannot "$(tail -n 1 "$log")"
  touch "$root/made"
fi
.ci/apt_settings "$root"
needed=$(for package in "$packages"/*.deb; do dpkg-deb -f "$package" Depends | tr ',' '\n' | sed 's/^ *//' | grep -vE '^(libplc|plchost)'; done |
  sort -u | paste -sd,)
[ "$kernel" != linux-image-rt-amd64 ] || needed+=,grub2-common
chroot "$root" sh -c 'apt-get -q update && DEBIAN_FRONTEND=noninteractive apt-get -q satisfy -y --no-install-recommends "$1"' _ "$needed" \
  >"$log" 2>&1 || cannot "its packages cannot be installed: $(tail -n 1 "$log")"

mkdir "$applications"
[ -z "$before" ] || cp -r "$before" "$applications/before"
build() { g++ -std=c++20 -O2 -shared -fPIC -I instances -o "$applications/$1.so" "${@:2}"; }
build bottling_line instances/examples/bottling_line/*.cpp
build outputs tests/integration/instances/applications/outputs.cpp
cat >"$applications/instances" <<'EOF'

[[instance]]
name = "line1"
core = 1
share_core = true
application = "/applications/bottling_line.so"
settings = "/applications/line.cfg"

[[instance]]
name = "line2"
core = 1
share_core = true
memory_max_mib = 512
pids_max = 200
application = "/applications/bottling_line.so"
settings = "/applications/line.cfg"

[[instance]]
name = "valves"
after = ["line1"]
core = 1
share_core = true
application = "/applications/outputs.so"
settings = "/applications/valves.cfg"
EOF
printf '[CmpSchedule]\nSchedulerInterval=1000\n' >"$applications/line.cfg"
cat "$applications/line.cfg" - >"$applications/valves.cfg" <<'EOF'
[SysMem]
Linux.Area.0.Flags=0x8000
Linux.Area.0.Address=0
Linux.Area.0.Size=8
Linux.Area.0.Device=/var/lib/plchost/valves
Linux.Area.0.SafeState=0xE5E5E5E5E5E5E5E5
EOF
[ "$cuts" -eq 0 ] || . tests/machine/power_cuts.sh

has_booted() { [[ "$(on_machine systemctl is-system-running || true)" =~ running|degraded ]]; }
machine_start
until_true 900 has_booted

plcctl() { asked on_machine plcctl --timeout 20 "$@"; }
files() {
  on_machine find / -xdev \( -path /proc -o -path /sys -o -path /run -o -path /tmp -o -path /var/tmp -o -path /var/log -o -path /var/cache \
    -o -path /var/lib/apt -o -path /var/lib/dpkg -o -path /var/lib/systemd -o -path /packages -o -path /applications \) -prune -o -print | sort
}
manager() { on_machine systemctl show -p MainPID --value plchostd; }
instances() { plcctl list instances --json | jq -c '[.[] | {name, pid, state}] | sort_by(.name)'; }
cycles() { plcctl list tasks --json | jq "[.[] | select(.instance == \"line1\")] | map(.$1) | add"; }
run() { plcctl wait instance line1 line2 valves --timeout 30 && [ "$(on_machine systemctl is-active plchostd)" = active ]; }
# ends_no_plc WHAT COMMAND...: another manager, the same processes of the instances, and their cycles go on. Cycles that are lost
# in the same time without the command do not count. A machine that stands still gets further rounds. An emulated one loses
# cycles all the time, and is not asked for them.
ends_no_plc() {
  local what=$1 before=$shown other round lost control at ran now
  shift
  for ((round = 1; round <= 5; round++)); do
    at=$(cycles lost_cycles)
    sleep 5
    control=$(($(cycles lost_cycles) - at))
    other=$(manager) at=$(cycles lost_cycles) ran=$(cycles cycles)
    "$@" >"$log" 2>&1 || fail "$what"
    is_another() { [ "$(manager)" != "$other" ] && [ "$(manager)" != 0 ] && run; }
    until_true 60 is_another
    lost=$(($(cycles lost_cycles) - at))
    [ "$(instances)" = "$before" ] || fail "$what: $before before it, $(instances) after it"
    now=$(cycles cycles)
    [ "$now" -gt "$ran" ] || fail "$what: line1 had run $ran cycles before it, and $now after it"
    [ "$machine_is_emulated" = no ] || return 0
    [ "$lost" -gt "$control" ] || break
    echo "  further round: $what: line1 lost $lost cycles, $control without it"
  done
  [ "$round" -le 5 ] || fail "$what costs cycles in each of 5 rounds"
}

story "the packages are installed, and the service runs without an instance"
# As the boot loader's own package would leave them, which also writes to a disk.
[ "$kernel" != linux-image-rt-amd64 ] || on_machine sh -c 'mkdir -p /boot/grub /etc/default/grub.d && touch /etc/default/grub && update-grub' >"$log" 2>&1 || fail "grub"
without=$(files)
on_machine sh -c 'apt-get -q install -y --no-install-recommends /packages/*.deb' >"$log" 2>&1 || fail "the packages cannot be installed"
sees_host() { [ "$(plcctl list hosts --json | jq -r ".[].host")" = plchost ]; }
until_true 60 sees_host
[ "$(on_machine systemctl is-active plchostd)" = active ] || fail "the service does not run"
[ "$(on_machine systemctl show -p Type -p WatchdogUSec -p NotifyAccess plchostd | paste -sd' ')" = "Type=notify NotifyAccess=main WatchdogUSec=15s" ] ||
  fail "$(on_machine systemctl show -p Type -p WatchdogUSec -p NotifyAccess plchostd)"
[ "$(on_machine python3 -c 'import plchost_client; print(plchost_client.Client(timeout=10).hosts()[0].name)')" = plchost ] || fail "Python sees no host"

# The registers of a device, which a file plays here.
registers() { on_machine od -An -N8 -tx1 /var/lib/plchost/valves | tr -d ' '; }
registers_are() { [ "$(registers)" = "$1" ]; }
driven=5555555555555555 safe=e5e5e5e5e5e5e5e5
story "three instances come by a reload of the service"
on_machine sh -c 'truncate -s 4096 /var/lib/plchost/valves && chgrp plchost /var/lib/plchost/valves && chmod 660 /var/lib/plchost/valves'
on_machine sh -c 'cat /applications/instances >>/etc/plchost/plchost.toml && systemctl reload plchostd' >"$log" 2>&1 || fail "the reload"
until_true 60 plcctl start instance line1 line2 valves
run || fail "they do not run"
until_true 20 registers_are "$driven"
shown=$(instances)

if [ "$kernel" = linux-image-rt-amd64 ]; then
  story "check host --fix sets the machine up: after a boot only what no file can change is left, and isolated cores run all that follows"
  findings() { plcctl check host --json | jq -r '[.[].id] | sort | join(" ")' || true; }
  first=$(findings)
  [[ $first == *isolated_cores* ]] || fail "the core is isolated already: $first"
  on_machine plcctl check host --fix --apply >"$work/applied" 2>"$log" || fail "--apply: $(cat "$work/applied")"
  for command in update-grub "systemctl restart plchost-tuning.service" "/lib/systemd/systemd-sysctl /etc/sysctl.d/60-plchost.conf"; do
    grep -qxF "ran: $command" "$work/applied" || fail "not run: $command: $(cat "$work/applied")"
  done
  on_machine plcctl check host --fix --revert >"$work/applied" 2>"$log" || fail "--revert: $(cat "$work/applied")"
  [ "$(grep -c '^removed' "$work/applied")" = 6 ] || fail "--revert: $(cat "$work/applied")"
  ! on_machine grep -q isolcpus /boot/grub/grub.cfg || fail "grub does not know of --revert"
  on_machine plcctl check host --fix --apply >"$work/applied" 2>"$log" || fail "--apply after --revert: $(cat "$work/applied")"
  on_machine plcctl check host --fix --apply >"$work/applied" 2>"$log" || fail "the second --apply: $(cat "$work/applied")"
  ! grep '^written' "$work/applied" || fail "the second --apply has written"
  # Of the first entry, as grub would start it.
  kernel_line=$(on_machine sed -nE 's/^\s*linux\s+\S+ (.*)/\1/p' /boot/grub/grub.cfg | sed -n '1s/ro\b *//p')
  [[ $kernel_line == *isolcpus=managed_irq,domain,1* ]] || fail "grub starts the kernel with $kernel_line"
  on_machine sed -nE '/recovery/,/^}/s/^\s*linux\s+\S+ (.*)/\1/p' /boot/grub/grub.cfg >"$log"
  ! grep -q isolcpus "$log" || fail "the entry for recovery is set up, too"
  machine_boot_again
  until_true 900 has_booted
  until_true 300 run
  left=$(findings)
  # QEMU is a hypervisor with a clock of its own, and three instances share the core.
  for id in $left; do
    [[ " clock_source machine shared_cores " == *" $id "* ]] || fail "left of $first: $left: $(plcctl check host || true)"
  done
  echo "  of '$first' are left: $left"
  until_true 60 registers_are "$driven"
  shown=$(instances)
fi

if [ "$cuts" -gt 0 ]; then
  story "the power is cut $cuts times while an operator works: what was answered holds"
  power_cuts "$cuts"
  shown=$(instances)
fi

story "each process has its rights, and nobody else has any"
owner=$(on_machine id -u plchost-plc)
# of PROGRAM FIELD: of /proc/PID/status
of() { on_machine sh -c 'sed -n "s/^$2:[[:space:]]*//p" "/proc/$(pgrep -o -x "$1")/status"' _ "$1" "$2" | tr -s '\t ' ' '; }
server=$(on_machine id -u plchost-dds)
group=$(on_machine getent group plchost | cut -d: -f3)
[ "$(of plchost-dds Uid)" = "$server $server $server $server" ] || fail "the API server has the user $(of plchost-dds Uid)"
[ "$(of plchost-dds Gid)" = "$group $group $group $group" ] || fail "the API server has the group $(of plchost-dds Gid)"
[ "$(of plchost-dds CapPrm)" = 0000000000000000 ] || fail "the API server has capabilities: $(of plchost-dds CapPrm)"
[ "$(of plc-instance Uid)" = "$owner $owner $owner $owner" ] || fail "an instance has the user $(of plc-instance Uid)"
limits=$(on_machine sh -c 'sed -nE "s/^Max (realtime priority|locked memory) +([a-z0-9]+) .*/\2/p" "/proc/$(pgrep -o -x plchostd)/limits"' | paste -sd' ')
none=0000000000000000 of_real_time=0000000000804000
expected="$none $none $none $none"
if [ "$limits" != "unlimited 99" ]; then
  [ "$kind" = container ] || fail "the limits of the unit do not hold: $limits"
  echo "  this container cannot raise limits ($limits): instances keep two capabilities instead"
  expected="$of_real_time $of_real_time $none $none"
fi
capabilities=$(for set in CapPrm CapEff CapInh CapAmb; do of plc-instance "$set"; done | paste -sd' ')
[ "$capabilities" = "$expected" ] || fail "an instance has the capabilities $capabilities"
threads() { on_machine sh -c 'ps -L -o comm=,cls=,rtprio= -p "$(pgrep -o -x plc-instance)"'; }
[ "$(threads | awk '$2 == "FF" && $3 > highest { highest = $3 } END { print highest + 0 }')" -ge 52 ] ||
  fail "an instance has no task in real time: $(threads)"
[ "$(of plc-instance VmLck | grep -oE '[0-9]+')" -ge 1000 ] || fail "an instance has locked $(of plc-instance VmLck)"
[ "$(of plc-instance NoNewPrivs)$(of plchost-dds NoNewPrivs)" = 11 ] || fail "they may gain rights"
on_machine sh -c 'journalctl -q --no-pager -u plchostd | grep -q "files: those that it needs"' || fail "the API server sees all files"
exposure=$(on_machine systemd-analyze security --no-pager plchostd.service | sed -n 's/.*level for plchostd.service: \([0-9.]*\) .*/\1/p')
[ "$(jq -n "$exposure < 3")" = true ] || fail "systemd-analyze security: $exposure"
# as USER COMMAND...: with all groups of the user
as() { on_machine setpriv --reuid "$1" --regid "$1" --init-groups "${@:2}"; }
for folder in /run/plchost /var/lib/plchost; do
  as plchost-plc sh -c "touch $folder/made && rm $folder/made" || fail "instances make no file in $folder"
  ! as plchost-dds touch "$folder/planted" 2>>"$log" || fail "the group of the service can make files in $folder"
done
for file in /dev/shm/plchost.transitions.line1 /dev/shm/plchost.host /dev/shm/plchost.log.line1; do
  ! as plchost-dds test -w "$file" || fail "the API server can write $file"
done
for file in /dev/shm/plchost.posts /dev/shm/plchost.host /dev/shm/plchost.log.line1 /var/lib/plchost/wishes.plchost; do
  ! as plchost-plc test -w "$file" || fail "an instance can write $file"
done
for file in /run/plchost/manager.sock /run/plchost/line1.sock /dev/shm/plchost /dev/shm/plchost.instance.line1; do
  ! on_machine setpriv --reuid 65534 --regid 65534 --clear-groups test -r "$file" || fail "everybody can read $file"
  ! on_machine setpriv --reuid 65534 --regid 65534 --clear-groups test -w "$file" || fail "everybody can write $file"
done

story "each instance has a control group of its own, with its limits"
groups=/sys/fs/cgroup/system.slice/plchost-instances.service
process_of() { plcctl list instances --json | jq -r ".[] | select(.name == \"$1\") | .pid"; }
limits_of_line2() { on_machine sh -c 'cd "$1" && cat memory.max memory.oom.group pids.max | paste -sd" "' _ "$groups/plchost.instance.line2"; }
# in_group PROGRAM...: in the group of line2
in_group() { on_machine sh -c 'echo 0 >"$0/cgroup.procs" && exec "$@"' "$groups/plchost.instance.line2" "$@"; }
if on_machine test -e /sys/fs/cgroup/cgroup.controllers; then
  for name in line1 line2 valves; do
    group=$(on_machine cat "/proc/$(process_of "$name")/cgroup")
    [ "$group" = "0::/system.slice/plchost-instances.service/plchost.instance.$name" ] || fail "$name is in $group"
  done
  [ "$(limits_of_line2)" = "536870912 1 200" ] || fail "the limits of line2: $(limits_of_line2)"
  scores=$(on_machine sh -c 'for name in plchostd plc-instance; do cat "/proc/$(pgrep -o -x "$name")/oom_score_adj"; done' | paste -sd' ')
  [ "$scores" = "-900 -950" ] || fail "the OOM scores: $scores"
  left=$(in_group sh -c 'setsid sleep 1000 >/dev/null 2>&1 & echo $!')
  other=$(process_of line1) first=$(process_of line2)
  in_group python3 -c 'b"x" * (1 << 30)' >"$log" 2>&1 && fail "a process of line2 has a GiB"
  has_begun_anew() { [ "$(process_of line2)" != "$first" ] && run; }
  until_true 60 has_begun_anew
  ! on_machine test -e "/proc/$left" || fail "a process of line2 has outlived it"
  [[ $(plcctl list instances --json | jq -r '.[] | select(.name == "line2") | .problem') == *"out of memory: memory_max_mib"* ]] ||
    fail "the problem of line2: $(plcctl list instances --json)"
  [ "$(process_of line1)" = "$other" ] || fail "line1 has ended with it"
  shown=$(instances)
else
  echo "  this container has no control groups of version 2"
fi

story "a restart of the service, an upgrade, a kill and a stop of the manager's process end none of them"
ends_no_plc "systemctl restart" on_machine systemctl restart plchostd
ends_no_plc "an upgrade" on_machine sh -c 'apt-get -q install -y --reinstall /packages/*.deb'
ends_no_plc "a kill of the manager" on_machine systemctl kill --kill-who=main -s KILL plchostd
ends_no_plc "a manager that stands still" on_machine systemctl kill --kill-who=main -s STOP plchostd

[ "$(registers)" = "$driven" ] || fail "outputs have not been driven all along: $(registers)"
if on_machine test -e /sys/fs/cgroup/cgroup.controllers; then
  [ "$(limits_of_line2)" = "536870912 1 200" ] || fail "the limits of line2 after restarts: $(limits_of_line2)"
fi

if [ -n "$before" ]; then
  story "the way back to the packages of a version before, and the upgrade from them, end none of them"
  user_of() { on_machine sh -c 'stat -c %u "/proc/$1"' _ "$(plcctl list instances --json | jq ".[] | select(.name == \"$1\") | .pid")"; }
  restart_all() {
    ends_no_plc "$1" on_machine systemctl restart plchostd
    for name in line1 line2 valves; do plcctl restart instance "$name" >"$log" 2>&1 || fail "no restart of $name"; done
    until_true 60 run
    shown=$(instances)
    for name in line1 line2 valves; do [ "$(user_of "$name")" = "$2" ] || fail "$1: $name is of user $(user_of "$name")"; done
  }
  # A version before may not know the keys.
  on_machine sed -Ei 's/^(instance_user|memory_max_mib|pids_max)/# &/' /etc/plchost/plchost.toml
  restart_all "a restart without instance_user" 0
  ends_no_plc "the packages before" on_machine sh -c 'dpkg -i --force-confold --force-downgrade /applications/before/*.deb'
  ends_no_plc "an upgrade from them" on_machine sh -c 'dpkg -i --force-confold /packages/*.deb'
  on_machine sed -Ei 's/^# (instance_user|memory_max_mib|pids_max)/\1/' /etc/plchost/plchost.toml
  restart_all "a restart with instance_user" "$owner"
  until_true 20 registers_are "$driven"
fi

story "a stop ends them in order, with their outputs in the safe state"
since=$(on_machine date +%s)
on_machine systemctl stop plchostd
[ "$(registers)" = "$safe" ] || fail "outputs after a stop: $(registers)"
order=$(on_machine journalctl -q --no-pager -u plchostd --since "@$since" -o cat |
  sed -nE 's/.*plchostd: instance (line1|valves): (stopping|offline)$/\1 \2/p' | paste -sd,)
[ "$order" = "valves stopping,valves offline,line1 stopping,line1 offline" ] || fail "the order of a stop: $order"
[ "$(on_machine pgrep -c plc-instance)" = 0 ] || fail "instances run on after a stop"
[ -z "$(on_machine ls /dev/shm)" ] || fail "left in /dev/shm: $(on_machine ls /dev/shm)"
has_no_groups() { ! on_machine test -e "$groups"; }
until_true 20 has_no_groups

story "files of another user under its names are taken away and told, and it starts"
on_machine setpriv --reuid 65534 --regid 65534 --clear-groups sh -c 'umask 0; for name in host posts instance.line1; do echo planted >"/dev/shm/plchost.$name"; done'
on_machine systemctl start plchostd
until_true 60 run
[ "$(on_machine journalctl -q --no-pager -u plchostd | grep -c 'was put there by another user (owner 65534')" = 3 ] || fail "the planted files are not told"
[ -z "$(on_machine find /dev/shm -user 65534)" ] || fail "planted files are left: $(on_machine find /dev/shm -user 65534)"

story "a removal keeps the state, and a purge leaves nothing"
on_machine apt-get -q remove -y plchost >"$log" 2>&1 || fail "the removal"
[ "$(on_machine pgrep -c 'plc')" = 0 ] || fail "$(on_machine pgrep -a plc) after the removal"
on_machine test -e /var/lib/plchost || fail "the state is gone"
on_machine test -e /etc/plchost/plchost.toml || fail "the configuration is gone"
on_machine sh -c 'apt-get -q purge -y plchost libplchost-client1 libplcpool1 plchost-dev python3-plchost' >"$log" 2>&1 || fail "the purge"
left=$(diff <(echo "$without") <(files)) || fail "left behind: $left"
echo "all stories of the packages on Debian $suite: passed"
