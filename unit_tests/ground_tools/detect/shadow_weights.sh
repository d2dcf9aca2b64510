#!/bin/sh
# Renders the fields that are not there yet, and fits: `make shadow-weights`.
#   shadow_weights.sh CAIRN PROGRAM FOLDER 'FIELD...' 'FIELD...'
# Fields to fit to and to judge by, each as SEED-ELEVATION-AZIMUTH: 20 m at 5, 10 and 20 mm a pixel, and
# 100 m of a rockier kind at 25 cm.
set -eu
cairn=$1 program=$2 out=$3 fit=$4 held_out=$5

render() {  # FIELD PART ORTHO SETTING...
  field=$1 part=$2 ortho=$3
  shift 3
  folder=$out/$field/$part
  [ -e "$folder/.rendered" ] && return
  rm -rf "$folder"
  elevation_azimuth=${field#*-}
  set -- "$@" "seed=${field%%-*}" "ortho_sun.elevation_deg=${elevation_azimuth%-*}" \
    "ortho_sun.azimuth_deg=${elevation_azimuth#*-}" traverse.kind=straight
  for setting do set -- "$@" --set "$setting"; shift; done
  "$cairn" sim "$@" --no-frames --ortho "$ortho" -o "$folder" >/dev/null
  touch "$folder/.rendered"
}

for field in $fit $held_out; do
  render "$field" near 0.005,0.01,0.02 site.size_m=20 traverse.length_m=5
  render "$field" far 0.25 site.size_m=100 traverse.length_m=20 rocks.k=0.15 rocks.min_diameter_m=0.3 \
    rocks.max_diameter_m=8 rocks.pebble_min_diameter_m=0.15
done
folders() { for field do printf '%s ' "$out/$field/near" "$out/$field/far"; done; }
# shellcheck disable=SC2046,SC2086
"$program" $(folders $fit) -- $(folders $held_out)
