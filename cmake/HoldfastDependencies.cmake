# Everything the libraries and programs stand on; tests and benchmarks add their own.

# ---- core: these, and nothing else ----

find_package(Eigen3 3.4 REQUIRED NO_MODULE)
find_package(Boost 1.74 REQUIRED) # Boost.Math, headers only
find_package(Threads REQUIRED)

# The fit kernel in vectors of whatever the processor has; without it the same
# formulas run in plain C++.
find_package(hwy QUIET)
option(HOLDFAST_WITH_HIGHWAY "Vectorise the fit with Highway" ${hwy_FOUND})
if(HOLDFAST_WITH_HIGHWAY)
  find_package(hwy REQUIRED)
endif()

find_package(benchmark QUIET)
if(benchmark_FOUND AND PROJECT_IS_TOP_LEVEL)
  option(HOLDFAST_BUILD_BENCHMARKS "Build holdfast_benchmark" ON)
else()
  option(HOLDFAST_BUILD_BENCHMARKS "Build holdfast_benchmark" OFF)
endif()

# ---- pcl: the classes beside PCL's, files, and all programs ----

# Asking for more components (features, io, surface, segmentation) would pull in VTK
# and Qt. What we use of pcl_segmentation needs neither, so it is linked by name.
set(HOLDFAST_CLOUDS_COMPONENTS common kdtree search octree)
set(HOLDFAST_PCL_COMPONENTS ${HOLDFAST_CLOUDS_COMPONENTS} sample_consensus filters)
if(NOT DEFINED HOLDFAST_WITH_PCL)
  find_package(PCL 1.12 QUIET COMPONENTS ${HOLDFAST_PCL_COMPONENTS})
endif()
option(HOLDFAST_WITH_PCL "Classes for PCL, files, programs" ${PCL_FOUND})
if(NOT HOLDFAST_WITH_PCL)
  # Plain variables, which go before the options of the same names.
  foreach(part BUILD_APPS BUILD_SAMPLES BUILD_BENCHMARKS BUILD_EXPERIMENTS
      WITH_HDF5 WITH_OPENNI2 WITH_VIEWER WITH_PYTHON)
    set(HOLDFAST_${part} OFF)
  endforeach()
  return()
endif()

find_package(PCL 1.12 REQUIRED COMPONENTS ${HOLDFAST_PCL_COMPONENTS})
find_library(HOLDFAST_PCL_SEGMENTATION_LIBRARY pcl_segmentation
  HINTS ${PCL_LIBRARY_DIRS} REQUIRED)
mark_as_advanced(HOLDFAST_PCL_SEGMENTATION_LIBRARY)

find_package(fmt 8 REQUIRED)
find_package(nlohmann_json 3.10 REQUIRED)
find_package(PNG REQUIRED)
find_package(yaml-cpp REQUIRED)

# Live cameras and .oni recordings.
find_package(PkgConfig QUIET)
if(PkgConfig_FOUND)
  pkg_check_modules(OPENNI2 QUIET IMPORTED_TARGET libopenni2)
endif()
option(HOLDFAST_WITH_OPENNI2 "Clouds from cameras through OpenNI2" ${OPENNI2_FOUND})
if(HOLDFAST_WITH_OPENNI2 AND NOT OPENNI2_FOUND)
  message(FATAL_ERROR "HOLDFAST_WITH_OPENNI2 needs pkg-config and libopenni2-dev")
endif()

# The window of `holdfast live --view`. Not looked for where it is not wanted: finding
# VTK takes seconds.
if(NOT DEFINED HOLDFAST_WITH_VIEWER OR HOLDFAST_WITH_VIEWER)
  find_package(VTK QUIET COMPONENTS CommonCore CommonDataModel RenderingCore)
  find_package(X11 QUIET)
  if(VTK_FOUND AND X11_FOUND)
    set(viewer_found ON)
  else()
    set(viewer_found OFF)
  endif()
  option(HOLDFAST_WITH_VIEWER "A window for holdfast live" ${viewer_found})
endif()

# The Python module, for the Python that has numpy and pybind11: Debian's, where another
# one comes first in the path.
if(NOT HOLDFAST_QUICKSTART AND (NOT DEFINED HOLDFAST_WITH_PYTHON OR HOLDFAST_WITH_PYTHON))
  include(HoldfastPython)
endif()

# Columns of `holdfast collect`. Not looked for where they are not wanted.
if(NOT DEFINED HOLDFAST_WITH_HDF5 OR HOLDFAST_WITH_HDF5)
  find_package(HDF5 1.10 QUIET COMPONENTS C)
  option(HOLDFAST_WITH_HDF5 "Data sets in columns" ${HDF5_FOUND})
  if(HOLDFAST_WITH_HDF5 AND NOT HDF5_FOUND)
    message(FATAL_ERROR "HOLDFAST_WITH_HDF5 needs libhdf5-dev 1.10 or newer")
  endif()
endif()

if(HOLDFAST_BUILD_APPS)
  find_package(CLI11 REQUIRED)
endif()

# PCL's own estimates, readers and writers, which programs, samples, tests and benchmarks
# compare ours with or use beside them.
if(HOLDFAST_BUILD_EXPERIMENTS OR HOLDFAST_BUILD_TESTS OR HOLDFAST_BUILD_BENCHMARKS OR
    HOLDFAST_BUILD_SAMPLES)
  find_library(HOLDFAST_PCL_FEATURES_LIBRARY pcl_features HINTS ${PCL_LIBRARY_DIRS}
    REQUIRED)
  find_library(HOLDFAST_PCL_IO_LIBRARY pcl_io HINTS ${PCL_LIBRARY_DIRS} REQUIRED)
  mark_as_advanced(HOLDFAST_PCL_FEATURES_LIBRARY HOLDFAST_PCL_IO_LIBRARY)
endif()
