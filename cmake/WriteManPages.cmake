# cmake -DPROGRAM=holdfast -DFOLDER=man1 -DVERSION=0.1.0 -P WriteManPages.cmake: a page for
# the program and one for each of its commands, from what their --help says, so that there
# is one text of each option. Compressed where gzip is installed, as packages want them.
function(help_of result)
  execute_process(COMMAND ${PROGRAM} ${ARGN} --help
    OUTPUT_VARIABLE text RESULT_VARIABLE failed ERROR_VARIABLE error)
  if(failed)
    message(FATAL_ERROR "${PROGRAM} ${ARGN} --help: ${failed} ${error}")
  endif()
  # It names itself by where it was built.
  string(REPLACE "${PROGRAM}" "holdfast" text "${text}")
  set(${result} "${text}" PARENT_SCOPE)
endfunction()

function(escape result text)
  string(REPLACE "\\" "\\e" text "${text}")
  string(REPLACE "-" "\\-" text "${text}")
  # A dot or quote at the beginning of a line would be a request.
  string(REGEX REPLACE "(^|\n)([.'])" "\\1\\\\&\\2" text "${text}")
  set(${result} "${text}" PARENT_SCOPE)
endfunction()

# \param one_line what it is for, for the index of pages
function(write_page name one_line help see_also)
  escape(help "${help}")
  escape(one_line "${one_line}")
  escape(title "${name}")
  string(TOUPPER "${name}" upper)
  set(page ".TH ${upper} 1 \"\" \"holdfast ${VERSION}\" \"User Commands\"
.SH NAME
${title} \\- ${one_line}
.SH DESCRIPTION
.nf
${help}
.fi
.SH SEE ALSO
${see_also}
")
  file(WRITE ${FOLDER}/${name}.1 "${page}")
  if(GZIP_PROGRAM)
    execute_process(COMMAND ${GZIP_PROGRAM} -9nf ${FOLDER}/${name}.1
      COMMAND_ERROR_IS_FATAL ANY)
  endif()
endfunction()

find_program(GZIP_PROGRAM gzip)
file(REMOVE_RECURSE ${FOLDER})
file(MAKE_DIRECTORY ${FOLDER})
help_of(help)
# Lines "  name    what it does" of the list of commands, up to the next empty line.
if(NOT help MATCHES "Subcommands:\n(([^\n]+\n)+)")
  message(FATAL_ERROR "no list of commands in ${PROGRAM} --help")
endif()
string(REPLACE ";" "," lines "${CMAKE_MATCH_1}") # one list entry per line
string(REGEX MATCHALL "(^|\n)  [a-z]+ +[^\n]+" lines "\n${lines}")
set(pages "")
foreach(line IN LISTS lines)
  string(REGEX MATCH "  ([a-z]+) +([^\n]+)" line "${line}")
  set(command "${CMAKE_MATCH_1}")
  set(what "${CMAKE_MATCH_2}")
  help_of(command_help ${command})
  write_page(holdfast-${command} "${what}" "${command_help}" ".BR holdfast (1)")
  list(APPEND pages ".BR holdfast\\-${command} (1)")
endforeach()
list(JOIN pages ",\n" pages)
write_page(holdfast "bounded curved contact patches from depth clouds" "${help}" "${pages}")
