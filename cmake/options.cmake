# Compile options of every target of ours. -ffp-contract=off keeps the figures the same whether or not the
# processor can fuse a multiplication and an addition.
set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)

option(PLUMBLINE_TESTS "Build the tests" ON)
option(PLUMBLINE_BENCHMARKS "Build the benchmarks (Google Benchmark)" ON)
option(PLUMBLINE_FUZZERS "Build the fuzzers (clang only)" OFF)
set(PLUMBLINE_SANITIZE "" CACHE STRING "Sanitizers, as for -fsanitize: address,undefined or thread")

add_library(plumbline_options INTERFACE)
target_compile_options(plumbline_options INTERFACE -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wno-sign-conversion
                                                   -Werror -ffp-contract=off)
if(PLUMBLINE_SANITIZE)
  target_compile_options(plumbline_options INTERFACE -fsanitize=${PLUMBLINE_SANITIZE} -fno-sanitize-recover=all
                                                     -fno-omit-frame-pointer)
  if(CMAKE_CXX_COMPILER_ID STREQUAL "Clang")
    # Undefined behaviour inside the headers of other projects is not ours to find; addresses are checked there too.
    target_compile_options(plumbline_options INTERFACE
      -fsanitize-ignorelist=${CMAKE_CURRENT_LIST_DIR}/undefined_behaviour_ignored.txt)
  endif()
  target_link_options(plumbline_options INTERFACE -fsanitize=${PLUMBLINE_SANITIZE})
endif()
install(TARGETS plumbline_options EXPORT plumbline)
