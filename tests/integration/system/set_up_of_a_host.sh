#!/usr/bin/env bash
# 'plcctl check host --fix' below the root of an image: the files that it prints, writes and takes away, and the states of that
# root in which it writes nothing. No test writes in the /etc of this machine.
. "$(dirname "$0")/common.sh"

image=$cell/image
config=$image/etc/plchost/plchost.toml
# new_image CORES: a root with grub's files, with four cores of which each instance has one
new_image() {
  rm -rf "$image"
  mkdir -p "$image"/etc/{plchost,default/grub.d,sysctl.d,udev/rules.d,systemd/system/multi-user.target.wants} "$image/sys/devices/system/cpu" \
    "$image/usr/sbin"
  touch "$image/usr/sbin/update-grub"
  echo 'GRUB_CMDLINE_LINUX_DEFAULT="quiet"' >"$image/etc/default/grub"
  echo 'GRUB_CMDLINE_LINUX_DEFAULT="$GRUB_CMDLINE_LINUX_DEFAULT splash"' >"$image/etc/default/grub.d/50-image.cfg"
  echo 0-3 >"$image/sys/devices/system/cpu/online"
  printf '[host]\nname = "press"\n' >"$config"
  for core; do
    printf '\n[[instance]]\nname = "line%s"\ncore = %s\napplication = "/opt/line.so"\n' "$core" "$core" >>"$config"
  done
}
fix() { plcctl check host --fix --root "$image" "$@"; }
# All that is in the image, with contents, rights, targets, and the moments of the last change.
state() { (cd "$image" && find . -printf '%p %y %m %l %C@\n' | sort && find . -type f -exec sha256sum {} + | sort); }
# refused TEXT OPTION...: with exit code 1 and this text, and nothing is changed
refused() {
  local text=$1 before code=0 said
  shift
  before=$(state)
  said=$(fix "$@" 2>&1) || code=$?
  is "$code" 1 || fail "exit code $code instead of 1, of '$text': $said"
  grep -qF -- "$text" <<<"$said" || fail "instead of '$text': $said"
  is "$(state)" "$before" || fail "'$text' has changed the image"
}
# As grub-mkconfig reads them.
kernel_line() { sh -ec '. "$0/etc/default/grub"; for x in "$0"/etc/default/grub.d/*.cfg; do . "$x"; done; echo "$GRUB_CMDLINE_LINUX_DEFAULT"' "$image"; }
words="isolcpus=managed_irq,domain,2-3 nohz_full=2-3 rcu_nocbs=2-3 irqaffinity=0-1 preempt=full"
files=(/etc/default/grub.d/plchost.cfg /etc/sysctl.d/60-plchost.conf /etc/systemd/system/plchost-tuning.service
  /etc/systemd/system/multi-user.target.wants/plchost-tuning.service /etc/systemd/system/irqbalance.service.d/60-plchost.conf
  /etc/udev/rules.d/60-plchost.rules)

# It prints and writes nothing; then it writes what it has printed; then nothing more.
new_image 2 3
before=$(state)
plan=$(fix)
is "$(state)" "$before" || fail "--fix alone has written"
for file in "${files[@]}"; do grep -qxF "new: $image$file" <<<"$plan" || fail "the plan has no $file: $plan"; done
grep -q '^not looked at: .*memory_lock' <<<"$plan" || fail "no reasons: $plan"
applied=$(fix --apply)
for file in "${files[@]}"; do grep -qxF "written: $image$file" <<<"$applied" || fail "not written: $file: $applied"; done
grep -qx 'to run in it: update-grub' <<<"$applied" || fail "nothing is to be run: $applied"
! grep -q 'try-restart irqbalance' <<<"$applied" || fail "irqbalance is not there, and would be started anew"
mkdir -p "$image/lib/systemd/system"
touch "$image/lib/systemd/system/irqbalance.service"
grep -qx 'to run: systemctl try-restart irqbalance.service' < <(fix) || fail "irqbalance would go on with all cores"
rm -r "$image/lib"
is "$(kernel_line)" "quiet splash $words" || fail "the command line of the kernel: $(kernel_line)"
while read -r line; do
  grep -qxF "    $line" <<<"$plan" || fail "was not in the plan: $line"
done < <(cat "$image/etc/default/grub.d/plchost.cfg" "$image/etc/sysctl.d/60-plchost.conf" "$image/etc/udev/rules.d/60-plchost.rules")
! command -v systemd-analyze >/dev/null || { said=$(SYSTEMD_LOG_TARGET=console systemd-analyze verify "$image/etc/systemd/system/plchost-tuning.service" 2>&1 || true)
  ! grep -q 'plchost-tuning.service:[0-9]' <<<"$said" || fail "systemd does not read the unit: $said"; }
# Its commands, as systemd hands them to the shell.
while read -r command; do
  sh -nc "$command" || fail "no shell reads: $command"
done < <(sed -n "s/^ExecStart=-\/bin\/sh -c '\(.*\)'$/\1/p" "$image/etc/systemd/system/plchost-tuning.service" | sed 's/\$\$/$/g')
after=$(state)
is "$(fix --apply | grep -c '^is there: ')" 6 || fail "the second --apply has written"
is "$(state)" "$after" || fail "the second --apply has changed something"

# Other cores, and a file that lost its end.
sed -i 's/core = 2/core = 1/' "$config"
truncate -s 60 "$image/etc/sysctl.d/60-plchost.conf"
echo half >"$image/etc/udev/rules.d/60-plchost.rules.plchost-new"
fix --apply >"$cell/said" || fail "other cores: $(cat "$cell/said")"
is "$(kernel_line)" "quiet splash isolcpus=managed_irq,domain,1,3 nohz_full=1,3 rcu_nocbs=1,3 irqaffinity=0,2 preempt=full" || fail "$(kernel_line)"
grep -q 'watchdog_cpumask = 0,2' "$image/etc/sysctl.d/60-plchost.conf" || fail "the file that lost its end is not mended"

# The way back, also without a configuration. Folders and the files of others stay.
rm "$config"
fix --revert >"$cell/said" || fail "the way back: $(cat "$cell/said")"
grep -q '^with a reboot: ' "$cell/said" || fail "it does not say what a reboot brings: $(cat "$cell/said")"
is "$(cd "$image" && find . ! -type d | sort | paste -sd' ')" "./etc/default/grub ./etc/default/grub.d/50-image.cfg ./sys/devices/system/cpu/online ./usr/sbin/update-grub" ||
  fail "after --revert: $(cd "$image" && find . ! -type d)"
[ ! -e "$image/etc/systemd/system/irqbalance.service.d" ] || fail "a folder is left"
# A --revert that was cut before its programs has a second one that runs them.
fix --revert >"$cell/said" || fail "the second --revert"
grep -qx "plchost has no file here" "$cell/said" || fail "the second --revert: $(cat "$cell/said")"
grep -qx 'to run in it: update-grub' "$cell/said" || fail "the second --revert runs nothing: $(cat "$cell/said")"

# By 'systemctl enable' of an earlier unit, which had [Install].
new_image 2 3
ln -s /etc/systemd/system/plchost-tuning.service "$image${files[3]}"
fix --apply >/dev/null || fail "a link as systemctl makes it"
is "$(readlink "$image${files[3]}")" ../plchost-tuning.service || fail "the link is $(readlink "$image${files[3]}")"
! grep -qF '[Install]' "$image${files[2]}" || fail "systemctl would make a link of its own"
ln -sf /etc/systemd/system/plchost-tuning.service "$image${files[3]}"
fix --revert >/dev/null || fail "--revert with a link as systemctl makes it"
[ ! -L "$image${files[3]}" ] || fail "a link to nowhere is left"

# Huge pages: for those that ask only, unless the operator has turned them off.
new_image 2 3
fix --apply >/dev/null
pages=$(sed -n "s/^ExecStart=-\/bin\/sh -c '\(.*transparent_hugepage.*\)'$/\1/p" "$image${files[2]}")
[ -n "$pages" ] || fail "no command for huge pages"
mkdir "$cell/pages"
for kept in "always madvise [never]" "always [madvise] never" "[always] madvise never"; do
  echo "$kept" >"$cell/pages/enabled"
  sh -c "${pages//\/sys\/kernel\/mm\/transparent_hugepage/$cell\/pages}" || true
  [ "${kept:0:1}" != "[" ] || kept=madvise
  is "$(cat "$cell/pages/enabled")" "$kept" || fail "instead of $kept: $(cat "$cell/pages/enabled")"
done

# Two names of one file: with the other one it could be changed.
ln "$image${files[1]}" "$image/other_name"
fix --apply | grep -qxF "written: $image${files[1]}" || fail "a file with two names stays"

# An empty root without grub: another boot loader has to give the words.
new_image 2 3
rm -r "$image/usr" "$image/etc/default" "$image/etc/udev" "$image/etc/systemd" "$image/etc/sysctl.d"
fix --apply >"$cell/said" || fail "an empty root: $(cat "$cell/said")"
grep -qxF "by hand: there is no update-grub: let the boot loader give the kernel: $words" "$cell/said" || fail "$(cat "$cell/said")"
[ ! -e "$image/etc/default" ] || fail "a file for a grub that is not there"
# A left-over of grub is no grub.
new_image 2 3
rm -r "$image/usr"
fix --apply >"$cell/said" || fail "without update-grub: $(cat "$cell/said")"
grep -qxF "by hand: there is no update-grub: let the boot loader give the kernel: $words" "$cell/said" || fail "$(cat "$cell/said")"

# With any of these in the way, nothing is written at all.
for file in "${files[@]}"; do
  new_image 2 3
  mkdir -p "$image$(dirname "$file")"
  echo "# of another" >"$image$file"
  refused "$file is" --apply
  fix --apply >/dev/null 2>&1 || true
  is "$(cat "$image$file")" "# of another" || fail "$file was written over"
done
fix --revert >/dev/null 2>"$cell/said" && fail "--revert takes the file of another away"
grep -qF "left as it is: $image${files[-1]}" "$cell/said" || fail "$(cat "$cell/said")"
new_image 2 3
ln -s "$cell/outside" "$image/etc/sysctl.d/60-plchost.conf"
refused "no plain file" --apply
new_image 2 3
rmdir "$image/etc/udev/rules.d"
mkdir -p "$cell/outside"
ln -s "$cell/outside" "$image/etc/udev/rules.d"
refused "where a folder has to be" --apply
[ -z "$(ls "$cell/outside")" ] || fail "written outside of the image"
new_image 2 3
echo 'GRUB_CMDLINE_LINUX_DEFAULT="$GRUB_CMDLINE_LINUX_DEFAULT isolcpus=1"' >"$image/etc/default/grub.d/99-mine.cfg"
refused "99-mine.cfg has isolcpus= too" --apply
new_image 2 3
echo 'GRUB_CMDLINE_LINUX_DEFAULT="quiet"' >"$image/etc/default/grub.d/99-first.cfg"
echo 'GRUB_CMDLINE_LINUX_DEFAULT="${GRUB_CMDLINE_LINUX_DEFAULT} last"' >"$image/etc/default/grub.d/vendor.cfg"
fix >/dev/null || fail "files that take nothing away"
echo '  export GRUB_CMDLINE_LINUX_DEFAULT="quiet"' >>"$image/etc/default/grub.d/vendor.cfg"
refused "vendor.cfg sets GRUB_CMDLINE_LINUX_DEFAULT after plchost.cfg and drops its words" --apply
new_image 2 3
mkdir "$image/etc/default/grub.d/99-folder.cfg"
refused "cannot read what grub reads: $image/etc/default/grub.d/99-folder.cfg: Is a directory" --apply
new_image 0 2
refused "core 0 stays with the kernel, and line0 has it" --apply
new_image
refused "no instance has a core" --apply
new_image 2 7
refused "core" --apply
new_image 2 3
mkdir "$image/run"
touch "$image/run/.containerenv"
refused "this is a container" --apply
fix >"$cell/said" || fail "a container: $(cat "$cell/said")"
grep -q 'has to be done outside, on the host' "$cell/said" || fail "$(cat "$cell/said")"
refused "there is no file $cell/none.toml" --config "$cell/none.toml"

# A folder that cannot be written: it tells which files are written, and the next --apply goes on there.
may_not_write=(setpriv --bounding-set=-dac_override --inh-caps=-dac_override)
if [ "$(id -u)" -eq 0 ] && "${may_not_write[@]}" true 2>/dev/null; then
  new_image 2 3
  chmod 555 "$image/etc/sysctl.d"
  ! "${may_not_write[@]}" "$BIN/plcctl" check host --fix --root "$image" --apply >"$cell/said" 2>&1 || fail "written in a folder that is only read"
  grep -q "^written: $image/etc/default/grub.d/plchost.cfg" "$cell/said" || fail "$(cat "$cell/said")"
  grep -q "cannot make $image/etc/sysctl.d/60-plchost.conf: Permission denied (EACCES); the files above are written" "$cell/said" || fail "$(cat "$cell/said")"
  [ -z "$(ls -A "$image/etc/sysctl.d")" ] || fail "half a file is left"
  chmod 755 "$image/etc/sysctl.d"
  is "$(fix --apply | grep -c '^written: ')" 5 || fail "--apply does not go on"
fi

# wrong_use OPTION...
wrong_use() {
  local code=0
  plcctl check host "$@" >"$cell/said" 2>&1 || code=$?
  is "$code" 2 || fail "plcctl check host $*: exit code $code: $(cat "$cell/said")"
}
wrong_use --apply
wrong_use --root "$image"
wrong_use --fix --apply --revert --root "$image"
wrong_use --fix --host press --root "$image"
wrong_use --fix --json --root "$image"
wrong_use --fix --root "$cell/no_such_folder"
# An empty variable of a script: never this machine instead of an image.
ln -s / "$cell/slash"
for root in "" / /// /. "$cell/slash"; do
  wrong_use --fix --root "$root"
  grep -qF "'$root' names this machine; leave it out" "$cell/said" || fail "--root '$root': $(cat "$cell/said")"
done
wrong_use --root ""

# Nobody reads: the work is done, and the exit code tells it.
new_image 2 3
for mode in "" --apply; do
  code=0
  fix $mode >/dev/full 2>"$cell/said" || code=$?
  is "$code" 1 || fail "exit code $code on a full disk: $(cat "$cell/said")"
  grep -qF 'cannot write to the standard output' "$cell/said" || fail "$(cat "$cell/said")"
done
is "$(fix --apply | grep -c '^is there: ')" 6 || fail "it has stopped on a full disk"
cp "$BIN/plcctl" "$cell/plcctl"
! "$cell/plcctl" check host --fix >"$cell/said" 2>&1 || fail "--fix works without plchostd"
grep -q 'works on a controller only' "$cell/said" || fail "$(cat "$cell/said")"
if [ "$(id -u)" -eq 0 ] && setpriv --reuid 65534 --regid 65534 --clear-groups test -x "$BIN/plcctl" 2>/dev/null; then
  ! setpriv --reuid 65534 --regid 65534 --clear-groups "$BIN/plcctl" check host --fix --apply >"$cell/said" 2>&1 || fail "others than root may write"
  grep -q 'only root may write in /etc' "$cell/said" || fail "$(cat "$cell/said")"
fi

# The files of another user than root.
other_user=(setpriv --reuid 65534 --regid 65534 --clear-groups)
new_image 2 3
chmod 711 "$cell"
if [ "$(id -u)" -eq 0 ] && chown -R 65534 "$image" && "${other_user[@]}" test -x "$BIN/plcctl" -a -w "$image/etc" 2>/dev/null; then
  ASAN_OPTIONS=${ASAN_OPTIONS:-}:detect_leaks=0 "${other_user[@]}" "$BIN/plcctl" check host --fix --root "$image" --apply >"$cell/said" 2>&1 ||
    fail "an image of another user: $(cat "$cell/said")"
  grep -qx 'to do in it: the files belong to user 65534: .*' "$cell/said" || fail "$(cat "$cell/said")"
  is "$(fix --apply | grep -c '^written: ')" 5 || fail "files of another user stay"
fi

# The host itself: a root with the program alone, a grub that can fail, and no systemd. A sanitizer needs /proc there.
new_image 2 3
programs=(/bin/sh /bin/rm /bin/rmdir /bin/grep /bin/head /bin/readlink)
ldd "$BIN/plchostd" "${programs[@]}" | sed -nE 's/^.*[[:space:]](\/[^ ]*) \(0x.*$/\1/p' | sort -u | while read -r library; do cp --parents -L "$library" "$image"; done
mkdir -p "$image"/{bin,boot/grub,dev}
touch "$image/dev/null"
cp -L "$BIN/plchostd" "${programs[@]}" "$image/bin"
cp "$(dirname "$0")/../../../manager/packages/debian/plchost.postrm" "$image/postrm"
cat >"$image/usr/sbin/update-grub" <<'END'
#!/bin/sh
export -p >/environment
[ ! -e /grub_fails ] || exit 1
. /etc/default/grub
for file in /etc/default/grub.d/*.cfg; do [ ! -e "$file" ] || . "$file"; done
[ ! -e /grub_loses ] || GRUB_CMDLINE_LINUX_DEFAULT=quiet
echo "  linux /vmlinuz root=/dev/sda1 ro $GRUB_CMDLINE_LINUX_DEFAULT" >/boot/grub/grub.cfg
END
chmod 755 "$image/usr/sbin/update-grub"
# in_host CODE WORD: the exit code of --fix-host WORD there
in_host() {
  local code=0
  chroot "$image" /bin/plchostd --fix-host "$2" >"$cell/said" 2>&1 || code=$?
  is "$code" "$1" || fail "--fix-host $2 in a root of its own: exit code $code: $(cat "$cell/said")"
}
said_line() { grep -qxF -- "$1" "$cell/said" || fail "instead of '$1': $(cat "$cell/said")"; }
if ! chroot "$image" /bin/plchostd --version >"$cell/said" 2>&1; then
  echo "not tested: the host itself: $(head -n 1 "$cell/said")"
  exit 0
fi
export LEFT_OVER=yes
in_host 0 apply
said_line "ran: update-grub"
said_line "with a reboot: $words"
! grep -q LEFT_OVER "$image/environment" || fail "the caller's environment: $(cat "$image/environment")"
touch "$image/grub_loses"
in_host 1 apply
said_line "by hand: grub does not do it: let the boot loader give the kernel: $words"
grep -q 'after update-grub /boot/grub/grub.cfg does not have these words' "$cell/said" || fail "$(cat "$cell/said")"
rm "$image/grub_loses"
in_host 0 apply
touch "$image/grub_fails"
in_host 1 apply
said_line "by hand: update-grub has failed: let the boot loader give the kernel: $words"
in_host 1 revert
! grep -q '^with a reboot' "$cell/said" || fail "a reboot does not bring it: $(cat "$cell/said")"
grep -q -- '--revert again runs them anew' "$cell/said" || fail "$(cat "$cell/said")"
grep -q isolcpus "$image/boot/grub/grub.cfg" || fail "the stage has no words to lose"
rm "$image/grub_fails"
in_host 0 revert
said_line "plchost has no file here"
! grep -q isolcpus "$image/boot/grub/grub.cfg" || fail "the second --revert has not finished the first"
# The purge of the package finishes such a --revert, too, and takes a link away as systemctl makes it.
in_host 0 apply
ln -sf /etc/systemd/system/plchost-tuning.service "$image${files[3]}"
rm "$image${files[0]}"
chroot "$image" /bin/sh /postrm purge >"$cell/said" 2>&1 || fail "the purge: $(cat "$cell/said")"
! grep -q isolcpus "$image/boot/grub/grub.cfg" || fail "the purge has not finished --revert: $(cat "$cell/said")"
for file in "${files[@]}"; do [ ! -e "$image$file" ] && [ ! -L "$image$file" ] || fail "the purge leaves $file"; done
# A container that tells it by its environment alone.
mkdir -p "$image/proc/1"
printf 'PATH=/bin\0container=lxc\0' >"$image/proc/1/environ"
in_host 1 apply
grep -q '/proc/1/environ says that this is a container' "$cell/said" || fail "$(cat "$cell/said")"
