# Data sets through the engine that the field's clusters run, where it is installed.
if(TARGET holdfast)
  add_test(NAME slurm_cluster
    COMMAND ${CMAKE_CURRENT_SOURCE_DIR}/cluster/run.sh $<TARGET_FILE:holdfast>
      ${scratch_dir}/slurm_cluster)
  set_tests_properties(slurm_cluster PROPERTIES
    SKIP_RETURN_CODE 77 TIMEOUT 900 PROCESSORS 2)
endif()
