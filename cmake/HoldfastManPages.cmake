# Man pages, made by the program that they are of as soon as it is built; not where it
# cannot run, and not for a first look.
if(NOT TARGET holdfast OR HOLDFAST_QUICKSTART OR CMAKE_CROSSCOMPILING OR NOT UNIX)
  return()
endif()
set(man_folder ${PROJECT_BINARY_DIR}/man1)
set(man_script ${PROJECT_SOURCE_DIR}/cmake/WriteManPages.cmake)
add_custom_command(OUTPUT ${man_folder}.stamp
  COMMAND ${CMAKE_COMMAND} -DPROGRAM=$<TARGET_FILE:holdfast> -DFOLDER=${man_folder}
    -DVERSION=${PROJECT_VERSION} -P ${man_script}
  COMMAND ${CMAKE_COMMAND} -E touch ${man_folder}.stamp
  DEPENDS holdfast ${man_script}
  COMMENT "Man pages")
add_custom_target(holdfast_man ALL DEPENDS ${man_folder}.stamp)
install(DIRECTORY ${man_folder}/ DESTINATION ${CMAKE_INSTALL_MANDIR}/man1
  COMPONENT program)
