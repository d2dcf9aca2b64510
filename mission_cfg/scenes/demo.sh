#!/bin/bash
# A fresh stretch of terrain, its map, and two drives over it.
# usage: demo.sh CAIRN FOLDER
set -euo pipefail
cairn=$1 out=$2
scene=$(dirname "$0")/demo.toml
mkdir -p "$out"
printf '\nRendering the site and the drive of %s\n' "$scene"
"$cairn" sim "$scene" -o "$out/data" --ortho 0.005
ortho=$out/data/ortho_5mm.tif
printf '\nPreparing the orbital map from %s\n' "$ortho"
"$cairn" map build "$ortho" -o "$out/site.cmap" --csv "$out/orbital.csv"
drive() { "$cairn" run --dataset "$out/data" --map "$out/site.cmap" --ortho "$ortho" "$@"; }
printf '\nDriving, VO as it is\n'
drive -o "$out/as_it_is"
printf '\nThe same with VO made worse on purpose (2 %% and 0.1 degrees a metre)\n'
drive -o "$out/degraded" --degrade scale=1.02,yaw=0.1deg/m
printf '\n'
"$cairn" report "$out/as_it_is" "$out/degraded" -o "$out/report.html"
echo 'Open it with a browser; it needs no network.'
