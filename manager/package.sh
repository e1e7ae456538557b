#!/usr/bin/env bash
# Makes the Debian packages of this checkout, for the Debian and the processor that it runs on. lintian looks at them.
#   manager/package.sh [FOLDER]            the packages go there; default: .build/packages
#   manager/package.sh --arm64 [FOLDER]    for arm64, on another processor; default: .build/packages-arm64
set -euo pipefail
needs=package
for_processor=()
default=.build/packages
case "${1:-}" in
  -h | --help) sed -n '2,/^[^#]/s/^# \{0,1\}//p' "$0"; exit ;;
  --arm64)
    needs=cross
    for_processor=(--host-arch arm64)
    default=.build/packages-arm64
    shift
    ;;
  -*) echo "manager/package.sh: unknown option $1; allowed are --arm64 and --help" >&2; exit 2 ;;
esac
cd "$(dirname "$0")/.."
folder=$(realpath -m "${1:-$default}")
.ci/packages "$needs"
version=$(sed -nE 's/^project\(plchost VERSION ([0-9.]+).*/\1/p' CMakeLists.txt)
. /etc/os-release
work=$(mktemp -d "${TMPDIR:-/tmp}/plchost-package.XXXXXX")
trap 'rm -rf "$work"' EXIT
source=$work/plchost-$version
mkdir -p "$source" "$folder"
git ls-files -z | xargs -0 cp --parents -t "$source"
cp -r manager/packages/debian "$source/debian"
cat >"$source/debian/changelog" <<EOF
plchost ($version-1~deb$VERSION_ID) ${VERSION_CODENAME:-unstable}; urgency=medium

  * Made from $(git describe --always --dirty 2>/dev/null || echo 'a release').

 -- $(sed -n 's/^Maintainer: //p' manager/packages/debian/control)  $(git log -1 --format=%cD 2>/dev/null || date -R)
EOF
if ! (cd "$source" && DEB_BUILD_OPTIONS="parallel=$(nproc) noautodbgsym nocheck" dpkg-buildpackage -b -us -uc "${for_processor[@]}") >"$work/log" 2>&1; then
  tail -n 50 "$work/log" >&2
  echo "manager/package.sh: the packages could not be made" >&2
  exit 1
fi
lintian --allow-root --fail-on error,warning --suppress-tags-from-file manager/packages/lintian.txt "$work"/*.changes
cp "$work"/*.deb "$folder"
ls "$folder"/*.deb
