#!/usr/bin/env bash
# Tests that need npm: run.sh page_test.mjs FOLDER runs one of them with packages in that
# folder; run.sh bundle FOLDER rebuilds the page and compares it with what is committed.
# Exit code 77: npm's registry, node or chromium cannot be had here, as it says.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
what=$1
folder=$2

skip() {
  echo "skipped: $1"
  exit 77
}

# install FOLDER: the packages of a lock file, unless they are there.
install() {
  if ! cmp -s package-lock.json node_modules/.of-this-lock; then
    timeout 200 npm ci --no-audit --no-fund --fetch-retries=1 >npm.log 2>&1 ||
      skip "npm ci failed: $(grep -m1 'npm error' npm.log || echo 'no answer')"
    cp package-lock.json node_modules/.of-this-lock
  fi
}

command -v node >/dev/null || skip "no node (package nodejs)"
command -v npm >/dev/null || skip "no npm (package npm)"
[[ $(node -p 'process.versions.node.split(".")[0]') -ge 18 ]] || skip "node is too old"

mkdir -p "$folder"
if [[ $what == bundle ]]; then
  page=$here/../../apps/report/page
  rm -rf "$folder/src"
  cp -r "$page"/{package.json,package-lock.json,build.mjs,src} "$folder"
  cd "$folder"
  install
  node build.mjs "$folder/dist"
  diff -rq "$page/dist" "$folder/dist" ||
    { echo "apps/report/page/dist is not what its sources give: npm run build"; exit 1; }
else
  cp "$here"/*.mjs "$here"/package*.json "$folder"
  cd "$folder"
  install
  node "$what"
fi
