# The house itself: formatting, layers, set-up, pages and versions.
set(support ${CMAKE_CURRENT_SOURCE_DIR}/support)

add_test(NAME format COMMAND ${support}/check_format.sh)
set_tests_properties(format PROPERTIES SKIP_RETURN_CODE 77)

add_test(NAME include_direction COMMAND ${support}/check_includes.sh)

# A check that cannot fail is none: these two files break the rules.
set(bad_tree ${scratch_dir}/bad_tree)
file(WRITE ${bad_tree}/include/holdfast/fit/bad.h "#include <holdfast/sensor/camera.h>\n")
file(WRITE ${bad_tree}/src/geometry/bad.cpp "#  include <pcl/point_types.h>\n")
add_test(NAME include_direction_finds_violations
  COMMAND ${support}/check_includes.sh ${bad_tree})
set_tests_properties(include_direction_finds_violations PROPERTIES PASS_REGULAR_EXPRESSION
  "fit must not include sensor.*must not include <pcl|must not include <pcl.*fit must not include sensor")

add_test(NAME one_definition COMMAND ${support}/check_one_definition.py ${PROJECT_SOURCE_DIR})
file(WRITE ${bad_tree}/src/fit/placed.h "namespace holdfast {\nstruct Placed {\n};\n} // namespace holdfast\n")
file(WRITE ${bad_tree}/apps/placed.cpp "namespace holdfast {\nclass Placed : Base {\n};\n} // namespace holdfast\n")
add_test(NAME one_definition_finds_violations
  COMMAND ${support}/check_one_definition.py ${bad_tree})
set_tests_properties(one_definition_finds_violations PROPERTIES
  PASS_REGULAR_EXPRESSION "holdfast::Placed is defined in src/fit/placed.h and apps/placed.cpp|holdfast::Placed is defined in apps/placed.cpp and src/fit/placed.h")

# Every public header compiles alone, those of the core where PCL is not installed.
get_target_property(core_dirs Eigen3::Eigen INTERFACE_INCLUDE_DIRECTORIES)
set(header_dirs ${PROJECT_SOURCE_DIR}/include ${PROJECT_BINARY_DIR}/include)
# Named once more, the compiler's own folder would come behind those that wrap it.
set(pcl_dirs ${PCL_INCLUDE_DIRS})
list(REMOVE_ITEM pcl_dirs /usr/include)
# The helpers for PCL's viewer need VTK, and are left out where it was not looked for.
if(TARGET VTK::CommonCore)
  get_target_property(vtk_dirs VTK::CommonCore INTERFACE_INCLUDE_DIRECTORIES)
  list(APPEND pcl_dirs ${vtk_dirs})
endif()
add_test(NAME headers_compile_alone
  COMMAND ${support}/check_headers.sh ${CMAKE_CXX_COMPILER}
    "${header_dirs};${core_dirs}" "${pcl_dirs}")
set_tests_properties(headers_compile_alone PROPERTIES TIMEOUT 900)

# A header that leans on what others include is found.
file(WRITE ${bad_tree}/alone/holdfast/bad.h "inline std::string name();\n")
add_test(NAME headers_compile_alone_finds_violations
  COMMAND ${support}/check_headers.sh ${CMAKE_CXX_COMPILER} ${bad_tree}/alone "")
set_tests_properties(headers_compile_alone_finds_violations PROPERTIES
  PASS_REGULAR_EXPRESSION "holdfast/bad.h does not compile alone")

if(TARGET holdfast)
  add_test(NAME quick_start_of_the_program
    COMMAND ${support}/check_startup.sh $<TARGET_FILE:holdfast>)
  add_test(NAME quick_start_finds_violations
    COMMAND ${support}/check_startup.sh ${HOLDFAST_PCL_IO_LIBRARY})
  set_tests_properties(quick_start_finds_violations PROPERTIES
    PASS_REGULAR_EXPRESSION "loads .*libvtk")
endif()

add_test(NAME package_setup COMMAND ${support}/check_setup.sh)

if(TARGET holdfast AND NOT HOLDFAST_QUICKSTART)
  set(program_of_readme $<TARGET_FILE:holdfast> ${scratch_dir}/readme)
endif()
add_test(NAME readme COMMAND ${support}/check_readme.sh ${program_of_readme})

add_test(NAME links_of_pages COMMAND ${support}/check_links.sh)
set(bad_page ${scratch_dir}/bad_page)
file(WRITE ${bad_page}/page.md "# A heading\n[a](#a-heading) [b](#b) ![c](c.png)\n")
add_test(NAME links_of_pages_finds_violations COMMAND ${support}/check_links.sh ${bad_page})
set_tests_properties(links_of_pages_finds_violations PROPERTIES
  PASS_REGULAR_EXPRESSION "no heading for #b.*no c.png")

add_test(NAME versions COMMAND ${support}/check_versions.sh)

if(TARGET doc)
  add_test(NAME reference_pages
    COMMAND ${CMAKE_COMMAND} --build ${PROJECT_BINARY_DIR} --target doc)
endif()

if(HOLDFAST_BUILD_SAMPLES)
  add_test(NAME sample_first_patch
    COMMAND first_patch ${PROJECT_SOURCE_DIR}/samples/rocks.pcd)
  set_tests_properties(sample_first_patch PROPERTIES PASS_REGULAR_EXPRESSION
    "paraboloid  normal.*sigma")
endif()
