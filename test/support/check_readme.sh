#!/usr/bin/env bash
# The C++ snippet of the README is the marked part of samples/first_patch.cpp, and short.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

snippet=$(sed -n '/^```cpp$/,/^```$/{/^```/d;p}' README.md)
sample=$(sed -n '/^\/\/ \[snippet\]$/,/^\/\/ \[end\]$/{/^\/\/ \[/d;p}' samples/first_patch.cpp)
[[ -n $sample ]] || { echo "no marked part in samples/first_patch.cpp" && exit 1; }
diff <(echo "$snippet") <(echo "$sample")
lines=$(wc -l <<<"$sample")
((lines <= 15)) || { echo "the snippet has $lines lines, 15 are allowed" && exit 1; }
