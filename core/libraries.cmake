# The libraries under the floors, all from Debian (sample_data/setup.sh names the packages). The build and the installed package both look for them here.
include(CMakeFindDependencyMacro)
find_dependency(Eigen3 3.4 NO_MODULE)
find_dependency(Ceres 2.1)
find_dependency(fmt)
find_dependency(CLI11)
find_dependency(nlohmann_json)
find_dependency(tomlplusplus)
find_dependency(FastFloat)
find_dependency(PkgConfig)
pkg_check_modules(FFTW3 REQUIRED IMPORTED_TARGET fftw3)
pkg_check_modules(MATIO REQUIRED IMPORTED_TARGET matio)
if(NOT TARGET UDUNITS2::UDUNITS2)  # its .pc file goes by different names
  find_path(UDUNITS2_INCLUDE_DIR udunits2.h PATH_SUFFIXES udunits2 REQUIRED)
  find_library(UDUNITS2_LIBRARY udunits2 REQUIRED)
  add_library(UDUNITS2::UDUNITS2 UNKNOWN IMPORTED)
  set_target_properties(UDUNITS2::UDUNITS2 PROPERTIES
    IMPORTED_LOCATION "${UDUNITS2_LIBRARY}" INTERFACE_INCLUDE_DIRECTORIES "${UDUNITS2_INCLUDE_DIR}")
endif()
