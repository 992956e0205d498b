# What a first look does without, and what samples/quickstart.sh therefore does not
# compile: all but `holdfast fit` and `holdfast info`, the noise calibration, simulator,
# maps, contacts and evaluation, two covariance modes, vectors other than AVX2 and the
# plainest, and the library holdfast_pcl.

# Plain variables go before the options of the same names, and leave a later build in
# the same folder as it would have been.
if(HOLDFAST_QUICKSTART)
  foreach(part BUILD_TESTS BUILD_SAMPLES BUILD_BENCHMARKS BUILD_EXPERIMENTS
      WITH_HDF5 WITH_OPENNI2 WITH_VIEWER WITH_PYTHON)
    set(HOLDFAST_${part} OFF)
  endforeach()
  # Several sources at a time: half of what they take is the headers that they share.
  set(CMAKE_UNITY_BUILD ON)
  set(CMAKE_UNITY_BUILD_BATCH_SIZE 16)
endif()

set(quickstart_without
  src/simulation/ src/evaluation/ src/contact/ src/sensor/noise_calibration
  src/fusion/jet.cpp src/fusion/map_query src/fusion/measurement src/fusion/patch_map
  src/fusion/pattern_reach src/fusion/registration src/fusion/roughness
  src/fusion/support_grid
  src/sensor/pattern_calibration
  src/uncertainty/stagewise src/uncertainty/second_order
  src/pcl/frame_extraction src/pcl/frame_mapping src/pcl/map_conversions
  src/pcl/patch_points src/pcl/print
  src/io/patch_map_file src/io/foot_file src/io/atomic_folder src/io/range_frame
  src/io/trajectory_file
  apps/calibrate/ apps/collect/ apps/map/ apps/report/ apps/risk/ apps/simulate/
  apps/plot.cpp
  apps/result_input.cpp apps/risk_result.cpp
  # All but what images of --dense are drawn with.
  apps/render/render.cpp apps/render/render_scene apps/render/render_settings
  apps/render/patch_support apps/render/view apps/render/render_risk
  apps/render/risk_colors)
# What stands in for them where the rest calls them.
set(quickstart_instead src/uncertainty/quickstart/left_out_modes.cpp)

# Takes from a list of sources what the quick start does without.
function(holdfast_filter_sources list)
  set(kept ${${list}})
  if(HOLDFAST_QUICKSTART)
    foreach(part IN LISTS quickstart_without)
      list(FILTER kept EXCLUDE REGEX "^${PROJECT_SOURCE_DIR}/${part}")
    endforeach()
  endif()
  set(${list} ${kept} PARENT_SCOPE)
endfunction()
