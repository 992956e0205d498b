#!/usr/bin/env bash
# The README is short, leads to every page, and shows what works: its C++ is the marked
# part of samples/first_patch.cpp, its commands run (its Python: test_samples.py), and
# the table that doc/program.md shows is the one that is printed.
#
#   check_readme.sh [HOLDFAST SCRATCH]     the program, for the commands
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
cd "$root"

fail() {
  echo "$1"
  exit 1
}

(($(wc -l <README.md) <= 130)) || fail "the README has more than 130 lines"
for page in doc/*.md; do
  grep -q "]($page)" README.md || fail "the README does not lead to $page"
done

snippet=$(sed -n '/^```cpp$/,/^```$/{/^```/d;p}' README.md)
sample=$(sed -n '/^\/\/ \[snippet\]$/,/^\/\/ \[end\]$/{/^\/\/ \[/d;p}' samples/first_patch.cpp)
[[ -n $sample ]] || fail "no marked part in samples/first_patch.cpp"
diff <(echo "$snippet") <(echo "$sample")
lines=$(wc -l <<<"$sample")
((lines <= 15)) || fail "the snippet has $lines lines, 15 are allowed"

(($# == 2)) || exit 0
program=$1 scratch=$2
mapfile -t commands < <(sed -n 's/^    holdfast //p' README.md)
((${#commands[@]} >= 3)) || fail "the README shows no commands"
rm -rf "$scratch" && mkdir -p "$scratch" && cd "$scratch"
ln -s "$root/samples" samples
for command in "${commands[@]}"; do
  # shellcheck disable=SC2086 # several arguments
  "$program" $command --quiet || fail "failed: holdfast $command"
done
for file in results/rocks.patches.json rocks.png rocks.html; do
  [[ -s $file ]] || fail "the commands of the README made no $file"
done

# Counts may differ by a few between processors; more is another table.
table() {
  sed -n '/^surface (medians)/,/^[^a-z]*$\|^rejected/p' | awk '$2 ~ /^[0-9]+$/ { print $1, $2 }'
}
paste -d ' ' <(table <"$root/doc/program.md") \
  <("$program" fit samples/rocks.pcd -o again 2>&1 | table) |
  awk 'NF != 4 || $1 != $3 || ($2 - $4) ^ 2 > (3 + 0.02 * $4) ^ 2 { bad = 1; print }
       END { exit bad || NR != 5 }' || fail "doc/program.md shows another table than fit prints"
