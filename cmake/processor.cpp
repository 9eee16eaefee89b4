// Prints the widest instruction set of kernels that this processor runs, for cmake/Kernels.cmake.
#include <cstdio>

#include "core/packs/instruction_sets.h"

int main() { std::fputs(sheetbend::runs_v4() ? "v4" : sheetbend::runs_v3() ? "v3" : "portable", stdout); }
