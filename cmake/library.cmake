# plumbline_library(NAME SOURCES file... LINKS target...)
# One library a folder. Its headers live in FOLDER/include/FOLDER, and that root reaches only those that link the
# library: a header of a layer that a target does not depend on cannot be included (tests/layers_test.cmake).
function(plumbline_library name)
  cmake_parse_arguments(ARG "" "" "SOURCES;LINKS" ${ARGN})
  add_library(plumbline_${name} STATIC ${ARG_SOURCES})
  add_library(plumbline::${name} ALIAS plumbline_${name})
  set_target_properties(plumbline_${name} PROPERTIES EXPORT_NAME ${name})
  target_include_directories(
    plumbline_${name} PUBLIC $<BUILD_INTERFACE:${CMAKE_CURRENT_SOURCE_DIR}/include>
                             $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}/plumbline>)
  target_link_libraries(plumbline_${name} PUBLIC ${ARG_LINKS} PRIVATE plumbline_options)
  install(TARGETS plumbline_${name} EXPORT plumbline ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
  install(DIRECTORY include/ DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/plumbline)
endfunction()
