# shellcheck shell=bash
# Set-up shared by ./run and ./test, which source it: system packages, a Python environment, sheetbend in it.
# Every step looks first and does nothing when its work is done.

readonly VENV="$ROOT/.venv"
readonly STAMP="$VENV/sheetbend.stamp"

say() { printf '\n==> [%3d s] %s\n' "$SECONDS" "$*"; }
fail() {
  printf '\nerror: %s\n' "$*" >&2
  exit 1
}

has_command() { command -v "$1" >/dev/null; }
has_header() { [[ -e /usr/include/$1 || -e /usr/local/include/$1 ]]; }
has_cmake() {
  has_command cmake && printf '3.25\n%s\n' "$(cmake --version | sed -n '1s/.* //p')" | sort -V -C
}

# The first Python that is new enough, by absolute path; nothing when there is none.
find_python() {
  local name
  for name in python3 python3.14 python3.13 python3.12 python3.11; do
    if has_command "$name" && "$name" -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null; then
      "$name" -c 'import sys; print(sys.executable)'
      return
    fi
  done
}
has_venv() { [[ -n $(find_python) ]] && "$(find_python)" -c 'import ensurepip, venv' 2>/dev/null; }
has_python_headers() {
  [[ -n $(find_python) ]] && "$(find_python)" -c \
    'import os, sys, sysconfig; sys.exit(not os.path.exists(os.path.join(sysconfig.get_path("include"), "Python.h")))'
}

# Debian's names of what is not there.
missing_packages() {
  has_command c++ || echo g++
  has_cmake || echo cmake
  has_command ninja || echo ninja-build
  has_venv || echo python3-venv
  has_python_headers || echo python3-dev
  has_header eigen3/Eigen/Core || echo libeigen3-dev
  has_header ceres/ceres.h || echo libceres-dev
  has_header gtest/gtest.h || echo libgtest-dev
  has_header nlohmann/json.hpp || echo nlohmann-json3-dev
  has_command valgrind || echo valgrind
}

as_root() {
  if [[ $(id -u) == 0 ]]; then "$@"; else sudo -n "$@"; fi
}
may_install() { has_command apt-get && { [[ $(id -u) == 0 ]] || sudo -n true 2>/dev/null; }; }

# Installs what is missing where that is allowed; otherwise says what to install, and goes on if it can be done without.
install_system_packages() {
  local missing
  missing=$(missing_packages | paste -sd ' ')
  [[ -n $missing ]] || return 0
  if may_install; then
    say "installing system packages: $missing"
    # shellcheck disable=SC2086  # a list of names
    as_root apt-get update -qq && as_root env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq $missing >/dev/null ||
      echo "warning: apt-get could not install them" >&2
    missing=$(missing_packages | paste -sd ' ')
    [[ -n $missing ]] || return 0
  fi
  say "not on this machine, and not installable from here: $missing"
  echo "    Debian, Ubuntu: sudo apt-get install $missing"
  echo "    Elsewhere: a C++20 compiler, Python >= 3.11 with headers and venv, CMake >= 3.25, Ninja, Eigen 3.4, Ceres 2.1, GoogleTest, nlohmann-json, Valgrind."
  has_command c++ || fail "without a C++ compiler (g++) sheetbend cannot be built."
  has_venv || fail "without Python >= 3.11 and its venv module (python3-venv) no environment can be made."
  has_python_headers || fail "without Python's headers (python3-dev) the module cannot be built."
  echo "    Going on without: CMake, Ninja and Eigen come from PyPI, without Ceres SciPy fits, without GoogleTest no C++ tests, without nlohmann-json no C++ library, without Valgrind no instruction counts."
}

make_environment() {
  if [[ ! -x $VENV/bin/pip ]]; then
    say "making the Python environment .venv"
    "$(find_python)" -m venv --clear "$VENV"
  fi
  PATH="$VENV/bin:$PATH"
  export PIP_DISABLE_PIP_VERSION_CHECK=1
}

# What the installed package depends on: its sources, its build files and the libraries that decide what is built.
fingerprint() {
  (
    cd "$ROOT" || exit
    find pyproject.toml CMakeLists.txt LICENSE licenses cmake core adjoint python -type f ! -name '*.pyc' ! -path '*/.*' -print0 |
      sort -z | xargs -0 sha256sum
    "$VENV/bin/python" --version
    for header in eigen3/Eigen/Core ceres/ceres.h; do
      if has_header "$header"; then echo "$header"; fi
    done
  ) | sha256sum | cut -d ' ' -f 1
}

build_requirements() {
  "$VENV/bin/python" - "$ROOT/pyproject.toml" <<'PYTHON'
import sys
import tomllib

with open(sys.argv[1], "rb") as file:
    print(*tomllib.load(file)["build-system"]["requires"], sep="\n")
PYTHON
}

# Compiles through ccache where it is installed; paths in the cache are relative, so another checkout finds what this one compiled.
use_compiler_cache() {
  has_command ccache || return 0
  export CMAKE_CXX_COMPILER_LAUNCHER=ccache CCACHE_BASEDIR="$ROOT" CCACHE_NOHASHDIR=1
}

# install_sheetbend EXTRAS: builds in place of pip's throw-away directory, so that a second build compiles only what changed. SHEETBEND_KERNELS says which kernels
# are compiled; without it, those for this machine. For `dev` those of all instruction sets are, which its tests compare; this also serves who asks for this machine's.
install_sheetbend() {
  local extras=$1 kernels=${SHEETBEND_KERNELS:-machine} found
  [[ $extras != dev ]] || kernels=all
  found=$(fingerprint)
  if [[ -e $STAMP ]] && grep -qxE "$found (${kernels/#machine/machine|all}) ($extras|dev)" "$STAMP"; then
    say "sheetbend is installed and up to date"
    return
  fi
  rm -f "$STAMP"
  say "installing what the build needs"
  local tools=()
  has_cmake || tools+=("cmake>=3.25")
  has_command ninja || tools+=(ninja)
  mapfile -t -O "${#tools[@]}" tools < <(build_requirements)
  pip install -q "${tools[@]}"
  say "building and installing sheetbend[$extras] (minutes the first time)"
  local settings=(--config-settings build-dir="$ROOT/build/wheel" --config-settings cmake.define.SHEETBEND_KERNELS="$kernels")
  [[ -z ${CI:-} ]] || settings+=(--config-settings cmake.define.SHEETBEND_WERROR=ON)
  pip install -q --no-build-isolation "${settings[@]}" "${ROOT}[$extras]"
  echo "$found $kernels $extras" >"$STAMP"
}

set_up() {
  install_system_packages
  make_environment
  use_compiler_cache
}
