# Headers that nearly every unit of a target reads are parsed once per target. Compiler caches and precompiled headers do not go together, so builds
# with a cache show that every unit includes what it uses.
function(sheetbend_precompile target)
  if(NOT CMAKE_CXX_COMPILER_LAUNCHER)
    list(TRANSFORM ARGN PREPEND ${PROJECT_SOURCE_DIR}/)
    target_precompile_headers(${target} PRIVATE ${ARGN})
  endif()
endfunction()
