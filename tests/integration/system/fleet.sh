# Hosts on one switch, each in a namespace of its own, and a desk from which they are looked after. Sourced in the place of
# common.sh.
. "$(dirname "${BASH_SOURCE[0]}")/spaces.sh"

# An instance that costs next to nothing.
printf '[CmpSchedule]\nSchedulerInterval=100000\nTask.Freewheeling.Cycletime=1000\n[SysTimer]\nLinux.IdleStates=Allow\n' >"$cell/idle.cfg"

# write_member HOST [LINE...]: a host on the switch, with one instance; lines for its [dds]
write_member() {
  local host=$1
  shift
  write_host "$host" "$first_core"
  printf '[dds]\ninterface = "cable"\nallow_unsecured = true\n' >>"$cell/$host.toml"
  [ $# -eq 0 ] || printf '%s\n' "$@" >>"$cell/$host.toml"
  write_instance "$host" line1 "$first_core" packer 'share_core = true' "settings = \"$cell/idle.cfg\""
}

# desk COMMAND...: plcctl at the desk; $desk_options before the command
desk_options=(--interface cable)
desk() { within desk "$BIN/plcctl" --timeout 10 "${desk_options[@]}" "$@"; }
# hosts_seen [STATE]: "a b c"
hosts_seen() { desk list hosts --json | jq -r "[.[] | select(.state == \"${1:-alive}\") | .host] | sort | join(\" \")"; }
sees() { is "$(hosts_seen)" "$1"; }
# of HOST COMMAND...: plcctl at the desk, for one host
of() { desk --host "$@"; }
cycles_of() { of "$1" list tasks --json | jq -r '.[] | select(.task == "Report") | .cycles'; }
pid_of() { of "$1" list instances --json | jq -r '.[0].pid'; }
host_field() { of "$1" list hosts --json | jq -r ".[0].$2"; }
