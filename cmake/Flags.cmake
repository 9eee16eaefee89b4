# How everything here is compiled. The floating-point flags decide bits, so they are the same in the library, modules and tests.
set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_CXX_VISIBILITY_PRESET hidden)
set(CMAKE_VISIBILITY_INLINES_HIDDEN ON)
set(CMAKE_POSITION_INDEPENDENT_CODE ON)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)

# No contraction: a fused multiply-add would give other bits on other machines. math-errno blocks inlined square roots.
add_compile_options(-ffp-contract=off -fno-math-errno -Wall -Wextra)
# GCC notes that packs as wide as a vector register have no stable calling convention; none crosses a public interface.
add_compile_options(-Wno-psabi)
# GCC looks for garbage from 128 MB on, which takes 5 to 10 % of its time; from 600 MB on it takes up to 220 MB more. Not with a compiler cache, where
# another option makes every entry useless.
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
  add_compile_options(--param=ggc-min-heapsize=600000)
endif()

option(SHEETBEND_WERROR "Warnings in our own files are errors" OFF)
if(SHEETBEND_WERROR)
  add_compile_options(-Werror)
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    add_compile_options(-Wno-error=maybe-uninitialized)  # gcc 12 says so of Eigen's matrices, and of arrays without elements
  endif()
endif()

if(SHEETBEND_SANITIZE)
  add_compile_options(-fsanitize=${SHEETBEND_SANITIZE} -fno-sanitize-recover=all -fno-omit-frame-pointer)
  add_link_options(-fsanitize=${SHEETBEND_SANITIZE})
endif()
