#!/usr/bin/env bash
# Every source file is formatted as .clang-format says. Versions of clang-format differ
# in details, so version 14 (Debian 12) decides and any other skips (exit code 77).
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

clang_format=$(command -v clang-format-14 || command -v clang-format || true)
if [[ -z $clang_format ]] || ! "$clang_format" --version | grep -q 'version 14\.'; then
  echo "skipped: clang-format 14 is not installed"
  exit 77
fi
unformatted=0
while IFS= read -r -d '' file; do
  if ! "$clang_format" --dry-run -Werror "$file" 2>/dev/null; then
    echo "$file: run clang-format -i on it"
    unformatted=1
  fi
done < <(find include src apps samples test -regex '.*\.\(h\|hpp\|inl\|cpp\)' -print0)
exit $unformatted
