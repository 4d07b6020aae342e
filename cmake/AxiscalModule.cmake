# SPDX-License-Identifier: Apache-2.0
# axiscal_add_module(NAME [UNDER FOLDER] SOURCES ... [HEADERS ...] [PUBLIC ...] [PRIVATE ...]
#                    [HEADER_ONLY_PRIVATE ...])
#
# One library per folder: target axiscal_NAME, alias axiscal::NAME, headers under include/axiscal/NAME, or
# for a room of a larger module under include/axiscal/FOLDER; include/axiscal/NAME.hpp, where it is there, has
# them all and says what the module is for. PUBLIC and PRIVATE are link dependencies;
# HEADER_ONLY_PRIVATE are needed to build it and by no user. A header beside or below the module's
# CMakeLists.txt, outside of `include`, is private: it is not installed, and it is included by its path from
# the root of the repository ("calib/fit/model.hpp"). axiscal::NAME_private gives that path.
function(axiscal_add_module name)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "UNDER" "SOURCES;HEADERS;PUBLIC;PRIVATE;HEADER_ONLY_PRIVATE")
  set(target axiscal_${name})
  set(folder ${name})
  if(arg_UNDER)
    set(folder ${arg_UNDER})
  endif()
  add_library(${target} ${arg_SOURCES})
  add_library(axiscal::${name} ALIAS ${target})
  if(arg_HEADERS)
    list(TRANSFORM arg_HEADERS PREPEND include/axiscal/${folder}/)
    if(EXISTS "${CMAKE_CURRENT_SOURCE_DIR}/include/axiscal/${name}.hpp")
      list(APPEND arg_HEADERS include/axiscal/${name}.hpp)
    endif()
    target_sources(${target} PUBLIC FILE_SET HEADERS BASE_DIRS include FILES ${arg_HEADERS})
  endif()
  add_library(${target}_private INTERFACE)
  add_library(axiscal::${name}_private ALIAS ${target}_private)
  target_include_directories(${target}_private INTERFACE "${PROJECT_SOURCE_DIR}")
  list(APPEND arg_HEADER_ONLY_PRIVATE axiscal::${name}_private)
  target_compile_features(${target} PUBLIC cxx_std_20)
  target_compile_options(${target} PRIVATE ${AXISCAL_WARNINGS})
  axiscal_harden(${target})
  target_link_libraries(${target} PUBLIC ${arg_PUBLIC} PRIVATE ${arg_PRIVATE})
  foreach(dependency IN LISTS arg_HEADER_ONLY_PRIVATE)
    target_link_libraries(${target} PRIVATE $<BUILD_INTERFACE:${dependency}>)
  endforeach()
  set_target_properties(
    ${target}
    PROPERTIES EXPORT_NAME ${name}
               VERSION ${PROJECT_VERSION}
               SOVERSION ${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR}
               VERIFY_INTERFACE_HEADER_SETS ON)
  set_property(GLOBAL APPEND PROPERTY AXISCAL_MODULES ${target})
  # What is added later is no target yet, so that a module of the library could link a tool only as a
  # mere name; that is refused here.
  set_property(GLOBAL APPEND PROPERTY AXISCAL_MODULES_OF_${AXISCAL_RING} ${target})
  foreach(dependency IN LISTS arg_PUBLIC arg_PRIVATE)
    if(dependency MATCHES "^axiscal::" AND NOT TARGET ${dependency})
      message(FATAL_ERROR "${target}: ${dependency} comes later; dependence goes one way")
    endif()
  endforeach()
endfunction()

# axiscal_compile_fast(TARGET): code that is not waited for when it runs need not be when it is compiled.
function(axiscal_compile_fast target)
  target_compile_options(${target} PRIVATE $<$<CONFIG:Release>:-O1>)
endfunction()

# axiscal_link(TARGET LIBRARY PATH)
#
# Links a library that only this target's sources see, by its name. Where AXISCAL_STATIC_SMALL_LIBRARIES
# has its archive linked, a program of this build has one library less to load.
function(axiscal_link target library path)
  string(REGEX REPLACE "[.]so$" ".a" archive "${path}")
  if(library IN_LIST AXISCAL_SMALL_LIBRARIES AND EXISTS "${archive}")
    get_filename_component(file "${archive}" NAME)
    target_link_libraries(${target} PRIVATE $<BUILD_INTERFACE:-l:${file}> $<INSTALL_INTERFACE:${library}>)
  else()
    target_link_libraries(${target} PRIVATE ${library})
    if(library IN_LIST AXISCAL_SMALL_LIBRARIES)
      set_property(GLOBAL PROPERTY AXISCAL_SMALL_LIBRARIES_SHARED TRUE)
    endif()
  endif()
endfunction()

# axiscal_start_soon(TARGET)
#
# Links the program with the compiler's own libraries within it, where AXISCAL_STATIC_SMALL_LIBRARIES has that
# done and no library of C++ is left that it loads at its start: two thirds of what the loader did were
# libstdc++'s symbols. No exception may then cross to a library that is loaded later, nor leave what
# std::call_once calls. And relocations take few bytes.
function(axiscal_start_soon target)
  get_property(shared GLOBAL PROPERTY AXISCAL_SMALL_LIBRARIES_SHARED)
  if(NOT AXISCAL_SMALL_LIBRARIES OR NOT AXISCAL_LATE_LIBRARIES OR shared OR
     "${CMAKE_CXX_FLAGS} ${CMAKE_EXE_LINKER_FLAGS}" MATCHES "-fsanitize")
    return()
  endif()
  include(CheckCXXSourceCompiles)
  # An older C library refuses a program with packed relocations, though the linker makes one.
  set(reads_packed "#include <cstdlib>\n#if defined(__GLIBC__) && !__GLIBC_PREREQ(2, 36)\n#error\n#endif\n")
  set(program "#include <iostream>\nint main() { std::cout << 1; }")
  set(CMAKE_REQUIRED_LINK_OPTIONS -static-libstdc++ -static-libgcc)
  check_cxx_source_compiles("${program}" AXISCAL_HAS_STATIC_COMPILER_LIBRARIES)
  if(AXISCAL_HAS_STATIC_COMPILER_LIBRARIES)
    target_link_options(${target} PRIVATE ${CMAKE_REQUIRED_LINK_OPTIONS})
  endif()
  set(CMAKE_REQUIRED_LINK_OPTIONS -Wl,-z,pack-relative-relocs)
  check_cxx_source_compiles("${reads_packed}${program}" AXISCAL_HAS_PACKED_RELOCATIONS)
  if(AXISCAL_HAS_PACKED_RELOCATIONS)
    target_link_options(${target} PRIVATE ${CMAKE_REQUIRED_LINK_OPTIONS})
  endif()
endfunction()

# axiscal_use_library(TARGET LIBRARY HEADER DEFINITION [LATE])
#
# Links a library that has no CMake package and that only this target's sources see, and defines
# DEFINITION; says so and goes on where it is not installed. With LATE the sources load it when they first
# call it, as core/late_library.hpp says.
function(axiscal_use_library target library header definition)
  find_path(${definition}_INCLUDE_DIR ${header})
  find_library(${definition}_LIBRARY ${library})
  mark_as_advanced(${definition}_INCLUDE_DIR ${definition}_LIBRARY)
  if(NOT ${definition}_INCLUDE_DIR OR NOT ${definition}_LIBRARY)
    message(STATUS "${target}: ${library} is not there; built without it")
    return()
  endif()
  target_compile_definitions(${target} PRIVATE ${definition})
  if("LATE" IN_LIST ARGN)
    axiscal_load_late(${target} ${library} "${${definition}_LIBRARY}" ${definition})
  else()
    axiscal_link(${target} ${library} "${${definition}_LIBRARY}")
  endif()
endfunction()

# axiscal_load_late(TARGET LIBRARY PATH DEFINITION)
#
# Defines DEFINITION_FILE, a library's soname, and DEFINITION_PACKAGE, what installs it; links the library
# where it has no soname, or nothing is to be loaded late.
function(axiscal_load_late target library path definition)
  if(NOT AXISCAL_LATE_LIBRARIES OR NOT EXISTS "${path}")
    axiscal_link(${target} ${library} "${path}")
    return()
  endif()
  file(REAL_PATH "${path}" real)
  if(NOT "${${definition}_LATE}" STREQUAL "${real}")
    execute_process(COMMAND "${CMAKE_OBJDUMP}" -p "${path}" OUTPUT_VARIABLE said ERROR_QUIET)
    set(soname "")
    if(said MATCHES "SONAME +([^ \n]+)")
      set(soname "${CMAKE_MATCH_1}")
    endif()
    set(package "")
    execute_process(COMMAND dpkg-query -S "${real}" OUTPUT_VARIABLE said ERROR_QUIET)
    if(said MATCHES "^([^:,]+)")
      set(package "${CMAKE_MATCH_1}")
    endif()
    set(${definition}_LATE "${real}" CACHE INTERNAL "")
    set(${definition}_SONAME "${soname}" CACHE INTERNAL "")
    set(${definition}_PACKAGE "${package}" CACHE INTERNAL "")
  endif()
  if("${${definition}_SONAME}" STREQUAL "")
    axiscal_link(${target} ${library} "${path}")
    return()
  endif()
  target_compile_definitions(
    ${target} PRIVATE ${definition}_LATE ${definition}_FILE="${${definition}_SONAME}"
                      ${definition}_PACKAGE="${${definition}_PACKAGE}")
  target_link_libraries(${target} PRIVATE ${CMAKE_DL_LIBS})
  set_property(GLOBAL APPEND PROPERTY AXISCAL_LATE_PACKAGES ${${definition}_PACKAGE})
endfunction()

# axiscal_find_own_files(TARGET)
#
# TARGET looks for modules and programs of ours at run time: late_module.hpp.
function(axiscal_find_own_files target)
  include(GNUInstallDirs)
  file(RELATIVE_PATH from_program "${CMAKE_INSTALL_FULL_BINDIR}" "${CMAKE_INSTALL_FULL_LIBDIR}/axiscal")
  target_compile_definitions(
    ${target} PRIVATE AXISCAL_BUILD_TREE="${CMAKE_BINARY_DIR}"
                      AXISCAL_OWN_FILES_BUILT="${PROJECT_BINARY_DIR}/modules"
                      AXISCAL_OWN_FILES_FROM_PROGRAM="${from_program}"
                      AXISCAL_OWN_FILES_INSTALLED="${CMAKE_INSTALL_FULL_LIBDIR}/axiscal")
  target_link_libraries(${target} PRIVATE ${CMAKE_DL_LIBS})
endfunction()

# axiscal_add_late_module(TARGET MODULE DEFINITION SOURCE... )
#
# Compiles sources of TARGET that need a library of C++ again, as a MODULE that is loaded when it is first
# asked for; DEFINITION is its file's name, for TARGET.
function(axiscal_add_late_module target module definition)
  add_library(${module} MODULE ${ARGN})
  target_include_directories(${module} PRIVATE "${PROJECT_SOURCE_DIR}")
  set_target_properties(
    ${module} PROPERTIES PREFIX "" CXX_VISIBILITY_PRESET hidden UNITY_BUILD OFF
                         LIBRARY_OUTPUT_DIRECTORY "${PROJECT_BINARY_DIR}/modules")
  target_compile_options(${module} PRIVATE ${AXISCAL_WARNINGS})
  axiscal_harden(${module})
  target_compile_definitions(${target} PRIVATE ${definition}="${module}.so")
  axiscal_find_own_files(${target})
  add_dependencies(${target} ${module})
  if(AXISCAL_INSTALL)
    install(TARGETS ${module} LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR}/axiscal)
  endif()
endfunction()

# axiscal_embed(SOURCES FUNCTION FILE HEADER)
#
# Appends to the list SOURCES a source in which FUNCTION of HEADER returns the file; an empty FILE makes
# an empty text.
function(axiscal_embed sources function file header)
  set(output "${CMAKE_CURRENT_BINARY_DIR}/${function}.cpp")
  set(depends "")
  if(file)
    set(depends "${file}")
  endif()
  add_custom_command(
    OUTPUT "${output}"
    COMMAND
      "${CMAKE_COMMAND}" "-DINPUT=${file}" "-DOUTPUT=${output}" "-DFUNCTION=${function}"
      "-DHEADER=${header}" -P "${PROJECT_SOURCE_DIR}/cmake/AxiscalEmbed.cmake"
    DEPENDS ${depends} "${PROJECT_SOURCE_DIR}/cmake/AxiscalEmbed.cmake")
  set(${sources} ${${sources}} "${output}" PARENT_SCOPE)
endfunction()
