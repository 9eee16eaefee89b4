#!/usr/bin/env bash
# Makes the virtual environments of the peers, one each, under a folder: setup_peers.sh FOLDER [NAME ...]
# Names: numba jax warp torch taichi newton (the first three when none is given). An environment that is there is left alone.
set -euo pipefail
folder=${1:?usage: setup_peers.sh FOLDER [numba|jax|warp|torch|taichi|newton ...]}
shift
(($#)) || set -- numba jax warp
for name in "$@"; do
  case $name in
    numba | torch | taichi | newton) packages=("$name") ;;
    jax) packages=("jax[cpu]") ;;
    warp) packages=(warp-lang) ;;
    *)
      echo "error: no peer is called $name; name some of: numba jax warp torch taichi newton" >&2
      exit 2
      ;;
  esac
  if [[ -x $folder/$name/bin/python ]]; then
    echo "$name: $folder/$name is there"
    continue
  fi
  echo "$name: making $folder/$name"
  python3 -m venv "$folder/$name"
  "$folder/$name/bin/pip" install -q "${packages[@]}" numpy || {
    rm -rf "${folder:?}/$name"
    echo "error: ${packages[*]} could not be installed" >&2
    exit 1
  }
done
