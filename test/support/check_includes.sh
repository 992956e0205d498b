#!/usr/bin/env bash
# Includes point only upward in the list of layers below, so that the core can be read,
# tested and used without PCL.
#
#   check_includes.sh [ROOT]     ROOT holds include/ and src/ (default: this project)
set -euo pipefail
cd "${1:-$(dirname "${BASH_SOURCE[0]}")/../..}"

# Which layers each layer may include, itself aside. sensor and fit do not know each
# other: the fit sees points and covariances, never where they came from.
check='
BEGIN {
  allowed["ground"] = ""
  allowed["geometry"] = ""
  allowed["parallel"] = "ground"
  allowed["patch"] = "ground geometry"
  allowed["sensor"] = "ground geometry"
  allowed["fit"] = "ground geometry parallel patch"
  uncertainty = "ground geometry parallel patch fit"
  allowed["uncertainty"] = uncertainty
  allowed["front"] = uncertainty " uncertainty"
  allowed["validation"] = "geometry parallel patch fit"
  allowed["fusion"] = uncertainty " uncertainty sensor"
  allowed["contact"] = allowed["fusion"] " fusion"
  allowed["simulation"] = "ground geometry patch sensor"
  allowed["evaluation"] = allowed["front"] " front validation sensor simulation fusion contact"
  allowed["pcl"] = allowed["front"] " front validation sensor fusion contact"
  allowed["io"] = allowed["pcl"] " pcl"
  allowed["python"] = allowed["io"] " io simulation"
  # Headers above the rooms: the front door, and what all may know.
  room["patch_estimator"] = "front"
  room["correlated_noise"] = "ground"
  room["enum_names"] = "ground"
  room["noise_pattern"] = "ground"
  room["progress"] = "ground"
  room["version"] = "ground"
  # Beside C++ standard headers, which have neither slash nor dot. What a public header
  # includes, every user of the core must have: only Eigen.
  core_headers_may = "^(Eigen/|[a-z_0-9]+$)"
  core_sources_may = "^(Eigen/|boost/math/|hwy/|pthread[.]h|[a-z_0-9]+$)"
}
function complain(why) {
  printf "%s:%d: %s\n", FILENAME, FNR, why
  bad = 1
}
function layer_of(path) {
  if (path ~ /\//) {
    sub(/\/.*/, "", path)
    return path
  }
  sub(/\..*/, "", path)
  return path in room ? room[path] : path
}
function check_ours(header) {
  # In the same folder.
  if (header !~ /\// && $0 ~ /include[ \t]*"/)
    return
  target = layer_of(header)
  if (target in allowed && target != layer &&
      index(" " allowed[layer] " ", " " target " ") == 0)
    complain(layer " must not include " target)
}
function check_foreign(header) {
  may = FILENAME ~ /^include/ ? core_headers_may : core_sources_may
  if (layer != "pcl" && layer != "io" && layer != "python" && header !~ may)
    complain("the core must not include <" header ">")
}
FNR == 1 {
  layer = FILENAME
  sub(/^(include\/holdfast|src)\//, "", layer)
  layer = layer_of(layer)
  if (!(layer in allowed))
    complain("unknown layer " layer)
}
/^[ \t]*#[ \t]*include[ \t]*["<]/ {
  header = $0
  sub(/^[^"<]*["<]/, "", header)
  sub(/[">].*/, "", header)
  if (sub(/^holdfast\//, "", header) || $0 ~ /include[ \t]*"/)
    check_ours(header)
  else
    check_foreign(header)
}
END { exit bad }
'
find include/holdfast src -regex '.*\.\(h\|hpp\|inl\|cpp\)' -exec awk "$check" {} +
