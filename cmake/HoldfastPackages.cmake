# cpack -G DEB: the packages that debian/control describes, made of what is built. Names,
# sections, dependencies and descriptions are read there.
file(READ ${PROJECT_SOURCE_DIR}/debian/control debian_control)

# The field of a stanza, with the lines that continue it.
function(holdfast_control_field result stanza field)
  set(value "")
  if(stanza MATCHES "\n${field}:[ ]*([^\n]*(\n [^\n]*)*)")
    set(value "${CMAKE_MATCH_1}")
  endif()
  set(${result} "${value}" PARENT_SCOPE)
endfunction()

holdfast_control_field(maintainer "${debian_control}" Maintainer)
set(CPACK_PACKAGE_NAME ${PROJECT_NAME})
set(CPACK_PACKAGE_VENDOR "Holdfast contributors")
set(CPACK_PACKAGE_CONTACT "${maintainer}" CACHE STRING
  "Maintainer of packages, as Name <address>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "") # each package has its own
set(CPACK_RESOURCE_FILE_LICENSE ${PROJECT_SOURCE_DIR}/LICENSE)
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
# The libraries of one package need the others of the same one.
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS ${PROJECT_BINARY_DIR}/src)

# Debian's name of the changelog of a package whose packaging is its own.
set(debian_changelog ${PROJECT_BINARY_DIR}/debian_changelog.gz)
file(ARCHIVE_CREATE OUTPUT ${debian_changelog} FORMAT raw COMPRESSION GZip
  COMPRESSION_LEVEL 9 PATHS ${PROJECT_SOURCE_DIR}/debian/changelog)

# A component of the installation as a package of debian/control.
function(holdfast_package component name)
  string(TOUPPER ${component} upper)
  if(NOT debian_control MATCHES "\nPackage: ${name}(\n[^\n]+)+")
    message(FATAL_ERROR "debian/control has no package ${name}")
  endif()
  set(stanza "${CMAKE_MATCH_0}")
  holdfast_control_field(section "${stanza}" Section)
  if(NOT section)
    holdfast_control_field(section "${debian_control}" Section)
  endif()
  holdfast_control_field(description "${stanza}" Description)
  # The first line and its indentation are put there by cpack.
  string(REGEX REPLACE "\n " "\n" description "${description}")
  string(REGEX REPLACE "\n[.](\n|$)" "\n\\1" description "${description}")

  holdfast_control_field(depends "${stanza}" Depends)
  string(REGEX REPLACE "[ \n]*,[ \n]*" ";" depends "${depends}")
  list(FILTER depends EXCLUDE REGEX "^\\\${(shlibs|misc):Depends}$")
  list(TRANSFORM depends REPLACE "\\\${binary:Version}" "${PROJECT_VERSION}")
  set(python3 "python3 (>= ${Python_VERSION_MAJOR}.${Python_VERSION_MINOR})")
  list(TRANSFORM depends REPLACE "\\\${python3:Depends}" "${python3}, python3-numpy")
  if(NOT HOLDFAST_WITH_PCL)
    list(REMOVE_ITEM depends libpcl-dev)
  endif()
  list(JOIN depends ", " depends)

  set(CPACK_DEBIAN_${upper}_PACKAGE_NAME ${name} PARENT_SCOPE)
  set(CPACK_DEBIAN_${upper}_PACKAGE_SECTION ${section} PARENT_SCOPE)
  set(CPACK_DEBIAN_${upper}_PACKAGE_DEPENDS "${depends}" PARENT_SCOPE)
  set(CPACK_DEBIAN_${upper}_DESCRIPTION "${description}" PARENT_SCOPE)
  set(CPACK_COMPONENTS_ALL ${CPACK_COMPONENTS_ALL} ${component} PARENT_SCOPE)
  set(documents ${CMAKE_INSTALL_DATADIR}/doc/${name})
  install(FILES ${PROJECT_SOURCE_DIR}/debian/copyright
    DESTINATION ${documents} COMPONENT ${component} EXCLUDE_FROM_ALL)
  install(FILES ${debian_changelog} RENAME changelog.gz
    DESTINATION ${documents} COMPONENT ${component} EXCLUDE_FROM_ALL)
  if(EXISTS ${PROJECT_SOURCE_DIR}/debian/${name}.lintian-overrides)
    install(FILES ${PROJECT_SOURCE_DIR}/debian/${name}.lintian-overrides RENAME ${name}
      DESTINATION ${CMAKE_INSTALL_DATADIR}/lintian/overrides
      COMPONENT ${component} EXCLUDE_FROM_ALL)
  endif()
endfunction()

set(CPACK_COMPONENTS_ALL "")
set(soname_version ${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR})
holdfast_package(lib libholdfast${soname_version})
holdfast_package(dev libholdfast-dev)
set(CPACK_DEBIAN_DEV_PACKAGE_SHLIBDEPS OFF)
# That ldconfig finds them, and what others that are linked with them depend on.
set(control ${PROJECT_BINARY_DIR}/debian_lib)
file(WRITE ${control}/triggers "activate-noawait ldconfig\n")
file(WRITE ${control}/shlibs "")
foreach(library IN ITEMS core clouds pcl)
  if(TARGET holdfast_${library})
    file(APPEND ${control}/shlibs
      "libholdfast_${library} ${soname_version} libholdfast${soname_version} (>= ${PROJECT_VERSION})\n")
  endif()
endforeach()
set(CPACK_DEBIAN_LIB_PACKAGE_CONTROL_EXTRA ${control}/triggers ${control}/shlibs)
if(TARGET holdfast)
  holdfast_package(program holdfast)
endif()
# A module is for the Python that it was built with; packages are for the system's.
if(HOLDFAST_WITH_PYTHON AND Python_EXECUTABLE MATCHES "^/usr/bin/")
  holdfast_package(module python3-holdfast)
  # What dh_python3 does: compiled at installation, and that removed with the package.
  set(scripts ${PROJECT_BINARY_DIR}/debian_python)
  file(CONFIGURE OUTPUT ${scripts}/postinst CONTENT "#!/bin/sh
set -e
if [ \"$1\" = configure ] && command -v py3compile >/dev/null 2>&1; then
  py3compile -p python3-holdfast
fi
")
  file(CONFIGURE OUTPUT ${scripts}/prerm CONTENT "#!/bin/sh
set -e
if command -v py3clean >/dev/null 2>&1; then
  py3clean -p python3-holdfast
else
  find /usr/lib/python3/dist-packages/holdfast -name __pycache__ -prune -exec rm -r {} +
fi
")
  file(CHMOD ${scripts}/postinst ${scripts}/prerm PERMISSIONS
    OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
  set(CPACK_DEBIAN_MODULE_PACKAGE_CONTROL_EXTRA ${scripts}/postinst ${scripts}/prerm)
endif()
include(CPack)
