# cmake -DFOLDER=repository -DCOMMIT=text -DSOURCE=file.cpp -P WriteCommit.cmake: a source
# file that returns the commit of the repository (apps/commit.h), or COMMIT if that is not
# empty. Touched only where it changes, since it is asked for by every build.
if(NOT COMMIT)
  find_program(git git)
  # A folder inside another project's repository has no commit of its own.
  if(git AND EXISTS ${FOLDER}/.git)
    execute_process(COMMAND ${git} -C ${FOLDER} rev-parse --short=10 HEAD
      OUTPUT_VARIABLE COMMIT OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
    execute_process(COMMAND ${git} -C ${FOLDER} diff --quiet HEAD --
      RESULT_VARIABLE differs OUTPUT_QUIET ERROR_QUIET)
    if(COMMIT AND differs)
      string(APPEND COMMIT "+")
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
