#!/usr/bin/env bash
# What cmake/setup.sh does when packages are missing, with stand-ins for the commands
# that would ask or change the system.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)

stubs=$(mktemp -d)
trap 'rm -rf "$stubs"' EXIT
log=$stubs/log

# stub NAME BODY: a command that comes before the real one.
stub() {
  printf '#!/bin/bash\n%s\n' "$2" >"$stubs/$1"
  chmod +x "$stubs/$1"
}

# run UID SUDO INSTALLED: installs the build packages as user UID, where SUDO says
# whether sudo lets him and INSTALLED whether the packages are there.
run() {
  : >"$log"
  stub id "echo $1"
  stub sudo "[[ \$1 == -* ]] && { $2; exit; }; $2 && \"\$@\""
  stub dpkg-query "$3 && echo 'ii '"
  stub apt-get "echo apt-get \"\$@\" >>'$log'"
  (PATH=$stubs:$PATH && source "$root/cmake/setup.sh" && install_packages build) \
    >"$stubs/out" 2>&1 </dev/null
}

fail() {
  echo "failed: $1"
  cat "$stubs/out" "$log"
  exit 1
}

run 1000 false true || fail "nothing is missing"
[[ ! -s $log ]] || fail "apt-get was called although nothing is missing"

if run 1000 false false; then fail "packages are missing and cannot be installed"; fi
[[ ! -s $log ]] || fail "apt-get was called without root"
grep -q 'apt-get install --no-install-recommends .*libpcl-dev' "$stubs/out" ||
  fail "the apt line is not shown"
if grep -q libgtest-dev "$stubs/out"; then fail "building does not need GoogleTest"; fi

for who in "0 false" "1000 true"; do
  # shellcheck disable=SC2086
  run $who false || fail "installing works as '$who'"
  [[ $(head -n 1 "$log") == "apt-get update" ]] || fail "no apt-get update as '$who'"
  grep -q '^apt-get install -y --no-install-recommends .*libpcl-dev' "$log" ||
    fail "no apt-get install as '$who'"
done
