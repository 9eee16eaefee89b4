#!/usr/bin/env bash
# Makes python/sheetbend/page/vendor from the versions in package.json. Needs Node.js and npm; nobody else does.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")"
VENDOR=../../python/sheetbend/page/vendor
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cp package.json view3d.js "$work"
(cd "$work" && npm install --no-package-lock --no-audit --no-fund --loglevel=error)
"$work/node_modules/.bin/esbuild" "$work/view3d.js" --bundle --minify --legal-comments=none --format=iife \
  --global-name=THREE --target=es2020 --outfile="$VENDOR/three.min.js"
cp "$work/node_modules/uplot/dist/uPlot.iife.min.js" "$VENDOR/uplot.min.js"
cp "$work/node_modules/uplot/dist/uPlot.min.css" "$VENDOR/uplot.min.css"
cp "$work/node_modules/three/LICENSE" ../../licenses/three-MIT.txt
cp "$work/node_modules/uplot/LICENSE" ../../licenses/uplot-MIT.txt
(cd "$VENDOR" && sha256sum three.min.js uplot.min.js uplot.min.css >SHA256SUMS)
