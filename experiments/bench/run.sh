#!/usr/bin/env bash
# The whole comparison and the page that tells it: run.sh FOLDER [compare.py's options]. FOLDER keeps the peers' environments.
# It takes about half an hour on a quiet machine. PYTHON names an interpreter that has sheetbend[cli,plot]; python3 by default.
set -euo pipefail
folder=${1:?usage: run.sh FOLDER [options]}
shift
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
python=${PYTHON:-python3}
"$here/setup_peers.sh" "$folder"
"$python" "$here/compare.py" "$folder" "$@"
# what compare.py has just written
newest=$(ls -t "$here"/results/*.json | head -n 1)
"$python" "$here/table.py" "$newest"
echo "tables of docs/benchmarks.md written from $newest"
