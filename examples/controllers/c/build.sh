#!/bin/sh
# Compiles pid.c and packs it with modelDescription.xml: sh build.sh [FILE.fmu]
# Needs a C compiler, and zip or Python. Linux on x86-64; other systems: win64/pid.dll, darwin64/pid.dylib.
set -e
here=$(cd "$(dirname "$0")" && pwd)
case ${1:-pid.fmu} in /*) out=$1 ;; *) out=$PWD/${1:-pid.fmu} ;; esac
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
mkdir -p binaries/linux64
${CC:-cc} -std=c99 -O2 -Wall -Wextra -shared -fPIC -fvisibility=hidden "$here/pid.c" -o binaries/linux64/pid.so -lm
cp "$here/modelDescription.xml" .
rm -f "$out"
if command -v zip >/dev/null; then
    zip -qr "$out" modelDescription.xml binaries
else
    python3 -m zipfile -c "$out" modelDescription.xml binaries
fi
echo "$out"
