#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# make.sh OUTPUT.cpp HEADER ...: writes one program that runs each example (@code) in the headers' comments.
set -eu
output=$1
shift
{
  echo "// Made by tests/programs/make.sh; do not edit."
  printf '#include <cmath>\n#include <cstdio>\n#include <string>\n#include <vector>\n\n'
  for header in "$@"; do
    echo "#include \"axiscal/$(basename "$header")\""
  done
  echo "namespace {"
  for header in "$@"; do
    echo "void $(basename "$header" .hpp)_program() {"
    sed -n '/^\/\/\/ @code/,/^\/\/\/ @endcode/{//d;s#^/// \{0,1\}##;p;}' "$header"
    echo "}"
  done
  echo "}  // namespace"
  echo "int main() {"
  for header in "$@"; do
    echo "  $(basename "$header" .hpp)_program();"
  done
  echo '  std::printf("every program ran\\n");'
  echo "}"
} >"$output"
