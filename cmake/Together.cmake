# What costs less where there is no compiler cache. A cache does better with units of their own that parse their headers themselves, so builds with one
# show that every unit includes what it uses.

# Headers that nearly every unit of a target reads are parsed once per target.
function(sheetbend_precompile target)
  if(NOT CMAKE_CXX_COMPILER_LAUNCHER)
    list(TRANSFORM ARGN PREPEND ${PROJECT_SOURCE_DIR}/)
    target_precompile_headers(${target} PRIVATE ${ARGN})
  endif()
endfunction()

# Up to `count` units of a target are compiled as one, so that what each instantiates of pybind11 or of the standard library is compiled once. Names in
# their unnamed namespaces have to differ.
function(sheetbend_compile_together target count)
  if(NOT CMAKE_CXX_COMPILER_LAUNCHER)
    set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE ${count})
  endif()
endfunction()

# The same of these sources, and of no others of the target.
function(sheetbend_compile_sources_together target count)
  if(CMAKE_CXX_COMPILER_LAUNCHER)
    return()
  endif()
  set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_MODE GROUP)
  list(GET ARGN 0 first)
  get_filename_component(name ${first} NAME_WE)
  set(number 0)
  foreach(source IN LISTS ARGN)
    math(EXPR group "${number} / ${count}")
    set_property(SOURCE ${source} PROPERTY UNITY_GROUP ${name}_${group})
    math(EXPR number "${number} + 1")
  endforeach()
endfunction()
