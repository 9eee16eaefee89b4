// Which instruction sets this processor runs: asked at run time by choose.cpp, and by CMake when it chooses what to compile (cmake/Kernels.cmake).
#pragma once

#include <vector>

namespace sheetbend {

// Those that kernels are compiled for in this build, widest first, whether this processor runs them or not.
std::vector<const char*> compiled_instruction_sets();

#ifdef __x86_64__
inline bool runs_v3() {
  __builtin_cpu_init();
  return __builtin_cpu_supports("popcnt") && __builtin_cpu_supports("avx2") && __builtin_cpu_supports("bmi") &&
         __builtin_cpu_supports("bmi2") && __builtin_cpu_supports("fma");
}

inline bool runs_v4() {
  return runs_v3() && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
         __builtin_cpu_supports("avx512cd") && __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl");
}
#endif

}  // namespace sheetbend
