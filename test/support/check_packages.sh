#!/usr/bin/env bash
# Debian packages of what is built: made, installed below a folder, run there, and removed
# without a trace.
#
#   check_packages.sh BUILD SCRATCH      exits with 77 where a tool is missing
set -euo pipefail
build=$1 scratch=$2

for tool in cpack dpkg dpkg-deb dpkg-shlibdeps pkg-config; do
  if ! command -v $tool >/dev/null; then
    echo "$tool is not installed"
    exit 77
  fi
done

rm -rf "$scratch"
mkdir -p "$scratch/packages" "$scratch/root/var/lib/dpkg/"{info,updates,triggers}
root=$scratch/root
: >"$root/var/lib/dpkg/status"
: >"$root/var/lib/dpkg/available"

# dpkg with a database of its own. What the packages depend on is that of the machine.
package() {
  dpkg --root="$root" --force-not-root --force-depends --force-bad-path \
    --force-script-chrootless --log=/dev/null "$@" >"$scratch/dpkg.log" 2>&1 || {
    cat "$scratch/dpkg.log"
    exit 1
  }
}

fail() {
  echo "$1"
  exit 1
}

(cd "$scratch" && cpack -G DEB --config "$build/CPackConfig.cmake" -B "$scratch/packages" \
  >cpack.log 2>&1) || { cat "$scratch/cpack.log"; exit 1; }
debs=("$scratch"/packages/*.deb)
names=()
for deb in "${debs[@]}"; do
  names+=("$(dpkg-deb --field "$deb" Package)")
  for field in Version Architecture Maintainer Description; do
    [[ -n $(dpkg-deb --field "$deb" $field) ]] || fail "$deb has no $field"
  done
done
echo "packages: ${names[*]}"

package --install "${debs[@]}"
program=$root/usr/bin/holdfast
"$program" --version
# The libraries of the package, not those of the build.
ldd "$program" | grep -o '[^ ]*libholdfast[^ ]*so[^ ]* => [^ ]*' |
  while read -r _ _ library; do
    [[ $(readlink -f "$library") == $(readlink -f "$root")/* ]] ||
      fail "the program takes $library"
  done
for page in holdfast holdfast-fit; do
  [[ -n $(compgen -G "$root/usr/share/man/man1/$page.1*") ]] || fail "no page of $page"
done
[[ -e $root/usr/share/holdfast/config/sensors/kinect_v1.yaml ]] || fail "no sensors"
HOLDFAST_CONFIG_DIR=$root/usr/share/holdfast/config \
  "$program" info "$root"/usr/share/doc/*/samples/rocks.pcd >"$scratch/info.txt" ||
  fail "the program does not read the sample"
PKG_CONFIG_PATH=$(dirname "$(find "$root" -name holdfast_core.pc)") \
  pkg-config --exists --print-errors holdfast_core

package --purge "${names[@]}"
left=$(find "$root" -path "$root/var" -prune -o ! -type d -print)
[[ -z $left ]] || fail "left behind: $left"
echo "installed, run, and removed without a trace"
