# SPDX-License-Identifier: Apache-2.0
# `cpack` makes a .deb of what `cmake --install` puts in place.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME axiscal)
set(CPACK_PACKAGE_VENDOR "The Axiscal developers")
set(CPACK_PACKAGE_CONTACT "The Axiscal developers <axiscal@invalid>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "${PROJECT_DESCRIPTION}")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
# Which packages hold the libraries that it was linked with, and those that it loads late.
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
get_property(late_packages GLOBAL PROPERTY AXISCAL_LATE_PACKAGES)
list(REMOVE_DUPLICATES late_packages)
list(JOIN late_packages ", " CPACK_DEBIAN_PACKAGE_DEPENDS)
include(CPack)
