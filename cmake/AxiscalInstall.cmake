# SPDX-License-Identifier: Apache-2.0
# What `cmake --install` puts where: libraries, headers, CMake package, pkg-config file, command.
include(CMakePackageConfigHelpers)
include(GNUInstallDirs)

set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/axiscal)
install(
  TARGETS ${axiscal_modules} axiscal_calib axiscal_all
  EXPORT axiscalTargets
  FILE_SET HEADERS DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
install(EXPORT axiscalTargets NAMESPACE axiscal:: DESTINATION ${package_dir})
configure_package_config_file(cmake/axiscalConfig.cmake.in axiscalConfig.cmake
                              INSTALL_DESTINATION ${package_dir})
write_basic_package_version_file(axiscalConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES "${CMAKE_CURRENT_BINARY_DIR}/axiscalConfig.cmake"
              "${CMAKE_CURRENT_BINARY_DIR}/axiscalConfigVersion.cmake" cmake/FindGeographicLib.cmake
        DESTINATION ${package_dir})

# Static libraries: the order matters, users first.
set(axiscal_pc_libs "")
foreach(module IN LISTS axiscal_modules)
  string(PREPEND axiscal_pc_libs "-l${module} ")
endforeach()
get_property(private_libraries GLOBAL PROPERTY AXISCAL_PRIVATE_LIBRARIES)
list(REMOVE_DUPLICATES private_libraries)
list(TRANSFORM private_libraries PREPEND "-l")
list(JOIN private_libraries " " axiscal_pc_private_libs)
# The package can be moved: its prefix is found from where the file lies.
cmake_path(RELATIVE_PATH CMAKE_INSTALL_PREFIX
           BASE_DIRECTORY "${CMAKE_INSTALL_FULL_LIBDIR}/pkgconfig" OUTPUT_VARIABLE axiscal_pc_prefix)
configure_file(cmake/axiscal.pc.in axiscal.pc @ONLY)
install(FILES "${CMAKE_CURRENT_BINARY_DIR}/axiscal.pc"
        DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig)

if(TARGET axiscal)
  install(TARGETS axiscal)
endif()
install(FILES LICENSE README.md CHANGELOG.md DESTINATION ${CMAKE_INSTALL_DOCDIR})
