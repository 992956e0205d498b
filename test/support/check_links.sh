#!/usr/bin/env bash
# Every link and picture of every page leads to a file, and every heading that is named to
# a heading.
#
#   check_links.sh [FOLDER]
set -euo pipefail
cd "${1:-$(dirname "${BASH_SOURCE[0]}")/../..}"

# The anchors of a page: its headings in small letters, without marks, spaces as dashes.
anchors() {
  sed -n 's/^##* //p' "$1" | tr '[:upper:]' '[:lower:]' | tr -cd '[:alnum:] _\n-' | tr ' ' '-'
}

failed=0
pages=0
while read -r page; do
  pages=$((pages + 1))
  while read -r link; do
    [[ $link =~ ^(https?|mailto): ]] && continue
    path=${link%%#*}
    target=$page
    [[ -z $path ]] || target=$(dirname "$page")/$path
    if [[ ! -e $target ]]; then
      echo "$page: no $link"
      failed=1
    elif [[ $link == *#* ]] && ! anchors "$target" | grep -qx -- "${link##*#}"; then
      echo "$page: no heading for $link"
      failed=1
    fi
  done < <(grep -o '](\([^) ]*\)' "$page" | cut -c3-)
done < <(find . \( -name 'build*' -o -name node_modules -o -name .git \) -prune -o \
  -name '*.md' -print | sort)
((pages)) || { echo "no pages" && exit 1; }
((failed == 0))
