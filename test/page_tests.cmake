# The page of `holdfast report` in a browser, its glTF before a validator, and that the
# committed bundle is what its sources give. They skip where npm or chromium cannot be
# had.
if(NOT TARGET holdfast OR HOLDFAST_QUICKSTART)
  return()
endif()

set(run_page ${CMAKE_CURRENT_SOURCE_DIR}/report/run.sh)
add_test(NAME report_page
  COMMAND ${run_page} page_test.mjs ${scratch_dir}/report_packages)
add_test(NAME report_glb
  COMMAND ${run_page} glb_test.mjs ${scratch_dir}/report_packages)
add_test(NAME report_bundle
  COMMAND ${run_page} bundle ${scratch_dir}/report_bundle)
set_tests_properties(report_page report_glb report_bundle PROPERTIES
  SKIP_RETURN_CODE 77
  TIMEOUT 1800 # drawn in software, beside other work
  ENVIRONMENT "HOLDFAST_PROGRAM=$<TARGET_FILE:holdfast>;HOLDFAST_SOURCE_DIR=${PROJECT_SOURCE_DIR};HOLDFAST_SCRATCH_DIR=${scratch_dir}")
# Both install the same packages.
set_tests_properties(report_page report_glb PROPERTIES RESOURCE_LOCK report_packages)
