# cpack -G DEB: the libraries, what compiles against them, and the program.
set(CPACK_PACKAGE_NAME holdfast)
set(CPACK_PACKAGE_VENDOR "Holdfast contributors")
set(CPACK_PACKAGE_CONTACT "Holdfast contributors <holdfast@localhost>" CACHE STRING
  "Maintainer of packages, as Name <address>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "${PROJECT_DESCRIPTION}")
set(CPACK_RESOURCE_FILE_LICENSE ${PROJECT_SOURCE_DIR}/LICENSE)
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_COMPONENTS_ALL lib dev program)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)

set(soname_version ${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR})
set(CPACK_DEBIAN_LIB_PACKAGE_NAME libholdfast${soname_version})
set(CPACK_DEBIAN_LIB_PACKAGE_SECTION libs)
# Its files are found by ldconfig, and others may depend on exactly these.
set(CPACK_DEBIAN_LIB_PACKAGE_GENERATE_SHLIBS ON)
set(CPACK_COMPONENT_LIB_DESCRIPTION
  "Shared libraries and sensor files.\nThe core knows points and covariances; the others clouds, files and PCL.")

set(CPACK_DEBIAN_DEV_PACKAGE_NAME libholdfast-dev)
set(CPACK_DEBIAN_DEV_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEV_PACKAGE_SHLIBDEPS OFF)
set(CPACK_DEBIAN_DEV_PACKAGE_DEPENDS
  "${CPACK_DEBIAN_LIB_PACKAGE_NAME} (= ${PROJECT_VERSION}), libeigen3-dev")
if(HOLDFAST_WITH_PCL)
  string(APPEND CPACK_DEBIAN_DEV_PACKAGE_DEPENDS ", libpcl-dev")
endif()
set(CPACK_COMPONENT_DEV_DESCRIPTION
  "Headers, CMake package and samples.\nAlso the files that pkg-config reads.")

set(CPACK_DEBIAN_PROGRAM_PACKAGE_NAME holdfast)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_SECTION science)
# Its modules and it share symbols that the libraries do not promise to keep.
set(CPACK_DEBIAN_PROGRAM_PACKAGE_DEPENDS
  "${CPACK_DEBIAN_LIB_PACKAGE_NAME} (= ${PROJECT_VERSION})")
set(CPACK_COMPONENT_PROGRAM_DESCRIPTION
  "The program: fits, maps, reports and simulates.\nSensors and noise are measured by it as well.")

# The libraries of one package need the others of the same one.
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS ${PROJECT_BINARY_DIR}/src)
include(CPack)
