# The kernel_table.cpp of core/points, core/blocks, adjoint/packs and adjoint/blocks, once per instruction set; core/packs/choose.cpp takes one at
# run time.
# Renaming the namespace keeps the variants' templates and inline functions apart.
set(variants portable)
# Sanitizers need minutes per instruction set: there is one.
if(CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64|AMD64" AND NOT SHEETBEND_SANITIZE AND NOT SHEETBEND_PORTABLE_KERNELS)
  list(APPEND variants v2 v3 v4)
  set_source_files_properties(core/packs/choose.cpp PROPERTIES COMPILE_DEFINITIONS SHEETBEND_X86_KERNELS)
endif()
# Kernels are inlined as a whole: what is passed through memory costs more than what is computed, and gcc's own limits stop short of that. Those
# of blocks compute with whole packs; where a register holds two lanes of eight, inlining them takes minutes.
set(inlined_whole)
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND NOT SHEETBEND_SANITIZE)
  foreach(limit max-inline-insns-auto max-inline-insns-single max-inline-insns-small large-function-growth
                inline-unit-growth large-unit-insns large-stack-frame large-stack-frame-growth)
    list(APPEND inlined_whole --param=${limit}=100000)
  endforeach()
endif()
set_source_files_properties(adjoint/packs/kernel_table.cpp PROPERTIES COMPILE_OPTIONS "${inlined_whole}")

set(kernel_objects)
foreach(variant IN LISTS variants)
  set(name ${variant})
  add_library(sheetbend_kernels_${variant} OBJECT core/points/kernel_table.cpp core/blocks/kernel_table.cpp
              adjoint/packs/kernel_table.cpp adjoint/blocks/kernel_table.cpp)
  target_include_directories(sheetbend_kernels_${variant} PRIVATE ${PROJECT_SOURCE_DIR})
  if(NOT variant STREQUAL "portable")
    set(name x86-64-${variant})
    target_compile_options(sheetbend_kernels_${variant} PRIVATE -march=${name})
  endif()
  if(NOT SHEETBEND_SANITIZE)
    target_compile_options(sheetbend_kernels_${variant} PRIVATE -O3)
  endif()
  if(variant MATCHES "v3|v4")
    target_compile_options(sheetbend_kernels_${variant} PRIVATE ${inlined_whole})
  endif()
  target_compile_definitions(sheetbend_kernels_${variant} PRIVATE sheetbend=sheetbend_${variant} SHEETBEND_VARIANT=${variant}
                                                          SHEETBEND_VARIANT_NAME="${name}")
  list(APPEND kernel_objects $<TARGET_OBJECTS:sheetbend_kernels_${variant}>)
endforeach()
