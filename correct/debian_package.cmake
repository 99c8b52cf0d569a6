# cpack -G DEB --config build/CPackConfig.cmake: all that `cmake --install` installs, below /usr, as one Debian package for the Debian it is built on.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_VENDOR "the unrig authors")
set(CPACK_PACKAGE_CONTACT "the unrig authors <unrig@localhost>" CACHE STRING "who stands as the maintainer in the Debian package")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "take the rig out of an unsteady force measurement")
set(CPACK_PACKAGE_DESCRIPTION "From strain-gauge recordings of an unsteady aerodynamic or hydrodynamic
test to the load that a perfectly rigid rig would have felt: the program unrig,
its C++ library and its Python package.")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_PRE_BUILD_SCRIPTS ${PROJECT_SOURCE_DIR}/correct/debian_policy.cmake)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
# The libraries that the program and the Python module are linked to, by dpkg-shlibdeps; of our own, where they are shared, it reads the libraries themselves.
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
if(BUILD_SHARED_LIBS)
  set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS ${PROJECT_BINARY_DIR}/core ${PROJECT_BINARY_DIR}/fit ${PROJECT_BINARY_DIR}/correct)
  set(CPACK_DEBIAN_PACKAGE_GENERATE_SHLIBS ON)  # ldconfig too
endif()
if(TARGET unrig_python)
  string(REGEX MATCHALL "[0-9]+" version ${UNRIG_PYTHON_VERSION})
  list(GET version 0 major)
  list(GET version 1 minor)
  math(EXPR next "${minor} + 1")
  set(CPACK_DEBIAN_PACKAGE_DEPENDS "python3 (>= ${major}.${minor}), python3 (<< ${major}.${next}), python3-numpy")
  set(CPACK_DEBIAN_PACKAGE_RECOMMENDS "python3-xarray, python3-pandas")
endif()
# What compiles and links with the library.
set(CPACK_DEBIAN_PACKAGE_SUGGESTS "cmake, pkg-config, g++, libeigen3-dev, libceres-dev, libfftw3-dev, libudunits2-dev, libtomlplusplus-dev, nlohmann-json3-dev, libcli11-dev, libfmt-dev, libfast-float-dev, libhdf5-dev, zlib1g-dev")
install(FILES ${PROJECT_SOURCE_DIR}/LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR} RENAME copyright)  # where Debian looks for it
include(CPack)
