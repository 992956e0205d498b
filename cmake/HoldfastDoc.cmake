# The target doc: reference pages of the public headers; a warning is an error.
find_program(HOLDFAST_DOXYGEN doxygen)
mark_as_advanced(HOLDFAST_DOXYGEN)
if(HOLDFAST_DOXYGEN AND PROJECT_IS_TOP_LEVEL)
  configure_file(${PROJECT_SOURCE_DIR}/cmake/Doxyfile.in
    ${PROJECT_BINARY_DIR}/Doxyfile @ONLY)
  add_custom_target(doc
    COMMAND ${HOLDFAST_DOXYGEN} ${PROJECT_BINARY_DIR}/Doxyfile
    COMMENT "Reference pages in ${PROJECT_BINARY_DIR}/doc/html")
endif()
