# holdfast_core.pc, holdfast_clouds.pc and holdfast_pcl.pc beside the CMake package, for
# who builds without CMake. Moved with the prefix, as the CMake package is.
file(RELATIVE_PATH up_to_prefix /prefix/${CMAKE_INSTALL_LIBDIR}/pkgconfig /prefix)
string(REGEX REPLACE "/$" "" up_to_prefix "${up_to_prefix}")

set(requires_core "eigen3 >= 3.4")
set(requires_clouds "holdfast_core = ${PROJECT_VERSION}")
foreach(part IN LISTS HOLDFAST_CLOUDS_COMPONENTS)
  string(APPEND requires_clouds ", pcl_${part}")
endforeach()
set(requires_pcl "holdfast_clouds = ${PROJECT_VERSION}")
foreach(part IN LISTS HOLDFAST_PCL_COMPONENTS)
  string(APPEND requires_pcl ", pcl_${part}")
endforeach()

foreach(component IN LISTS components)
  set(requires "${requires_${component}}")
  configure_file(${PROJECT_SOURCE_DIR}/cmake/holdfast.pc.in
    ${PROJECT_BINARY_DIR}/holdfast_${component}.pc @ONLY)
  install(FILES ${PROJECT_BINARY_DIR}/holdfast_${component}.pc
    DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig COMPONENT dev)
endforeach()
