#!/usr/bin/env bash
# What takes long to load is not in the process of a program, or a library, from its
# start: VTK, and the parts of PCL that bring it or take as long themselves.
#
#   check_startup.sh PROGRAM
set -euo pipefail

loaded=$(ldd "$1")
if slow=$(grep -oE 'lib(vtk[^ ]*|Qt[^ ]*|pcl_(io|visualization|features|segmentation|filters|sample_consensus))[^ ]*' <<<"$loaded"); then
  echo "$1 loads" $slow
  exit 1
fi
echo "$1 loads $(wc -l <<<"$loaded") libraries, none of them slow"
