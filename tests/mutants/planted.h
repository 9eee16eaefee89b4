// Which mutant a run has: the environment names one of those in plant.cmake, or none.
#pragma once

#include <cstdlib>
#include <string_view>

inline bool planted(std::string_view mutant) {
  static const char* const name = std::getenv("SHEETBEND_MUTANT");
  return name && name == mutant;
}
