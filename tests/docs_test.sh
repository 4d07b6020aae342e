#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# docs_test.sh SOURCE_DIR: what comments cite exists: sections of docs/method.md by number, sections of
# docs/formats.md by name, and documents by file name. docs/messages.md also names every warning of calib.
set -eu
cd "$1"
text=$(mktemp)
trap 'rm -f "$text"' EXIT
# Joins the comments of each file to one line, since a citation may be broken between two lines.
find . \( -name 'build*' -o -name node_modules -o -name .git \) -prune -o \( -name '*.hpp' -o -name '*.cpp' \) -print |
  while read -r file; do
    sed -n 's#^.*//[/<]* ##p' "$file" | tr '\n' ' '
    echo
  done >"$text"
status=0
complain() {
  echo "$*"
  status=1
}
for cited in $(grep -oE 'method\.md, sections? [0-9.]*[0-9]( (and|to) [0-9.]*[0-9])?' "$text" |
  sed -E 's/^method\.md, sections? //; s/ to /-/; s/ and /\n/' | sort -u); do
  for number in $(seq -s ' ' "${cited%-*}" "${cited#*-}" 2>/dev/null); do
    grep -qE "^##+ $number\.? " docs/method.md || complain "docs/method.md has no section $number, which a comment cites"
  done
done
grep -oE 'formats\.md, [A-Z][a-z]+( readings)?' "$text" | sed 's/^formats\.md, //; s/ /_/' | sort -u >"$text.names"
for name in $(cat "$text.names"); do
  grep -q "^## $(echo "$name" | tr _ ' ')" docs/formats.md || complain "docs/formats.md has no section $name, which a comment cites"
done
rm -f "$text.names"
for document in $(grep -oE 'docs/[a-z_]+\.md' "$text" | sort -u); do
  [ -e "$document" ] || complain "$document, which a comment cites, does not exist"
done
for code in $(grep -oE '\.name = "[a-z_]+"' calib/record/src/warning_code.cpp | grep -oE '"[a-z_]+"' | tr -d '"'); do
  grep -q "\`$code\`" docs/messages.md || complain "docs/messages.md does not name the warning $code"
done
# The library names its settings in its own words; only cli knows their names on the command line.
if grep -rnE '"([^"]*[ (])?--[a-z][a-z-]+' --include='*.cpp' --include='*.hpp' \
  core field positioner instruments kernels calib logs exchange report acquisition; then
  complain "a message of the library names an option: let the error carry a Setting (axiscal/core/setting.hpp)"
fi
exit $status
