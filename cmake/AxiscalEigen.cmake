# SPDX-License-Identifier: Apache-2.0
# axiscal_eigen_alignment(FILE): writes a header with an #error for programs in which Eigen's alignment differs from
# this build's, for example with -march=native.
include(CheckCXXSourceCompiles)

function(axiscal_eigen_alignment file)
  get_directory_property(options COMPILE_OPTIONS)
  list(JOIN options " " CMAKE_REQUIRED_FLAGS)
  set(CMAKE_REQUIRED_LIBRARIES Eigen3::Eigen)
  foreach(macro IN ITEMS EIGEN_DEFAULT_ALIGN_BYTES EIGEN_MAX_STATIC_ALIGN_BYTES)
    # 16 is the usual value without -march, and 0 the value without vector code.
    foreach(bytes IN ITEMS 16 32 64 0)
      string(MD5 flags "${CMAKE_CXX_COMPILER} ${CMAKE_CXX_FLAGS} ${CMAKE_REQUIRED_FLAGS}")
      set(found AXISCAL_${macro}_IS_${bytes}_${flags})
      check_cxx_source_compiles(
        "#include <Eigen/Core>\nstatic_assert(${macro} == ${bytes});\nint main() {}" ${found})
      if(${found})
        set(AXISCAL_${macro} ${bytes})
        break()
      endif()
    endforeach()
    if(NOT DEFINED AXISCAL_${macro})
      message(FATAL_ERROR "Unknown alignment of Eigen: ${macro} is not 16, 32, 64 or 0")
    endif()
  endforeach()
  configure_file("${PROJECT_SOURCE_DIR}/cmake/eigen_alignment.hpp.in" "${file}" @ONLY)
endfunction()
