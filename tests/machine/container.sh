# The machine of run.sh as a container: systemd is process 1, the kernel is that of this machine.
# A file that run.sh sources: it has $root, $packages, $applications and $work.
machine_programs=(debootstrap systemd-nspawn)
machine_packages=ca-certificates,dbus,jq,procps,systemd-sysv
machine_is_emulated=no

machine_start() {
  systemd-nspawn -q -D "$root" --volatile=overlay --register=no --keep-unit --private-network "${machine_rights[@]}" \
    --bind-ro="$packages:/packages" --bind-ro="$applications:/applications" -b --console=read-only >"$work/console" 2>&1 </dev/null &
  machine=$!
  for ((i = 0; i < 50; i++)); do
    leader=$(pgrep -P "$machine" -x systemd) && return
    kill -0 "$machine" 2>/dev/null || cannot "$(tail -n 1 "$work/console")"
    sleep 0.2
  done
  cannot "the container has no systemd after 10 s"
}
# The filter of systemd 252 for containers does not know the last three, which confine the API server.
machine_rights=(--capability=CAP_IPC_LOCK
  --system-call-filter="landlock_create_ruleset landlock_add_rule landlock_restrict_self")

on_machine() { nsenter -t "$leader" -a -- env -i "${machine_environment[@]}" "$@"; }
