# Each layer reaches only the headers it may include (docs/conventions.md, "Layers"): a forbidden include must not
# compile, an allowed one must. Run as: cmake -DCOMPILER=... -DSOURCE_DIR=... -P layers_test.cmake
set(roots_core core/include)
set(roots_sim core/include sim/include)
set(roots_factors core/include estimator/factors/include)
set(roots_eval core/include sim/include estimator/factors/include eval/include)
set(roots_estimator core/include estimator/factors/include estimator/include)

function(expect layer header compiles)
  set(flags "")
  foreach(root ${roots_${layer}})
    list(APPEND flags -I${SOURCE_DIR}/${root})
  endforeach()
  file(WRITE ${BINARY_DIR}/layers_probe.cc "#include \"${header}\"\n")
  execute_process(
    COMMAND ${COMPILER} -std=c++20 -fsyntax-only ${flags} -isystem /usr/include/eigen3 ${BINARY_DIR}/layers_probe.cc
    RESULT_VARIABLE result
    ERROR_VARIABLE error
    OUTPUT_QUIET)
  if(result EQUAL 0)
    set(did TRUE)
  else()
    set(did FALSE)
  endif()
  if(NOT did STREQUAL compiles)
    message(SEND_ERROR "${layer} including ${header}: compiled ${did}, expected ${compiles}\n${error}")
  endif()
endfunction()

expect(core core/time.h TRUE)
expect(core sim/trajectory.h FALSE)
expect(core estimator/estimate.h FALSE)
expect(sim core/time.h TRUE)
expect(sim estimator/estimate.h FALSE)
expect(sim eval/alignment.h FALSE)
expect(factors core/time.h TRUE)
expect(factors estimator/batch.h FALSE)
expect(estimator estimator/triangulation.h TRUE)
expect(estimator sim/ground_truth.h FALSE)
expect(estimator eval/alignment.h FALSE)
expect(eval estimator/factors/imu_factor.h TRUE)
expect(eval estimator/batch.h FALSE)

# The roots above are those of the build: what the targets' compile commands name.
file(STRINGS ${BINARY_DIR_TOP}/compile_commands.json commands REGEX "\"command\":")
foreach(command ${commands})
  foreach(layer core sim estimator)
    if(command MATCHES " -c ${SOURCE_DIR}/${layer}/")
      if(layer STREQUAL core)
        set(forbidden sim estimator eval tools)
      elseif(layer STREQUAL sim)
        set(forbidden estimator eval tools)
      else()
        set(forbidden sim eval tools)
      endif()
      foreach(other ${forbidden})
        if(command MATCHES "-I${SOURCE_DIR}/${other}/")
          message(SEND_ERROR "the include root of ${other} is given to ${layer}: ${command}")
        endif()
      endforeach()
    endif()
  endforeach()
endforeach()

# No way around the roots.
file(GLOB_RECURSE sources ${SOURCE_DIR}/core/*.h ${SOURCE_DIR}/core/*.cc ${SOURCE_DIR}/sim/*.h ${SOURCE_DIR}/sim/*.cc
     ${SOURCE_DIR}/estimator/*.h ${SOURCE_DIR}/estimator/*.cc ${SOURCE_DIR}/eval/*.h ${SOURCE_DIR}/eval/*.cc
     ${SOURCE_DIR}/tools/*.h ${SOURCE_DIR}/tools/*.cc)
foreach(source ${sources})
  file(STRINGS ${source} includes REGEX "^#include +[\"<][^\">]*\\.\\./")
  if(includes)
    message(SEND_ERROR "${source}: ${includes}")
  endif()
endforeach()
