#!/usr/bin/env bash
# The version stands in CMakeLists.txt; what cannot read it there says the same.
#
#   check_versions.sh [FOLDER]
set -euo pipefail
cd "${1:-$(dirname "${BASH_SOURCE[0]}")/../..}"

version=$(sed -n 's/^  VERSION \([0-9.]*\)$/\1/p' CMakeLists.txt)
[[ $version =~ ^[0-9]+\.[0-9]+\.[0-9]+$ ]] || { echo "CMakeLists.txt: no version" && exit 1; }
soname=${version%.*}
failed=0

# same FILE FOUND [EXPECTED]
same() {
  [[ $2 == "${3:-$version}" ]] || {
    echo "$1 says '$2', not '${3:-$version}'"
    failed=1
  }
}

same CITATION.cff "$(sed -n 's/^version: //p' CITATION.cff)"
same debian/changelog "$(sed -n '1s/^holdfast (\(.*\)) .*/\1/p' debian/changelog)"
for file in package.xml apps/ros/msgs/holdfast_msgs/package.xml; do
  same "$file" "$(sed -n 's/^  <version>\(.*\)<\/version>$/\1/p' "$file")"
done
# The section below that of what is not released.
released=$(grep -m 1 '^## [0-9]' CHANGELOG.md || true)
same CHANGELOG.md "$(sed 's/^## \([^ ]*\) .*/\1/' <<<"$released")"
same "CITATION.cff, of the day," "$(sed -n 's/^date-released: //p' CITATION.cff)" "${released##* }"
same "debian/control" "$(sed -n 's/^Package: libholdfast\([0-9.]*\)$/\1/p' debian/control)" "$soname"
same samples/CMakeLists.txt \
  "$(sed -n 's/.*find_package(holdfast \([0-9.]*\).*/\1/p' samples/CMakeLists.txt)" "$soname"
while IFS=: read -r file found; do
  same "$file" "$found" "$soname"
done < <(grep -oE '(libholdfast|libholdfast_[a-z]+\.so\.)[0-9]+\.[0-9]+' README.md doc/*.md \
  debian/rules debian/control | sed 's/:.*[a-z]\.*\([0-9]\)/:\1/')

# What Debian builds with is what the list of packages says, but for what it always has.
wanted=$(awk '/^(build|python) / && $2 !~ /^(g\+\+|python3-(pip|venv|wheel|setuptools))$/ \
  { print $2 }' cmake/debian-packages.txt | sort)
given=$(sed -n '/^Build-Depends:/,/^[A-Z].*:/p' debian/control | sed '1d;$d' |
  tr -d ' ,' | grep -v '^dh-python$' | sort)
diff <(echo "$wanted") <(echo "$given") || {
  echo "debian/control and cmake/debian-packages.txt differ"
  failed=1
}
((failed == 0))
