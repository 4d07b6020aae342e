# SPDX-License-Identifier: Apache-2.0
# axiscal_harden(TARGET)
#
# Compiles a target with the hardening options that Linux distributions use: position-independent code, stack
# protector, _FORTIFY_SOURCE, control-flow protection (x86-64), and full RELRO for executables. Builds with
# sanitizers are not hardened.
option(AXISCAL_HARDENING "Stack protector, FORTIFY, control-flow protection, full RELRO" ON)

include(CheckCXXCompilerFlag)
include(CheckPIESupported)
check_pie_supported(LANGUAGES CXX)
check_cxx_compiler_flag(-fstack-protector-strong AXISCAL_HAS_STACK_PROTECTOR)
check_cxx_compiler_flag(-fcf-protection=full AXISCAL_HAS_CF_PROTECTION)

function(axiscal_harden target)
  set_target_properties(${target} PROPERTIES POSITION_INDEPENDENT_CODE ON)
  if(NOT AXISCAL_HARDENING OR AXISCAL_BUILD_FUZZ OR CMAKE_CXX_FLAGS MATCHES "-fsanitize")
    return()
  endif()
  if(AXISCAL_HAS_STACK_PROTECTOR)
    target_compile_options(${target} PRIVATE -fstack-protector-strong)
  endif()
  if(AXISCAL_HAS_CF_PROTECTION)
    target_compile_options(${target} PRIVATE -fcf-protection=full)
  endif()
  # _FORTIFY_SOURCE needs optimisation. -U comes first because some compilers define it themselves.
  target_compile_options(${target}
                         PRIVATE $<$<NOT:$<CONFIG:Debug>>:-U_FORTIFY_SOURCE -D_FORTIFY_SOURCE=2>)
  get_target_property(type ${target} TYPE)
  if(type STREQUAL "EXECUTABLE" AND CMAKE_SYSTEM_NAME STREQUAL "Linux")
    target_link_options(${target} PRIVATE -Wl,-z,relro,-z,now)
  endif()
endfunction()
