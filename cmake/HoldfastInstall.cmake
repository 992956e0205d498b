# What a user of the libraries gets, and how find_package(holdfast) finds it.
include(CMakePackageConfigHelpers)

set(config_dir ${CMAKE_INSTALL_LIBDIR}/cmake/holdfast)

set(components core)
if(HOLDFAST_WITH_PCL)
  list(APPEND components clouds)
  if(TARGET holdfast_pcl)
    list(APPEND components pcl)
  endif()
else()
  set(not_built REGEX "holdfast/(pcl|io)$" EXCLUDE)
endif()
if(NOT HOLDFAST_WITH_OPENNI2)
  list(APPEND not_built PATTERN openni2_grabber.h EXCLUDE)
endif()
install(DIRECTORY ${PROJECT_SOURCE_DIR}/include/ ${PROJECT_BINARY_DIR}/include/
  DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT dev ${not_built})
install(DIRECTORY ${PROJECT_SOURCE_DIR}/config
  DESTINATION ${CMAKE_INSTALL_DATADIR}/holdfast COMPONENT lib)
install(FILES ${PROJECT_SOURCE_DIR}/LICENSE
  DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT dev)
# The pages, and the samples that they speak of; not the tables of long runs.
install(FILES ${PROJECT_SOURCE_DIR}/README.md ${PROJECT_SOURCE_DIR}/CHANGELOG.md
  DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT dev)
install(DIRECTORY ${PROJECT_SOURCE_DIR}/doc ${PROJECT_SOURCE_DIR}/samples
  DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT dev
  PATTERN experiments EXCLUDE
  PATTERN quickstart.sh EXCLUDE)
if(TARGET holdfast)
  install(TARGETS holdfast COMPONENT program)
  foreach(module holdfast_viewer holdfast_columns holdfast_comparison)
    if(TARGET ${module})
      install(TARGETS ${module}
        DESTINATION ${CMAKE_INSTALL_LIBDIR}/holdfast COMPONENT program)
    endif()
  endforeach()
endif()
include(HoldfastManPages)

# One export set per component: core must be usable where PCL is not installed.
foreach(component IN LISTS components)
  install(TARGETS holdfast_${component} EXPORT holdfast_${component}Targets
    RUNTIME COMPONENT lib
    LIBRARY COMPONENT lib NAMELINK_COMPONENT dev
    ARCHIVE COMPONENT dev)
  install(EXPORT holdfast_${component}Targets
    NAMESPACE holdfast::
    DESTINATION ${config_dir}
    COMPONENT dev)
endforeach()

include(HoldfastPkgConfig)

list(JOIN HOLDFAST_PCL_COMPONENTS " " holdfast_pcl_components)
list(JOIN HOLDFAST_CLOUDS_COMPONENTS " " holdfast_clouds_components)
configure_package_config_file(
  ${PROJECT_SOURCE_DIR}/cmake/holdfastConfig.cmake.in
  ${PROJECT_BINARY_DIR}/holdfastConfig.cmake
  INSTALL_DESTINATION ${config_dir})
# Before version 1 every minor version may change the interface.
write_basic_package_version_file(
  ${PROJECT_BINARY_DIR}/holdfastConfigVersion.cmake
  COMPATIBILITY SameMinorVersion)
install(FILES
  ${PROJECT_BINARY_DIR}/holdfastConfig.cmake
  ${PROJECT_BINARY_DIR}/holdfastConfigVersion.cmake
  DESTINATION ${config_dir} COMPONENT dev)
