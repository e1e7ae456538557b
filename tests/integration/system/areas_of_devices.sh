#!/usr/bin/env bash
# [SysMem] areas in a real /dev/uio0 and in /dev/mem, in a virtual machine that has both: the other side of each
# device is a file here. Needs qemu-system-x86_64, busybox (static), and a kernel with its modules:
#
#     GUEST_KERNEL=/boot/vmlinuz-6.1.0-56-amd64 GUEST_MODULES=/lib/modules/6.1.0-56-amd64 areas_of_devices.sh
#
# Without them it is skipped. GUEST_ACCELERATOR: tcg works in any machine, kvm is faster. BIN: the programs, APPLICATIONS: the applications.
set -euo pipefail

kernel=${GUEST_KERNEL:-}
[ -n "$kernel" ] || for one in /boot/vmlinuz-*; do kernel=$one; done
modules=${GUEST_MODULES:-/lib/modules/$(basename "${kernel:-none}" | sed 's/^vmlinuz-//')}
uio=$modules/kernel/drivers/uio
skip() { echo "skipped: $*"; exit 77; }
[ -r "$kernel" ] || skip "no kernel for a virtual machine (GUEST_KERNEL)"
[ -r "$uio/uio.ko" ] || skip "no uio.ko below $uio (GUEST_MODULES)"
[ -r "$uio/uio_netx.ko" ] || skip "no uio_netx.ko below $uio (GUEST_MODULES)"
command -v qemu-system-x86_64 >/dev/null || skip "no qemu-system-x86_64"
busybox=$(command -v busybox) || skip "no busybox"

folder=$(mktemp -d "${TMPDIR:-/tmp}/plchost-devices.XXXXXX")
guest=
clean_up() {
  [ -z "$guest" ] || { kill -KILL "$guest" 2>/dev/null || true; wait "$guest" 2>/dev/null || true; }
  rm -rf "$folder"
}
trap clean_up EXIT
fail() { echo "FAILED: $*" >&2; tail -n 60 "$folder/console" >&2; exit 1; }

# The file system of the guest: a program, an application, what they are linked with, and a script.
root=$folder/root
mkdir -p "$root"/{bin,proc,sys,dev,tmp,lib64}
cp "$busybox" "$root/bin/busybox"
cp "$BIN/plc-instance" "$APPLICATIONS/device_mirror.so" "$uio/uio.ko" "$uio/uio_netx.ko" "$root/"
ldd "$BIN/plc-instance" "$APPLICATIONS/device_mirror.so" | grep -oE '/[^ ]+\.so[^ :]*' | sort -u |
  while read -r library; do [ ! -f "$library" ] || install -D "$library" "$root$library"; done
cat >"$root/init" <<'GUEST'
#!/bin/busybox sh
/bin/busybox --install -s /bin
export PATH=/bin
mount -t proc none /proc
mount -t sysfs none /sys
mount -t devtmpfs none /dev
mkdir -p /dev/shm
mount -t tmpfs none /dev/shm
insmod /uio.ko && insmod /uio_netx.ko
# Dual-ported memory, as the cards have it that the driver was written for: the first one is the driver's.
devices=$(grep -l 0x1110 /sys/bus/pci/devices/*/device | sort)
first=$(basename $(dirname $(echo "$devices" | head -n 1)))
second=$(dirname $(echo "$devices" | tail -n 1))
echo netx >/sys/bus/pci/devices/$first/driver_override
echo 1 >/sys/bus/pci/devices/$first/enable
echo $first >/sys/bus/pci/drivers_probe
echo 1 >$second/enable
address=$(sed -n 3p $second/resource | cut -d ' ' -f 1)
ls -l /dev/uio0 /dev/mem
cat /sys/class/uio/uio0/name /sys/class/uio/uio0/maps/map0/addr
cat >/tmp/line1.cfg <<SETTINGS
[SysMem]
Linux.Area.0.Flags=0x1000
Linux.Area.0.Device=/dev/uio0
Linux.Area.0.Address=0
Linux.Area.0.Size=64
Linux.Area.1.Flags=0x2000
Linux.Area.1.Device=/dev/uio0
Linux.Area.1.Address=0x1000
Linux.Area.1.Size=64
Linux.Area.2.Flags=0x4000
Linux.Area.2.Address=$address
Linux.Area.2.Size=64
Linux.Area.3.Flags=0x8000
Linux.Area.3.Device=/dev/mem
Linux.Area.3.Address=$(printf '0x%x' $((address + 0x1000)))
Linux.Area.3.Size=64
SETTINGS
cat /tmp/line1.cfg
/plc-instance --name line1 --core 0 --run-directory /tmp --settings /tmp/line1.cfg --application /device_mirror.so
echo "plc-instance ended: $?"
poweroff -f
GUEST
chmod +x "$root/init"
(cd "$root" && find . | "$busybox" cpio -o -H newc 2>/dev/null | gzip -1) >"$folder/initrd"

truncate -s 1M "$folder/uio" "$folder/mem"
device() {
  echo "-object memory-backend-file,id=$1,share=on,mem-path=$folder/$1,size=1M -device ivshmem-plain,memdev=$1,addr=$2"
}
# shellcheck disable=SC2046
qemu-system-x86_64 -machine pc,accel=${GUEST_ACCELERATOR:-tcg} -m 512 -nodefaults -display none -no-reboot \
  -serial "file:$folder/console" -kernel "$kernel" -initrd "$folder/initrd" \
  -append "console=ttyS0 quiet panic=-1 rdinit=/init" $(device uio 4) $(device mem 5) >"$folder/qemu.log" 2>&1 &
guest=$!

# Values in the inputs of the device come back inverted in its outputs.
put() { printf '%b' "$2" | dd of="$folder/$1" bs=1 conv=notrunc status=none; }
outputs() { dd if="$folder/$1" bs=1 skip=4096 count=4 status=none | od -An -tx1 | tr -d ' \n'; }
wait_for() {
  for _ in $(seq 600); do
    [ "$(outputs "$1")" = "$2" ] && return 0
    kill -0 "$guest" 2>/dev/null || fail "the virtual machine ended: $(cat "$folder/qemu.log")"
    sleep 0.1
  done
  fail "outputs of '$1' are $(outputs "$1"), not $2"
}
for device in uio mem; do
  wait_for $device ffffffff
  put $device '\x01\x02\x03\xf0'
  wait_for $device fefdfc0f
  put $device '\xff\x00\xaa\x55'
  wait_for $device 00ff55aa
done
echo "areas in /dev/uio0 and /dev/mem of Linux $(basename "$modules") carry inputs and outputs"
