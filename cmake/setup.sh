# Sourced by samples/quickstart.sh and test/run.sh, which set $root to the folder of the
# project: installs packages, configures, builds.
# shellcheck shell=bash disable=SC2154

# Packages of the given groups ("build test") that are not installed. What is there as a
# command counts, wherever it comes from: Node.js of other sources brings its own npm and
# conflicts with Debian's.
missing_packages() {
  local package
  awk -v groups=" $* " '/^[a-z]/ && index(groups, " " $1 " ") { print $2 }' \
    "$root/cmake/debian-packages.txt" |
    while read -r package; do
      command -v "$package" >/dev/null ||
        dpkg-query -W -f='${db:Status-Abbrev}' "$package" 2>/dev/null | grep -q '^ii' ||
        printf '%s\n' "$package"
    done
}

# Asks for a password only where somebody can type it.
may_sudo() {
  command -v sudo >/dev/null || return 1
  if [[ -t 0 ]]; then sudo -v; else sudo -n true 2>/dev/null; fi
}

# Installs what is missing; without the right to do so, says how and stops.
install_packages() {
  if ! command -v dpkg-query >/dev/null; then
    echo "Not a Debian system: cmake/debian-packages.txt lists what is needed." >&2
    return 0
  fi
  local missing as_root=()
  mapfile -t missing < <(missing_packages "$@")
  ((${#missing[@]})) || return 0

  if (($(id -u) != 0)); then
    if ! may_sudo; then
      echo "Packages are missing and neither root nor sudo is at hand. As root, run:" >&2
      echo "  apt-get update && apt-get install --no-install-recommends ${missing[*]}" >&2
      return 1
    fi
    as_root=(sudo)
  fi
  echo "Installing ${missing[*]}"
  "${as_root[@]}" apt-get update
  "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive \
    apt-get install -y --no-install-recommends "${missing[@]}"
}

# build_in FOLDER [cmake options] [-- targets]: configures and builds.
build_in() {
  local folder=$1 options targets=()
  shift
  options=(-S "$root" -B "$folder")
  while (($#)) && [[ $1 != -- ]]; do
    options+=("$1")
    shift
  done
  (($# > 1)) && targets=(--target "${@:2}")
  if [[ ! -e $folder/CMakeCache.txt ]]; then
    command -v ninja >/dev/null && options+=(-G Ninja)
    command -v ccache >/dev/null && options+=(
      -DCMAKE_C_COMPILER_LAUNCHER=ccache -DCMAKE_CXX_COMPILER_LAUNCHER=ccache)
  fi
  cmake "${options[@]}"
  cmake --build "$folder" --parallel "$(nproc)" "${targets[@]}"
}
