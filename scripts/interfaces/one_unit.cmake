# Makes interfaces quick to compile. CMake includes this at each package's project()
# (CMAKE_PROJECT_INCLUDE), so that the packages themselves are like those of others.

cmake_minimum_required(VERSION 3.19)

# One unit for all files of a library compiles in a tenth of the time. The descriptions of
# generator_c define static names that clash in one unit.
function(mavbridge_compile_in_one_unit)
  get_property(targets DIRECTORY PROPERTY BUILDSYSTEM_TARGETS)
  foreach(target IN LISTS targets)
    get_target_property(type ${target} TYPE)
    if(type STREQUAL "SHARED_LIBRARY")
      get_target_property(sources ${target} SOURCES)
      list(FILTER sources INCLUDE REGEX "__description\\.c$")
      set_source_files_properties(${sources} PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
      set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE 0)
    endif()
  endforeach()
endfunction()
cmake_language(DEFER CALL mavbridge_compile_in_one_unit)
