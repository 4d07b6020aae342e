# SPDX-License-Identifier: Apache-2.0
# axiscal_instrument(TARGET [SOURCES ...])
#
# Compiles a target, or these of its sources, with what AXISCAL_INSTRUMENTATION says: coverage and sanitizers
# for the fuzzers, the thread sanitizer for what runs in parallel (presets fuzz and thread). What is not named
# so, the numerics above all, is compiled as ever, as it would take three times as long; the preset sanitize
# has all of it under the address and undefined-behaviour sanitizers.
set(AXISCAL_INSTRUMENTATION "" CACHE STRING "Compiler options of what is named by axiscal_instrument()")

function(axiscal_instrument target)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "" "SOURCES")
  if(arg_SOURCES)
    set_property(SOURCE ${arg_SOURCES} APPEND PROPERTY COMPILE_OPTIONS ${AXISCAL_INSTRUMENTATION})
  else()
    target_compile_options(${target} PRIVATE ${AXISCAL_INSTRUMENTATION})
  endif()
endfunction()
