#!/usr/bin/env bash
# Puts uPlot, which draws the plots of reports (docs/decisions/0006-reports.md), into the tree: fetched with npm, checked.
# For another version change the two lines below and run this; npm view uplot@VERSION dist.integrity prints the hash.
set -euo pipefail
VERSION=1.6.32
SHA512=KIMVnG68zvu5XXUbC4LQEPnhwOxBuLyW1AHtpm6IKTXImkbLgkMy+jabjLgSLMasNuGGzQm/ep3tOkyTxpiQIw==

assets=$(cd "$(dirname "${BASH_SOURCE[0]}")/../src/relform_analysis/relform_analysis/report/assets" && pwd)/uplot
work=$(mktemp -d)
trap 'rm -r "$work"' EXIT
cd "$work"
npm pack --silent "uplot@$VERSION"
found=$(openssl dgst -sha512 -binary "uplot-$VERSION.tgz" | base64 --wrap=0)
[ "$found" = "$SHA512" ] || { echo "vendor_uplot: uplot-$VERSION.tgz: unexpected hash $found" >&2; exit 1; }
tar --extract --gzip --file "uplot-$VERSION.tgz"
mkdir -p "$assets"
cp package/LICENSE package/dist/uPlot.iife.min.js package/dist/uPlot.min.css "$assets"
cd "$assets"
sha256sum LICENSE uPlot.iife.min.js uPlot.min.css > SHA256SUMS
echo "uPlot $VERSION is in $assets"
