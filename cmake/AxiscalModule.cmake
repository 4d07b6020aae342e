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
  set_target_properties(
    ${target}
    PROPERTIES EXPORT_NAME ${name}
               VERIFY_INTERFACE_HEADER_SETS ON)
  if(BUILD_SHARED_LIBS)
    set_target_properties(${target} PROPERTIES CXX_VISIBILITY_PRESET hidden VISIBILITY_INLINES_HIDDEN ON)
  endif()
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
# Links a library that only this target's sources see, by its name. If AXISCAL_STATIC_SMALL_LIBRARIES
# has its archive linked, the programs of this build have one library less to load.
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
# Links a library that has no CMake package and that only this target's sources see, and defines
# DEFINITION. If the library is not installed, it says so and goes on.
function(axiscal_use_library target library header definition)
  find_path(${definition}_INCLUDE_DIR ${header})
  find_library(${definition}_LIBRARY ${library})
  mark_as_advanced(${definition}_INCLUDE_DIR ${definition}_LIBRARY)
  if(NOT ${definition}_INCLUDE_DIR OR NOT ${definition}_LIBRARY)
    message(STATUS "${target}: ${library} is not there; built without it")
    return()
  endif()
  target_compile_definitions(${target} PRIVATE ${definition})
  axiscal_link(${target} ${library} "${${definition}_LIBRARY}")
endfunction()

# axiscal_add_program(NAME [COMPONENT component] SOURCES ... LIBRARIES ...)
#
# A program of the command's: beside `axiscal` in the build, and in libexec when it is installed
# (core/own_program.hpp finds it). It loads the libraries that it calls, and no others.
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

# axiscal_join_scripts(OUTPUT MODULE...): modules of JavaScript as the one script of a page.
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
