# SPDX-License-Identifier: Apache-2.0
# axiscal_add_module(NAME [UNDER FOLDER] SOURCES ... [HEADERS ...] [PUBLIC ...] [PRIVATE ...]
#                    [HEADER_ONLY_PRIVATE ...])
#
# Adds the library of one folder: target axiscal_NAME, alias axiscal::NAME. Its public headers are in
# include/axiscal/NAME, or in include/axiscal/FOLDER if it is part of a larger module. The optional
# include/axiscal/NAME.hpp includes all of them and describes the module. PUBLIC and PRIVATE are link dependencies.
# HEADER_ONLY_PRIVATE dependencies are needed only to build the library. Headers outside of `include` are private:
# they are not installed, and they are included by the path from the root of the repository
# ("calib/fit/model.hpp"). axiscal::NAME_private adds that root to the include path.
function(axiscal_add_module name)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "UNDER" "SOURCES;HEADERS;PUBLIC;PRIVATE;HEADER_ONLY_PRIVATE")
  set(target axiscal_${name})
  set(folder ${name})
  if(arg_UNDER)
    set(folder ${arg_UNDER})
  endif()
  add_library(${target} STATIC ${arg_SOURCES})
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
  axiscal_precompile(${target} axiscal_core)
  set_target_properties(
    ${target}
    PROPERTIES EXPORT_NAME ${name}
               VERIFY_INTERFACE_HEADER_SETS ON)
  if(BUILD_SHARED_LIBS)
    set_target_properties(${target} PROPERTIES CXX_VISIBILITY_PRESET hidden VISIBILITY_INLINES_HIDDEN ON)
  endif()
  set_property(GLOBAL APPEND PROPERTY AXISCAL_MODULES ${target})
  # A module that is added later is not yet a target. So this loop refuses a dependency on a later module, for
  # example of the library on a tool.
  set_property(GLOBAL APPEND PROPERTY AXISCAL_MODULES_OF_${AXISCAL_RING} ${target})
  foreach(dependency IN LISTS arg_PUBLIC arg_PRIVATE)
    if(dependency MATCHES "^axiscal::" AND NOT TARGET ${dependency})
      message(FATAL_ERROR "${target}: ${dependency} is added later; a module may depend only on earlier modules")
    endif()
  endforeach()
endfunction()

# axiscal_precompile(TARGET FIRST): compiles the headers that most sources include only once, for the target FIRST. The
# other targets need the same sanitizers, and either all or none are optimised. g++ would also need all other options to
# be the same, so only clang uses precompiled headers.
function(axiscal_precompile target first)
  if(NOT CMAKE_CXX_COMPILER_ID MATCHES "Clang" OR AXISCAL_INSTRUMENTATION)
    return()
  endif()
  if(target STREQUAL first)
    target_precompile_headers(${target} PRIVATE <Eigen/Dense> <algorithm> <functional> <map> <memory> <nlohmann/json.hpp>
                                                <optional> <string> <utility> <vector>)
  else()
    target_precompile_headers(${target} REUSE_FROM ${first})
  endif()
endfunction()

# axiscal_compile_fast(TARGET): compiles with -O1 in release builds, for code whose speed does not matter. With -O0 the
# library would become slow too: the linker keeps one copy of each function of Eigen, and may keep the slow one.
function(axiscal_compile_fast target)
  target_compile_options(${target} PRIVATE $<$<CONFIG:Release>:-O1>)
endfunction()

# axiscal_link(TARGET LIBRARY PATH)
#
# Links a library that only this target's sources include. If AXISCAL_SMALL_LIBRARIES contains its name, its archive
# is linked, so that the programs of this build load one library less.
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

# axiscal_use_library(TARGET LIBRARY HEADER DEFINITION)
#
# Links a library that has no CMake package and that only this target's sources include, and defines DEFINITION.
# If the library is not installed, a status message says so and DEFINITION stays undefined.
function(axiscal_use_library target library header definition)
  find_path(${definition}_INCLUDE_DIR ${header})
  find_library(${definition}_LIBRARY ${library})
  mark_as_advanced(${definition}_INCLUDE_DIR ${definition}_LIBRARY)
  if(NOT ${definition}_INCLUDE_DIR OR NOT ${definition}_LIBRARY)
    message(STATUS "${target}: ${library} was not found; built without it")
    return()
  endif()
  target_compile_definitions(${target} PRIVATE ${definition})
  axiscal_link(${target} ${library} "${${definition}_LIBRARY}")
endfunction()

# axiscal_add_program(NAME [COMPONENT component] SOURCES ... LIBRARIES ...)
#
# Adds a program that `axiscal` starts. It is beside `axiscal` in the build folder and is installed in libexec
# (core/own_program.hpp finds it). It loads only the libraries that it calls.
function(axiscal_add_program name)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "COMPONENT" "SOURCES;LIBRARIES")
  add_executable(${name} ${arg_SOURCES})
  target_compile_options(${name} PRIVATE ${AXISCAL_WARNINGS})
  axiscal_harden(${name})
  axiscal_compile_fast(${name})
  target_link_libraries(${name} PRIVATE ${arg_LIBRARIES})
  target_link_options(${name} PRIVATE -Wl,--as-needed)
  set_target_properties(${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY "${PROJECT_BINARY_DIR}/cli")
  if(AXISCAL_INSTALL AND arg_COMPONENT)
    include(GNUInstallDirs)
    install(TARGETS ${name} RUNTIME DESTINATION ${CMAKE_INSTALL_LIBEXECDIR}/axiscal COMPONENT ${arg_COMPONENT})
  endif()
endfunction()

# axiscal_join_scripts(OUTPUT MODULE...): joins JavaScript modules to one script for an HTML page.
function(axiscal_join_scripts output)
  list(JOIN ARGN "," modules)
  add_custom_command(
    OUTPUT "${output}"
    COMMAND "${CMAKE_COMMAND}" "-DINPUTS=${modules}" "-DOUTPUT=${output}" -P
            "${PROJECT_SOURCE_DIR}/cmake/AxiscalJoinScripts.cmake"
    DEPENDS ${ARGN} "${PROJECT_SOURCE_DIR}/cmake/AxiscalJoinScripts.cmake")
endfunction()

# axiscal_embed(SOURCES FUNCTION FILE HEADER)
#
# Generates a source in which FUNCTION, declared in HEADER, returns the contents of FILE, and appends it to the list
# SOURCES. If FILE is an empty name, the function returns an empty text.
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
