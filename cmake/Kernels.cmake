# The kernels, once per instruction set; core/packs/choose.cpp takes one of them at run time. Per set there are the tables (kernel_table.cpp in
# core/points, core/blocks, adjoint/packs, adjoint/blocks and adjoint/contact), and for every kind of constraint in core/constraints/registry.h one unit with its kernels in colors and
# one with those in blocks. These units are written here.
# Renaming the namespace keeps the variants' templates and inline functions apart.
#
# A build for this machine has the portable kernels and those of the widest set that its processor runs. Elsewhere it takes the portable ones where the
# processor lacks that set: results have the same bits, so it is right on every machine. What goes to other machines is built with all sets.
if(NOT SHEETBEND_KERNELS MATCHES "^(machine|all|portable)$")
  message(FATAL_ERROR "SHEETBEND_KERNELS: must be machine, all or portable (got '${SHEETBEND_KERNELS}').")
endif()
set(has_x86_kernels FALSE)
if(CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64|AMD64")
  set(has_x86_kernels TRUE)
endif()
set(variants portable)
if(NOT has_x86_kernels OR SHEETBEND_SANITIZE OR SHEETBEND_KERNELS STREQUAL "portable")
  # Sanitizers need minutes per instruction set: there is one.
elseif(SHEETBEND_KERNELS STREQUAL "all" OR CMAKE_CROSSCOMPILING)
  list(APPEND variants v3 v4)
else()
  # Asked again by each run of CMake, so that a build folder that another machine goes on with is right for it. The tests give an answer of their own.
  set(widest ${SHEETBEND_WIDEST_KERNELS})
  if(NOT widest)
    try_run(ran compiled SOURCES ${PROJECT_SOURCE_DIR}/cmake/processor.cpp NO_CACHE
            CMAKE_FLAGS -DINCLUDE_DIRECTORIES=${PROJECT_SOURCE_DIR} RUN_OUTPUT_VARIABLE widest CXX_STANDARD 20)
    if(NOT ran EQUAL 0)
      message(FATAL_ERROR "cmake/processor.cpp did not say what this processor runs. Fix: give -DSHEETBEND_KERNELS=all")
    endif()
  endif()
  list(APPEND variants ${widest})
  list(REMOVE_DUPLICATES variants)
endif()
list(JOIN variants ", " text)
message(STATUS "sheetbend: kernels ${text}")
foreach(variant IN LISTS variants)
  string(TOUPPER ${variant} text)
  set_property(SOURCE core/packs/choose.cpp APPEND PROPERTY COMPILE_DEFINITIONS SHEETBEND_KERNELS_${text})
endforeach()

# The kinds in the order of the registry, and of each its header and whether it says `hot = true` or `hot_in_blocks = true` (core/constraints/concept.h).
set(registry core/constraints/registry.h)
file(READ ${registry} text)
string(REGEX MATCH "using Registry = std::tuple<([^;]*)>;" text "${text}")
string(REGEX REPLACE "//[^\n]*" "" text "${CMAKE_MATCH_1}")
string(REGEX MATCHALL "[A-Za-z0-9_]+" kinds "${text}")
file(GLOB kind_headers RELATIVE ${PROJECT_SOURCE_DIR} CONFIGURE_DEPENDS core/constraints/*.h)
set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${registry})
foreach(header IN LISTS kind_headers)
  file(READ ${header} text)
  string(REPLACE ";" "," text "${text}")
  foreach(kind IN LISTS kinds)
    string(FIND "${text}" "\nstruct ${kind} " begin)
    if(begin EQUAL -1)
      continue()
    endif()
    string(SUBSTRING "${text}" ${begin} -1 own)
    string(FIND "${own}" "\n}," end)
    string(SUBSTRING "${own}" 0 ${end} own)
    set(header_of_${kind} ${header})
    set(hot_PackKernels_${kind} false)
    set(hot_BlockKernels_${kind} false)
    if(own MATCHES "static constexpr bool hot = true")
      set(hot_PackKernels_${kind} true)
    endif()
    if(own MATCHES "static constexpr bool hot(_in_blocks)? = true")
      set(hot_BlockKernels_${kind} true)
    endif()
    set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${header})
  endforeach()
endforeach()

# Writes a unit that instantiates Kernels<kind> from folder/kernels_of_kind.h, and appends it to the list `units`.
function(sheetbend_write_unit kind folder kernels units)
  if(NOT header_of_${kind})
    message(FATAL_ERROR "${registry} lists ${kind}, and no header in core/constraints defines 'struct ${kind}' at the start of a line.")
  endif()
  set(unit ${PROJECT_BINARY_DIR}/kinds/${folder}/${kind}.cpp)
  file(CONFIGURE OUTPUT ${unit} @ONLY CONTENT "// Made by cmake/Kernels.cmake.
#include \"@folder@/kernels_of_kind.h\"
#include \"${header_of_${kind}}\"

static_assert(sheetbend::@kernels@<sheetbend::@kind@>::hot == ${hot_${kernels}_${kind}}, \"say `hot` in the struct itself, so that CMake reads it\");
template struct sheetbend::@kernels@<sheetbend::@kind@>;
")
  set(${units} ${${units}} ${unit} PARENT_SCOPE)
endfunction()

set(hot_packs)
set(hot_blocks)
set(cold_packs)
set(cold_blocks)
foreach(kind IN LISTS kinds)
  foreach(part packs blocks)
    set(kernels PackKernels)
    if(part STREQUAL "blocks")
      set(kernels BlockKernels)
    endif()
    if(hot_${kernels}_${kind})
      sheetbend_write_unit(${kind} adjoint/${part} ${kernels} hot_${part})
    else()
      sheetbend_write_unit(${kind} adjoint/${part} ${kernels} cold_${part})
    endif()
  endforeach()
endforeach()

# Kernels of hot kinds are inlined as a whole: what is passed through memory costs more than what is computed, and gcc's own limits stop short of that.
# Those of the others stop at functions of a thousand instructions in colors, and in blocks, where less depends on it, at gcc's own limits: gcc
# compiles them faster and into half the bytes. Sweeps then take the same number of instructions forward and up to 2.8 times as many with the gradient;
# direct blocks up to 1.2 and 1.7 times as many.
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

# On x86-64-v3 gcc copies structs in pieces of 16 bytes, so a register that is loaded from such a copy waits for two stores. With pieces as wide as the
# registers, constraints on duals take down to a quarter of the time (docs/decisions/what-a-build-compiles.md).
include(CheckCXXCompilerFlag)
check_cxx_compiler_flag(-mmove-max=256 SHEETBEND_HAS_MOVE_MAX)
set(copies_v3)
if(SHEETBEND_HAS_MOVE_MAX)
  set(copies_v3 -mmove-max=256 -mstore-max=256)
endif()

set(kernel_objects)
set(kernel_libraries)
# An object library of one instruction set; `part` tells apart those that are compiled with other options.
function(sheetbend_add_kernels variant part)
  cmake_parse_arguments(PARSE_ARGV 2 kernels "" "COLD_VARIANT" "SOURCES;OPTIONS")
  set(library sheetbend_kernels_${variant}_${part})
  set(name ${variant})
  add_library(${library} OBJECT ${kernels_SOURCES})
  target_include_directories(${library} PRIVATE ${PROJECT_SOURCE_DIR})
  if(NOT variant STREQUAL "portable")
    set(name x86-64-${variant})
    target_compile_options(${library} PRIVATE -march=${name} ${copies_${variant}})
  endif()
  if(NOT SHEETBEND_SANITIZE)
    # They throw nothing and call nothing that throws, so nobody unwinds them: the tables for it are an eighth of the portable ones. Sanitizers
    # print stacks by these tables.
    target_compile_options(${library} PRIVATE ${kernels_OPTIONS} -fno-exceptions -fno-asynchronous-unwind-tables)
  endif()
  target_compile_definitions(${library} PRIVATE sheetbend=sheetbend_${variant} SHEETBEND_VARIANT=${variant}
                                                SHEETBEND_VARIANT_NAME="${name}")
  if(kernels_COLD_VARIANT)
    target_compile_definitions(${library} PRIVATE SHEETBEND_COLD_VARIANT=${kernels_COLD_VARIANT})
  endif()
  if(CMAKE_CXX_COMPILER_ID MATCHES "Clang")
    target_compile_options(${library} PRIVATE -Wno-undefined-var-template)  # they are defined in the units of the kinds
  endif()
  sheetbend_precompile(${library} adjoint/packs/kernels_of_kind.h adjoint/blocks/kernels_of_kind.h)
  set(kernel_objects ${kernel_objects} $<TARGET_OBJECTS:${library}> PARENT_SCOPE)
  set(kernel_libraries ${kernel_libraries} ${library} PARENT_SCOPE)
endfunction()

set(tables adjoint/packs/kernel_table.cpp adjoint/blocks/kernel_table.cpp adjoint/contact/kernel_table.cpp core/blocks/kernel_table.cpp core/points/kernel_table.cpp)
set(of_cold_kinds adjoint/packs/cold_kinds.cpp adjoint/blocks/cold_kinds.cpp)
# Precompiled headers would compile the kernels of every kind into them.
set_source_files_properties(${tables} ${of_cold_kinds} PROPERTIES SKIP_PRECOMPILE_HEADERS ON SKIP_UNITY_BUILD_INCLUSION ON)
# For hot kinds alone there is v4: the others take the kernels of v3 (docs/decisions/what-a-build-compiles.md).
if(NOT variants STREQUAL "portable")
  sheetbend_add_kernels(v3 cold_packs SOURCES ${cold_packs} OPTIONS -O3 ${inlined_in_part})
  sheetbend_add_kernels(v3 cold_blocks SOURCES ${of_cold_kinds} ${cold_blocks} OPTIONS -O3)
endif()
foreach(variant IN LISTS variants)
  if(variant STREQUAL "v4")
    sheetbend_add_kernels(v4 hot SOURCES ${tables} ${hot_packs} ${hot_blocks} OPTIONS -O3 ${inlined_whole} COLD_VARIANT v3)
  elseif(variant STREQUAL "v3")
    sheetbend_add_kernels(v3 hot SOURCES ${tables} ${hot_packs} ${hot_blocks} OPTIONS -O3 ${inlined_whole})
  elseif(has_x86_kernels)
    # Beside the others these serve processors without AVX2, and builds that were made on a machine with a wider set: those of cold kinds are to be small.
    # Alone they serve builds that are to be quick.
    set(level -Os)
    if(variants STREQUAL "portable")
      set(level -O1)
    endif()
    sheetbend_add_kernels(portable hot SOURCES ${tables} ${hot_packs} ${hot_blocks} OPTIONS -O1)
    sheetbend_add_kernels(portable cold SOURCES ${cold_packs} ${cold_blocks} OPTIONS ${level})
    sheetbend_compile_together(sheetbend_kernels_portable_hot 6)
    sheetbend_compile_together(sheetbend_kernels_portable_cold 6)
  else()
    # On other processors kernels of blocks keep gcc's own limits: what more of inlining brings there was not measured.
    sheetbend_add_kernels(portable packs SOURCES ${hot_packs} OPTIONS -O3 ${inlined_whole})
    sheetbend_add_kernels(portable blocks SOURCES ${tables} ${hot_blocks} ${cold_packs} ${cold_blocks} OPTIONS -O3)
  endif()
endforeach()
