# The kernels, once per instruction set; core/packs/choose.cpp takes one of them at run time. Per set there are the tables (kernel_table.cpp in
# core/points, core/blocks, adjoint/packs and adjoint/blocks), with most kinds of constraint, and those kinds that core/constraints/cold_kinds.h
# names (cold_kinds.cpp in adjoint/packs and adjoint/blocks).
# Renaming the namespace keeps the variants' templates and inline functions apart.
set(variants portable)
set(has_x86_kernels FALSE)
if(CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64|AMD64")
  set(has_x86_kernels TRUE)
  # Sanitizers need minutes per instruction set: there is one.
  if(NOT SHEETBEND_SANITIZE AND NOT SHEETBEND_PORTABLE_KERNELS)
    list(APPEND variants v3 v4)
    set_source_files_properties(core/packs/choose.cpp PROPERTIES COMPILE_DEFINITIONS SHEETBEND_X86_KERNELS)
  endif()
endif()

# Kernels are inlined as a whole: what is passed through memory costs more than what is computed, and gcc's own limits stop short of that. Those
# of cold kinds stop at functions of a thousand instructions in colors, and in blocks, where less depends on it, at gcc's own limits.
set(inlined_whole)
set(inlined_in_part)
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND NOT SHEETBEND_SANITIZE)
  foreach(limit max-inline-insns-auto max-inline-insns-single max-inline-insns-small)
    list(APPEND inlined_whole --param=${limit}=100000)
    list(APPEND inlined_in_part --param=${limit}=1000)
  endforeach()
  foreach(limit large-function-growth inline-unit-growth large-unit-insns large-stack-frame large-stack-frame-growth)
    list(APPEND inlined_whole --param=${limit}=100000)
    list(APPEND inlined_in_part --param=${limit}=100000)
  endforeach()
endif()

set(kernel_objects)
set(kernel_libraries)
# An object library of one instruction set; `part` tells apart those that are compiled with other options.
function(sheetbend_add_kernels variant part)
  cmake_parse_arguments(PARSE_ARGV 2 kernels "" "" "SOURCES;OPTIONS")
  set(library sheetbend_kernels_${variant}_${part})
  set(name ${variant})
  add_library(${library} OBJECT ${kernels_SOURCES})
  target_include_directories(${library} PRIVATE ${PROJECT_SOURCE_DIR})
  if(NOT variant STREQUAL "portable")
    set(name x86-64-${variant})
    target_compile_options(${library} PRIVATE -march=${name})
  endif()
  if(NOT SHEETBEND_SANITIZE)
    target_compile_options(${library} PRIVATE ${kernels_OPTIONS})
  endif()
  target_compile_definitions(${library} PRIVATE sheetbend=sheetbend_${variant} SHEETBEND_VARIANT=${variant}
                                                SHEETBEND_VARIANT_NAME="${name}")
  set(kernel_objects ${kernel_objects} $<TARGET_OBJECTS:${library}> PARENT_SCOPE)
  set(kernel_libraries ${kernel_libraries} ${library} PARENT_SCOPE)
endfunction()

set(packs adjoint/packs/kernel_table.cpp)
set(blocks core/points/kernel_table.cpp core/blocks/kernel_table.cpp adjoint/blocks/kernel_table.cpp)
set(cold_packs adjoint/packs/cold_kinds.cpp)
set(cold_blocks adjoint/blocks/cold_kinds.cpp)
foreach(variant IN LISTS variants)
  if(NOT variant STREQUAL "portable")
    sheetbend_add_kernels(${variant} tables SOURCES ${packs} ${blocks} OPTIONS -O3 ${inlined_whole})
    sheetbend_add_kernels(${variant} cold SOURCES ${cold_packs} OPTIONS -O3 ${inlined_in_part})
    sheetbend_add_kernels(${variant} cold_blocks SOURCES ${cold_blocks} OPTIONS -O3)
  elseif(has_x86_kernels)
    # Processors without AVX2, and builds that are to be quick.
    sheetbend_add_kernels(${variant} tables SOURCES ${packs} ${blocks} ${cold_packs} ${cold_blocks} OPTIONS -O2)
  else()
    # Kernels of blocks compute with whole packs; where a register holds two lanes of eight, inlining them takes minutes.
    sheetbend_add_kernels(${variant} packs SOURCES ${packs} OPTIONS -O3 ${inlined_whole})
    sheetbend_add_kernels(${variant} blocks SOURCES ${blocks} ${cold_packs} ${cold_blocks} OPTIONS -O3)
  endif()
endforeach()
