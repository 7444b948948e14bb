cmake_minimum_required(VERSION 3.25)
# Writes OUTPUT with the version and the commit (git describe), touching it only where the text changed.
set(commit "unknown")
if(GIT_EXECUTABLE)
  execute_process(
    COMMAND ${GIT_EXECUTABLE} -C ${SOURCE_DIR} describe --always --dirty --abbrev=12
    OUTPUT_VARIABLE described
    OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET
    RESULT_VARIABLE failed)
  if(NOT failed)
    set(commit ${described})
  endif()
endif()
file(CONFIGURE OUTPUT ${OUTPUT} CONTENT "#define PLUMBLINE_VERSION \"@VERSION@\"\n#define PLUMBLINE_COMMIT \"@commit@\"\n" @ONLY)
