# SPDX-License-Identifier: Apache-2.0
# cmake -DINPUT=FILE -DOUTPUT=FILE.cpp -DFUNCTION=NAME -DHEADER=FILE.hpp -P AxiscalEmbed.cmake
#
# Writes a source with a function that returns the bytes of INPUT. The bytes are empty if INPUT does not exist.
set(bytes "")
if(EXISTS "${INPUT}")
  file(READ "${INPUT}" bytes HEX)
endif()
string(REGEX REPLACE "([0-9a-f][0-9a-f])" "0x\\1," bytes "${bytes}")
string(REGEX REPLACE "(0x0a,)" "\\1\n" bytes "${bytes}")
file(WRITE "${OUTPUT}" "// Made from ${INPUT}; do not edit.
#include \"${HEADER}\"

namespace axiscal {

std::string_view ${FUNCTION}() {
  static constexpr unsigned char bytes[] = {${bytes}0};
  return {reinterpret_cast<const char*>(bytes), sizeof bytes - 1};
}

}  // namespace axiscal
")
