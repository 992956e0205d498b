# cmake -DFOLDER=repository -DCOMMIT=text -DSOURCE=file.cpp -P WriteCommit.cmake: a source
# file that returns where in the history the sources are (apps/commit.h), or COMMIT if
# that is not empty. Touched only where it changes, since it is asked for by every build.
if(NOT COMMIT)
  find_program(git git)
  # A folder inside another project's repository has no commit of its own.
  if(git AND EXISTS ${FOLDER}/.git)
    execute_process(
      COMMAND ${git} -C ${FOLDER} describe --tags --match v[0-9]* --always --long --abbrev=10
      OUTPUT_VARIABLE COMMIT OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
    execute_process(COMMAND ${git} -C ${FOLDER} diff --quiet HEAD --
      RESULT_VARIABLE differs OUTPUT_QUIET ERROR_QUIET)
    if(COMMIT AND differs)
      string(APPEND COMMIT "+")
    endif()
  elseif(EXISTS ${FOLDER}/cmake/archive_commit.txt)
    # Filled in by git archive; the tag is missing where there is none.
    file(READ ${FOLDER}/cmake/archive_commit.txt filled_in)
    if(NOT filled_in MATCHES "[$]Format" AND filled_in MATCHES "[^\n]+")
      set(COMMIT ${CMAKE_MATCH_0})
    endif()
  endif()
endif()
set(text "#include \"commit.h\"

std::string
holdfast::app::commit()
{
  return \"${COMMIT}\";
}
")
if(EXISTS ${SOURCE})
  file(READ ${SOURCE} former)
endif()
if(NOT text STREQUAL former)
  file(WRITE ${SOURCE} "${text}")
endif()
