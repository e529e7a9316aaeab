# What the scripts share; sourced, not run.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
processors=$(nproc)

say() { printf '%s: %s\n' "$(basename "$0")" "$*"; }

# Runs a command and shows its output only when it fails.
quietly() {
  local log code=0
  log=$(mktemp)
  "$@" >"$log" 2>&1 </dev/null || code=$?
  if [ "$code" -ne 0 ]; then
    cat "$log" >&2
    say "failed: $*" >&2
  fi
  rm -f "$log"
  return "$code"
}

# Installs what is missing from the given groups of packages.txt.
install_packages() {
  local group package missing=() as_root=()
  while read -r group package; do
    [[ " $* " == *" $group "* ]] || continue
    [ "$(dpkg-query -W -f='${db:Status-Status}' "$package" 2>/dev/null || true)" = installed ] || missing+=("$package")
  done < <(grep -v '^#' "$root/scripts/packages.txt")
  [ "${#missing[@]}" -gt 0 ] || return 0
  if ! command -v apt-get >/dev/null; then
    say "no apt here, so the build may fail: install what corresponds to the Debian packages ${missing[*]}" >&2
    return 0
  fi
  if [ "$(id -u)" -ne 0 ]; then
    if ! command -v sudo >/dev/null; then
      say "needs root or sudo to install ${missing[*]}" >&2
      return 1
    fi
    as_root=(sudo)
    [ -z "${CI:-}" ] || as_root+=(-n)
  fi
  say "installing ${missing[*]}"
  quietly "${as_root[@]}" apt-get update
  quietly "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y --no-install-recommends "${missing[@]}"
}

# Configures a preset with the given options of cmake, and builds it, several sources of a cold room at once, which is faster; what follows
# --target goes to the build.
build() {
  local preset=$1 options=()
  shift
  while [ $# -gt 0 ] && [ "$1" != --target ]; do options+=("$1") && shift; done
  say "building $preset"
  (cd "$root" && quietly cmake --preset "$preset" -DCMAKE_UNITY_BUILD=ON "${options[@]}" && quietly cmake --build --preset "$preset" "$@")
}

# Of packages that Debian 12 does not have: installs those given into build/venv, which sees Debian's too.
pip_install() {
  { [ -x "$root/build/venv/bin/python" ] || /usr/bin/python3 -m venv --system-site-packages "$root/build/venv"; } &&
    "$root/build/venv/bin/pip" install --quiet "$@"
}

# All C++ files of the project, each ended by a zero byte.
sources() {
  (cd "$root" && find include src tools tests examples python -name '*.[ch]pp' -print0)
}
