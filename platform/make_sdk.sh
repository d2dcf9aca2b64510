#!/bin/bash
# The folder that integrators get, whole or not at all.
# usage: make_sdk.sh LIBRARY FOLDER    with TARGET, MISSION, CXX, CPU, FLAGS, RUN (how an IMAGE is run), EIGEN, EIGEN_TERMS,
#                                      and of a bare board BARE, BOARD_FILES, BOOT
set -euo pipefail
library=$1 sdk=$2
if [ -e "$sdk" ] && [ ! -f "$sdk/lib/pkgconfig/cairn.pc" ]; then
  echo "sdk: $sdk is there and is no SDK; choose another PREFIX"
  exit 1
fi
part=$sdk.part
rm -rf "$part"
mkdir -p "$part"/{lib/pkgconfig,include/cairn/hal,include/eigen3}
cp LICENSE NOTICE "$part"
cp "$library" "$part/lib"
board=${BARE:+'${prefix}'/platform/$TARGET}
sed -e "s|@TARGET@|$TARGET|; s|@MISSION@|$MISSION|; s|@CXX@|$CXX|; s|@CPU@|$CPU|; s|@BOARD@|$board|" \
    -e "s|@FLAGS@|$FLAGS|; s|@RUN@|$RUN|" platform/cairn.pc.in >"$part/lib/pkgconfig/cairn.pc"
(cd fsw && cp --parents -- */*.hpp "$part/include/cairn")
cp hal/*.hpp "$part/include/cairn/hal"
cp mission_cfg/*.hpp mission_cfg/"$MISSION"/*.hpp "$part/include/cairn"
cp -R "$EIGEN/Eigen" "$part/include/eigen3"
[ -z "$EIGEN_TERMS" ] || cp "$EIGEN_TERMS" "$part/include/eigen3/COPYRIGHT"
if [ -n "$BARE" ]; then
  # shellcheck disable=SC2086
  cp --parents $BOARD_FILES "$part"
  cp -R platform/example "$part/example"
  [ -z "$BOOT" ] || cp "$BOOT" "$part/platform/$TARGET/boot.elf"
fi
rm -rf "$sdk"
mv "$part" "$sdk"
echo "sdk: $sdk"
