# SPDX-License-Identifier: Apache-2.0
# Finds GeographicLib through pkg-config: Debian's package does not include a CMake config file.
# Defines the target GeographicLib::GeographicLib.
find_package(PkgConfig QUIET)
if(PkgConfig_FOUND)
  pkg_check_modules(PC_GeographicLib QUIET geographiclib)
endif()
find_path(GeographicLib_INCLUDE_DIR GeographicLib/NormalGravity.hpp
          HINTS ${PC_GeographicLib_INCLUDE_DIRS})
find_library(GeographicLib_LIBRARY NAMES GeographicLib Geographic
             HINTS ${PC_GeographicLib_LIBRARY_DIRS})
string(REGEX REPLACE "[.]so$" ".a" GeographicLib_ARCHIVE "${GeographicLib_LIBRARY}")
if(GeographicLib IN_LIST AXISCAL_SMALL_LIBRARIES AND EXISTS "${GeographicLib_ARCHIVE}")
  set(GeographicLib_LIBRARY "${GeographicLib_ARCHIVE}")
elseif(GeographicLib IN_LIST AXISCAL_SMALL_LIBRARIES)
  set_property(GLOBAL PROPERTY AXISCAL_SMALL_LIBRARIES_SHARED TRUE)
endif()
set(GeographicLib_VERSION ${PC_GeographicLib_VERSION})

include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(
  GeographicLib
  REQUIRED_VARS GeographicLib_LIBRARY GeographicLib_INCLUDE_DIR
  VERSION_VAR GeographicLib_VERSION)

if(GeographicLib_FOUND AND NOT TARGET GeographicLib::GeographicLib)
  add_library(GeographicLib::GeographicLib UNKNOWN IMPORTED)
  set_target_properties(
    GeographicLib::GeographicLib
    PROPERTIES IMPORTED_LOCATION "${GeographicLib_LIBRARY}"
               INTERFACE_INCLUDE_DIRECTORIES "${GeographicLib_INCLUDE_DIR}")
endif()
mark_as_advanced(GeographicLib_INCLUDE_DIR GeographicLib_LIBRARY)
