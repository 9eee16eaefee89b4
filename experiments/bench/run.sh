#!/usr/bin/env bash
# The whole comparison and the page that tells it: run.sh FOLDER [compare.py's options]. FOLDER keeps the peers' environments.
# It takes about half an hour on a quiet machine. PYTHON names an interpreter that has sheetbend[cli,plot]; python3 by default.
set -euo pipefail
folder=${1:?usage: run.sh FOLDER [options]}
shift
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
"$here/setup_peers.sh" "$folder"
"${PYTHON:-python3}" "$here/compare.py" "$folder" --page "$@"
