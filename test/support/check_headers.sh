#!/usr/bin/env bash
# Every public header compiles alone.
#
#   check_headers.sh COMPILER CORE_DIRS PCL_DIRS
#
# CORE_DIRS and PCL_DIRS are folders of headers, with semicolons between: the first of
# CORE_DIRS is checked, the others are what it may use. Only headers in holdfast/pcl/ and
# holdfast/io/ may use PCL_DIRS; without those they are left out, and visualization.h
# where VTK is in none of them.
set -euo pipefail

compiler=$1
IFS=";" read -r -a core_dirs <<<"$2"
IFS=";" read -r -a pcl_dirs <<<"$3"
include=${core_dirs[0]}
core_flags=("${core_dirs[@]/#/-I}")
pcl_flags=("${pcl_dirs[@]/#/-isystem}")

vtk=
for dir in "${pcl_dirs[@]}"; do
  [[ -e $dir/vtkVersion.h ]] && vtk=$dir
done

# check HEADER flags...
check() {
  local header=$1
  shift
  # As a user would write it, and twice, for its guard.
  printf '#include <%s>\n#include <%s>\n' "$header" "$header" |
    "$compiler" -std=c++17 -fsyntax-only -x c++ "$@" - && return
  echo "$header does not compile alone"
  return 1
}

failed=0
running=0
while IFS= read -r header; do
  flags=("${core_flags[@]}")
  if [[ $header == holdfast/@(pcl|io)/* ]]; then
    ((${#pcl_dirs[@]})) || continue
    [[ $header == */visualization.h && -z $vtk ]] && continue
    flags+=("${pcl_flags[@]}")
  fi
  check "$header" "${flags[@]}" &
  if ((++running == 2)); then
    wait -n || failed=1
    running=$((running - 1))
  fi
done < <(cd "$include" && find holdfast -name '*.h' | sort)
while ((running-- > 0)); do
  wait -n || failed=1
done
exit $failed
