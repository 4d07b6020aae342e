# SPDX-License-Identifier: Apache-2.0
# cmake -DINPUTS=FILE,FILE,... -DOUTPUT=FILE.js -P AxiscalJoinScripts.cmake
#
# Writes modules as one script that a page holds: without the lines that import, and without the word export. A
# module comes after those that it imports.
string(REPLACE "," ";" inputs "${INPUTS}")
set(script "")
foreach(input IN LISTS inputs)
  file(READ "${input}" text)
  string(REGEX REPLACE "import [^;]*;\n" "" text "${text}")
  string(REGEX REPLACE "(^|\n)export " "\\1" text "${text}")
  string(APPEND script "${text}")
endforeach()
if(script MATCHES "</script|<!--")
  message(FATAL_ERROR "${OUTPUT}: a script within a page cannot hold ${CMAKE_MATCH_0}")
endif()
file(WRITE "${OUTPUT}" "(() => {\n\"use strict\";\n${script}})();\n")
