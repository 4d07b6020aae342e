# SPDX-License-Identifier: Apache-2.0
# `cpack` makes one Debian package of each install component. Configure with the preset `package`, which installs to
# /usr and puts libraries in the folder of the machine type.
find_program(AXISCAL_GZIP gzip)
mark_as_advanced(AXISCAL_GZIP)
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME axiscal)
set(CPACK_PACKAGE_VENDOR "The Axiscal developers")
set(CPACK_PACKAGE_CONTACT "The Axiscal developers <developers@axiscal.org>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "calibration of axis-sensitive instruments")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_GROUPING IGNORE)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
# A build with -g puts the debug symbols in separate packages (axiscal-dbgsym).
if("${CMAKE_CXX_FLAGS} ${CMAKE_CXX_FLAGS_RELEASE}" MATCHES "-g")
  set(CPACK_DEBIAN_DEBUGINFO_PACKAGE ON)
endif()
set(introduction
    "Axiscal calibrates accelerometers, inclinometers, magnetometers, gyroscopes and
optical sensors. The instrument sits in a cube that is laid on a table in 12
orientations; a regression gives bias, sensitivity and cross-axis terms with
their uncertainties.
.
This package contains
")

# axiscal_debian_package(COMPONENT PACKAGE CONTENT): sets the name and description of a component's package and
# installs its copyright, notices and changelog.
macro(axiscal_debian_package component package content)
  list(APPEND CPACK_COMPONENTS_ALL ${component})
  string(TOUPPER ${component} upper)
  set(CPACK_DEBIAN_${upper}_PACKAGE_NAME ${package})
  set(CPACK_COMPONENT_${upper}_DESCRIPTION "${introduction}${content}.")
  install(FILES "${PROJECT_SOURCE_DIR}/packaging/copyright" DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/${package}
          COMPONENT ${component})
  install(FILES "${PROJECT_BINARY_DIR}/packaging/THIRD-PARTY-NOTICES.gz"
          DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/${package} COMPONENT ${component})
  if(AXISCAL_GZIP)
    install(FILES "${PROJECT_BINARY_DIR}/packaging/changelog.gz" DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/${package}
            COMPONENT ${component})
  endif()
endmacro()

set(CPACK_COMPONENTS_ALL "")
axiscal_debian_package(command axiscal "the command axiscal")
axiscal_debian_package(report axiscal-report "the program for reports (HTML) and certificates (PDF)")
axiscal_debian_package(store axiscal-store "the program that keeps calibrations in SQLite or PostgreSQL")
if(TARGET axiscal-acquire)
  axiscal_debian_package(acquire axiscal-acquire "the program for live instruments: serial, IIO, MQTT, SCPI")
endif()
if(TARGET axiscal-read)
  axiscal_debian_package(hdf5 axiscal-hdf5 "the program that reads logs in HDF5 and MATLAB 7.3")
endif()
axiscal_debian_package(development libaxiscal-dev "the C++ library: headers, archives, CMake and pkg-config files")
if(TARGET axiscal_python)
  axiscal_debian_package(python python3-axiscal "the Python package axiscal")
  set(CPACK_DEBIAN_PYTHON_PACKAGE_SECTION python)
  set(CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS "python3, python3-numpy")
  set(CPACK_DEBIAN_PYTHON_PACKAGE_RECOMMENDS "python3-pandas, axiscal, axiscal-report")
endif()
set(own_version "axiscal (= ${PROJECT_VERSION})")
foreach(component IN ITEMS REPORT STORE ACQUIRE HDF5)
  set(CPACK_DEBIAN_${component}_PACKAGE_DEPENDS "${own_version}")
endforeach()
set(CPACK_DEBIAN_COMMAND_PACKAGE_RECOMMENDS "axiscal-hdf5, axiscal-report")
set(CPACK_DEBIAN_COMMAND_PACKAGE_SUGGESTS "axiscal-acquire, axiscal-store")
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS "libeigen3-dev, libgeographiclib-dev | libgeographic-dev")
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SHLIBDEPS OFF)

# axiscal_compress(FILE): compresses FILE with gzip -9n, as Debian's policy requires; equal input gives equal bytes.
function(axiscal_compress file)
  if(AXISCAL_GZIP)
    execute_process(COMMAND "${AXISCAL_GZIP}" -9nf "${file}" COMMAND_ERROR_IS_FATAL ANY)
  endif()
endfunction()
configure_file("${PROJECT_SOURCE_DIR}/packaging/changelog.in" "${PROJECT_BINARY_DIR}/packaging/changelog" @ONLY)
axiscal_compress("${PROJECT_BINARY_DIR}/packaging/changelog")

# THIRD-PARTY-NOTICES contains the licences of all linked libraries, copied from the system's packages.
set(notices "Axiscal contains parts of these libraries. THIRD-PARTY.md of its sources lists them.\n")
foreach(package IN ITEMS libeigen3-dev libgeographiclib-dev libgeographic-dev nlohmann-json3-dev libboost-dev libfmt-dev
                         libcli11-dev pybind11-dev libhwy-dev libpugixml-dev libyaml-cpp-dev libstdc++6)
  if(EXISTS "/usr/share/doc/${package}/copyright")
    file(READ "/usr/share/doc/${package}/copyright" text)
    string(APPEND notices "\n==== ${package} ====\n${text}")
  endif()
endforeach()
file(WRITE "${PROJECT_BINARY_DIR}/packaging/THIRD-PARTY-NOTICES" "${notices}")
axiscal_compress("${PROJECT_BINARY_DIR}/packaging/THIRD-PARTY-NOTICES")
include(CPack)
