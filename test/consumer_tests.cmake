# Installs the project beside the tests and uses it from there, as others will.
set(prefix ${scratch_dir}/prefix)

add_test(NAME install
  COMMAND ${CMAKE_COMMAND} --install ${PROJECT_BINARY_DIR} --prefix ${prefix})
set_tests_properties(install PROPERTIES FIXTURES_SETUP installed)

if(TARGET holdfast)
  add_test(NAME installed_program COMMAND ${prefix}/${CMAKE_INSTALL_BINDIR}/holdfast --version)
  set_tests_properties(installed_program PROPERTIES
    FIXTURES_REQUIRED installed
    PASS_REGULAR_EXPRESSION "${PROJECT_VERSION}")
endif()

# A program that uses a library with sanitizers needs them as well.
set(sanitizer_flag "")
if(HOLDFAST_SANITIZE)
  list(JOIN HOLDFAST_SANITIZE "," sanitizer_flag)
  string(PREPEND sanitizer_flag -fsanitize=)
endif()

# The native one is the case that breaks when memory layouts differ between instruction
# sets: the library is always compiled for the baseline.
function(add_consumer_test name flags)
  set(folder ${scratch_dir}/${name})
  add_test(NAME ${name}
    COMMAND ${CMAKE_CTEST_COMMAND}
      --build-and-test ${CMAKE_CURRENT_SOURCE_DIR}/consumer ${folder}
      --build-generator ${CMAKE_GENERATOR}
      --build-noclean
      --build-options
        -DCMAKE_PREFIX_PATH=${prefix}
        -DCMAKE_BUILD_TYPE=Release
        -DCMAKE_CXX_COMPILER=${CMAKE_CXX_COMPILER}
        -DCMAKE_CXX_COMPILER_LAUNCHER=${CMAKE_CXX_COMPILER_LAUNCHER}
        "-DCMAKE_CXX_FLAGS=${flags} ${sanitizer_flag}"
        -DWITH_PCL=${HOLDFAST_WITH_PCL}
      --test-command ${CMAKE_CTEST_COMMAND} --output-on-failure)
  set_tests_properties(${name} PROPERTIES FIXTURES_REQUIRED installed TIMEOUT 600)
endfunction()

# Without CMake, by what pkg-config says.
find_program(HOLDFAST_PKG_CONFIG pkg-config)
mark_as_advanced(HOLDFAST_PKG_CONFIG)
if(HOLDFAST_PKG_CONFIG AND BUILD_SHARED_LIBS AND NOT HOLDFAST_SANITIZE)
  set(by_hand ${scratch_dir}/core_consumer_by_hand)
  set(moved ${prefix}/${CMAKE_INSTALL_LIBDIR})
  add_test(NAME consumer_pkg_config
    COMMAND sh -ec "flags=$(PKG_CONFIG_PATH=${moved}/pkgconfig ${HOLDFAST_PKG_CONFIG} --cflags --libs holdfast_core); ${CMAKE_CXX_COMPILER} -std=c++17 ${CMAKE_CURRENT_SOURCE_DIR}/consumer/core_consumer.cpp -o ${by_hand} $flags -Wl,-rpath,${moved}; ${by_hand}")
  set_tests_properties(consumer_pkg_config PROPERTIES
    FIXTURES_REQUIRED installed TIMEOUT 600)
endif()

if(TARGET holdfast_man)
  add_test(NAME packages
    COMMAND ${CMAKE_CURRENT_SOURCE_DIR}/support/check_packages.sh
      ${PROJECT_BINARY_DIR} ${scratch_dir}/debian)
  set_tests_properties(packages PROPERTIES SKIP_RETURN_CODE 77 TIMEOUT 1200)
endif()

add_consumer_test(consumer "")
add_consumer_test(consumer_native "-march=native")
