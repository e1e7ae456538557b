#!/usr/bin/env bash
# Instances have a user of their own: they do all that they did before, in real time, and nothing to the manager, the API server
# and the files of others. The manager has the rights that its unit gives it.
. "$(dirname "$0")/common.sh"

[ "$(id -u)" -eq 0 ] || { echo "only root can start programs as other users"; exit 77; }
for program in setpriv pgrep python3; do
  command -v "$program" >/dev/null || { echo "no $program"; exit 77; }
done
# Numbers that no account has.
server_user=64042 group=64041 user=64043
chmod 711 "$cell"
setpriv --reuid "$user" --regid "$group" --clear-groups test -x "$cell" ||
  fail "user $user may not enter $cell, or a folder above it"
mkdir -m 755 "$cell/applications"
cp "$APPLICATIONS"/{packer,task_faults,online_1,online_2,manager_fails_at_start}.so "$cell/applications"
chmod 644 "$cell/applications"/*.so
APPLICATIONS=$cell/applications
printf '[CmpSchedule]\nTask.Freewheeling.Cycletime=10\n' >"$cell/applications/line.cfg"

rights=(setpriv --regid "$group" --clear-groups --no-new-privs --bounding-set=-all,+sys_nice,+ipc_lock,+setuid,+setgid
  --inh-caps=-all)
# start_service LIMITS: as start_manager; `unlimited`: the unit's limits, by which a process needs no capability
start_service() {
  (umask 0027 && { [ "$1" != unlimited ] || ulimit -r 99 -l unlimited; } && exec "${rights[@]}" "$BIN/plchostd" --config "$cell/cell1.toml" 2>>"$cell/cell1.log") &
  managers+=($!)
}
# Without a word to the instances, and with the configuration of now.
next_manager() {
  kill -KILL "$manager" && wait "$manager" 2>/dev/null || true
  start_service given
  manager=${managers[-1]}
}
# status PID FIELD: of /proc/PID/status, its words with single spaces
status() { sed -n "s/^$2:\t*//p" "/proc/$1/status" | tr -s '\t ' ' '; }
server() { pgrep -f "^$BIN/plchost-dds --host cell1 .*$cell/" || true; }
# as_member COMMAND...: as another user of the manager's group
as_member() { setpriv --reuid "$server_user" --regid "$group" --clear-groups --no-new-privs --bounding-set=-all --inh-caps=-all "$@"; }
# has_list FILE: an access list lets the user of instances, and not the group. Some file systems have none.
has_list() {
  python3 -c 'import os, sys; os.getxattr(sys.argv[1], "system.posix_acl_access")' "$1" 2>/dev/null || { echo "  no access list: $1"; return 1; }
}
# as_instance COMMAND...: with the rights of an instance
as_instance() { setpriv --reuid "$user" --regid "$group" --groups "$user" --no-new-privs --bounding-set=-all --inh-caps=-all "$@"; }
user_is() { is "$(status "$(instance "$1" pid)" Uid)" "$2 $2 $2 $2"; }
runs_as() { state_is "$1" running && user_is "$1" "$2"; }
all_run_as() { runs_as line1 "$1" && runs_as line2 "$1" && runs_as line3 "$1"; }
# products N: line1, which says so once a second, has counted so many
products() {
  local from
  from=$(wc -l <"$cell/cell1.log")
  counted() { tail -n "+$((from + 1))" "$cell/cell1.log" | grep -q "line1.*products $1, "; }
  until_true 20 counted "$1"
}
# is_real_time NAME: its tasks have SCHED_FIFO, all of its memory is locked, and its threads are on its core
is_real_time() {
  local pid highest
  pid=$(instance "$1" pid)
  highest=$(ps -L -o cls=,rtprio= -p "$pid" | sed -n 's/^ *FF *//p' | sort -n | tail -1)
  [ "${highest:-0}" -ge 52 ] || fail "$1 has no task in real time: $(ps -L -o comm=,cls=,rtprio= -p "$pid")"
  [ "$(status "$pid" VmLck | grep -oE '[0-9]+')" -ge 1000 ] || fail "$1 has locked $(status "$pid" VmLck)"
  echo "  $1: SCHED_FIFO up to $highest, $(status "$pid" VmLck | xargs) locked"
  is "$(cat "/proc/$pid/task"/*/status | sed -n 's/^Cpus_allowed_list:\t//p' | sort -u)" "$first_core" || fail "$1 is on other cores, too"
}
capabilities() { for set in CapEff CapPrm CapInh CapAmb; do status "$1" "$set"; done | paste -sd' '; }
none=0000000000000000

write_host cell1 "$first_core"
write_instance cell1 line1 "$first_core" packer 'share_core = true' "settings = \"$cell/applications/line.cfg\""
write_instance cell1 line2 "$first_core" task_faults 'share_core = true'
write_instance cell1 line3 "$first_core" online_1 'share_core = true'
sed -i "/^\[host\]/a instance_user = \"$user\"" "$cell/cell1.toml"
sed -i "/^\[host\]/i [dds]\nuser = \"$server_user\"\n" "$cell/cell1.toml"

if (ulimit -r 99 -l unlimited) 2>/dev/null; then
  echo "- with the limits of the unit an instance needs no capability, and has its priorities and its memory"
  start_service unlimited
  until_true 60 all_run_as "$user"
  for name in line1 line2 line3; do
    pid=$(instance "$name" pid)
    is "$(capabilities "$pid")" "$none $none $none $none" || fail "$name: $(capabilities "$pid")"
    is_real_time "$name"
  done
  kill -TERM "${managers[-1]}" && wait "${managers[-1]}" || fail "the manager ended with $?"
  nothing_left
fi

echo "- without them it has the two for real time; another user, the manager's group, and no way to more"
ulimit -r 0
ulimit -l 64
start_service given
manager=${managers[-1]}
until_true 60 all_run_as "$user"
pid=$(instance line1 pid)
is "$(status "$pid" Gid)" "$group $group $group $group" || fail "its group: $(status "$pid" Gid)"
is "$(status "$pid" Groups | xargs -n1 | sort -u | paste -sd' ')" "$group $user" || fail "its groups: $(status "$pid" Groups)"
is "$(status "$pid" NoNewPrivs)" 1 || fail "it may gain rights"
is "$(status "$pid" Seccomp)" 2 || fail "it has no filter of system calls"
of_real_time=$(printf '%016x' $(((1 << 23) | (1 << 14))))
is "$(capabilities "$pid")" "$of_real_time $of_real_time $none $none" || fail "its capabilities: $(capabilities "$pid")"
for name in line1 line2 line3; do is_real_time "$name"; done
is "$(status "$(server)" Uid)" "$server_user $server_user $server_user $server_user" || fail "the API server: $(status "$(server)" Uid)"

echo "- it does what it did: retain variables, exceptions, downloads, online changes, variables, logs"
post() { plcctl post event line1/product >/dev/null; }
for _ in 1 2 3; do post; done
products 3
plcctl post event line2/divide >/dev/null
faulted() { is "$(plcctl show exception line2 --json | jq -r '.[0].count')" "$1"; }
until_true 20 faulted 1
plcctl reset instance line2 && plcctl start instance line2 || fail "line2 after its exception"
plcctl load application line3 "$APPLICATIONS/online_2.so" --online >"$cell/answer.log" || fail "no online change: $(cat "$cell/answer.log")"
grep -q "taken over between two cycles" "$cell/answer.log" || fail "$(cat "$cell/answer.log")"
! answer=$(plcctl load application line3 "$APPLICATIONS/manager_fails_at_start.so" 2>&1) || fail "an application that does not come up: $answer"
grep -q "is started again" <<<"$answer" || fail "the application before is not started again: $answer"
until_true 30 runs_as line3 "$user"
plcctl register event line1/extra >/dev/null || fail "no event is registered"
plcctl logs line1 -n 1 >/dev/null && plcctl list objects >/dev/null || fail "it shows less"
plcctl reset statistics line1 >/dev/null || fail "a command"

echo "- a process that is killed comes again, with its values"
kill -KILL "$pid"
is_another() { state_is line1 running && [ "$(instance line1 pid)" != "$pid" ]; }
until_true 30 is_another
user_is line1 "$user" || fail "line1: $(status "$(instance line1 pid)" Uid)"
products 3

echo "- it cannot touch the manager, the API server, what they keep, and files of others"
state=$cell/cell1.state
for folder in "$cell/cell1" "$state"; do
  is "$(stat -c '%u %g %a' "$folder")" "0 $group 1771" || fail "the rights of $folder: $(ls -ld "$folder")"
  as_instance sh -c "touch '$folder/made' && rm '$folder/made'" || fail "it makes no file in $folder"
  ! has_list "$folder" || ! as_member touch "$folder/planted" 2>/dev/null || fail "each user of the group can make files in $folder"
done
as_instance test -w "/dev/shm/$pool-cell1.transitions.line1" || fail "it cannot write its changes of state"
! has_list "/dev/shm/$pool-cell1.transitions.line1" || ! as_member test -w "/dev/shm/$pool-cell1.transitions.line1" || fail "each user of the group can write its changes of state"
touch "$cell/others" && chmod 600 "$cell/others"
for file in "$state/wishes.cell1" "$state/applications.cell1" "$state/applications.cell1/line3" "$state/applications.cell1/line3/000001.so" \
  "$state/audit.cell1" "$cell/cell1/manager.lock" "$cell/others" "/dev/shm/$pool-cell1.host" "/dev/shm/$pool-cell1.wish.line1" \
  "/dev/shm/$pool-cell1.log.line1"; do
  [ -e "$file" ] || fail "there is no $file"
  ! as_instance test -w "$file" || fail "it can write $file: $(ls -ld "$file")"
done
for file in "$state/wishes.cell1" "$state/audit.cell1" "/dev/shm/$pool-cell1.wish.line1" "/dev/shm/$pool-cell1.posts"; do
  [ -e "$file" ] || fail "there is no $file"
  ! as_instance test -w "$file" || fail "it can write $file: $(ls -ld "$file")"
  ! as_instance test -r "$file" || fail "it can read $file: $(ls -ld "$file")"
done
for name in wishes.cell1 applications.cell1 audit.cell1; do
  ! as_instance mv "$state/$name" "$state/$name.away" 2>/dev/null || fail "it can put $name away"
done
for name in manager.sock manager.lock; do
  ! as_instance rm -f "$cell/cell1/$name" 2>/dev/null || fail "it can remove $name"
  ! as_instance mv "$cell/cell1/$name" "$cell/cell1/$name.away" 2>/dev/null || fail "it can put $name away"
done
for process in "$manager" "$(server)"; do
  ! as_instance kill -0 "$process" 2>/dev/null || fail "it can signal process $process"
done
# Its packets are not answered, and nothing happens: the connection ends. Python may lie where only root reads.
answer=$(python3 - "$cell/cell1/manager.sock" "$user" "$group" <<'PY'
import os, socket, sys
user, group = int(sys.argv[2]), int(sys.argv[3])
os.setgroups([user])
os.setresgid(group, group, group)
os.setresuid(user, user, user)
link = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
link.settimeout(10)
link.connect(sys.argv[1])
try:
    link.send(b'{}')
    print('answered' if link.recv(16384) else 'ended')
except ConnectionError:
    print('ended')
PY
)
is "$answer" ended || fail "the manager serves an instance: $answer"

echo "- files that it has put under the manager's names are not believed"
kill -KILL "$manager" && wait "$manager" 2>/dev/null || true
line1=$(pgrep -f "^$BIN/plc-instance --name line1 .*$cell/")
rm "$cell/cell1/manager.lock" "$cell/cell1/manager.sock" "/dev/shm/$pool-cell1.host"
as_instance touch "$cell/cell1/manager.lock" "$cell/cell1/manager.sock" "/dev/shm/$pool-cell1.host" "/dev/shm/$pool-cell1.wish.line9"
as_instance sh -c "echo 1 >'$cell/cell1/core$first_core.latency'"
start_service given
manager=${managers[-1]}
until_true 60 all_run_as "$user"
is "$(instance line1 pid)" "$line1" || fail "line1 is another process: it was not adopted"
is "$(find "$cell/cell1/manager.lock" "$cell/cell1/manager.sock" "/dev/shm/$pool-cell1.host" -user "$user")" "" || fail "planted files are used"
[ ! -e "/dev/shm/$pool-cell1.wish.line9" ] || fail "a planted wish is left"
rm "$cell/cell1/core$first_core.latency"
products 3

echo "- changes of state that it has overwritten keep none of them from its start, nor does an empty flight recorder"
rm "/dev/shm/$pool-cell1.recorder.line1"
as_member touch "/dev/shm/$pool-cell1.recorder.line1"
printf overwritten | as_instance dd of="/dev/shm/$pool-cell1.transitions.line1" conv=notrunc status=none
kill -KILL "$line1"
is_another() { state_is line1 running && [ "$(instance line1 pid)" != "$line1" ]; }
until_true 30 is_another
line1=$(pgrep -f "^$BIN/plc-instance --name line1 .*$cell/")
plcctl list transitions line1 >/dev/null || fail "no changes of state"
[ -s "/dev/shm/$pool-cell1.recorder.line1" ] || grep -q 'there is no flight recorder' "$cell/cell1.log" || fail "nothing tells that it has none"
products 3

echo "- without the key the next processes are the manager's user, with the files of the other"
sed -i '/^instance_user = /d' "$cell/cell1.toml"
next_manager
until_true 60 all_run_as "$user"
is "$(instance line1 pid)" "$line1" || fail "line1 is another process: it was not adopted"
post
products 4
kill -KILL "$line1"
until_true 60 runs_as line1 0
products 4
is "$(stat -c %u "/dev/shm/$pool-cell1.memory.line1.retain")" 0 || fail "its retain variables are the other user's"
plcctl restart instance line2 >/dev/null || fail "no restart of line2"
until_true 60 runs_as line2 0
faulted 1 || fail "its exceptions are lost: $(plcctl show exception line2)"
plcctl post event line2/divide >/dev/null
until_true 20 faulted 2
plcctl reset instance line2 && plcctl start instance line2 || fail "line2 after its exception"
post
products 5
kill -TERM "$manager" && wait "$manager" || fail "the manager ended with $?"
nothing_left
start_service given
manager=${managers[-1]}
until_true 60 all_run_as 0
products 5
post
products 6

echo "- with the key again they are the other user's, with the files of the manager's"
sed -i "/^\[host\]/a instance_user = \"$user\"" "$cell/cell1.toml"
next_manager
until_true 60 all_run_as 0
kill -KILL "$(instance line1 pid)"
until_true 60 runs_as line1 "$user"
products 6
is "$(stat -c %u "/dev/shm/$pool-cell1.memory.line1.retain")" "$user" || fail "its retain variables are the manager's"
for name in line2 line3; do plcctl restart instance "$name" >/dev/null || fail "no restart of $name"; done
until_true 60 all_run_as "$user"
faulted 2 || fail "its exceptions are lost: $(plcctl show exception line2)"
plcctl post event line2/divide >/dev/null
until_true 20 faulted 3
plcctl reset instance line2 || fail "no reset"
post
products 7
plcctl reset instance line1 --cold >/dev/null && plcctl start instance line1 >/dev/null || fail "no cold reset"
post
products 1
kill -TERM "$manager" && wait "$manager" || fail "the manager ended with $?"
nothing_left
start_service given
manager=${managers[-1]}
until_true 60 runs_as line1 "$user"
products 1

echo "- a user that it cannot become keeps it from starting, and the reason is told"
kill -TERM "$manager" && wait "$manager" || fail "the manager ended with $?"
nothing_left
rights=(setpriv --regid "$group" --clear-groups --no-new-privs --bounding-set=-all,+sys_nice,+ipc_lock --inh-caps=-all)
start_service given
says_why() { grep -q '\[host\] instance_user: .*cannot become user 64043: that takes root with CAP_SETUID and CAP_SETGID' "$cell/cell1.log"; }
until_true 30 says_why
kill -TERM "${managers[-1]}" && wait "${managers[-1]}" || true
nothing_left
