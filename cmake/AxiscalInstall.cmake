# SPDX-License-Identifier: Apache-2.0
# The install rules of libraries, headers, the CMake package, pkg-config files and the command.
# The components are `development`, `command` (cli/CMakeLists.txt) and one for each program that the command starts.
include(CMakePackageConfigHelpers)
include(GNUInstallDirs)

set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/axiscal)
set(component_targets ${axiscal_modules} axiscal_calib)
if(BUILD_SHARED_LIBS)
  # The installed target of each module links libaxiscal.so.
  foreach(module IN LISTS component_targets)
    string(REGEX REPLACE "^axiscal_" "" name ${module})
    add_library(axiscal_of_${name} INTERFACE)
    set_target_properties(axiscal_of_${name} PROPERTIES EXPORT_NAME ${name})
    target_link_libraries(axiscal_of_${name} INTERFACE axiscal_library)
    install(TARGETS axiscal_of_${name} EXPORT axiscalTargets)
    get_target_property(header_folders ${module} HEADER_DIRS)
    if(NOT header_folders)
      continue()  # a module without public headers
    endif()
    foreach(folder IN LISTS header_folders)
      install(DIRECTORY "${folder}/" DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT development)
    endforeach()
  endforeach()
  target_include_directories(axiscal_library INTERFACE $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
else()
  install(
    TARGETS ${component_targets}
    EXPORT axiscalTargets
    ARCHIVE COMPONENT development
    FILE_SET HEADERS DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT development)
endif()
install(
  TARGETS axiscal_library axiscal_all
  EXPORT axiscalTargets
  LIBRARY COMPONENT development
  FILE_SET HEADERS DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT development)
install(EXPORT axiscalTargets NAMESPACE axiscal:: DESTINATION ${package_dir} COMPONENT development)
list(TRANSFORM axiscal_modules REPLACE "^axiscal_" "" OUTPUT_VARIABLE axiscal_component_names)
list(APPEND axiscal_component_names calib axiscal)
list(JOIN axiscal_component_names ", " axiscal_component_names)
configure_package_config_file(cmake/axiscalConfig.cmake.in axiscalConfig.cmake
                              INSTALL_DESTINATION ${package_dir})
write_basic_package_version_file(axiscalConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES "${CMAKE_CURRENT_BINARY_DIR}/axiscalConfig.cmake"
              "${CMAKE_CURRENT_BINARY_DIR}/axiscalConfigVersion.cmake" cmake/FindGeographicLib.cmake
        DESTINATION ${package_dir} COMPONENT development)

# The installed files can be moved: a .pc file computes the prefix from its own folder.
cmake_path(RELATIVE_PATH CMAKE_INSTALL_PREFIX
           BASE_DIRECTORY "${CMAKE_INSTALL_FULL_LIBDIR}/pkgconfig" OUTPUT_VARIABLE axiscal_pc_prefix)
# axiscal_install_pc(NAME TARGET): installs NAME.pc with all libraries that the target links, so that
# `pkg-config --cflags --libs NAME` is enough. For a shared library it lists only libraries that public headers use.
function(axiscal_install_pc pc_name target)
  set(libs "")
  set(requires "")
  get_target_property(type ${target} TYPE)
  if(NOT type STREQUAL "INTERFACE_LIBRARY")
    get_target_property(name ${target} OUTPUT_NAME)
    if(NOT name)
      set(name ${target})
    endif()
    list(APPEND libs "-l${name}")
  endif()
  get_target_property(links ${target} INTERFACE_LINK_LIBRARIES)
  foreach(link IN LISTS links)
    string(REGEX REPLACE "^\\$<LINK_ONLY:(.*)>$" "\\1" name "${link}")
    string(REGEX REPLACE "^\\$<INSTALL_INTERFACE:(.*)>$" "\\1" name "${name}")
    if(name MATCHES "BUILD_INTERFACE" OR NOT name)
      continue()
    elseif(name MATCHES "^axiscal(::|_)(.*)$")
      list(APPEND requires axiscal-${CMAKE_MATCH_2})
    elseif(name STREQUAL "Eigen3::Eigen")
      list(APPEND requires eigen3)
    elseif(name STREQUAL "GeographicLib::GeographicLib")
      list(APPEND requires geographiclib)
    elseif(name STREQUAL "Threads::Threads")
      list(APPEND libs -pthread)
    elseif(name MATCHES "::")
      message(FATAL_ERROR "${pc_name}.pc: the pkg-config name of ${name} is unknown; add it to axiscal_install_pc()")
    else()
      list(APPEND libs "-l${name}")
    endif()
  endforeach()
  foreach(list IN ITEMS libs requires)
    list(REMOVE_DUPLICATES ${list})
    list(JOIN ${list} " " ${list})
  endforeach()
  configure_file(cmake/axiscal.pc.in ${pc_name}.pc @ONLY)
  install(FILES "${CMAKE_CURRENT_BINARY_DIR}/${pc_name}.pc" DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig
          COMPONENT development)
endfunction()
if(BUILD_SHARED_LIBS)
  axiscal_install_pc(axiscal axiscal_library)
else()
  foreach(module IN LISTS axiscal_modules ITEMS axiscal_calib axiscal_library)
    string(REGEX REPLACE "^axiscal_" "axiscal-" pc_name ${module})
    axiscal_install_pc(${pc_name} ${module})
  endforeach()
  axiscal_install_pc(axiscal axiscal_all)
endif()

if(TARGET axiscal)
  install(TARGETS axiscal RUNTIME COMPONENT command)
endif()
install(FILES README.md DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT development)
