# SPDX-License-Identifier: Apache-2.0
# axiscal_instrument(TARGET [SOURCES ...])
#
# Compiles a target, or only the named sources of it, with the options in AXISCAL_INSTRUMENTATION: coverage and
# sanitizers for the fuzzers (preset fuzz), the thread sanitizer for parallel code (preset thread). All other sources,
# mainly the numerics, are compiled without these options, with which they would run three times as long. The preset
# sanitize compiles all sources with the address and undefined-behaviour sanitizers.
set(AXISCAL_INSTRUMENTATION "" CACHE STRING "Compiler options of the targets and sources named in axiscal_instrument()")

function(axiscal_instrument target)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "" "SOURCES")
  if(arg_SOURCES)
    set_property(SOURCE ${arg_SOURCES} APPEND PROPERTY COMPILE_OPTIONS ${AXISCAL_INSTRUMENTATION})
  else()
    target_compile_options(${target} PRIVATE ${AXISCAL_INSTRUMENTATION})
  endif()
endfunction()
