#!/usr/bin/env bash
# Stories of containers: the host in one of manager/Containerfile; I/O firmware and a second client of the pool in others, by podman.
#   tests/machine/containers.sh [--packages FOLDER] [SUITE]
# SUITE: bookworm or trixie; default: the Debian of this machine. FOLDER: the packages for it, from manager/package.sh, which is
# called without --packages. Nothing of podman is left on this machine.
# As root. Exit code 77: podman runs no container here, and nothing was tested; the last line says why.
set -euo pipefail

packages=
suite=$(. /etc/os-release && echo "$VERSION_CODENAME")
arguments=("$@")
while [ $# -gt 0 ]; do
  case "$1" in
    --packages) packages=$(realpath -e "${2:?"--packages needs a folder"}") && shift ;;
    -h | --help) sed -n '2,/^[^#]/s/^# \{0,1\}//p' "$0"; exit ;;
    -*) echo "tests/machine/containers.sh: unknown option $1; allowed are --packages and --help" >&2; exit 2 ;;
    *) suite=$1 ;;
  esac
  shift
done
cannot() { echo "no containers here: $*; nothing was tested" >&2; exit 77; }
[ "$(id -u)" -eq 0 ] || cannot "only root can lock memory and have priorities in them"
# All of podman's mounts are those of this script, and go with it.
if [ -z "${PLCHOST_OWN_MOUNTS:-}" ]; then
  unshare --mount --propagation private true 2>/dev/null || cannot "mounts are not allowed"
  PLCHOST_OWN_MOUNTS=yes exec unshare --mount --propagation private "$(realpath "$0")" ${arguments[@]+"${arguments[@]}"}
fi
cd "$(dirname "$0")/../.."
for program in podman debootstrap gcc jq; do
  command -v "$program" >/dev/null || cannot "$program is missing; .ci/packages machine installs all that is needed"
done

root=$PWD/.build/machine/$suite-containers
work=$(mktemp -d "${TMPDIR:-/var/tmp}/plchost-containers.XXXXXX")
log=$work/log
group=plchost-${work##*.} # of control groups, where they are needed
told=
clean_up() {
  local code=$?
  [ "$code" -eq 0 ] || [ -n "$told" ] || echo "FAILED: exit code $code; the words of the command stand above" >&2
  remove_all 0 || podman ps --all >&2
  for ((i = 0; i < 20; i++)); do # conmon ends a moment after its container
    find /sys/fs/cgroup -depth -type d -path "*/$group*" -exec rmdir {} + 2>/dev/null && break
    sleep 0.2
  done
  umount "$work/shm" 2>/dev/null || true
  rm -rf --one-file-system "$work" 2>/dev/null || true
}
trap clean_up EXIT
trap 'told=yes; exit 130' INT TERM
fail() {
  told=yes
  echo "FAILED: $*" >&2
  tail -n 30 "$log" >&2
  podman logs --tail 40 plc >&2 2>&1 || true
  exit 1
}
. tests/machine/stories.sh

# Nothing of this machine's own podman is used, or left in it.
runtime=() run=()
podman() {
  TMPDIR=$work command podman --root "$work/storage" --runroot "$work/run" --tmpdir "$work/tmp" --storage-driver vfs --events-backend none \
    --cgroup-manager cgroupfs "${runtime[@]}" "$@"
}
# remove_all SECONDS: so long each may take to stop. Those that share the memory of the host's go before it.
remove_all() {
  local names
  names=$(podman ps --all --format '{{.Names}}' 2>/dev/null | sed '/^plc$/d'; echo plc)
  for name in $names; do podman rm --force --ignore --time "$1" "$name" >"$log" 2>&1 || return 1; done
}

if [ -z "$packages" ]; then
  packages=$PWD/.build/packages
  manager/package.sh "$packages" >"$log" || fail "no packages"
fi
if [ ! -e "$root/made" ]; then
  rm -rf "$root"
  .ci/debian_root "$suite" "$root/debian" ca-certificates >"$log" 2>&1 || { told=yes; cannot "$(tail -n 1 "$log")"; }
  touch "$root/made"
fi
cp /etc/apt/apt.conf.d/* "$root/debian/etc/apt/apt.conf.d/"
tar -C "$root/debian" --exclude='./var/cache/apt/*' -c . | podman import - localhost/debian >"$log" 2>&1 || { told=yes; cannot "$(tail -n 1 "$log")"; }

# The ways to run one, the usual one first. Each later one is for a machine that withholds something: raising limits
# (CAP_SYS_RESOURCE), version 2 of control groups beside version 1, or control groups as a whole.
cores=(--cpuset-cpus "0-$(($(nproc) - 1))")
least=(--ulimit "nofile=$(ulimit -Hn):$(ulimit -Hn)" --ulimit nproc=8192:8192)
usual() { run=("${cores[@]}"); }
low_limits() { run=("${cores[@]}" "${least[@]}"); }
version_1() {
  command -v runc >/dev/null || { echo "runc is missing" >"$log"; return 1; }
  runtime=(--runtime runc) run=("${cores[@]}" "${least[@]}" --cgroup-parent "/$group")
  # A kernel with RT_GROUP_SCHED gives real time to groups only.
  [ -e /sys/fs/cgroup/cpu/cpu.rt_runtime_us ] || return 0
  mkdir -p "/sys/fs/cgroup/cpu/$group"
  echo 800000 >"/sys/fs/cgroup/cpu/$group/cpu.rt_runtime_us" 2>"$log" || return 1
  rights+=(--cpu-rt-runtime 700000)
}
without_groups() {
  command -v crun >/dev/null || { echo "crun is missing" >"$log"; return 1; }
  umount -Rl /sys/fs/cgroup 2>/dev/null || true
  mount -t cgroup2 cgroup2 /sys/fs/cgroup 2>"$log" || return 1
  runtime=(--runtime crun) run=("${least[@]}" --cgroups disabled)
}
way=
for try in usual low_limits version_1 without_groups; do
  runtime=() run=() rights=(--cap-add SYS_NICE --cap-add IPC_LOCK)
  "$try" && podman run --rm --network none "${run[@]}" "${rights[@]}" localhost/debian chrt -f 50 true >"$log" 2>&1 && way=$try && break
  echo "  not the way '$try': $(tail -n 1 "$log")"
done
[ -n "$way" ] || { told=yes; cannot "podman runs none: $(tail -n 1 "$log")"; }
echo "  the way '$way': podman ${runtime[*]} run ${run[*]} ${rights[*]}"
limits=(--ulimit rtprio=99:99 --ulimit memlock=-1:-1)
if podman run --rm --network none "${run[@]}" "${limits[@]}" localhost/debian true >"$log" 2>&1; then
  run+=("${limits[@]}")
else
  echo "  this machine cannot raise limits: instances keep two capabilities instead"
  limits=()
fi

story "the image is made by manager/Containerfile from the packages"
mkdir -p "$work/project/.build/packages" "$work/programs" "$work/applications"
cp -r manager "$work/project"
cp "$packages"/*.deb "$work/project/.build/packages"
# In a changed root, as not every way can build; that is about how the commands in it are run, not about the image.
podman build --isolation chroot --network host --build-arg DEBIAN=localhost/debian -t plchost -f manager/Containerfile "$work/project" \
  >"$log" 2>&1 || fail "the image is not made"
gcc -O2 -shared -fPIC -I instances -o "$work/applications/packer.so" instances/examples/packer/packer.c
cp instances/examples/packer/packer.cfg "$work/applications"
gcc -std=c89 -D_POSIX_C_SOURCE=200809L -O2 -I shm -o "$work/programs/io_terminal" instances/examples/io_terminal/io_terminal.c
for package in "$packages"/libplcpool1_*.deb; do dpkg-deb -x "$package" "$work/pool"; done
gcc -O2 -I shm -o "$work/programs/pool_client" tests/machine/pool_client.c "$(find "$work/pool" -name 'libplcpool.so.1' | head -n 1)" \
  -Wl,--unresolved-symbols=ignore-in-shared-libs
podman run --rm --network none "${run[@]}" --entrypoint cat plchost /etc/plchost/plchost.toml >"$work/image.toml" 2>"$log" || fail "its configuration"
grep -qx 'pool_across_containers = true' "$work/image.toml" || fail "the image is not for several containers: $(cat "$work/image.toml")"
cat "$work/image.toml" - >"$work/plchost.toml" <<TOML

[[instance]]
name = "packer1"
core = $(($(nproc) - 1))
share_core = true
application = "/applications/packer.so"
settings = "/applications/packer.cfg"
TOML

shared=(--ipc shareable --shm-size 256m) joined=(--ipc container:plc)
start_host() { # start_host CONFIGURATION
  podman run -d --name plc --network none "${shared[@]}" "${run[@]}" "${rights[@]}" -v plc-state:/var/lib/plchost \
    -v "$work/applications:/applications:ro" -v "$1:/etc/plchost/plchost.toml" plchost >"$log" 2>&1 || fail "the host does not start"
}
on_host() { podman exec plc "$@"; }
plcctl() { asked on_host plcctl --timeout 20 "$@"; }
# client NAME IMAGE PROGRAM ARGUMENT...: a container that shares /dev/shm with the host's, and nothing else. No rights are added.
client() {
  podman run -d --name "$1" --network none "${joined[@]}" "${run[@]}" -v "$work/programs:/programs:ro" --entrypoint "/programs/$3" "$2" "${@:4}" \
    >"$log" 2>&1 || fail "the container $1 does not start"
}
says() { podman logs "$1" 2>&1 | grep -qF "$2"; }
runs() { plcctl wait instance packer1 --timeout 30; }
process() { plcctl list instances --json | jq -r '.[] | select(.name == "packer1") | .pid'; }
manager() { on_host sh -c 'for p in /proc/[0-9]*; do [ "$(cat "$p/comm")" = plchostd ] && [ "$(cut -d" " -f4 "$p/stat")" = 1 ] && basename "$p"; done; true' 2>/dev/null; }
# finds FIELD PROGRAM: of /proc/PID/status of that program in the container of the host
finds() { on_host sh -c 'grep -lx "$2" /proc/[0-9]*/comm | head -n 1 | xargs dirname | xargs -I{} sed -n "s/^$1:[[:space:]]*//p" {}/status' _ "$1" "$2" | tr -s '\t ' ' '; }

story "host, an instance and the API server run in one container, each with its rights"
start_host "$work/plchost.toml"
until_true 60 runs
[ "$(plcctl list hosts --json | jq -r '.[].host')" = plchost ] || fail "no host: $(plcctl list hosts)"
[ "$(on_host cat /proc/1/comm)" = plchost-contain ] || fail "process 1 is $(on_host cat /proc/1/comm)"
for user in plc-instance:plchost-plc plchost-dds:plchost-dds; do
  id=$(on_host id -u "${user#*:}")
  [ "$(finds Uid "${user%:*}")" = "$id $id $id $id" ] || fail "${user%:*} has the user $(finds Uid "${user%:*}")"
done
expected=0000000000804000
[ ${#limits[@]} -eq 0 ] || expected=0000000000000000
[ "$(finds CapPrm plc-instance)" = "$expected" ] || fail "an instance has the capabilities $(finds CapPrm plc-instance)"
[ "$(finds CapPrm plchost-dds)" = 0000000000000000 ] || fail "the API server has the capabilities $(finds CapPrm plchost-dds)"
[ "$(finds VmLck plc-instance | cut -d' ' -f1)" -gt 1000 ] || fail "an instance has locked $(finds VmLck plc-instance)"
fifo=$(on_host sh -c 'for t in /proc/$1/task/*/stat; do sed "s/.*) //" "$t" | cut -d" " -f39; done | grep -c "^1$"' _ "$(process)")
[ "$fifo" -ge 2 ] || fail "$fifo threads of the instance are real-time"

story "check host says that it is in a container, and of which kind"
plcctl check host --all --json >"$work/findings" 2>"$log" || true
[[ "$(jq -r '.[] | select(.id == "container") | .found' "$work/findings")" == *"/run/.containerenv says that this is one"* ]] ||
  fail "check host: $(cat "$work/findings")"

story "I/O firmware in a second container drives the outputs, and a client in a third one posts events"
client terminal localhost/debian io_terminal --pool plchost --name terminal1
client poster plchost pool_client post packer1/product 720
until_true 20 says poster "posted 720"
# 720 products are two pallets, which the terminal echoes to the inputs.
until_true 20 says plc "products 720, cartons 60 (on the belt 0), layers 10, pallets 2, panel 2"

story "each of them is process 1, and none is taken for another one"
client holder plchost pool_client hold press
until_true 20 says holder "process 1 holds press"
sleep 3 # the manager looks each second
plcctl list objects press* --json >"$work/objects" 2>"$log" || fail "list objects"
[ "$(jq -r '.[] | select(.object == "press.memory") | .references[0] | "\(.pid) \(.program)"' "$work/objects")" = "0 pool_client" ] ||
  fail "holders: $(cat "$work/objects")"
plcctl list objects 'press*' >"$work/objects" 2>"$log" || fail "list objects"
grep -q "held by pool_client of another container, thread 1 there" "$work/objects" || fail "the mutex: $(cat "$work/objects")"
client taker plchost pool_client take press
until_true 20 says taker "timed out"

story "a killed manager costs no PLC, and takes nothing from clients in other containers"
before=$(process) ended=$(manager)
on_host sh -c "kill -KILL $ended"
is_another() { local now; now=$(manager) && [ -n "$now" ] && [ "$now" != "$ended" ]; }
until_true 30 is_another
until_true 60 runs
[ "$(process)" = "$before" ] || fail "packer1 was process $before, and is $(process)"
says plc adopted || fail "no word of the adoption"
podman restart --time 0 taker >"$log" 2>&1 || fail "taker"
timed_out_twice() { [ "$(podman logs taker 2>&1 | grep -c 'timed out')" = 2 ]; }
until_true 20 timed_out_twice

story "a killed client is seen by all: the next one gets its mutex and is told, and its memory goes"
podman kill holder >"$log" 2>&1 || fail "holder"
podman restart --time 0 taker >"$log" 2>&1 || fail "taker"
until_true 20 says taker "its owner has ended"
has_no_memory() { ! on_host test -e /dev/shm/plchost.memory.press.memory; }
until_true 20 has_no_memory

story "killed firmware and a killed instance find each other again"
podman kill terminal >"$log" 2>&1 && podman rm terminal >"$log" 2>&1 || fail "terminal"
client terminal localhost/debian io_terminal --pool plchost --name terminal1
on_host sh -c "kill -KILL $(process)"
is_another_instance() { runs && [ "$(process)" != "$before" ]; }
until_true 60 is_another_instance
podman rm poster >"$log" 2>&1 || fail "poster"
client poster plchost pool_client post packer1/product 360
until_true 20 says plc "products 1080, cartons 90 (on the belt 0), layers 15, pallets 3, panel 3"

story "SIGHUP takes over a changed configuration"
sed -n '/^\[\[instance/,$p' "$work/plchost.toml" | sed 's/packer1/packer2/; /^settings/d' >"$work/packer2" # without a terminal
cat "$work/packer2" >>"$work/plchost.toml"
podman kill --signal HUP plc >"$log" 2>&1 || fail "SIGHUP"
until_true 60 plcctl wait instance packer2 --timeout 1

story "a stop ends all in order, and the next container of the host goes on with its retain variables"
podman stop --time 30 plc >"$log" 2>&1 || fail "the stop"
[ "$(podman inspect --format '{{.State.ExitCode}}' plc)" = 0 ] || fail "exit code $(podman inspect --format '{{.State.ExitCode}}' plc)"
says plc "packer1: offline" || fail "no word of an end in order"
remove_all 0 || fail "rm"
start_host "$work/plchost.toml"
until_true 60 runs
until_true 20 says plc "products 1080, cartons 90 (on the belt 0), layers 15, pallets 3"

story "with a /dev/shm that outlives it and keep_pool, firmware goes on when the container of the host is made anew"
remove_all 30 || fail "rm"
sed -i 's/^\[host\]$/&\nkeep_pool = true/' "$work/plchost.toml"
mkdir "$work/shm" && mount -t tmpfs -o mode=1777,size=256m tmpfs "$work/shm"
shared=(-v "$work/shm:/dev/shm") joined=("${shared[@]}")
start_host "$work/plchost.toml"
until_true 60 runs
client terminal localhost/debian io_terminal --pool plchost --name terminal1
client poster plchost pool_client post packer1/product 360
until_true 20 says plc "products 1440, cartons 120 (on the belt 0), layers 20, pallets 4, panel 4"
# The stop comes just when the manager has been killed: the next one ends the PLCs in order.
on_host sh -c "kill -KILL $(manager) && kill -TERM 1" >"$log" 2>&1 || true
is_stopped() { [ "$(podman inspect --format '{{.State.Status}} {{.State.ExitCode}}' plc)" = "exited 0" ]; }
until_true 60 is_stopped
says plc "packer1: offline" || fail "no word of an end in order"
podman rm plc >"$log" 2>&1 || fail "rm"
start_host "$work/plchost.toml"
until_true 60 runs
podman restart --time 0 poster >"$log" 2>&1 || fail "poster"
until_true 20 says plc "products 1800, cartons 150 (on the belt 0), layers 25, pallets 5, panel 5"

story "without pool_across_containers a client of another container is refused, and told of the key"
remove_all 30 || fail "rm"
shared=(--ipc shareable --shm-size 256m) joined=(--ipc container:plc) # the kept pool is for several
sed -i 's/^pool_across_containers = true/pool_across_containers = false/' "$work/plchost.toml"
start_host "$work/plchost.toml"
until_true 60 runs
client poster plchost pool_client post packer1/product 1
until_true 20 says poster "pool_across_containers = true"

story "a manager that cannot start ends the container, which says why"
remove_all 30 || fail "rm"
echo 'nonsense = 1' >>"$work/plchost.toml"
start_host "$work/plchost.toml"
has_ended() { [ "$(podman inspect --format '{{.State.Status}} {{.State.ExitCode}}' plc)" = "exited 1" ]; }
until_true 20 has_ended
says plc nonsense || fail "no word of the wrong key"
echo "all stories of containers on Debian $suite: passed"
