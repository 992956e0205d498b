#!/usr/bin/env bash
# Debian packages: lintian finds no error, dpkg installs them with all that they depend on,
# what they bring runs, and purging them leaves nothing.
#
#   try_packages.sh SCRATCH PACKAGE.deb...
#
# As root they are installed over the running system, in a layer that is thrown away
# (overlayfs; only what is there may be depended on). Where that is not allowed, dpkg
# installs all but the Python module, whose scripts are for the system's folders, below
# SCRATCH, and dependencies are not looked at.
set -euo pipefail

fail() {
  echo "$*" >&2
  exit 1
}

quietly() {
  "$@" >"$log" 2>&1 || { cat "$log" >&2 && fail "failed: $*"; }
}

read_names() {
  local deb
  names=()
  for deb in "$@"; do
    names+=("$(dpkg-deb --field "$deb" Package)")
  done
  echo "packages: ${names[*]}"
}

has() {
  [[ " ${names[*]} " == *" $1 "* ]]
}

# use ROOT SEEN [COMMAND...]: what the packages brought to the folder ROOT, which programs
# started by COMMAND see as SEEN.
use() {
  local root=$1 seen=$2 library libraries=0 page
  local run=("${@:3}")
  if has libholdfast-dev; then
    PKG_CONFIG_PATH=$(dirname "$(find "$root/usr/lib" -name holdfast_core.pc)") \
      pkg-config --exists --print-errors holdfast_core
  fi
  has holdfast || return 0
  "${run[@]}" "$seen/usr/bin/holdfast" --version
  # The libraries of the package, not those of a build or another installation.
  while read -r library; do
    [[ $(realpath -m "$library") == "$seen"/usr/lib/* ]] || fail "the program takes $library"
    libraries=$((libraries + 1))
  done < <("${run[@]}" ldd "$seen/usr/bin/holdfast" | sed -n 's/.*libholdfast.* => \([^ ]*\).*/\1/p')
  ((libraries == 2)) || fail "the program takes $libraries of our libraries"
  for page in holdfast holdfast-fit; do
    [[ -e $root/usr/share/man/man1/$page.1.gz ]] || fail "no page of $page"
  done
  [[ -e $root/usr/share/holdfast/config/sensors/kinect_v1.yaml ]] || fail "no sensors"
  has libholdfast-dev || return 0
  quietly "${run[@]}" "$seen/usr/bin/holdfast" fit \
    "$seen/usr/share/doc/holdfast/samples/rocks.pcd" --max-patches 20 --json -
  grep -q '"surface"' "$log" || fail "the program fits no patches"
}

use_python() {
  has python3-holdfast || return 0
  "$@" /usr/bin/python3 -c "
import importlib.metadata, holdfast
assert holdfast.__file__.startswith('/usr/lib/python3/dist-packages'), holdfast.__file__
print('python3-holdfast', importlib.metadata.version('holdfast'))
sensor = holdfast.Sensor.load('kinect_v1')
image = holdfast.simulate('rocks', sensor, stride=8)
assert len(holdfast.extract(image.points, sensor, radius_m=0.1)) > 0"
}

# In a mount namespace of its own: the system, and a layer for what is written.
in_layer() {
  local layer=$1 root=$1/root name path
  shift
  mount -t tmpfs tmpfs "$layer"
  mkdir -p "$layer/"{written,work,root}
  mount -t overlay overlay "$root" \
    -o "lowerdir=/,upperdir=$layer/written,workdir=$layer/work"
  mount --rbind /proc "$root/proc"
  mount --rbind /dev "$root/dev"
  mount -t tmpfs tmpfs "$root/tmp"
  cp "$@" "$root/tmp"

  local inside=(chroot "$root" /usr/bin/env -i HOME=/tmp LANG=C.UTF-8
    PATH=/usr/sbin:/usr/bin:/sbin:/bin DEBIAN_FRONTEND=noninteractive)
  quietly "${inside[@]}" sh -c 'dpkg --install /tmp/*.deb'
  use "$root" "" "${inside[@]}"
  use_python "${inside[@]}"
  quietly "${inside[@]}" dpkg --purge "${names[@]}"

  # Of what was written all that was not there before, but for dpkg's own records.
  (cd "$layer/written" && find . ! -type d ! -type c \
    ! -path './var/lib/dpkg/*' ! -path './var/cache/*' ! -path './var/log/*') |
    while read -r path; do
      [[ -e /$path || -L /$path ]] || echo "$path"
    done >"$layer/left"
  (cd "$layer/written" && find . -type d -iname '*holdfast*') >>"$layer/left"
  [[ ! -s $layer/left ]] || fail "left behind: $(cat "$layer/left")"
  for name in "${names[@]}"; do
    [[ -z $(compgen -G "$root/var/lib/dpkg/info/${name}[.:]*") ]] || fail "dpkg knows $name"
  done
}

# Below a folder, with a database of its own.
in_folder() {
  local root=$1/root left deb debs=()
  for deb in "${@:2}"; do
    [[ $deb == */python3-* ]] || debs+=("$deb")
  done
  read_names "${debs[@]}"
  mkdir -p "$root/var/lib/dpkg/"{info,updates,triggers}
  : >"$root/var/lib/dpkg/status"
  : >"$root/var/lib/dpkg/available"
  local dpkg=(dpkg --root="$root" --force-not-root --force-depends --force-bad-path
    --force-script-chrootless --log=/dev/null)
  quietly "${dpkg[@]}" --install "${debs[@]}"
  use "$root" "$root" env "HOLDFAST_CONFIG_DIR=$root/usr/share/holdfast/config"
  quietly "${dpkg[@]}" --purge "${names[@]}"
  left=$(find "$root" -path "$root/var" -prune -o ! -type d -print)
  [[ -z $left ]] || fail "left behind: $left"
}

# Whether a layer over the system can be had below the folder.
may_layer() {
  (($(id -u) == 0)) && unshare --mount bash -ec '
    mount -t tmpfs tmpfs "$1" && mkdir "$1"/{written,work,root}
    mount -t overlay overlay "$1/root" \
      -o "lowerdir=/,upperdir=$1/written,workdir=$1/work"' -- "$1" >"$log" 2>&1
}

if [[ $1 == --in-layer ]]; then
  log=$2.log
  read_names "${@:3}"
  in_layer "${@:2}"
  exit
fi

trial=$(realpath "$1")/trial
log=$trial.log
mapfile -t debs < <(realpath "${@:2}")
rm -rf "$trial"
mkdir -p "$trial"

if command -v lintian >/dev/null; then
  lintian --allow-root --fail-on error --tag-display-limit 0 "${debs[@]}" ||
    fail "lintian has found errors"
else
  echo "lintian is not installed"
fi
if may_layer "$trial"; then
  unshare --mount "${BASH_SOURCE[0]}" --in-layer "$trial" "${debs[@]}"
else
  echo "no layer over the system for want of rights: below a folder instead"
  in_folder "$trial" "${debs[@]}"
fi
echo "installed, run, and removed without a trace"
