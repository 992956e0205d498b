# The core of the node for ROS everywhere; the node where ROS is installed, a file of tests
# at a time, each with a master of its own.
if(TARGET test_ros_core)
  target_link_libraries(test_ros_core PRIVATE holdfast_ros_core)
endif()
if(NOT HOLDFAST_WITH_ROS OR NOT TARGET holdfast_node)
  return()
endif()
file(GLOB ros_tests CONFIGURE_DEPENDS ros/test_*.py)
foreach(source IN LISTS ros_tests)
  get_filename_component(name ${source} NAME_WE)
  string(REPLACE "test_" "ros_" name ${name})
  add_test(NAME ${name}
    COMMAND ${HOLDFAST_ROS_PYTHON} -m pytest --rootdir ${PROJECT_SOURCE_DIR}
      -p no:cacheprovider -q -rP ${source})
  set_tests_properties(${name} PROPERTIES TIMEOUT 1800 ENVIRONMENT
    "PYTHONPATH=${PROJECT_BINARY_DIR}/ros/python;PYTHONDONTWRITEBYTECODE=1;HOLDFAST_BUILD_DIR=${PROJECT_BINARY_DIR};HOLDFAST_SOURCE_DIR=${PROJECT_SOURCE_DIR};HOLDFAST_SCRATCH_DIR=${scratch_dir}")
endforeach()
