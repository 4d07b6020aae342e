# SPDX-License-Identifier: Apache-2.0
# cmake -DINPUTS=FILE,FILE,... -DOUTPUT=FILE.js -P AxiscalJoinScripts.cmake
#
# Joins JavaScript modules to one script for an HTML page. Import lines and the word export are removed. INPUTS must
# list a module after the modules that it imports.
string(REPLACE "," ";" inputs "${INPUTS}")
set(script "")
foreach(input IN LISTS inputs)
  file(READ "${input}" text)
  string(REGEX REPLACE "import [^;]*;\n" "" text "${text}")
  string(REGEX REPLACE "(^|\n)export " "\\1" text "${text}")
  string(APPEND script "${text}")
endforeach()
if(script MATCHES "</script|<!--")
  message(FATAL_ERROR "${OUTPUT}: a script within a page cannot contain ${CMAKE_MATCH_0}")
endif()
file(WRITE "${OUTPUT}" "(() => {\n\"use strict\";\n${script}})();\n")
